// Uploads models to the GPU: textures, the triangle table, and vertices in drawing order.
import { SoupError } from "./error.js";
import { bindTextures, drawOnce, layerTarget, makeTexture } from "./gpu.js";
import { placeOf } from "./model.js";
import { TABLE_WIDTH, opacityFragment, rangeFragment } from "./shaders.js";
import { cutPages, placeOnTile } from "./tiles.js";

const MOST_TILES = 256;  // tile numbers are one byte in the triangle table

/**
 * @typedef {object} GpuModel a model on the GPU
 * @property {import("./model.js").Model} model
 * @property {number} opaque number of triangles with opacity of at least 0.5 everywhere; drawn first, without opacity
 * @property {number} masked number of triangles that reach opacity 0.5 somewhere; others are not drawn
 * @property {number} width of a texture layer, texels
 * @property {number} height
 * @property {number} tiles number of tiles; each has two layers of features
 * @property {number} rows of the triangle table
 * @property {number} bytes on the GPU
 */

/**
 * @param {WebGL2RenderingContext} gl
 * @param {import("./model.js").Model} model
 * @param {TexImageSource[][]} pages decoded pages, two images each
 * @returns {GpuModel}
 * @throws {SoupError} if the device cannot hold it
 */
export function uploadModel(gl, model, pages) {
  const most = gl.getParameter(gl.MAX_TEXTURE_SIZE), rows = Math.ceil(model.triangles / TABLE_WIDTH);
  const { cuts, count, width, height } = cutPages(model.pages, most);
  if (rows > most || count > MOST_TILES || 2 * count > gl.getParameter(gl.MAX_ARRAY_TEXTURE_LAYERS))
    throw new SoupError(
      `${model.name}: its textures exceed the limit of this device, ${most} texels a side; use a smaller model`);
  while (gl.getError() !== gl.NO_ERROR);  // clears errors of earlier calls
  const features = makeTexture(gl, gl.RGBA8, width, height, 2 * count);
  cuts.forEach((cut) => fillTiles(gl, cut, pages[cut.page], width, height));
  const table = makeTexture(gl, gl.RGBA32UI, TABLE_WIDTH, rows, 3);
  tableLayers(model, cuts, rows).forEach((texels, layer) =>
    gl.texSubImage3D(gl.TEXTURE_2D_ARRAY, 0, 0, 0, layer, TABLE_WIDTH, rows, 1, gl.RGBA_INTEGER, gl.UNSIGNED_INT,
      texels));
  const opacities = opacityLayers(gl, features, width, height, count);
  const ranges = opacityRanges(gl, model, table, features, rows);
  const corners = uploadCorners(gl, model, ranges), vertexBytes = 48 * (corners.opaque + corners.masked);
  const bytes = width * height * count * 9 + TABLE_WIDTH * rows * 48 + vertexBytes;
  const drawn = { model, table, features, opacities, programs: {}, width, height, tiles: count, rows, bytes,
    ...corners };
  if (gl.getError() === gl.OUT_OF_MEMORY) {
    releaseModel(gl, drawn);
    throw new SoupError(
      `${model.name}: does not fit into the memory of this device; close other pages or use a smaller model`);
  }
  return drawn;
}

/**
 * @param {WebGL2RenderingContext} gl
 * @param {GpuModel} drawn
 */
export function releaseModel(gl, drawn) {
  for (const texture of [drawn.table, drawn.features, drawn.opacities]) gl.deleteTexture(texture);
  for (const { program } of Object.values(drawn.programs)) gl.deleteProgram(program);
  gl.deleteBuffer(drawn.buffer);
  gl.deleteVertexArray(drawn.vertexArray);
}

/**
 * Uploads an image as uploadModel does and returns RGBA of its upper left pixel.
 * @param {WebGL2RenderingContext} gl
 * @param {TexImageSource} picture
 */
export function uploadedPixel(gl, picture) {
  const texture = makeTexture(gl, gl.RGBA8, 1, 1, 1), target = layerTarget(gl, texture, 0), rgba = new Uint8Array(4);
  gl.texSubImage3D(gl.TEXTURE_2D_ARRAY, 0, 0, 0, 0, 1, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, picture);
  gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, rgba);
  gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  gl.deleteFramebuffer(target);
  gl.deleteTexture(texture);
  return rgba;
}

/** Uploads both images of a page, tile by tile, to the bound texture. */
function fillTiles(gl, { first, across, down, strideX, strideY }, pictures, width, height) {
  for (let tile = 0; tile < across * down; ++tile) {
    const x = (tile % across) * strideX, y = Math.floor(tile / across) * strideY;
    gl.pixelStorei(gl.UNPACK_SKIP_PIXELS, x);
    gl.pixelStorei(gl.UNPACK_SKIP_ROWS, y);
    pictures.forEach((picture, half) => {
      const w = Math.min(width, picture.width - x), h = Math.min(height, picture.height - y);
      gl.texSubImage3D(gl.TEXTURE_2D_ARRAY, 0, 0, 0, 2 * (first + tile) + half, w, h, 1, gl.RGBA, gl.UNSIGNED_BYTE,
        picture);
    });
  }
  gl.pixelStorei(gl.UNPACK_SKIP_PIXELS, 0);
  gl.pixelStorei(gl.UNPACK_SKIP_ROWS, 0);
}

/** The triangle table: three layers of four numbers per triangle, as soup_triangle in shaders.js reads them. */
function tableLayers(model, cuts, rows) {
  const layers = Array.from({ length: 3 }, () => new Uint32Array(4 * TABLE_WIDTH * rows));
  const floats = layers.map((texels) => new Float32Array(texels.buffer));
  for (let t = 0; t < model.triangles; ++t) {
    const place = placeOnTile(placeOf(model.places, t), cuts);
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

function opacityLayers(gl, features, width, height, tiles) {
  const opacities = makeTexture(gl, gl.R8, width, height, tiles);
  bindTextures(gl, { features });
  for (let tile = 0; tile < tiles; ++tile) {
    const target = layerTarget(gl, opacities, tile);
    drawOnce(gl, opacityFragment, target, width, height, (uniforms) => gl.uniform1i(uniforms.layer, 2 * tile + 1));
    gl.deleteFramebuffer(target);
  }
  return opacities;
}

/** Four bytes per triangle; the first two are the minimum and maximum opacity of its lattice. */
function opacityRanges(gl, model, table, features, rows) {
  const ranges = makeTexture(gl, gl.RGBA8, TABLE_WIDTH, rows, 1), target = layerTarget(gl, ranges, 0);
  const bytes = new Uint8Array(4 * TABLE_WIDTH * rows);
  bindTextures(gl, { table, features });
  drawOnce(gl, rangeFragment, target, TABLE_WIDTH, rows,
    (uniforms) => gl.uniform1ui(uniforms.triangles, model.triangles));
  gl.readPixels(0, 0, TABLE_WIDTH, rows, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
  gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  gl.deleteFramebuffer(target);
  gl.deleteTexture(ranges);
  return bytes;
}

/** Uploads vertices in drawing order, each with the number of its triangle. */
function uploadCorners(gl, model, ranges) {
  const opaque = [], masked = [];
  // Opacity 0.5 is 127.5 / 255, so bytes from 128 reach it.
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
