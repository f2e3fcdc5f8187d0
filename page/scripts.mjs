// `node scripts.mjs` prints the scripts of the page and its style as they are packed: the scripts of the worker, those of the
// page, the style, with a line between them. Without indentation and lines that are comments, because every byte is in every page.
import { readFileSync } from "node:fs";

export const WORKER = ["unpack", "engine", "worker"];
export const PAGE = ["vectors", "meshes", "instant", "canvas", "figure", "plots", "visuals", "app", "panel", "input", "start"];
export const LINE = "\n//# part\n";

const view = new URL("../cli/src/view/", import.meta.url);

function trimmed(file) {
  let comment = false;
  const lines = readFileSync(new URL(file, view), "utf8").split("\n").map((line) => line.trim());
  const kept = lines.filter((line) => {
    if (line.startsWith("/*")) comment = true;
    const drop = comment || line === "" || line.startsWith("//");
    if (line.endsWith("*/")) comment = false;
    return !drop;
  });
  return kept.join("\n");
}

const script = (names) => `"use strict";\n${names.map((name) => trimmed(`${name}.js`)).join("\n")}\n`;

export const packed = () => [script(WORKER), script(PAGE), trimmed("page.css")].join(LINE);

if (process.argv[1]?.endsWith("scripts.mjs")) process.stdout.write(packed());
