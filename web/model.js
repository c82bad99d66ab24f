// Reads model.glb: a soup with neural textures in a glTF extension (docs/formats.md, engine/format/model_file.cpp).
import { SoupError } from "./error.js";
import { decodeGlb } from "./glb.js";
import { decodeLattices, fillAtlas, makeAtlas } from "./lattice.js";
import { crc32, isWholePng, pngSize } from "./png.js";
import { poseOf } from "./rotation.js";
import { decodeVertices } from "./vertices.js";

export const EXTENSION = "TRISOUP_neural_textures";
const VERSIONS = 4, MAX_PAGES = 256, PAGE_SIDE = 4096, MAX_STEP = 128;
const PLACE_BYTES = 8, TRIANGLE_BYTES = 36, POSE_FLOATS = 7;
export const MAX_LEVEL = 5;  // of a lattice
export const MLP_PARAMETERS = 595;

/**
 * Returns the place of a triangle's lattice in the atlas. Lattice point (x, y) is texel (x0 + x, y0 + y), or
 * (x0 - x, y0 - y) if `turned` is 1.
 * @param {DataView} places 8 bytes per triangle
 * @param {number} triangle
 */
export function placeOf(places, triangle) {
  const at = PLACE_BYTES * triangle;
  return {
    x0: places.getUint16(at, true),
    y0: places.getUint16(at + 2, true),
    level: places.getUint8(at + 4),
    page: places.getUint8(at + 5),
    turned: places.getUint8(at + 6),
  };
}

/**
 * @typedef {object} Model a decoded model. Normalised coordinates: the mean distance of the cameras from the origin
 *   is 1.
 * @property {string} name
 * @property {number} triangles
 * @property {{scale: number, centre: number[], middle: number[]}} normalisation normalised = scale (dataset - centre) =
 *   scale (vertex of the file - middle)
 * @property {Float32Array} vertices x, y, z of three vertices per triangle, normalised
 * @property {DataView} places see placeOf
 * @property {Float32Array} mlp w1[16][16] b1[16] w2[16][16] b2[16] w3[3][16] b3[3]
 * @property {{width: number, height: number, features: (Uint8Array | {rgba: Uint8Array})[]}[]} pages two images each,
 *   PNG files or RGBA bytes: features 0 to 3; features 4 to 6 and opacity
 * @property {number[]} background RGB, 0 to 1
 * @property {number[] | null} up up direction, if known
 * @property {number} near clip planes of the model's cameras, normalised
 * @property {number} far
 * @property {boolean} dropNear these cameras do not draw triangles that reach behind them, as in training
 * @property {import("./camera.js").Camera[]} cameras test views first
 */

/**
 * Decodes a model.glb. Textures of version 1 files stay PNG.
 * @param {Uint8Array} bytes
 * @param {string} name prefix of error messages
 * @returns {Model}
 * @throws {SoupError} if the file is not a complete model
 */
export function decodeModel(bytes, name) {
  const { document, binary } = decodeGlb(bytes, name);
  return decodeDocument(document, binary, name);
}

/**
 * Decodes the document and buffer of a model.glb.
 * @param {object} document glTF JSON
 * @param {Uint8Array} binary its buffer
 * @param {string} name prefix of error messages
 * @returns {Model}
 * @throws {SoupError} if it is not a complete model
 */
export function decodeDocument(document, binary, name) {
  if (!document?.extensions?.[EXTENSION])
    throw new SoupError(`${name}: has no ${EXTENSION} extension; it is not a trisoup model`);
  try {
    return new Reader(document, binary, name).model();
  } catch (error) {
    if (error instanceof SoupError) throw error;
    // A member is missing or has another type.
    throw new SoupError(`${name}: has JSON that is not of a trisoup model (${error.message}); export it again`);
  }
}

/** Reads one file. */
class Reader {
  constructor(document, binary, name) {
    this.document = document;
    this.extension = document.extensions[EXTENSION];
    this.binary = binary;
    this.name = name;
  }

  damaged(what) {
    return new SoupError(`${this.name}: ${what}; the file is truncated or damaged, export or copy it again`);
  }

  whole(value) {
    if (!Number.isSafeInteger(value) || value < 0)
      throw this.damaged("has an invalid whole number");
    return value;
  }

  number(value) {
    if (!Number.isFinite(value)) throw this.damaged("has an invalid number");
    return value;
  }

  vector(values) {
    return [0, 1, 2].map((i) => this.number(values[i]));
  }

  /** Returns the bytes of a bufferView. */
  view(index) {
    const view = this.document.bufferViews[this.whole(index)];
    const offset = this.whole(view.byteOffset ?? 0), length = this.whole(view.byteLength);
    if (offset > this.binary.length || length > this.binary.length - offset)
      throw this.damaged("has a bufferView beyond its end");
    return this.binary.subarray(offset, offset + length);
  }

