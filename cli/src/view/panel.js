// The panel: plots, settings, sliders. It is built anew for every mechanism.

/** An element with attributes and children. */
function element(tag, attributes = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on")) made.addEventListener(name.slice(2), value);
    else if (value === true) made.setAttribute(name, "");
    else if (value !== false && value !== null) made.setAttribute(name, value);
  }
  made.append(...children);
  return made;
}

/** A part of the panel that folds. */
function part(name, isOpen, ...children) {
  return element("details", { open: isOpen, "data-part": name }, element("summary", {}, name), ...children);
}

/** Most rows of sliders that are shown at once; more are behind a button. */
const ROWS = 12;

/** A slider with its name and value. `set` gets a number, and the slider. */
function slider({ name, low, high, value, unit = "", set, attributes = {} }) {
  const shown = element("output", {}, `${digits(value)} ${unit}`);
  const input = element("input", { type: "range", min: low, max: high, step: "any", value, "aria-label": `${name}${unit ? `, ${unit}` : ""}`, ...attributes });
  input.addEventListener("input", () => {
    input.update(+input.value);
    set(+input.value, input);
  });
  // Not while a hand moves it.
  input.update = (x, always) => {
    if (always || document.activeElement !== input) input.value = x;
    shown.textContent = `${digits(x)} ${unit}`;
  };
  return element("label", { class: "row", title: name }, element("span", {}, name), input, shown);
}

/** Rows, those beyond some behind a button. */
function rows(list) {
  if (list.length <= ROWS) return list;
  const rest = element("div", { hidden: true }, ...list.slice(ROWS));
  const more = element("button", { type: "button", class: "more", onclick: () => ((rest.hidden = false), more.remove()) }, `${list.length - ROWS} more`);
  return [...list.slice(0, ROWS), rest, more];
}

function choice(name, options, value, set) {
  const select = element("select", { "aria-label": name, onchange: () => set(select.value) }, ...options.map(([v, text]) => element("option", { value: v, selected: String(v) === String(value) }, text)));
  return element("label", { class: "field" }, element("span", {}, name), select);
}

function check(name, value, set, attributes = {}) {
  const input = element("input", { type: "checkbox", checked: value, onchange: () => set(input.checked), ...attributes });
  return element("label", { class: "check" }, input, name);
}

/** At most one question for each slider waits; the last value counts. */
const pending = new Map();
function latest(key, ask) {
  const waits = pending.has(key);
  pending.set(key, ask);
  if (waits) return;
  queue.then(async () => {
    const last = pending.get(key);
    pending.delete(key);
    await last();
  });
}

const parts = {};

/** Builds the panel for the mechanism of the page. */
function renewed() {
  const { scene, opened } = page;
  $("empty").hidden = Boolean(scene) || Boolean(opened && !$("trouble").hidden);
  document.body.classList.toggle("bare", !scene);
  $("bar").hidden = !scene && !opened;
  $("name").textContent = scene?.name ?? "";
  $("facts").textContent = scene ? facts(scene) : "";
  document.title = scene ? `${scene.name} · mbd view` : "mbd view";
  canvas.element.setAttribute("aria-label", scene ? `The mechanism ${scene.name}: ${facts(scene)}` : "No mechanism yet");
  for (const id of ["restart", "play", "step", "scrub"]) $(id).disabled = !scene && !(opened && id === "restart");
  paused();
  page.changed = true;
  const panel = $("panel");
  const unfolded = new Map([...panel.querySelectorAll("details")].map((d) => [d.dataset.part, d.open]));
  panel.replaceChildren();
  if (!scene) return;
  page.sections = [];
  panel.append(energyPart(), phasePart(scene), ...[loopsPart(scene), contactsPart(scene), pullPart(), startPart(scene), effortsPart(scene), parametersPart(scene)].filter(Boolean), lookPart(scene), motionPart(scene), filePart(scene, opened));
  panel.querySelectorAll("details").forEach((d) => {
    if (unfolded.has(d.dataset.part)) d.open = unfolded.get(d.dataset.part);
    d.addEventListener("toggle", () => (page.changed = true));
  });
}

