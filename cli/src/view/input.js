// Mouse, fingers, keyboard, and files that are dropped.

/** Fingers and mouse buttons that are down, by their number. */
const fingers = new Map();

/** The hand moves in the plane across the view through the point that it holds. */
function handAt(x, y) {
  const { origin, way } = canvas.ray(x, y), { depth } = page.hold;
  return add(origin, times(depth / Math.max(1e-6, -dot(way, canvas.towards)), way));
}

function pointerDown(event) {
  const element = canvas.element;
  element.focus({ preventScroll: true });
  fingers.set(event.pointerId, [event.offsetX, event.offsetY]);
  element.setPointerCapture(event.pointerId);
  if (fingers.size > 1) {
    letGo();
    return;
  }
  if (!page.scene || event.button !== 0 || event.shiftKey) return;
  const hit = page.figure.pick(page.instant, event.offsetX, event.offsetY);
  if (hit) grasp(hit);
}

/** A body is held by a spring, whose stiffness is such that the weight of all stretches it by a part of their size. */
async function grasp({ frame, point }) {
  const { scene, figure } = page, at = page.instant.inside(frame, point);
  const stiffness = (12 * figure.weight()) / scene.extent, mass = scene.bodies.reduce((sum, body) => sum + (body.mass || 0), 0);
  const damping = 0.35 * Math.sqrt(stiffness * mass);
  page.hold = { frame, hand: point, depth: -dot(sub(point, canvas.eye), canvas.towards) };
  const hold = page.hold;
  await rejoin();
  if (page.hold !== hold) return;
  await change({ action: "change", call: "pull", args: [frame, ...at, stiffness, damping] });
  if (page.hold !== hold) return;
  canvas.element.style.cursor = "grabbing";
  say(`Pulling ${scene.frames[frame]}`);
}

function letGo() {
  if (!page.hold) return;
  page.hold = null;
  canvas.element.style.cursor = "";
  change({ action: "change", call: "let_go", args: [] });
}

function pointerMove(event) {
  const before = fingers.get(event.pointerId);
  if (!before) return;
  const now = [event.offsetX, event.offsetY], [dx, dy] = [now[0] - before[0], now[1] - before[1]];
  const spread = () => {
    const [a, b] = [...fingers.values()];
    return Math.hypot(a[0] - b[0], a[1] - b[1]);
  };
  const { view } = canvas;
  if (fingers.size === 2) {
    const old = spread();
    fingers.set(event.pointerId, now);
    view.distance *= old / Math.max(1, spread());
    move(dx / 2, dy / 2);
    return;
  }
  fingers.set(event.pointerId, now);
  if (page.hold) {
    page.hold.hand = handAt(...now);
    if (!page.playing) latest("hand", () => page.hold && change({ action: "frame", steps: 0, most: 1, hand: page.hold.hand }));
  } else if (event.shiftKey || event.buttons & 6) move(dx, dy);
  else turn(-0.006 * dx, 0.006 * dy);
}

function move(dx, dy) {
  const s = canvas.pixel(canvas.view.distance);
  canvas.view.at = add(canvas.view.at, add(times(-dx * s, canvas.right), times(dy * s, canvas.up)));
  page.look.follow = false;
  const box = $("look-follow");
  if (box) box.checked = false;
  page.changed = true;
}

function turn(yaw, pitch) {
  const { view } = canvas;
  view.yaw += yaw;
  view.pitch = Math.max(-1.5, Math.min(1.5, view.pitch + pitch));
  page.changed = true;
}

function zoom(factor) {
  const { view } = canvas, extent = page.scene?.extent ?? 1;
  view.distance = Math.max(0.05 * extent, Math.min(60 * extent, view.distance * factor));
  page.changed = true;
}

function pointerUp(event) {
  fingers.delete(event.pointerId);
  if (fingers.size === 0) letGo();
}

function toggle(key) {
  const box = $(`look-${key}`);
  if (box) box.click();
}

function scrubTo(part) {
  if (!page.history.length) return;
  page.playing = false;
  paused();
  page.shown = Math.max(0, Math.min(page.history.length - 1, Math.round(part * (page.history.length - 1))));
  show(page.history[page.shown], false);
}

const KEYS = {
  " ": () => play(), r: restart, R: restart, ".": () => steps(1), f: () => toggle("follow"), n: () => toggle("names"), v: () => toggle($("look-forces") ? "forces" : "reactions"), o: () => $("files").click(), "?": () => $("help").showModal(),
  "[": () => scrubTo((page.shown - 1) / Math.max(1, page.history.length - 1)), "]": () => scrubTo((page.shown + 1) / Math.max(1, page.history.length - 1)),
  "+": () => zoom(0.88), "=": () => zoom(0.88), "-": () => zoom(1.14),
  ArrowLeft: () => turn(-0.08, 0), ArrowRight: () => turn(0.08, 0), ArrowUp: () => turn(0, 0.06), ArrowDown: () => turn(0, -0.06),
};

/** What is there without a mechanism. */
const EMPTY = `<h2>Drop a mechanism here</h2>
<p>A model of this project (<code>.toml</code>), a robot (<code>.urdf</code>) or a model of MuJoCo (<code>.xml</code>), with its meshes (<code>.stl</code>, <code>.obj</code>) and included files, if it has any.</p>
<p><button id="choose" type="button">Choose files</button></p>
<p class="muted">Files stay on this machine: the page makes no request.</p>`;

