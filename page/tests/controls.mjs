// `node controls.mjs MBD [--pictures FOLDER]`: everything a user can do on the page that the program MBD writes, in Chromium, by
// events as a user makes them: files are dropped, motions played, slowed, scrubbed and stepped, sliders moved, bodies pulled. With a
// folder, each state is kept as a picture, to be looked at.
import { execFileSync } from "node:child_process";
import { mkdirSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { fileURLToPath } from "node:url";
import { chromium } from "./chromium.mjs";

const [mbd, ...flags] = process.argv.slice(2);
const pictures = flags.includes("--pictures") ? flags[flags.indexOf("--pictures") + 1] : null;
if (pictures) mkdirSync(pictures, { recursive: true });
const root = fileURLToPath(new URL("../../", import.meta.url)), folder = mkdtempSync(join(tmpdir(), "page-"));
const failures = [];
const claim = (holds, text) => {
  console.log(`${holds ? "  " : "! "}${text}`);
  if (!holds) failures.push(text);
};
const browser = await chromium();

/** Writes a page and opens it without a motion. */
async function opened(model, more = [], look = {}) {
  const file = join(folder, "page.html");
  execFileSync(mbd, ["view", ...(model ? [join(root, model)] : []), ...more, "-o", file], { stdio: ["ignore", "ignore", "pipe"] });
  const page = await browser.page(`file://${file}#still`, look);
  await page.until("typeof page !== 'undefined' && page.first !== undefined");
  /** What an expression of the page gives, and the picture of a state. */
  page.of = async (expression) => JSON.parse(await page.evaluate(`JSON.stringify(${expression}) ?? "null"`));
  page.state = async (name) => {
    await page.evaluate("new Promise((resolve) => requestAnimationFrame(() => requestAnimationFrame(resolve)))");
    if (pictures) writeFileSync(join(pictures, `${name}.png`), await page.shot());
    return page.evaluate("$('picture').toDataURL()");
  };
  /** A key on the picture. */
  page.key = async (key, code = key) => {
    const text = key.length === 1 ? { text: key } : {};
    await page.evaluate("$('picture').focus()");
    await page.on("Input.dispatchKeyEvent", { type: "keyDown", key, code, ...text });
    await page.on("Input.dispatchKeyEvent", { type: "keyUp", key, code });
  };
  /** A click in the middle of an element. */
  page.click = async (selector) => {
    const [x, y] = await page.of(`(() => { const e = document.querySelector(${JSON.stringify(selector)}); e.scrollIntoView({ block: "center" }); const b = e.getBoundingClientRect(); return [b.x + b.width / 2, b.y + b.height / 2]; })()`);
    await page.mouse("mousePressed", x, y, { buttons: 1 });
    await page.mouse("mouseReleased", x, y);
  };
  /** A slider or a list takes a value, with the events that a user's hand makes. */
  page.set = (selector, value, event = "input") =>
    page.evaluate(`(() => { const e = document.querySelector(${JSON.stringify(selector)}); e.value = ${JSON.stringify(value)}; e.dispatchEvent(new Event(${JSON.stringify(event)}, { bubbles: true })); })()`);
  /** Files are dropped: `[name, contents]`. */
  page.drop = async (...files) => {
    await page.evaluate(`(async () => {
      const transfer = new DataTransfer();
      for (const [name, contents] of ${JSON.stringify(files.map(([name, contents]) => [name, Buffer.from(contents).toString("base64")]))}) transfer.items.add(new File([unpacked(contents)], name));
      $("status").textContent = "";
      dispatchEvent(new DragEvent("dragover", { dataTransfer: transfer, cancelable: true }));
      dispatchEvent(new DragEvent("drop", { dataTransfer: transfer, cancelable: true }));
    })()`);
    await page.until("!/^(Reading|$)/.test($('status').textContent)");
  };
  /** Opens all parts of the panel. */
  page.unfold = () => page.evaluate("document.querySelectorAll('#panel details').forEach((d) => (d.open = true))");
  /** Runs for some seconds of the motion. */
  page.run = async (seconds) => {
    await page.evaluate("play(true)");
    await page.until(`page.instant.t > ${seconds} || !$('trouble').hidden`);
    await page.evaluate("play(false)");
    await page.until("!page.busy");
  };
  page.end = async (name) => {
    claim(!page.troubles.length && page.requests.length <= 1, `${name}: no error and no request ${page.troubles.join("; ").slice(0, 300)}`);
    await page.close();
  };
  return page;
}
const text = (path) => readFileSync(join(root, path));

/** A tetrahedron as a binary STL file, and as an OBJ file. */
function stl() {
  const corners = [[0, 0, 0], [0.2, 0, 0], [0, 0.2, 0], [0, 0, 0.2]], faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
  const out = Buffer.alloc(84 + 50 * faces.length);
  out.writeUInt32LE(faces.length, 80);
  faces.forEach((face, f) => face.forEach((c, k) => corners[c].forEach((x, i) => out.writeFloatLE(x, 84 + 50 * f + 12 + 12 * k + 4 * i))));
  return out;
}
const OBJ = "v 0 0 0\nv 0.2 0 0\nv 0 0.2 0\nv 0 0 0.2\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
const URDF = `<robot name="meshes"><link name="world"/>
<link name="arm"><visual><geometry><mesh filename="package://it/arm.stl"/></geometry></visual><visual><origin xyz="0 0 0.3"/><geometry><mesh filename="hand.obj"/></geometry></visual>
<inertial><mass value="1"/><origin xyz="0 0 0.2"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="hinge" type="continuous"><parent link="world"/><child link="arm"/><axis xyz="0 1 0"/></joint></robot>`;

async function files() {
  const page = await opened(null);
  claim(await page.evaluate("!$('empty').hidden && $('panel').children.length === 0"), "a page without a mechanism says what to do");
  await page.state("empty");
  await page.drop(["broken.toml", "[[body]]\nname = \"a\"\nmass = -1\n"]);
  const told = await page.evaluate("$('trouble-text').textContent");
  claim(/broken\.toml:\d+:\d+/.test(told) && /help/.test(told) && (await page.evaluate("!$('trouble').hidden")), `a broken file is told with its place: ${told.split("\n")[0].slice(0, 100)}`);
  await page.state("broken");
  await page.click("#dismiss");
  claim(await page.evaluate("$('trouble').hidden"), "the message can be closed");
  await page.drop(["notes.txt", "no mechanism"]);
  claim(/notes\.txt/.test(await page.evaluate("$('trouble-text').textContent")), "a file of another kind is told");
  await page.drop(["double_pendulum.toml", text("models/double_pendulum.toml")]);
  claim((await page.evaluate("page.scene?.nv")) === 2 && (await page.evaluate("$('trouble').hidden")), "a TOML file opens by a drop");
  await page.drop(["hopping_leg.xml", text("models/mjcf/hopping_leg.xml")]);
  claim(await page.evaluate("page.scene?.name === 'hopping_leg' && $('trouble').hidden"), "a model of MuJoCo opens by a drop");
  await page.drop(["ur5_tool.toml", text("models/ur5_tool.toml")]);
  claim(/ur5\.urdf/.test(await page.evaluate("$('trouble-text').textContent")), "a description whose other file is not there says so");
  await page.drop(["ur5_tool.toml", text("models/ur5_tool.toml")], ["ur5.urdf", text("models/ur5.urdf")]);
  claim((await page.of("page.scene?.params.map((p) => p.name)"))?.join() === "load", "a description with the file that it reads opens");
  const before = await page.of("[page.scene.bodies.map((b) => b.mass), page.instant.potential]");
  await page.unfold();
  await page.set("[data-part=Parameters] input", "4");
  await page.until(`Math.abs(page.scene.bodies.at(-1).mass - ${before[0].at(-1)} - 2.5) < 1e-12`);
  await page.until(`page.instant.potential !== ${before[1]}`);
  claim(true, "a slider of a parameter changes the mechanism");
  await page.drop(["meshes.urdf", URDF]);
  claim((await page.of("page.missing")).join() === "arm.stl,hand.obj", "meshes that were not dropped are named");
  const bare = await page.state("urdf-without-meshes");
  await page.drop(["arm.stl", stl()], ["hand.obj", OBJ]);
  claim((await page.of("page.missing")).length === 0 && (await page.state("urdf-with-meshes")) !== bare, "STL and OBJ files that are dropped are shown");
  await page.end("dropped files");
}

async function motion() {
  const page = await opened("models/double_pendulum.toml");
  await page.unfold();
  await page.state("pendulum");
  await page.key(" ", "Space");
  await page.until("page.playing && page.instant.t > 0.3");
  claim((await page.evaluate("$('play').getAttribute('aria-label')")) === "Pause", "the space bar plays");
  await page.click("#play");
  await page.until("!page.playing && !page.busy");
  const end = await page.of("[page.instant.t, page.history.length]");
  await page.state("paused");
  // Back in what was shown, and on from there.
  await page.set("#scrub", "0.5");
  const middle = await page.of("[page.instant.t, page.shown, page.history.length]");
  claim(middle[0] > 0 && middle[0] < 0.8 * end[0] && middle[2] === end[1], `scrubbing shows what was: ${middle[0].toFixed(3)} of ${end[0].toFixed(3)} s`);
  const clock = await page.evaluate("new Promise((resolve) => requestAnimationFrame(() => resolve($('clock').textContent)))");
  claim(clock === `${middle[0].toFixed(3)} s`, `the clock shows it: ${clock}`);
  await page.key("[");
  const [earlier] = await page.of("[page.shown]");
  await page.key("]");
  claim(earlier === middle[1] - 1 && (await page.evaluate("page.shown")) === middle[1], "[ and ] go to the instants beside");
  await page.key(".");
  await page.until("!page.busy && page.shown === page.history.length - 1");
  const on = await page.of("[page.instant.t, page.instant.kinetic + page.instant.potential]");
  claim(Math.abs(on[0] - middle[0] - 0.001) < 1e-9, "a step goes on from what is shown");
  await page.key("r");
  await page.until("page.instant.t === 0 && page.history.length === 1");
  claim(true, "R goes back to the start");
  // Slow motion: seconds of the motion in a second.
  for (const speed of [0.1, 2]) {
    await page.set("#speed", String(speed), "change");
    await page.evaluate("play(true)");
    await page.wait(300);
    const rate = await page.evaluate("(async () => { const from = [performance.now(), page.instant.t]; await new Promise((r) => setTimeout(r, 1500)); return 1000 * (page.instant.t - from[1]) / (performance.now() - from[0]); })()");
    await page.evaluate("play(false)");
    // A machine that has other work to do shows less.
    claim(rate < 1.15 * speed && rate > 0, `speed ${speed}: ${rate.toFixed(2)} seconds a second`);
  }
  await page.set("#speed", "1", "change");
  // Sliders.
  await page.set("[data-q='1']", "0.7");
  await page.until("page.instant.t === 0 && Math.abs(page.instant.q(1) - 0.7) < 1e-12");
  claim(!(await page.evaluate("page.playing")), "a slider of a coordinate begins anew there");
  await page.set("[data-v='0']", "2");
  await page.until("Math.abs(page.instant.v(0) - 2) < 1e-9");
  claim(Math.abs((await page.evaluate("page.instant.q(1)")) - 0.7) < 1e-12, "a slider of a velocity keeps the coordinates");
  const efforts = "[data-part=Efforts] input";
  await page.set(efforts, await page.evaluate(`document.querySelector(${JSON.stringify(efforts)}).max`));
  await page.run(0.5);
  const driven = await page.of("[page.instant.work, Math.max(...page.history.map((i) => Math.abs(i.error))), Math.max(...page.history.map((i) => i.kinetic))]");
  claim(Math.abs(driven[0]) > 1e-3 && driven[1] < 1e-4 * driven[2], `an effort does work, ${driven[0].toFixed(3)} J, and the energy balances to ${(driven[1] / driven[2]).toExponential(1)} of the largest kinetic energy`);
  await page.state("effort");
  await page.evaluate("[...document.querySelectorAll('[data-part=Efforts] button')].at(-1).click()");
  claim((await page.evaluate("page.efforts.every((x) => x === 0)")) && +(await page.evaluate(`document.querySelector(${JSON.stringify(efforts)}).value`)) === 0, "efforts can be set to zero");
  // Section, path, follow, names.
  await page.evaluate("[...document.querySelectorAll('[data-part=Phase] input')][0].click()");
  await page.run(6);
  const section = await page.of("[page.sections.length, page.sections.every((s) => Math.abs(Math.sin(s[page.cut])) < 1e-6)]");
  claim(section[0] > 2 && section[1], `Poincaré section: ${section[0]} crossings, on the section`);
  await page.state("section");
  const untraced = await page.state("untraced");
  await page.evaluate("(() => { const e = [...document.querySelectorAll('[data-part=Picture] select')][0]; e.value = String(page.scene.frames.length - 1); e.dispatchEvent(new Event('change')); })()");
  claim((await page.state("path")) !== untraced && (await page.evaluate("tracePoints().length")) > 50, "the path of a frame is drawn");
  const fixed = await page.of("canvas.view.at");
  await page.key("f");
  await page.state("followed");
  const followed = await page.of("canvas.view.at");
  claim((await page.evaluate("page.look.follow")) && followed.every(Number.isFinite) && followed.join() !== fixed.join(), "F follows the mechanism");
  const names = "(() => { const c = $('names'), d = c.getContext('2d').getImageData(0, 0, c.width, c.height - 200).data; return d.some((x) => x > 0); })()";
  await page.state("names");
  const withNames = await page.evaluate(names);
  await page.key("n");
  await page.state("no-names");
  claim(withNames && !(await page.evaluate(names)), "N hides the names");
  const view = await page.of("[canvas.view.yaw, canvas.view.distance]");
  await page.key("ArrowLeft");
  await page.key("+");
  const turned = await page.of("[canvas.view.yaw, canvas.view.distance]");
  claim(turned[0] !== view[0] && turned[1] < view[1], "arrows turn the view, + comes nearer");
  await page.key("?");
  claim(await page.evaluate("$('help').open"), "? lists the keys");
  await page.state("keys");
  await page.evaluate("$('help').close()");
  // Method and step.
  await page.set("[data-part=Method] select", "dop853", "change");
  await page.run((await page.evaluate("page.instant.t")) + 0.2);
  claim(await page.evaluate("$('trouble').hidden && page.instant.finite"), "the method can be changed while it runs");
  // Code is given.
  const source = await page.evaluate("engine.ask({ action: 'source' }).then(({ text }) => text)");
  claim(source.includes("pub fn rates"), `the page generates code: ${source.length} letters`);
  await page.end("motion");
}

/** The text of a model of one body on a joint, with weight along x. */
const one = (joint, params = "") => `name = "one"
gravity = [9.81, 0, 0]
${params}
[[body]]
name = "body"
mass = 1
com = [0, 0, -0.5]
inertia = [0.1, 0.1, 0.1]
[[joint]]
name = "it"
child = "body"
${joint}
`;

/** Changes: those that are refused, those from what was shown before; coordinates in metres, momenta, dampers. */
async function changes() {
  const page = await opened(null);
  /** Waits until all questions are answered. */
  const idle = () => page.evaluate("(async () => { for (let last = null; last !== queue || pending.size; ) { last = queue; await queue; await new Promise((resolve) => setTimeout(resolve, 20)); } })()");
  const bar = await page.evaluate("$('bar').hidden");
  const fourbar = text("models/mechanisms/fourbar.toml").toString().replace("gravity =", "params = { far = 0.4 }\ngravity =").replace("xyz = [0.4,", 'xyz = [{ param = "far" },');
  await page.drop(["fourbar.toml", fourbar]);
  await page.unfold();
  await page.run(0.3);
  // A start and a parameter with which the loop does not close.
  const parameter = "[data-part=Parameters] input", shown = "[page.instant.t, page.history.length, page.shown]";
  const before = await page.of(shown);
  await page.set("[data-q='2']", "0");
  await idle();
  const refused = await page.of("[$('trouble').hidden, $('trouble-head').textContent, $('trouble-text').textContent]");
  claim(!refused[0] && /do not close/.test(refused[2]) && (await page.of(shown)).join() === before.join(), `what is refused is told, and keeps what was shown: ${refused[1]}: ${refused[2]}`);
  await page.set("[data-part=Efforts] input", "0.2");
  await idle();
  claim(await page.evaluate("$('trouble').hidden"), "the message goes with the next change");
  await page.set(parameter, "1.2");
  await idle();
  claim(await page.evaluate(`!$('trouble').hidden && Math.abs(document.querySelector(${JSON.stringify(parameter)}).value - 0.4) < 1e-12`), "a refused parameter gets its value back");
  await page.click("#dismiss");
  claim(await page.evaluate("$('trouble').hidden && Math.abs(document.querySelector('[data-part=Efforts] input').value - 0.2) < 1e-12"), "sliders keep their values when a message is closed");
  // From what was shown before.
  for (const [name, change] of [["an effort", () => page.set("[data-part=Efforts] input", "0.1")], ["a parameter", () => page.set(parameter, "0.4001")], ["a step", () => page.set("[data-part=Method] label:nth-of-type(2) select", "0.002", "change")]]) {
    await page.run((await page.evaluate("page.instant.t")) + 0.2);
    await page.set("#scrub", "0.5");
    const [t, at] = await page.of("[page.instant.t, page.shown]");
    await change();
    await idle();
    const [now, q, length] = await page.of("[page.instant.t, page.history.at(-2).q(0) - page.instant.q(0), page.history.length]");
    claim(now === t && Math.abs(q) < 1e-2 && length === at + 2, `${name} is changed from what is shown on`);
  }
  claim(await page.evaluate("page.measured.steps === 0 && page.settings.step === 0.002"), "times of a step are measured anew with another step");
  await page.run((await page.evaluate("page.instant.t")) + 0.2);
  await page.set("#scrub", "0.5");
  const scrubbed = await page.of(shown);
  await page.evaluate("document.querySelector('[data-part=Phase] input').click()");
  await idle();
  claim((await page.of(shown)).join() === scrubbed.join(), "a section alone changes nothing that is shown");
  await page.evaluate("document.querySelector('[data-part=Phase] input').click()");
  await page.evaluate("(() => { grasp({ frame: page.scene.bodies[1].frame, point: page.instant.place(page.scene.bodies[1].frame, page.scene.bodies[1].com) }); letGo(); })()");
  await idle();
  await page.evaluate("steps(1)");
  claim(await page.evaluate("!page.hold && page.instant.hand() === null"), "a tap on a body while scrubbed holds nothing");
  claim(await page.evaluate("page.history.at(-1).most[1] >= Math.max(...page.history.map((i) => Math.abs(i.error))) && page.history.at(-1).most[0] >= Math.max(...page.history.map((i) => i.kinetic))"), "the largest error is that of all instants");
  // The engine stops.
  await page.evaluate("stopped(new Error('a test'))");
  const stays = await page.of("!$('bar').hidden && !$('restart').disabled");
  await page.click("#restart");
  await page.until("page.scene && $('trouble').hidden");
  claim(bar && stays, "a motion that stopped can be opened again");
  // Metres: 2π of them are no turn.
  await page.drop(["one.toml", one('type = "prismatic"\naxis = [1, 0, 0]\nstart = 1')]);
  await page.evaluate("(() => { page.look.section = true; renewed(); })()");
  await page.unfold();
  await page.run(1.2);
  const metres = await page.of("[page.instant.q(0), page.sections.length]");
  await page.state("metres");
  claim(metres[0] > 7 && metres[1] === 0 && (await page.evaluate("document.querySelector('[data-q=\"0\"]').nextSibling.textContent === `${digits(page.instant.q(0))} m`")), `${metres[0].toFixed(2)} m are shown as they are, and cross no section`);
  await page.evaluate("page.look.section = false");
  // Momenta of their own.
  await page.drop(["chain.toml", text("models/variants/chain.toml")]);
  claim((await page.of("page.scene.coordinates.map((c) => c.v)")).join() === "0,,,,,4,5,6" && (await page.of("[...document.querySelectorAll('[data-part=Phase] select')].map((list) => list.options.length)")).join() === "4,4", "a coordinate behind a ball has its own momentum");
  await page.drop(["one.toml", one('type = "floating"')]);
  claim(await page.evaluate("page.scene.coordinates.every((c) => c.v === null) && document.querySelectorAll('[data-part=Phase] select').length === 0"), "momenta in body axes belong to no coordinate");
  await page.drop(["one.toml", one('type = "planar"')]);
  claim((await page.of("page.scene.coordinates.map((c) => c.v)")).join() === ",,2", "of a planar joint, the angle has a momentum");
  // A damper that a slider sets.
  await page.drop(["one.toml", one('type = "revolute"\naxis = [0, 1, 0]\ndamping = { param = "c" }', "params = { c = 0 }")]);
  await page.unfold();
  await page.set(parameter, "0.5");
  await idle();
  await page.run(1);
  const damped = await page.of("[page.instant.work, ...page.history.at(-1).most]");
  claim(damped[0] < -1e-3 && damped[2] < 1e-4 * damped[1], `a damper takes ${(-damped[0]).toFixed(3)} J, and the energy balances to ${(damped[2] / damped[1]).toExponential(1)} of the largest kinetic energy`);
  await page.end("changes");
}

async function loopsAndContacts() {
  let page = await opened("models/mechanisms/stewart.toml");
  await page.unfold();
  await page.run(1);
  const residual = await page.of("[page.instant.residual, Math.max(...page.history.map((i) => i.residual)), parts.residual.textContent]");
  claim(residual[1] < 1e-6 && /m or rad/.test(residual[2]), `loops stay closed: ${residual[1].toExponential(1)} at most; shown: ${residual[2]}`);
  await page.state("stewart");
  await page.evaluate("$('look-reactions').click()");
  await page.run((await page.evaluate("page.instant.t")) + 0.2);
  const carried = await page.of("[page.instant.arrows().length, page.instant.arrows().every((a) => a.force.every(Number.isFinite)), Math.max(...page.instant.arrows().map((a) => Math.hypot(...a.force))), page.figure.weight()]");
  claim(carried[0] > 0 && carried[1] && carried[2] > 0.05 * carried[3], `forces in ${carried[0]} joints, with those of loops: ${carried[2].toFixed(0)} N at most, weight ${carried[3].toFixed(0)} N`);
  await page.state("stewart-reactions");
  await page.end("loops");
  page = await opened("models/contacts/quadruped.toml");
  await page.unfold();
  await page.run(1);
  const weight = await page.of("[page.figure.weight(), page.instant.arrows().filter((a) => a.contact).reduce((sum, a) => sum + a.force[2], 0), page.instant.modes().filter((m) => m > 0).length]");
  claim(weight[2] > 0 && weight[1] > 0.3 * weight[0] && weight[1] < 3 * weight[0], `forces of contacts: ${weight[1].toFixed(1)} N upwards on ${weight[2]} contacts, weight ${weight[0].toFixed(1)} N`);
  const arrows = await page.state("forces");
  await page.key("v");
  claim((await page.state("no-forces")) !== arrows, "V hides the forces");
  // It stands still; joints 1, 4, 7 and 10 carry the legs, and push the trunk up by what they pull the legs down.
  await page.evaluate("$('look-reactions').click()");
  await page.until("page.instant.arrows().some((a) => !a.contact)");
  const hips = await page.of("page.instant.arrows().filter((a) => !a.contact).filter((a, k) => k % 3 === 1).reduce((sum, a) => sum - a.force[2], 0)");
  claim(Math.abs(hips - 1.2 * 9.81) < 1e-6, `forces in joints with those of contacts: the legs carry ${hips.toFixed(6)} N of a trunk of 1.2 kg`);
  await page.state("contact-reactions");
  await page.end("contacts");
  page = await opened("models/ur5.urdf");
  await page.unfold();
  await page.evaluate("$('look-reactions').click()");
  await page.run(0.2);
  claim(await page.evaluate("page.instant.arrows().filter((a) => !a.contact).length === page.scene.nv && page.instant.arrows().every((a) => a.force.every(Number.isFinite))"), "forces in the joints of an arm");
  await page.state("reactions");
  await page.end("reactions");
}

async function looks() {
  const page = await opened("models/ur5.urdf", [], { dark: true });
  const ink = "getComputedStyle(document.documentElement).getPropertyValue('--paper').trim()";
  const dark = await page.evaluate(ink);
  await page.state("dark");
  await page.unfold();
  await page.evaluate("(() => { const e = [...document.querySelectorAll('[data-part=Picture] select')].at(-1); e.value = 'light'; e.dispatchEvent(new Event('change')); })()");
  claim((await page.evaluate(ink)) !== dark, `dark as the system, light on request: ${dark}, ${await page.evaluate(ink)}`);
  await page.state("light");
  // What a screen reader reads: every control has a name.
  await page.on("Accessibility.enable");
  const { nodes } = await page.on("Accessibility.getFullAXTree");
  const controls = nodes.filter((n) => !n.ignored && ["button", "slider", "combobox", "checkbox", "textbox", "image", "img", "canvas", "listbox", "DisclosureTriangle"].includes(n.role?.value));
  const unnamed = controls.filter((n) => !n.name?.value?.trim());
  claim(controls.length > 30 && !unnamed.length, `${controls.length} controls and pictures have names for screen readers ${unnamed.map((n) => n.role.value).join(", ")}`);
  claim(nodes.some((n) => n.role?.value === "status") && nodes.some((n) => n.role?.value === "toolbar" && n.name?.value), "states are announced, the toolbar has a name");
  await page.end("themes and labels");
  const phone = await opened("models/contacts/quadruped.toml", [], { width: 390, height: 844, scale: 2, mobile: true });
  await phone.run(0.3);
  await phone.state("phone");
  const size = await phone.of("[document.documentElement.scrollWidth, innerWidth, ...['play', 'restart', 'scrub', 'speed'].map((id) => { const b = $(id).getBoundingClientRect(); return b.left >= 0 && b.right <= innerWidth && b.width > 0 && b.bottom <= innerHeight; })]");
  claim(size[0] <= size[1] && size.slice(2).every(Boolean), `on a phone nothing is wider than the screen, and the toolbar is on it: ${size}`);
  await phone.end("phone");
}

try {
  for (const part of [files, motion, changes, loopsAndContacts, looks]) await part();
} finally {
  await browser.close();
  rmSync(folder, { recursive: true, force: true });
}
console.log(failures.length ? `${failures.length} claims failed` : "the controls do what they say");
process.exitCode = failures.length ? 1 : 0;
