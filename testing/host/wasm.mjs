// `node wasm.mjs MODULE FOLDER MODELS...` writes the code of every model into a folder.
import fs from "node:fs";

const [file, folder, ...models] = process.argv.slice(2);
const module = await WebAssembly.compile(fs.readFileSync(file));
for (const path of models) {
  const { exports: host } = await WebAssembly.instantiate(module, {});
  const put = (bytes) => {
    const at = host.space(bytes.length);
    new Uint8Array(host.memory.buffer, at, bytes.length).set(bytes);
    return [at, bytes.length];
  };
  const at = host.run(...put(Buffer.from(path)), ...put(fs.readFileSync(path)));
  fs.writeFileSync(`${folder}/${path.replaceAll("/", "_")}.rs`, Buffer.from(host.memory.buffer, at, host.length()));
}
