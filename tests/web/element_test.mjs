// What <tri-soup> offers to scripts and visitors: cameras, controls, links, paths, hotspots, headsets.
import assert from "node:assert/strict";
import { mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { before, test } from "node:test";
import { fileURLToPath } from "node:url";
import { gzipSync } from "node:zlib";
import { decodeModel } from "../../web/model.js";
import { SIZE, html, largePath, model, modelPath, native, on, pages, picture, scratch, server } from "./harness.mjs";

const MOST_BYTES = 40_000;  // of the module, compressed

/** Runs in the page: waits until the camera rests. */
const rest = () => new Promise((resolve) => {
  const look = () => (document.querySelector("tri-soup").moving ? requestAnimationFrame(look) : resolve());
  requestAnimationFrame(() => requestAnimationFrame(look));
});
/** Runs in the page: waits until the scene is drawn, even if something was wrong with it. */
const loaded = async () => {
  while (!document.querySelector("tri-soup").loaded) await new Promise((resolve) => setTimeout(resolve, 20));
};
const state = () => document.querySelector("tri-soup").camera;
const near = (actual, expected, within = 1e-6) => actual.forEach((value, i) =>
  assert.ok(Math.abs(value - expected[i]) <= within, `${actual} is not ${expected}`));
const press = async (page, code) => {
  await page.send("Input.dispatchKeyEvent", { type: "keyDown", code, key: code });
  await page.send("Input.dispatchKeyEvent", { type: "keyUp", code, key: code });
};
const click = async (page, x, y, count = 1) => {
  for (let clickCount = 1; clickCount <= count; ++clickCount)
    for (const type of ["mousePressed", "mouseReleased"])
      await page.send("Input.dispatchMouseEvent", { type, x, y, button: "left", clickCount });
};
const wheel = async (page, deltaY, modifiers = 0) => {
  await page.send("Input.dispatchMouseEvent", { type: "mouseWheel", x: 50, y: 50, deltaX: 0, deltaY, modifiers });
  await page.run(() => new Promise((resolve) => setTimeout(resolve, 400)));
  await page.run(rest);
};
/** Collects messages of `error` events from the start of a page. */
const collect = () => {
  window.told = [];
  addEventListener("error", (event) => window.told.push(event.message), true);
};
const COMPLAINT = /^<tri-soup>: /;
const ALONE = { width: SIZE, height: SIZE };

before(() => {
  native("soup-export", modelPath, "-o", join(scratch, "product"), "--title", "Garden", "--overwrite");
  pages["/product/"] = join(scratch, "product");
  pages["/other.glb"] = readFileSync(largePath);
  mkdirSync(join(scratch, "pictures"), { recursive: true });
});

test("the module of a page has at most 40 KB, compressed", () => {
  const bytes = gzipSync(readFileSync(join(scratch, "product", "tri-soup.js")), { level: 9 }).length;
  console.log(`${bytes} bytes`);
  assert.ok(bytes <= MOST_BYTES, `${bytes} bytes`);
});

test("a script reads and sets the camera", () => on("/one.html", async (page) => {
  const first = await page.run(state);
  assert.deepEqual([first.index, first.matrix.length, first.position.length], [0, 16, 3]);
  near(first.matrix.slice(12, 15), first.position);
  const exact = await picture(page, 0);
  const events = await page.run(async () => {
    const soup = document.querySelector("tri-soup");
    let changes = 0;
    soup.addEventListener("camerachange", () => ++changes);
    const { position, target, up } = soup.camera;
    soup.camera = { position: position.map((x, i) => target[i] + 1.5 * (x - target[i])), target, up, fov: 30 };
    await new Promise((resolve) => setTimeout(resolve, 200));
    return changes;
  });
  assert.equal(events, 1);
  const set = await page.run(state);
  assert.equal(set.index, null);
  near([set.fov], [30]);
  near(set.target, first.target);
  near(set.position, first.position.map((x, i) => first.target[i] + 1.5 * (x - first.target[i])));
  assert.notDeepEqual((await picture(page, 0)).rgba, exact.rgba);
  // What was read can be set again, by its matrix too.
  const [again, byMatrix] = [await picture(page, 0, { settings: { camera: set } }),
    await picture(page, 0, { settings: { camera: { matrix: set.matrix, fov: 30, aspect: set.aspect } } })];
  let far = 0;
  for (let i = 0; i < again.rgba.length; ++i) if (Math.abs(again.rgba[i] - byMatrix.rgba[i]) > 2) ++far;
  assert.ok(far < 0.002 * again.rgba.length, `${far} values differ`);
  await picture(page, 0, { settings: { camera: 0 } });
  assert.deepEqual((await picture(page, 0)).rgba, exact.rgba, "a number is still one of the model's cameras");
}));

test("another model of the same scene is shown from the same camera", () => on("/one.html", async (page) => {
  await picture(page, 0, { settings: { camera: 2 } });
  const before = await picture(page, 0), camera = await page.run(state);
  assert.deepEqual(await page.run(() => document.querySelector("tri-soup").cameraAt(2)), camera);
  assert.equal(await page.run(() => document.querySelector("tri-soup").replace("/other.glb")), true);
  const after = await picture(page, 0);
  assert.notDeepEqual(after.rgba, before.rgba, "the picture is that of the model before");
  assert.deepEqual(await page.run(state), camera);
  assert.equal(await page.run(() => document.querySelector("tri-soup").replace("/none.glb")), false);
  assert.deepEqual((await picture(page, 0)).rgba, after.rgba, "a model that is missing empties the scene");
}, { allowed: [COMPLAINT, /404/] }));

test("a camera that is none gives one line, and the scene stays", () => {
  pages["/far.html"] = html('<tri-soup src="/model.glb" camera="999"></tri-soup>');
  return on("/far.html", async (page) => {
    await page.run(loaded);
    const before = await picture(page, 0);
    assert.ok(before.rgba.some((value) => value < 100), "a blank page");
    assert.equal((await page.run(state)).index, 0);
    const told = await page.run(async () => {
      const soup = document.querySelector("tri-soup");
      soup.camera = { position: [NaN, 0, 0] };
      soup.camera = { fov: 1000 };
      soup.camera = "nobody";
      const arrived = await soup.flyTo(1e6);
      return [...window.told, arrived];
    });
    assert.match(told[0], /^model\.glb: has no camera 999; give a name, or a number below \d+/);
    assert.match(told[1], /^camera\.position is \[NaN, 0, 0\]; give 3 finite numbers$/);
    assert.match(told[2], /^camera\.fov is 1000; give/);
    assert.match(told[3], /has no camera nobody; /);
    assert.match(told[4], /has no camera 1000000; /);
    assert.deepEqual(told.slice(5), [false]);
    assert.deepEqual((await picture(page, 0)).rgba, before.rgba);
  }, { begin: collect, allowed: [COMPLAINT], wait: false });
});

test("a change of the camera is animated, and at once where motion is not wanted",
  () => on("/one.html", async (page) => {
  const fly = () => page.run(async () => {
    const soup = document.querySelector("tri-soup"), seen = new Set();
    soup.addEventListener("camerachange", () => seen.add(soup.camera.position.join()));
    const start = performance.now(), arrived = await soup.flyTo(soup.camera.index === 3 ? 4 : 3, { seconds: 0.3 });
    return [arrived, soup.camera.index, performance.now() - start, seen.size];
  });
  const [arrived, index, ms, seen] = await fly();
  assert.deepEqual([arrived, index], [true, 3]);
  assert.ok(ms > 200 && seen >= 2, `${seen} views in ${ms} ms`);
  const flown = await picture(page, 0), set = await picture(page, 0, { settings: { camera: 3 } });
  assert.deepEqual(flown.rgba, set.rgba, "it does not arrive exactly");
  const interrupted = await page.run(async () => {
    const soup = document.querySelector("tri-soup"), flight = soup.flyTo(5, { seconds: 9 });
    soup.flyTo(3, { seconds: 0 });
    return flight;
  });
  assert.equal(interrupted, false);
  await page.send("Emulation.setEmulatedMedia", { features: [{ name: "prefers-reduced-motion", value: "reduce" }] });
  assert.ok((await fly())[2] < 200);
}));

const toolbar = (page) => page.run(() => {
  const root = document.querySelector("tri-soup").shadowRoot, bar = root.querySelector("[part=controls]");
  if (bar.hidden) return [];
  return [...bar.querySelectorAll("button, select")].filter((node) => node.checkVisibility()).map((node) => {
    const { left, top, right, bottom, width, height } = node.getBoundingClientRect();
    const inside = left >= 0 && top >= 0 && right <= innerWidth && bottom <= innerHeight;
    return { label: node.getAttribute("aria-label"), fits: inside && width >= 44 && height >= 44 };
  });
});
const push = (page, label) => page.run((name) => [...document.querySelector("tri-soup").shadowRoot
  .querySelectorAll("button")].find((node) => node.getAttribute("aria-label") === name).click(), label);

for (const [name, screen] of [["phone", { width: 390, height: 844, ratio: 1, touch: true }],
  ["window", { width: 1280, height: 800 }]])
  test(`controls of an exported page on a ${name}`, () => on("/product/", async (page) => {
    const buttons = await toolbar(page);
    assert.deepEqual(buttons.map((button) => button.label), ["Previous camera", "Camera", "Next camera", "First view",
      "Copy a link to this view", "Full screen", "Help"]);
    for (const { label, fits } of buttons) assert.ok(fits, `${label} is cut off or too small for a finger`);
    await push(page, "Next camera");
    await page.run(rest);
    assert.equal((await page.run(state)).index, 1);
    assert.equal(await page.run(() => document.querySelector("tri-soup").shadowRoot.querySelector("select").value),
      "1");
    await page.run(() => {
      const select = document.querySelector("tri-soup").shadowRoot.querySelector("select");
      select.value = "4";
      select.dispatchEvent(new Event("change"));
    });
    await page.run(rest);
    assert.equal((await page.run(state)).index, 4);
    writeFileSync(join(scratch, "pictures", `controls-${name}.png`), await page.screenshot());
    await push(page, "First view");
    await page.run(rest);
    assert.equal((await page.run(state)).index, 0);
    await push(page, "Help");
    const help = () => page.run(() => {
      const dialog = document.querySelector("tri-soup").shadowRoot.querySelector("dialog");
      return dialog ? [dialog.open, dialog.textContent.includes("turn around this point"),
        dialog.getBoundingClientRect().right <= innerWidth] : null;
    });
    assert.deepEqual(await help(), [true, true, true]);
    writeFileSync(join(scratch, "pictures", `help-${name}.png`), await page.screenshot());
    await page.send("Input.dispatchKeyEvent", { type: "rawKeyDown", code: "Escape", key: "Escape",
      windowsVirtualKeyCode: 27 });
    await page.run(() => new Promise((resolve) => setTimeout(resolve, 100)));
    assert.equal(await help(), null, "Escape closes it");
  }, { screen }));

test("full screen fills the screen, and its button leaves it", () => {
  pages["/whole.html"] = html('<tri-soup src="/model.glb" controls></tri-soup>');
  return on("/whole.html", async (page) => {
    const pushed = async () => {
      const [x, y] = await page.run(() => {
        const box = document.querySelector("tri-soup").shadowRoot.querySelector("[title*='ull screen']")
          .getBoundingClientRect();
        return [box.left + 20, box.top + 20];
      });
      await click(page, x, y);
      return page.run(async () => {
        await new Promise((resolve) => setTimeout(resolve, 1000));
        const soup = document.querySelector("tri-soup"), { width, height } = soup.getBoundingClientRect();
        return [document.fullscreenElement === soup, width === innerWidth && height === innerHeight,
          soup.shadowRoot.querySelector("[title*='ull screen']").title];
      });
    };
    assert.deepEqual(await pushed(), [true, true, "Leave full screen"]);
    assert.deepEqual(await pushed(), [false, false, "Full screen"]);
  });
});

test("without the attribute there are no controls, and each can be left out", () => {
  pages["/some.html"] = html('<tri-soup src="/model.glb" controls="help reset nonsense"></tri-soup>');
  return on("/one.html", async (page) => {
    assert.deepEqual(await toolbar(page), []);
    await page.run(() => document.querySelector("tri-soup").focus());
    for (const code of ["KeyH", "Enter", "KeyL"]) await press(page, code);
    assert.deepEqual(await page.run(() => [document.fullscreenElement,
      document.querySelector("tri-soup").shadowRoot.querySelector("dialog"), location.hash]), [null, null, ""]);
    assert.equal(await page.run(() => document.querySelector("tri-soup").getAttribute("role")), "img");
    await page.open(`${server.url}/some.html`);
    await page.run(loaded);
    assert.deepEqual((await toolbar(page)).map((button) => button.label), ["First view", "Help"]);
    assert.equal(await page.run(() => document.querySelector("tri-soup").getAttribute("role")), "group");
  });
});

test("keys of a page that the scene fills work at once", () => on("/product/", async (page) => {
  await press(page, "BracketRight");
  await page.run(rest);
  assert.equal((await page.run(state)).index, 1);
  const far = (await page.run(state)).position;
  await press(page, "ArrowRight");
  await page.run(rest);
  assert.notDeepEqual((await page.run(state)).position, far);
  await press(page, "Home");
  await page.run(rest);
  assert.equal((await page.run(state)).index, 0);
  await page.run(() => {
    document.querySelector("tri-soup").requestFullscreen = async () => { window.asked = true; };
  });
  await press(page, "Enter");
  assert.equal(await page.run(() => window.asked), true);
  await page.send("Input.dispatchKeyEvent", { type: "keyDown", code: "KeyH", key: "h" });
  assert.ok(await page.run(() => document.querySelector("tri-soup").shadowRoot.querySelector("dialog").open));
}, { screen: ALONE }));

test("in a page that scrolls, the wheel zooms after a click or with Ctrl", () => {
  pages["/long.html"] = html('<tri-soup src="/model.glb"></tri-soup><div id="long"></div>' +
    '<link rel="stylesheet" href="/long.css">');
  pages["/long.css"] = "#long { height: 3000px; width: 10px } body { display: block }";
  const at = async (page) => [await page.run(() => scrollY), (await page.run(state)).position];
  return on("/long.html", async (page) => {
    const [, from] = await at(page);
    await wheel(page, 60);
    const [scrolled, still] = await at(page);
    assert.ok(scrolled > 0);
    assert.deepEqual(still, from);
    const hint = () => page.run(() => {
      const line = document.querySelector("tri-soup").shadowRoot.querySelector("[part=hint]");
      return line.hidden ? null : line.textContent;
    });
    assert.equal(await hint(), null, "without controls nothing is shown over the scene");
    await wheel(page, -500);
    await page.run(() => { document.querySelector("tri-soup").controls = true; });
    await wheel(page, 20);
    assert.equal(await hint(), "Click the scene, or hold Ctrl, to zoom with the wheel.");
    await wheel(page, -500);
    await page.run(() => { document.querySelector("tri-soup").controls = false; });
    await wheel(page, 60, 2);
    const [top, zoomed] = await at(page);
    assert.equal(top, 0);
    assert.notDeepEqual(zoomed, from);
    await click(page, 50, 50);
    await wheel(page, 60);
    const [after, more] = await at(page);
    assert.equal(after, 0);
    assert.notDeepEqual(more, zoomed);
    for (const [policy, scrolls] of [["never", true], ["modifier", true], ["always", false]]) {
      await page.run((value) => { document.querySelector("tri-soup").wheel = value; }, policy);
      await wheel(page, 30);
      assert.equal((await at(page))[0] > 0, scrolls, policy);
      await page.run(() => scrollTo(0, 0));
    }
  });
});

test("a double click sets the point that the camera turns around", () => on("/one.html", async (page) => {
  // The middle of what is drawn: any pixel that shows a triangle.
  const { rgba, width } = await picture(page, 0);
  const shows = (p) => [0, 1, 2].every((c) => rgba[4 * p + c] < 200);
  const pixel = [...Array(width * width).keys()].filter((p) => {
    const [x, y] = [p % width, Math.floor(p / width)];
    return Math.abs(x - 100) > 20 && Math.abs(y - 100) < 60 && [0, 1, -1, width, -width].every((d) => shows(p + d));
  })[0], [x, y] = [pixel % width, Math.floor(pixel / width)];
  const before = await page.run(state);
  await click(page, x + 0.5, y + 0.5, 2);
  await page.run(rest);
  const after = await page.run(state);
  near(after.position, before.position, 1e-4);
  const tangent = Math.tan((before.fov * Math.PI) / 360), m = before.matrix;
  const [a, b] = [((x + 0.5) / 100 - 1) * tangent * before.aspect, (1 - (y + 0.5) / 100) * tangent];
  const ray = [0, 1, 2].map((i) => a * m[i] + b * m[4 + i] - m[8 + i]);
  const unit = (v) => v.map((c) => c / Math.hypot(...v));
  near(unit(after.target.map((c, i) => c - after.position[i])), unit(ray), 0.01);
  assert.ok(Math.abs(Math.hypot(...after.target.map((c, i) => c - after.position[i])) -
    Math.hypot(...before.target.map((c, i) => c - before.position[i]))) > 1e-3, "the distance is of the surface");
  await click(page, 2.5, 2.5, 2);  // nothing is there
  await page.run(rest);
  near((await page.run(state)).target, after.target, 1e-6);
}));

test("by touch: a double tap sets the point, a tap on a button is the button's", () => on("/product/", async (page) => {
  const touch = (type, ...points) => page.send("Input.dispatchTouchEvent",
    { type, touchPoints: points.map(([x, y], id) => ({ x, y, id })) });
  const tap = async (x, y) => {
    await touch("touchStart", [x, y]);
    await touch("touchEnd");
  };
  // Some place in the middle that shows a triangle.
  const { rgba, width, height } = await picture(page, 0), dark = (x, y) =>
    rgba[4 * (y * width + x)] < 200 && rgba[4 * ((y + 3) * width + x)] < 200 && rgba[4 * (y * width + x + 3)] < 200;
  const places = [...Array(80).keys()].flatMap((row) => [...Array(20).keys()].map((column) =>
    [60 + 7 * column, Math.floor(height / 2) - 160 + 4 * row])), [x, y] = places.find(([i, j]) => dark(i, j));
  const before = await page.run(state);
  await tap(x, y);
  await page.run(rest);
  assert.deepEqual((await page.run(state)).target, before.target, "one tap moves nothing");
  await page.run(() => new Promise((resolve) => setTimeout(resolve, 500)));
  await tap(x, y);
  await tap(x + 2, y + 1);
  await page.run(rest);
  const after = await page.run(state);
  near(after.position, before.position, 1e-4);
  assert.notDeepEqual(after.target, before.target);
  const [left, top] = await page.run(() => {
    const box = document.querySelector("tri-soup").shadowRoot.querySelector("[title='Next camera']")
      .getBoundingClientRect();
    return [box.left + 20, box.top + 20];
  });
  await tap(left, top);
  await page.run(rest);
  assert.equal((await page.run(state)).index, 1);
}, { screen: { width: 390, height: 844, ratio: 1, touch: true } }));

test("an address has the camera, and an edited one is told of", () => {
  pages["/link.html"] = html('<tri-soup src="/model.glb" permalink controls></tri-soup>');
  let link, shown;
  const open = (address, action, rest) => on(address, action, { begin: collect, ...rest });
  return open("/link.html#other=1", async (page) => {
    assert.equal(await page.run(() => location.hash), "#other=1", "nothing has changed yet");
    await page.run(() => document.querySelector("tri-soup").focus());
    for (const code of ["ArrowRight", "ArrowUp", "ArrowUp"]) await press(page, code);
    await page.run(rest);
    await page.run(() => new Promise((resolve) => setTimeout(resolve, 500)));
    link = await page.run(() => location.href);
    assert.match(link, /#other=1&camera=(-?[\d.e-]+,){10}-?[\d.e-]+$/);
    assert.equal(await page.run(() => document.querySelector("tri-soup").link), link);
    shown = await picture(page, 0);
    await page.run(() => {
      Object.defineProperty(navigator, "clipboard",
        { value: { writeText: async (text) => { window.copied = text; } } });
    });
    await push(page, "Copy a link to this view");
    assert.equal(await page.run(() => window.copied), link);
    await page.run(() => { location.hash = "#camera=4"; });
    await page.run(rest);
    assert.equal((await page.run(state)).index, 4);
  }).then(() => open(link, async (page) => {
    const again = await picture(page, 0);
    let far = 0;
    for (let i = 0; i < again.rgba.length; ++i) if (Math.abs(again.rgba[i] - shown.rgba[i]) > 2) ++far;
    assert.ok(far < 0.002 * again.rgba.length, `${far} values differ`);
  })).then(async () => {
    for (const [hash, words] of [["#camera=1,2,x", /the link's camera "1,2,x" is cut off or edited; copy the whole/],
      ["#camera=77777", /the link's camera is 77777, and model\.glb has \d+; copy the link again/],
      ["#camera=0,0,0,0,0,0,40,1", /target is at its position; /]])
      await open(`/link.html${hash}`, async (page) => {
        await page.run(loaded);
        const shown = await page.run(() => {
          const hint = document.querySelector("tri-soup").shadowRoot.querySelector("[part=hint]");
          return hint.hidden ? "" : hint.textContent;
        });
        assert.match(shown, words);
        assert.match((await page.run(() => window.told)).join(), words);
        assert.equal((await page.run(state)).index, 0, "the first view is shown");
      }, { allowed: [COMPLAINT], wait: false });
  });
});

test("paths are played, by scripts and by a button", () => {
  pages["/path.html"] = html('<tri-soup src="/model.glb" path="/path.json" controls></tri-soup>');
  pages["/bad.json"] = "no json";
  pages["/none.json"] = "{}";
  return on("/path.html", async (page) => {
    const { position, target } = await page.run(state);
    const at = (s) => position.map((x, i) => x + s * (target[i] - x));
    pages["/path.json"] = JSON.stringify({ keyframes: [0, 0.2, 0.4].map((time) =>
      ({ time, position: at(time), target, fov: 30 + 50 * time })) });
    const [events, states] = await page.run(async () => {
      const soup = document.querySelector("tri-soup"), names = [];
      for (const name of ["play", "pause", "ended"]) soup.addEventListener(name, () => names.push(name));
      const ended = new Promise((resolve) => soup.addEventListener("ended", resolve));
      const plays = await soup.play(), during = [plays, soup.paused, soup.duration];
      await ended;
      return [names, [...during, soup.paused, soup.currentTime, soup.camera]];
    });
    assert.deepEqual(events, ["play", "ended"]);
    assert.deepEqual(states.slice(0, 5), [true, false, 0.4, true, 0.4]);
    near(states[5].position, at(0.4));
    near([states[5].fov], [50]);
    await page.run(() => { document.querySelector("tri-soup").currentTime = 0.2; });
    near((await page.run(state)).position, at(0.2));
    // On a busy machine a path that ends would have ended before the button is pressed again.
    await page.run(() => { document.querySelector("tri-soup").loop = true; });
    await push(page, "Play");
    await page.run(() => new Promise((resolve) => requestAnimationFrame(() => requestAnimationFrame(resolve))));
    assert.equal(await page.run(() => document.querySelector("tri-soup").paused), false);
    await push(page, "Pause");
    assert.equal(await page.run(() => document.querySelector("tri-soup").paused), true);
    await page.run(() => { document.querySelector("tri-soup").loop = false; });
    // A nerfstudio path as an object, and what is no path.
    const told = await page.run(async () => {
      const soup = document.querySelector("tri-soup"), c = soup.camera.matrix, lines = [];
      const rows = [0, 1, 2, 3].flatMap((r) => [0, 1, 2, 3].map((column) => c[4 * column + r]));
      lines.push(await soup.play({ camera_path: [{ camera_to_world: rows, fov: 33, aspect: 1 }], fps: 24 }));
      lines.push(soup.camera.fov);
      soup.addEventListener("error", (event) => lines.push(event.message));
      for (const path of ["/bad.json", "/none.json", "/gone.json", { keyframes: [{ time: 0 }] }])
        lines.push(await soup.play(path));
      return lines;
    });
    assert.equal(told[0], true);
    near([told[1]], [33]);
    assert.match(told[2], /^bad\.json: is not JSON \(.*\); check/);
    assert.match(told[4], /^\/none\.json: is not a camera path; give JSON/);
    assert.match(told[6], /^gone\.json: the server answers 404; /);
    assert.match(told[8], /^path: keyframes\[0\] has no pose; /);
    assert.deepEqual([3, 5, 7, 9].map((i) => told[i]), [false, false, false, false]);
  }, { allowed: [COMPLAINT, /404/] });
});

test("a visitor stops a path, and a scene that is out of sight rests", () => on("/one.html", async (page) => {
  const paused = await page.run(async () => {
    const soup = document.querySelector("tri-soup"), { position, target } = soup.camera;
    await soup.play({ keyframes: [{ time: 0, position, target }, { time: 60, position, target }], loop: true });
    return soup.paused;
  });
  assert.equal(paused, false);
  await page.send("Input.dispatchMouseEvent", { type: "mousePressed", x: 60, y: 60, button: "left", buttons: 1 });
  await page.send("Input.dispatchMouseEvent", { type: "mouseMoved", x: 80, y: 60, button: "left", buttons: 1 });
  assert.equal(await page.run(() => document.querySelector("tri-soup").paused), true);
}));

test("hotspots lie where they say, and a click tells the page", () => {
  const spots = (p, q) => `<button slot="hotspot-a" data-position="${p.join(" ")}" data-camera="2">Here</button>
    <button slot="hotspot-b" data-position="${q.join(" ")}">Behind</button>
    <button slot="hotspot-c" data-position="1 NaN 2">Broken</button><button slot="hotspot-d">Nowhere</button>`;
  return on("/one.html", async (page) => {
    const { position, target, matrix, fov, aspect } = await page.run(state);
    const behind = position.map((x, i) => x - (target[i] - x));
    // A point right of and above the middle, before everything.
    const distance = Math.hypot(...target.map((t, i) => t - position[i]));
    const place = position.map((x, i) =>
      x + (0.2 * (target[i] - x)) / distance + 0.04 * matrix[i] + 0.02 * matrix[4 + i]);
    pages["/spots.html"] = html(`<tri-soup src="/model.glb">${spots(place, behind)}</tri-soup>`);
    await page.open(`${server.url}/spots.html`);
    await page.run(loaded);
    await page.run(rest);
    const [box, hidden, told] = await page.run(() => {
      const middle = document.querySelector("[slot=hotspot-a]").getBoundingClientRect();
      return [[(middle.left + middle.right) / 2, (middle.top + middle.bottom) / 2, middle.height],
        ["b", "c", "d"].map((name) => document.querySelector(`[slot=hotspot-${name}]`).checkVisibility()), window.told];
    });
    const tangent = Math.tan((fov * Math.PI) / 360);
    near(box.slice(0, 2), [100 + (100 * 0.2) / (tangent * aspect), 100 - (100 * 0.1) / tangent], 0.6);
    assert.ok(box[2] >= 44);
    assert.deepEqual(hidden, [false, false, false]);
    assert.match(told[0], /^hotspot-c: data-position "1 NaN 2" is \[1, NaN, 2\]; give 3 finite numbers$/);
    assert.match(told[1], /^hotspot-d: has no data-position; give data-position="x y z"$/);
    await page.run(() => document.querySelector("tri-soup").addEventListener("hotspot",
      (event) => { window.clicked = event.detail; }));
    await click(page, ...box.slice(0, 2));
    const clicked = await page.run(() => window.clicked);
    assert.equal(clicked.name, "hotspot-a");
    near(clicked.position, place, 1e-9);
    await page.run(rest);
    assert.equal((await page.run(state)).index, 2, "data-camera");
    // One that lies behind the soup is faded; children that come and go are followed.
    const faded = await page.run(async () => {
      const soup = document.querySelector("tri-soup");
      await soup.flyTo(0, { seconds: 0 });
      const { position: eye, target: aim } = soup.camera;  // the soup lies between the camera and the new one
      const late = document.createElement("button");
      late.slot = "hotspot-late";
      late.dataset.position = eye.map((x, i) => x + 1.9 * (aim[i] - x)).join(" ");
      soup.append(late);
      await new Promise((resolve) => setTimeout(resolve, 600));
      return [late, document.querySelector("[slot=hotspot-a]")]
        .map((node) => getComputedStyle(node.assignedSlot.parentElement).opacity);
    });
    assert.deepEqual(faded, ["0.25", "1"]);
  }, { begin: collect, allowed: [COMPLAINT] });
});

test("nothing is drawn while nothing changes, with all controls", () => {
  pages["/rests.html"] = html(`<tri-soup src="/model.glb" controls permalink>
    <button slot="hotspot-1" data-position="0 0 0">x</button></tri-soup>`);
  return on("/rests.html", async (page) => {
    await page.run(() => document.querySelector("tri-soup").flyTo(2));
    await page.run(rest);
    await page.run(() => new Promise((resolve) => setTimeout(resolve, 500)));
    const [before, after] = await page.run(async () => {
      const count = window.count;
      await new Promise((resolve) => setTimeout(resolve, 500));
      return [count, window.count];
    });
    assert.ok(before > 5);
    assert.equal(after, before);
  }, { begin: () => {
    const { drawArrays } = WebGL2RenderingContext.prototype;
    window.count = 0;
    WebGL2RenderingContext.prototype.drawArrays = function (...rest) {
      ++window.count;
      drawArrays.apply(this, rest);
    };
  } });
});

test("a lazy element loads when it comes near, and one without interaction does not move", () => {
  pages["/lazy.html"] = html(`<div id="long"></div><tri-soup src="/model.glb" loading="lazy" interaction="none"
    poster="/icon.png"></tri-soup><link rel="stylesheet" href="/long.css">`);
  pages["/long.css"] = "#long { height: 3000px; width: 10px } body { display: block }";
  pages["/eager.glb"] = model;
  return on("/lazy.html", async (page) => {
    await page.run(() => {
      const eager = document.createElement("tri-soup");
      eager.id = "eager";
      document.body.append(eager);
      setTimeout(() => { eager.src = "/eager.glb"; }, 200);  // when it is known to be out of sight
    });
    await page.run(() => new Promise((resolve) => setTimeout(resolve, 500)));
    assert.equal(page.requests.some((url) => url.endsWith("/model.glb")), false, "loaded far away");
    assert.equal(page.requests.some((url) => url.endsWith("/eager.glb")), true, "waits without being lazy");
    await page.run(async () => {
      scrollTo(0, 3000);
      while (!document.querySelector("tri-soup").loaded) await new Promise((resolve) => setTimeout(resolve, 20));
    });
    const [x, y] = await page.run(() => {
      const box = document.querySelector("tri-soup").getBoundingClientRect();
      return [box.left + 50, box.top + 50];
    });
    const { position } = await page.run(state);
    await page.send("Input.dispatchMouseEvent", { type: "mousePressed", x, y, button: "left", buttons: 1 });
    await page.send("Input.dispatchMouseEvent", { type: "mouseMoved", x: x + 30, y, button: "left", buttons: 1 });
    await page.send("Input.dispatchMouseEvent", { type: "mouseReleased", x, y, button: "left" });
    await page.run(rest);
    assert.deepEqual((await page.run(state)).position, position);
    assert.equal(await page.run(() => document.querySelector("tri-soup").hasAttribute("tabindex")), false);
  }, { wait: false });
});

test("a lazy element loads if it was out of sight one frame ago", () => {
  pages["/busy.html"] = html('<tri-soup src="/model.glb" loading="lazy"></tri-soup>');
  return on("/busy.html", async (page) => {
    assert.equal(await page.run(state).then(({ position }) => position.length), 3);
  }, { begin: () => {
    window.IntersectionObserver = class {
      constructor(tell) { this.tell = tell; }
      observe() { setTimeout(() => this.tell([{ isIntersecting: false }, { isIntersecting: true }])); }
      disconnect() {}
    };
  } });
});

test("a page opened from a disk says what to do", () => on(`file://${join(scratch, "product", "index.html")}`,
  async (page) => {
  await page.run(() => new Promise((resolve) => setTimeout(resolve, 2600)));
  const text = await page.run(() => {
    const line = document.querySelector("tri-soup > p"), box = line.getBoundingClientRect();
    return [line.textContent, getComputedStyle(line).visibility, box.bottom <= innerHeight && box.height > 20,
      document.querySelector("tri-soup > img").naturalWidth > 0];
  });
  assert.match(text[0], /opened this page from a disk.*python3 -m http\.server.*--single-file/);
  assert.deepEqual(text.slice(1), ["visible", true, true]);
  writeFileSync(join(scratch, "pictures", "disk.png"), await page.screenshot());
}, { wait: false, allowed: [/blocked by CORS policy/, /Failed to load resource/],
  screen: { width: 390, height: 844 } }));

/** A headset: two views of 64 x 64 pixels side by side, as WebXR describes them. */
const fakeHeadset = () => {
  const SIDE = 64, f = 1 / Math.tan(0.6);
  const projection = new Float32Array([f, 0, 0, 0, 0, f, 0, 0, 0, 0, -1, -1, 0, 0, -0.02, 0]);
  window.views = [-1, 1].map((side) => ({ eye: side < 0 ? "left" : "right", projectionMatrix: projection,
    transform: { matrix: new Float32Array([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0.1 * side, 0, 0, 1]) } }));
  window.XRWebGLLayer = class {
    constructor(session, gl) {
      Object.assign(this,
        { gl, framebuffer: gl.createFramebuffer(), framebufferWidth: 2 * SIDE, framebufferHeight: SIDE });
      const texture = gl.createTexture();
      gl.activeTexture(gl.TEXTURE0 + 15);
      gl.bindTexture(gl.TEXTURE_2D, texture);
      gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA8, 2 * SIDE, SIDE);
      gl.bindFramebuffer(gl.FRAMEBUFFER, this.framebuffer);
      gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, texture, 0);
      gl.bindFramebuffer(gl.FRAMEBUFFER, null);
      window.layer = this;
    }
    getViewport(view) { return { x: view.eye === "left" ? 0 : SIDE, y: 0, width: SIDE, height: SIDE }; }
  };
  class Session extends EventTarget {
    async updateRenderState(values) { this.state = values; }
    async requestReferenceSpace(kind) { return { kind }; }
    requestAnimationFrame(draw) {
      setTimeout(() => {
        draw(performance.now(), { getViewerPose: () => ({ views: window.views }) });
        window.frames3d = (window.frames3d ?? 0) + 1;
      }, 10);
    }
    async end() { this.dispatchEvent(new Event("end")); }
  }
  Object.defineProperty(navigator, "xr", { value: {
    isSessionSupported: async (mode) => mode === "immersive-vr" || window.withAr === true,
    requestSession: async (mode) => {
      if (window.refuse) throw new Error("no headset");
      window.mode = mode;
      return new Session();
    },
  } });
  WebGL2RenderingContext.prototype.makeXRCompatible = async () => {};
};

/** Runs in the page: shows the scene in the headset and returns what its two eyes see, RGBA, top row first. */
const throughHeadset = async (mode) => {
  const soup = document.querySelector("tri-soup"), frames = window.frames3d ?? 0, shown = await soup.enterXR(mode);
  while (!(window.frames3d > frames + 2)) await new Promise((resolve) => setTimeout(resolve, 10));
  const { gl, framebuffer } = window.layer, pixels = new Uint8Array(4 * 128 * 64);
  gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
  gl.readPixels(0, 0, 128, 64, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
  gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  soup.exitXR();
  const row = (eye, y) => [...pixels.slice(4 * (128 * y + 64 * eye), 4 * (128 * y + 64 * eye + 64))];
  const rows = [...Array(64).keys()].reverse();
  return { shown, mode: window.mode, eyes: [0, 1].map((eye) => rows.flatMap((y) => row(eye, y))) };
};

test("the element has the members of its types", () => {
  const types = readFileSync(new URL("../../web/tri-soup.d.ts", import.meta.url), "utf8");
  const body = types.slice(types.indexOf("export class TriSoup"), types.indexOf("addEventListener<K"));
  const members = new Set([...body.matchAll(/^  (?:readonly |get |set )?(\w+)[:(?]/gm)].map((found) => found[1]));
  assert.ok(members.size > 25, `${[...members]}`);
  return on("/one.html", async (page) => {
    assert.deepEqual(await page.run((names) => {
      const soup = document.querySelector("tri-soup");
      return names.filter((name) => !(name in soup));
    }, [...members]), []);
  });
});

test("the examples run", () => {
  pages["/examples/page/"] = fileURLToPath(new URL("../../examples/page", import.meta.url));
  pages["/examples/page/model.glb"] = model;
  const press = (id) => document.getElementById(id).click();
  return on("/examples/page/", async (page) => {
    const soup = (id) => page.run(async (name) => {
      const element = document.getElementById(name);
      element.scrollIntoView();
      const begun = performance.now();
      while (!element.loaded || (element.moving && !element.autorotate && element.paused)) {
        if (performance.now() > begun + 40_000)
          throw new Error(`${name}: loaded ${element.loaded}, moving ${element.moving}, paused ${element.paused}, ` +
            `at ${JSON.stringify(element.getBoundingClientRect())}, "${element.shadowRoot.textContent}"`);
        await new Promise((resolve) => setTimeout(resolve, 20));
      }
      const { position, target, index } = element.camera;
      return { index, distance: Math.hypot(...target.map((x, i) => x - position[i])) };
    }, id);
    const far = await soup("camera");
    await page.run(press, "closer");
    near([(await soup("camera")).distance], [0.5 * far.distance], 1e-6);
    assert.match(await page.run(() => document.getElementById("pose").textContent), /^-?\d+\.\d+, /);
    await page.run(press, "back");
    assert.equal((await soup("camera")).index, 0);
    await soup("path");
    await page.run(() => new Promise((resolve) => {
      document.getElementById("path").addEventListener("timeupdate", resolve, { once: true });
      document.getElementById("play").click();
    }));
    assert.match(await page.run(() => document.getElementById("time").textContent), /^\d+\.\d of 8\.0 s$/);
    await page.run(() => document.getElementById("path").pause());
    await soup("hotspots");
    await page.run(() => document.querySelector("[slot=hotspot-middle]").click());
    assert.equal((await soup("hotspots")).index, 1);
    assert.match(await page.run(() => document.getElementById("clicked").textContent), /^hotspot-middle at /);
    await soup("link");
    await soup("picture");
    writeFileSync(join(scratch, "pictures", "examples.png"), await page.screenshot());
  }, { wait: false });
});

test("a headset gets one view per eye, each as a camera at its place shows the scene", () => {
  pages["/xr.html"] = html('<tri-soup src="/model.glb" controls aa="none"></tri-soup>');
  const { up } = decodeModel(new Uint8Array(model), "x");
  return on("/xr.html", async (page) => {
    const labels = (await toolbar(page)).map((button) => button.label);
    assert.ok(labels.includes("Virtual reality") && !labels.includes("Augmented reality"), `${labels}`);
    const { position, target, matrix } = await page.run(state);
    await page.run(() => {
      window.seen = [];
      for (const name of ["xrstart", "xrend"])
        document.querySelector("tri-soup").addEventListener(name, () => window.seen.push(name));
    });
    const { shown, mode, eyes } = await page.run(throughHeadset, "immersive-vr");
    assert.deepEqual([shown, mode, await page.run(() => window.seen)], [true, "immersive-vr", ["xrstart", "xrend"]]);
    // The room is level, and the target is two metres away; the eyes are 0.1 m beside the middle.
    const minus = (a, b) => a.map((x, i) => x - b[i]), plus = (a, b, s) => a.map((x, i) => x + s * b[i]);
    const dot = (a, b) => a.reduce((sum, x, i) => sum + x * b[i], 0), ahead = minus(target, position);
    const level = plus(ahead, up, -dot(ahead, up)), metre = Math.hypot(...ahead) / 2;
    near([dot(matrix.slice(0, 3), up)], [0], 0.02);
    const side = plus(matrix.slice(0, 3), up, -dot(matrix.slice(0, 3), up));
    await page.run(() => Object.assign(document.querySelector("tri-soup").style, { width: "64px", height: "64px" }));
    for (const [eye, sign] of [[0, -1], [1, 1]]) {
      const from = plus(position, side, 0.1 * sign * metre);
      const camera = { position: from, target: plus(from, level, 1), up, fov: (2 * 0.6 * 180) / Math.PI, aspect: 1 };
      const { rgba, width } = await picture(page, 0, { settings: { camera } });
      assert.equal(width, 64);
      const others = [...rgba].filter((value, i) => i % 4 < 3 && Math.abs(value - eyes[eye][i]) > 3).length;
      const covered = [...rgba].filter((value, i) => i % 4 === 0 && value < 230).length;
      assert.ok(covered > 200, `nothing to see: ${covered}`);
      assert.ok(others < 0.02 * rgba.length, `eye ${eye}: ${others} values differ`);
    }
    assert.ok(eyes[0].some((value, i) => Math.abs(value - eyes[1][i]) > 50), "both eyes see the same");
    assert.ok(eyes[0].every((value, i) => i % 4 < 3 || value === 255), "a hole in the background");
  }, { begin: fakeHeadset });
});

test("over the room, pixels without a triangle are transparent; a headset that fails is told of", () =>
  on("/xr.html", async (page) => {
  const { eyes: [left] } = await page.run(throughHeadset, "immersive-ar"), alphas = left.filter((_, i) => i % 4 === 3);
  assert.ok(alphas.includes(0) && alphas.includes(255), `${new Set(alphas)}`);
  const refused = await page.run(async () => {
    window.refuse = true;
    const soup = document.querySelector("tri-soup"), told = [];
    soup.addEventListener("error", (event) => told.push(event.message));
    return [await soup.enterXR(), ...told];
  });
  assert.equal(refused[0], false);
  assert.match(refused[1], /^the headset does not start \(no headset\); connect it/);
  assert.ok((await picture(page, 0)).rgba.some((value) => value < 100), "the page shows the scene again");
}, { begin: fakeHeadset, allowed: [COMPLAINT] }));
