"""Reads a URDF with Pinocchio's own reader and adds what it leaves out: mimics, damping, names of links."""

import xml.etree.ElementTree as ET

import numpy as np
import pinocchio as pin

from system import Joint, System

KINDS = {"revolute": "pin", "prismatic": "slider", "continuous": "pin_unbounded"}
BASES = {"floating": pin.JointModelFreeFlyer, "planar": pin.JointModelPlanar}


def load(root, file, base="fixed", wrenches=()):
    """The system in `root/file` on the given base; `wrenches` names links on which one acts, in body axes."""
    path = str(root / file)
    if base == "fixed":
        model = pin.buildModelFromUrdf(path)
    else:
        model = pin.buildModelFromUrdf(path, BASES[base]())
    tables = {joint.get("name"): joint for joint in ET.parse(path).getroot().findall("joint")}
    joints = []
    for ident in range(1, model.njoints):
        name, piece = model.names[ident], model.joints[ident]
        if name not in tables:
            assert name == "root_joint"
            joints.append(Joint(name, base, ident, piece.idx_q, piece.idx_v, pin.SE3.Identity()))
            continue
        joints.append(describe(tables[name], name, ident, piece))
        assert (joints[-1].nq, joints[-1].nv) == (piece.nq, piece.nv)
    links = {f.name: k for k, f in enumerate(model.frames) if f.type == pin.FrameType.BODY}
    named = [(link, link, "body") for link in wrenches]
    return System(file, base, model, joints, links, chosen(path, model, links, wrenches), named)


def describe(table, name, ident, piece):
    """Joint with damping and mimic."""
    made = Joint(name, KINDS[table.get("type")], ident, piece.idx_q, piece.idx_v, pin.SE3.Identity())
    dynamics = table.find("dynamics")
    if dynamics is not None:
        made.damping = np.array([float(dynamics.get("damping", 0))])
        assert float(dynamics.get("friction", 0)) == 0, "dry friction is not part of the reference"
    mimic = table.find("mimic")
    if mimic is not None:
        made.role, made.leader = "mimic", mimic.get("joint")
        made.ratio, made.offset = float(mimic.get("multiplier", 1)), float(mimic.get("offset", 0))
    return made


def chosen(path, model, links, wrenches):
    """Links to report: those with a wrench, and up to four that end a branch and move."""
    robot = ET.parse(path).getroot()
    parents = {joint.find("parent").get("link") for joint in robot.findall("joint")}
    ends = [k for k in links if k not in parents and model.frames[links[k]].parentJoint > 0]
    step = max(1, len(ends) // 4)
    return list(dict.fromkeys([*wrenches, *ends[::step][:4]]))
