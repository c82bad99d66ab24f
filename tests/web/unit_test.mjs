// The parts of web/ that need no browser: node --test tests/web/unit_test.mjs
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";
import { fitted, framingOf, viewOf } from "../../web/camera.js";
import { SoupError } from "../../web/error.js";
import { decodeGlb } from "../../web/glb.js";
import { decodeLattices, makeAtlas } from "../../web/lattice.js";
import { decodeModel, placeOf } from "../../web/model.js";
import { Navigation } from "../../web/navigation.js";
import { readPath } from "../../web/path.js";
import { decodeCamera, encodeCamera } from "../../web/permalink.js";
import { isWholePng, pngSize } from "../../web/png.js";
import { cameraOf, stateOf } from "../../web/pose.js";
import { poseOf, quaternionOf, slerp } from "../../web/rotation.js";
import { layer, literal } from "../../web/shaders.js";
import { shotAt } from "../../web/shot.js";
import { cutPages, placeOnTile } from "../../web/tiles.js";
import { decodeVertices } from "../../web/vertices.js";
import { eyeCamera, roomBefore } from "../../web/xr.js";
import { edited } from "./edit_glb.mjs";
import { camerasOf, pathCases } from "./path_cases.mjs";
import { rgbaOf } from "./png.mjs";

const file = new Uint8Array(readFileSync(new URL("../fuzz/corpus/model_file/three_triangles.glb", import.meta.url)));

/** The same model in later versions; the last is of pages, without a mesh. */
const [second, third, fourth] = [2, 3, 4]
  .map((version) => new Uint8Array(
    readFileSync(new URL(`../fuzz/corpus/model_file/three_triangles_${version}.glb`, import.meta.url))));

const rewritten = (change) => edited(file, change);

/** What a reader says of bytes: null for a model; anything but a SoupError is a fault. */
function complaint(bytes) {
  try {
    decodeModel(bytes, "some.glb");
    return null;
  } catch (error) {
    assert.ok(error instanceof SoupError, `${error.stack}`);
    assert.match(error.message, /^some\.glb: [^\n]+; [^\n]+$/, "one line with file, thing and fix");
    return error.message;
  }
}

const near = (actual, expected, within = 1e-6) =>
  [...actual].forEach((value, i) => assert.ok(Math.abs(value - expected[i]) <= within,
    `${[...actual]} is not ${expected}`));

test("a model is what its file says", () => {
  const model = decodeModel(file, "x.glb");
  assert.equal(model.triangles, 3);
  assert.equal(model.vertices.length, 27);
  assert.equal(model.mlp.length, 595);
  assert.equal(model.pages.length, 1);
  assert.deepEqual(model.background, [0, 0, 0]);
  assert.equal(model.dropNear, true, "its settings have steps and no drop_near");
  assert.deepEqual([model.near, model.far], [0.025, 2.5]);
  // As atlas.cpp places them: higher levels first.
  const levels = [0, 1, 2].map((t) => placeOf(model.places, t).level);
  assert.ok(levels.every((level) => level <= 5));
});

test("vertices are normalised as scale (vertex + origin - centre)", () => {
  const before = decodeModel(file, "x.glb").vertices;
  const moved = decodeModel(
    rewritten((_, e) => Object.assign(e, { origin: [1, 2, 3], centre: [0.5, 0.25, 0], scale: 4 })), "x.glb").vertices;
  near(moved, [...before].map((v, i) => 4 * (v + [0.5, 1.75, 3][i % 3])));
});

test("settings are those of the model, and another program's are passed over", () => {
  const planes = (settings) => {
    const { near: n, far, dropNear } = decodeModel(rewritten((_, e) => { e.settings = settings; }), "x.glb");
    return [n, far, dropNear];
  };
  assert.deepEqual(planes({ test_near: 0.5, far: 8, drop_near: false, steps: 5 }), [0.5, 8, false]);
  assert.deepEqual(planes({ test_near: "close" }), [0.025, 2.5, false]);
  assert.deepEqual(planes(null), [0.025, 2.5, false]);
  assert.match(complaint(rewritten((_, e) => { e.settings = { test_near: 3 }; })), /clip planes/);
});

test("cameras: test views first, and impossible ones are refused", () => {
  const row = (name, isTest) => ({ name, test: isTest, size: [40, 30], focal: [50, 50], centre: [20, 15],
    world_to_camera: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 2] });
  const names = (rows) => decodeModel(rewritten((_, e) => { e.cameras = rows; }), "x.glb").cameras
    .map((camera) => camera.name);
  assert.deepEqual(names([row("a", false), row("b", true), row("c", false), row("d", true)]), ["b", "d", "a", "c"]);
  assert.match(complaint(rewritten((_, e) => { e.cameras = [{ ...row("a", true), size: [0, 30] }]; })), /camera/);
  assert.match(
    complaint(rewritten((_, e) => { e.cameras = [{ ...row("a", true), world_to_camera: Array(12).fill(1) }]; })),
    /camera/);
});

