// The engine of the page in Node, from the committed files.
import { readdirSync, readFileSync } from "node:fs";
import { packed } from "../scripts.mjs";

const view = new URL("../../cli/src/view/", import.meta.url), read = (name) => readFileSync(new URL(name, view));
const { unlzma } = new Function(`${read("unpack.js")}; return { unlzma };`)();
/** The engine's bytes, as a page unpacks them. */
export const unpacked = () => unlzma(read("page.wasm.lzma"));
export const module = await WebAssembly.compile(unpacked());
const make = new Function(`${read("engine.js")}; return makeEngine;`)();

/** Whether the packed scripts are those of the folder. */
export const scriptsAreFresh = new TextDecoder().decode(unlzma(read("page.js.lzma"))) === packed();

/** A fresh instance. */
export const engine = () => make(module);

/** Fowler, Noll and Vo's hash, as `page/src/main.rs` has it. */
export function hash(bytes) {
  let [low, high] = [0x84222325, 0xcbf29ce4];
  for (const byte of bytes) {
    low = (low ^ byte) >>> 0;
    // Times 0x100000001b3, in halves.
    const product = low * 0x1b3, carried = Math.floor(product / 2 ** 32);
    high = (Math.imul(high, 0x1b3) + carried + (low << 8)) >>> 0;
    low = product >>> 0;
  }
  return high.toString(16).padStart(8, "0") + low.toString(16).padStart(8, "0");
}

/** A model's file and those beside it whose names are in its text, in quotes: `[name, contents]` each. */
export function filesOf(path) {
  const at = new URL(`../../${path}`, import.meta.url), name = path.split("/").pop(), text = readFileSync(at, "utf8");
  const others = readdirSync(new URL(".", at)).filter((other) => other !== name && text.includes(`"${other}"`));
  return [name, ...others].map((each) => [each, readFileSync(new URL(each, at))]);
}

/** How the models of the project are read that need an option. */
export const options = (path) => ({ floating: ["solo12", "g1"].some((name) => path.split("/").pop().includes(name)), floor: null });
