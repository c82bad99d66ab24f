// The help of the controls: what touch, mouse and keys do.
const TOUCH = ["Touch", [["One finger", "turn"], ["Two fingers", "move, and zoom by pinching"],
  ["Double tap", "turn around this point"]]];
const MOUSE = ["Mouse", [["Drag", "turn"], ["Shift or right drag", "move"], ["Ctrl drag", "look around"],
  ["Wheel", "zoom"], ["Double click", "turn around this point"]]];
const KEYS = ["Keys", [["Arrows", "turn"], ["W A S D", "fly (Shift: faster)"], ["Q E", "down, up"],
  ["[ ]", "previous, next camera"], ["Home", "first view"], ["F, R", "whole scene, start again"],
  ["X", "smooth edges: 3 levels"]]];
const PATH_KEY = ["Space", "play or pause"], LINK_KEY = ["L", "copy a link to this view"];
const SCREEN_KEY = ["Enter", "full screen"], HELP_KEY = ["H", "this help"];

export const make = (tag, properties = {}, ...children) => {
  const node = Object.assign(document.createElement(tag), properties);
  node.append(...children);
  return node;
};

const chapter = ([title, rows]) => [make("h3", {}, title), make("dl", {}, ...rows.flatMap(([what, does]) =>
  [make("dt", {}, what), make("dd", {}, does)]))];

/** Shows the help over a shadow root. can: which of path, link and fullscreen there are. */
export function showHelp(root, can) {
  root.querySelector("dialog")?.remove();
  const close = make("button", { type: "button", ariaLabel: "Close", autofocus: true }, "\u2715");
  const keys = ["Keys", [...KEYS[1], ...(can.path ? [PATH_KEY] : []), ...(can.link ? [LINK_KEY] : []),
    ...(can.fullscreen ? [SCREEN_KEY] : []), HELP_KEY]];
  // A phone has no keys, and what a visitor uses comes first.
  const coarse = matchMedia("(pointer: coarse)").matches;
  const chapters = coarse ? [TOUCH, MOUSE, keys] : [MOUSE, keys, TOUCH];
  const dialog = make("dialog", { ariaLabel: "Help" }, make("header", {}, make("h2", {}, "Help"), close),
    ...chapters.flatMap(chapter));
  dialog.part = "help";
  close.addEventListener("click", () => dialog.close());
  // A click beside it: of the dialog itself, but outside its box.
  dialog.addEventListener("click", (event) => {
    const box = dialog.getBoundingClientRect();
    if (event.target === dialog && (event.clientX < box.left || event.clientX > box.right ||
      event.clientY < box.top || event.clientY > box.bottom)) dialog.close();
  });
  dialog.addEventListener("keydown", (event) => event.stopPropagation());
  dialog.addEventListener("close", () => dialog.remove());
  root.append(dialog);
  dialog.showModal();
}
