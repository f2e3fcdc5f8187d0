"""Rollouts of this package and of MuJoCo's, on one thread, in one run: `python bench/rollouts.py [REPEATS]`.

Both integrate the same robots by the classical Runge-Kutta method with steps of 1 ms and random joint forces, without contacts
and limits; roots are fixed. Both read the same URDF, of which shapes, limits, damping and friction are left out. The machine's speed
changes from minute to minute: the figures of one round are taken one after the other, the best of all rounds counts, and ratios are
those of the same run. One program integrates momenta and the other velocities: their motions differ by the method's errors, which grow
where light links are thrown about.
"""

import pathlib
import sys
import time
import xml.etree.ElementTree as xml

import mujoco
import numpy as np
from mujoco import rollout as mujoco_rollout

import multibody

MODELS = pathlib.Path(__file__).resolve().parents[2] / "models"
DT, STEPS, ROWS = 1e-3, 500, 16


def bare_urdf(name):
    """The text of a URDF without shapes, limits, damping and friction, which both programs then read alike."""
    tree = xml.parse(MODELS / name).getroot()
    for link in tree.findall("link"):
        for part in link.findall("visual") + link.findall("collision"):
            link.remove(part)
    for joint in tree.findall("joint"):
        if joint.get("type") == "revolute":
            joint.set("type", "continuous")
        for part in joint.findall("limit") + joint.findall("dynamics") + joint.findall("safety_controller"):
            joint.remove(part)
    return xml.tostring(tree, encoding="unicode")


def mujoco_model(text):
    """MuJoCo's model of a URDF with a fixed root, with a motor on every joint."""
    spec = mujoco.MjSpec.from_string(text)
    spec.compiler.balanceinertia = True
    spec.compiler.fusestatic = False
    for joint in spec.joints:
        spec.add_actuator(name=joint.name + "_motor", target=joint.name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
    spec.option.timestep = DT
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_RK4
    spec.option.disableflags = int(mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
    return spec.compile()


def order(model, other):
    """Index of MuJoCo's joints in the order of this package's."""
    return [mujoco.mj_name2id(other, mujoco.mjtObj.mjOBJ_JOINT, name) for name in model.velocity_names]


def seconds(work):
    start = time.process_time()
    work()
    return time.process_time() - start


def compare(name, repeats):
    """Steps a second of one robot, and how far both programs' motions are apart."""
    text = bare_urdf(name)
    model, other = multibody.load(text=text, format="urdf"), mujoco_model(text)
    random = np.random.default_rng(0)
    q = random.uniform(-1, 1, (ROWS, model.nv))
    u = random.uniform(-1, 1, (ROWS, STEPS, model.nv))
    places = np.argsort(order(model, other))
    size = mujoco.mj_stateSize(other, mujoco.mjtState.mjSTATE_FULLPHYSICS)
    start = np.zeros((ROWS, size))
    start[:, 1 : 1 + model.nv] = q[:, places]
    forces, data = np.ascontiguousarray(u[:, :, places]), mujoco.MjData(other)
    v = np.zeros_like(q)
    mine = model.rollout((q, v), u, dt=DT, threads=1)
    with mujoco_rollout.Rollout(nthread=0) as theirs:
        states, _ = theirs.rollout(other, [data], start, forces)
        apart = abs(states[:, -1, 1 : 1 + model.nv] - mine.q[:, -1][:, places]).max()

        def one_by_one():
            for k in range(ROWS):
                model.rollout((q[k], v[k]), u[k], dt=DT, threads=1)

        def theirs_one_by_one():
            for k in range(ROWS):
                theirs.rollout(other, [data], start[k : k + 1], forces[k : k + 1])

        ways = {
            "one": one_by_one,
            "batch": lambda: model.rollout((q, v), u, dt=DT, threads=1),
            "batch, momenta": lambda: model.rollout((q, v), u, dt=DT, threads=1, state="momenta"),
            "MuJoCo one": theirs_one_by_one,
            "MuJoCo batch": lambda: theirs.rollout(other, [data], start, forces),
        }
        best = {way: np.inf for way in ways}
        for _ in range(repeats):
            for way, work in ways.items():
                best[way] = min(best[way], seconds(work))
    rate = {way: ROWS * STEPS / time / 1e3 for way, time in best.items()}
    print(f"{name}: {model.nv} velocities; both motions differ by {apart:.1e} after {STEPS * DT:.1f} s")
    for way, steps in rate.items():
        print(f"  {way:16} {steps:9.1f} thousand steps a second of one thread")
    print(f"  one state at a time: {rate['one'] / rate['MuJoCo one']:.1f} times MuJoCo's rollout")
    print(f"  batches:             {rate['batch'] / rate['MuJoCo batch']:.1f} times MuJoCo's rollout")
    print(f"  batches of momenta:  {rate['batch, momenta'] / rate['MuJoCo batch']:.1f} times")


if __name__ == "__main__":
    for robot in ("ur5.urdf", "g1.urdf"):
        compare(robot, int(sys.argv[1]) if len(sys.argv) > 1 else 10)
