// Meshes: triangles with a normal at each corner, six numbers a corner.

/** Around z, between a profile of `[radius, height, normal outwards, normal up]`. */
function turned(profile, corners = 32) {
  const out = [];
  const corner = (k, [r, z, n, u]) => {
    const a = (2 * Math.PI * k) / corners, [c, s] = [Math.cos(a), Math.sin(a)];
    out.push(r * c, r * s, z, n * c, n * s, u);
  };
  for (let k = 0; k < corners; k++)
    for (let i = 0; i + 1 < profile.length; i += 2) {
      const [low, high] = [profile[i], profile[i + 1]];
      [[k, low], [k + 1, low], [k + 1, high], [k, low], [k + 1, high], [k, high]].forEach((c) => corner(...c));
    }
  return new Float32Array(out);
}

/** A tube from 0 to 1 with radius 1; with lids a cylinder. */
const tube = () => turned([[1, 0, 1, 0], [1, 1, 1, 0]]);
const cylinder = () => turned([[0, -0.5, 0, -1], [1, -0.5, 0, -1], [1, -0.5, 1, 0], [1, 0.5, 1, 0], [1, 0.5, 0, 1], [0, 0.5, 0, 1]]);
const cone = () => turned([[0, 0, 0, -1], [1, 0, 0, -1], [1, 0, 0.9, 0.45], [0, 1, 0.9, 0.45]], 20);

function box() {
  const out = [];
  for (let axis = 0; axis < 3; axis++)
    for (const side of [-1, 1]) {
      const [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
      for (const [a, b] of [[-1, -1], [1, -1], [1, 1], [-1, -1], [1, 1], [-1, 1]]) {
        const p = [0, 0, 0], n = [0, 0, 0];
        [p[axis], p[u], p[v], n[axis]] = [side / 2, (a * side) / 2, b / 2, side];
        out.push(...p, ...n);
      }
    }
  return new Float32Array(out);
}

const square = () => new Float32Array([[-1, -1], [1, -1], [1, 1], [-1, -1], [1, 1], [-1, 1]].flatMap(([x, y]) => [x, y, 0, 0, 0, 1]));

/** Triangles without normals get those of their faces. */
function faceted(corners) {
  const out = new Float32Array(2 * corners.length);
  for (let k = 0; k + 8 < corners.length; k += 9) {
    const [a, b, c] = [0, 3, 6].map((i) => [...corners.slice(k + i, k + i + 3)]), n = unit(cross(sub(b, a), sub(c, a)));
    [a, b, c].forEach((p, i) => out.set([...p, ...n], 2 * k + 6 * i));
  }
  return out;
}

/** Corners that triangles share, once each, and the triangles as indices of them: a ball has a sixth of the corners, and
 *  every corner is computed once a picture. */
function shared(corners) {
  const count = corners.length / 6, words = new Int32Array(Float32Array.from(corners).buffer), indices = new Uint32Array(count);
  const slots = new Int32Array(2 ** Math.ceil(Math.log2(2 * count + 2))).fill(-1), mask = slots.length - 1, kept = [];
  for (let k = 0; k < count; k++) {
    let slot = 0;
    for (let i = 0; i < 6; i++) slot = Math.imul(slot ^ words[6 * k + i], 0x9e3779b1) ^ (slot >>> 15);
    const same = (other) => [0, 1, 2, 3, 4, 5].every((i) => words[6 * k + i] === words[6 * other + i]);
    for (slot &= mask; slots[slot] >= 0 && !same(kept[slots[slot]]); slot = (slot + 1) & mask);
    if (slots[slot] < 0) slots[slot] = kept.push(k) - 1;
    indices[k] = slots[slot];
  }
  const out = new Float32Array(6 * kept.length);
  kept.forEach((k, i) => out.set(corners.subarray(6 * k, 6 * k + 6), 6 * i));
  return { kept: out, indices };
}

/** The triangles that were divided into four each, of a mesh that consists of such; otherwise those that there are. */
function undivided(indices) {
  const coarse = new Uint32Array(indices.length / 4);
  for (let k = 0; k < indices.length; k += 12) {
    const [a, d, f, g, b, e, h, i, c, ...middle] = indices.subarray(k, k + 12);
    if (d !== g || f !== h || e !== i || middle.join() !== [d, e, f].join()) return indices;
    coarse.set([a, b, c], k / 4);
  }
  return coarse;
}

/** Largest number of triangles of a mesh file. */
const MOST_TRIANGLES = 400000;

/** A mesh file, STL (binary or text) or OBJ, as triangles. Throws a message where it cannot be read. */
function meshFile(name, buffer) {
  const lower = name.toLowerCase();
  if (lower.endsWith(".stl")) return faceted(stl(name, buffer));
  if (lower.endsWith(".obj")) return faceted(obj(name, new TextDecoder().decode(buffer)));
  throw new Error(`${name}: of meshes, .stl and .obj files are read`);
}

function stl(name, buffer) {
  const view = new DataView(buffer), count = buffer.byteLength >= 84 ? view.getUint32(80, true) : 0;
  if (buffer.byteLength >= 84 && buffer.byteLength === 84 + 50 * count) {
    if (count > MOST_TRIANGLES) throw new Error(`${name}: more than ${MOST_TRIANGLES} triangles; reduce the mesh`);
    const out = new Float32Array(9 * count);
    for (let k = 0; k < count; k++) for (let i = 0; i < 9; i++) out[9 * k + i] = view.getFloat32(84 + 50 * k + 12 + 4 * i, true);
    return checked(name, out);
  }
  const out = [];
  for (const match of new TextDecoder().decode(buffer).matchAll(/vertex\s+(\S+)\s+(\S+)\s+(\S+)/g)) out.push(+match[1], +match[2], +match[3]);
  return checked(name, new Float32Array(out.slice(0, 9 * Math.floor(out.length / 9))));
}

function obj(name, text) {
  const points = [], out = [];
  for (const line of text.split("\n")) {
    const words = line.trim().split(/\s+/);
    if (words[0] === "v") points.push(words.slice(1, 4).map(Number));
    if (words[0] !== "f") continue;
    const face = words.slice(1).map((word) => {
      const k = parseInt(word, 10);
      return points[k < 0 ? points.length + k : k - 1];
    });
    if (face.some((p) => !p)) throw new Error(`${name}: a face has a corner that there is not: ${line.trim().slice(0, 60)}`);
    for (let k = 1; k + 1 < face.length; k++) out.push(...face[0], ...face[k], ...face[k + 1]);
    if (out.length > 9 * MOST_TRIANGLES) throw new Error(`${name}: more than ${MOST_TRIANGLES} triangles; reduce the mesh`);
  }
  return checked(name, new Float32Array(out));
}

function checked(name, corners) {
  if (corners.length === 0) throw new Error(`${name}: it has no triangles`);
  if (!corners.every(Number.isFinite)) throw new Error(`${name}: a corner is not three numbers`);
  return corners;
}
