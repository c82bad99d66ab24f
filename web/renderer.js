// Draws soups with WebGL2: a visibility pass, then the MLP once per pixel (as in engine/render/renderer.cpp).
import { FRAME_BINDING, bindTextures, layerTarget, makeProgram, makeTexture } from "./gpu.js";
import { DEPTHS, SAMPLES, maskedFragment, opaqueFragment, screenVertex, shadeFragment, soupVertex } from "./shaders.js";

const MOST_SAMPLES = 4, FRAME_FLOATS = 40;

export class Renderer {
  #gl; #vertex; #opaque; #masked = {}; #frame; #frameValues = new Float32Array(FRAME_FLOATS);
  #hits = null; #depth = null; #layers = []; #width = 0; #height = 0;

  /** @param {WebGL2RenderingContext} gl a context without depth, alpha and antialiasing, see makeContext */
  constructor(gl) {
    this.#gl = gl;
    gl.disable(gl.DITHER);
    gl.depthFunc(gl.GREATER);
    // Depth is reversed. Without EXT_clip_control this still works, with the precision of fixed-point depth.
    const clip = gl.getExtension("EXT_clip_control");
    clip?.clipControlEXT(clip.LOWER_LEFT_EXT, clip.ZERO_TO_ONE_EXT);
    this.#vertex = soupVertex(clip ? DEPTHS.zeroToOne : DEPTHS.reversed);
    this.#opaque = makeProgram(gl, this.#vertex, opaqueFragment);
    this.#frame = gl.createBuffer();
    gl.bindBuffer(gl.UNIFORM_BUFFER, this.#frame);
    gl.bufferData(gl.UNIFORM_BUFFER, 4 * FRAME_FLOATS, gl.DYNAMIC_DRAW);
  }

  /** Largest side of a frame in pixels. */
  get largestSide() {
    const gl = this.#gl;
    return Math.min(gl.getParameter(gl.MAX_TEXTURE_SIZE), gl.getParameter(gl.MAX_RENDERBUFFER_SIZE),
      ...gl.getParameter(gl.MAX_VIEWPORT_DIMS));
  }

  /** Bytes of the targets of the first pass: a triangle number per sample, and one depth. */
  get targetBytes() { return 4 * (MOST_SAMPLES + 1) * this.#width * this.#height; }

  /**
   * Draws a frame to the canvas, which must be large enough, or to another target.
   * @param {import("./upload.js").GpuModel} drawn
   * @param {import("./camera.js").View} view
   * @param {{aa: "none" | "msaa" | "ssaa", dropBehind: boolean, left?: number, top?: number,
   *   target?: {framebuffer: WebGLFramebuffer | null, height: number, clear: boolean}}} options left, top: position on
   *   the canvas or target, pixels; clear: pixels without a triangle are transparent
   */
  draw(drawn, view, { aa, dropBehind, left = 0, top = 0, target = null }) {
    const gl = this.#gl, { width, height } = view;
    this.#fit(width, height);
    const above = (target?.height ?? gl.drawingBufferHeight) - top;
    this.#setFrame(view, target?.clear ? [0, 0, 0, 0] : [...drawn.model.background, 1], [left, above]);
    bindTextures(gl, { table: drawn.table, opacities: drawn.opacities, features: drawn.features });
    gl.enable(gl.DEPTH_TEST);
    gl.enable(gl.SCISSOR_TEST);
    gl.viewport(0, 0, width, height);
    gl.scissor(0, 0, width, height);
    gl.bindVertexArray(drawn.vertexArray);
    this.#masked[aa] ??= makeProgram(gl, this.#vertex, maskedFragment(aa));
    SAMPLES[aa].at.forEach((offset, layer) => {
      gl.bindFramebuffer(gl.FRAMEBUFFER, this.#layers[layer]);
      gl.clearBufferuiv(gl.COLOR, 0, [0, 0, 0, 0]);
      gl.clearBufferfv(gl.DEPTH, 0, [0]);
      const pass = ({ program, uniforms }, first, count) => {
        gl.useProgram(program);
        gl.uniform2f(uniforms.move, (-2 * offset[0]) / width, (-2 * offset[1]) / height);
        gl.uniform2f(uniforms.offset, ...offset);
        gl.uniform1i(uniforms.drop_behind, Number(dropBehind));
        gl.drawArrays(gl.TRIANGLES, 3 * first, 3 * count);
      };
      pass(this.#opaque, 0, drawn.opaque);
      pass(this.#masked[aa], drawn.opaque, drawn.masked);
      // Lets tile-based GPUs skip writing the depth to memory.
      gl.invalidateFramebuffer(gl.FRAMEBUFFER, [gl.DEPTH_ATTACHMENT]);
    });
    gl.bindVertexArray(null);
    gl.disable(gl.DEPTH_TEST);
    gl.bindFramebuffer(gl.FRAMEBUFFER, target?.framebuffer ?? null);
    gl.viewport(left, above - height, width, height);
    gl.scissor(left, above - height, width, height);
    drawn.programs[aa] ??= makeProgram(gl, screenVertex, shadeFragment(aa, drawn.model.mlp));
    bindTextures(gl, { hits: this.#hits });
    gl.useProgram(drawn.programs[aa].program);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    bindTextures(gl, { hits: null });
  }

  /**
   * Returns the result of the last frame's first pass: per pixel, top row first, the number (from 1) of the visible
   * triangle, or 0.
   * @param {number} width size of the last frame
   * @param {number} height
   * @param {number} [sample] index of the sample in the pixel
   */
  hits(width, height, sample = 0) {
    const gl = this.#gl, values = new Uint32Array(4 * width * height);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.#layers[sample]);
    gl.readPixels(0, 0, width, height, gl.RGBA_INTEGER, gl.UNSIGNED_INT, values);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    return values.filter((_, i) => i % 4 === 0);
  }

  /** The number (from 1) of the triangle that the last frame shows at a pixel, or 0. */
  hitAt(x, y) {
    const gl = this.#gl, value = new Uint32Array(4);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.#layers[0]);
    gl.readPixels(x, y, 1, 1, gl.RGBA_INTEGER, gl.UNSIGNED_INT, value);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    return value[0];
  }

  /** Enlarges the targets of the first pass to the frame. They never shrink: soups of a page have various sizes. */
  #fit(width, height) {
    if (width <= this.#width && height <= this.#height) return;
    const gl = this.#gl;
    this.#width = Math.max(width, this.#width);
    this.#height = Math.max(height, this.#height);
    gl.deleteTexture(this.#hits);
    gl.deleteRenderbuffer(this.#depth);
    for (const target of this.#layers) gl.deleteFramebuffer(target);
    this.#hits = makeTexture(gl, gl.R32UI, this.#width, this.#height, MOST_SAMPLES);
    this.#depth = gl.createRenderbuffer();
    gl.bindRenderbuffer(gl.RENDERBUFFER, this.#depth);
    gl.renderbufferStorage(gl.RENDERBUFFER, gl.DEPTH_COMPONENT32F, this.#width, this.#height);
    this.#layers = Array.from({ length: MOST_SAMPLES }, (_, layer) => {
      const target = layerTarget(gl, this.#hits, layer);
      gl.framebufferRenderbuffer(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.RENDERBUFFER, this.#depth);
      return target;
    });
  }

  #setFrame(view, background, corner) {
    const gl = this.#gl, values = this.#frameValues;
    values.set(view.clipFromWorld, 0);
    values.set([...view.eye, 1, ...view.ray, 0, ...view.rayX, 0, ...view.rayY, 0, ...background], 16);
    values.set([2 / view.width, 2 / view.height, ...corner], 36);
    gl.bindBufferBase(gl.UNIFORM_BUFFER, FRAME_BINDING, this.#frame);
    gl.bufferSubData(gl.UNIFORM_BUFFER, 0, values);
  }
}
