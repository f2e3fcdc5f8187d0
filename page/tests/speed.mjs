// `node speed.mjs`: processor time of a step of 1 ms, which must be less than that; other programs on the machine do not count.
import { readFileSync } from "node:fs";
import { engine, options } from "./engine.mjs";

const root = new URL("../../", import.meta.url);
for (const path of ["models/ur5.urdf", "models/g1.urdf", "models/mechanisms/stewart.toml", "models/contacts/quadruped.toml"]) {
  const page = engine(), name = path.split("/").pop();
  const answer = page.open(name, [[name, readFileSync(new URL(path, root))]], options(path));
  if (!answer.ok) throw new Error(answer.text);
  const measured = (steps) => {
    const before = process.cpuUsage(), { done, trouble } = page.advance(steps), { user, system } = process.cpuUsage(before);
    if (done < steps) throw new Error(`${path}: ${trouble}`);
    return (user + system) / steps;
  };
  const [first, later] = [measured(1000), measured(3000)];
  console.log(`${path}: ${first.toFixed(0)} µs a step in the first second, while code is assembled, then ${later.toFixed(0)} µs`);
  if (later > 1000 || first > 1500) process.exitCode = 1;
}
