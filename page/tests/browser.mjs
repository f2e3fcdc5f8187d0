// `node browser.mjs MBD [--broken N] [--quick]`: the page that the program MBD writes, in Chromium: it makes no request, its
// robots move, states have the bits of a native build, pulling keeps the balance of
// the energy, and broken files that are dropped are told.
import { execFileSync } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync, statSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { fileURLToPath } from "node:url";
import { chromium } from "./chromium.mjs";
import { filesOf, options } from "./engine.mjs";
import { broken } from "./malformed.mjs";

const [mbd, ...flags] = process.argv.slice(2);
const flag = (name, standard) => (flags.includes(name) ? flags[flags.indexOf(name) + 1] : standard);
const root = fileURLToPath(new URL("../../", import.meta.url)), folder = mkdtempSync(join(tmpdir(), "page-"));
const quick = flags.includes("--quick");
const failures = [];
const claim = (holds, text) => {
  console.log(`${holds ? "  " : "! "}${text}`);
  if (!holds) failures.push(text);
};
const browser = await chromium();
/** Writes a page and opens it. `#still` begins without a motion. */
async function opened(model, more = [], look = {}, hash = "") {
  const file = join(folder, "page.html");
  execFileSync(mbd, ["view", ...(model ? [join(root, model)] : []), ...more, "-o", file], { stdio: ["ignore", "ignore", "pipe"] });
  const page = await browser.page(`file://${file}${hash}`, look);
  await page.until("typeof page !== 'undefined' && page.first !== undefined");
  return { page, size: statSync(file).size };
}
const quiet = (page, name) => claim(!page.troubles.length && page.requests.length <= 1, `${name}: no error, no request ${page.troubles.join("; ").slice(0, 300)}`);