test("cameras of version 3: lenses and poses in a table", () => {
  const { cameras } = decodeModel(third, "x.glb");
  assert.deepEqual(
    cameras.map(({ name, test, width, height, fx, fy, cx, cy }) => [name, test, width, height, fx, fy, cx, cy]),
    [["b", true, 40, 30, 50, 51, 20, 15], ["a", false, 40, 30, 50, 51, 20, 15], ["c", false, 80, 30, 50, 51, 20, 15]]);
  // A turn by a right angle about x; about y, by arc tan 3/4; none.
  near(cameras[1].pose, [1, 0, 0, 0.5, 0, 0, -1, -0.25, 0, 1, 0, 2]);
  near(cameras[0].pose, [0.8, 0, 0.6, 0, 0, 1, 0, 0, -0.6, 0, 0.8, 3]);
  near(cameras[2].pose, [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 4]);
  const wrong = [
    ({ cameras: c }) => c.names.push("d"), ({ cameras: c }) => { c.names = "abc"; },
    ({ cameras: c }) => { c.poses = 0; }, ({ cameras: c }) => { c.poses = null; },
    ({ cameras: c }) => { c.test = [3]; }, ({ cameras: c }) => { c.test = 1; },
    ({ cameras: c }) => { c.lens = [0, 0, 7]; }, ({ cameras: c }) => { delete c.lenses; },
    ({ cameras: c }) => { c.lenses[0].focal = [0, 1]; }, ({ cameras: c }) => { c.lenses[1].size = [0, 1]; },
  ];
  for (const change of wrong) assert.ok(complaint(edited(third, (_, e) => change(e))), `${change}`);
  for (const value of [3, NaN]) {
    const turned = edited(third, (d, e, binary) => new DataView(binary.buffer)
      .setFloat32(d.bufferViews[e.cameras.poses].byteOffset, value, true));
    assert.match(complaint(turned), /invalid camera/);
  }
});

test("no part of a model is a model", () => {
  for (let length = 0; length < file.length; ++length) assert.ok(complaint(file.slice(0, length)), `${length} bytes`);
  assert.ok(complaint(new Uint8Array([...file, 0, 0, 0, 0])), "nor is more than one");
});

test("whatever a byte is, there is a model or one line", () => {
  const { features } = decodeModel(file, "x").pages[0];
  const inTexture = (at) => features.some((png) => at >= png.byteOffset + 8 && at < png.byteOffset + png.length);
  let refused = 0;
  for (let at = 0; at < file.length; ++at)
    for (const bits of [0x01, 0x80, 0xff]) {
      const damaged = file.slice();
      damaged[at] ^= bits;
      const line = complaint(damaged);
      if (line) ++refused;
      assert.ok(line || !inTexture(at), `byte ${at} of a texture`);
    }
  assert.ok(refused > 3000, `${refused} of ${3 * file.length} are refused`);
});

test("documents that are something else", () => {
  const wrong = [
    (d) => { delete d.extensions; }, (d) => { d.bufferViews = 5; }, (d) => { d.meshes = []; },
    (d) => { d.images = null; }, (d) => { d.bufferViews[0].byteLength = -1; },
    (d) => { d.bufferViews[0].byteOffset = 1e300; }, (d) => { d.bufferViews[0].byteOffset = "0"; },
    (_, e) => { e.version = 5; }, (_, e) => { e.version = 0; }, (_, e) => { e.triangles = 0; },
    (_, e) => { e.triangles = 2 ** 40; }, (_, e) => { e.triangles = 1.5; }, (_, e) => { e.mlp = e.places; },
    (_, e) => { e.places = e.mlp; }, (_, e) => { e.pages = {}; }, (_, e) => { e.pages = []; },
    (_, e) => { e.pages = [{ features: [1] }]; }, (_, e) => { e.pages = Array(300).fill(e.pages[0]); },
    (_, e) => { e.scale = 0; }, (_, e) => { e.centre = [1, 2]; }, (_, e) => { e.centre = ["1", 2, 3]; },
    (_, e) => { e.background = [2, 0, 0]; }, (_, e) => { e.up = [0, 0, 0]; },
    (_, e) => { e.sphericalHarmonicsDegree = 3; }, (_, e) => { e.cameras = {}; }, (_, e) => { e.cameras = [null]; },
  ];
  for (const change of wrong) assert.ok(complaint(rewritten(change)), `${change}`);
  for (const text of ["", "no model", "\x89PNG\r\n\x1a\n"])
    assert.match(complaint(new TextEncoder().encode(text)), /not a binary glTF/);
});

