// `node malformed.mjs [COUNT]`: broken files get a message; nothing stops the engine, and nothing takes long.
import { readFileSync } from "node:fs";
import { engine } from "./engine.mjs";

const root = new URL("../../", import.meta.url);
const sources = ["models/double_pendulum.toml", "models/mechanisms/fourbar.toml", "models/contacts/quadruped.toml", "models/ur5.urdf", "models/mjcf/hopping_leg.xml"]
  .map((path) => [path.split("/").pop(), readFileSync(new URL(path, root), "utf8")]);
sources.push(["ball.xml", `<mujoco><worldbody><body name="a"><freejoint/><geom type="sphere" size="0.1"/><body name="b" pos="0 0 .2"><joint axis="0 1 0"/><geom type="capsule" size=".03 .1"/></body></body></worldbody></mujoco>`]);
const PIECES = ["-1", "1e308", "nan", "inf", "\"\"", "[", "]", "{", "}", "<", ">", "&", "\u0000", "\uFFFD", "0", "1e-320", "[[body]]", "<link name='x'/>", "<!--", "= =", "９", "\"".repeat(50), "[".repeat(2000), "<a>".repeat(2000)];

let seed = 20260731;
const random = (n) => {
  seed = (Math.imul(seed, 1664525) + 1013904223) >>> 0;
  return Math.floor((seed / 2 ** 32) * n);
};

/** A text with some changes. */
export function broken() {
  let [name, text] = sources[random(sources.length)];
  for (let k = random(4) + 1; k > 0; k--) {
    const at = random(text.length + 1), some = random(40) + 1, piece = PIECES[random(PIECES.length)];
    switch (random(7)) {
      case 0: text = text.slice(0, at) + piece + text.slice(at); break;
      case 1: text = text.slice(0, at) + text.slice(at + some); break;
      case 2: text = text.slice(0, at); break;
      case 3: text = text.slice(0, at) + text.slice(at, at + some).repeat(30) + text.slice(at + some); break;
      case 4: {
        const numbers = [...text.matchAll(/-?\d+\.?\d*(e-?\d+)?/g)], hit = numbers[random(numbers.length || 1)];
        if (hit) text = text.slice(0, hit.index) + piece + text.slice(hit.index + hit[0].length);
        break;
      }
      case 5: {
        const words = [...text.matchAll(/[a-z_]{3,}/g)], hit = words[random(words.length || 1)], other = words[random(words.length || 1)];
        if (hit && other) text = text.slice(0, hit.index) + other[0] + text.slice(hit.index + hit[0].length);
        break;
      }
      default: if (random(20) === 0) name = ["x", "a.txt", "b.xml", "c.urdf", "d.toml", "e.STL"][random(6)];
    }
  }
  return [name, text];
}

if (process.argv[1].endsWith("malformed.mjs")) {
  const count = +(process.argv[2] ?? 1000);
  let [opened, refused, longest, failed] = [0, 0, 0, 0];
  for (let k = 0; k < count; k++) {
    const [name, text] = broken(), page = engine(), begin = performance.now();
    try {
      const answer = page.open(name, [[name, new TextEncoder().encode(text)]]);
      if (answer.ok) {
        opened++;
        JSON.parse(answer.text);
        // What stops is told, too.
        const { done, trouble } = page.advance(5);
        page.look(true);
        if (done < 5 && !trouble) throw new Error("it stopped without a word");
      } else {
        refused++;
        if (!/error/.test(answer.text)) throw new Error(`no message: ${answer.text}`);
      }
    } catch (error) {
      failed++;
      console.log(`file ${k}, ${name}: ${error.message}\n${text.slice(0, 300)}`);
    }
    longest = Math.max(longest, performance.now() - begin);
  }
  console.log(`${count} broken files: ${refused} refused with a message, ${opened} sound in spite of it, ${failed} failed; at most ${longest.toFixed(0)} ms`);
  process.exitCode = failed || longest > 10000 ? 1 : 0;
}
