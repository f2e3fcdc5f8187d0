// `node wasm.mjs MODULE FOLDER MODELS...` writes the code of every model into a folder.
import fs from "node:fs";
import { basename, dirname } from "node:path";

const [file, folder, ...models] = process.argv.slice(2);
const module = await WebAssembly.compile(fs.readFileSync(file));
for (const path of models) {
  const { exports: host } = await WebAssembly.instantiate(module, {});
  const put = (bytes) => {
    const at = host.space(bytes.length);
    new Uint8Array(host.memory.buffer, at, bytes.length).set(bytes);
    return [at, bytes.length];
  };
  // Descriptions name only models beside them.
  for (const other of models.filter((other) => other !== path && dirname(other) === dirname(path))) {
    host.file(...put(Buffer.from(basename(other))), ...put(fs.readFileSync(other)));
  }
  const at = host.run(...put(Buffer.from(path)), ...put(fs.readFileSync(path)));
  fs.writeFileSync(`${folder}/${path.replaceAll("/", "_")}.rs`, Buffer.from(host.memory.buffer, at, host.length()));
}