function facts(scene) {
  const count = (n, one, many = `${one}s`) => `${n} ${n === 1 ? one : many}`;
  const list = [count(scene.bodies.length, "body", "bodies"), count(scene.nv, "freedom")];
  if (scene.loops) list.push(count(scene.loops.names.length, "loop"), `mobility ${scene.loops.mobility}`);
  if (scene.contacts.length) list.push(count(scene.contacts.length, "contact"));
  return list.join(" · ");
}

function paused() {
  $("play").setAttribute("aria-label", page.playing ? "Pause" : "Play");
  $("play-icon").setAttribute("d", page.playing ? "M4 3h3v10H4zM9.5 3h3v10h-3z" : "M4 2.5v11l9-5.5z");
}

function energyPart() {
  parts.energy = element("canvas", { class: "plot", role: "img", "aria-label": "Kinetic, potential and total energy over time" });
  parts.error = element("canvas", { class: "plot low", role: "img", "aria-label": "Error of the energy over time" });
  parts.errorText = element("p", { class: "figure" });
  const touching = page.scene.contacts.length > 0;
  return part("Energy, J", true, parts.energy, element("h3", {}, touching ? "change that contacts leave, J" : "error of the balance, J"), parts.error, parts.errorText);
}

function phasePart(scene) {
  parts.phase = element("canvas", { class: "plot tall", role: "img", "aria-label": "Momentum over coordinate" });
  const plain = scene.coordinates.map((c, k) => [k, c.name]).filter(([k]) => scene.coordinates[k].plain);
  const paired = plain.filter(([k]) => scene.coordinates[k].v !== null);
  if (!paired.length) return part("Phase", false, element("p", { class: "muted" }, "no coordinate has a momentum of its own"));
  if (!paired.some(([k]) => k === page.phase)) page.phase = paired[0][0];
  page.cut = (paired[1] ?? paired[0])[0];
  const cutChoice = choice("where this rises through zero", plain, page.cut, (k) => {
    page.cut = +k;
    setSection();
  });
  cutChoice.hidden = !page.look.section;
  const toggle = check("Poincaré section", page.look.section, (on) => {
    page.look.section = on;
    cutChoice.hidden = !on;
    setSection();
  });
  if (page.look.section) setSection();
  return part("Phase", !scene.lie && scene.nv <= 4, choice("coordinate and its momentum", paired, page.phase, (k) => ((page.phase = +k), (page.changed = true))), parts.phase, toggle, cutChoice);
}

function setSection() {
  page.sections = [];
  page.changed = true;
  change({ action: "section", args: [page.look.section ? page.cut : 4294967295, 0] });
}

function loopsPart(scene) {
  if (!scene.loops) return null;
  const { names, rows, rank, mobility, iterations } = scene.loops;
  parts.residual = element("p", { class: "figure" });
  parts.residuals = element("canvas", { class: "plot low", role: "img", "aria-label": "Residual of the loops over time" });
  const closed = iterations === null ? "" : iterations === 0 ? "closed as they start" : `closed in ${iterations} iteration${iterations === 1 ? "" : "s"}`;
  return part("Loops", true, element("p", {}, `${names.length} (${names.slice(0, 6).join(", ")}${names.length > 6 ? ", …" : ""}): ${closed}; ${rows} rows, ${rank} independent, mobility ${mobility}`), element("h3", {}, "residual, logarithm of m or rad"), parts.residuals, parts.residual);
}

function contactsPart(scene) {
  if (!scene.contacts.length) return null;
  parts.contacts = element("p", { class: "figure" });
  parts.modes = scene.contacts.slice(0, 40).map((name) => element("li", { "data-mode": 0 }, name));
  return part("Contacts", true, choice("followed", [[2, "by events, or steps where they crowd"], [0, "by events only"], [1, "by time steps"]], page.settings.contacts, (k) => setting("contacts", +k)), parts.contacts, element("ul", { class: "modes" }, ...parts.modes));
}