for (const [version, bytes] of [[2, second], [3, third]])
  test(`a file of version ${version} has the lattices of the same model in version 1`, () => {
  const old = decodeModel(file, "x.glb"), model = decodeModel(bytes, "x.glb");
  assert.deepEqual(model.vertices, old.vertices);
  assert.deepEqual(model.mlp, old.mlp);
  const before = old.pages[0].features.map((png) => rgbaOf(Buffer.from(png)));
  let compared = 0;
  for (let t = 0; t < 3; ++t) {
    const from = placeOf(old.places, t), to = placeOf(model.places, t), r = 1 << from.level;
    assert.equal(to.level, from.level);
    const texel = ({ x0, y0, turned }, width, x, y) =>
      4 * (turned ? (y0 - y) * width + x0 - x : (y0 + y) * width + x0 + x);
    for (let y = 0; y <= r; ++y)
      for (let x = 0; x + y <= r; ++x)
        for (const half of [0, 1]) {
          const a = texel(from, before[half].width, x, y), b = texel(to, model.pages[to.page].width, x, y);
          assert.deepEqual([...model.pages[to.page].features[half].rgba.slice(b, b + 4)],
            [...before[half].rgba.slice(a, a + 4)]);
          ++compared;
        }
  }
  assert.ok(compared > 12);
});

test("a page's model has the vertices of the same model on a grid, in another order", () => {
  const sorted = (model) => Array.from({ length: 3 }, (_, t) => [...model.vertices.subarray(9 * t, 9 * t + 9)])
    .sort((a, b) => a[0] - b[0] || a[1] - b[1] || a[2] - b[2]);
  const was = sorted(decodeModel(third, "x.glb")), is = sorted(decodeModel(fourth, "x.glb"));
  // Photographs of 51 pixels a unit from more than half a unit away, to an eighth of a pixel: steps of 1 / 512 or more.
  for (let t = 0; t < 3; ++t) near(is[t], was[t], 1 / 128);
  assert.ok(is.flat().every((value) => Number.isInteger(value * 2 ** 12)));
});

test("vertices are what the native programs write, and those that end too early are none", () => {
  const { document, binary } = decodeGlb(fourth, "x"),
    { byteOffset, byteLength } = document.bufferViews[document.extensions.TRISOUP_neural_textures.vertices.bufferView];
  const bytes = binary.subarray(byteOffset, byteOffset + byteLength);
  assert.equal(decodeVertices(bytes, 3).length, 27);
  assert.equal(decodeVertices(bytes.subarray(0, bytes.length >> 1), 3), null);
  assert.equal(decodeVertices(bytes, 2 ** 40), null);
});

for (const [name, today] of [["with a mesh", third], ["of a page", fourth]])
  test(`a file ${name} is whole or it is refused`, () => {
  for (let length = 0; length < today.length; ++length) assert.ok(complaint(today.slice(0, length)), `${length} bytes`);
  for (let at = 0; at < today.length; at += 3) {
    const damaged = today.slice();
    damaged[at] ^= 0x41;
    complaint(damaged);
  }
});

test("a file of today with something impossible is refused", () => {
  for (const change of [(_, e) => { e.vertices.crc32 ^= 1; }, (_, e) => { e.vertices = {}; },
    (_, e) => { e.version = 3; }, (_, e) => { e.triangles = 4; }, (_, e) => { e.triangles = 0; }])
    assert.ok(complaint(edited(fourth, change)), `${change}`);
  const wrong = [
    (_, e) => { delete e.textures; }, (_, e) => { e.textures.crc32 ^= 1; }, (_, e) => { e.textures.bufferView = 0; },
    (_, e) => { e.textures.steps = [1]; }, (_, e) => { e.textures.steps[3] = 0; },
    (_, e) => { e.textures.steps[3] = 129; }, (_, e) => { e.textures.steps = null; }, (_, e) => { e.triangles = 4; },
  ];
  for (const change of wrong) assert.ok(complaint(edited(third, change)), `${change}`);
});

