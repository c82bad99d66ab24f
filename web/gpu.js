// Helpers for WebGL2 objects: texture arrays, framebuffers of one layer, programs.
import { SoupError } from "./error.js";
import { UNITS, screenVertex } from "./shaders.js";

export const FRAME_BINDING = 0;  // binding of the uniform block Frame
const UNIFORMS = ["move", "offset", "drop_behind", "layer", "triangles"];

/**
 * @param {HTMLCanvasElement} canvas
 * @returns {WebGL2RenderingContext}
 * @throws {SoupError} if WebGL2 is not available
 */
export function makeContext(canvas) {
  const gl = canvas.getContext("webgl2",
    { alpha: false, antialias: false, depth: false, stencil: false, powerPreference: "high-performance" });
  if (!gl) throw new SoupError(
    "this browser has no WebGL2, or it is switched off; use a newer one, or allow hardware acceleration");
  return gl;
}

/**
 * Binds texture arrays to their units.
 * @param {WebGL2RenderingContext} gl
 * @param {Record<string, WebGLTexture | null>} textures keys: names in UNITS
 */
export function bindTextures(gl, textures) {
  for (const [name, texture] of Object.entries(textures)) {
    gl.activeTexture(gl.TEXTURE0 + UNITS[name]);
    gl.bindTexture(gl.TEXTURE_2D_ARRAY, texture);
  }
}

/** Creates a texture array without filtering and binds it to the unit of `features`. */
export function makeTexture(gl, format, width, height, layers) {
  const texture = gl.createTexture();
  bindTextures(gl, { features: texture });
  gl.texStorage3D(gl.TEXTURE_2D_ARRAY, 1, format, width, height, layers);
  gl.texParameteri(gl.TEXTURE_2D_ARRAY, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
  gl.texParameteri(gl.TEXTURE_2D_ARRAY, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
  return texture;
}

/** Creates and binds a framebuffer that draws to one layer of a texture array. */
export function layerTarget(gl, texture, layer) {
  const target = gl.createFramebuffer();
  gl.bindFramebuffer(gl.FRAMEBUFFER, target);
  gl.framebufferTextureLayer(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, texture, 0, layer);
  return target;
}

/**
 * @param {WebGL2RenderingContext} gl
 * @param {string} vertex GLSL
 * @param {string} fragment GLSL
 * @returns {{program: WebGLProgram, uniforms: Record<string, WebGLUniformLocation | null>}} its textures are those of
 *   UNITS
 * @throws {SoupError} if it cannot be compiled
 */
export function makeProgram(gl, vertex, fragment) {
  const program = gl.createProgram();
  const shaders = [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]].map(([kind, source]) => {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
    return shader;
  });
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS) && !gl.isContextLost()) {
    const log = [gl.getProgramInfoLog(program), ...shaders.map((shader) => gl.getShaderInfoLog(shader))].filter(Boolean)
      .join(" ");
    throw new SoupError(
      `this browser's WebGL2 cannot compile the shaders (${log.trim().slice(0, 200)}); try another browser`);
  }
  for (const shader of shaders) gl.deleteShader(shader);
  const uniforms = Object.fromEntries(UNIFORMS.map((name) => [name, gl.getUniformLocation(program, name)]));
  gl.useProgram(program);
  for (const [name, unit] of Object.entries(UNITS)) gl.uniform1i(gl.getUniformLocation(program, name), unit);
  const block = gl.getUniformBlockIndex(program, "Frame");
  if (block !== gl.INVALID_INDEX) gl.uniformBlockBinding(program, block, FRAME_BINDING);
  return { program, uniforms };
}

/** Draws all pixels of a target with a program that is used only once. */
export function drawOnce(gl, fragment, target, width, height, setUniforms) {
  const { program, uniforms } = makeProgram(gl, screenVertex, fragment);
  gl.useProgram(program);
  setUniforms(uniforms);
  gl.bindFramebuffer(gl.FRAMEBUFFER, target);
  gl.disable(gl.SCISSOR_TEST);
  gl.viewport(0, 0, width, height);
  gl.drawArrays(gl.TRIANGLES, 0, 3);
  gl.deleteProgram(program);
}