function pullPart() {
  parts.pull = element("p", { class: "figure" }, "Drag a body in the picture: a spring pulls it.");
  return part("Pulling", false, parts.pull);
}

function startPart(scene) {
  const list = scene.coordinates.map((c, k) => {
    if (!c.plain) return null;
    const span = c.unit === "rad" ? Math.PI : scene.extent, value = page.instant.q(k);
    const [low, high] = [c.low ?? Math.min(-span, value), c.high ?? Math.max(span, value)];
    return slider({ name: c.name, unit: c.unit, low, high, value, attributes: { "data-q": k }, set: (x) => begin(k, x, false) });
  });
  const speeds = scene.velocities.map((c, k) => slider({ name: c.name, unit: `${c.unit || "1"}/s`, low: -10, high: 10, value: page.instant.v(k), attributes: { "data-v": k }, set: (x) => begin(k, x, true) }));
  return part("Start values", false, element("p", { class: "muted" }, "Moving one begins the motion anew."), ...rows(list.filter(Boolean)), element("h3", {}, "velocities"), ...rows(speeds));
}

function begin(k, x, velocity) {
  page.playing = false;
  paused();
  latest(`start ${velocity} ${k}`, async () => {
    const answer = await change({ action: "change", call: "set_start", args: [k, x, velocity ? 1 : 0] }, true);
    if (answer?.ok) page.sections = [];
  });
}

function effortsPart(scene) {
  const weight = page.figure.weight() * scene.extent;
  const list = scene.velocities.map((c, k) => {
    const most = c.limit ?? +(c.unit === "m" ? weight / scene.extent : 0.5 * weight).toPrecision(2);
    return slider({ name: c.name, unit: c.unit === "m" ? "N" : "N m", low: -most, high: most, value: page.efforts[k], set: (x) => {
      page.efforts[k] = x;
      latest(`effort ${k}`, () => changeShown({ action: "change", call: "set_effort", args: [k, x] }));
    } });
  });
  const zero = element("button", { type: "button", onclick: () => {
    $("panel").querySelectorAll("[data-part=Efforts] input").forEach((input) => +input.value && ((input.value = 0), input.dispatchEvent(new Event("input"))));
  } }, "all to zero");
  return part("Efforts", false, ...rows(list), zero);
}

function parametersPart(scene) {
  if (!scene.params.length) return null;
  return part("Parameters", true, ...rows(scene.params.map(({ name, value }, k) => {
    const [low, high] = value > 0 ? [0.2 * value, 3 * value] : value < 0 ? [3 * value, 0.2 * value] : [-1, 1];
    return slider({ name, low, high, value, set: (x, input) => latest(`param ${k}`, async () => {
      const answer = await changeShown({ action: "change", call: "set_parameter", args: [k, x] });
      if (answer?.ok) {
        scene.params[k].value = x;
        await redescribe();
      } else if (answer && +input.value === x) input.update(scene.params[k].value, true);
    }) });
  })));
}

/** The shapes follow parameters. */
async function redescribe() {
  const { text, meshes } = await engine.ask({ action: "describe" }), old = page.scene;
  if (!text || !old) return;
  const scene = JSON.parse(text);
  for (const key of ["parts", "rods", "supports", "shapes", "bodies"]) old[key] = scene[key];
  old.meshes = meshes;
  visualise();
  page.changed = true;
}