test("lattices that end too early are none", () => {
  const { document, binary } = decodeGlb(third, "x"),
    { bufferView, steps } = document.extensions.TRISOUP_neural_textures.textures;
  const { byteOffset, byteLength } = document.bufferViews[bufferView],
    bytes = binary.subarray(byteOffset, byteOffset + byteLength);
  assert.ok(decodeLattices(bytes, 3, steps));
  assert.equal(decodeLattices(bytes.subarray(0, bytes.length >> 1), 3, steps), null);
  assert.equal(decodeLattices(bytes, 100000, steps), null);
});

test("atlases are those of the native programs", () => {
  // Two of a level share a block; shelves of falling height; a page ends at its side (tests/host/atlas_test.cpp).
  const levels = Uint8Array.from({ length: 5000 }, (_, i) => i % 6), { places, pages } = makeAtlas(levels, 512);
  assert.ok(pages.length > 1);
  const taken = pages.map(({ width, height }) => new Uint8Array(width * height));
  for (let t = 0; t < levels.length; ++t) {
    const { x0, y0, level, page, turned } = placeOf(places, t), r = 1 << level;
    assert.equal(level, levels[t]);
    for (let y = 0; y <= r; ++y)
      for (let x = 0; x + y <= r; ++x) {
        const [u, v] = turned ? [x0 - x, y0 - y] : [x0 + x, y0 + y];
        assert.ok(u >= 0 && v >= 0 && u < pages[page].width && v < pages[page].height);
        assert.equal(taken[page][v * pages[page].width + u]++, 0, "no texel is of two triangles");
      }
  }
});

test("a PNG is whole or it is not", () => {
  const png = decodeModel(file, "x.glb").pages[0].features[0];
  assert.ok(pngSize(png).width > 0 && isWholePng(png));
  for (let at = 8; at < png.length; ++at) {
    const damaged = png.slice();
    damaged[at] ^= 4;
    assert.equal(isWholePng(damaged), false, `byte ${at}`);
  }
  for (let length = 8; length < png.length; ++length)
    assert.equal(isWholePng(png.slice(0, length)), false, `${length} bytes`);
});

test("weights keep their bits as text, and GLSL takes them for floats", () => {
  const values = new Float32Array(4), bits = new Uint32Array(values.buffer);
  for (let i = 0; i < 20000; ++i) {
    bits[0] = Math.imul(i + 1, 0x9e3779b1);
    if (!Number.isFinite(values[0])) continue;
    const text = literal(values[0]);
    assert.equal(Math.fround(Number(text)), values[0], text);
    assert.match(text, /^-?\d+(\.\d+)?(e[+-]?\d+)?$/);
    assert.match(text, /[.e]/);
  }
  for (const value of [0, 1, -3, 1e20]) assert.match(literal(value), /[.e]/);
});

test("a layer of the MLP is weights times inputs and biases", () => {
  // Evaluated by turning the text, which is a sum of matrices times vectors, into numbers.
  const evaluate = (text, inputs) => {
    const terms = text.split("\n    + ")
      .map((term) => term.match(/^(?:vec|mat4x)(\d)\(([^)]*)\)(?: \* x\[(\d)\])?$/).slice(1));
    const rows = Number(terms[0][0]), sum = terms[0][1].split(",").map(Number);
    for (const [, numbers, input] of terms.slice(1))
      numbers.split(",").map(Number)
        .forEach((value, i) => { sum[i % rows] += value * inputs[4 * input + Math.floor(i / rows)]; });
    return sum;
  };
  for (const outputs of [16, 3]) {
    const weights = Float32Array.from({ length: 16 * outputs }, (_, i) => Math.sin(i * i + 1)),
      biases = Float32Array.from({ length: outputs }, (_, i) => i / 7);
    const inputs = Array.from({ length: 16 }, (_, i) => Math.cos(3 * i));
    const expected = [...biases].map((bias, o) => inputs.reduce((sum, x, i) => sum + weights[16 * o + i] * x, bias));
    near(layer(weights, biases, "x").flatMap((text) => evaluate(text, inputs)), expected, 1e-5);
  }
});

const camera = { width: 40, height: 30, fx: 50, fy: 45, cx: 18, cy: 16,
  pose: [1, 0, 0, 0.2, 0, 0, -1, 0.1, 0, 1, 0, 1.5] };

