// `node scripts.mjs` prints the scripts of the page as they are packed: those of the worker, a line, those of the page. Without
// indentation and lines that are comments, because every byte is in every page.
import { readFileSync } from "node:fs";

export const WORKER = ["unpack", "engine", "worker"];
export const PAGE = ["vectors", "meshes", "instant", "canvas", "figure", "plots", "visuals", "app", "panel", "input", "start"];
export const LINE = "\n//# page\n";

const view = new URL("../cli/src/view/", import.meta.url);

function trimmed(name) {
  let comment = false;
  const lines = readFileSync(new URL(`${name}.js`, view), "utf8").split("\n").map((line) => line.trim());
  const kept = lines.filter((line) => {
    if (line.startsWith("/*")) comment = true;
    const drop = comment || line === "" || line.startsWith("//");
    if (line.endsWith("*/")) comment = false;
    return !drop;
  });
  return kept.join("\n");
}

export const packed = () => `"use strict";\n${WORKER.map(trimmed).join("\n")}${LINE}"use strict";\n${PAGE.map(trimmed).join("\n")}\n`;

if (process.argv[1]?.endsWith("scripts.mjs")) process.stdout.write(packed());
