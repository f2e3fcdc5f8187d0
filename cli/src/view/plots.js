// Plots on two-dimensional canvases.

/** A number for a scale or a read-out: at most so many digits that say something. */
function digits(x, most = 3) {
  if (x === 0 || !Number.isFinite(x)) return x === 0 ? "0" : "–";
  const a = Math.abs(x);
  if (a < 1e-3 || a >= 1e5) return x.toExponential(1).replace("e+", "e");
  return String(+x.toPrecision(a >= 1000 ? 4 : most));
}

/** Marks of an axis between two numbers. */
function marks(low, high, count) {
  const step = [1, 2, 5, 10].map((m) => m * 10 ** Math.floor(Math.log10((high - low) / count))).find((s) => (high - low) / s <= count);
  const out = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step && out.length < 20; k++) out.push(k * step);
  return out;
}

/** Lowest and highest of all points of some curves, with some room. */
function bounds(curves, k) {
  let [low, high] = [Infinity, -Infinity];
  for (const { points } of curves)
    for (const p of points)
      if (Number.isFinite(p[k])) [low, high] = [Math.min(low, p[k]), Math.max(high, p[k])];
  return [low, high];
}

/**
 * Draws curves: `{ points: [[x, y], …], colour, name, dots }` each. `least` is the least height of the scale, so that
 * round-off is a line; `now` is a place on the abscissa that is marked.
 */
function plot(canvas, curves, ink, { least = 0, now = null, point = null, empty = "", labels = ["", ""] } = {}) {
  const ratio = Math.min(devicePixelRatio || 1, 2), w = canvas.clientWidth, h = canvas.clientHeight;
  if (!w || !h) return;
  if (canvas.width !== Math.round(w * ratio)) canvas.width = Math.round(w * ratio);
  if (canvas.height !== Math.round(h * ratio)) canvas.height = Math.round(h * ratio);
  const c = canvas.getContext("2d");
  c.setTransform(ratio, 0, 0, ratio, 0, 0);
  c.clearRect(0, 0, w, h);
  c.font = "10.5px system-ui, sans-serif";
  let [[x0, x1], [y0, y1]] = [bounds(curves, 0), bounds(curves, 1)];
  if (!(x1 >= x0) || !(y1 >= y0)) {
    c.fillStyle = ink.muted;
    c.fillText(empty, 10, h / 2);
    return;
  }
  if (!(x1 > x0)) [x0, x1] = [x0 - 0.5, x1 + 0.5];
  const largest = Math.max(Math.abs(y0), Math.abs(y1)), wanted = Math.max(least, 1e-12 * largest, largest > 0 ? 0 : 1e-3);
  if (y1 - y0 < wanted) [y0, y1] = [(y0 + y1 - wanted) / 2, (y0 + y1 + wanted) / 2];
  const pad = 0.06 * (y1 - y0);
  [y0, y1] = [y0 - pad, y1 + pad];
  const [left, right, top, bottom] = [46, w - 8, curves.some((curve) => curve.name) ? 20 : 7, h - 17];
  const X = (x) => left + ((x - x0) / (x1 - x0)) * (right - left), Y = (y) => bottom - ((y - y0) / (y1 - y0)) * (bottom - top);
  c.lineWidth = 1;
  c.strokeStyle = ink.grid;
  c.fillStyle = ink.muted;
  c.textAlign = "right";
  for (const y of marks(y0, y1, Math.max(2, (bottom - top) / 26))) {
    c.beginPath();
    c.moveTo(left, Math.round(Y(y)) + 0.5);
    c.lineTo(right, Math.round(Y(y)) + 0.5);
    c.stroke();
    c.fillText(digits(y), left - 5, Y(y) + 3.5);
  }
  c.textAlign = "center";
  for (const x of marks(x0, x1, Math.max(2, (right - left) / 60))) c.fillText(digits(x), Math.max(left + 6, Math.min(right - 10, X(x))), h - 4);
  if (now !== null && now >= x0 && now <= x1) {
    c.strokeStyle = ink.muted;
    c.beginPath();
    c.moveTo(X(now), top);
    c.lineTo(X(now), bottom);
    c.stroke();
  }
  c.save();
  c.beginPath();
  c.rect(left, top - 2, right - left + 1, bottom - top + 4);
  c.clip();
  for (const { points, colour, dots } of curves) {
    c.strokeStyle = c.fillStyle = colour;
    c.lineWidth = 1.5;
    c.lineJoin = "round";
    if (dots) {
      for (const [x, y] of points) c.fillRect(X(x) - 1, Y(y) - 1, 2, 2);
      continue;
    }
    c.beginPath();
    points.forEach(([x, y], k) => (k ? c.lineTo(X(x), Y(y)) : c.moveTo(X(x), Y(y))));
    c.stroke();
  }
  if (point) {
    c.fillStyle = ink.text;
    c.beginPath();
    c.arc(X(point[0]), Y(point[1]), 3, 0, 7);
    c.fill();
  }
  c.restore();
  c.textAlign = "left";
  let at = left;
  for (const { name, colour } of curves) {
    if (!name) continue;
    c.fillStyle = colour;
    c.fillRect(at, 8, 10, 2.5);
    c.fillStyle = ink.text;
    c.fillText(name, at + 14, 13);
    at += 24 + c.measureText(name).width;
  }
  c.fillStyle = ink.muted;
  c.textAlign = "right";
  if (labels[0]) c.fillText(labels[0], right, bottom - 4);
  if (labels[1]) c.fillText(labels[1], right, top + 10);
}

/** At most so many points of a list, evenly, the last one among them. */
function thinned(list, most) {
  if (list.length <= most) return list;
  const step = (list.length - 1) / (most - 1);
  return Array.from({ length: most }, (_, k) => list[Math.round(k * step)]);
}
