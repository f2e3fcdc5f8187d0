// What is drawn of a mechanism: bodies, shapes, rods, supports, forces, traces, the hand, and the names beside them.

const SHADOW = unit([0.35, -0.45, 0.9]);

/** A colour `#rrggbb` as three numbers. */
const rgb = (hex) => [1, 3, 5].map((k) => parseInt(hex.slice(k, k + 2), 16) / 255);

/** Round numbers, 1, 2 or 5 times a power of ten: the largest that is at most `x`. */
function round(x) {
  const decade = 10 ** Math.floor(Math.log10(x));
  return [5, 2, 1].map((m) => m * decade).find((r) => r <= x) ?? decade;
}

class Figure {
  /** `visuals` are shapes to look at: of the file, and meshes. */
  constructor(canvas, scene, visuals) {
    this.canvas = canvas;
    this.scene = scene;
    this.own = [];
    const make = (corners) => {
      const mesh = canvas.mesh(corners);
      this.own.push(mesh);
      return mesh;
    };
    const seen = new Set(visuals.map((visual) => visual.frame));
    const drawn = [];
    // The engine's triangles: of a ball, of the parts, of the shapes.
    const [ball, ...triangles] = scene.meshes;
    canvas.meshes.ball ??= canvas.mesh(ball);
    [...scene.parts, ...scene.shapes].forEach(({ frame, colour, kind, pose }, k) => {
      // A body with a shape to look at needs no other part.
      if (!triangles[k]?.length || (!kind && seen.has(frame))) return;
      drawn.push({ frame, colour, mesh: make(triangles[k]), local: pose ? columns(pose) : null });
    });
    for (const visual of visuals) {
      const mesh = visual.corners ? make(visual.corners) : null, local = mesh ? { mesh, local: visual.matrix } : this.local(visual);
      if (local) drawn.push({ frame: visual.frame, colour: this.colourOf(visual.frame), ...local });
    }
    this.drawn = drawn;
    this.planes = scene.shapes.filter((shape) => shape.kind === "plane" && shape.frame < 0);
  }

  free() {
    this.own.forEach((mesh) => this.canvas.free(mesh));
  }

  colourOf(frame) {
    return this.scene.bodies.find((body) => body.frame === frame)?.colour ?? -1;
  }

  /** Mesh and matrix of a primitive of a URDF in its frame. */
  local({ kind, dims, pose }) {
    const { meshes } = this.canvas, at = columns(pose);
    const scale = (mesh, s) => ({ mesh, local: product(at, scaled([0, 0, 0], s)) });
    switch (kind) {
      case "sphere": return scale(meshes.ball, [dims[0], dims[0], dims[0]]);
      case "box": return scale(meshes.box, dims);
      case "cylinder": return scale(meshes.cylinder, [dims[0], dims[0], dims[1]]);
      default: return null;
    }
  }

  /** Height of the floor: that of a horizontal plane of the model, or below what is drawn. */
  floorHeight() {
    const plane = this.planes.find((p) => p.dims[2] > 0.999 * size(p.dims) && p.pose[8] > 0.999);
    return plane ? plane.pose[11] : this.scene.lowest;
  }

  /** Draws an instant. `look` has what the user chose, `ink` the colours. */
  draw(instant, look, ink) {
    const { canvas, scene } = this, { gl, meshes } = canvas, extent = scene.extent;
    canvas.begin(rgb(ink.paper));
    const height = this.floorHeight(), centre = canvas.view.at, reach = 6 * Math.max(extent, 0.4 * canvas.view.distance);
    canvas.floor(height, centre, reach, round(0.35 * extent), [...rgb(ink.floor), 1], rgb(ink.grid));
    const colour = (k, alpha = 1) => [...rgb(k < 0 ? ink.muted : ink.lines[k % ink.lines.length]), alpha];
    const bodies = (paint) => {
      for (const { frame, colour: k, mesh, local } of this.drawn) {
        const pose = instant.matrix(frame);
        paint(mesh, local ? product(pose, local) : pose, k);
      }
      for (const rod of scene.rods) {
        const [a, b] = rod.ends.map((end) => instant.place(end.frame, end.at));
        if (size(sub(a, b)) > 1e-9) paint(meshes.tube, along(a, b, 0.009 * extent), rod.colour);
      }
    };
    const down = [1, 0, 0, 0, 0, 1, 0, 0, -SHADOW[0] / SHADOW[2], -SHADOW[1] / SHADOW[2], 0, 0];
    const z = height + 0.001 * extent, shadow = [...down, (SHADOW[0] / SHADOW[2]) * z, (SHADOW[1] / SHADOW[2]) * z, z, 1];
    if (look.shadows && canvas.eye[2] > height) canvas.shadows(() => bodies((mesh, m) => canvas.draw(mesh, product(shadow, m), [0, 0, 0, ink.dark ? 0.35 : 0.12], 1)));
    bodies((mesh, m, k) => canvas.draw(mesh, m, colour(k)));
    for (const part of scene.parts)
      for (let k = 0; k + 2 < part.joints.length; k += 3) {
        const p = instant.place(part.frame, part.joints.slice(k, k + 3));
        canvas.draw(meshes.ball, scaled(p, [1, 1, 1].map(() => Math.max(1.12 * part.radius, 0.011 * extent))), [...rgb(ink.text), 1]);
      }
    this.walls(ink);
    this.supports(ink, extent);
    if (look.forces || look.reactions) this.forces(instant, look, ink, extent);
    this.trace(look.trace, ink, extent);
    const hand = instant.hand();
    if (hand) {
      const red = [...rgb(ink.force), 1];
      if (size(sub(hand.hand, hand.point)) > 1e-9) canvas.draw(meshes.tube, along(hand.point, hand.hand, 0.006 * extent), red);
      for (const p of [hand.point, hand.hand]) canvas.draw(meshes.ball, scaled(p, [1, 1, 1].map(() => 0.018 * extent)), red);
    }
    gl.bindVertexArray(null);
  }

