// The attributes of <tri-soup>, as properties (tri-soup.d.ts describes them).
import { SAMPLES } from "./shaders.js";

export class SoupAttributes extends HTMLElement {
  get src() { return this.getAttribute("src") ?? ""; }
  set src(value) { this.setAttribute("src", value); }
  get poster() { return this.getAttribute("poster") ?? ""; }
  set poster(value) { this.setAttribute("poster", value); }
  get aa() { return this.getAttribute("aa") in SAMPLES ? this.getAttribute("aa") : "msaa"; }
  set aa(value) { this.setAttribute("aa", value); }
  get autorotate() { return this.hasAttribute("autorotate"); }
  set autorotate(value) { this.toggleAttribute("autorotate", Boolean(value)); }
  get controls() { return this.hasAttribute("controls"); }
  set controls(value) { this.toggleAttribute("controls", Boolean(value)); }
  get loading() { return this.getAttribute("loading") === "lazy" ? "lazy" : "eager"; }
  set loading(value) { this.setAttribute("loading", value); }
  get interaction() { return this.getAttribute("interaction") === "none" ? "none" : "auto"; }
  set interaction(value) { this.setAttribute("interaction", value); }
  get wheel() {
    const value = this.getAttribute("wheel");
    return ["always", "modifier", "never"].includes(value) ? value : "auto";
  }
  set wheel(value) { this.setAttribute("wheel", value); }
  get path() { return this.getAttribute("path") ?? ""; }
  set path(value) { this.setAttribute("path", value); }
  get loop() { return this.hasAttribute("loop"); }
  set loop(value) { this.toggleAttribute("loop", Boolean(value)); }
  get permalink() { return this.hasAttribute("permalink"); }
  set permalink(value) { this.toggleAttribute("permalink", Boolean(value)); }
}
