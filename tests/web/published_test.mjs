// The published viewer's pass structure beside ours (published_structure.js), of the same soup: that it shows the same,
// so that their times can be compared (page_times.mjs).
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";
import { fileURLToPath } from "node:url";
import { edited } from "./edit_glb.mjs";
import { bin, html, model, on, pages, scratch } from "./harness.mjs";

/** The model with an MLP whose colours are the direction's; a short training has learnt little that depends on it. */
function directed() {
  const w1 = 0, b1 = 256, w2 = 272, w3 = 544, b3 = 592, count = 595, firstDirection = 8;
  const mlp = new Float32Array(count);
  for (let c = 0; c < 3; ++c) {
    mlp[w1 + 16 * c + firstDirection + c] = 1;
    mlp[b1 + c] = 0.5;  // above the ReLU's corner
    mlp[w2 + 16 * c + c] = 1;
    mlp[w3 + 16 * c + c] = 8;
    mlp[b3 + c] = -4;
  }
  return edited(model, (document, extension, binary) =>
    binary.set(new Uint8Array(mlp.buffer), document.bufferViews[extension.mlp].byteOffset));
}

/** dB of RGB, of the pixels that differ by no more than `most` steps, and the share of those that do. */
function difference(a, b, most) {
  let squares = 0, others = 0, count = 0;
  for (let p = 0; p < a.length; p += 4) {
    const d = [0, 1, 2].map((c) => a[p + c] - b[p + c]);
    if (d.some((value) => Math.abs(value) > most)) ++others;
    else for (const value of d) squares += (value / 255) ** 2, ++count;
  }
  return { psnr: -10 * Math.log10(squares / count), others: others / (a.length / 4) };
}

test("the published structure shows what ours shows, and its directions are upside down where asked", async () => {
  const folder = join(scratch, "published"), path = join(scratch, "directed.glb");
  writeFileSync(path, directed());
  pages["/directed.glb"] = readFileSync(path);
  execFileSync(join(bin, "soup-export"),
    [path, "-o", folder, "--format", "published", "--title", "garden", "--overwrite"]);
  Object.assign(pages, { "/published/": join(folder, "garden"), "/tests/": fileURLToPath(new URL(".", import.meta.url)),
    "/two.html": html("") });
  await on("/two.html", async (page) => {
    const texts = await page.run(async () => {
      const { TwoStructures } = await import("/tests/two_structures.js"),
        two = await TwoStructures.load("/directed.glb", "/published/");
      const view = two.views(5, 320, 240)[1];
      return [two.rgba(0, view), two.rgba(1, view), two.rgba(1, view, true)];
    });
    const [ours, theirs, mirrored] = texts.map((text) => Buffer.from(text, "base64"));
    const same = difference(ours, theirs, 24), upsideDown = difference(ours, mirrored, 24);
    console.log(JSON.stringify({ same, upsideDown }));
    mkdirSync(join(scratch, "pictures"), { recursive: true });
    writeFileSync(join(scratch, "pictures", "two_structures.png"), await page.screenshot());
    // Bytes of its tables are cut off, not rounded.
    assert.ok(same.psnr > 55 && same.others < 0.001, JSON.stringify(same));
    assert.ok(upsideDown.psnr < same.psnr - 10, JSON.stringify(upsideDown));
  }, { wait: false, screen: { width: 980, height: 260 }, allowed: [/GPU stall due to ReadPixels/] });
});
