// Swings a double pendulum for five seconds with the classical Runge-Kutta method, and prints where it is and how well
// its energy is kept.
import { readFile } from "node:fs/promises";
import { DoublePendulum, load } from "./double_pendulum.js";

const pendulum = await load(await readFile(new URL("./double_pendulum.wasm", import.meta.url)));
const { NQ, NV, COORDINATES } = DoublePendulum;
const state = { q: Float64Array.of(2.0, 1.0), p: new Float64Array(NV) };
const zero = { qd: new Float64Array(NQ), pd: new Float64Array(NV) };

/** The rates where the state would be after `h` seconds of some earlier rates. */
function rates(h, { qd, pd }) {
  state.q.forEach((q, k) => (pendulum.q[k] = q + h * qd[k]));
  state.p.forEach((p, k) => (pendulum.p[k] = p + h * pd[k]));
  const next = pendulum.rates();
  // These are views of the module's memory, which the next call overwrites.
  return { qd: next.qd.slice(), pd: next.pd.slice() };
}

/** One step of `h` seconds. */
function step(h) {
  const a = rates(0, zero);
  const b = rates(h / 2, a);
  const c = rates(h / 2, b);
  const d = rates(h, c);
  for (const [slope, weight] of [[a, h / 6], [b, h / 3], [c, h / 3], [d, h / 6]]) {
    slope.qd.forEach((qd, k) => (state.q[k] += weight * qd));
    slope.pd.forEach((pd, k) => (state.p[k] += weight * pd));
  }
}

/** Kinetic and potential energy together, J. */
function energy() {
  pendulum.q.set(state.q);
  pendulum.p.set(state.p);
  const [kinetic, potential] = pendulum.energy();
  return kinetic + potential;
}

for (let second = 0; second <= 5; second++) {
  const angles = COORDINATES.map((name, k) => `${name} ${state.q[k].toFixed(3)} rad`);
  console.log(`${second} s: ${angles.join(", ")}; energy ${energy().toFixed(6)} J`);
  for (let k = 0; k < 1000; k++) {
    step(0.001);
  }
}
