// web/three in a headless Chromium, with three.js from npm, beside <tri-soup>. TRISOUP_THREE names the folder with
// node_modules.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { before, test } from "node:test";
import { fileURLToPath } from "node:url";
import { viewOf } from "../../web/camera.js";
import { decodeGlb } from "../../web/glb.js";
import { decodeModel } from "../../web/model.js";
import { edited } from "./edit_glb.mjs";
import { SIZE, bin, html, model, modelPath, native, on, pages, picture, scratch } from "./harness.mjs";
import { readPng } from "./png.mjs";

const soup = decodeModel(new Uint8Array(model), "model.glb"), size = [SIZE, SIZE];
const IMPORTS = { three: "/node_modules/three/build/three.module.js",
  "three/addons/": "/node_modules/three/examples/jsm/" };

before(() => {
  pages["/node_modules/"] = join(process.env.TRISOUP_THREE, "node_modules");
  pages["/three_page.js"] = readFileSync(fileURLToPath(new URL("three_page.js", import.meta.url)));
  pages["/three.html"] = html(`<tri-soup src="/model.glb" aa="none"></tri-soup>
    <script type="importmap">${JSON.stringify({ imports: IMPORTS })}</script>
    <script type="module" src="/three_page.js"></script>`);
});

const drawn = async (page, wanted) =>
  new Uint8Array(Buffer.from(await page.run((w) => window.draw(w), { size, ...wanted }), "base64"));

/**
 * How far pictures are apart: share of pixels that differ by more than two steps (edges and ties), and PSNR of the
 * others.
 */
function apart(a, b) {
  assert.equal(a.length, b.length);
  let others = 0, squares = 0;
  for (let p = 0; p < a.length; p += 4) {
    const steps = [0, 1, 2].map((c) => Math.abs(a[p + c] - b[p + c]));
    if (Math.max(...steps) > 2) ++others;
    else squares += steps.reduce((sum, s) => sum + (s / 255) ** 2, 0);
  }
  return { others: (4 * others) / a.length, psnr: -10 * Math.log10(squares / (0.75 * a.length)) };
}

function same(a, b, mostOthers, what) {
  const result = apart(a, b);
  console.log(`${what}: ${JSON.stringify(result)}`);
  assert.ok(result.others <= mostOthers, `${what}: ${result.others} of the pixels are others`);
  assert.ok(result.psnr > 50, `${what}: ${result.psnr} dB`);
}

test("views are those of <tri-soup>", () => on("/three.html", async (page) => {
  for (const camera of [0, 3, 6])
    same(await drawn(page, { camera }), (await picture(page, 0, { settings: { camera } })).rgba, 0.002,
      `camera ${camera}`);
}));

/** Where the ray of a pixel meets a plane of three points or of a normal: in multiples of the ray. */
function meets(view, x, y, normal, distance) {
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const ray = [0, 1, 2]
    .map((i) => -(view.ray[i] + (2 * (x + 0.5) / SIZE - 1) * view.rayX[i] + (2 * (y + 0.5) / SIZE - 1) * view.rayY[i]));
  return (distance - dot(normal, view.eye)) / dot(normal, ray);
}

function planeOfTriangle(t) {
  const [a, b, c] = [0, 3, 6].map((corner) => soup.vertices.subarray(9 * t + corner, 9 * t + corner + 3));
  const u = [0, 1, 2].map((i) => b[i] - a[i]), v = [0, 1, 2].map((i) => c[i] - a[i]);
  const normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
  return [normal, normal[0] * a[0] + normal[1] * a[1] + normal[2] * a[2]];
}

test("a plane through the soup hides what lies behind it, and nothing else", () => on("/three.html", async (page) => {
  // Through the middle, upright, seen at an angle.
  const plane = { normal: [0.6, 0.8, 0], distance: 0.02 }, camera = 0;
  const bare = await picture(page, 0, { samples: 1, settings: { camera } }),
    view = viewOf({ ...soup.cameras[camera], ...scaled(soup.cameras[camera]) }, soup.near, soup.far);
  for (const options of [{}, { reversedDepthBuffer: true }]) {
    const rgba = await drawn(page, { camera, plane, options });
    let wrong = 0, before = 0, behind = 0;
    for (let y = 0; y < SIZE; ++y)
      for (let x = 0; x < SIZE; ++x) {
        const p = y * SIZE + x, hit = bare.hits[0][p], at = meets(view, x, y, plane.normal, plane.distance);
        const isRed = rgba[4 * p] === 255 && rgba[4 * p + 1] === 0 && rgba[4 * p + 2] === 0;
        const inFront = at > 0 && (hit === 0 || at < meets(view, x, y, ...planeOfTriangle(hit - 1)));
        if (hit !== 0 && inFront) ++before;
        if (hit !== 0 && !inFront) ++behind;
        if (isRed !== inFront) ++wrong;
      }
    mkdirSync(join(scratch, "pictures"), { recursive: true });
    const what = `${JSON.stringify(options)}: before ${before}, behind ${behind}, wrong ${wrong}`;
    console.log(what);
    assert.ok(before > 1000 && behind > 1000, what);
    assert.ok(wrong <= 0.002 * SIZE * SIZE, what);
  }
}));

/** A camera of the model for a picture of SIZE. */
function scaled({ width, height, fx, fy, cx, cy }) {
  const s = SIZE / height;
  return { width: SIZE, height: SIZE, fx: fx * s, fy: fy * s, cx: SIZE / 2 + s * (cx - width / 2), cy: cy * s };
}

