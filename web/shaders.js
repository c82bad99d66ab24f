// The two passes in GLSL ES 3.00, equal to those for Vulkan in shaders/ except for what WebGL2 lacks:
//  - It can neither multisample integers nor read single samples. The first pass is drawn once per sample, shifted by
//    the offset of the sample in the pixel, into its own layer. The samples are the same as in the native renderer.
//  - It has no textureGather: opacity takes three fetches.
//  - It has no specialisation constants: the weights of the MLP are written into the shader text.
// Frames are drawn top row first, as in Vulkan, and flipped when they are drawn to the canvas.

export const TABLE_WIDTH = 1024;  // triangle t is at texel (t % 1024, t / 1024) of the triangle table
export const UNITS = { table: 0, features: 1, opacities: 2, hits: 3 };  // texture units

/**
 * Sample positions of each kind of anti-aliasing, in pixels from the pixel centre.
 * `shadeAll`: opacity and colour are evaluated at each sample; otherwise at the pixel centre, and opacity is
 * extrapolated to the samples by its slope.
 */
export const SAMPLES = {
  none: { at: [[0, 0]], shadeAll: false },
  // The standard sample locations of Vulkan.
  msaa: { at: [[-0.125, -0.375], [0.375, -0.125], [-0.375, 0.125], [0.125, 0.375]], shadeAll: false },
  ssaa: { at: [[-0.25, -0.25], [0.25, -0.25], [-0.25, 0.25], [0.25, 0.25]], shadeAll: true },
};

const HEADER = `#version 300 es
precision highp float;
precision highp int;
precision highp sampler2DArray;
precision highp usampler2DArray;
`;

const FRAME_MEMBERS = `
  mat4 clip_from_world;
  vec4 eye;                // world
  vec4 ray, ray_x, ray_y;  // direction from the surface to the camera at NDC (x, y): ray + x ray_x + y ray_y
  vec4 background;
  vec2 pixel;              // NDC per pixel
  vec2 corner;             // upper left corner of the frame, from the lower left corner of the canvas, pixels
`;
const FRAME = `
layout(std140) uniform Frame {${FRAME_MEMBERS}};
`;

/** The shader without #version and with single uniforms instead of a block, as three.js needs it. */
export const withPlainUniforms = (shader) =>
  shader.replace("#version 300 es\n", "").replace(FRAME, FRAME_MEMBERS.replace(/^ {2}(?=\w)/gm, "uniform "));

const TRIANGLES = `
uniform usampler2DArray table;
struct SoupTriangle {
  vec3 v2, e0, e1;   // world; the other corners are v2 + e0 and v2 + e1
  uint place;        // x0 | y0 << 16 in the atlas
  uint layer_level;  // level | page << 8 | turned << 16
};

SoupTriangle soup_triangle(uint t) {
  ivec2 column = ivec2(int(t & ${TABLE_WIDTH - 1}u), int(t / ${TABLE_WIDTH}u));
  uvec4 a = texelFetch(table, ivec3(column, 0), 0), b = texelFetch(table, ivec3(column, 1), 0);
  uvec4 c = texelFetch(table, ivec3(column, 2), 0);
  return SoupTriangle(uintBitsToFloat(a.xyz), uintBitsToFloat(b.xyz), uintBitsToFloat(c.xyz), a.w, b.w);
}
`;

