// Draws soups with WebGL2: what is visible first, then the MLP once per pixel (engine/render/renderer.cpp).
import { SoupError } from "./error.js";
import { placeOf } from "./model.js";
import {
  SAMPLES, TABLE_WIDTH, UNITS, maskedFragment, opacityFragment, opaqueFragment, rangeFragment, screenVertex, shadeFragment, soupVertex,
} from "./shaders.js";

const MOST_SAMPLES = 4, FRAME_FLOATS = 40, FRAME_BINDING = 0;

/**
 * @typedef {object} GpuModel a model as it is drawn
 * @property {import("./model.js").Model} model
 * @property {number} opaque triangles that are at least a half everywhere: drawn first, without looking at opacity
 * @property {number} masked triangles that are a half somewhere; those that are it nowhere are not drawn at all
 */

export class Renderer {
  #gl; #zeroToOne; #opaque; #masked = {}; #frame; #frameValues = new Float32Array(FRAME_FLOATS);
  #hits = null; #depth = null; #layers = []; #width = 0; #height = 0;

  /** @param {WebGL2RenderingContext} gl without depth, alpha and multisamples of its own */
  constructor(gl) {
    this.#gl = gl;
    gl.disable(gl.DITHER);
    gl.depthFunc(gl.GREATER);
    // Depth is reversed. Where clip space cannot be Vulkan's it still works, with the digits of a fixed-point depth.
    const clip = gl.getExtension("EXT_clip_control");
    clip?.clipControlEXT(clip.LOWER_LEFT_EXT, clip.ZERO_TO_ONE_EXT);
    this.#zeroToOne = clip !== null;
    this.#opaque = this.#program(soupVertex(this.#zeroToOne), opaqueFragment);
    this.#frame = gl.createBuffer();
    gl.bindBuffer(gl.UNIFORM_BUFFER, this.#frame);
    gl.bufferData(gl.UNIFORM_BUFFER, 4 * FRAME_FLOATS, gl.DYNAMIC_DRAW);
  }

  /** Longest side of a picture in pixels. */
  get largestSide() {
    const gl = this.#gl;
    return Math.min(gl.getParameter(gl.MAX_TEXTURE_SIZE), gl.getParameter(gl.MAX_RENDERBUFFER_SIZE), ...gl.getParameter(gl.MAX_VIEWPORT_DIMS));
  }

  /**
   * @param {import("./model.js").Model} model
   * @param {TexImageSource[][]} pages its decoded pages, two pictures each
   * @returns {GpuModel}
   * @throws {SoupError} when the device cannot hold it
   */
  upload(model, pages) {
    const gl = this.#gl;
    const width = Math.max(...model.pages.map((page) => page.width)), height = Math.max(...model.pages.map((page) => page.height));
    const rows = Math.ceil(model.triangles / TABLE_WIDTH), most = gl.getParameter(gl.MAX_TEXTURE_SIZE);
    if (Math.max(width, height, rows) > most || 2 * pages.length > gl.getParameter(gl.MAX_ARRAY_TEXTURE_LAYERS))
      throw new SoupError(`${model.name}: its textures of ${width} x ${height} texels are too large for this device, which ends at ${most}; use a smaller model`);
    while (gl.getError() !== gl.NO_ERROR);  // of others
    const features = this.#texture(gl.RGBA8, width, height, 2 * pages.length);
    pages.flat().forEach((picture, layer) =>
      gl.texSubImage3D(gl.TEXTURE_2D_ARRAY, 0, 0, 0, layer, picture.width, picture.height, 1, gl.RGBA, gl.UNSIGNED_BYTE, picture));
    const table = this.#texture(gl.RGBA32UI, TABLE_WIDTH, rows, 3);
    tableLayers(model, rows).forEach((texels, layer) =>
      gl.texSubImage3D(gl.TEXTURE_2D_ARRAY, 0, 0, 0, layer, TABLE_WIDTH, rows, 1, gl.RGBA_INTEGER, gl.UNSIGNED_INT, texels));
    const opacities = this.#opacities(features, width, height, pages.length);
    const ranges = this.#opacityRanges(model, table, features, rows);
    const drawn = { model, table, features, opacities, programs: {}, ...this.#corners(model, ranges) };
    if (gl.getError() === gl.OUT_OF_MEMORY) {
      this.release(drawn);
      throw new SoupError(`${model.name}: does not fit the memory of this device; close other pages or use a smaller model`);
    }
    return drawn;
  }

  /**
   * RGBA of the upper left pixel of a picture, as upload() has it.
   * @param {TexImageSource} picture
   */
  firstPixel(picture) {
    const gl = this.#gl, texture = this.#texture(gl.RGBA8, 1, 1, 1), target = this.#layerTarget(texture, 0), rgba = new Uint8Array(4);
    gl.texSubImage3D(gl.TEXTURE_2D_ARRAY, 0, 0, 0, 0, 1, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, picture);
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, rgba);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.deleteFramebuffer(target);
    gl.deleteTexture(texture);
    return rgba;
  }

  /** @param {GpuModel} drawn */
  release(drawn) {
    const gl = this.#gl;
    for (const texture of [drawn.table, drawn.features, drawn.opacities]) gl.deleteTexture(texture);
    for (const { program } of Object.values(drawn.programs)) gl.deleteProgram(program);
    gl.deleteBuffer(drawn.buffer);
    gl.deleteVertexArray(drawn.vertexArray);
  }

  /**
   * Draws to the upper left corner of the canvas, which has to be as large as the view.
   * @param {GpuModel} drawn
   * @param {import("./camera.js").View} view
   * @param {{aa: "none" | "msaa" | "ssaa", dropBehind: boolean}} options
   */
  draw(drawn, view, { aa, dropBehind }) {
    const gl = this.#gl, { width, height } = view;
    this.#fit(width, height);
    this.#setFrame(view, drawn.model.background);
    this.#bind({ table: drawn.table, opacities: drawn.opacities, features: drawn.features });
    gl.enable(gl.DEPTH_TEST);
    gl.enable(gl.SCISSOR_TEST);
    gl.viewport(0, 0, width, height);
    gl.scissor(0, 0, width, height);
    gl.bindVertexArray(drawn.vertexArray);
    this.#masked[aa] ??= this.#program(soupVertex(this.#zeroToOne), maskedFragment(aa));
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
      // Phones need not write to memory what nobody reads.
      gl.invalidateFramebuffer(gl.FRAMEBUFFER, [gl.DEPTH_ATTACHMENT]);
    });
    gl.bindVertexArray(null);
    gl.disable(gl.DEPTH_TEST);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    const below = gl.drawingBufferHeight - height;
    gl.viewport(0, below, width, height);
    gl.scissor(0, below, width, height);
    drawn.programs[aa] ??= this.#program(screenVertex, shadeFragment(aa, drawn.model.mlp));
    this.#bind({ hits: this.#hits });
    gl.useProgram(drawn.programs[aa].program);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    this.#bind({ hits: null });
  }

  /**
   * What the first pass of the last picture found: per pixel, rows downwards, the number (from 1) of the visible triangle, 0 where
   * there is none.
   * @param {number} width of the last picture
   * @param {number} height
   * @param {number} [sample] which of the pixel's samples
   */
  hits(width, height, sample = 0) {
    const gl = this.#gl, values = new Uint32Array(4 * width * height);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.#layers[sample]);
    gl.readPixels(0, 0, width, height, gl.RGBA_INTEGER, gl.UNSIGNED_INT, values);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    return values.filter((_, i) => i % 4 === 0);
  }

  /** Textures by the names of UNITS. */
  #bind(textures) {
    const gl = this.#gl;
    for (const [name, texture] of Object.entries(textures)) {
      gl.activeTexture(gl.TEXTURE0 + UNITS[name]);
      gl.bindTexture(gl.TEXTURE_2D_ARRAY, texture);
    }
  }

  #program(vertex, fragment) {
    const gl = this.#gl, program = gl.createProgram();
    const shaders = [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]].map(([kind, source]) => {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, source);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
      return shader;
    });
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS) && !gl.isContextLost()) {
      const log = [gl.getProgramInfoLog(program), ...shaders.map((shader) => gl.getShaderInfoLog(shader))].filter(Boolean).join(" ");
      throw new SoupError(`this browser's WebGL2 cannot compile the shaders (${log.trim().slice(0, 200)}); try another browser`);
    }
    for (const shader of shaders) gl.deleteShader(shader);
    const names = ["move", "offset", "drop_behind", "layer", "triangles"];
    const uniforms = Object.fromEntries(names.map((name) => [name, gl.getUniformLocation(program, name)]));
    gl.useProgram(program);
    for (const [name, unit] of Object.entries(UNITS)) gl.uniform1i(gl.getUniformLocation(program, name), unit);
    const block = gl.getUniformBlockIndex(program, "Frame");
    if (block !== gl.INVALID_INDEX) gl.uniformBlockBinding(program, block, FRAME_BINDING);
    return { program, uniforms };
  }

  /** A new array of textures that are fetched and never filtered, bound to the unit of `features`. */
  #texture(format, width, height, layers) {
    const gl = this.#gl, texture = gl.createTexture();
    this.#bind({ features: texture });
    gl.texStorage3D(gl.TEXTURE_2D_ARRAY, 1, format, width, height, layers);
    gl.texParameteri(gl.TEXTURE_2D_ARRAY, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
    gl.texParameteri(gl.TEXTURE_2D_ARRAY, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
    return texture;
  }

  #layerTarget(texture, layer) {
    const gl = this.#gl, target = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, target);
    gl.framebufferTextureLayer(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, texture, 0, layer);
    return target;
  }

  /** Makes the targets of the first pass as large as a picture. They only grow: pages have soups of several sizes. */
  #fit(width, height) {
    if (width <= this.#width && height <= this.#height) return;
    const gl = this.#gl;
    this.#width = Math.max(width, this.#width);
    this.#height = Math.max(height, this.#height);
    gl.deleteTexture(this.#hits);
    gl.deleteRenderbuffer(this.#depth);
    for (const target of this.#layers) gl.deleteFramebuffer(target);
    this.#hits = this.#texture(gl.R32UI, this.#width, this.#height, MOST_SAMPLES);
    this.#depth = gl.createRenderbuffer();
    gl.bindRenderbuffer(gl.RENDERBUFFER, this.#depth);
    gl.renderbufferStorage(gl.RENDERBUFFER, gl.DEPTH_COMPONENT32F, this.#width, this.#height);
    this.#layers = Array.from({ length: MOST_SAMPLES }, (_, layer) => {
      const target = this.#layerTarget(this.#hits, layer);
      gl.framebufferRenderbuffer(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.RENDERBUFFER, this.#depth);
      return target;
    });
  }

  #setFrame(view, background) {
    const gl = this.#gl, values = this.#frameValues;
    values.set(view.clipFromWorld, 0);
    values.set([...view.eye, 1, ...view.ray, 0, ...view.rayX, 0, ...view.rayY, 0, ...background, 1], 16);
    values.set([2 / view.width, 2 / view.height, gl.drawingBufferHeight], 36);
    gl.bindBufferBase(gl.UNIFORM_BUFFER, FRAME_BINDING, this.#frame);
    gl.bufferSubData(gl.UNIFORM_BUFFER, 0, values);
  }

  /** Draws one pixel for each of a target's, with a program that is needed once. */
  #once(fragment, target, width, height, setUniforms) {
    const gl = this.#gl, { program, uniforms } = this.#program(screenVertex, fragment);
    gl.useProgram(program);
    setUniforms(uniforms);
    gl.bindFramebuffer(gl.FRAMEBUFFER, target);
    gl.disable(gl.SCISSOR_TEST);
    gl.viewport(0, 0, width, height);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    gl.deleteProgram(program);
  }

  #opacities(features, width, height, pages) {
    const gl = this.#gl, opacities = this.#texture(gl.R8, width, height, pages);
    this.#bind({ features });
    for (let page = 0; page < pages; ++page) {
      const target = this.#layerTarget(opacities, page);
      this.#once(opacityFragment, target, width, height, (uniforms) => gl.uniform1i(uniforms.layer, 2 * page + 1));
      gl.deleteFramebuffer(target);
    }
    return opacities;
  }

  /** Four bytes a triangle, of which the first two are the least and the greatest opacity of its lattice. */
  #opacityRanges(model, table, features, rows) {
    const gl = this.#gl, ranges = this.#texture(gl.RGBA8, TABLE_WIDTH, rows, 1), target = this.#layerTarget(ranges, 0);
    const bytes = new Uint8Array(4 * TABLE_WIDTH * rows);
    this.#bind({ table, features });
    this.#once(rangeFragment, target, TABLE_WIDTH, rows, (uniforms) => gl.uniform1ui(uniforms.triangles, model.triangles));
    gl.readPixels(0, 0, TABLE_WIDTH, rows, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.deleteFramebuffer(target);
    gl.deleteTexture(ranges);
    return bytes;
  }

  /** Vertices in the order in which they are drawn, each with the number of its triangle. */
  #corners(model, ranges) {
    const gl = this.#gl, opaque = [], masked = [];
    // A byte is at least a half from 128 on: 127.5 / 255 is the threshold.
    for (let t = 0; t < model.triangles; ++t)
      if (ranges[4 * t] >= 128) opaque.push(t);
      else if (ranges[4 * t + 1] >= 128) masked.push(t);
    const order = [...opaque, ...masked];
    const floats = new Float32Array(12 * order.length), numbers = new Uint32Array(floats.buffer);
    order.forEach((t, i) => {
      for (let corner = 0; corner < 3; ++corner) {
        const at = 12 * i + 4 * corner, from = 9 * t + 3 * corner;
        floats.set(model.vertices.subarray(from, from + 3), at);
        numbers[at + 3] = t + 1;
      }
    });
    const buffer = gl.createBuffer(), vertexArray = gl.createVertexArray();
    gl.bindVertexArray(vertexArray);
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.bufferData(gl.ARRAY_BUFFER, numbers, gl.STATIC_DRAW);
    gl.enableVertexAttribArray(0);
    gl.vertexAttribPointer(0, 3, gl.FLOAT, false, 16, 0);
    gl.enableVertexAttribArray(1);
    gl.vertexAttribIPointer(1, 1, gl.UNSIGNED_INT, 16, 12);
    gl.bindVertexArray(null);
    return { buffer, vertexArray, opaque: opaque.length, masked: masked.length };
  }
}

/** The table of triangles: three layers of four numbers a triangle, as soup_triangle in shaders.js reads them. */
function tableLayers(model, rows) {
  const layers = Array.from({ length: 3 }, () => new Uint32Array(4 * TABLE_WIDTH * rows));
  const floats = layers.map((texels) => new Float32Array(texels.buffer));
  for (let t = 0; t < model.triangles; ++t) {
    const place = placeOf(model.places, t);
    for (let axis = 0; axis < 3; ++axis) {
      const [v0, v1, v2] = [0, 3, 6].map((corner) => model.vertices[9 * t + corner + axis]);
      floats[0][4 * t + axis] = v2;
      floats[1][4 * t + axis] = v0 - v2;
      floats[2][4 * t + axis] = v1 - v2;
    }
    layers[0][4 * t + 3] = place.x0 | (place.y0 << 16);
    layers[1][4 * t + 3] = place.level | (place.page << 8) | (place.turned << 16);
  }
  return layers;
}
