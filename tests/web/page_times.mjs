// node page_times.mjs BIN MODEL...: milliseconds a picture of each model in a headless Chromium, by our two passes and
// by those of the published viewer (published_structure.js), in turn, view by view; three sizes. Not a test: figures
// for docs/viewer.md. Best with nothing else running.
import { execFileSync } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join, resolve } from "node:path";
import { fileURLToPath } from "node:url";
import { Browser } from "./browser.mjs";
import { serve } from "./server.mjs";

const SIZES = [[480, 270], [960, 540], [1920, 1080]], VIEWS = 12, WARMUP = 3;

const median = (values) => [...values].sort((a, b) => a - b)[Math.floor(values.length / 2)];

const [bin, ...models] = process.argv.slice(2);
if (models.length === 0) {
  console.error("usage: node page_times.mjs BIN MODEL...   BIN: folder of the programs; MODEL: a model.glb");
  process.exit(2);
}
const scratch = mkdtempSync(join(tmpdir(), "trisoup-times-"));
const pages = {
  "/web/": fileURLToPath(new URL("../../web", import.meta.url)),
  "/tests/": fileURLToPath(new URL(".", import.meta.url)),
  "/two.html": '<!doctype html><meta charset="utf-8">', "/favicon.ico": "",
};
const server = await serve(pages), browser = await Browser.launch();
try {
  console.log("| model | size | ours, ms | published structure, ms | ours of it |\n| --- | --- | --- | --- | --- |");
  for (const [index, model] of models.entries()) {
    execFileSync(join(bin, "soup-export"),
      [resolve(model), "-o", join(scratch, String(index)), "--format", "published", "--title", "scene"]);
    pages[`/${index}/`] = join(scratch, String(index), "scene");
    pages[`/${index}.glb`] = readFileSync(model);
    for (const [width, height] of SIZES) {
      const page = await browser.page({ width, height });
      await page.open(`${server.url}/two.html`);
      const measured = await page.run(async (i, size, views, warmup) => {
        const { TwoStructures } = await import("/tests/two_structures.js"),
          two = await TwoStructures.load(`/${i}.glb`, `/${i}/`);
        return { times: two.times(two.views(views, ...size), warmup), triangles: two.triangles };
      }, index, [width, height], VIEWS, WARMUP);
      const [ours, published] = [0, 1].map((which) => median(measured.times.map((pair) => pair[which])));
      console.log(
        `| ${measured.triangles} | ${width} x ${height} | ${ours.toFixed(1)} | ${published.toFixed(1)} ` +
        `| ${(ours / published).toFixed(2)} |`);
      await page.close();
    }
  }
} finally {
  await browser.close();
  server.close();
  rmSync(scratch, { recursive: true });
}
