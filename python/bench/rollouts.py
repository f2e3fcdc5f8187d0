"""Rollouts of this package and of MuJoCo's, on one thread, in one run: `python bench/rollouts.py [REPEATS]`.

Both integrate the same robots by the classical Runge-Kutta method with steps of 1 ms and random joint forces, without contacts
and limits; roots are fixed. Both read the same URDF, of which shapes, limits, damping and friction are left out. The machine's speed
changes from minute to minute: the figures of one round are taken one after the other, the best of all rounds counts, and ratios are
those of the same run. MuJoCo has two ways, `mujoco.rollout` and `mujoco.batch`. One program integrates momenta and the other
velocities: their motions differ by the method's errors, which `refine` shows to vanish with the fourth power of the step.
"""

import pathlib
import sys
import time
import xml.etree.ElementTree as xml

import mujoco
import mujoco.batch
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


def start_of(model, other, q):
    """MuJoCo's states at rest for coordinates of this package."""
    size = mujoco.mj_stateSize(other, mujoco.mjtState.mjSTATE_FULLPHYSICS)
    start = np.zeros((len(q), size))
    start[:, 1 : 1 + model.nv] = q[:, np.argsort(order(model, other))]
    return start


def refine(model, other, q, u):
    """How far both motions are apart, and from a reference by small tolerances, with smaller and smaller steps: of the first row."""
    places = np.argsort(order(model, other))
    rest = (q[0], np.zeros(model.nv))
    reference = model.rollout(rest, u[0], dt=DT, tolerance=1e-12).q[-1, places]
    for parts in (1, 2, 4, 8):
        forces = np.repeat(u[0], parts, axis=0)
        other.opt.timestep = DT / parts
        mine = model.rollout(rest, forces, dt=DT / parts).q[-1, places]
        with mujoco_rollout.Rollout(nthread=0) as theirs:
            states, _ = theirs.rollout(other, [mujoco.MjData(other)], start_of(model, other, q[:1]), forces[None, :, places])
        found = states[0, -1, 1 : 1 + model.nv]
        apart, ours, others = abs(mine - found).max(), abs(mine - reference).max(), abs(found - reference).max()
        print(f"  steps of {DT / parts * 1e3:.3f} ms: apart {apart:.1e}; errors {ours:.1e} here, {others:.1e} MuJoCo")
    other.opt.timestep = DT


def outputs(model, repeats):
    """Prints the time of accelerations, of states that are computed one by one and of many."""
    random = np.random.default_rng(0)
    for rows in (63, 4096):
        q, v = random.uniform(-1, 1, (2, rows, model.nv))
        out = np.empty_like(v)
        best = min(seconds(lambda: model.accelerations(q, v, out=out)) for _ in range(20 * repeats))
        print(f"  accelerations of {rows} states: {best / rows * 1e9:.0f} ns a state")


def loads(repeats):
    """Steps a second of a UR5 that carries another load in each row: a parameter here, a model of its own in MuJoCo."""
    text = bare_urdf("ur5.urdf")
    head, tail = multibody.convert(text=text, format="urdf").split('name = "wrist_3_link"\nmass = ')
    mass, tail = tail.split("\n", 1)
    given = f'{head}name = "wrist_3_link"\nmass = {{ param = "load" }}\n{tail}\n[params]\nload = {mass}\n'
    model, random = multibody.load(text=given), np.random.default_rng(0)
    q = random.uniform(-1, 1, (ROWS, model.nv))
    u, masses = random.uniform(-1, 1, (ROWS, STEPS, model.nv)), random.uniform(0.1, 2.0, ROWS)
    others = [mujoco_model(text) for _ in range(ROWS)]
    for other, load in zip(others, masses):
        other.body("wrist_3_link").mass = load
        mujoco.mj_setConst(other, mujoco.MjData(other))
    places = np.argsort(order(model, others[0]))
    start, forces, data = start_of(model, others[0], q), np.ascontiguousarray(u[:, :, places]), mujoco.MjData(others[0])
    v = np.zeros_like(q)
    batch = mujoco.batch.Batch(mujoco_model(text), ROWS, nthread=1)
    batch.body("wrist_3_link").mass = masses[:, None]
    batch.set_const()
    qpos, qvel = batch.bind("qpos"), batch.bind("qvel")
    with mujoco_rollout.Rollout(nthread=0) as pool:

        def one():
            for k in range(ROWS):
                model.rollout((q[k], v[k]), u[k], dt=DT, threads=1, params={"load": masses[k]})

        def together():
            return model.rollout((q, v), u, dt=DT, threads=1, params={"load": masses})

        def their_one():
            for k in range(ROWS):
                pool.rollout(others[k], [data], start[k : k + 1], forces[k : k + 1])

        def their_rollout():
            return pool.rollout(others, [data], start, forces)

        def their_batch():
            qpos[:], qvel[:] = q[:, places], 0.0
            return batch.rollout(STEPS, forces, record=("qpos", "qvel"))

        mine = together().q[:, -1][:, places]
        ends = [their_rollout()[0][:, -1, 1 : 1 + model.nv], their_batch()["qpos"][:, -1]]
        apart = max(abs(end - mine).max() for end in ends)
        ways = (one, together, their_one, their_rollout, their_batch)
        best = [np.inf] * len(ways)
        for _ in range(repeats):
            best = [min(least, seconds(way)) for least, way in zip(best, ways)]
    rates = [ROWS * STEPS / time / 1e3 for time in best]
    print(f"ur5.urdf with a load in each row; motions differ by {apart:.1e} after {STEPS * DT:.1f} s; thousand steps a second:")
    print(f"  one {rates[0]:.1f}, batch {rates[1]:.1f}; MuJoCo one {rates[2]:.1f}, rollout {rates[3]:.1f}, Batch {rates[4]:.1f}")
    print(f"  {rates[0] / rates[2]:.1f} times MuJoCo one; batch {rates[1] / max(rates[3:]):.1f} times the better one")


