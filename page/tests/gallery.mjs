// `node gallery.mjs MBD [NAMES...]`: pictures of the shipped mechanisms for the book and the README, made by Chromium from the pages
// that the program MBD writes, into `book/src/gallery`. With names, those pictures only.
import { execFileSync } from "node:child_process";
import { mkdirSync, mkdtempSync, readdirSync, rmSync, statSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { fileURLToPath } from "node:url";
import { chromium } from "./chromium.mjs";

/**
 * The pictures: model, time of the motion in s, and what is not the page's own choice: options of the command, the frame whose path
 * is drawn, angles of the camera in rad, its distance as a part of the page's.
 */
const PICTURES = [
  ["models/double_pendulum.toml", 4, { trace: -1, near: 0.7 }],
  ["models/ur5.urdf", 0, { yaw: -0.7, near: 0.85 }],
  ["models/g1.urdf", 0, { more: ["--base", "floating"] }],
  ["models/solo12.urdf", 0, { more: ["--base", "floating"], near: 0.85 }],
  ["models/panda.urdf", 0, { near: 0.85 }],
  ["models/iiwa14.urdf", 0.4, { near: 0.8 }],
  ["models/biped.toml", 0, { yaw: -1.4 }],
  ["models/satellite.toml", 2, { near: 0.6 }],
  ["models/chain10_planar.toml", 1.3, { trace: -1, near: 0.75 }],
  ["models/mechanisms/stewart.toml", 0.2, {}],
  ["models/mechanisms/delta.toml", 0.2, { trace: -1 }],
  ["models/mechanisms/fourbar.toml", 3, { trace: -1 }],
  ["models/mechanisms/fourbar_3d.toml", 3, {}],
  ["models/mechanisms/slider_crank.toml", 2, { near: 0.85 }],
  ["models/mechanisms/strandbeest_leg.toml", 3, { trace: -1 }],
  ["models/mechanisms/bicycle.toml", 1, {}],
  ["models/mechanisms/spring_leg.toml", 0.5, {}],
  ["models/contacts/quadruped.toml", 0.3, {}],
  ["models/contacts/newtons_cradle.toml", 0.9, { near: 0.75 }],
  ["models/contacts/rattleback.toml", 1, { near: 0.7 }],
  ["models/contacts/tippe_top.toml", 1, {}],
  ["models/mjcf/hopping_leg.xml", 0.2, { near: 0.85 }],
  ["models/variants/gripper.toml", 0.5, { near: 0.75 }],
];
const SIZE = { width: 400, height: 300, scale: 1.5 };
/** Largest size of all pictures together, bytes. */
const LARGEST = 600000;

const [mbd, ...names] = process.argv.slice(2);
const root = fileURLToPath(new URL("../../", import.meta.url)), gallery = join(root, "book/src/gallery");
const folder = mkdtempSync(join(tmpdir(), "gallery-"));
mkdirSync(gallery, { recursive: true });
const browser = await chromium();
try {
  for (const [model, time, { more = [], trace, yaw, pitch, near = 1 }] of PICTURES) {
    const name = model.split("/").pop().replace(/\.\w+$/, "");
    if (names.length && !names.includes(name)) continue;
    const file = join(folder, "page.html");
    execFileSync(mbd, ["view", join(root, model), ...more, "-o", file], { stdio: ["ignore", "ignore", "ignore"] });
    const page = await browser.page(`file://${file}#still`, SIZE);
    await page.until("typeof page !== 'undefined' && page.first !== undefined");
    await page.evaluate(`(async () => {
      const style = document.createElement("style");
      style.textContent = "body{display:block!important}#stage{width:100vw;height:100vh}#panel,#bar,#head,#names{display:none!important}";
      document.head.append(style);
      const step = page.settings.step, count = Math.round(${time} / step);
      for (let done = 0; done < count; ) {
        const some = Math.min(200, count - done);
        const answer = await change({ action: "frame", steps: some, each: 8, most: 20000 });
        if (!answer || answer.trouble) throw new Error(answer?.trouble ?? "stopped");
        done += answer.done;
      }
      ${trace === undefined ? "" : `page.look.traceOf = ${trace} < 0 ? page.scene.frames.length - 1 : ${trace};`}
      ${yaw === undefined ? "" : `canvas.view.yaw = ${yaw};`}
      ${pitch === undefined ? "" : `canvas.view.pitch = ${pitch};`}
      canvas.view.distance *= ${0.86 * near};
      draw();
    })()`);
    const { data } = await page.on("Page.captureScreenshot", { format: "webp", quality: 82 });
    writeFileSync(join(gallery, `${name}.webp`), Buffer.from(data, "base64"));
    if (page.troubles.length) throw new Error(`${model}: ${page.troubles.join("; ")}`);
    await page.close();
  }
} finally {
  await browser.close();
  rmSync(folder, { recursive: true, force: true });
}
const all = readdirSync(gallery).reduce((sum, file) => sum + statSync(join(gallery, file)).size, 0);
console.log(`${readdirSync(gallery).length} pictures, ${(all / 1000).toFixed(0)} kB`);
process.exitCode = all > LARGEST ? 1 : 0;
