# Sourced by the tests of the window: an X display of their own, and synthetic keys.
for tool in Xvfb xdotool; do
  command -v $tool >/dev/null || { echo "skipped: $tool is not installed"; exit 77; }
done
trap 'kill $(jobs -p) 2>/dev/null; wait; rm -rf "$scratch"' EXIT

# open_display: starts an X server and sets DISPLAY. The pixels of the screen are in $scratch/Xvfb_screen0.
open_display() {
  rm -f "$scratch/display"
  # Without -noreset the server restarts when its last client leaves, and drops a client that connects meanwhile.
  Xvfb -noreset -displayfd 3 -screen 0 1024x768x24 -fbdir "$scratch" 3>"$scratch/display" 2>/dev/null &
  for _ in $(seq 100); do [ -s "$scratch/display" ] && break; sleep 0.1; done
  export DISPLAY=:$(cat "$scratch/display")
}

# await_window PROCESS NAME [TENTHS]: waits for a window, at most TENTHS tenths of a second, and sets `window`.
await_window() {
  window=""
  for _ in $(seq "${3:-200}"); do
    window=$(xdotool search --name "$2" 2>/dev/null | tail -n 1) && [ -n "$window" ] && return 0
    kill -0 "$1" 2>/dev/null || fail "the window '$2' did not open: $(cat err)"
    sleep 0.1
  done
  fail "no window '$2': $(cat err)"
}

# press KEY...: sends keys to the window under the mouse.
press() { xdotool mousemove 600 350 key --delay 60 "$@"; }

# close_window PROCESS: closes the window with its keyboard shortcut.
close_window() {
  press ctrl+q
  for _ in $(seq 50); do kill -0 "$1" 2>/dev/null || break; sleep 0.1; done
  kill -0 "$1" 2>/dev/null && fail "Ctrl+Q does not close the window"
  wait "$1" || fail "the viewer ended with an error: $(cat err)"
  [ ! -s err ] || fail "the viewer printed: $(cat err)"
}
