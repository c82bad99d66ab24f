// Decodes the lattices of a model.glb, which are stored as arithmetically coded differences from coarser samples
// (engine/format/lattice_code.cpp, lattice_hierarchy.cpp), and arranges them in an atlas (engine/soup/atlas.cpp).
import { RangeDecoder } from "./range_decoder.js";

const CHANNELS = 8, FINEST_LEVEL = 5;
/** First index of the probabilities of each kind of decision. */
const LEVELS = 0, ZERO = 64, SIGN = ZERO + 4 * CHANNELS * 16 * 8, BITS = SIGN + CHANNELS * 9,
  REST = BITS + 4 * 16 * 8 * 7;
const CHANCES = REST + 8 * CHANNELS * 64;

const latticeIndex = (x, y) => ((x + y) * (x + y + 1)) / 2 + y;

/**
 * By level: four numbers per sample (index, a, b, depth), coarse samples first. a and b are the coarser samples between
 * which it lies; -1 for the first sample.
 */
const refinements = Array.from({ length: FINEST_LEVEL + 1 }, (_, level) => {
  const r = 1 << level, right = latticeIndex(r, 0),
    all = [0, -1, -1, 0, right, 0, 0, 0, latticeIndex(0, r), 0, right, 0];
  for (let depth = 1; depth <= level; ++depth)
    for (let h = r >> depth, y = 0; y <= r; y += h)
      for (let x = 0; x + y <= r; x += h) {
        const oddX = (x / h) & 1, oddY = (y / h) & 1;
        if (!oddX && !oddY) continue;
        const dx = oddX ? h : 0, dy = oddY ? (oddX ? -h : h) : 0;
        all.push(latticeIndex(x, y), latticeIndex(x - dx, y - dy), latticeIndex(x + dx, y + dy), depth);
      }
  return Int32Array.from(all);
});

/** Number of samples of a lattice of this level. */
export const samplesAt = (level) => (((1 << level) + 1) * ((1 << level) + 2)) / 2;

function halfOctave(n) {
  const octave = 31 - Math.clz32(n);
  return octave === 0 ? 0 : 2 * octave + ((n >> (octave - 1)) & 1);
}

const signOf = (difference) => (difference < 0 ? 0 : difference === 0 ? 1 : 2);

/** Decodes one difference. The other arguments select the probabilities, see decodeTriangle. */
function difference(decoder, kind, channel, near, beside, signs) {
  if (!decoder.decide(ZERO + ((kind * CHANNELS + channel) * 16 + near) * 8 + beside)) return 0;
  const negative = decoder.decide(SIGN + channel * 9 + signs), bits = BITS + ((kind * 16 + near) * 8 + beside) * 7;
  let n = 0, number = 1;
  while (n < 7 && decoder.decide(bits + n)) ++n;
  for (let bit = 0; bit < n; ++bit)
    number = (number << 1) | decoder.decide(REST + (n * CHANNELS + channel) * 64 + Math.min(number, 63));
  return negative ? -number : number;
}

/** Decodes the differences and values of one triangle, CHANNELS per sample. */
function decodeTriangle(decoder, level, steps, differences, values, begin) {
  const samples = refinements[level], recent = new Int32Array(CHANNELS).fill(32);
  for (let i = 0; i < samples.length; i += 4) {
    const here = samples[i] * CHANNELS, a = samples[i + 1] * CHANNELS, b = samples[i + 2] * CHANNELS,
      depth = samples[i + 3];
    const kind = depth === 0 ? 3 : Math.min(level - depth, 2);
    for (let c = 0; c < CHANNELS; ++c) {
      const between = depth === 0 ? 0 : Math.abs(differences[a + c]) + Math.abs(differences[b + c]);
      const near = Math.min(15, halfOctave(4 + 4 * between + recent[c]) - 4);
      const one = c > 0 ? differences[here + c - 1] : 0, two = c > 1 ? differences[here + c - 2] : 0;
      const beside = Math.min(7, halfOctave(1 + 2 * Math.abs(one) + Math.abs(two)));
      const d = difference(decoder, kind, c, near, beside, 3 * signOf(one) + signOf(two));
      differences[here + c] = d;
      recent[c] += (16 * Math.abs(d) - recent[c]) >> 2;
      const middle = a < 0 ? 128 : (values[begin + a + c] + values[begin + b + c] + 1) >> 1;
      values[begin + here + c] = Math.min(255, Math.max(0, middle + d * steps[c]));
    }
  }
}