test("without the loader the colours are those that soup-eval measures", () => on("/three.html", async (page) => {
  const measured = join(scratch, "measured"), garden = fileURLToPath(new URL("../../assets/garden", import.meta.url));
  execFileSync(join(bin, "soup-eval"), [modelPath, garden, "--backend", "cpu", "--json", join(scratch, "measured.json"),
    "--renders", measured]);
  const { views, psnr_baked: mean } = JSON.parse(readFileSync(join(scratch, "measured.json")));
  let sum = 0;
  for (const [camera, view] of views.entries()) {
    const rgba = await drawn(page, { camera, baked: true }),
      { rgb, width } = readPng(join(measured, "renders", view.name.replace("/", "_")));  // left: the photograph
    let squares = 0;
    for (let y = 0; y < SIZE; ++y)
      for (let i = 0; i < 3 * SIZE; ++i)
        squares += ((rgba[4 * (y * SIZE + Math.floor(i / 3)) + (i % 3)] - rgb[3 * y * width + i]) / 255) ** 2;
    const psnr = -10 * Math.log10(squares / (3 * SIZE * SIZE));
    sum += psnr;
    assert.ok(Math.abs(psnr - view.psnr_baked) < 0.3, `${view.name}: ${psnr} dB, soup-eval ${view.psnr_baked} dB`);
  }
  console.log(`baked colours: ${sum / views.length} dB in three.js, soup-eval ${mean} dB`);
  assert.ok(Math.abs(sum / views.length - mean) < 0.05);
}));

test("moved, cloned, in a part of the canvas, through a target of light, after a lost context: the same picture",
  () => on("/three.html", async (page) => {
  const camera = 2, plain = await drawn(page, { camera });
  same(await drawn(page, { camera, moved: true }), plain, 0.003, "moved");
  same(await drawn(page, { camera, cloned: true }), plain, 0, "cloned");
  same(await drawn(page, { camera, target: true }), plain, 0, "through a target");
  const part = await drawn(page, { camera, part: [60, 20, 100, 100] }),
    small = await drawn(page, { camera, size: [100, 100] });
  const cut = Buffer.concat(Array.from({ length: 100 },
    (_, y) => part.subarray(4 * ((20 + y) * SIZE + 60), 4 * ((20 + y) * SIZE + 160))));
  same(cut, small, 0.003, "in a part");
  same(await drawn(page, { camera, lost: true, options: { stencil: true } }), plain, 0.003, "after a lost context");
}, { allowed: [/CONTEXT_LOST_WEBGL: loseContext/, /Context (Lost|Restored)/] }));

test("a model whose vertices are coded, and one that its node moves", () => {
  const coded = join(scratch, "coded.glb");
  native("soup-export", modelPath, "-o", coded, "--format", "glb", "--vertex-share", "0.001", "--overwrite");
  pages["/coded.glb"] = readFileSync(coded);
  assert.equal(decodeGlb(pages["/coded.glb"], "x").document.meshes, undefined);
  // The soup beside the origin of its node, and the node elsewhere.
  const beside = [0.5, -0.25, 1], moved = [5, -7, 2];
  pages["/shifted.glb"] = Buffer.from(edited(model, (document, extension, binary) => {
    document.nodes[0] = { mesh: 0, translation: moved };
    const { byteOffset } = document.bufferViews[document.accessors[0].bufferView],
      floats = new DataView(binary.buffer, binary.byteOffset + byteOffset);
    for (let i = 0; i < 9 * extension.triangles; ++i)
      floats.setFloat32(4 * i, floats.getFloat32(4 * i, true) + beside[i % 3], true);
    Object.assign(extension,
      { origin: moved, centre: extension.centre.map((value, i) => value + beside[i] + moved[i]) });
  }));
  return on("/three.html", async (page) => {
    const plain = await drawn(page, { camera: 1 });
    for (const address of ["/coded.glb", "/shifted.glb"])
      same(await drawn(page, { camera: 1, address }), plain, 0.003, address);
    same(await drawn(page, { camera: 1, address: "/coded.glb", moved: true }), plain, 0.003, "moved");
    const place = await page.run(() => window.place("/shifted.glb")), { middle } = soup.normalisation;
    for (const i of [0, 1, 2])
      assert.ok(Math.abs(place[i] - (middle[i] + beside[i] + moved[i])) < 1e-6, `the soup is at ${place}`);
  });
});

test("other files, other cameras, rays", () => {
  pages["/plain.glb"] = Buffer.from(edited(model, (document) => { delete document.extensions; }));
  pages["/bad.glb"] = Buffer.from(edited(model, (_, extension) => { extension.scale = -1; }));
  return on("/three.html", async (page) => {
    assert.equal(await page.run(() => window.other("/plain.glb")), "no soup");
    assert.match(await page.run(() => window.other("/bad.glb")), /has an invalid centre or scale/);
    assert.match(await page.run(() => window.flat()), /PerspectiveCamera/);
    const distances = await page.run(() => window.pick(0));
    assert.ok(distances.length > 0 && distances[0] > 0.1 && distances[0] < 2, `${distances}`);
  });
});

test("the example shows a soup with a ring around it", () => on("/web/three/example.html", async (page) => {
  await page.run(async () => {
    while (!document.querySelector("p").hidden && /Loading/.test(document.querySelector("p").textContent))
      await new Promise((resolve) => setTimeout(resolve, 20));
  });
  assert.equal(await page.run(() => document.querySelector("p").hidden), true);
  writeFileSync(join(scratch, "pictures", "three.png"), await page.screenshot());
}, { screen: { width: 500, height: 400 }, wait: false }));
