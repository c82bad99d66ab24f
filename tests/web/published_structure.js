// The pass structure of the published web viewer, written from its description, so that it can be timed beside ours in
// the same browser:
//  - first pass: every fragment of every triangle fetches all eight channels from two look-up tables, drops what is
//    below a half and writes the other seven and its opacity to two targets;
//  - second pass: spherical harmonics and the MLP, from uniform matrices, for every pixel of the picture.
// It reads what `soup-export --format published` writes. Not in it: three.js, whose work on the host is a draw call or
// two a picture.
const PASS_ONE_VERTEX = `#version 300 es
precision highp float;
layout(location = 0) in vec3 position;
layout(location = 1) in uint face;
uniform mat4 clip_from_world;
flat out uint triangle;
out vec3 corner;
void main() {
  int which = gl_VertexID % 3;
  corner = vec3(which == 0, which == 1, which == 2);
  triangle = face;
  gl_Position = clip_from_world * vec4(position, 1.0);
}
`;

const PASS_ONE_FRAGMENT = `#version 300 es
precision highp float;
precision highp int;
precision highp sampler2D;
uniform sampler2D lut0, lut1;
uniform int level, table_width;
flat in uint triangle;
in vec3 corner;
layout(location = 0) out vec4 low;
layout(location = 1) out vec4 high;

ivec2 texel(int x, int y, int r) {
  int k = x + y, n = int(triangle) * ((r + 1) * (r + 2) / 2) + k * (k + 1) / 2 + y;
  return ivec2(n % table_width, n / table_width);
}

void main() {
  int r = 1 << level;
  vec2 u = corner.xy * float(r);
  int x = min(int(u.x), r - 1), y = min(int(u.y), r - 1 - x);
  vec2 f = u - vec2(x, y);
  bool upper = f.x + f.y > 1.0 && x + y + 2 <= r;
  ivec2 i0 = texel(x + 1, y, r), i1 = texel(x, y + 1, r), i2 = upper ? texel(x + 1, y + 1, r) : texel(x, y, r);
  vec2 w = upper ? 1.0 - f.yx : f;
  float rest = 1.0 - w.x - w.y;
  low = w.x * texelFetch(lut0, i0, 0) + w.y * texelFetch(lut0, i1, 0) + rest * texelFetch(lut0, i2, 0);
  high = w.x * texelFetch(lut1, i0, 0) + w.y * texelFetch(lut1, i1, 0) + rest * texelFetch(lut1, i2, 0);
  if (high.a < 0.5) discard;
}
`;

const PASS_TWO_VERTEX = `#version 300 es
void main() { gl_Position = vec4(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0, 0.0, 1.0); }
`;

/** A layer without loops, whose indices a driver would have to work out: four vectors in, vectors of four out. */
const layer = (weights, biases, from, to, outputs) => Array.from({ length: outputs }, (_, i) =>
  `  vec4 ${to}${i} = ${biases(i)}` +
  [0, 1, 2, 3].map((j) => ` + ${weights}[${4 * i + j}] * ${from}${j}`).join("") + ";").join("\n");
const relu = (name) => [0, 1, 2, 3].map((i) => `  ${name}${i} = max(${name}${i}, 0.0);`).join("\n");

const PASS_TWO_FRAGMENT = `#version 300 es
precision highp float;
precision highp sampler2D;
uniform sampler2D low_target, high_target;
uniform mat4 world_from_clip;
uniform vec3 eye, background;
uniform vec2 size;
uniform float up;  // -1: the direction of a view as the published page has it, upside down
uniform mat4 w1[16], w2[16], w3[4];
uniform vec4 b1[4], b2[4], b3;
layout(location = 0) out vec4 colour;

void main() {
  vec4 low = texelFetch(low_target, ivec2(gl_FragCoord.xy), 0);
  vec4 high = texelFetch(high_target, ivec2(gl_FragCoord.xy), 0);
  vec2 ndc = 2.0 * gl_FragCoord.xy / size - 1.0;
  vec4 far = world_from_clip * vec4(ndc.x, up * ndc.y, 1.0, 1.0);
  vec3 v = normalize(eye - far.xyz / far.w);
  vec4 x0 = low, x1 = vec4(high.xyz, 0.28209479);
  vec4 x2 = vec4(-0.48860251 * v.y, 0.48860251 * v.z, -0.48860251 * v.x, 1.09254843 * v.x * v.y);
  vec4 x3 = vec4(-1.09254843 * v.y * v.z, 0.31539157 * (2.0 * v.z * v.z - v.x * v.x - v.y * v.y),
                 -1.09254843 * v.x * v.z, 0.54627422 * (v.x * v.x - v.y * v.y));
${layer("w1", (i) => `b1[${i}]`, "x", "h", 4)}
${relu("h")}
${layer("w2", (i) => `b2[${i}]`, "h", "g", 4)}
${relu("g")}
${layer("w3", () => "b3", "g", "o", 1)}
  vec3 shaded = 1.0 / (1.0 + exp(-o0.xyz));
  colour = vec4(high.a == 0.0 ? background : mix(low.rgb, shaded, low.a), 1.0);
}
`;

