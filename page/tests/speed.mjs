// `node speed.mjs`: processor time of a step of 1 ms, which must be less than 0.7 ms, and of all that the engine does before the
// first picture, which must be less than a second; other programs on the machine do not count.
import { readFileSync } from "node:fs";
import { engine, options, unpacked } from "./engine.mjs";

/** Processor time of an action, ms. */
function spent(action) {
  const before = process.cpuUsage();
  action();
  const { user, system } = process.cpuUsage(before);
  return (user + system) / 1000;
}

const unpack = spent(() => new WebAssembly.Module(unpacked()));
const root = new URL("../../", import.meta.url);
for (const path of ["models/ur5.urdf", "models/g1.urdf", "models/mechanisms/stewart.toml", "models/contacts/quadruped.toml"]) {
  const page = engine(), name = path.split("/").pop();
  const ready = unpack + spent(() => {
    const answer = page.open(name, [[name, readFileSync(new URL(path, root))]], options(path));
    if (!answer.ok) throw new Error(answer.text);
    page.look(true);
    page.meshes();
  });
  /** Microseconds of a step. */
  const measured = (steps) =>
    (1000 / steps) *
    spent(() => {
      const { done, trouble } = page.advance(steps);
      if (done < steps) throw new Error(`${path}: ${trouble}`);
    });
  const [first, later] = [measured(1000), measured(3000)];
  console.log(`${path}: ready after ${ready.toFixed(0)} ms; ${first.toFixed(0)} µs a step in the first second, while code is assembled, then ${later.toFixed(0)} µs`);
  if (later > 700 || first > 1500 || ready > 1000) process.exitCode = 1;
}