try {
  // How fast it is here.
  const ROBOTS = [["models/ur5.urdf", []], ["models/g1.urdf", ["--base", "floating"]], ["models/mechanisms/stewart.toml", []], ["models/contacts/quadruped.toml", []]];
  for (const [model, more] of quick ? ROBOTS.slice(0, 1) : ROBOTS) {
    const { page, size } = await opened(model, more);
    const first = await page.evaluate("page.first");
    await page.until("page.measured.steps > 200 || !$('trouble').hidden");
    // Until the page has found how fine its pictures can be.
    if (!quick) await new Promise((resolve) => setTimeout(resolve, 5000));
    const { ms, t, frames, fineness, trouble } = JSON.parse(await page.evaluate(`(async () => {
      const from = [performance.now(), page.instant.t, page.measured.frames];
      await new Promise((resolve) => setTimeout(resolve, ${quick ? 800 : 3000}));
      const to = [performance.now(), page.instant.t, page.measured.frames], [ms, t, frames] = to.map((x, k) => x - from[k]);
      return JSON.stringify({ ms, t, frames, fineness: canvas.fineness, trouble: $("trouble-text").textContent });
    })()`));
    // Times are told only: other programs may run, and there may be no GPU. `speed.mjs` judges by the processor's time.
    claim(!trouble, `${model}: ${(size / 1000).toFixed(0)} kB, first picture after ${first.toFixed(0)} ms, ${((1000 * t) / ms).toFixed(2)} times real time, ${((1000 * frames) / ms).toFixed(0)} pictures a second at ${fineness.toFixed(2)} of the fineness ${trouble}`);
    quiet(page, model);
    await page.close();
  }

  const { page, size } = await opened("models/double_pendulum.toml", [], {}, "#still");
  claim(size <= 940000, `size of a page: ${size} bytes`);

  // Bits: the engine in the page itself.
  await page.evaluate(`globalThis.makeEngine = new Function(${JSON.stringify(readFileSync(join(root, "cli/src/view/engine.js"), "utf8"))} + "; return makeEngine;")()`);
  let [same, all] = [0, 0];
  for (const line of readFileSync(join(root, "page/states.txt"), "utf8").trim().split("\n")) {
    const [path, done, state, source] = line.split(" ");
    if (!/^\d+$/.test(done)) continue;
    const files = filesOf(path).map(([name, contents]) => [name, contents.toString("base64")]);
    const got = await page.evaluate(`(async () => {
      const { hash } = await globalThis.hashing;
      const one = makeEngine(engine.module);
      const { ok, text } = one.open(${JSON.stringify(files[0][0])}, ${JSON.stringify(files)}.map(([name, contents]) => [name, unpacked(contents)]), ${JSON.stringify(options(path))});
      if (!ok) return text;
      const { nq, nv } = JSON.parse(text), { done } = one.advance(10000), numbers = one.look(false);
      const state = [numbers[0], ...numbers.slice(13, 13 + nq + nv)].map((x) => (Number.isNaN(x) ? NaN : x));
      return [done, hash(new Uint8Array(new Float64Array(state).buffer)), hash(new TextEncoder().encode(one.source()))].join(" ");
    })()`.replace("await globalThis.hashing", `{ hash: ${readFileSync(new URL("./engine.mjs", import.meta.url), "utf8").match(/export (function hash[\s\S]*?\n})/)[1]} }`));
    all++;
    if (got === `${done} ${state} ${source}`) same++;
    else claim(false, `${path}: ${got}, natively ${done} ${state} ${source}`);
  }
  claim(same === all && all > 0, `${same} of ${all} models: state after 10,000 steps and generated code have the bits of a native build`);

  // Pulling: the balance of the energy holds, with the work of the hand in it.
  const grip = JSON.parse(await page.evaluate(`(async () => {
    const at = canvas.project(page.instant.place(page.scene.bodies[1].frame, page.scene.bodies[1].com));
    return JSON.stringify(at);
  })()`));
  await page.evaluate("play(true)");
  await page.mouse("mousePressed", grip[0], grip[1], { buttons: 1 });
  for (let k = 1; k <= 20; k++) {
    await page.mouse("mouseMoved", grip[0] + 6 * k, grip[1] - 8 * k, { buttons: 1 });
    await page.wait(50);
  }
  await page.until("page.instant.spring > 0");
  const held = JSON.parse(await page.evaluate("JSON.stringify({ hold: Boolean(page.hold), spring: page.instant.spring, kinetic: Math.max(...page.history.map((i) => i.kinetic)), error: Math.max(...page.history.map((i) => Math.abs(i.error))), work: page.instant.work })"));
  await page.mouse("mouseReleased", grip[0] + 120, grip[1] - 160);
  claim(held.hold && held.spring > 0, `a body is pulled: ${held.spring.toFixed(3)} J in the spring`);
  claim(held.error < 1e-4 * held.kinetic, `energy and work balance while a body is pulled: ${(held.error / held.kinetic).toExponential(1)} of the largest kinetic energy`);
  await page.until("!page.hold && page.instant.hand() === null");

  // Broken files.
  const count = +flag("--broken", 1000);
  const files = Array.from({ length: count }, () => broken()).map(([name, text]) => [name, Buffer.from(text).toString("base64")]);
  let told = 0, longest = 0;
  for (let k = 0; k < files.length; k += 50) {
    const answers = JSON.parse(await page.evaluate(`(async () => {
      const out = [];
      for (const [name, contents] of ${JSON.stringify(files.slice(k, k + 50))}) {
        const begin = performance.now(), ok = await open([[name, unpacked(contents).buffer]]);
        out.push([ok || !$("trouble").hidden && $("trouble-text").textContent.length > 0, performance.now() - begin, $("trouble-text").textContent.includes("unreachable")]);
      }
      return JSON.stringify(out);
    })()`));
    for (const [is, ms, crashed] of answers) {
      told += is && !crashed;
      longest = Math.max(longest, ms);
    }
  }
  claim(told === count && longest < 10000, `${told} of ${count} broken files opened or told, at most ${longest.toFixed(0)} ms`);
  const text = readFileSync(join(root, "models/mechanisms/fourbar.toml")).toString("base64");
  claim(await page.evaluate(`open([["fourbar.toml", unpacked(${JSON.stringify(text)}).buffer]])`), "a sound file opens after them");
  quiet(page, "after all of it");
  await page.close();
} finally {
  await browser.close();
  rmSync(folder, { recursive: true, force: true });
}
console.log(failures.length ? `${failures.length} claims failed` : "the page keeps its claims");
process.exitCode = failures.length ? 1 : 0;
