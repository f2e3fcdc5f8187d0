"""Strips robot descriptions down to what matters for dynamics, numbers untouched.

    python strip_urdf.py [--drake drake-1.23.0-....whl] [name ...]

Reads the URDF files of the PyPI package `example-robot-data` (and, for the iiwa, of the PyPI wheel `drake`, which is only
unzipped, never installed), keeps links with their inertia and joints with origin, axis, limits, dynamics and mimic, drops
the rest and counts in a comment what went.
"""

import argparse
import pathlib
import sysconfig
import xml.etree.ElementTree as ET
import zipfile
from collections import Counter
from dataclasses import dataclass

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parent.parent
DATA = pathlib.Path(sysconfig.get_path("purelib")) / "cmeel.prefix/share/example-robot-data/robots"

KEEP = {
    "robot": {"link", "joint"},
    "link": {"inertial"},
    "inertial": {"origin", "mass", "inertia"},
    "joint": {"origin", "parent", "child", "axis", "limit", "dynamics", "mimic"},
}
# All other attributes are outside the URDF format, for particular simulators; Pinocchio does not read them.
ATTRIBUTES = {
    "robot": {"name"},
    "dynamics": {"damping", "friction"},
    "limit": {"lower", "upper", "effort", "velocity"},
}


@dataclass
class Source:
    """One robot: where it comes from and what is said about it."""

    file: str
    target: str
    purpose: str
    upstream: str
    licence: str


ERD = "PyPI example-robot-data 6.0.0, "
SOURCES = {
    "ur5": Source(
        "ur_description/urdf/ur5_robot.urdf", "models/ur5.urdf",
        "Universal Robots UR5, six pins: the everyday industrial arm, no damping, no products of inertia.",
        "github.com/ros-industrial/universal_robot", "BSD (as its package.xml says)"),
    "panda": Source(
        "panda_description/urdf/panda.urdf", "models/panda.urdf",
        "Franka Panda with hand, seven pins and two finger slides, one mimicking the other: full inertias, damping, mimic.",
        "github.com/frankaemika/franka_ros", "Apache-2.0"),
    "solo12": Source(
        "solo_description/robots/solo12.urdf", "models/solo12.urdf",
        "Solo-12 quadruped, twelve pins: meant for a floating base, which the reader of the file chooses.",
        "github.com/open-dynamic-robot-initiative/robot_properties_solo", "BSD-3-Clause"),
    "g1": Source(
        "g1_description/urdf/g1_29dof_rev_1_0.urdf", "models/g1.urdf",
        "Unitree G1 humanoid, 29 pins, 35 velocities with a floating base: the large model.",
        "github.com/unitreerobotics/unitree_ros", "BSD-3-Clause"),
    "iiwa14": Source(
        "pydrake/share/drake/manipulation/models/iiwa_description/urdf/iiwa14_no_collision.urdf", "models/iiwa14.urdf",
        "KUKA LBR iiwa 14, seven pins with damping: the usual arm of timing comparisons.",
        "github.com/RobotLocomotion/drake, after github.com/SalvoVirga/iiwa_stack", "BSD-3-Clause and BSD-2-Clause"),
    "romeo": Source(
        "romeo_description/urdf/romeo_small.urdf", "tests/reference/robots/romeo.urdf",
        "Aldebaran Romeo humanoid, 31 pins. Two links break the triangle inequality of inertias: readers should warn.",
        "github.com/laas/romeo", "BSD (as its package.xml says; model copyright Aldebaran Robotics)"),
    "hyq": Source(
        "hyq_description/robots/hyq_no_sensors.urdf", "tests/reference/robots/hyq.urdf",
        "IIT HyQ quadruped, twelve pins with damping.",
        "github.com/iit-DLSLab/hyq-description", "Apache-2.0"),
    "anymal_c": Source(
        "anymal_c_simple_description/urdf/anymal.urdf", "tests/reference/robots/anymal_c.urdf",
        "ANYbotics ANYmal C quadruped, twelve pins, very many fixed links.",
        "github.com/ANYbotics/anymal_c_simple_description", "BSD-3-Clause, copyright 2020 ANYbotics AG"),
    "kinova": Source(
        "kinova_description/robots/kinova.urdf", "tests/reference/robots/kinova.urdf",
        "Kinova j2s6s200 arm, six joints, some of them continuous.",
        "github.com/Kinovarobotics/kinova-ros", "BSD (as its package.xml says)"),
    "ur10": Source(
        "ur_description/urdf/ur10_robot.urdf", "tests/reference/robots/ur10.urdf",
        "Universal Robots UR10, put on a planar base in the reference.",
        "github.com/ros-industrial/universal_robot", "BSD (as its package.xml says)"),
    "baxter": Source(
        "baxter_description/urdf/baxter.urdf", "tests/reference/robots/baxter.urdf",
        "Rethink Baxter, two arms with mimic grippers (slides, ratio -1).",
        "github.com/RethinkRobotics/baxter_common", "BSD-3-Clause, copyright 2013-2015 Rethink Robotics"),
    "pr2": Source(
        "pr2_description/urdf/pr2.urdf", "tests/reference/robots/pr2.urdf",
        "Willow Garage PR2: continuous joints, slides, mimic grippers, in the reference on a planar base.",
        "github.com/pr2/pr2_common", "BSD (as its package.xml says)"),
}


def strip(element, gone):
    """Removes from `element` every child and attribute that is not kept, counting them in `gone`."""
    allowed = ATTRIBUTES.get(element.tag)
    if allowed is not None:
        for key in [k for k in element.attrib if k not in allowed]:
            gone[f"attribute {key.split('}')[-1]} of <{element.tag}>"] += 1
            del element.attrib[key]
    for child in list(element):
        if child.tag in KEEP.get(element.tag, ()):
            strip(child, gone)
        else:
            gone[f"<{child.tag}>"] += 1
            element.remove(child)


def convert(text, source, package):
    """The stripped file as text."""
    robot = ET.fromstring(text)
    gone = Counter()
    strip(robot, gone)
    for element in robot.iter():
        element.text = None
        element.tail = None
    ET.indent(robot, "  ")
    removed = ", ".join(f"{n} {what}" for what, n in sorted(gone.items()))
    lines = [
        source.purpose,
        f"Source: {package}{source.file}, upstream {source.upstream}.",
        f"Licence: {source.licence}; see models/README.md.",
        f"Stripped by tests/reference/strip_urdf.py: comments, {removed}. All else as it was.",
    ]
    comment = "<!--\n  " + "\n  ".join(line.replace("--", "- -") for line in lines) + "\n-->\n"
    return '<?xml version="1.0"?>\n' + comment + ET.tostring(robot, encoding="unicode") + "\n"


def main():
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", help="robots to write; all by default")
    parser.add_argument("--drake", help="wheel of drake 1.23.0, for the iiwa")
    arguments = parser.parse_args()
    for name in arguments.names or SOURCES:
        source = SOURCES[name]
        if source.file.startswith("pydrake"):
            if arguments.drake is None:
                print(f"{name}: left alone, needs --drake")
                continue
            package = "PyPI drake 1.23.0, "
            text = zipfile.ZipFile(arguments.drake).read(source.file).decode()
        else:
            package = ERD
            text = (DATA / source.file).read_text()
        target = ROOT / source.target
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_text(convert(text, source, package))
        print(f"{source.target}: {target.stat().st_size} bytes")


if __name__ == "__main__":
    main()
