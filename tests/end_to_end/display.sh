# Sourced by the tests of the window: a display of its own and synthetic keys.
for tool in Xvfb xdotool; do
  command -v $tool >/dev/null || { echo "$tool is missing: the window is not tested"; exit 77; }
done
trap 'kill $(jobs -p) 2>/dev/null; wait; rm -rf "$scratch"' EXIT

# open_display: an X server, DISPLAY set; its pixels stand in $scratch/Xvfb_screen0.
open_display() {
  rm -f "$scratch/display"
  # -noreset: without it the server starts over when its last client leaves, and drops the one that comes just then.
  Xvfb -noreset -displayfd 3 -screen 0 1024x768x24 -fbdir "$scratch" 3>"$scratch/display" 2>/dev/null &
  for _ in $(seq 100); do [ -s "$scratch/display" ] && break; sleep 0.1; done
  export DISPLAY=:$(cat "$scratch/display")
}

# await_window PROCESS NAME [TENTHS]: sets `window`; gives up after so many tenths of a second
await_window() {
  window=""
  for _ in $(seq "${3:-200}"); do
    window=$(xdotool search --name "$2" 2>/dev/null | tail -n 1) && [ -n "$window" ] && return 0
    kill -0 "$1" 2>/dev/null || fail "the window '$2' did not open: $(cat err)"
    sleep 0.1
  done
  fail "no window '$2': $(cat err)"
}

# press KEY...: to whatever window has the mouse
press() { xdotool mousemove 600 350 key --delay 60 "$@"; }

# close_window PROCESS: with its own key
close_window() {
  press ctrl+q
  for _ in $(seq 50); do kill -0 "$1" 2>/dev/null || break; sleep 0.1; done
  kill -0 "$1" 2>/dev/null && fail "Control Q does not close"
  wait "$1" || fail "the viewer ended with an error: $(cat err)"
  [ ! -s err ] || fail "it said: $(cat err)"
}