test("rays and projection are each other's inverse", () => {
  const view = viewOf(camera, 0.1, 10), at = (c, r) => view.clipFromWorld[4 * c + r];
  for (const [x, y] of [[0, 0], [0.7, -0.3], [-1, 1]]) {
    const towards = [0, 1, 2].map((i) => view.ray[i] + x * view.rayX[i] + y * view.rayY[i]);
    const point = view.eye.map((e, i) => e - 0.8 * towards[i]);
    const clip = [0, 1, 2, 3].map((r) => at(0, r) * point[0] + at(1, r) * point[1] + at(2, r) * point[2] + at(3, r));
    near([clip[0] / clip[3], clip[1] / clip[3]], [x, y], 1e-5);
    assert.ok(clip[3] > 0 && Math.abs(clip[2] / clip[3]) < 1);
  }
  // Pixel (cx, cy) looks along the third axis of the camera, depth `near` is NDC -1 and `far` is 1.
  for (const [depth, expected] of [[0.1, -1], [10, 1]]) {
    const point = view.eye.map((e, i) => e + depth * camera.pose[8 + i]);
    const clip = [2, 3].map((r) => at(0, r) * point[0] + at(1, r) * point[1] + at(2, r) * point[2] + at(3, r));
    near([clip[0] / clip[1]], [expected], 1e-4);
  }
});

test("a camera that is moved goes on from where it stood", () => {
  const navigation = new Navigation({ target: [0, 0, 0], up: [0, 0, 1], distance: 2, fov: 0.6 });
  const level = { width: 40, height: 30, fx: 45, fy: 45, cx: 20, cy: 15, pose: [1, 0, 0, 0, 0, 0, -1, 0, 0, 1, 0, 2] };
  navigation.snap(level);
  assert.ok(navigation.snapped);
  const before = viewOf(navigation.camera(80, 60), 0.1, 10);
  navigation.orbit(0, 0);
  assert.ok(!navigation.snapped);
  near(viewOf(navigation.camera(80, 60), 0.1, 10).clipFromWorld, before.clipFromWorld, 1e-5);
  navigation.zoom(2);
  near(viewOf(navigation.camera(80, 60), 0.1, 10).eye, [0, -1, 0], 1e-9);
  navigation.orbit(Math.PI / 2, 0);
  near(viewOf(navigation.camera(80, 60), 0.1, 10).eye, [1, 0, 0], 1e-9);
  navigation.orbit(0, 100);
  assert.ok(viewOf(navigation.camera(80, 60), 0.1, 10).eye[2] < 1, "never straight above");
  navigation.reset();
  near([Math.hypot(...viewOf(navigation.camera(80, 60), 0.1, 10).eye)], [2], 1e-9);
});

test("without cameras a soup is framed by most of its vertices", () => {
  const vertices = new Float32Array(300).map((_, i) => (i < 3 ? 1e6 : [i % 7, i % 5, i % 3][i % 3] / 10));
  const framing = framingOf({ cameras: [], up: null, vertices });
  assert.ok(framing.distance < 10 && framing.target.every((x) => x < 1), "one stray moves nothing");
  assert.deepEqual(framing.up, [0, 1, 0]);
});

test("pages larger than a device's textures are cut so that every lattice lies in one tile", () => {
  assert.deepEqual(cutPages([{ width: 4096, height: 4096 }], 4096), {
    cuts: [{ page: 0, first: 0, across: 1, down: 1, strideX: 4096, strideY: 4096 }], count: 1, width: 4096,
    height: 4096,
  });
  for (const [sides, most] of [[[[8192, 8192]], 4096], [[[8192, 300], [4097, 8000]], 2048],
    [[[100, 70], [99, 513]], 64]]) {
    const pages = sides.map(([width, height]) => ({ width, height })),
      { cuts, count, width, height } = cutPages(pages, most);
    assert.ok(width <= most && height <= most);
    const area = pages.reduce((sum, page) => sum + page.width * page.height, 0);
    if (most > 1000 && sides.length === 1)
      assert.ok(width * height * count < 1.05 * area, "no more memory than the page itself");
    pages.forEach((page, number) => {
      for (let i = 0; i < 3000; ++i) {
        const level = i % 6, reach = 1 << level, turned = (i >> 3) & 1;
        // Corners of the page too.
        const [x, y] = [page.width, page.height].map((side, axis) =>
          [0, side - 1 - reach, (7919 * i * (axis + 1)) % (side - reach)][i < 24 ? (i >> (4 * axis)) % 2 : 2]);
        const place = { x0: x + turned * reach, y0: y + turned * reach, level, page: number, turned },
          on = placeOnTile(place, cuts);
        const cut = cuts[number], tile = on.page - cut.first;
        assert.ok(tile >= 0 && tile < cut.across * cut.down && on.page < count);
        const left = (tile % cut.across) * cut.strideX, top = Math.floor(tile / cut.across) * cut.strideY;
        assert.deepEqual([on.x0 + left, on.y0 + top], [place.x0, place.y0], "the same texel");
        for (const [value, side] of [[on.x0, width], [on.y0, height]]) {
          const low = value - turned * reach;
          assert.ok(low >= 0 && low + reach < side, `level ${level} at ${x}, ${y}`);
        }
      }
    });
  }
});

