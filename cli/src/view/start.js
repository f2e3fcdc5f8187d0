// The beginning: the engine is unpacked, and the mechanism of the file is opened if it has one.

let canvas = null, engine = null;

/** The methods of integration that the page offers. */
const METHODS = [["rk4", "Runge-Kutta, order 4"], ["semi-implicit-euler", "semi-implicit Euler"], ["midpoint", "midpoint, order 2"], ["dop853", "Dormand-Prince, order 8"]];

/** Colours of the style are those of the drawings. */
function themed() {
  const ink = inks();
  for (const name of ["paper", "text", "muted", "grid", "floor", "force"]) document.documentElement.style.setProperty(`--${name}`, ink[name]);
  document.documentElement.style.setProperty("--accent", ink.lines[0]);
  document.documentElement.style.colorScheme = ink.dark ? "dark" : "light";
  page.changed = true;
}

const unpacked = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0));

async function start() {
  const begin = performance.now();
  themed();
  try {
    if (typeof WebAssembly !== "object") throw new Error("this browser is too old: it knows no WebAssembly");
    canvas = new Canvas($("picture"));
    engine = new Engine($("wasm").textContent, WORKER);
  } catch (error) {
    trouble("The page cannot run here", error.message);
    return;
  }
  listen();
  const { name, files, options } = JSON.parse($("given").textContent);
  renewed();
  requestAnimationFrame(tick);
  if (name) {
    $("empty").hidden = true;
    $("facts").textContent = `reading ${name}`;
    const list = files.map(([file, contents]) => [file, unpacked(contents).buffer]);
    list.sort(([a], [b]) => (b === name) - (a === name));
    await open(list, options);
  } else await engine.ready.catch((error) => trouble("The page cannot run here", error.message));
  page.first = performance.now() - begin;
  if (page.scene && !matchMedia("(prefers-reduced-motion: reduce)").matches && !location.hash.includes("still")) await play(true);
}

start();
