// A headless Chromium, driven over the DevTools protocol by its pipe: no package needed.
import { spawn } from "node:child_process";
import { existsSync, mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";

const CANDIDATES = [process.env.TRISOUP_CHROMIUM, "/usr/bin/chromium", "/usr/bin/chromium-browser",
  "/usr/bin/google-chrome"];
const PATIENCE_MS = 60_000;

/** Path of a Chromium; null where there is none. TRISOUP_CHROMIUM names another than Debian's. */
export const findChromium = () => CANDIDATES.find((path) => path && existsSync(path)) ?? null;

export class Browser {
  #process; #profile; #next = 1; #waiting = new Map(); #pages = new Map(); #rest = "";

  static async launch(switches = []) {
    const browser = new Browser();
    browser.#profile = mkdtempSync(join(tmpdir(), "trisoup-web-"));
    const fixed = ["--headless=new", "--remote-debugging-pipe", `--user-data-dir=${browser.#profile}`, "--no-first-run",
      "--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
      "--disable-gpu-watchdog", "--hide-scrollbars", "--disable-background-networking", "--disable-component-update",
      "--force-color-profile=srgb", "--disable-dev-shm-usage"];
    browser.#process = spawn(findChromium(), [...fixed, ...switches, "about:blank"],
      { stdio: ["ignore", "ignore", "ignore", "pipe", "pipe"] });
    browser.#process.stdio[4].setEncoding("utf8").on("data", (text) => browser.#receive(text));
    browser.#process.on("exit", (code) => {
      for (const { reject } of browser.#waiting.values()) reject(new Error(`chromium ended (${code})`));
      browser.#waiting.clear();
    });
    await browser.send("Target.setDiscoverTargets", { discover: false });
    return browser;
  }

  #receive(text) {
    const messages = (this.#rest + text).split("\0");
    this.#rest = messages.pop();
    for (const message of messages.map((m) => JSON.parse(m))) {
      const waiting = this.#waiting.get(message.id);
      if (!waiting) this.#pages.get(message.sessionId)?.receive(message);
      else if (message.error) waiting.reject(new Error(`${waiting.method}: ${message.error.message}`));
      else waiting.resolve(message.result);
      if (waiting) this.#waiting.delete(message.id);
    }
  }

  send(method, params = {}, sessionId = undefined) {
    const id = this.#next++;
    return new Promise((resolve, reject) => {
      const late = setTimeout(() => reject(new Error(`${method} takes more than ${PATIENCE_MS / 1000} s`)),
        PATIENCE_MS);
      const settle = (how) => (value) => { clearTimeout(late); how(value); };
      this.#waiting.set(id, { resolve: settle(resolve), reject: settle(reject), method });
      this.#process.stdio[3].write(JSON.stringify({ id, method, params, sessionId }) + "\0");
    });
  }

  /** @param {{width?: number, height?: number, ratio?: number, touch?: boolean}} screen */
  async page({ width = 800, height = 600, ratio = 1, touch = false } = {}) {
    const { targetId } = await this.send("Target.createTarget", { url: "about:blank" });
    const { sessionId } = await this.send("Target.attachToTarget", { targetId, flatten: true });
    const page = new Page(this, sessionId, targetId);
    this.#pages.set(sessionId, page);
    for (const domain of ["Page", "Runtime", "Log", "Network"]) await page.send(`${domain}.enable`);
    await page.send("Emulation.setDeviceMetricsOverride", { width, height, deviceScaleFactor: ratio, mobile: touch });
    if (touch) await page.send("Emulation.setTouchEmulationEnabled", { enabled: true, maxTouchPoints: 5 });
    return page;
  }

  async close() {
    const ended = new Promise((resolve) => this.#process.once("exit", resolve));
    this.send("Browser.close").catch(() => {});
    const late = setTimeout(() => this.#process.kill("SIGKILL"), 5000);
    await ended;
    clearTimeout(late);
    rmSync(this.#profile, { recursive: true, force: true, maxRetries: 10, retryDelay: 100 });
  }
}

export class Page {
  complaints = [];  // what stood in the console, and exceptions nobody caught
  requests = [];    // addresses
  #loaded = null;

  constructor(browser, sessionId, targetId) {
    this.browser = browser;
    this.sessionId = sessionId;
    this.targetId = targetId;
  }

  send(method, params) { return this.browser.send(method, params, this.sessionId); }

  receive({ method, params }) {
    if (method === "Runtime.consoleAPICalled" && ["error", "warning", "assert"].includes(params.type))
      this.complaints.push(params.args.map((a) => a.value ?? a.description).join(" "));
    if (method === "Runtime.exceptionThrown")
      this.complaints.push(params.exceptionDetails.exception?.description ?? params.exceptionDetails.text);
    if (method === "Log.entryAdded" && ["error", "warning"].includes(params.entry.level))
      this.complaints.push(`${params.entry.text} ${params.entry.url ?? ""}`);
    if (method === "Network.requestWillBeSent") this.requests.push(params.request.url);
    if (method === "Page.loadEventFired") this.#loaded?.();
  }

  async open(url) {
    const loaded = new Promise((resolve) => { this.#loaded = resolve; });
    const { errorText } = await this.send("Page.navigate", { url });
    if (errorText) throw new Error(`${url}: ${errorText}`);
    await loaded;
  }

  /** Runs a function in the page; arguments and result go as JSON, promises are awaited. */
  async run(action, ...values) {
    const expression = `(${action})(...${JSON.stringify(values)})`;
    const { result, exceptionDetails } = await this.send("Runtime.evaluate",
      { expression, awaitPromise: true, returnByValue: true });
    if (exceptionDetails) throw new Error(exceptionDetails.exception?.description ?? exceptionDetails.text);
    return result.value;
  }

  /** PNG of what is to be seen. */
  async screenshot() {
    return Buffer.from((await this.send("Page.captureScreenshot", { format: "png" })).data, "base64");
  }

  close() { return this.browser.send("Target.closeTarget", { targetId: this.targetId }); }
}
