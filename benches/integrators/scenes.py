"""The scenes of the work-precision bench: `python scenes.py WORK`.

Writes for each what Pinocchio is built from (`NAME.model`, plain numbers, as benches/rivals), a URDF for MuJoCo and Drake
(`NAME.urdf`), and `scenes.txt`: name, end time, number of joints, start q, start v.
"""

import math
import pathlib
import re
import sys

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parent.parent
sys.path[:0] = [str(ROOT / "benches" / "rivals"), str(ROOT / "tests" / "reference")]

import models  # noqa: E402
import urdf_model  # noqa: E402

# Name, file, seconds simulated. The motions are chaotic (README.md): no longer than doubles can follow to 1e-11.
SCENES = [("ur5", "models/ur5.urdf", 5.0), ("panda_arm", "models/panda_arm.urdf", 1.0)]

# Read by MuJoCo only: inertias stay as they are written.
MUJOCO = '<mujoco><compiler fusestatic="true" balanceinertia="false" boundmass="0" boundinertia="0"/></mujoco>'


def start(n):
    """Angles of `mbd simulate`'s own start, and a speed that every tool can be given."""
    return [0.3 if i % 2 == 0 else -0.3 for i in range(n)], [0.5] * n


def angles(match):
    """Right angles as the generator takes them: a decimal π/2 is one."""
    def snap(word):
        x = float(word)
        turns = round(x / (math.pi / 2))
        return repr(turns * math.pi / 2) if abs(x - turns * math.pi / 2) < models.SNAP else word
    return 'rpy="' + " ".join(snap(w) for w in match.group(1).split()) + '"'


def plain(text):
    """The mechanism alone: nothing damps, nothing limits."""
    text = re.sub(r"<(limit|dynamics)\b[^>]*/>", "", text)
    text = text.replace('type="revolute"', 'type="continuous"')
    text = re.sub(r'rpy="([^"]*)"', angles, text)
    return text.replace("</robot>", MUJOCO + "\n</robot>")


def main(folder):
    folder.mkdir(parents=True, exist_ok=True)
    lines = []
    for name, file, end in SCENES:
        system = urdf_model.load(ROOT, file)
        (folder / f"{name}.model").write_text(models.flat(name, system.model))
        (folder / f"{name}.urdf").write_text(plain((ROOT / file).read_text()))
        q, v = start(system.model.nv)
        lines.append(f"{name} {end!r} {len(q)} {models.numbers(q)} {models.numbers(v)}")
    (folder / "scenes.txt").write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]).resolve())
