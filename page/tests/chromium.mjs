// Chromium without a screen, by its protocol over a pipe: no package is needed.
import { spawn } from "node:child_process";
import { mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";

// Without a GPU the browser composes in software, as for a user; WebGL is drawn by SwiftShader.
const FLAGS = ["--headless=new", "--no-sandbox", "--no-first-run", "--disable-background-networking", "--disable-component-update", "--disable-sync", "--disable-extensions", "--enable-unsafe-swiftshader", "--hide-scrollbars", "--remote-debugging-pipe"];

/** A browser; `page` opens a file in it. */
export async function chromium() {
  const profile = mkdtempSync(join(tmpdir(), "chromium-"));
  const child = spawn("chromium", [...FLAGS, `--user-data-dir=${profile}`, "about:blank"], { stdio: ["ignore", "ignore", "ignore", "pipe", "pipe"] });
  const [, , , to, from] = child.stdio;
  const waiting = new Map(), listeners = [];
  let count = 0, rest = Buffer.alloc(0);
  from.on("data", (chunk) => {
    rest = Buffer.concat([rest, chunk]);
    for (let end; (end = rest.indexOf(0)) >= 0; rest = rest.subarray(end + 1)) {
      const message = JSON.parse(rest.subarray(0, end));
      if (message.id) {
        const { resolve, reject } = waiting.get(message.id);
        waiting.delete(message.id);
        if (message.error) reject(new Error(message.error.message));
        else resolve(message.result);
      } else listeners.forEach((listener) => listener(message));
    }
  });
  const send = (method, params = {}, sessionId = undefined) =>
    new Promise((resolve, reject) => {
      waiting.set(++count, { resolve, reject });
      to.write(`${JSON.stringify({ id: count, method, params, sessionId })}\0`);
    });
  const page = async (url, { width = 1280, height = 760, dark = false, scale = 1, mobile = false } = {}) => {
    const { targetId } = await send("Target.createTarget", { url: "about:blank" });
    const { sessionId } = await send("Target.attachToTarget", { targetId, flatten: true });
    const on = (method, params) => send(method, params, sessionId);
    const troubles = [], requests = [];
    listeners.push(({ sessionId: of, method, params }) => {
      if (of !== sessionId) return;
      if (method === "Runtime.exceptionThrown") troubles.push(params.exceptionDetails.exception?.description ?? params.exceptionDetails.text);
      if (method === "Runtime.consoleAPICalled" && params.type === "error") troubles.push(params.args.map((a) => a.value ?? a.description).join(" "));
      if (method === "Network.requestWillBeSent" && !/^(blob|data|about):/.test(params.request.url)) requests.push(params.request.url);
    });
    for (const domain of ["Page", "Runtime", "Network"]) await on(`${domain}.enable`);
    await on("Emulation.setDeviceMetricsOverride", { width, height, deviceScaleFactor: scale, mobile });
    await on("Emulation.setEmulatedMedia", { features: [{ name: "prefers-color-scheme", value: dark ? "dark" : "light" }] });
    const evaluate = async (expression) => {
      const { result, exceptionDetails } = await on("Runtime.evaluate", { expression, awaitPromise: true, returnByValue: true });
      if (exceptionDetails) throw new Error(exceptionDetails.exception?.description ?? exceptionDetails.text);
      return result.value;
    };
    await on("Page.navigate", { url });
    const wait = (ms) => new Promise((resolve) => setTimeout(resolve, ms));
    /** Waits until an expression is true. */
    const until = async (expression, ms = 60000) => {
      for (const end = Date.now() + ms; Date.now() < end; await wait(50)) if (await evaluate(`Boolean(${expression})`).catch(() => false)) return true;
      throw new Error(`it did not become true: ${expression}`);
    };
    const mouse = (type, x, y, more = {}) => on("Input.dispatchMouseEvent", { type, x, y, button: "left", clickCount: 1, ...more });
    const shot = async () => Buffer.from((await on("Page.captureScreenshot", { format: "png" })).data, "base64");
    return { on, evaluate, until, wait, mouse, shot, troubles, requests, close: () => send("Target.closeTarget", { targetId }) };
  };
  const close = async () => {
    const gone = new Promise((resolve) => child.on("exit", resolve));
    await send("Browser.close").catch(() => {});
    await gone;
    rmSync(profile, { recursive: true, force: true, maxRetries: 5, retryDelay: 200 });
  };
  return { page, close };
}
