// In a page: one soup drawn by our two passes and by those of the published viewer (published_structure.js), view by
// view in turn.
import { framingOf, hemisphere, viewOf } from "/web/camera.js";
import { makeContext } from "/web/gpu.js";
import { decodeModel } from "/web/model.js";
import { checkDecoder, decodePages } from "/web/pictures.js";
import { Renderer } from "/web/renderer.js";
import { uploadModel } from "/web/upload.js";
import { PublishedStructure } from "./published_structure.js";

export class TwoStructures {
  #canvases = [document.createElement("canvas"), document.createElement("canvas")];
  #gl; #renderer; #drawn; #published;

  /**
   * @param {string} model address of a model.glb
   * @param {string} folder address of what soup-export --format published makes of it, with a slash at the end
   */
  static async load(model, folder) {
    const two = new TwoStructures();
    two.#gl = makeContext(two.#canvases[0]);
    two.#renderer = new Renderer(two.#gl);
    const decoded = decodeModel(new Uint8Array(await (await fetch(model)).arrayBuffer()), "model");
    await checkDecoder(two.#gl);
    two.#drawn = uploadModel(two.#gl, decoded, await decodePages(decoded));
    two.#published = await PublishedStructure.load(two.#canvases[1], folder, decoded.normalisation);
    return two;
  }

  get triangles() { return this.#drawn.model.triangles; }

  /** @returns {import("/web/camera.js").View[]} those of soup-view --benchmark */
  views(count, width, height) {
    const { model } = this.#drawn;
    return hemisphere(framingOf(model), count, width, height).map((camera) => viewOf(camera, model.near, model.far));
  }

  #draw(which, view, mirrored) {
    Object.assign(this.#canvases[which], { width: view.width, height: view.height });
    if (which === 0) this.#renderer.draw(this.#drawn, view, { aa: "none", dropBehind: false, left: 0, top: 0 });
    else this.#published.draw(view, { mirrored });
  }

  /**
   * RGBA of a picture, as base64; it is also to be seen in the page. which: 0 ours, 1 the published structure's;
   * mirrored: see PublishedStructure.draw().
   */
  rgba(which, view, mirrored = false) {
    this.#draw(which, view, mirrored);
    const copy = Object.assign(document.createElement("canvas"), { width: view.width, height: view.height }),
      context = copy.getContext("2d");
    context.drawImage(this.#canvases[which], 0, 0);
    document.body.append(copy);
    return btoa(Array.from(context.getImageData(0, 0, view.width, view.height).data,
      (byte) => String.fromCharCode(byte)).join(""));
  }

  /**
   * Milliseconds until a picture is there: [ours, published] of every view, each drawn in turn; the first `warmup` are
   * drawn and not told.
   */
  times(views, warmup) {
    const timed = (which, view) => {
      const gl = this.#canvases[which].getContext("webgl2"), start = performance.now();
      this.#draw(which, view, false);
      gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
      return performance.now() - start;
    };
    return [...views.slice(0, warmup), ...views]
      .map((view, i) => (i % 2 === 0 ? [timed(0, view), timed(1, view)] : [timed(1, view), timed(0, view)].reverse()))
      .slice(warmup);
  }
}