const world = { scale: 0.5, centre: [10, 20, 30] };
const context = { normalisation: world, up: [0, 0, 1], what: "camera" };
const start = { fov: 40, aspect: 1.5, position: [10, 20, 40], target: [10, 20, 30], up: [0, 1, 0] };

/** What is wrong with a camera; null if nothing is. */
function cameraComplaint(given) {
  try {
    cameraOf(given, start, context);
    return null;
  } catch (error) {
    assert.ok(error instanceof SoupError, `${error.stack}`);
    assert.match(error.message, /^camera[^\n]+; [^\n]+$/);
    return error.message;
  }
}

test("a camera that is read is the one that was set, in world coordinates", () => {
  const given = { position: [13, 20, 30], target: [10, 20, 30], up: [0, 0, 1], fov: 50, aspect: 2 };
  const made = cameraOf(given, start, context);
  near([made.distance], [1.5]);
  const state = stateOf(made, made.distance, world);
  for (const name of ["position", "target", "up"]) near(state[name], given[name], 1e-9);
  near([state.fov, state.aspect], [50, 2], 1e-9);
  // Looks along -x: x of the camera is +y, its backward axis +x. Column-major, as three.js has it.
  near(state.matrix, [0, 1, 0, 0, 0, 0, 1, 0, 1, 0, 0, 0, 13, 20, 30, 1], 1e-9);
  const again = cameraOf({ matrix: new Float64Array(state.matrix), fov: 50, aspect: 2 }, start, context);
  near(again.pose, made.pose, 1e-9);
  const moved = cameraOf({ ...state, position: [10, 14, 30] }, start, context);
  near(stateOf(moved, moved.distance, world).position, [10, 14, 30], 1e-9);
  near(stateOf(moved, moved.distance, world).target, [10, 20, 30], 1e-9);
  near([cameraOf({ fov: 60 }, start, context).distance], [5], 1e-9);
  // Straight down, where the up direction of the soup cannot be up.
  assert.ok(cameraOf({ position: [10, 20, 35], target: [10, 20, 30] }, start, context).pose.every(Number.isFinite));
});

test("a camera that is none is refused in one line that names the member", () => {
  for (const [given, words] of [
    [{ position: [1, NaN, 2], target: [0, 0, 0] }, /camera\.position is \[1, NaN, 2\]; give 3 finite/],
    [{ position: "1 2 3" }, /camera\.position/], [{ target: [1, 2] }, /camera\.target/],
    [{ fov: 0 }, /camera\.fov is 0; give a number from 1 to 170/], [{ fov: "40" }, /camera\.fov/],
    [{ aspect: -1 }, /camera\.aspect/], [{ matrix: Array(16).fill(0) }, /camera\.matrix is not a rotation/],
    [{ matrix: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1] }, /camera\.matrix/],
    [{ matrix: [1, 0, 0, 5, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1] }, /camera\.matrix/],
    [{ position: [1e9, 0, 0] }, /too far from the scene/], [{ position: [10, 20, 30] }, /camera\.target is at its/],
    [null, /camera is null/], [{ up: [1, 2, NaN] }, /camera\.up/]])
    assert.match(String(cameraComplaint(given)), words, JSON.stringify(given));
  assert.equal(cameraComplaint({ up: [0, 0, 0] }), null, "without an up direction the soup's is taken");
});

test("a link has a camera, and an edited one is refused", () => {
  const state = { ...start, index: null };
  const back = decodeCamera(encodeCamera(state));
  for (const name of ["position", "target", "fov", "aspect", "up"]) assert.deepEqual(back[name], start[name]);
  assert.equal(decodeCamera(encodeCamera({ ...state, index: 7 })), 7);
  for (const text of ["", "1,2,3", "1,2,3,4,5,6,7,x", "1,2,,4,5,6,7,8", "-1", "1e999,2,3,4,5,6,7,8", "<script>"])
    assert.throws(() => decodeCamera(text), (error) => error instanceof SoupError && /; /.test(error.message), text);
});