def compare(name, repeats):
    """Steps a second of one robot, and how far both programs' motions are apart."""
    text = bare_urdf(name)
    model, other = multibody.load(text=text, format="urdf"), mujoco_model(text)
    random = np.random.default_rng(0)
    q = random.uniform(-1, 1, (ROWS, model.nv))
    u = random.uniform(-1, 1, (ROWS, STEPS, model.nv))
    places = np.argsort(order(model, other))
    start = start_of(model, other, q)
    forces, data = np.ascontiguousarray(u[:, :, places]), mujoco.MjData(other)
    v = np.zeros_like(q)
    mine = model.rollout((q, v), u, dt=DT, threads=1)
    batch = mujoco.batch.Batch(other, ROWS, nthread=1)
    qpos, qvel = batch.bind("qpos"), batch.bind("qvel")

    def their_batch():
        qpos[:], qvel[:] = q[:, places], 0.0
        return batch.rollout(STEPS, forces, record=("qpos", "qvel"))

    assert abs(their_batch()["qpos"][:, -1] - mine.q[:, -1][:, places]).max() < 1e-1
    with mujoco_rollout.Rollout(nthread=0) as theirs:
        states, _ = theirs.rollout(other, [data], start, forces)
        apart = abs(states[:, -1, 1 : 1 + model.nv] - mine.q[:, -1][:, places]).max()

        def one_by_one(state):
            for k in range(ROWS):
                model.rollout((q[k], v[k]), u[k], dt=DT, threads=1, state=state)

        def theirs_one_by_one():
            for k in range(ROWS):
                theirs.rollout(other, [data], start[k : k + 1], forces[k : k + 1])

        ways = {
            "one": lambda: one_by_one("velocities"),
            "one, momenta": lambda: one_by_one("momenta"),
            "batch": lambda: model.rollout((q, v), u, dt=DT, threads=1),
            "batch, momenta": lambda: model.rollout((q, v), u, dt=DT, threads=1, state="momenta"),
            "MuJoCo one": theirs_one_by_one,
            "MuJoCo rollout": lambda: theirs.rollout(other, [data], start, forces),
            "MuJoCo Batch": their_batch,
        }
        best = {way: np.inf for way in ways}
        for _ in range(repeats):
            for way, work in ways.items():
                best[way] = min(best[way], seconds(work))
    rate = {way: ROWS * STEPS / time / 1e3 for way, time in best.items()}
    print(f"{name}: {model.nv} velocities; both motions differ by {apart:.1e} after {STEPS * DT:.1f} s")
    for way, steps in rate.items():
        print(f"  {way:16} {steps:9.1f} thousand steps a second of one thread")
    alone, together = ("MuJoCo one",), ("MuJoCo rollout", "MuJoCo Batch")
    for way, best_of in (("one", alone), ("one, momenta", alone), ("batch", together), ("batch, momenta", together)):
        print(f"  {way}: {rate[way] / max(rate[other] for other in best_of):.1f} times {' or '.join(best_of)}, the better one")
    outputs(model, repeats)
    refine(model, other, q, u)


if __name__ == "__main__":
    rounds = int(sys.argv[1]) if len(sys.argv) > 1 else 10
    for robot in ("ur5.urdf", "g1.urdf"):
        compare(robot, rounds)
    loads(rounds)
