// Converts a model to arrays for the GPU, for engines that upload data themselves.
import { layerTarget, makeContext } from "../gpu.js";
import { checkDecoder, decodePages } from "../pictures.js";
import { TABLE_WIDTH } from "../shaders.js";
import { releaseModel, uploadModel } from "../upload.js";

/**
 * @typedef {object} Unpacked
 * @property {import("../model.js").Model} model
 * @property {number} width of a texture layer, texels
 * @property {number} height
 * @property {number} tiles
 * @property {number} rows of the triangle table
 * @property {Uint8Array} features RGBA, two layers per tile
 * @property {Uint8Array} opacities one layer per tile
 * @property {Uint32Array} table three layers of RGBA
 * @property {Float32Array} position vertices in drawing order
 * @property {Uint32Array} number triangle of each vertex, from 1
 * @property {number} opaque number of opaque triangles, drawn first
 * @property {number} masked number of triangles with holes
 */

/**
 * Creates the textures in a temporary context and reads them back. This is the only way to get unchanged pixels of an
 * image from a browser, and the engine gets the same values as <tri-soup>.
 * @param {import("../model.js").Model} model
 * @returns {Promise<Unpacked>}
 * @throws {import("../error.js").SoupError} if a texture is damaged or the device cannot hold them
 */
export async function unpackModel(model) {
  const gl = makeContext(document.createElement("canvas"));
  try {
    await checkDecoder(gl);
    const pages = await decodePages(model);
    const drawn = uploadModel(gl, model, pages);
    for (const picture of pages.flat()) picture.close?.();
    const unpacked = readBack(gl, drawn);
    releaseModel(gl, drawn);
    return unpacked;
  } finally {
    gl.getExtension("WEBGL_lose_context")?.loseContext();  // browsers limit the number of contexts
  }
}

function readBack(gl, { model, width, height, tiles, rows, opaque, masked, features, table, buffer }) {
  const texels = width * height, layers = new Uint8Array(8 * texels * tiles),
    opacities = new Uint8Array(texels * tiles);
  readLayers(gl, features, width, height, 2 * tiles, gl.RGBA, gl.UNSIGNED_BYTE, layers);
  for (let tile = 0; tile < tiles; ++tile) {
    // Opacity is the last of features 4 to 7.
    const high = layers.subarray(4 * texels * (2 * tile + 1));
    for (let i = 0; i < texels; ++i) opacities[tile * texels + i] = high[4 * i + 3];
  }
  const triangles = new Uint32Array(12 * TABLE_WIDTH * rows);
  readLayers(gl, table, TABLE_WIDTH, rows, 3, gl.RGBA_INTEGER, gl.UNSIGNED_INT, triangles);
  const count = 3 * (opaque + masked), vertices = new Uint32Array(4 * count),
    coordinates = new Float32Array(vertices.buffer);
  gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
  gl.getBufferSubData(gl.ARRAY_BUFFER, 0, vertices);
  const position = new Float32Array(3 * count), number = new Uint32Array(count);
  for (let i = 0; i < count; ++i) {
    position.set(coordinates.subarray(4 * i, 4 * i + 3), 3 * i);
    number[i] = vertices[4 * i + 3];
  }
  return { model, width, height, tiles, rows, opaque, masked, features: layers, opacities, table: triangles, position,
    number };
}

function readLayers(gl, texture, width, height, layers, format, type, values) {
  const size = values.length / layers;
  for (let layer = 0; layer < layers; ++layer) {
    const target = layerTarget(gl, texture, layer);
    gl.readPixels(0, 0, width, height, format, type, values.subarray(layer * size, (layer + 1) * size));
    gl.deleteFramebuffer(target);
  }
}