  floats(bytes) {
    // Copied because the bytes may not be aligned for floats.
    const values = new Float32Array(bytes.slice().buffer);
    return values.every(Number.isFinite) ? values : null;
  }

  model() {
    const { extension } = this;
    const version = this.whole(extension.version);
    if (version < 1 || version > VERSIONS)
      throw new SoupError(
        `${this.name}: has version ${version}, this page reads versions 1 to ${VERSIONS}; use a newer page`);
    if (extension.sphericalHarmonicsDegree !== 2)
      throw new SoupError(
        `${this.name}: has spherical harmonics of another degree than 2; use a newer trisoup`);
    const triangles = this.whole(extension.triangles), normalisation = this.normalisation();
    const vertices = version >= 4 && extension.vertices !== undefined
      ? this.codedVertices(triangles) : this.vertices(triangles, normalisation);
    const { places, pages } = version === 1 ? this.atlas(triangles) : this.textures(triangles);
    return {
      name: this.name,
      triangles,
      normalisation,
      vertices,
      places,
      mlp: this.mlp(),
      pages,
      background: this.background(),
      up: this.up(),
      cameras: this.cameras(),
      ...this.planes(),
    };
  }

  normalisation() {
    const centre = this.vector(this.extension.centre), scale = this.number(this.extension.scale);
    const origin = this.extension.origin === undefined ? [0, 0, 0] : this.vector(this.extension.origin);
    // Beyond these limits floats cannot resolve the soup.
    if (!(Math.hypot(...centre) < 1e12 && Math.hypot(...origin) < 1e12 && scale > 1e-9 && scale < 1e9))
      throw this.damaged("has an invalid centre or scale");
    return { scale, centre, middle: centre.map((value, axis) => value - origin[axis]) };
  }

  vertices(triangles, { scale, middle }) {
    const accessor = this.document.accessors[this.whole(this.document.meshes[0].primitives[0].attributes.POSITION)];
    const bytes = this.view(accessor.bufferView);
    if (triangles === 0 || bytes.length !== triangles * TRIANGLE_BYTES)
      throw this.damaged("has a number of vertices that does not match its triangles");
    const vertices = this.floats(bytes);
    if (!vertices) throw this.damaged("has a vertex that is not a number");
    for (let i = 0; i < vertices.length; ++i) vertices[i] = scale * (vertices[i] - middle[i % 3]);
    return vertices;
  }

  /** Returns the bytes of a coded part after checking their CRC. */
  coded({ bufferView, crc32: sum }, what) {
    const bytes = this.view(bufferView);
    if (crc32(bytes) !== this.whole(sum)) throw this.damaged(`has damaged ${what}`);
    return bytes;
  }

  /** Vertices of files without a mesh. */
  codedVertices(triangles) {
    const vertices = decodeVertices(this.coded(this.extension.vertices, "vertices"), triangles);
    if (triangles === 0 || !vertices) throw this.damaged("has vertices that end too early");
    return vertices;
  }

  mlp() {
    const bytes = this.view(this.extension.mlp);
    if (bytes.length !== 4 * MLP_PARAMETERS) throw this.damaged("has an MLP of the wrong size");
    const mlp = this.floats(bytes);
    if (!mlp) throw this.damaged("has an MLP weight that is not a number");
    return mlp;
  }

  /** Textures of versions 2 and later. */
  textures(triangles) {
    const { steps } = this.extension.textures, bytes = this.coded(this.extension.textures, "textures");
    if (!Array.isArray(steps) || steps.length !== 8 ||
      !steps.every((step) => this.whole(step) >= 1 && step <= MAX_STEP))
      throw this.damaged("has invalid texture steps");
    const lattices = decodeLattices(bytes, triangles, steps);
    if (!lattices) throw this.damaged("has textures that end too early");
    const atlas = makeAtlas(lattices.levels, PAGE_SIDE);
    if (atlas.pages.length > MAX_PAGES) throw this.damaged("needs too many atlas pages");
    return { places: atlas.places, pages: fillAtlas(lattices, atlas) };
  }

  /** Textures of version 1. */
  atlas(triangles) {
    const places = this.places(triangles);
    return { places, pages: this.pages(triangles, places) };
  }

  places(triangles) {
    const bytes = this.view(this.extension.places);
    if (bytes.length !== PLACE_BYTES * triangles) throw this.damaged("has a texture table of the wrong length");
    return new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  }

