# Sourced by the end-to-end tests: a scratch folder, a tiny scene, a short training.
set -euo pipefail
bin=$1
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
"$bin/make-tiny-scene" "$scratch/scene"
device=()   # of what draws
[ -n "${TRISOUP_DEVICE:-}" ] && device=(--device "$TRISOUP_DEVICE")
compute=(--backend "${TRISOUP_BACKEND:-vulkan}" "${device[@]}")  # of what trains and measures
tiny=(--steps 60 --triangles 40 --init-count 120 --init-radius 0.2 --init-box 0.7 --set resample_every=20
  --checkpoint-every 10)
short=("${tiny[@]}" "${compute[@]}")
fail() {
  echo "FAIL: $*" >&2
  exit 1
}
psnr_of() { grep -o '"psnr": [0-9.]*' "$1" | tail -n 1 | cut -d' ' -f2; }  # psnr_of METRICS: the mean of the test views
# round_that_went_back RUN: the first round of simplifying that began with an older one's soup, if any.
round_that_went_back() {
  grep -o '"from": [0-9]*' "$1/metrics.json" | awk 'NR > 1 && $2 != NR - 2 { print NR - 1; exit }'
}

# The bits of a checkpoint: all but the seconds that it took, and the spaces that fill its header up.
state_of() {
  local header
  header=$(od -An -tu8 -N8 "$1" | tr -d ' ')
  { head -c $((8 + header)) "$1" | tail -c +9 | sed -E 's/"(cpu_)?seconds":"[^"]*"//g' |
    tr -d ' '; tail -c +$((9 + header)) "$1"; } | sha256sum
}