/** A button of the bar, with a drawing. */
const button = (id, title, label, path, name = "") =>
  `<button id="${id}" type="button" title="${title}" aria-label="${label}"><svg viewBox="0 0 16 16" aria-hidden="true"><path${name} d="${path}"/></svg></button>`;

/** The bar below the picture. */
const BAR = `${button("restart", "Back to the start (R)", "Back to the start", "M3 3v10M13 3 5 8l8 5z")}
${button("play", "Play or pause (space)", "Play", "M4 2.5v11l9-5.5z", ' id="play-icon"')}
${button("step", "One step (.)", "One step", "M4 3l7 5-7 5zM13 3v10")}
<input id="scrub" type="range" min="0" max="1" step="any" value="1" aria-label="Time of what is shown">
<output id="clock" aria-live="off">0.000 s</output>
<label class="speed">speed <select id="speed" aria-label="Speed of the motion"></select></label>`;

/** Speeds of the motion, as they are called. */
const SPEEDS = [["1/20", 0.05], ["1/10", 0.1], ["1/4", 0.25], ["1/2", 0.5], [1, 1], [2, 2], [4, 4]];

/** What keys and mouse do: the list of `?`. */
const HELP = [
  ["drag the background", "look around; with shift or two fingers, move the view"],
  ["drag a body", "pull it with a spring"],
  ["wheel, + and −", "distance"],
  ["arrows", "look around"],
  ["space", "play or pause"],
  ["R", "back to the start"],
  [".", "one step"],
  ["[ and ]", "earlier and later in what was shown"],
  ["F", "follow the mechanism"],
  ["N", "names"],
  ["V", "forces"],
  ["O", "open files"],
  ["?", "this list"],
];

function keyDown(event) {
  if (event.ctrlKey || event.metaKey || event.altKey || $("help").open) return;
  const at = event.target.tagName;
  // Sliders, lists and buttons keep the keys that are theirs.
  const own = at === "SELECT" || (at === "INPUT" && event.key.startsWith("Arrow")) || ((at === "BUTTON" || at === "SUMMARY" || at === "INPUT") && event.key === " ");
  const action = KEYS[event.key];
  if (!action || own) return;
  event.preventDefault();
  action();
}

async function dropped(list) {
  const files = [];
  for (const file of list) {
    if (file.size > 256 * 2 ** 20) return trouble(`${file.name} cannot be opened`, "it is longer than 256 MiB");
    files.push([file.name, await file.arrayBuffer()]);
  }
  if (files.length) await open(files);
}

/** The files of a drop, those of folders among them. */
async function filesOf(transfer) {
  const entries = [...transfer.items].map((item) => item.webkitGetAsEntry?.()).filter(Boolean);
  if (!entries.some((entry) => entry.isDirectory)) return [...transfer.files];
  const files = [];
  const walk = async (entry) => {
    if (files.length > 2000) return;
    if (entry.isFile) files.push(await new Promise((resolve, reject) => entry.file(resolve, reject)));
    else {
      const reader = entry.createReader();
      for (;;) {
        const some = await new Promise((resolve, reject) => reader.readEntries(resolve, reject));
        if (!some.length) break;
        for (const inner of some) await walk(inner);
      }
    }
  };
  for (const entry of entries) await walk(entry);
  return files.filter((file) => /\.(toml|urdf|xml|mjcf|stl|obj)$/i.test(file.name));
}

function listen() {
  const element = canvas.element;
  $("empty").innerHTML = EMPTY;
  $("bar").innerHTML = BAR;
  $("speed").append(...SPEEDS.map(([name, speed]) => new Option(name, speed, false, speed === 1)));
  $("help").innerHTML = `<h2 id="help-head">Keys and mouse</h2><dl>${HELP.map(([keys, text]) => `<dt>${keys}</dt><dd>${text}</dd>`).join("")}</dl><form method="dialog"><button>Close</button></form>`;
  element.addEventListener("pointerdown", pointerDown);
  element.addEventListener("pointermove", pointerMove);
  element.addEventListener("pointerup", pointerUp);
  element.addEventListener("pointercancel", pointerUp);
  element.addEventListener("contextmenu", (event) => event.preventDefault());
  element.addEventListener("wheel", (event) => (event.preventDefault(), zoom(Math.exp(0.0012 * event.deltaY))), { passive: false });
  canvas.restored = () => page.scene && (visualise(), (page.changed = true));
  addEventListener("keydown", keyDown);
  addEventListener("dragover", (event) => (event.preventDefault(), document.body.classList.add("over")));
  addEventListener("dragleave", (event) => event.relatedTarget || document.body.classList.remove("over"));
  addEventListener("drop", async (event) => {
    event.preventDefault();
    document.body.classList.remove("over");
    await dropped(await filesOf(event.dataTransfer));
  });
  $("files").addEventListener("change", async () => {
    const list = [...$("files").files];
    $("files").value = "";
    await dropped(list);
  });
  $("choose").onclick = () => $("files").click();
  $("dismiss").onclick = () => (trouble("", ""), page.scene || renewed());
  $("play").onclick = () => play();
  $("restart").onclick = restart;
  $("step").onclick = () => steps(1);
  $("scrub").oninput = () => scrubTo(+$("scrub").value);
  $("speed").onchange = () => (page.speed = +$("speed").value);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", themed);
}