function lookPart(scene) {
  const { look } = page, set = (key) => (on) => ((look[key] = on), (page.changed = true));
  const frames = scene.frames.map((name, k) => [k, name]);
  const forces = (name, key) => check(name, look[key], (on) => {
    look[key] = on;
    page.changed = true;
    // What is shown was computed without them.
    if (page.scene && !page.playing && page.shown === page.history.length - 1) change({ action: "frame", steps: 0, most: 1 });
  }, { id: `look-${key}` });
  const list = [...(scene.contacts.length ? [forces("forces of contacts", "forces")] : []), forces("forces in joints", "reactions"), check("names", look.names, set("names"), { id: "look-names" }), check("follow the mechanism", look.follow, set("follow"), { id: "look-follow" }), check("shadows", look.shadows, set("shadows")), choice("path of", [[-1, "nothing"], ...frames], look.traceOf, (k) => ((look.traceOf = +k), (page.changed = true)))];
  if (/\.(urdf|xml)$/i.test(page.opened.name)) list.push(check("shapes to look at", look.visuals !== false, (on) => ((look.visuals = on), visualise(), (page.changed = true))));
  list.push(choice("theme", [["", "as the system"], ["light", "light"], ["dark", "dark"]], document.documentElement.dataset.theme ?? "", (theme) => {
    if (theme) document.documentElement.dataset.theme = theme;
    else delete document.documentElement.dataset.theme;
    themed();
  }));
  return part("Picture", false, ...list);
}

/** Goes on from what is shown with another setting. */
async function setting(key, value) {
  page.settings[key] = value;
  await changeShown({ action: "settings", settings: page.settings });
  unmeasured();
}

function motionPart() {
  parts.speed = element("p", { class: "figure" });
  return part("Method", false, choice("method", METHODS, page.settings.method, (value) => setting("method", value)), choice("step", [[1e-4, "0.1 ms"], [2.5e-4, "0.25 ms"], [5e-4, "0.5 ms"], [1e-3, "1 ms"], [2e-3, "2 ms"], [5e-3, "5 ms"]], page.settings.step, (value) => setting("step", +value)), parts.speed);
}

function filePart(scene, opened) {
  const children = [];
  const isUrdf = /<robot/.test(new TextDecoder().decode(opened.files.get(opened.name)).slice(0, 20000)) && !/\.toml$/i.test(opened.name);
  if (!/\.toml$/i.test(opened.name)) {
    const again = (options) => open([...opened.files], { ...opened.options, ...options });
    if (isUrdf) children.push(check("free base", opened.options.floating, (on) => again({ floating: on })));
    children.push(check("floor below it", opened.options.floor !== null, (on) => again({ floor: on ? +(scene.lowest + (scene.contacts.length ? 0 : 0.12 * scene.extent)).toFixed(4) - 1e-3 : null })));
  }
  for (const { kind, line, column, message, help } of scene.findings) children.push(element("p", { class: kind }, `${line ? `${line}:${column}: ` : ""}${kind}: ${message}`, element("br"), help));
  if (page.missing.length) children.push(element("p", { class: "muted" }, `Meshes that were not dropped: ${page.missing.slice(0, 5).join(", ")}${page.missing.length > 5 ? ` and ${page.missing.length - 5} more` : ""}. Drop them on the page.`));
  children.push(element("p", {}, element("button", { type: "button", onclick: () => $("files").click() }, "Open another"), " ", element("button", { type: "button", onclick: saveSource }, "Save Rust code"), " ", element("button", { type: "button", onclick: () => $("help").showModal() }, "Keys")));
  return part(`File: ${opened.name}`, scene.findings.some((f) => f.kind !== "notice"), ...children);
}

async function saveSource() {
  say("Generating code");
  const { text } = await engine.ask({ action: "source" });
  const link = element("a", { href: URL.createObjectURL(new Blob([text], { type: "text/plain" })), download: `${page.scene.name}.rs` });
  link.click();
  say("Code was generated");
}

const isOpen = (canvas) => canvas?.closest("details")?.open && canvas.clientWidth > 0;

