// The page: it opens files, runs the motion, keeps what was shown, and draws it.

const $ = (id) => document.getElementById(id);
/** Largest number of instants that are kept: ten minutes at sixty a second, or less of large mechanisms. */
const KEPT = 36000, KEPT_NUMBERS = 12e6;
/** Time after which a worker that does not answer is ended, ms. */
const PATIENCE = 30000;

const page = {
  scene: null, instant: null, history: [], shown: -1, playing: false, busy: false, debt: 0, last: 0, worker: null,
  look: { forces: true, reactions: false, names: true, shadows: true, trace: [], traceOf: -1, follow: false, section: false },
  settings: { method: "rk4", step: 1e-3, contacts: 2 }, efforts: [], opened: null, speed: 1, hold: null, slow: 0, sections: [], missing: [], measured: { frames: 0, steps: 0, spent: 0 },
};

/** A worker and its answers. */
class Engine {
  constructor(text, source) {
    this.source = URL.createObjectURL(new Blob([source], { type: "text/javascript" }));
    this.text = text;
    this.begin();
  }
  begin() {
    this.worker = new Worker(this.source);
    this.waiting = new Map();
    this.count = 0;
    this.worker.onmessage = ({ data: { id, answer, error } }) => {
      const { resolve, reject, clock } = this.waiting.get(id) ?? {};
      clearTimeout(clock);
      this.waiting.delete(id);
      if (error === undefined) resolve?.(answer);
      else reject?.(new Error(error));
    };
    this.worker.onerror = (event) => this.fail(event.message || "the worker stopped");
    this.ready = this.ask({ action: "start", text: this.module ? null : this.text, module: this.module }).then(({ module }) => (this.module = module));
  }
  /** All questions that wait are refused; another worker begins. */
  fail(message) {
    this.worker.terminate();
    const waiting = [...this.waiting.values()];
    this.begin();
    waiting.forEach(({ reject, clock }) => (clearTimeout(clock), reject(new Error(message))));
  }
  ask(question) {
    return new Promise((resolve, reject) => {
      const id = ++this.count;
      const clock = setTimeout(() => this.fail(`the computation was ended after ${PATIENCE / 1000} s`), PATIENCE);
      this.waiting.set(id, { resolve, reject, clock });
      this.worker.postMessage({ id, ...question });
    });
  }
}

/** The colours of the reader's preference, or of the choice on the page. */
function inks() {
  const dark = document.documentElement.dataset.theme ? document.documentElement.dataset.theme === "dark" : matchMedia("(prefers-color-scheme: dark)").matches;
  return { ...INKS[dark ? "dark" : "light"], dark };
}

function say(text) {
  $("status").textContent = text;
}

function trouble(head, text) {
  $("trouble").hidden = !text;
  $("trouble-head").textContent = head;
  $("trouble-text").textContent = text;
  if (text) say(`${head}. ${text.split("\n")[0]}`);
}

/** What is measured of the motion begins anew. */
function unmeasured() {
  Object.assign(page.measured, { steps: 0, spent: 0 });
  page.slow = 0;
}

/** Opens the first description among some files, `[name, ArrayBuffer]` each; the others are what it may name. */
async function open(files, options = {}) {
  const described = files.filter(([name]) => /\.(toml|urdf|xml|mjcf)$/i.test(name));
  const named = new Map(page.opened?.files ?? []);
  files.forEach(([name, contents]) => named.set(name, contents));
  const chosen = described.find(([name]) => !isIncluded(name, described)) ?? described[0];
  const name = chosen?.[0] ?? (files.every(([name]) => /\.(stl|obj)$/i.test(name)) ? page.opened?.name : undefined);
  if (!name) {
    trouble("Nothing to open", files.length ? `${files.map(([name]) => name).join(", ")}: models are read from .toml, .urdf and .xml files` : "no file was dropped");
    return false;
  }
  const all = described.length ? new Map(files) : named;
  options = { ...(described.length ? { floating: false, floor: null } : page.opened?.options), ...options };
  say(`Reading ${name}`);
  let answer;
  try {
    await engine.ready;
    answer = await engine.ask({ action: "open", name, files: [...all], options, settings: page.settings, forces: wanted() });
  } catch (error) {
    answer = { ok: false, text: `${name}: error: ${error.message}\n  help: the rest of the page goes on; report this file if it is a sound model` };
    page.scene = null;
  }
  if (!answer.ok) {
    page.playing = false;
    page.scene = null;
    page.opened = { name, files: all, options };
    trouble(`${name} cannot be opened`, answer.text);
    renewed();
    return false;
  }
  trouble("", "");
  const before = page.opened?.name === name ? page.look : null;
  page.opened = { name, files: all, options };
  const scene = JSON.parse(answer.text);
  page.scene = scene;
  scene.meshes = answer.meshes;
  scene.at = layout(scene);
  page.history = [];
  unmeasured();
  page.efforts = scene.velocities.map(() => 0);
  page.hold = null;
  // What nothing holds falls out of sight.
  if (!before) Object.assign(page.look, { traceOf: -1, follow: !scene.supports.length && !scene.contacts.length });
  const instant = new Instant(scene, answer.numbers);
  measure(scene, instant);
  visualise();
  aim();
  show(instant, true);
  renewed();
  say(`${scene.name}: ${scene.bodies.length} bodies, ${scene.nv} freedoms`);
  return true;
}