// Three lattice points. Their weights: w.x for i0, w.y for i1, 1 - w.x - w.y for i2.
const LATTICE = `
struct LatticeCell {
  ivec3 i0, i1, i2;  // texels of the atlas; z: page
  vec2 w;
};

vec3 to_camera(vec2 ndc) { return ray.xyz + ndc.x * ray_x.xyz + ndc.y * ray_y.xyz; }

// Computed from the ray: interpolation would use corners that the rasteriser has snapped to its grid. With several
// samples the pixel centre can lie outside of the triangle; it is clamped to the edge.
vec2 barycentrics(SoupTriangle t, vec2 ndc) {
  vec3 direction = to_camera(ndc), s = eye.xyz - t.v2, p = cross(direction, t.e1);
  float det = dot(p, t.e0), scale = det != 0.0 ? 1.0 / det : 0.0;
  float b0 = clamp(dot(p, s) * scale, 0.0, 1.0);
  return vec2(b0, clamp(dot(cross(s, t.e0), direction) * scale, 0.0, 1.0 - b0));
}

LatticeCell lattice_cell(SoupTriangle t, vec2 b) {
  int r = 1 << int(t.layer_level & 255u), side = (t.layer_level >> 16) != 0u ? -1 : 1;
  vec2 u = b * float(r);
  int x = min(int(u.x), r - 1), y = min(int(u.y), r - 1 - x);
  vec2 f = u - vec2(x, y);
  bool lower = f.x + f.y <= 1.0;
  // In cells along the hypotenuse rounding can select the upper half, which has no sample.
  bool upper = !lower && x + y + 2 <= r;
  ivec2 at = ivec2(int(t.place & 65535u), int(t.place >> 16)) + side * ivec2(x, y);
  int page = int((t.layer_level >> 8) & 255u);
  return LatticeCell(ivec3(at + ivec2(side, 0), page), ivec3(at + ivec2(0, side), page),
                     ivec3(upper ? at + side : at, page), lower ? f : 1.0 - f.yx);
}
`;

/**
 * Depth in clip space. `reversed` and `zeroToOne`: 1 at the near plane, 0 at the far plane, because floats are dense
 * near 0; zeroToOne needs EXT_clip_control. `usual`: unchanged from clip_from_world.
 */
export const DEPTHS = { usual: "p.z", reversed: "-p.z", zeroToOne: "0.5 * (p.w - p.z)" };

/** First pass, vertex shader. depth: one of DEPTHS. */
export const soupVertex = (depth) => `${HEADER}${FRAME}${TRIANGLES}
layout(location = 0) in vec3 position;  // world
layout(location = 1) in uint number;    // number of the triangle, from 1
uniform vec2 move;         // NDC from the sample to the pixel centre
// Omit triangles that reach behind the camera, as in training, instead of clipping them.
uniform bool drop_behind;
flat out uint triangle;

float depth_of(vec3 v) { return (clip_from_world * vec4(v, 1.0)).w; }

void main() {
  triangle = number;
  vec4 p = clip_from_world * vec4(position, 1.0);
  gl_Position = vec4(p.xy + move * p.w, ${depth}, p.w);
  if (drop_behind) {
    SoupTriangle t = soup_triangle(number - 1u);
    if (min(depth_of(t.v2), min(depth_of(t.v2 + t.e0), depth_of(t.v2 + t.e1))) <= 0.0)
      gl_Position = vec4(2.0, 2.0, 0.0, 1.0);
  }
}
`;

/** First pass, opaque triangles: reads no texture, so early depth tests are possible. */
export const opaqueFragment = `${HEADER}
flat in uint triangle;
layout(location = 0) out uint hit;
void main() { hit = triangle; }
`;

/** First pass, triangles with holes: reads only opacity, one byte per lattice point. */
export const maskedFragment = (aa) => `${HEADER}${FRAME}${TRIANGLES}${LATTICE}
uniform sampler2DArray opacities;
uniform vec2 offset;  // of the sample, pixels
flat in uint triangle;
layout(location = 0) out uint hit;

float opacity(vec2 at) {
  SoupTriangle t = soup_triangle(triangle - 1u);
  LatticeCell c = lattice_cell(t, barycentrics(t, at * pixel - 1.0));
  float v2 = texelFetch(opacities, c.i2, 0).x;
  return v2 + c.w.x * (texelFetch(opacities, c.i0, 0).x - v2) + c.w.y * (texelFetch(opacities, c.i1, 0).x - v2);
}

void main() {
${SAMPLES[aa].at.length > 1 && !SAMPLES[aa].shadeAll
    ? `  float alpha = opacity(gl_FragCoord.xy), x = dFdx(alpha), y = dFdy(alpha);
  if (alpha + offset.x * x + offset.y * y < 0.5) discard;`
    : "  if (opacity(gl_FragCoord.xy + offset) < 0.5) discard;"}
  hit = triangle;
}
`;

