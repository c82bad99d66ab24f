// <tri-soup> in a headless Chromium, beside the native renderer.
import assert from "node:assert/strict";
import { spawn } from "node:child_process";
import { mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { before, test } from "node:test";
import { decodeGlb } from "../../web/glb.js";
import { decodeModel } from "../../web/model.js";
import { Browser } from "./browser.mjs";
import { edited } from "./edit_glb.mjs";
import { SIZE, agrees, agreesOn, bin, html, largePath, model, modelPath, native, on, pages, picture, scratch,
  server } from "./harness.mjs";
import { readPng } from "./png.mjs";

/** Translation of the first camera in the file with which the deepest triangle reaches from behind it into its view. */
function amidDeepest({ cameras, vertices }) {
  const { pose } = cameras.find((camera) => camera.name === firstCamera);
  const turned = (at) => [0, 1, 2].map((row) => [0, 1, 2]
    .reduce((sum, axis) => sum + pose[4 * row + axis] * vertices[at + axis], 0));
  let deepest = null;
  for (let at = 0; at < vertices.length; at += 9) {
    const corners = [0, 3, 6].map((corner) => turned(at + corner)), depths = corners.map((corner) => corner[2]);
    const depth = Math.max(...depths) - Math.min(...depths);
    if (!deepest || depth > deepest.depth) deepest = { depth, corners };
  }
  // Its foremost corner is in the middle of the view.
  const foremost = deepest.corners.reduce((a, b) => (a[2] > b[2] ? a : b));
  return foremost.map((x, axis) => (axis === 2 ? 0.5 * deepest.depth : 0) - x);
}

/** Of every version of the format. */
const corpus = ["three_triangles.glb", "three_triangles_2.glb", "three_triangles_3.glb", "three_triangles_4.glb"]
  .map((name) => readFileSync(new URL(`../fuzz/corpus/model_file/${name}`, import.meta.url)));
const firstCamera = decodeGlb(model, "x").document.extensions.TRISOUP_neural_textures.cameras.names[0];

before(() => {
  native("soup-export", modelPath, "-o", join(scratch, "page"), "--title", `A "page" & <more>`, "--camera", "1",
    "--overwrite");
  native("soup-export", modelPath, "-o", join(scratch, "page.html"), "--single-file", "--overwrite");
  pages["/page/"] = join(scratch, "page");
});

test("ten views are those of soup-view", () => on("/one.html", async (page) => {
  for (let camera = 0; camera < 10; ++camera)
    agrees(await picture(page, 0, { samples: 1, settings: { aa: "none", camera } }), "none", 0.001, "--camera",
      String(camera));
}));

test("ten views of 15,000 triangles are those of soup-view", () => {
  pages["/large.glb"] = readFileSync(largePath);
  pages["/large.html"] = html('<tri-soup src="/large.glb" aa="none"></tri-soup>');
  return on("/large.html", async (page) => {
    for (let camera = 0; camera < 10; ++camera)
      agreesOn(largePath, await picture(page, 0, { samples: 1, settings: { camera } }), "none", 0.001, "--camera",
        String(camera));
  });
});

test("a page's model, whose vertices are coded, is what soup-view makes of it", () => {
  const path = join(scratch, "page", "model.glb");
  assert.equal(decodeGlb(readFileSync(path), "x").document.meshes, undefined);
  pages["/coded.html"] = html('<tri-soup src="/page/model.glb" aa="none"></tri-soup>');
  return on("/coded.html", async (page) => {
    for (const camera of [0, 4, 8]) {
      const shown = await picture(page, 0, { samples: 1, settings: { camera } });
      agreesOn(path, shown, "none", 0.001, "--camera", String(camera));
    }
  });
});

test("amid the soup: triangles that reach behind the camera are left out or clipped, as the settings say", async () => {
  const amid = amidDeepest(decodeModel(new Uint8Array(model), "x"));
  const paths = [true, false].map((drop) => {
    const path = join(scratch, `amid-${drop}.glb`);
    writeFileSync(path, edited(model, (document, extension, binary) => {
      extension.settings.drop_near = drop;
      const first = document.bufferViews[extension.cameras.poses].byteOffset;
      amid.forEach((value, axis) =>
        new DataView(binary.buffer, binary.byteOffset).setFloat32(first + 4 * (4 + axis), value, true));
    }));
    return path;
  });
  pages["/amid.html"] =
    html('<tri-soup src="/amid-true.glb" aa="none"></tri-soup><tri-soup src="/amid-false.glb" aa="none"></tri-soup>');
  for (const [i, name] of ["/amid-true.glb", "/amid-false.glb"].entries()) pages[name] = readFileSync(paths[i]);
  await on("/amid.html", async (page) => {
    const seen = [];
    for (const i of [0, 1]) {
      const drawn = await picture(page, i, { samples: 1, settings: { camera: firstCamera } });
      agreesOn(paths[i], drawn, "none", 0.001, "--camera", firstCamera);
      seen.push(Buffer.from(drawn.rgba));
    }
    assert.ok(!seen[0].equals(seen[1]), "nothing reaches behind the camera");
  });
});

// Four samples see another triangle four times as often; 2 x 2 are rasterised on half the grid there, and SwiftShader's
// depth of single samples is its own.
test("smooth edges are those of soup-view", () => on("/one.html", async (page) => {
  for (const [aa, mostTies] of [["msaa", 0.008], ["ssaa", 0.015]])
    for (const camera of [0, 5])
      agrees(await picture(page, 0, { samples: 4, settings: { aa, camera } }), aa, mostTies, "--camera",
        String(camera));
}));

test("four soups in one page, one context", () => {
  pages["/four.html"] =
    html([2, 3, 4, 5].map((camera) => `<tri-soup src="/model.glb" camera="${camera}" aa="none"></tri-soup>`).join(""));
  const count = () => {
    const { getContext } = HTMLCanvasElement.prototype;
    window.contexts = 0;
    HTMLCanvasElement.prototype.getContext = function (kind, ...rest) {
      window.contexts += kind === "webgl2" ? 1 : 0;
      return getContext.call(this, kind, ...rest);
    };
  };
  return on("/four.html", async (page) => {
    const first = await Promise.all([0, 1, 2, 3].map((i) => picture(page, i)));
    for (let i = 0; i < 4; ++i) {
      // The targets hold the hits of what was drawn last.
      await page.run((which) => document.querySelectorAll("tri-soup")[which].setAttribute("camera", "0"), i);
      const last = await picture(page, i, { samples: 1, settings: { camera: i + 2 } });
      assert.deepEqual(first[i].rgba, last.rgba);
      agrees(last, "none", 0.001, "--camera", String(i + 2));
    }
    assert.equal(await page.run(() => window.contexts), 1);
    assert.equal(page.requests.filter((url) => url.endsWith("/model.glb")).length, 1, "one model, one request");
  }, { begin: count });
});

test("a device with small textures shows the same", async () => {
  pages["/large.glb"] = readFileSync(largePath);
  pages["/large.html"] = html('<tri-soup src="/large.glb" aa="none"></tri-soup>');
  let usual;
  await on("/large.html", async (page) => { usual = await picture(page, 0, { settings: { aa: "none", camera: 1 } }); });
  await on("/large.html", async (page) => {
    assert.deepEqual((await picture(page, 0, { settings: { aa: "none", camera: 1 } })).rgba, usual.rgba);
    assert.ok(await page.run(() => window.layers >= 6), "one texture was enough");
  }, {
    begin: () => {
      const { getParameter, texStorage3D } = WebGL2RenderingContext.prototype;
      WebGL2RenderingContext.prototype.getParameter = function (name) {
        return name === this.MAX_TEXTURE_SIZE ? 256 : getParameter.call(this, name);
      };
      window.layers = 0;
      WebGL2RenderingContext.prototype.texStorage3D = function (target, levels, format, width, height, depth) {
        window.layers = Math.max(window.layers, depth);
        texStorage3D.call(this, target, levels, format, width, height, depth);
      };
    },
  });
});

test("in a frame of another page", async () => {
  pages["/framed.html"] = `<!doctype html><link rel="icon" href="/icon.png"><link rel="stylesheet" href="/framed.css">
    <iframe src="/one.html" width="${SIZE}" height="${SIZE}"></iframe>`;
  pages["/framed.css"] = "body { margin: 0; height: 5000px } iframe { border: 0; display: block }";
  let alone;
  const shown = () => {
    const soup = (window.frames[0] ?? window).document.querySelector("tri-soup");
    return new Promise((resolve) => {
      const look = () =>
        (soup?.loaded ? resolve(soup.shadowRoot.querySelector("canvas").toDataURL()) : setTimeout(look, 20));
      look();
    });
  };
  await on("/one.html", async (page) => { alone = await page.run(shown); });
  await on("/framed.html", async (page) => {
    assert.equal(await page.run(shown), alone);
    const wheel = async (deltaY) => {
      await page.send("Input.dispatchMouseEvent", { type: "mouseWheel", x: 50, y: 50, deltaX: 0, deltaY });
      await page.run(() => new Promise((resolve) => setTimeout(resolve, 400)));
      return page.run(() => window.scrollY);
    };
    assert.ok(await wheel(120) > 0, "the wheel does not scroll the page around it");
    assert.equal(await page.run(shown), alone, "the wheel scrolls and zooms");
    await wheel(-1000);
    for (const type of ["mousePressed", "mouseReleased"])
      await page.send("Input.dispatchMouseEvent", { type, x: 50, y: 50, button: "left", clickCount: 1 });
    assert.equal(await wheel(120), 0, "after a click the page around it scrolls");
    assert.notEqual(await page.run(shown), alone, "after a click the wheel does nothing");
  });
});

test("keys turn the scene as far as soup-view does", () => on("/one.html", async (page) => {
  await page.run(() => document.querySelector("tri-soup").focus());
  const press = async (code, key = code) => {
    await page.send("Input.dispatchKeyEvent", { type: "keyDown", code, key });
    await page.send("Input.dispatchKeyEvent", { type: "keyUp", code, key });
  };
  await press("KeyR", "r");
  for (let i = 0; i < 6; ++i) await press("ArrowRight");
  // The start is 0.6 radians around and 0.35 above the ground.
  const drawn = await picture(page, 0, { samples: 1, settings: { aa: "none" } });
  agrees(drawn, "none", 0.001, "--elevation", String((0.35 * 180) / Math.PI), "--near", "0.01", "--far", "10");
  await press("KeyX", "x");
  assert.equal(await page.run(() => document.querySelector("tri-soup").aa), "msaa");
  await press("BracketRight", "]");
  const next = await picture(page, 0, { samples: 1, settings: { aa: "none" } });
  agrees(next, "none", 0.001, "--camera", "1");
}));

test("the wheel and the mouse move the camera, and nothing is drawn without a change",
  () => on("/one.html", async (page) => {
  const drawings = () => page.run(async () => {
    const { count } = window;
    await new Promise((resolve) => setTimeout(resolve, 300));
    return [count, window.count];
  });
  const [idle, later] = await drawings();
  assert.ok(idle > 0);
  assert.equal(later, idle, "drawn while nothing changed");
  const seen = [Buffer.from((await picture(page, 0)).rgba)];
  const mouse = (type, x, y, rest = {}) => page.send("Input.dispatchMouseEvent",
    { type, x, y, button: "left", clickCount: 1, ...rest });
  await page.send("Input.dispatchMouseEvent", { type: "mouseWheel", x: 50, y: 50, deltaX: 0, deltaY: -300 });
  seen.push(Buffer.from((await picture(page, 0)).rgba));
  for (const modifiers of [0, 8, 2]) {
    await mouse("mousePressed", 60, 60, { buttons: 1, modifiers });
    await mouse("mouseMoved", 90, 80, { buttons: 1, modifiers });
    await mouse("mouseReleased", 90, 80, { modifiers });
    seen.push(Buffer.from((await picture(page, 0)).rgba));
  }
  for (let i = 1; i < seen.length; ++i) assert.ok(!seen[i].equals(seen[i - 1]), `movement ${i} shows nothing new`);
  assert.ok((await drawings())[0] > idle);
}, {
  begin: () => {
    const { drawArrays } = WebGL2RenderingContext.prototype;
    window.count = 0;
    WebGL2RenderingContext.prototype.drawArrays = function (...rest) {
      ++window.count;
      drawArrays.apply(this, rest);
    };
  },
}));

test("a context that was lost comes back with the same picture", () => on("/one.html", async (page) => {
  const before = await picture(page, 0, { samples: 1, settings: { aa: "none", camera: 3 } });
  const told = await page.run(async () => {
    const soup = document.querySelector("tri-soup"), { theStage } = await import("/web/stage.js");
    const event = (name) => new Promise((resolve) => soup.addEventListener(name, resolve, { once: true }));
    const message = () => soup.shadowRoot.querySelector("[part=message]").textContent;
    const lose = theStage().gl.getExtension("WEBGL_lose_context"), lost = event("contextlost");
    lose.loseContext();
    await lost;
    soup.camera = 4;  // moving it meanwhile is no fault
    const during = message(), restored = event("contextrestored");
    await new Promise((resolve) => setTimeout(resolve, 100));
    lose.restoreContext();
    await restored;
    return [during, message()];
  });
  assert.match(told[0], /^The graphics device was lost/);
  assert.equal(told[1], "");
  const back = await picture(page, 0, { samples: 1, settings: { camera: 3 } });
  assert.deepEqual(back.rgba, before.rgba);
  assert.deepEqual(back.hits, before.hits);
}, { allowed: [/CONTEXT_LOST_WEBGL: loseContext/] }));

/** What an element of a page says of a model that cannot be shown, and what stood in its event. */
const verdict = (page, src) => page.run(async (address) => {
  const soup = document.createElement("tri-soup");
  const outcome = new Promise((resolve) => {
    soup.addEventListener("error", (event) => resolve(event.message));
    soup.addEventListener("load", () => resolve(null));
  });
  soup.src = address;
  document.body.replaceChildren(soup);
  const message = await outcome, shown = soup.shadowRoot.querySelector("[part=message]");
  return [message, shown.hidden ? "" : shown.textContent];
}, src);

test("damaged files give one line", () => {
  pages["/none.html"] = html("");
  const flipped = (bytes, at) => {
    const damaged = Buffer.from(bytes);
    damaged[at] ^= 0xff;
    return damaged;
  };
  // In the middle of the textures, and in a run of places through both files.
  const { document, binary } = decodeGlb(model, "model.glb"),
    { bufferView } = document.extensions.TRISOUP_neural_textures.textures;
  const { byteOffset, byteLength } = document.bufferViews[bufferView];
  const middle = model.length - binary.length + byteOffset + (byteLength >> 1);
  const files = [[], ["no model at all"], model.subarray(0, 1000), model.subarray(0, model.length - 1),
    model.subarray(0, model.length >> 1),
    flipped(model, 0), flipped(model, 9), flipped(model, 30), flipped(model, middle)];
  for (const file of corpus) {
    for (let at = 40; at < file.length; at += 613) files.push(flipped(file, at));
    for (let length = 20; length < file.length; length += 1402) files.push(file.subarray(0, length));
  }
  return on("/none.html", async (page) => {
    let told = 0;
    for (const [i, bytes] of files.entries()) {
      pages["/damaged.glb"] = Buffer.concat([bytes].flat().map((part) => Buffer.from(part)));
      const [event, shown] = await verdict(page, `/damaged.glb?${i}`);
      assert.equal(event ?? "", shown);
      if (event !== null) {
        assert.match(event, /^damaged\.glb: .+; .+/);
        ++told;
      }
      if (i < 9) assert.notEqual(event, null, `file ${i} was drawn`);
    }
    assert.ok(told > files.length / 2, `${told} of ${files.length} are refused`);
    assert.deepEqual(await verdict(page, "/model.glb"), [null, ""], "a good one after them");
  });
});

test("what the network does is told", () => {
  pages["/none.html"] = html("");
  pages["/gone.glb"] = (response) => { response.statusCode = 410; response.end(); };
  pages["/cut.glb"] = (response) => {
    response.setHeader("Content-Length", model.length);
    response.write(model.subarray(0, 100000), () => setTimeout(() => response.destroy(), 100));
  };
  return on("/none.html", async (page) => {
    for (const [address, line] of [["/gone.glb", /gone\.glb: the server answers 410/],
      ["/cut.glb", /cut\.glb: .*(broke off|cannot be reached)/],
      ["http://127.0.0.1:1/away.glb", /away\.glb: cannot be reached/],
      ["#nowhere", /#nowhere: the page has no such model/]]) {
      const [event, shown] = await verdict(page, address);
      assert.match(event, line);
      assert.equal(shown, event);
    }
  }, { allowed: [/Failed to load resource/, /violates the following Content Security Policy directive.*connect-src/,
    /Fetch API cannot load/] });
});

test("loading is shown: a poster, then progress", () => {
  const half = model.length >> 1;
  let finish;
  pages["/slow.glb"] = (response) => {
    response.setHeader("Content-Length", model.length);
    response.write(model.subarray(0, half));
    finish = () => response.end(model.subarray(half));
  };
  pages["/slow.html"] = html('<tri-soup src="/slow.glb" poster="/icon.png"></tri-soup>');
  const state = () => {
    const part = (name) => document.querySelector("tri-soup").shadowRoot.querySelector(`[part=${name}]`);
    return { poster: !part("poster").hidden, progress: !part("progress").hidden, canvas: !part("canvas").hidden,
      value: part("progress").value };
  };
  return on("/slow.html", async (page) => {
    // All of the first half is there, and the other one has not been sent.
    await page.run(async (expected) => {
      const soup = document.querySelector("tri-soup"), bar = soup.shadowRoot.querySelector("[part=progress]");
      while (!(bar.value >= expected)) await new Promise((resolve) => setTimeout(resolve, 10));
      soup.addEventListener("progress",
        (event) => { window.last = [event.loaded, event.total, event.lengthComputable]; });
    }, half / model.length);
    assert.deepEqual(await page.run(state),
      { poster: true, progress: true, canvas: false, value: half / model.length });
    finish();
    await page.run(async () => {
      while (!document.querySelector("tri-soup").loaded) await new Promise((resolve) => setTimeout(resolve, 10));
    });
    const { poster, progress, canvas } = await page.run(state);
    assert.deepEqual([poster, progress, canvas], [false, false, true]);
    assert.deepEqual(await page.run(() => window.last), [model.length, model.length, true]);
  }, { wait: false });
});

test("without WebGL2 there is a message", async () => {
  const old = await Browser.launch(["--disable-3d-apis"]);
  try {
    pages["/none.html"] = html("");
    await on("/none.html", async (page) => {
      const [event, shown] = await verdict(page, "/model.glb");
      assert.match(event, /no WebGL2/);
      assert.equal(shown, event);
    }, { by: old });
  } finally {
    await old.close();
  }
});

test("a browser that alters pixels is told of, not drawn with", () => {
  pages["/none.html"] = html("");
  return on("/none.html", async (page) => {
    const [event, shown] = await verdict(page, "/model.glb");
    assert.match(event, /alters the pixels/);
    assert.equal(shown, event);
  }, {
    begin: () => {
      const { createImageBitmap } = window;
      window.createImageBitmap = (source) => createImageBitmap(source);  // as one that knows no options
    },
  });
});

test("an exported page on a phone: its camera, its policy, touch", () => on("/page/", async (page) => {
  assert.equal(await page.run(() => document.title), 'A "page" & <more>');
  const own = page.requests.filter((url) => url.startsWith(`${server.url}/page/`))
    .map((url) => url.slice(server.url.length + 6));
  assert.deepEqual([...new Set(own)].sort(), ["", "model.glb", "page.css", "poster.webp", "tri-soup.js"]);
  assert.deepEqual(["", "model.glb", "tri-soup.js"].map((name) => own.filter((other) => other === name).length),
    [1, 1, 1]);
  const before = await picture(page, 0);
  assert.deepEqual([before.width, before.height], [1170, 2532]);
  mkdirSync(join(scratch, "pictures"), { recursive: true });
  writeFileSync(join(scratch, "pictures", "phone.png"), await page.screenshot());
  // The width of the photograph fits, so a square in the middle is what soup-view draws, but for ties along edges.
  native("soup-view", modelPath, "--screenshot", join(scratch, "native.png"), "--camera", "1", "--size", "1170x1170",
    "--aa", "msaa");
  const expected = readPng(join(scratch, "native.png")).rgb, above = 1170 * ((2532 - 1170) / 2);
  let far = 0;
  for (let p = 0; p < expected.length / 3; ++p)
    if ([0, 1, 2].some((c) => Math.abs(expected[3 * p + c] - before.rgba[4 * (p + above) + c]) > 2)) ++far;
  assert.ok(far < (0.02 * expected.length) / 3, `${far} pixels are others than soup-view's`);
}, { screen: { width: 390, height: 844, ratio: 3, touch: true } }));

// With a ratio of 1: a ninth of the work, for the same CSS pixels.
test("fingers on an exported page turn, move and near the scene, and not the page", () => on("/page/", async (page) => {
  const touch = (type, ...points) => page.send("Input.dispatchTouchEvent",
    { type, touchPoints: points.map(([x, y], id) => ({ x, y, id })) });
  // Apart without moving their middle, then together without coming nearer.
  const moves = {
    "one finger": [[[200, 400]], [[240, 420]]], "a pinch": [[[150, 400], [250, 400]], [[100, 400], [300, 400]]],
    "two fingers": [[[150, 400], [250, 400]], [[170, 430], [270, 430]]],
  };
  let last = Buffer.from((await picture(page, 0)).rgba);
  for (const [name, [from, to]] of Object.entries(moves)) {
    await touch("touchStart", ...from);
    await touch("touchMove", ...to);
    await touch("touchEnd");
    const now = Buffer.from((await picture(page, 0)).rgba);
    assert.ok(!now.equals(last), `${name}: nothing has moved`);
    last = now;
  }
  assert.deepEqual(await page.run(() => [scrollX, scrollY, visualViewport.scale]), [0, 0, 1], "the page itself stays");
  writeFileSync(join(scratch, "pictures", "phone-moved.png"), await page.screenshot());
}, { screen: { width: 390, height: 844, ratio: 1, touch: true } }));

// An emulated screen tells nobody of its new ratio, so this is what a page finds when it draws next.
test("on a screen of another ratio there are as many pixels as it has", () => on("/one.html", async (page) => {
  for (const [camera, ratio] of [2, 1, 1.5].entries()) {
    await page.send("Emulation.setDeviceMetricsOverride",
      { width: 800, height: 600, deviceScaleFactor: ratio, mobile: false });
    const { width, height, rgba } = await picture(page, 0, { settings: { camera } });
    assert.deepEqual([width, height], [ratio * SIZE, ratio * SIZE]);
    assert.ok(rgba.some((value) => value < 100), "it is drawn anew");
  }
}));

test("a page of one file opens from a disk and asks for nothing",
  () => on(`file://${join(scratch, "page.html")}`, async (page) => {
  const shown = await picture(page, 0);
  assert.deepEqual([shown.width, shown.height], [SIZE, SIZE]);
  assert.ok(shown.rgba.some((value) => value < 100));
  assert.deepEqual(page.requests.filter((url) => !url.startsWith("data:")), [`file://${join(scratch, "page.html")}`]);
}, { screen: { width: SIZE, height: SIZE } }));

test("soup-view --serve shows the page, and its benchmark measures", async () => {
  const served = spawn(join(bin, "soup-view"), [modelPath, "--serve", "--port", "0", "--camera", "1"],
    { stdio: ["ignore", "pipe", "inherit"] });
  const ended = new Promise((resolve) => served.once("exit", (code) => resolve(code)));
  try {
    const [, url] = /^(http:\/\/127\.0\.0\.1:\d+)\//
      .exec(await new Promise((resolve) => served.stdout.once("data", (text) => resolve(String(text)))));
    let ours;
    await on("/one.html", async (page) => { ours = await picture(page, 0, { settings: { camera: 1 } }); });
    await on(`${url}/`, async (page) => {
      assert.deepEqual((await picture(page, 0)).rgba, ours.rgba);
    }, { screen: { width: SIZE, height: SIZE } });
    await on(`${url}/benchmark.html?width=64&height=64&views=2&warmup=0&run`, async (page) => {
      const rows = await page.run(async () => {
        while (document.querySelector("table").hidden) await new Promise((resolve) => setTimeout(resolve, 20));
        return document.querySelectorAll("tr").length;
      });
      assert.ok(rows >= 3, `${rows} rows`);
    }, { wait: false });
  } finally {
    served.kill("SIGTERM");
  }
  assert.equal(await ended, 0);
});