/** Whether another of the descriptions includes a file. */
function isIncluded(name, described) {
  const decoder = new TextDecoder();
  return described.some(([other, contents]) => other !== name && decoder.decode(contents).includes(name));
}

/** Makes the figure, with shapes to look at where files have them. */
function visualise() {
  const { scene, opened } = page;
  let visuals = [], missing = [], troubles = [];
  if (/\.(urdf|xml)$/i.test(opened.name) && page.look.visuals !== false) {
    const text = new TextDecoder().decode(opened.files.get(opened.name));
    if (text.includes("<robot")) ({ visuals, missing, troubles } = urdfVisuals(text, scene, opened.files));
  }
  page.missing = missing;
  page.figure?.free();
  page.figure = new Figure(canvas, scene, visuals);
  if (troubles.length) trouble("Some shapes cannot be shown", troubles.slice(0, 8).join("\n"));
}

/** Extent, lowest point and middle of a mechanism. */
function measure(scene, instant) {
  const points = [];
  for (const part of scene.parts) for (let k = 0; k + 2 < part.points.length; k += 3) points.push([instant.place(part.frame, part.points.slice(k, k + 3)), part.radius]);
  for (const shape of scene.shapes) if (shape.frame >= 0 && shape.kind !== "plane") points.push([instant.place(shape.frame, shape.pose.slice(9)), Math.max(...shape.dims)]);
  for (let k = 0; k + 2 < scene.supports.length; k += 3) points.push([scene.supports.slice(k, k + 3), 0]);
  for (const body of scene.bodies) if (body.frame >= 0 && points.length === 0) points.push([instant.place(body.frame, body.com), 0.1]);
  const finite = points.filter(([p]) => p.every(Number.isFinite));
  const range = [0, 1, 2].map((k) => [Math.min(...finite.map(([p, r]) => p[k] - r)), Math.max(...finite.map(([p, r]) => p[k] + r))]);
  const sizes = range.map(([a, b]) => b - a);
  scene.extent = finite.length ? Math.max(...sizes, 1e-3) : 1;
  scene.middle = finite.length ? range.map(([a, b]) => (a + b) / 2) : [0, 0, 0];
  scene.lowest = finite.length ? range[2][0] - (scene.contacts.length ? 0 : 0.12 * scene.extent) : 0;
  const places = scene.frames.map((_, k) => instant.place(k, [0, 0, 0])[1]);
  scene.flat = places.length > 1 && Math.max(...places) - Math.min(...places) < 1e-6 * scene.extent;
}

/** Looks at the mechanism as a whole. */
function aim() {
  const { scene } = page;
  Object.assign(canvas.view, { at: [...scene.middle], distance: 2.3 * scene.extent, yaw: scene.flat ? -Math.PI / 2 + 0.18 : -1.1, pitch: scene.flat ? 0.16 : 0.32 });
  if (scene.flat) canvas.view.distance = 2.7 * scene.extent;
}

/** Shows an instant; one that is new is kept. */
function show(instant, isNew) {
  page.instant = instant;
  if (isNew) {
    // Largest kinetic energy and largest error so far, also of instants that are not kept.
    const before = page.history.at(-1)?.most ?? [0, 0];
    instant.most = [instant.kinetic, instant.error].map((x, k) => Math.max(before[k], Math.abs(x)));
    page.history.push(instant);
    if (page.look.section) page.sections.push(...instant.crossings());
    const most = Math.max(600, Math.min(KEPT, Math.floor(KEPT_NUMBERS / instant.numbers.length)));
    if (page.history.length > most) page.history.splice(0, Math.ceil(most / 10));
    page.shown = page.history.length - 1;
  }
  page.changed = true;
}

/** What a question has answered becomes what is shown. */
function answered({ numbers, seen = [] }, fresh = false) {
  if (!numbers || !page.scene) return;
  if (fresh) page.history = [];
  for (const each of [...seen, numbers]) show(new Instant(page.scene, each), true);
}

