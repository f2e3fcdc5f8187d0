// Prints the nanoseconds of a call of `rates()` of the module of a name (its path without the end), the least of many rounds.
import { readFile } from "node:fs/promises";

const ROUNDS = 600;
const CALLS = 3000;

const name = process.argv[2];
const { load } = await import(`${name}.mjs`);
const system = await load(await readFile(`${name}.wasm`));
// A state that is not the neutral one.
system.q.forEach((_, k) => (system.q[k] += 0.3 + 0.1 * k));
system.p.fill(0.5);
let least = Infinity;
let sum = 0;
for (let round = 0; round < ROUNDS; round++) {
  const from = process.hrtime.bigint();
  for (let call = 0; call < CALLS; call++) {
    sum += system.rates().pd[0];
  }
  least = Math.min(least, Number(process.hrtime.bigint() - from) / CALLS);
}
// The sum is used, so that no call can be left out.
console.log(Number.isFinite(sum) ? least : NaN);