test("rotations: quaternions and matrices are each other's inverse, and slerp is a turn at constant speed", () => {
  for (const axis of [[1, 0, 0], [0, 1, 0], [0, 0, 1], [0.6, 0, 0.8], [0, -0.6, 0.8]])
    for (const angle of [0, 1, 3, Math.PI, 4]) {
      const q = [...axis.map((x) => x * Math.sin(angle / 2)), Math.cos(angle / 2)], m = poseOf([...q, 0, 0, 0]);
      const back = quaternionOf([0, 4, 8].map((at) => m.slice(at, at + 3)));
      near(poseOf([...back, 0, 0, 0]), m, 1e-9);
    }
  const turn = (angle) => [0, 0, Math.sin(angle / 2), Math.cos(angle / 2)];
  near(slerp(turn(0.2), turn(1.4), 0.25), turn(0.5), 1e-9);
  near(slerp(turn(0.2), turn(1.4).map((x) => -x), 0.25), turn(0.5), 1e-9);
});

const pathContext = { normalisation: world, up: [0, 0, 1], now: start, pivot: () => 1 };
const key = (time, position) => ({ time, position, target: [10, 20, 30], fov: 40 });

test("a path goes through its key frames, smoothly", () => {
  const places = [[12, 20, 30], [10, 23, 30], [6, 20, 30], [10, 18, 31]];
  const { keys, seconds, loop } = readPath({ keyframes: places.map((place, i) => key([0, 1, 3, 4][i], place)) },
    "p.json", pathContext);
  assert.deepEqual([keys.length, seconds, loop], [4, 4, false]);
  const eye = (time) => shotAt(keys, time).eye.map((x, axis) => x / world.scale + world.centre[axis]);
  places.forEach((place, i) => near(eye([0, 1, 3, 4][i]), place, 1e-9));
  near(eye(-1), places[0], 1e-9);
  near(eye(9), places[3], 1e-9);
  // The speed has no jump at a key frame; a polygon through them would have one.
  const speed = (from, to) => [0, 1, 2].map((axis) => (eye(to)[axis] - eye(from)[axis]) / (to - from));
  for (const at of [1, 3]) near(speed(at - 1e-5, at), speed(at, at + 1e-5), 1e-3);
  const polygon = [0, 1, 2].map((axis) => (places[1][axis] + places[2][axis]) / 2);
  assert.ok(Math.hypot(...eye(2).map((x, axis) => x - polygon[axis])) > 0.05, "a straight line");
  // It looks at the target all the time.
  for (const time of [0, 1, 3]) near([shotAt(keys, time).distance], [0.5 * Math.hypot(
    ...places[[0, 1, 3].indexOf(time)].map((x, axis) => x - [10, 20, 30][axis]))], 1e-9);
});

test("nerfstudio's camera paths: row-major matrices, fov and seconds", () => {
  const rows = (x) => [0, 0, 1, x, 1, 0, 0, 2, 0, 1, 0, 3, 0, 0, 0, 1];
  const document = { camera_path: [1, 2, 4].map((x) => ({ camera_to_world: rows(x), fov: 70, aspect: 1.5 })), fps: 2,
    seconds: 3, is_cycle: true };
  const { keys, seconds, loop } = readPath(document, "camera_path.json", pathContext);
  assert.deepEqual([keys.map((one) => one.time), seconds, loop], [[0, 1.5, 3], 3, true]);
  near(keys[2].shot.eye, [0.5 * (4 - 10), 0.5 * (2 - 20), 0.5 * (3 - 30)], 1e-9);
  near([2 * Math.atan(0.5 * keys[0].shot.height)], [(70 * Math.PI) / 180], 1e-9);
  // x of the camera is +y, y is +z, it looks along -x: as rows of world to camera, right, down, forward.
  near(poseOf([...keys[0].shot.turn, 0, 0, 0]).filter((_, i) => i % 4 < 3), [0, 1, 0, 0, 0, -1, -1, 0, 0], 1e-9);
  // The scene of nerfstudio is 2 x (dataset turned about z and moved).
  const dataparser = { transform: [[0, -1, 0, 5], [1, 0, 0, 6], [0, 0, 1, 7]], scale: 2 };
  const undone = readPath(document, "camera_path.json", { ...pathContext, dataparser }).keys[0].shot.eye;
  const [x, y, z] = [1 / 2 - 5, 2 / 2 - 6, 3 / 2 - 7];
  near(undone, [0.5 * (y - 10), 0.5 * (-x - 20), 0.5 * (z - 30)], 1e-9);
});

test("the cameras of paths are those of path_cases.json, which soup-view agrees with", () => {
  for (const one of pathCases())
    camerasOf(one).forEach(({ eye, axes, focal }, i) => {
      const expected = one.cameras[i];
      near([...eye, ...axes], [...expected.eye, ...expected.axes], 1e-9);
      near([focal / expected.focal], [1], 1e-9);
    });
});

