# Sourced by the end-to-end tests: makes a scratch folder and a tiny scene, and sets the options of a short training.
set -euo pipefail
bin=$1
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
"$bin/make-tiny-scene" "$scratch/scene"
device=()   # options for programs that draw
[ -n "${TRISOUP_DEVICE:-}" ] && device=(--device "$TRISOUP_DEVICE")
compute=(--backend "${TRISOUP_BACKEND:-vulkan}" "${device[@]}")  # options for programs that train or measure
tiny=(--steps 60 --triangles 40 --init-count 120 --init-radius 0.2 --init-box 0.7 --set refine_every=20
  --checkpoint-every 10)
short=("${tiny[@]}" "${compute[@]}")
fail() {
  echo "FAIL: $*" >&2
  exit 1
}
# ... | has ARGUMENT...: as grep -q, but reads to the end: a writer that finds its pipe closed fails (pipefail).
has() { grep -c "$@" >/dev/null; }
# psnr_of METRICS: prints the mean PSNR of the test views.
psnr_of() { grep -m 1 -o '"psnr": [0-9.]*' "$1" | cut -d' ' -f2; }  # those of the views follow
# round_that_went_back RUN: prints the first round of simplification that started from an earlier round's soup, if any.
round_that_went_back() {
  grep -o '"from": [0-9]*' "$1/metrics.json" | awk 'NR > 1 && $2 != NR - 2 && !found++ { print NR - 1 }'
}

# state_of CHECKPOINT: prints a hash of the checkpoint without its times and the padding of its header.
state_of() {
  local header
  header=$(od -An -tu8 -N8 "$1" | tr -d ' ')
  {
    head -c $((8 + header)) "$1" | tail -c +9 | sed -E 's/"(cpu_)?seconds":"[^"]*"//g' | tr -d ' '
    tail -c +$((9 + header)) "$1"
  } | sha256sum
}