/** One triangle that covers the viewport. */
export const screenVertex = `${HEADER}
void main() { gl_Position = vec4(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0, 0.0, 1.0); }
`;

/** A GLSL float literal. Nine digits are exact; GLSL needs a point or an exponent. */
export function literal(value) {
  const text = String(Number(value.toPrecision(9)));
  return /[.e]/.test(text) ? text : `${text}.0`;
}

const vector = (type, values) => `${type}(${Array.from(values, literal).join(",")})`;

/**
 * GLSL expressions of a layer of the MLP, one per vector of up to four outputs.
 * @param {Float32Array} weights [outputs][16], row-major
 * @param {Float32Array} biases [outputs]
 * @param {string} input name of an array of four vec4
 */
export function layer(weights, biases, input) {
  const outputs = biases.length, rows = Math.min(4, outputs);
  const expressions = [];
  for (let first = 0; first < outputs; first += rows) {
    let sum = vector(`vec${rows}`, biases.subarray(first, first + rows));
    for (let j = 0; j < 4; ++j) {
      const columns = [];
      for (let column = 4 * j; column < 4 * j + 4; ++column)
        for (let row = first; row < first + rows; ++row) columns.push(weights[16 * row + column]);
      sum += `\n    + ${vector(`mat4x${rows}`, columns)} * ${input}[${j}]`;
    }
    expressions.push(sum);
  }
  return expressions;
}

/** GLSL of a 16 -> 16 -> 16 -> 3 MLP with ReLU, ReLU and sigmoid; the weights are literals. */
export function mlpFunction(mlp) {
  const hidden = (weights, input) =>
    layer(mlp.subarray(weights, weights + 256), mlp.subarray(weights + 256, weights + 272), input)
      .map((sum) => `max(${sum}, 0.0)`).join(",\n");
  return `
vec3 mlp(vec4 x[4]) {
  vec4 h[4] = vec4[4](${hidden(0, "x")});
  vec4 g[4] = vec4[4](${hidden(272, "h")});
  return 1.0 / (1.0 + exp(-(${layer(mlp.subarray(544, 592), mlp.subarray(592, 595), "g")[0]})));
}
`;
}

/** GLSL function for the colour of a triangle at a point of the screen. */
const surface = (mlp) => `${mlpFunction(mlp)}
uniform sampler2DArray features;  // features 0 to 3 of a page; 4 to 7 are in the next layer

vec4 mixed(LatticeCell c, int half_page) {
  ivec3 scale = ivec3(1, 1, 2), layer = ivec3(0, 0, half_page);
  vec4 v2 = texelFetch(features, c.i2 * scale + layer, 0);
  return v2 + c.w.x * (texelFetch(features, c.i0 * scale + layer, 0) - v2) +
    c.w.y * (texelFetch(features, c.i1 * scale + layer, 0) - v2);
}

vec3 surface_colour(uint hit, vec2 ndc) {
  SoupTriangle t = soup_triangle(hit - 1u);
  LatticeCell c = lattice_cell(t, barycentrics(t, ndc));
  vec4 low = mixed(c, 0), high = mixed(c, 1);
  vec3 v = normalize(to_camera(ndc));
  // Seven features, then the real spherical harmonics up to degree 2.
  vec4 x[4] = vec4[4](low, vec4(high.xyz, 0.28209479),
    vec4(-0.48860251 * v.y, 0.48860251 * v.z, -0.48860251 * v.x, 1.09254843 * v.x * v.y),
    vec4(-1.09254843 * v.y * v.z, 0.31539157 * (2.0 * v.z * v.z - v.x * v.x - v.y * v.y), -1.09254843 * v.x * v.z,
         0.54627422 * (v.x * v.x - v.y * v.y)));
  return (1.0 - low.w) * low.xyz + low.w * mlp(x);
}
`;

