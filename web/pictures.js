// The pictures of a model as a browser decodes them, pixel for pixel as they are stored.
import { SoupError } from "./error.js";
import { uploadedPixel } from "./upload.js";

/**
 * The pixels exactly as they are stored: lattices are numbers, not colours. Without these options a browser would apply
 * colour profiles, and multiply features by opacity, which cannot be undone where it is 0.
 * @param {Uint8Array} bytes
 * @returns {Promise<ImageBitmap>}
 */
const decodePng = (bytes) =>
  createImageBitmap(new Blob([bytes], { type: "image/png" }),
    { premultiplyAlpha: "none", colorSpaceConversion: "none" });

/** A picture to upload: a PNG file is decoded, bytes are as they are. */
const decodePicture = ({ width, height }, picture) =>
  picture.rgba ? new ImageData(new Uint8ClampedArray(picture.rgba.buffer), width, height) : decodePng(picture);

/** One pixel that a browser alters which minds alpha or the file's gamma, and what its bytes are. */
const PROBE = {
  png: Uint8Array.from(
    atob("iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAABGdBTUEAAYagMeiWXwAAAA1JREFUeNpjOJFixAQABLcBYSanGRMAAAAA" +
      "SUVORK5CYII="),
    (letter) => letter.charCodeAt(0)),
  rgba: [200, 100, 50, 2],
};

/**
 * Old browsers do not know the options of decodePng, and features would be others without a word.
 * @param {WebGL2RenderingContext} gl
 * @throws {SoupError} where pixels are not those of the file
 */
export async function checkDecoder(gl) {
  const picture = await decodePng(PROBE.png);
  const rgba = gl.isContextLost() ? null : uploadedPixel(gl, picture);
  picture.close();
  if (rgba?.some((value, i) => value !== PROBE.rgba[i]))
    throw new SoupError(
      "this browser alters the pixels of pictures (its WebGL2 is too old, or a privacy setting does it); " +
      "use a newer one");
}

/**
 * @param {import("./model.js").Model} model
 * @returns {Promise<(ImageBitmap | ImageData)[][]>} two pictures a page; bitmaps are to be closed
 * @throws {SoupError} when one is damaged
 */
export async function decodePages(model) {
  let pages;
  try {
    pages = await Promise.all(model.pages
      .map((page) => Promise.all(page.features.map((picture) => decodePicture(page, picture)))));
  } catch {
    throw new SoupError(
      `${model.name}: has a texture that cannot be decoded; the file is cut or damaged, export or copy it again`);
  }
  const fits = pages.flat().every((picture, i) => picture.width === model.pages[i >> 1].width &&
    picture.height === model.pages[i >> 1].height);
  if (!fits) throw new SoupError(`${model.name}: has a damaged texture; export or copy it again`);
  return pages;
}
