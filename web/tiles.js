// Cuts atlas pages that exceed the texture size of a device into overlapping tiles. A lattice lies completely in the
// tile in which it begins.
import { MAX_LEVEL } from "./model.js";

const REACH = 1 << MAX_LEVEL;  // extent of the largest lattice, texels

/**
 * @typedef {object} Cut the tiles of one page
 * @property {number} page
 * @property {number} first number of the first tile
 * @property {number} across number of tiles per row
 * @property {number} down number of rows
 * @property {number} strideX texels from a tile to the next one
 * @property {number} strideY
 */

/** Cuts one side of a page into the fewest tiles, as small as possible: their number, distance and length. */
function cutSide(side, most) {
  if (side <= most) return { count: 1, stride: side, length: side };
  const count = Math.ceil((side - REACH) / (most - REACH)), stride = Math.ceil((side - REACH) / count);
  return { count, stride, length: stride + REACH };
}

/**
 * Cuts pages into tiles.
 * @param {{width: number, height: number}[]} pages
 * @param {number} most largest side of a texture, more than 32
 * @returns {{cuts: Cut[], count: number, width: number, height: number}} count: number of tiles;
 *   width, height: size of the largest one
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
 * Converts a place on a page to a place on a tile; `page` of the result is the tile.
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
