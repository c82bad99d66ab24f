// Atlas pages that are larger than a device's textures, cut into tiles: each tile holds every lattice that begins in it
// as a whole.
import { MAX_LEVEL } from "./model.js";

const REACH = 1 << MAX_LEVEL;  // texels from the first to the last of a lattice

/**
 * @typedef {object} Cut one page in tiles
 * @property {number} page
 * @property {number} first number of its first tile
 * @property {number} across tiles side by side
 * @property {number} down
 * @property {number} strideX texels from a tile to the next one
 * @property {number} strideY
 */

/**
 * One side of a page: how many tiles, how far apart and how long they are. The fewest that fit, and those as small as
 * they can be.
 */
function cutSide(side, most) {
  if (side <= most) return { count: 1, stride: side, length: side };
  const count = Math.ceil((side - REACH) / (most - REACH)), stride = Math.ceil((side - REACH) / count);
  return { count, stride, length: stride + REACH };
}

/**
 * @param {{width: number, height: number}[]} pages
 * @param {number} most longest side of a texture, above 32
 * @returns {{cuts: Cut[], count: number, width: number, height: number}} count: of tiles; width and height hold each of
 *   them
 */
export function cutPages(pages, most) {
  const result = { cuts: [], count: 0, width: 0, height: 0 };
  pages.forEach(({ width, height }, page) => {
    const x = cutSide(width, most), y = cutSide(height, most);
    result.cuts.push({ page, first: result.count, across: x.count, down: y.count, strideX: x.stride,
      strideY: y.stride });
    result.count += x.count * y.count;
    result.width = Math.max(result.width, x.length);
    result.height = Math.max(result.height, y.length);
  });
  return result;
}

/**
 * A place on a page as one on a tile, which is its `page` then.
 * @param {ReturnType<typeof import("./model.js").placeOf>} place
 * @param {Cut[]} cuts
 */
export function placeOnTile(place, cuts) {
  const { first, across, down, strideX, strideY } = cuts[place.page], back = place.turned ? 1 << place.level : 0;
  const column = Math.min(Math.floor((place.x0 - back) / strideX), across - 1),
    row = Math.min(Math.floor((place.y0 - back) / strideY), down - 1);
  return { ...place, page: first + row * across + column, x0: place.x0 - column * strideX,
    y0: place.y0 - row * strideY };
}
