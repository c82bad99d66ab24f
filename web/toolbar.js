// The buttons over a scene (attribute `controls`).
import { make } from "./help.js";

/** Names in the attribute `controls`; without names there are all. */
export const CONTROLS = ["cameras", "path", "reset", "link", "xr", "fullscreen", "help"];

// Paths of icons, 24 x 24.
const ICONS = {
  previous: "M15 5l-7 7 7 7", next: "M9 5l7 7-7 7", play: "M8 5l11 7-11 7z", pause: "M8 5v14M16 5v14",
  reset: "M4 11l8-7 8 7M6 10v10h12V10", link: "M9 12h6M10 8H8a4 4 0 0 0 0 8h2M14 8h2a4 4 0 0 1 0 8h-2",
  enlarge: "M4 9V4h5M20 9V4h-5M4 15v5h5M20 15v5h-5", shrink: "M9 4v5H4M15 4v5h5M9 20v-5H4M15 20v-5h5",
};

function icon(name) {
  const space = "http://www.w3.org/2000/svg", svg = document.createElementNS(space, "svg"),
    path = document.createElementNS(space, "path");
  svg.setAttribute("viewBox", "0 0 24 24");
  svg.setAttribute("aria-hidden", "true");
  path.setAttribute("d", ICONS[name]);
  svg.append(path);
  return svg;
}

/** Which controls an attribute names. */
export function controlsOf(value) {
  const names = value === null ? [] : value.trim() === "" ? CONTROLS : value.split(/\s+/);
  return new Set(names.filter((name) => CONTROLS.includes(name)));
}

/** Names without the folder that all of them are in. */
function shortNames(names) {
  const folder = names[0]?.slice(0, names[0].lastIndexOf("/") + 1) ?? "";
  return names.every((name) => name.startsWith(folder)) ? names.map((name) => name.slice(folder.length)) : names;
}

export class Toolbar {
  #select; #buttons = {}; #groups; #names = null;

  /** @param {Record<string, Function>} commands what the buttons do */
  constructor(commands) {
    const button = (name, label, face, action) => {
      const node = make("button", { type: "button", title: label, ariaLabel: label, hidden: true }, face);
      node.addEventListener("click", action);
      this.#buttons[name] = node;
      return node;
    };
    this.#select = make("select", { ariaLabel: "Camera" });
    this.#select.addEventListener("change", () => commands.selectCamera(Number(this.#select.value)));
    const cameras = make("div", { className: "group cameras" },
      button("previous", "Previous camera", icon("previous"), () => commands.stepCamera(-1)), this.#select,
      button("next", "Next camera", icon("next"), () => commands.stepCamera(1)));
    const actions = make("div", { className: "group actions" },
      button("path", "Play", icon("play"), () => commands.playOrPause()),
      button("reset", "First view", icon("reset"), () => commands.firstView()),
      button("link", "Copy a link to this view", icon("link"), () => commands.copyLink()),
      button("vr", "Virtual reality", "VR", () => commands.enterXR("immersive-vr")),
      button("ar", "Augmented reality", "AR", () => commands.enterXR("immersive-ar")),
      button("fullscreen", "Full screen", icon("enlarge"), () => commands.fullscreen()),
      button("help", "Help", "?", () => commands.help()));
    this.#groups = { cameras, actions };
    this.node = make("div", { className: "bar", hidden: true }, cameras, actions);
    this.node.part = "controls";
    for (const group of [cameras, actions]) group.setAttribute("role", "group");
    cameras.setAttribute("aria-label", "Cameras");
    actions.setAttribute("aria-label", "View");
  }

  /** @param {Set<string>} shown names of CONTROLS. can: which of them make sense now */
  show(shown, can) {
    const on = (name) => shown.has(name) && can[name];
    this.node.hidden = shown.size === 0 || !can.scene;
    this.#groups.cameras.hidden = !on("cameras");
    for (const name of ["previous", "next"]) this.#buttons[name].hidden = false;
    for (const name of ["path", "reset", "link", "fullscreen", "help"]) this.#buttons[name].hidden = !on(name);
    for (const name of ["vr", "ar"]) this.#buttons[name].hidden = !shown.has("xr") || !can[name];
    this.#groups.actions.hidden = Object.entries(this.#buttons)
      .every(([name, node]) => ["previous", "next"].includes(name) || node.hidden);
  }

  /** The list of cameras; index: the one that is shown, or null. */
  setCamera(names, index) {
    if (this.#names !== names) {
      this.#names = names;
      const free = make("option", { value: "", disabled: true, hidden: true }, "Free view");
      this.#select.replaceChildren(free,
        ...shortNames(names).map((name, i) => make("option", { value: String(i) }, name)));
    }
    const value = index === null ? "" : String(index);
    if (this.#select.value !== value) this.#select.value = value;
  }

  setPlaying(playing) { this.#toggle("path", playing ? "Pause" : "Play", playing ? "pause" : "play"); }

  setFullscreen(full) {
    this.#toggle("fullscreen", full ? "Leave full screen" : "Full screen", full ? "shrink" : "enlarge");
  }

  #toggle(name, label, face) {
    const button = this.#buttons[name];
    if (button.title === label) return;
    Object.assign(button, { title: label, ariaLabel: label });
    button.replaceChildren(icon(face));
  }
}