/**
 * Decodes the textures of all triangles; null if the bytes end too early.
 * @param {Uint8Array} bytes
 * @param {number} triangles
 * @param {number[]} steps quantisation step of each feature
 * @returns {{levels: Uint8Array, offsets: Uint32Array, values: Uint8Array} | null} offsets: in samples of eight
 *   values
 */
export function decodeLattices(bytes, triangles, steps) {
  const decoder = new RangeDecoder(bytes, CHANCES), differences = new Int32Array(samplesAt(FINEST_LEVEL) * CHANNELS);
  const levels = new Uint8Array(triangles), offsets = new Uint32Array(triangles);
  let values = new Uint8Array(1 << 16), samples = 0, level = 0;
  for (let t = 0; t < triangles; ++t) {
    let node = 1;
    for (let bit = 0; bit < 3; ++bit) node = (node << 1) | decoder.decide(LEVELS + level * 8 + node);
    level = node & 7;
    if (level > FINEST_LEVEL || decoder.ended) return null;
    levels[t] = level;
    offsets[t] = samples;
    const needed = (samples + samplesAt(level)) * CHANNELS;
    if (needed > values.length) {
      const larger = new Uint8Array(Math.max(needed, 2 * values.length));
      larger.set(values);
      values = larger;
    }
    decodeTriangle(decoder, level, steps, differences, values, samples * CHANNELS);
    samples += samplesAt(level);
  }
  return decoder.ended ? null : { levels, offsets, values };
}

/**
 * Places lattices of these levels on pages of at most `side` x `side` texels. A block holds two lattices of one level.
 * @param {Uint8Array} levels
 * @param {number} side
 * @returns {{places: DataView, pages: {width: number, height: number}[]}} places: 8 bytes per triangle, see placeOf
 */
export function makeAtlas(levels, side) {
  const block = (level) => ({ width: (1 << level) + 3, height: (1 << level) + 2 });
  const order = Array.from(levels.keys()).sort((a, b) => levels[b] - levels[a] || a - b);
  let area = 0, width = 64;
  for (const level of levels) area += Math.floor((block(level).width * block(level).height) / 2) + 1;
  while (2 * width <= side && width * width < area * (17 / 16)) width *= 2;
  const places = new DataView(new ArrayBuffer(8 * levels.length)), heights = [0];
  let x = 0, y = 0, shelf = 0;
  for (let i = 0; i < order.length; ) {
    const level = levels[order[i]], size = block(level);
    if (x + size.width > width) [x, y, shelf] = [0, y + shelf, 0];
    if (y + size.height > side) {
      heights.push(0);
      x = y = shelf = 0;
    }
    shelf = Math.max(shelf, size.height);
    for (let half = 0; half < 2 && i < order.length && levels[order[i]] === level; ++half, ++i) {
      const at = 8 * order[i];
      places.setUint16(at, half ? x + size.width - 1 : x, true);
      places.setUint16(at + 2, half ? y + size.height - 1 : y, true);
      places.setUint8(at + 4, level);
      places.setUint8(at + 5, heights.length - 1);
      places.setUint8(at + 6, half);
    }
    heights[heights.length - 1] = Math.max(heights.at(-1), y + size.height);
    x += size.width;
  }
  return { places, pages: heights.map((height) => ({ width, height: Math.max(1, height) })) };
}

/**
 * Fills the pages of an atlas with RGBA bytes: features 0 to 3 and features 4 to 7; feature 7 is the opacity.
 * @param {{levels: Uint8Array, offsets: Uint32Array, values: Uint8Array}} lattices
 * @param {{places: DataView, pages: {width: number, height: number}[]}} atlas
 * @returns {{width: number, height: number, features: {rgba: Uint8Array}[]}[]}
 */
export function fillAtlas({ levels, offsets, values }, { places, pages }) {
  const filled = pages
    .map(({ width, height }) =>
      ({ width, height, features: [0, 1].map(() => ({ rgba: new Uint8Array(4 * width * height) })) }));
  for (let t = 0; t < levels.length; ++t) {
    const x0 = places.getUint16(8 * t, true), y0 = places.getUint16(8 * t + 2, true),
      page = filled[places.getUint8(8 * t + 5)];
    const sign = places.getUint8(8 * t + 6) ? -1 : 1, r = 1 << levels[t];
    for (let y = 0; y <= r; ++y)
      for (let x = 0; x + y <= r; ++x) {
        const from = (offsets[t] + latticeIndex(x, y)) * CHANNELS,
          to = 4 * ((y0 + sign * y) * page.width + x0 + sign * x);
        for (let c = 0; c < 4; ++c) {
          page.features[0].rgba[to + c] = values[from + c];
          page.features[1].rgba[to + c] = values[from + 4 + c];
        }
      }
  }
  return filled;
}
