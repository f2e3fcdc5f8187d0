// One instant of a motion: the numbers of the engine, and where they are. The layout is that of `Scene::look`.

const HEAD = 13;

/** Where the parts of an instant are, for a mechanism with `nq` coordinates, `nv` velocities and some frames. */
function layout({ nq, nv, frames }) {
  const q = HEAD, p = q + nq, v = p + nv, poses = v + nv, rest = poses + 12 * frames.length;
  return { q, p, v, poses, rest };
}

/** Reads an instant. */
class Instant {
  constructor(scene, numbers) {
    this.scene = scene;
    this.numbers = numbers;
    [this.t, this.kinetic, this.potential, this.spring, this.error, this.work, this.residual, this.byTimeSteps] = numbers;
    [this.contactForces, this.reactionForces, this.modeCount, this.held, this.crossingCount] = numbers.slice(8, HEAD);
  }
  get total() {
    return this.kinetic + this.potential + this.spring;
  }
  q(k) {
    return this.numbers[this.scene.at.q + k];
  }
  p(k) {
    return this.numbers[this.scene.at.p + k];
  }
  v(k) {
    return this.numbers[this.scene.at.v + k];
  }
  /** Coordinates and momenta. */
  state() {
    return this.numbers.slice(this.scene.at.q, this.scene.at.v);
  }
  /** A point of a frame in the ground; frame −1 is the ground. */
  place(frame, p) {
    if (frame < 0) return [...p];
    const at = this.scene.at.poses + 12 * frame, m = this.numbers;
    return [0, 1, 2].map((i) => m[at + 9 + i] + m[at + 3 * i] * p[0] + m[at + 3 * i + 1] * p[1] + m[at + 3 * i + 2] * p[2]);
  }
  /** A point of the ground in a frame. */
  inside(frame, p) {
    if (frame < 0) return [...p];
    const at = this.scene.at.poses + 12 * frame, m = this.numbers, d = [0, 1, 2].map((i) => p[i] - m[at + 9 + i]);
    return [0, 1, 2].map((k) => m[at + k] * d[0] + m[at + 3 + k] * d[1] + m[at + 6 + k] * d[2]);
  }
  /** The matrix of a frame, column by column, for WebGL. */
  matrix(frame) {
    if (frame < 0) return [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];
    return columns(this.numbers, this.scene.at.poses + 12 * frame);
  }
  /** Forces: where they act, their components, and whether they are those of contacts. */
  arrows() {
    const count = this.contactForces + this.reactionForces, out = [];
    for (let k = 0; k < count; k++) {
      const at = this.scene.at.rest + 6 * k, six = [...this.numbers.slice(at, at + 6)];
      out.push({ point: six.slice(0, 3), force: six.slice(3), contact: k < this.contactForces });
    }
    return out;
  }
  /** What each contact does: 0 open, 1 slides or presses, 2 sticks. */
  modes() {
    const at = this.scene.at.rest + 6 * (this.contactForces + this.reactionForces);
    return [...this.numbers.slice(at, at + this.modeCount)];
  }
  /** The spring that pulls: point, hand, force; `null` where none does. */
  hand() {
    if (!this.held) return null;
    const at = this.scene.at.rest + 6 * (this.contactForces + this.reactionForces) + this.modeCount;
    const nine = [...this.numbers.slice(at, at + 9)];
    return { point: nine.slice(0, 3), hand: nine.slice(3, 6), force: nine.slice(6) };
  }
  /** States at crossings of the section since the instant before: coordinates and momenta. */
  crossings() {
    const { nq, nv, at } = this.scene, n = nq + nv;
    const from = at.rest + 6 * (this.contactForces + this.reactionForces) + this.modeCount + (this.held ? 9 : 0);
    return Array.from({ length: this.crossingCount }, (_, k) => this.numbers.slice(from + n * k, from + n * (k + 1)));
  }
  get finite() {
    return this.numbers.every(Number.isFinite);
  }
}

/** A pose, nine numbers of a rotation row by row and three of a place, as a matrix column by column. */
function columns(m, at = 0) {
  return [
    m[at], m[at + 3], m[at + 6], 0, m[at + 1], m[at + 4], m[at + 7], 0,
    m[at + 2], m[at + 5], m[at + 8], 0, m[at + 9], m[at + 10], m[at + 11], 1,
  ];
}