/** Whether forces are shown. */
const wanted = () => page.look.forces || page.look.reactions;

/** Head of the message about a change that was refused. */
const REFUSED = "The change was refused";

/** Asks for something that changes the motion, one question after the other. What is refused changes nothing. */
let queue = Promise.resolve();
function change(question, fresh = false) {
  const scene = page.scene;
  queue = queue.then(async () => {
    if (!page.scene || scene !== page.scene) return null;
    try {
      const answer = await engine.ask({ forces: wanted(), ...question });
      if (answer.ok === false) trouble(REFUSED, answer.text);
      else {
        if (answer.ok && $("trouble-head").textContent === REFUSED) trouble("", "");
        answered(answer, fresh);
      }
      return answer;
    } catch (error) {
      stopped(error);
      return null;
    }
  });
  return queue;
}

/** The engine has stopped: the file is opened again, at its start. */
function stopped(error) {
  page.playing = false;
  page.scene = null;
  trouble("The motion stopped", `${error.message}\nThe mechanism can be opened again by restarting.`);
  renewed();
}

/** Goes on from what is shown, where that is not the end. */
async function rejoin() {
  if (!page.scene || page.shown === page.history.length - 1) return;
  page.history.length = page.shown + 1;
  await change({ action: "state", t: page.instant.t, values: [...page.instant.state()] });
}

/** A change of the motion from what is shown on. Where it is refused, what came later is there again. */
async function changeShown(question) {
  const { history, shown } = page, later = history.slice(shown + 1), end = history.at(-1);
  await rejoin();
  const answer = await change(question);
  if (answer?.ok === false && later.length && page.history === history) {
    history.push(...later);
    await change({ action: "state", t: end.t, values: [...end.state()] });
  }
  return answer;
}

async function play(on = !page.playing) {
  if (!page.scene) {
    if (page.opened && on) await open([...page.opened.files], page.opened.options);
    return;
  }
  if (on) await rejoin();
  page.playing = on;
  page.debt = 0;
  paused();
}

async function restart() {
  if (!page.scene) {
    if (page.opened) await open([...page.opened.files], page.opened.options);
    return;
  }
  page.hold = null;
  trouble("", "");
  await change({ action: "change", call: "restart", args: [] }, true);
  say("At the start");
}

/** So many steps of the motion. */
async function steps(count) {
  page.playing = false;
  paused();
  page.busy = true;
  const answer = await changeShown({ action: "frame", steps: count, most: 1000 });
  page.busy = false;
  if (answer?.trouble) ended(answer.trouble);
}

function ended(text) {
  page.playing = false;
  paused();
  trouble("The motion cannot go on", `${text}\nRestart it, change its start, or take shorter steps.`);
}

/** Draws coarser while a motion is shown by fewer pictures than the screen has, or than sixty a second, first without smooth edges;
 *  sharp again when it stands still. A picture now and then may be late. */
function pace(passed) {
  page.period = Math.max(1 / 60, Math.min(page.period, passed || 1));
  if (!page.playing) {
    if (!canvas.smooth) page.changed = true;
    [canvas.smooth, canvas.fineness, page.pace] = [true, 1, 0];
    return;
  }
  page.pace += 0.05 * (passed - page.pace);
  if (page.pace < 1.15 * page.period || canvas.fineness <= 0.4) return;
  if (!canvas.smooth) canvas.fineness = Math.max(0.4, 0.75 * canvas.fineness);
  [canvas.smooth, page.pace] = [false, 0];
}
page.pace = 0;
/** Least time between two pictures, s: that of the screen, or of sixty a second. */
page.period = 1;

/** A frame of the page. */
function tick(now) {
  requestAnimationFrame(tick);
  const passed = Math.min(0.1, (now - page.last) / 1000 || 0);
  page.last = now;
  pace(passed);
  if (page.playing && page.scene) {
    page.debt = Math.min(page.debt + passed * page.speed, 0.2 * page.speed);
    const count = Math.floor(page.debt / page.settings.step);
    if (!page.busy && count > 0) {
      page.busy = true;
      page.debt -= count * page.settings.step;
      const scene = page.scene;
      change({ action: "frame", steps: count, most: 60, each: Math.max(1, Math.round(page.speed / 60 / page.settings.step)), hand: page.hold?.hand ?? null }).then((answer) => {
        page.busy = false;
        if (!answer || scene !== page.scene) return;
        const behind = answer.done < count && !answer.trouble;
        page.slow = 0.95 * page.slow + (behind ? 0.05 : 0);
        page.measured.steps += answer.done;
        page.measured.spent += answer.spent;
        if (answer.trouble) ended(answer.trouble);
      });
    }
  }
  const size = `${canvas.element.clientWidth} ${canvas.element.clientHeight} ${inks().dark}`;
  if (page.changed || size !== page.size) {
    page.size = size;
    page.changed = false;
    draw();
  }
  page.measured.frames++;
}