/** Second pass: features and MLP once per pixel, or once per visible triangle in the pixel. */
export const shadeFragment = (aa, mlp) => `${HEADER}${FRAME}${TRIANGLES}${LATTICE}${surface(mlp)}
uniform usampler2DArray hits;
layout(location = 0) out vec4 colour;

void main() {
  vec2 at = vec2(gl_FragCoord.x - corner.x, corner.y - gl_FragCoord.y);
${SAMPLES[aa].at.length === 1 ? `
  uint hit = texelFetch(hits, ivec3(ivec2(at), 0), 0).x;
  colour = background;
  if (hit != 0u) colour = vec4(surface_colour(hit, at * pixel - 1.0), 1.0);` : `
  uint hit[4];
  int left = 0;  // bits of the samples still to be added
  vec3 sum = vec3(0.0);
  float alpha = 0.0;  // times 4
  for (int i = 0; i < 4; ++i) {
    hit[i] = texelFetch(hits, ivec3(ivec2(at), i), 0).x;
    alpha += hit[i] == 0u ? background.a : 1.0;
    if (hit[i] == 0u) sum += background.rgb;
    else left |= 1 << i;
  }
  // On a CPU a shorter loop saves work, a branch does not.
  while (left != 0) {
    int i = (left & 1) != 0 ? 0 : (left & 2) != 0 ? 1 : (left & 4) != 0 ? 2 : 3;
    uint h = i == 0 ? hit[0] : i == 1 ? hit[1] : i == 2 ? hit[2] : hit[3];
${SAMPLES[aa].shadeAll ? `
    vec2 offset = vec2(i & 1, i >> 1) * 0.5 - 0.25;
    sum += surface_colour(h, (at + offset) * pixel - 1.0);
    left &= left - 1;` : `
    int same = 0;
    float count = 0.0;
    for (int j = 0; j < 4; ++j)
      if (hit[j] == h) {
        same |= 1 << j;
        count += 1.0;
      }
    sum += count * surface_colour(h, at * pixel - 1.0);
    left &= ~same;`}
  }
  colour = vec4(0.25 * sum, 0.25 * alpha);`}
}
`;

/** Shades triangles directly, for engines that determine visibility by their own depth test. */
export const meshFragment = (mlp) => `${HEADER}${FRAME}${TRIANGLES}${LATTICE}${surface(mlp)}
uniform bool linear;  // the target stores linear colours, not sRGB
flat in uint triangle;
layout(location = 0) out vec4 colour;

void main() {
  vec3 c = surface_colour(triangle, gl_FragCoord.xy * pixel - 1.0);
  colour = vec4(linear ? mix(c / 12.92, pow((c + 0.055) / 1.055, vec3(2.4)), step(0.04045, c)) : c, 1.0);
}
`;

/** Copies opacity to its own texture, which has a quarter of the bytes that the first pass would read. */
export const opacityFragment = `${HEADER}
uniform sampler2DArray features;
uniform int layer;
layout(location = 0) out float opacity;
void main() { opacity = texelFetch(features, ivec3(gl_FragCoord.xy, layer), 0).a; }
`;

/**
 * Computes the minimum and maximum opacity of each triangle's lattice, one pixel per triangle at its place in the
 * table. Interpolated opacities lie between them.
 */
export const rangeFragment = `${HEADER}${TRIANGLES}
uniform sampler2DArray features;
uniform uint triangles;
layout(location = 0) out vec4 range;

void main() {
  uint t = uint(gl_FragCoord.x) + uint(gl_FragCoord.y) * ${TABLE_WIDTH}u;
  range = vec4(0.0);
  if (t >= triangles) return;
  SoupTriangle s = soup_triangle(t);
  int r = 1 << int(s.layer_level & 255u), side = (s.layer_level >> 16) != 0u ? -1 : 1;
  int page = int((s.layer_level >> 8) & 255u);
  ivec2 at = ivec2(int(s.place & 65535u), int(s.place >> 16));
  range.x = 1.0;
  for (int y = 0; y <= r; ++y)
    for (int x = 0; x + y <= r; ++x) {
      float value = texelFetch(features, ivec3(at + side * ivec2(x, y), 2 * page + 1), 0).a;
      range.xy = vec2(min(range.x, value), max(range.y, value));
    }
}
`;
