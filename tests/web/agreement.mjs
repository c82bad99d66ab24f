// Whether two pictures show the same: which pixels are ties, and how much the others differ.

/** As shaders/common/surface_colour.h: `--mode triangles` shows it. */
function randomColour(triangle) {
  let h = Math.imul(triangle, 0x9e3779b9) >>> 0;
  h = Math.imul(h ^ (h >>> 16), 0x85ebca6b) >>> 0;
  h = (h ^ (h >>> 13)) >>> 0;
  return [h & 255, (h >>> 8) & 255, (h >>> 16) & 255].map((c) => 255 * (0.25 + (0.75 * c) / 255));
}

/**
 * A pixel is a tie where a sample sees another triangle than the native renderer's.
 * @param {Uint8Array} ours RGBA
 * @param {Uint32Array[]} hits numbers (from 1) of the triangles that each sample sees, 0 for none
 * @param {Uint8Array} native RGB
 * @param {Uint8Array} triangles RGB, the native picture of `--mode triangles` with the same anti-aliasing
 * @param {number[]} background 0..1
 * @returns {{pixels: number, covered: number, ties: number, psnr: number}} psnr: in dB, of the pixels that are no ties;
 *   infinite where all are the same
 */
export function compare(ours, hits, native, triangles, background) {
  const pixels = native.length / 3, colours = new Map([[0, background.map((c) => 255 * c)]]);
  const colourOf = (hit) => colours.get(hit) ?? colours.set(hit, randomColour(hit - 1)).get(hit);
  let ties = 0, squares = 0, covered = 0;
  for (let p = 0; p < pixels; ++p) {
    const expected = [0, 0, 0];
    for (const layer of hits) colourOf(layer[p]).forEach((c, i) => { expected[i] += c / hits.length; });
    if (hits.some((layer) => layer[p] !== 0)) ++covered;
    // The native picture is rounded to whole numbers.
    if (expected.some((c, i) => Math.abs(c - triangles[3 * p + i]) > 0.6)) ++ties;
    else for (let i = 0; i < 3; ++i) squares += ((ours[4 * p + i] - native[3 * p + i]) / 255) ** 2;
  }
  return { pixels, covered, ties, psnr: -10 * Math.log10(squares / (3 * (pixels - ties))) };
}