/** The path of the traced frame up to what is shown. */
function tracePoints() {
  const { look, history, shown } = page;
  if (look.traceOf < 0) return [];
  return thinned(history.slice(0, shown + 1), 600).map((instant) => instant.place(look.traceOf, [0, 0, 0]));
}

function draw() {
  const ink = inks();
  const { scene, instant, figure, look } = page;
  if (!scene || !instant || !figure) {
    canvas.begin(rgb(ink.paper));
    canvas.floor(-0.6, [0, 0], 12, 0.5, [...rgb(ink.floor), 1], rgb(ink.grid));
    canvas.end();
    overlay(ink);
    return;
  }
  if (look.follow) {
    const masses = scene.bodies.filter((body) => body.mass > 0), all = masses.reduce((sum, body) => sum + body.mass, 0);
    const centre = masses.reduce((sum, body) => add(sum, times(body.mass / all, instant.place(body.frame, body.com))), [0, 0, 0]);
    if (centre.every(Number.isFinite)) canvas.view.at = centre;
  }
  look.trace = tracePoints();
  figure.draw(instant, look, ink);
  canvas.end();
  overlay(ink);
  $("clock").textContent = `${instant.t.toFixed(3)} s`;
  const scrub = $("scrub");
  if (document.activeElement !== scrub || page.playing) scrub.value = page.history.length > 1 ? page.shown / (page.history.length - 1) : 1;
  scrub.setAttribute("aria-valuetext", `${instant.t.toFixed(3)} seconds`);
  if (page.drawn++ % 3 === 0 || !page.playing) panelDraw(ink);
}
page.drawn = 0;

/** Names, axes and gravity, in two dimensions over the picture. */
function overlay(ink) {
  const element = $("names"), ratio = Math.min(devicePixelRatio || 1, 2), w = element.clientWidth, h = element.clientHeight;
  const pixels = [Math.round(w * ratio), Math.round(h * ratio)], c = element.getContext("2d"), { scene, instant, look } = page;
  if (element.width !== pixels[0] || element.height !== pixels[1]) [element.width, element.height] = pixels;
  c.setTransform(ratio, 0, 0, ratio, 0, 0);
  c.clearRect(0, 0, w + 1, h + 1);
  if (!scene) return;
  c.font = "12px system-ui, sans-serif";
  c.lineJoin = "round";
  const write = (text, x, y, colour) => {
    c.lineWidth = 3.5;
    c.strokeStyle = ink.paper;
    c.strokeText(text, x, y);
    c.fillStyle = colour;
    c.fillText(text, x, y);
  };
  if (look.names) {
    const taken = [];
    for (const { frame, name } of scene.named) {
      const body = scene.bodies.find((b) => b.frame === frame), at = canvas.project(instant.place(frame, body?.com ?? [0, 0, 0]));
      if (!at) continue;
      const [x, y] = [at[0] + 10, at[1] - 8], width = c.measureText(name).width;
      if (taken.some(([a, b, l]) => x < a + l + 4 && a < x + width + 4 && Math.abs(y - b) < 14)) continue;
      taken.push([x, y, width]);
      write(name, x, y, ink.text);
    }
  }
  // Axes of the ground and gravity, as they are seen.
  const narrow = w < 700, centre = [narrow ? 40 : 52, h - (narrow ? 108 : 118)], length = narrow ? 22 : 30;
  const arrow = (way, colour, name) => {
    const [u, v] = [dot(way, canvas.right) * length, -dot(way, canvas.up) * length], [x, y] = [centre[0] + u, centre[1] + v];
    c.strokeStyle = c.fillStyle = colour;
    c.lineWidth = 1.8;
    c.beginPath();
    c.moveTo(...centre);
    c.lineTo(x, y);
    c.stroke();
    const l = Math.hypot(u, v) || 1;
    write(name, x + (9 * u) / l - 3, y + (9 * v) / l + 4, colour);
  };
  const names = ["x", "y", "z"];
  [[1, 0, 0], [0, 1, 0], [0, 0, 1]].forEach((way, k) => arrow(way, ink.muted, names[k]));
  if (size(scene.gravity) > 0) arrow(unit(scene.gravity), ink.force, "g");
}