  pages(triangles, places) {
    const rows = this.extension.pages;
    if (!Array.isArray(rows) || rows.length > MAX_PAGES) throw this.damaged("has an invalid number of atlas pages");
    const pages = rows.map((row) => {
      const features = [0, 1].map((half) => this.view(this.document.images[this.whole(row.features[half])].bufferView));
      const [low, high] = features.map(pngSize);
      if (!low || !high) throw this.damaged("has a texture that is not a PNG file");
      if (low.width !== high.width || low.height !== high.height) throw this.damaged("has a page with two sizes");
      if (!features.every(isWholePng)) throw this.damaged("has a damaged texture");
      return { ...low, features };
    });
    // Limits the texels: headers of damaged files can claim any size. Allows one page of the largest usual size and
    // room for every lattice.
    let texels = 8192 * 8192;
    for (let t = 0; t < triangles; ++t) {
      const place = placeOf(places, t), page = pages[place.page], side = (1 << place.level) * (place.turned ? -1 : 1);
      if (place.level > MAX_LEVEL || !page || place.turned > 1) throw this.damaged("has an invalid texture table");
      const outside = (from, size) => from >= size || from + side < 0 || from + side >= size;
      if (outside(place.x0, page.width) || outside(place.y0, page.height))
        throw this.damaged("has a texture outside its page");
      texels += 2 * ((1 << place.level) + 3) * ((1 << place.level) + 2);
    }
    for (const page of pages) texels -= page.width * page.height;
    if (texels < 0) throw this.damaged("has more texels than its triangles need");
    return pages;
  }

  background() {
    const background = this.vector(this.extension.background);
    if (!background.every((c) => c >= 0 && c <= 1)) throw this.damaged("has a background that is not a colour");
    return background;
  }

  up() {
    if (this.extension.up === undefined) return null;
    const up = this.vector(this.extension.up), length = Math.hypot(...up);
    if (!(length > 1e-12 && length < 1e12)) throw this.damaged("has an up direction of invalid length");
    return up.map((x) => x / length);
  }

  /** Clip planes of the model's cameras, as in viewer/subject.cpp: settings of other programs are ignored. */
  planes() {
    const settings = this.extension.settings ?? {};
    const number = (value, otherwise) => (typeof value === "number" ? value : otherwise);
    const near = number(settings.test_near, 0.025), far = number(settings.far, 2.5);
    if (!(near >= 1e-6 && near < far && far < 1e37))
      throw new SoupError(`${this.name}: has invalid clip planes; train it again`);
    return { near, far, dropNear: typeof settings.drop_near === "boolean"
      ? settings.drop_near : "steps" in Object(settings) };
  }

  cameras() {
    const { cameras = [] } = this.extension;
    const read = Array.isArray(cameras)
      ? cameras.map((row) => this.camera(row, row.name, row.test === true, this.pose(row))) : this.table(cameras);
    if (!read.every(possible)) throw this.damaged("has an invalid camera");
    // Array.sort is stable: within test and training views the order of the file remains.
    return read.sort((a, b) => Number(b.test) - Number(a.test));
  }

  /** Reads a camera. lens: an object with `size`, `focal` and `centre`. */
  camera(lens, name, test, pose) {
    const [width, height] = [0, 1].map((i) => this.whole(lens.size[i]));
    const [fx, fy, cx, cy] = [lens.focal[0], lens.focal[1], lens.centre[0], lens.centre[1]].map((x) => this.number(x));
    return { name: String(name), test, width, height, fx, fy, cx, cy, pose };
  }

  /** Pose in files of versions 1 and 2. */
  pose(row) {
    return Array.from({ length: 12 }, (_, i) => this.number(row.world_to_camera[i]));
  }

  /** Cameras of versions 3 and later: photographs of one lens share its entry. */
  table({ names, test, lenses, lens, poses }) {
    const bytes = this.view(poses);
    if (!Array.isArray(names) || bytes.length !== 4 * POSE_FLOATS * names.length)
      throw this.damaged("has different numbers of poses and cameras");
    const numbers = this.floats(bytes), ofTest = new Set(test.map((index) => this.whole(index)));
    if (!numbers) throw this.damaged("has an invalid camera");
    if ([...ofTest].some((index) => index >= names.length))
      throw this.damaged("has a test view without a camera");
    return names.map((name, i) => {
      const its = lenses[lens ? this.whole(lens[i]) : 0];
      return this.camera(its, name, ofTest.has(i), poseOf(numbers.subarray(POSE_FLOATS * i, POSE_FLOATS * (i + 1))));
    });
  }
}

function possible({ width, height, fx, fy, cx, cy, pose }) {
  const largest = 1e6;  // pixels or normalised units
  const row = (i) => pose.slice(4 * i, 4 * i + 3);
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const rotates = [0, 1, 2]
    .every((i) => [0, 1, 2].every((j) => Math.abs(dot(row(i), row(j)) - (i === j ? 1 : 0)) < 1e-3));
  return width > 0 && height > 0 && width <= 65535 && height <= 65535 &&
    [fx, fy].every((f) => f > 1e-3 && f < largest) &&
    [cx, cy, pose[3], pose[7], pose[11]].every((x) => Math.abs(x) < largest) && rotates;
}