test("a path that is none is refused in one line that names the key frame", () => {
  for (const [document, words] of [[null, /p\.json: is not a camera path/], [{}, /is not a camera path/],
    [{ keyframes: [] }, /is not a camera path/], [{ keyframes: [{}] }, /keyframes\[0\]\.time is undefined; give sec/],
    [{ keyframes: [{ time: 0 }] }, /keyframes\[0\] has no pose/],
    [{ keyframes: [key(0, [1, 2, 3]), key(0, [1, 2, 3])] }, /keyframes\[1\]\.time is 0, not after/],
    [{ keyframes: [key(0, [1, "2", 3])] }, /keyframes\[0\]\.position is \[1, 2, 3\]; give 3 finite/],
    [{ keyframes: [null] }, /keyframes\[0\]/], [{ camera_path: [{}], fps: 1 }, /camera_path\[0\]\.camera_to_world/],
    [{ camera_path: [null], fps: 1 }, /camera_path\[0\]/], [{ camera_path: [{}] }, /no fps/]])
    assert.throws(() => readPath(document, "p.json", pathContext),
      (error) => error instanceof SoupError && words.test(error.message) && !/\n/.test(error.message), `${words}`);
});

test("an upright image keeps the horizontal field of view, a wide one the vertical", () => {
  const wide = { width: 300, height: 200, fx: 250, fy: 250, cx: 160, cy: 90, pose: camera.pose };
  const upright = fitted(wide, 390, 844), across = ({ width, fx, cx }) => [-cx / fx, (width - cx) / fx];
  near(across(upright), across(wide), 1e-12);
  near([upright.fx / upright.fy], [1]);
  near([(upright.cy - 422) / upright.fy], [(90 - 100) / 250], 1e-12);
  assert.deepEqual(fitted(wide, 900, 200).fy, 250);
});

test("damping follows a movement and arrives exactly", () => {
  const navigation = new Navigation({ target: [0, 0, 0], up: [0, 0, 1], distance: 2, fov: 0.6 });
  const eye = () => viewOf(navigation.camera(80, 60), 0.1, 10).eye, from = eye();
  navigation.damping = 0.1;
  navigation.zoom(2);
  near(eye(), from, 1e-12);
  assert.ok(navigation.settle(0.05));
  assert.ok(Math.hypot(...eye()) < 1.9 && Math.hypot(...eye()) > 1.1, "part of the way");
  for (let i = 0; i < 40 && navigation.settle(0.05); ++i);
  near([Math.hypot(...eye())], [1], 1e-12);
  assert.equal(navigation.settle(0.05), false, "it rests");
  for (let i = 0; i < 9; ++i) navigation.orbit(3, 0);
  while (navigation.settle(1));
  navigation.reset();
  let way = 0;
  for (let before = eye(); navigation.settle(0.01); before = eye())
    way += Math.hypot(...eye().map((x, axis) => x - before[axis]));
  assert.ok(way < 2 * Math.PI, `a reset goes ${way} around`);
});

test("an eye of a headset is its pinhole camera", () => {
  const room = roomBefore([1, 2, 3], [0, 1, 0], [0, 0, 1], 0.5);
  near(room.axes.flat(), [1, 0, 0, 0, 0, 1, 0, -1, 0], 1e-12);
  const [l, r, b, t, n, f] = [-0.7, 0.9, -1.1, 0.8, 1, 100];
  const projection = [2 / (r - l), 0, 0, 0, 0, 2 / (t - b), 0, 0, (r + l) / (r - l), (t + b) / (t - b),
    -(f + n) / (f - n), -1, 0, 0, (-2 * f * n) / (f - n), 0];
  const matrix = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0.03, 1.6, -0.2, 1];
  const view = viewOf(eyeCamera(projection, matrix, room, 100, 80), 0.01, 10), m = view.clipFromWorld;
  near(view.eye, [1 + 0.015, 2 + 0.1, 3 + 0.8], 1e-6);
  // A point of the room, projected by the headset's matrix and by the view; NDC y points down there.
  const [px, py, pz] = [0.4, 1.9, -2.5], [x, y, z] = [px - 0.03, py - 1.6, pz + 0.2];
  const point = [1 + 0.5 * px, 2 - 0.5 * pz, 3 + 0.5 * py];
  const clip = [0, 1, 3].map((i) => m[i] * point[0] + m[4 + i] * point[1] + m[8 + i] * point[2] + m[12 + i]);
  near([clip[0] / clip[2], -clip[1] / clip[2]],
    [(projection[0] * x + projection[8] * z) / -z, (projection[5] * y + projection[9] * z) / -z], 1e-5);
});
