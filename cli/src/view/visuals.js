// Shapes to look at: `<visual>` elements of a URDF, whose meshes are among the files that were dropped.

const numbers = (text, n, standard) => {
  const list = (text ?? "").trim().split(/\s+/).map(Number);
  return list.length === n && list.every(Number.isFinite) ? list : standard;
};

/** The rotation `Rz(yaw) Ry(pitch) Rx(roll)`, row by row. */
function rpy([roll, pitch, yaw]) {
  const [[sr, cr], [sp, cp], [sy, cy]] = [roll, pitch, yaw].map((a) => [Math.sin(a), Math.cos(a)]);
  return [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr, sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr, -sp, cp * sr, cp * cr];
}

/** The name of a file without its folders. */
const base = (path) => path.split(/[\\/]/).pop();

/** Shapes of a URDF's text: primitives, and the meshes among `files` (name to contents); names of missing meshes. */
function urdfVisuals(text, scene, files) {
  const visuals = [], missing = new Set(), troubles = [];
  const document = new DOMParser().parseFromString(text, "text/xml");
  if (document.querySelector("parsererror")) return { visuals, missing: [], troubles };
  for (const link of document.querySelectorAll("robot > link")) {
    const frame = scene.frames.indexOf(link.getAttribute("name"));
    if (frame < 0) continue;
    for (const visual of link.querySelectorAll(":scope > visual")) {
      const origin = visual.querySelector("origin");
      const pose = [...rpy(numbers(origin?.getAttribute("rpy"), 3, [0, 0, 0])), ...numbers(origin?.getAttribute("xyz"), 3, [0, 0, 0])];
      const shape = visual.querySelector("geometry")?.firstElementChild, of = (name, n) => numbers(shape.getAttribute(name), n, null);
      if (!shape) continue;
      const add = (kind, dims) => dims.every((d) => d !== null) && visuals.push({ frame, kind, dims: dims.flat(), pose });
      if (shape.tagName === "box") add("box", [of("size", 3)]);
      if (shape.tagName === "sphere") add("sphere", [of("radius", 1)]);
      if (shape.tagName === "cylinder") add("cylinder", [of("radius", 1), of("length", 1)]);
      if (shape.tagName !== "mesh") continue;
      const name = base(shape.getAttribute("filename") ?? ""), file = files.get(name);
      if (!file) {
        missing.add(name);
        continue;
      }
      try {
        const scale = numbers(shape.getAttribute("scale"), 3, [1, 1, 1]);
        visuals.push({ frame, corners: meshFile(name, file), matrix: product(columns(pose), scaled([0, 0, 0], scale)) });
      } catch (error) {
        troubles.push(error.message);
      }
    }
  }
  return { visuals, missing: [...missing], troubles };
}