function program(gl, vertex, fragment) {
  const made = gl.createProgram();
  for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    gl.attachShader(made, shader);
  }
  gl.linkProgram(made);
  if (!gl.getProgramParameter(made, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(made));
  return { made, at: (name) => gl.getUniformLocation(made, name) };
}

function texture(gl, unit, width, height, picture = null) {
  const made = gl.createTexture();
  gl.activeTexture(gl.TEXTURE0 + unit);
  gl.bindTexture(gl.TEXTURE_2D, made);
  gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA8, width, height);
  for (const filter of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER])
    gl.texParameteri(gl.TEXTURE_2D, filter, gl.NEAREST);
  if (picture) gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, picture);
  return made;
}

/** Corners of all faces, three after three, of a binary little-endian PLY of float vertices and triangles. */
export function cornersOf(bytes) {
  const end = "end_header\n", text = new TextDecoder("latin1").decode(bytes.subarray(0, 4096)),
    header = text.slice(0, text.indexOf(end) + end.length);
  const count = (element) => Number(new RegExp(`element ${element} (\\d+)`).exec(header)[1]),
    vertices = count("vertex"), faces = count("face");
  const data = new DataView(bytes.buffer, bytes.byteOffset + header.length), corners = new Float32Array(9 * faces);
  for (let f = 0; f < faces; ++f)
    for (let c = 0; c < 3; ++c) {
      const vertex = data.getInt32(12 * vertices + 13 * f + 1 + 4 * c, true);
      for (let axis = 0; axis < 3; ++axis)
        corners[9 * f + 3 * c + axis] = data.getFloat32(12 * vertex + 4 * axis, true);
    }
  return corners;
}

/**
 * A matrix [rows][16] as 4 x 4 matrices, each column after column. Missing rows are zero. Matrix 4 i + j maps inputs
 * 4 j to 4 j + 3 to outputs 4 i to 4 i + 3.
 */
function matrices(weights) {
  const rows = weights.length / 16, blocks = Math.ceil(rows / 4), values = new Float32Array(64 * blocks);
  for (let row = 0; row < rows; ++row)
    for (let column = 0; column < 16; ++column)
      values[64 * (row >> 2) + 16 * (column >> 2) + 4 * (column & 3) + (row & 3)] = weights[16 * row + column];
  return values;
}

/** The inverse of a 4 x 4 matrix, column after column, by Gauss and Jordan. */
function inverse(matrix) {
  const rows = Array.from({ length: 4 },
    (_, r) => [...[0, 1, 2, 3].map((c) => matrix[4 * c + r]), ...[0, 1, 2, 3].map((c) => Number(c === r))]);
  for (let c = 0; c < 4; ++c) {
    const pivot =
      rows.slice(c).reduce((best, row, i) => (Math.abs(row[c]) > Math.abs(rows[best][c]) ? c + i : best), c);
    [rows[c], rows[pivot]] = [rows[pivot], rows[c]];
    rows[c] = rows[c].map((value) => value / rows[c][c]);
    for (let r = 0; r < 4; ++r) if (r !== c) rows[r] = rows[r].map((value, k) => value - rows[r][c] * rows[c][k]);
  }
  return new Float32Array([0, 1, 2, 3].flatMap((c) => rows.map((row) => row[4 + c])));
}

export class PublishedStructure {
  #gl; #first; #second; #vertices; #targets = null; #faces; #meta;

