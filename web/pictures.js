// Decodes the images of a model without changing any pixel value.
import { SoupError } from "./error.js";
import { uploadedPixel } from "./upload.js";

/**
 * Decodes a PNG without changing its values. Without these options browsers apply colour profiles and multiply features
 * by opacity, which cannot be undone if the opacity is 0.
 * @param {Uint8Array} bytes
 * @returns {Promise<ImageBitmap>}
 */
const decodePng = (bytes) =>
  createImageBitmap(new Blob([bytes], { type: "image/png" }),
    { premultiplyAlpha: "none", colorSpaceConversion: "none" });

/** Converts an image for upload: decodes PNG files, wraps RGBA bytes. */
const decodePicture = ({ width, height }, picture) =>
  picture.rgba ? new ImageData(new Uint8ClampedArray(picture.rgba.buffer), width, height) : decodePng(picture);

/** A PNG of one pixel that changes if a browser applies alpha or gamma, and its correct value. */
const PROBE = {
  png: Uint8Array.from(
    atob("iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAABGdBTUEAAYagMeiWXwAAAA1JREFUeNpjOJFixAQABLcBYSanGRMAAAAA" +
      "SUVORK5CYII="),
    (letter) => letter.charCodeAt(0)),
  rgba: [200, 100, 50, 2],
};

/**
 * Checks that decodePng returns exact values. Old browsers silently ignore its options.
 * @param {WebGL2RenderingContext} gl
 * @throws {SoupError} if the pixel has changed
 */
export async function checkDecoder(gl) {
  const picture = await decodePng(PROBE.png);
  const rgba = gl.isContextLost() ? null : uploadedPixel(gl, picture);
  picture.close();
  if (rgba?.some((value, i) => value !== PROBE.rgba[i]))
    throw new SoupError(
      "this browser alters the pixels of images (its WebGL2 is too old, or a privacy setting does it); " +
      "use another browser");
}

/**
 * @param {import("./model.js").Model} model
 * @returns {Promise<(ImageBitmap | ImageData)[][]>} two images per page; the caller closes bitmaps
 * @throws {SoupError} if an image is damaged
 */
export async function decodePages(model) {
  let pages;
  try {
    pages = await Promise.all(model.pages
      .map((page) => Promise.all(page.features.map((picture) => decodePicture(page, picture)))));
  } catch {
    throw new SoupError(
      `${model.name}: has a texture that cannot be decoded; the file is truncated or damaged, export or copy it again`);
  }
  const fits = pages.flat().every((picture, i) => picture.width === model.pages[i >> 1].width &&
    picture.height === model.pages[i >> 1].height);
  if (!fits) throw new SoupError(`${model.name}: has a damaged texture; export or copy it again`);
  return pages;
}
