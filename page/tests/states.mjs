// `node states.mjs [MODELS...]`: states of the shipped models after 10,000 steps, and their generated code, have the bits of a
// native build, which are in page/states.txt.
import { readFileSync } from "node:fs";
import { engine, filesOf, hash, options, scriptsAreFresh } from "./engine.mjs";

const only = process.argv.slice(2);
let [checked, failed] = [0, 0];
for (const line of readFileSync(new URL("../states.txt", import.meta.url), "utf8").trim().split("\n")) {
  const [path, ...expected] = line.split(" ");
  if (only.length && !only.includes(path)) continue;
  const page = engine(), begin = performance.now();
  const { ok, text } = page.open(path.split("/").pop(), filesOf(path), options(path));
  let got = text.split("\n")[0].replace(`${path.split("/").pop()}: error: `, "");
  if (ok) {
    const { nq, nv } = JSON.parse(text);
    const { done } = page.advance(10000);
    const numbers = page.look(false);
    const state = [numbers[0], ...numbers.slice(13, 13 + nq + nv)].map((x) => (Number.isNaN(x) ? NaN : x));
    const source = new TextEncoder().encode(page.source());
    got = `${done} ${hash(new Uint8Array(new Float64Array(state).buffer))} ${hash(source)}`;
  }
  checked++;
  if (got !== expected.join(" ")) {
    failed++;
    console.log(`${path}: ${got}, natively ${expected.join(" ")}`);
  } else if (process.env.TIMES) console.log(`${path}: ${(performance.now() - begin).toFixed(0)} ms, ${page.exports.assembled()} functions assembled`);
}
console.log(`${checked - failed} of ${checked} models: state after 10,000 steps and generated code with the bits of a native build`);
if (!scriptsAreFresh) console.log("cli/src/view/page.js.lzma is stale: run `bash .ci/page.sh --scripts`");
process.exitCode = failed || !checked || !scriptsAreFresh ? 1 : 0;
