// Style of <tri-soup>. A strict Content-Security-Policy allows constructed style sheets, but no style elements.
const STYLE = `
:host {
  display: block; position: relative; aspect-ratio: 16 / 9; overflow: hidden; touch-action: none; cursor: grab;
  user-select: none; -webkit-user-select: none; -webkit-tap-highlight-color: transparent
}
:host(:active) { cursor: grabbing }
:host([interaction=none]) { touch-action: auto; cursor: auto }
:host([hidden]) { display: none }
:host(:fullscreen) { width: 100vw; height: 100vh; aspect-ratio: auto; background: #000 }
:host(:focus-visible) { outline: 3px solid #4cf; outline-offset: -3px }
canvas, img { position: absolute; inset: 0; width: 100%; height: 100%; display: block }
img { object-fit: cover }
progress {
  position: absolute; left: 10%; bottom: 5%; width: 80%; height: 4px; appearance: none; border: 0; background: #8886
}
progress::-webkit-progress-bar { background: #8886 }
progress::-webkit-progress-value { background: #fffc }
progress::-moz-progress-bar { background: #fffc }
.message {
  position: absolute; left: 0; right: 0; bottom: 0; margin: 0; overflow-wrap: anywhere;
  padding: 0.75em max(1em, env(safe-area-inset-right)) max(0.75em, env(safe-area-inset-bottom))
    max(1em, env(safe-area-inset-left));
  font: 14px/1.4 system-ui, sans-serif; color: #fff; background: #000c
}
.message:not([hidden]) ~ .bar { display: none }
.hint {
  position: absolute; top: max(12px, env(safe-area-inset-top)); left: 50%; transform: translateX(-50%); margin: 0;
  width: max-content; max-width: calc(100% - 32px); box-sizing: border-box; padding: 8px 14px; border-radius: 8px;
  font: 14px/1.4 system-ui, sans-serif; color: #fff; background: #000c; overflow-wrap: anywhere; pointer-events: none
}
.bar {
  position: absolute; left: 0; right: 0; bottom: 0; display: flex; flex-wrap: wrap; gap: 8px;
  justify-content: space-between; pointer-events: none; cursor: auto;
  padding: 8px max(8px, env(safe-area-inset-right)) max(8px, env(safe-area-inset-bottom))
    max(8px, env(safe-area-inset-left))
}
.group { display: flex; pointer-events: auto; border-radius: 10px; background: #111b; border: 1px solid #fff5 }
.group:empty { display: none }
.actions { margin-left: auto }
@container (max-width: 150px) { .cameras select { display: none } }
.group button, .group select, dialog button {
  min-width: 44px; height: 44px; padding: 0; border: 0; border-radius: 9px; background: none; color: #fff;
  font: 600 15px/1 system-ui, sans-serif; cursor: pointer; touch-action: manipulation
}
.group.cameras { flex: 1 1 92px; min-width: 92px; max-width: 252px; container-type: inline-size }
.cameras { justify-content: space-between }
.group select { flex: 1; width: 0; padding: 0 4px; font-weight: 400; text-overflow: ellipsis }
.group option { color: #000; background: #fff }
.group button:hover, .group select:hover, dialog button:hover { background: #fff3 }
button:focus-visible, select:focus-visible { outline: 3px solid #4cf; outline-offset: -3px }
svg {
  width: 24px; height: 24px; display: block; margin: auto; fill: none; stroke: currentColor; stroke-width: 2;
  stroke-linecap: round; stroke-linejoin: round
}
dialog {
  width: min(26em, calc(100% - 24px)); max-height: calc(100% - 24px); box-sizing: border-box; padding: 16px;
  border: 1px solid #fff5; border-radius: 12px; color: #fff; background: #1c1c1e; cursor: auto; overflow: auto;
  font: 15px/1.4 system-ui, sans-serif; user-select: text; -webkit-user-select: text; overscroll-behavior: contain
}
dialog::backdrop { background: #0008 }
dialog header { display: flex; justify-content: space-between; align-items: center; margin: -8px -8px 0 0 }
h2, h3 { margin: 0; font-size: 17px }
h3 { margin-top: 10px; font-size: 15px; color: #9cf }
dl { display: grid; grid-template-columns: auto 1fr; gap: 4px 16px; margin: 4px 0 0 }
dt { font-weight: 600 }
dd { margin: 0 }
.spots, .spots div { position: absolute; left: 0; top: 0; width: max-content }
.spots div { transition: opacity 0.2s }
.spots .far { opacity: 0.25 }
::slotted([slot^=hotspot]) {
  min-width: 44px; min-height: 44px; padding: 6px 12px; border: 1px solid #fff9; border-radius: 22px; color: #fff;
  background: #111b; font: 600 14px/1.2 system-ui, sans-serif; cursor: pointer; touch-action: manipulation;
  white-space: nowrap
}
[hidden] { display: none !important }
`;
let sheet = null;

/** Gives a shadow root the style. */
export function dress(root) {
  try {
    if (!sheet) {
      sheet = new CSSStyleSheet();
      sheet.replaceSync(STYLE);
    }
    root.adoptedStyleSheets = [sheet];
  } catch {
    // Safari before 16.4 has no constructed style sheets; a style element works unless a policy forbids it.
    root.append(Object.assign(document.createElement("style"), { textContent: STYLE }));
  }
}
