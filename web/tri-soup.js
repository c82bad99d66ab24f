// Defines <tri-soup>. See docs/viewer.md.
import { TriSoup } from "./element.js";

if (!customElements.get("tri-soup")) customElements.define("tri-soup", TriSoup);

export { TriSoup };
