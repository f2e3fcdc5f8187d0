// Vectors and matrices; matrices are column by column.

const add = (a, b) => a.map((x, k) => x + b[k]);
const sub = (a, b) => a.map((x, k) => x - b[k]);
const times = (s, a) => a.map((x) => s * x);
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const size = (a) => Math.hypot(a[0], a[1], a[2]);
const unit = (a) => times(1 / (size(a) || 1), a);

function product(a, b) {
  const out = new Float32Array(16);
  for (let i = 0; i < 4; i++)
    for (let j = 0; j < 4; j++) for (let k = 0; k < 4; k++) out[4 * j + i] += a[4 * k + i] * b[4 * j + k];
  return out;
}

/** Two directions at right angles to a unit vector. */
function across(n) {
  const x = unit(cross(n, Math.abs(n[2]) > 0.9 ? [1, 0, 0] : [0, 0, 1]));
  return [x, cross(n, x)];
}

/** A ball, or anything of size one, at a place. */
const scaled = (p, [x, y, z]) => [x, 0, 0, 0, 0, y, 0, 0, 0, 0, z, 0, ...p, 1];

/** What goes along z from 0 to 1, from one point to another with a radius. */
function along(from, to, radius) {
  const way = sub(to, from), [x, y] = across(unit(way));
  return [...times(radius, x), 0, ...times(radius, y), 0, ...way, 0, ...from, 1];
}