  /** Planes of the ground that are no floor. */
  walls(ink) {
    const { canvas, scene } = this, gl = canvas.gl;
    gl.depthMask(false);
    for (const plane of this.planes) {
      const m = plane.pose, n = unit([0, 1, 2].map((i) => dot(m.slice(3 * i, 3 * i + 3), plane.dims)));
      if (n[2] > 0.999) continue;
      const [x, y] = across(n).map((way) => times(0.7 * scene.extent, way)), at = [m[9], m[10], m[11]];
      canvas.draw(canvas.meshes.square, [...x, 0, ...y, 0, ...n, 0, ...at, 1], [...rgb(ink.muted), 0.3], 1);
    }
    gl.depthMask(true);
  }

  supports(ink, extent) {
    const s = 0.022 * extent;
    for (let k = 0; k + 2 < this.scene.supports.length; k += 3) {
      const p = this.scene.supports.slice(k, k + 3);
      this.canvas.draw(this.canvas.meshes.box, scaled(p, [2 * s, 2 * s, 2 * s]), [...rgb(ink.muted), 1]);
    }
  }

  forces(instant, look, ink, extent) {
    const red = [...rgb(ink.force), 1], blue = [...rgb(ink.text), 1];
    for (const { point, force, contact } of instant.arrows())
      if ((contact ? look.forces : look.reactions) && size(force) > 1e-3 * this.weight()) this.canvas.arrow(point, times(this.forceScale() * (contact ? 2 : 1), force), 0.007 * extent, contact ? red : blue);
  }

  /** Weight of all bodies, N, or that of a kilogram each in free fall. */
  weight() {
    const mass = this.scene.bodies.reduce((sum, body) => sum + (body.mass || 0), 0);
    return Math.max(mass, 1e-9) * (size(this.scene.gravity) || 1);
  }

  /** m for each N: the weight of the mechanism is a third of its size. Several contacts carry it, whose arrows are twice as long. */
  forceScale() {
    return (0.33 * this.scene.extent) / this.weight();
  }

  trace(points, ink, extent) {
    const step = Math.max(1, Math.floor(points.length / 600));
    for (let k = step; k < points.length; k += step)
      if (size(sub(points[k], points[k - step])) > 1e-6 * extent) this.canvas.draw(this.canvas.meshes.tube, along(points[k - step], points[k], 0.0035 * extent), [...rgb(ink.lines[1]), 0.35 + (0.65 * k) / points.length], 1);
  }

  /** The body that a ray meets first, roughly: frame and point in the ground; `null` where it meets none. */
  pick(instant, x, y) {
    let best = null;
    const consider = (frame, p) => {
      const at = this.canvas.project(p);
      if (!at || frame < 0) return;
      const away = Math.hypot(at[0] - x, at[1] - y);
      if (away < 26 && (!best || away + 40 * at[2] / this.canvas.view.distance < best.score)) best = { frame, point: p, score: away + 40 * at[2] / this.canvas.view.distance };
    };
    for (const part of this.scene.parts) {
      const n = part.points.length / 3, every = Math.max(1, Math.floor(n / 40)), list = [];
      for (let k = 0; k < n; k += every) list.push(part.points.slice(3 * k, 3 * k + 3));
      list.forEach((p) => consider(part.frame, instant.place(part.frame, p)));
      if (n < 6) for (let k = 0; k + 1 < n; k++) for (const s of [0.25, 0.5, 0.75]) consider(part.frame, instant.place(part.frame, add(times(1 - s, list[k]), times(s, list[k + 1]))));
    }
    for (const body of this.scene.bodies) if (body.mass > 0) consider(body.frame, instant.place(body.frame, body.com));
    for (const shape of this.scene.shapes) consider(shape.frame, instant.place(shape.frame, shape.pose.slice(9)));
    return best;
  }
}