  /**
   * @param {HTMLCanvasElement} canvas
   * @param {string} folder address of a scene's files, with a slash at the end
   * @param {{scale: number, middle: number[]}} normalisation of the views: these see scale (vertex - middle)
   */
  static async load(canvas, folder, { scale, middle }) {
    const get = async (name) => (await fetch(folder + name)).arrayBuffer();
    const plain = { premultiplyAlpha: "none", colorSpaceConversion: "none" };
    const picture = async (name) => createImageBitmap(new Blob([await get(name)], { type: "image/png" }), plain);
    const json = async (name) => JSON.parse(new TextDecoder().decode(await get(name)));
    const made = new PublishedStructure();
    await made.#upload(canvas, cornersOf(new Uint8Array(await get("mesh.ply")))
      .map((value, i) => scale * (value - middle[i % 3])), [await picture("lut0.png"), await picture("lut1.png")],
      await json("mlp_weights.json"), await json("meta.json"));
    return made;
  }

  #upload(canvas, corners, tables, mlp, meta) {
    const gl = this.#gl = canvas.getContext("webgl2",
      { alpha: false, antialias: false, depth: false, powerPreference: "high-performance" });
    this.#faces = corners.length / 9;
    this.#meta = meta;
    tables.forEach((table, unit) => texture(gl, unit, table.width, table.height, table));
    this.#vertices = gl.createVertexArray();
    gl.bindVertexArray(this.#vertices);
    const attribute = (index, values, pointer) => {
      gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
      gl.bufferData(gl.ARRAY_BUFFER, values, gl.STATIC_DRAW);
      gl.enableVertexAttribArray(index);
      pointer();
    };
    attribute(0, corners, () => gl.vertexAttribPointer(0, 3, gl.FLOAT, false, 12, 0));
    attribute(1, Uint32Array.from({ length: 3 * this.#faces }, (_, i) => Math.floor(i / 3)),
      () => gl.vertexAttribIPointer(1, 1, gl.UNSIGNED_INT, 4, 0));
    this.#first = program(gl, PASS_ONE_VERTEX, PASS_ONE_FRAGMENT);
    gl.useProgram(this.#first.made);
    gl.uniform1i(this.#first.at("lut1"), 1);
    gl.uniform1i(this.#first.at("level"), meta.level);
    gl.uniform1i(this.#first.at("table_width"), tables[0].width);
    this.#second = program(gl, PASS_TWO_VERTEX, PASS_TWO_FRAGMENT);
    gl.useProgram(this.#second.made);
    gl.uniform1i(this.#second.at("low_target"), 2);
    gl.uniform1i(this.#second.at("high_target"), 3);
    gl.uniform3fv(this.#second.at("background"), meta.background);
    for (const i of [1, 2, 3]) gl.uniformMatrix4fv(this.#second.at(`w${i}`), false, matrices(mlp[`W${i}`]));
    for (const i of [1, 2]) gl.uniform4fv(this.#second.at(`b${i}`), mlp[`b${i}`]);
    gl.uniform4fv(this.#second.at("b3"), [...mlp.b3, 0]);
  }

  /**
   * @param {import("../../web/camera.js").View} view
   * @param {{mirrored?: boolean}} [options] mirrored: directions of view upside down, as the published page has them
   */
  draw(view, { mirrored = false } = {}) {
    const gl = this.#gl, { width, height } = view;
    this.#fit(width, height);
    gl.viewport(0, 0, width, height);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.#targets.framebuffer);
    gl.enable(gl.DEPTH_TEST);
    gl.clearBufferfv(gl.COLOR, 0, [0, 0, 0, 0]);
    gl.clearBufferfv(gl.COLOR, 1, [0, 0, 0, 0]);
    gl.clearBufferfv(gl.DEPTH, 0, [1]);
    // A view's NDC grows downwards, those of WebGL's own targets upwards.
    const clip = Float32Array.from(view.clipFromWorld, (value, i) => (i % 4 === 1 ? -value : value));
    gl.useProgram(this.#first.made);
    gl.uniformMatrix4fv(this.#first.at("clip_from_world"), false, clip);
    gl.bindVertexArray(this.#vertices);
    gl.drawArrays(gl.TRIANGLES, 0, 3 * this.#faces);
    gl.bindVertexArray(null);
    gl.disable(gl.DEPTH_TEST);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.useProgram(this.#second.made);
    gl.uniformMatrix4fv(this.#second.at("world_from_clip"), false, inverse(clip));
    gl.uniform3fv(this.#second.at("eye"), view.eye);
    gl.uniform2f(this.#second.at("size"), width, height);
    gl.uniform1f(this.#second.at("up"), mirrored ? -1 : 1);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }

  #fit(width, height) {
    if (this.#targets?.width === width && this.#targets.height === height) return;
    const gl = this.#gl, framebuffer = gl.createFramebuffer(), depth = gl.createRenderbuffer();
    for (const old of this.#targets?.textures ?? []) gl.deleteTexture(old);
    gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
    const textures = [0, 1].map((i) => texture(gl, 2 + i, width, height));
    textures.forEach((made, i) => gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0 + i, gl.TEXTURE_2D, made,
      0));
    gl.drawBuffers([gl.COLOR_ATTACHMENT0, gl.COLOR_ATTACHMENT1]);
    gl.bindRenderbuffer(gl.RENDERBUFFER, depth);
    gl.renderbufferStorage(gl.RENDERBUFFER, gl.DEPTH_COMPONENT24, width, height);
    gl.framebufferRenderbuffer(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.RENDERBUFFER, depth);
    this.#targets = { width, height, framebuffer, textures };
  }
}
