"""Reads a model in the TOML format of this project (book/src/model-format.md) into Pinocchio.

Written apart from the project's own reader, as a second opinion on what the format means. Trusts its input.
"""

import pathlib
import tomllib

import numpy as np
import pinocchio as pin

from system import Joint, System


class Numbers:
    """Values of the three ways to write a number."""

    def __init__(self, params):
        self.params = params

    def one(self, x):
        if isinstance(x, dict):
            return self.params[x["param"]] if "param" in x else np.deg2rad(x["deg"])
        return float(x)

    def many(self, x):
        if isinstance(x, dict):
            return np.deg2rad(np.array(x["deg"], dtype=float))
        return np.array([self.one(e) for e in x])

    def spread(self, x, n):
        """One number or one per freedom."""
        if isinstance(x, list) or (isinstance(x, dict) and isinstance(x.get("deg"), list)):
            return self.many(x)
        return np.full(n, self.one(x))

    def placement(self, table):
        turn = np.eye(3)
        if "rpy" in table:
            turn = pin.rpy.rpyToMatrix(*self.many(table["rpy"]))
        elif "rotate" in table:
            axis = unit(self.many(table["rotate"]["axis"]))
            turn = pin.AngleAxis(self.one(table["rotate"]["angle"]), axis).toRotationMatrix()
        return pin.SE3(turn, self.many(table.get("xyz", [0, 0, 0])))

    def inertia(self, body):
        raw = body.get("inertia", [0, 0, 0])
        if isinstance(raw, dict):
            get = lambda key: self.one(raw.get(key, 0))
            matrix = np.array([
                [get("xx"), get("xy"), get("xz")],
                [get("xy"), get("yy"), get("yz")],
                [get("xz"), get("yz"), get("zz")],
            ])
        else:
            matrix = np.diag(self.many(raw))
        turn = pin.rpy.rpyToMatrix(*self.many(body.get("inertia_rpy", [0, 0, 0])))
        mass, com = self.one(body.get("mass", 0)), self.many(body.get("com", [0, 0, 0]))
        return pin.Inertia(mass, com, turn @ matrix @ turn.T)


# Kinds of joints whose name in the data is not that of the format.
KINDS = {"revolute": "pin", "prismatic": "slider"}


def unit(x):
    return x / np.linalg.norm(x)


def tilt(normal):
    """The smallest rotation that takes z to `normal`."""
    return pin.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), normal).toRotationMatrix()


def pieces(joint, numbers):
    """Pinocchio joints that make up one joint, and the tilt of a planar one.

    Where the axes move with the coordinates, simple joints stand in a row: Pinocchio's Coriolis matrix is not for such
    joints in one piece.
    """
    kind = joint["type"]
    axis = unit(numbers.many(joint.get("axis", [1, 0, 0] if "axis2" in joint else [0, 0, 1])))
    turn = pin.JointModelRevoluteUnaligned(axis)
    slide = pin.JointModelPrismaticUnaligned(axis)
    if kind == "universal":
        first = unit(numbers.many(joint.get("axis", [1, 0, 0])))
        second = unit(numbers.many(joint.get("axis2", [0, 1, 0])))
        return [pin.JointModelRevoluteUnaligned(first), pin.JointModelRevoluteUnaligned(second)], None
    if kind == "planar":
        return [pin.JointModelPlanar()], tilt(axis)
    if kind == "helical":
        return [pin.JointModelHelicalUnaligned(axis, numbers.one(joint["pitch"]))], None
    simple = {
        "pin": [turn], "slider": [slide], "cylindrical": [slide, turn], "fixed": [],
        "spherical": [pin.JointModelSpherical()], "floating": [pin.JointModelFreeFlyer()],
    }
    return simple[kind], None


class Builder:
    """Hangs the bodies of one file on a Pinocchio model, depth first, children in file order."""

    def __init__(self, path, params):
        self.table = tomllib.loads(pathlib.Path(path).read_text())
        self.params = self.table.get("params", {}) | params
        self.numbers = Numbers(self.params)
        self.model = pin.Model()
        for joint in self.table["joint"]:
            joint["type"] = KINDS.get(joint["type"], joint["type"])
        self.bodies = {body["name"]: body for body in self.table["body"]}
        self.at = {"ground": (0, pin.SE3.Identity())}
        self.joints, self.links = [], {}

    def hang(self, parent):
        for joint in self.table["joint"]:
            if joint.get("parent", "ground") == parent:
                self.add(joint, parent)
                self.hang(joint["child"])

    def add(self, joint, parent):
        ident, place = self.at[parent]
        place = place * self.numbers.placement(joint)
        models, tilted = pieces(joint, self.numbers)
        child = pin.SE3.Identity()
        if tilted is not None:
            place = place * pin.SE3(tilted, np.zeros(3))
            child = pin.SE3(tilted.T, np.zeros(3))
        iq, iv = self.model.nq, self.model.nv
        for k, piece in enumerate(models):
            ident = self.model.addJoint(ident, piece, place, joint["name"] + "'" * k)
            place = pin.SE3.Identity()
        # what is left of the placement: all of it behind a fixed joint, else that of the child in the tilted frame
        place = child if models else place
        name = joint["child"]
        self.at[name] = (ident, place)
        self.model.appendBodyToJoint(ident, self.numbers.inertia(self.bodies[name]), place)
        self.link(name, ident, place)
        if models:
            self.joints.append(self.describe(joint, ident, iq, iv, child))

    def link(self, name, ident, place):
        self.links[name] = self.model.addFrame(pin.Frame(name, ident, place, pin.FrameType.OP_FRAME))

    def describe(self, joint, ident, iq, iv, child):
        nv = self.model.nv - iv
        made = Joint(joint["name"], joint["type"], ident, iq, iv, child)
        for key in ("damping", "stiffness", "rest"):
            setattr(made, key, self.numbers.spread(joint.get(key, 0), nv))
        armature = self.model.armature.copy()
        armature[iv:] = self.numbers.spread(joint.get("armature", 0), nv)
        self.model.armature = armature
        if joint.get("motion") == "prescribed":
            made.role = "prescribed"
        if "mimic" in joint:
            mimic = joint["mimic"]
            made.role, made.leader = "mimic", mimic["joint"]
            made.ratio = self.numbers.one(mimic.get("ratio", 1))
            made.offset = self.numbers.one(mimic.get("offset", 0))
        return made


def load(root, file, gravity=None, params=None):
    """The system in `root/file`; `gravity` where the file leaves it to the caller, `params` in place of defaults."""
    builder = Builder(root / file, params or {})
    builder.hang("ground")
    table = builder.table
    for frame in table.get("frame", []):
        ident, place = builder.at[frame["body"]]
        builder.link(frame["name"], ident, place * builder.numbers.placement(frame))
    given = table.get("gravity", [0, 0, -9.81])
    builder.model.gravity.linear = np.array(gravity if given == "input" else builder.numbers.many(given))
    wrenches = [(w.get("name", w["body"]), w["body"], w.get("frame", "body")) for w in table.get("wrench", [])]
    reported = list(builder.links)
    return System(file, "fixed", builder.model, builder.joints, builder.links, reported, wrenches, builder.params)