/** Draws the plots and figures of the instant that is shown. */
function panelDraw(ink) {
  const { scene, instant, history } = page, list = thinned(history, 500), now = instant.t;
  if (isOpen(parts.energy)) {
    const curve = (name, colour, of) => ({ name, colour, points: list.map((i) => [i.t, of(i)]) });
    const curves = [curve("kinetic", ink.lines[0], (i) => i.kinetic), curve("potential", ink.lines[1], (i) => i.potential), curve("total", ink.lines[2], (i) => i.total)];
    if (list.some((i) => i.spring > 0)) curves.push(curve("spring", ink.lines[5], (i) => i.spring));
    plot(parts.energy, curves, ink, { now });
    const [kinetic, largest] = history.at(-1).most;
    plot(parts.error, [{ colour: ink.lines[5], points: list.map((i) => [i.t, i.error]) }], ink, { now, least: 1e-14 * Math.max(kinetic, 1e-300) });
    parts.errorText.textContent = `now ${digits(instant.error)} J, at most ${digits(largest)} J${kinetic > 0 ? `: ${digits(largest / kinetic)} of the largest kinetic energy` : ""}${instant.work ? `; work of efforts, dampers and hand's damper ${digits(instant.work)} J` : ""}`;
  }
  if (isOpen(parts.phase)) phaseDraw(ink, list);
  if (scene.loops && isOpen(parts.residuals)) {
    const log = (x) => Math.log10(Math.max(x, 1e-17));
    plot(parts.residuals, [{ colour: ink.lines[3], points: list.map((i) => [i.t, log(i.residual)]) }], ink, { now, least: 2 });
    parts.residual.textContent = `now ${digits(instant.residual)} m or rad`;
  }
  if (scene.contacts.length && isOpen(parts.contacts)) {
    const modes = instant.modes(), closed = modes.filter((mode) => mode > 0).length;
    parts.contacts.textContent = `${closed} closed; ${instant.byTimeSteps ? "by time steps" : "by events"}`;
    const words = ["open", instant.byTimeSteps ? "pressed" : "slides", "sticks"];
    parts.modes.forEach((item, k) => (item.dataset.mode !== String(modes[k] ?? 0) || !item.title) && ((item.dataset.mode = modes[k] ?? 0), (item.title = `${scene.contacts[k]}: ${words[modes[k] ?? 0]}`)));
  }
  const hand = instant.hand();
  if (isOpen(parts.pull)) parts.pull.textContent = hand ? `force ${digits(size(hand.force))} N, energy of the spring ${digits(instant.spring)} J` : "Drag a body in the picture: a spring pulls it.";
  if (isOpen(parts.speed)) parts.speed.textContent = page.slow > 0.3 ? "This machine is slower than the motion: time runs slower." : `time of computing ${page.measured.steps ? digits(1000 * page.measured.spent / page.measured.steps) : "–"} µs a step`;
  for (const input of $("panel").querySelectorAll("details[open] [data-q]")) input.update(wrapped(+input.dataset.q, instant.q(+input.dataset.q), +input.min, +input.max));
  for (const input of $("panel").querySelectorAll("details[open] [data-v]")) input.update(instant.v(+input.dataset.v));
}

/** A coordinate; an angle within a range, if turns bring it there. */
const wrapped = (k, x, low, high) => (page.scene.coordinates[k].unit === "rad" && (x < low || x > high) ? x - 2 * Math.PI * Math.round((x - (low + high) / 2) / (2 * Math.PI)) : x);

function phaseDraw(ink, list) {
  const { phase: k, instant, scene } = page, { name, v } = scene.coordinates[k], labels = [name, "p"];
  if (page.look.section) {
    const points = page.sections.slice(-4000).map((s) => [wrapped(k, s[k], -Math.PI, Math.PI), s[scene.nq + v]]);
    plot(parts.phase, [{ colour: ink.lines[0], points, dots: true }], ink, { labels, empty: "no crossing yet: let it run" });
    return;
  }
  plot(parts.phase, [{ colour: ink.lines[3], points: thinned(list, 500).map((i) => [i.q(k), i.p(v)]) }], ink, { labels, point: [instant.q(k), instant.p(v)] });
}
