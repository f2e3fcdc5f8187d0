"""The robots of the comparison: `python models.py FOLDER`.

Writes for each what Pinocchio is to be built from (`NAME.model`, plain numbers), and `robots.txt` for the generator:
name, base, file. Chains that are not in `models/` are made up here.
"""

import pathlib
import re
import sys

import numpy as np
import pinocchio as pin

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parent.parent
sys.path.insert(0, str(ROOT / "tests" / "reference"))

import toml_model  # noqa: E402
import urdf_model  # noqa: E402

# Name, file, base. The order of the report. Files without a folder come with example-robot-data.
ROBOTS = [
    ("double_pendulum", "models/double_pendulum.toml", "fixed"),
    ("chain10_planar", "models/chain10_planar.toml", "fixed"),
    ("ur5", "models/ur5.urdf", "fixed"),
    ("panda_arm", "models/panda_arm.urdf", "fixed"),
    ("iiwa14", "models/iiwa14.urdf", "fixed"),
    ("chain6", "models/chain6.toml", "fixed"),
    ("chain20", None, "fixed"),
    ("solo12", "models/solo12.urdf", "floating"),
    ("g1", "models/g1.urdf", "floating"),
    ("talos", "talos_reduced.urdf", "floating"),
    ("chain100", None, "fixed"),
    ("planar100", None, "fixed"),
]

# As the generator's own default: a decimal π/2 is one. The rivals get the benefit of it too.
SNAP = 1e-6
# Below this, relative to the largest entry, a number in an inertia is rounding of the merging of bodies.
ROUNDING = 1e-14


def general_chain(n):
    """TOML of a chain in which nothing is aligned and nothing is zero, of the kind of `models/chain6.toml`."""
    rng = np.random.default_rng(n)
    text = [f'name = "chain{n}"']
    show = lambda x: "[" + ", ".join(f"{e:.3f}" for e in x) + "]"
    for k in range(1, n + 1):
        mass, size = rng.uniform(0.5, 3), rng.uniform(0.05, 0.2, 3)
        turn = pin.rpy.rpyToMatrix(*rng.uniform(-np.pi, np.pi, 3))
        # a box of these half lengths, turned: meets the triangle inequality
        box = mass / 3 * np.diag([size[1] ** 2 + size[2] ** 2, size[0] ** 2 + size[2] ** 2, size[0] ** 2 + size[1] ** 2])
        i = turn @ box @ turn.T
        entries = {"xx": i[0, 0], "yy": i[1, 1], "zz": i[2, 2], "xy": i[0, 1], "xz": i[0, 2], "yz": i[1, 2]}
        inertia = ", ".join(f"{key} = {value:.6f}" for key, value in entries.items())
        parent = f"link{k - 1}" if k > 1 else "ground"
        text.append(f"""
[[body]]
name = "link{k}"
mass = {mass:.3f}
com = {show(rng.uniform(-0.2, 0.2, 3))}
inertia = {{ {inertia} }}

[[joint]]
name = "joint{k}"
type = "revolute"
parent = "{parent}"
child = "link{k}"
xyz = {show(rng.uniform(-0.4, 0.4, 3))}
rpy = {show(rng.uniform(-3, 3, 3))}
axis = {show(rng.normal(size=3))}""")
    return "\n".join(text) + "\n"


def planar_chain(n):
    """TOML of a chain of like bars in the plane, as `models/chain10_planar.toml`."""
    text = [f'name = "planar{n}"\ngravity = [0, 0, -9.81]']
    for k in range(1, n + 1):
        parent = f"link{k - 1}" if k > 1 else "ground"
        text.append(f"""
[[body]]
name = "link{k}"
mass = 0.4
com = [0, 0, -0.125]
inertia = [0.0021, 0.0021, 0.00005]

[[joint]]
name = "pin{k}"
type = "revolute"
parent = "{parent}"
child = "link{k}"
xyz = [0, 0, {-0.25 if k > 1 else 0}]
axis = [0, 1, 0]""")
    return "\n".join(text) + "\n"


def source(name, file, folder):
    """Path of a robot's description; written here if it is one of the made up chains."""
    if file is None:
        path = folder / f"{name}.toml"
        path.write_text(general_chain(int(name[5:])) if name.startswith("chain") else planar_chain(int(name[6:])))
        return path
    if "/" in file:
        return ROOT / file
    robots = "lib/python*/site-packages/cmeel.prefix/share/example-robot-data/robots"
    text = next(pathlib.Path(sys.prefix).glob(f"{robots}/*/robots/{file}")).read_text()
    # Neither side has dry friction.
    path = folder / f"{name}.urdf"
    path.write_text(re.sub(r'friction="[^"]*"', 'friction="0.0"', text))
    return path


def snapped(matrix):
    """A rotation without entries next to 0, if that leaves it one; what then stands alone in its row is 1 or -1."""
    close = np.where(np.abs(matrix) < SNAP, 0.0, matrix)
    alone = np.count_nonzero(close, axis=1, keepdims=True) == 1
    close = np.where(alone, np.sign(close), close)
    return close if np.abs(close @ close.T - np.eye(3)).max() < 1e-13 else matrix


def cleaned(x):
    x = np.asarray(x, dtype=float)
    return np.where(np.abs(x) < ROUNDING * np.max(np.abs(x), initial=0), 0.0, x)


def kind(joint):
    """Pinocchio's cheapest joint for an axis, and the axis."""
    name = joint.shortname()
    if name == "JointModelFreeFlyer":
        return "FF", np.zeros(3)
    if name in ("JointModelRX", "JointModelRY", "JointModelRZ"):
        return name[-2:], np.eye(3)["XYZ".index(name[-1])]
    assert name == "JointModelRevoluteUnaligned", name
    axis = joint.extract().axis
    for k in range(3):
        if np.abs(axis - np.eye(3)[k]).max() < SNAP:
            return "R" + "XYZ"[k], np.eye(3)[k]
    return "RU", axis


def flat(name, model):
    """One line per joint: name, kind, parent, rotation by rows, place, axis, mass, mass centre, inertia, armature."""
    lines = [f"{name} {model.nq} {model.nv} {model.njoints}", numbers(model.gravity.linear)]
    for i in range(1, model.njoints):
        what, axis = kind(model.joints[i])
        place, inertia = model.jointPlacements[i], model.inertias[i]
        line = [snapped(place.rotation).flatten(), place.translation, axis, [inertia.mass], cleaned(inertia.lever),
                cleaned(inertia.inertia.flatten()), [model.armature[model.joints[i].idx_v]]]
        lines.append(f"{model.names[i]} {what} {model.parents[i]} {numbers(np.concatenate(line))}")
    return "\n".join(lines) + "\n"


def numbers(x):
    return " ".join(repr(float(e)) for e in x)


def main(folder):
    folder.mkdir(parents=True, exist_ok=True)
    robots = []
    for name, file, base in ROBOTS:
        path = source(name, file, folder)
        if path.suffix == ".toml":
            system = toml_model.load(path.parent, path.name)
        else:
            system = urdf_model.load(path.parent, path.name, base)
        (folder / f"{name}.model").write_text(flat(name, system.model))
        robots.append(f"{name} {base} {path}")
    (folder / "robots.txt").write_text("\n".join(robots) + "\n")


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]).resolve())
