"""The scenes of the work-precision bench: `python scenes.py WORK`.

Writes for each what Pinocchio is built from (`NAME.model`, plain numbers, as in benches/rivals), the same as a URDF for MuJoCo,
Drake and the project (`NAME.urdf`), and `scenes.txt`: name, end time, number of joints, start q, start v.

The URDF holds what Pinocchio's reader makes of the model: a body a joint, fixed ones merged into it, since not every reader
does that. Nothing damps, limits, or drives; angles next to right ones are right ones, as the generator takes them.
"""

import math
import pathlib
import sys

import numpy as np
import pinocchio as pin

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parent.parent
sys.path[:0] = [str(ROOT / "benches" / "rivals"), str(ROOT / "tests" / "reference")]

import models  # noqa: E402
import urdf_model  # noqa: E402

# Name, file, seconds simulated. The motions are chaotic (README.md): no longer than doubles can follow to 1e-12.
SCENES = [("ur5", "models/ur5.urdf", 5.0), ("panda_arm", "models/panda_arm.urdf", 1.0)]


def start(n):
    """Angles of `mbd simulate`'s own start, and a speed that every tool can be given."""
    return [0.3 if i % 2 == 0 else -0.3 for i in range(n)], [0.5] * n


def angles(rotation):
    """Roll, pitch, yaw."""
    quarter = math.pi / 2
    found = pin.rpy.matrixToRpy(models.snapped(rotation))
    return [round(x / quarter) * quarter if abs(x - round(x / quarter) * quarter) < models.SNAP else x for x in found]


def urdf(name, model):
    parts = [f'<robot name="{name}">', '<link name="world"/>']
    for i in range(1, model.njoints):
        _, axis = models.kind(model.joints[i])
        place, body = model.jointPlacements[i], model.inertias[i]
        assert model.armature[model.joints[i].idx_v] == 0
        inertia = models.cleaned(body.inertia)
        entries = " ".join(f'i{"xyz"[a]}{"xyz"[b]}="{float(inertia[a, b])!r}"' for a, b in zip(*np.triu_indices(3)))
        parent = f"body{model.parents[i]}" if model.parents[i] else "world"
        parts.append(f"""<link name="body{i}">
  <inertial>
    <origin xyz="{models.numbers(models.cleaned(body.lever))}" rpy="0 0 0"/>
    <mass value="{float(body.mass)!r}"/>
    <inertia {entries}/>
  </inertial>
</link>
<joint name="{model.names[i]}" type="continuous">
  <parent link="{parent}"/>
  <child link="body{i}"/>
  <origin xyz="{models.numbers(place.translation)}" rpy="{models.numbers(angles(place.rotation))}"/>
  <axis xyz="{models.numbers(axis)}"/>
</joint>""")
    return "\n".join([*parts, "</robot>"]) + "\n"


def main(folder):
    folder.mkdir(parents=True, exist_ok=True)
    lines = []
    for name, file, end in SCENES:
        model = urdf_model.load(ROOT, file).model
        (folder / f"{name}.model").write_text(models.flat(name, model))
        (folder / f"{name}.urdf").write_text(urdf(name, model))
        q, v = start(model.nv)
        lines.append(f"{name} {end!r} {len(q)} {models.numbers(q)} {models.numbers(v)}")
    (folder / "scenes.txt").write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]).resolve())
