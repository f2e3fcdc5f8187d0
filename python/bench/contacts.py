"""Rollouts of many starts with contacts: end state's error against time, of this package and MuJoCo, on one thread in one run.

usage: contacts.py [ROUNDS [SCENE ...]]

Quadrupeds are dropped from random poses, without motors (`dropped`) or with springs in their joints, on which they come to stand
(`standing`). Both programs have the numbers of one TOML model (`benches/contacts/mjcf.py`); masses, energies and a flight
without contacts are compared before anything is timed. The error of a row is that of `benches/contacts`: the largest distance, over
all bodies, between where their origins and centres of mass end and where they should, by this package's motion from event to
event at a tolerance of 1e-12. Rows without such a motion are left out. What counts is the median of the others. Settings with
which more than one row in twenty fails are shown, and have no part in the comparison. MuJoCo has the settings of
`benches/contacts`, and the same with its own tolerance and number of iterations.

Times are those of the processor, the least of some rounds; machine code is made in the first round, which does not count. The end
of every row is all that is kept.
"""

import pathlib
import sys
import tempfile

import mujoco
import mujoco.batch
import numpy as np

import multibody
from rollouts import seconds

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "benches" / "contacts"))
import compare  # noqa: E402
import mjcf  # noqa: E402

ROWS = 32
# Model, and simulated time, s.
SCENES = {"dropped": ("quadruped", 0.3), "standing": ("quadruped_hop", 1.0)}
# Time steps, s, of both programs.
STEPS = [3.2e-2, 2.26e-2, 1.6e-2, 1.13e-2, 8e-3, 5.7e-3, 4e-3, 2.8e-3, 2e-3, 1.4e-3, 1e-3, 5e-4]
TOLERANCES = [1e-4]
REFERENCE = 1e-12
# Errors, m, at which both programs are compared.
ERRORS = [1e-1, 8e-2, 6e-2, 3e-2, 1e-2, 3e-3, 1e-3, 1e-4]
# How far the lowest foot is from the ground at the start, m; how far the trunk leans, rad; how far joints are turned, rad;
# velocities, m/s and rad/s.
HEIGHT, LEAN, TURN, SPEED = (0.02, 0.1), 0.3, 0.2, 0.3


class Scene:
    """A model of both programs, and starts."""

    def __init__(self, name, work):
        file, self.end = SCENES[name]
        self.name = name
        text = (compare.MODELS / f"{file}.toml").read_text()
        path, free = work / f"{name}.toml", work / f"{name}_free.toml"
        path.write_text(text)
        free.write_text(compare.without_contacts(text))
        self.model, self.free = multibody.load(path), multibody.load(free)
        self.mjcf, self.mjcf_free = mjcf.Scene(path), mjcf.Scene(free)
        self.starts()

    def starts(self):
        """Random coordinates and velocities of ROWS quadrupeds, in MuJoCo's layout, from the model's own start."""
        random = np.random.default_rng(0)
        other, spread = self.compiled(compare.mujoco_settings(self.name, 1e-3)["default"], 1e-3), random.uniform
        data = mujoco.MjData(other)
        self.q, self.v = np.empty((ROWS, other.nq)), spread(-SPEED, SPEED, (ROWS, other.nv))
        feet = [k for k in range(other.ngeom) if other.geom(k).name.startswith("foot")]
        for q in self.q:
            q[:] = self.mjcf.qpos
            q[3:7] = mjcf.quaternion([*spread(-LEAN, LEAN, 2), spread(-np.pi, np.pi)])
            q[7:] += spread(-TURN, TURN, len(q) - 7)
            data.qpos[:] = q
            mujoco.mj_kinematics(other, data)
            q[2] += spread(*HEIGHT) - min(data.geom_xpos[k, 2] - other.geom_size[k, 0] for k in feet)

    def compiled(self, setting, step, free=False):
        """MuJoCo's model."""
        scene = self.mjcf_free if free else self.mjcf
        return mujoco.MjModel.from_xml_string(scene.mjcf(setting | {"option": setting["option"] | {"timestep": step}}))

    def places(self, states):
        """Origins and centres of mass of all bodies for coordinates in MuJoCo's layout."""
        other = self.compiled(compare.mujoco_settings(self.name, 1e-3)["default"], 1e-3)
        data, found = mujoco.MjData(other), []
        bodies = [other.body(name).id for name in self.mjcf.order()]
        for q in states:
            data.qpos[:] = q
            mujoco.mj_kinematics(other, data)
            mujoco.mj_comPos(other, data)
            found.append(np.concatenate([data.xpos[bodies], data.xipos[bodies]]))
        return np.array(found)

    def own(self, other):
        """The starts in this package's layout."""
        joints = [other.joint(name) for name in self.free.velocity_names[6:]]
        turn = self.q[:, 3:7] * [1, -1, -1, -1]
        linear = [mjcf.turned(list(a), list(v)) for a, v in zip(turn, self.v[:, :3])]
        q = np.hstack([self.q[:, :3], self.q[:, 4:7], self.q[:, 3:4], self.q[:, [j.qposadr[0] for j in joints]]])
        return q, np.hstack([linear, self.v[:, 3:6], self.v[:, [j.dofadr[0] for j in joints]]])

    def ours(self, model, **how):
        """Coordinates at the end, in MuJoCo's layout, and rows that failed."""
        motion = model.rollout((self.q, self.v), layout="mujoco", threads=1, on_error="mark", **how)
        return motion.q[:, -1], len(motion.failures)

    def check(self):
        """Stops where the models differ."""
        setting = {"option": {"integrator": "RK4"}, "solref": "0.02 1", "solimp": "0.9 0.95 0.001 0.5 2", "limits": "0.02 1"}
        other = self.compiled(setting, 1e-4, free=True)
        steps = round(compare.FREE / 1e-4)
        batch = mujoco.batch.Batch(other, ROWS, nthread=1)
        batch.bind("qpos")[:], batch.bind("qvel")[:] = self.q, self.v
        theirs = batch.rollout(steps, record=("qpos",))["qpos"][:, -1]
        mine, _ = self.ours(self.free, dt=compare.FREE, steps=1, tolerance=1e-12)
        apart = {"flight, m": abs(self.places(mine) - self.places(theirs)).max()}
        data, energies = mujoco.MjData(other), []
        other.opt.enableflags |= int(mujoco.mjtEnableBit.mjENBL_ENERGY)
        for q, v in zip(self.q, self.v):
            data.qpos[:], data.qvel[:] = q, v
            mujoco.mj_forward(other, data)
            energies.append(data.energy.copy())
        q, v = self.own(other)
        mine = self.free.energy(q, self.free.momenta(q, v))
        # Potential energies are compared by their differences.
        kinetic, potential = np.transpose(mine) - np.transpose(energies)[::-1]
        apart["energies, J"] = max(abs(kinetic).max(), np.ptp(potential))
        apart["mass, kg"] = abs(sum(b["mass"] for b in self.mjcf.model["body"]) - other.body_mass.sum())
        for what, value in apart.items():
            print(f"{self.name}: {what}: MuJoCo {value:.1e} from ours", flush=True)
            if not value < compare.BOUND:
                sys.exit(f"{self.name}: the models differ")


def least(work, rounds):
    """The least time of some rounds after one that is not timed, s, and the last result."""
    work()
    times = []
    for _ in range(rounds):
        result = []
        times.append(seconds(lambda: result.append(work())))
        if sum(times) > compare.PATIENCE:
            break
    return min(times), result[0]


def errors(scene, wanted, states):
    """Of all rows, m; infinite where one diverged."""
    states = np.asarray(states)
    sound = np.isfinite(states).all(axis=1)
    apart = np.full(len(states), np.inf)
    if not sound.any():
        return apart
    apart[sound] = np.linalg.norm(scene.places(states[sound]) - wanted[sound], axis=2).max(axis=1)
    return apart


def our_runs(scene):
    """Settings and what computes the coordinates at the end."""
    whole = {"dt": scene.end, "steps": 1}
    for regime in ("events", "automatic"):
        for tolerance in TOLERANCES:
            how = whole | {"tolerance": tolerance, "contacts": regime}
            yield f"{regime}, tolerance {tolerance:g}", lambda: scene.ours(scene.model, **how)
    for step in STEPS:
        count = int(np.ceil(scene.end / step - 1e-9))
        parts = {"dt": scene.end / count, "steps": count, "every": count}
        yield f"steps of {1e3 * step:g} ms", lambda: scene.ours(scene.model, contacts="steps", **parts)


def their_runs(scene):
    for setting in compare.mujoco_settings(scene.name, STEPS[0]):
        for effort, words in (({}, ""), ({"tolerance": 1e-8, "iterations": 100}, ", its own effort")):
            for step in STEPS:
                count = int(np.ceil(scene.end / step - 1e-9))
                how = compare.mujoco_settings(scene.name, scene.end / count)[setting]
                other = scene.compiled(how | {"option": how["option"] | effort}, scene.end / count)
                batch = mujoco.batch.Batch(other, ROWS, nthread=1)
                qpos, qvel = batch.bind("qpos"), batch.bind("qvel")

                def work():
                    batch.reset()
                    qpos[:], qvel[:] = scene.q, scene.v
                    batch.rollout(count, record=())
                    return qpos.copy(), 0

                yield f"{setting}{words}, {1e3 * step:g} ms", work


def times(name, rounds):
    with tempfile.TemporaryDirectory() as work:
        scene = Scene(name, pathlib.Path(work))
        scene.check()
    states, failed = scene.ours(scene.model, dt=scene.end, steps=1, tolerance=REFERENCE, contacts="events")
    wanted = scene.places(np.nan_to_num(states))
    known = np.isfinite(states).all(axis=1)
    print(f"{name}: {ROWS} rows of {scene.end:g} s, without {failed} whose reference fails", flush=True)
    found = {}
    for program, runs in (("multibody", our_runs(scene)), ("MuJoCo", their_runs(scene))):
        found[program] = []
        for setting, work in runs:
            taken, (states, failures) = least(work, rounds)
            off = errors(scene, wanted, states)[known]
            middle, most = (np.quantile(off, part, method="higher") for part in (0.5, 0.9))
            if failures <= ROWS / 20:
                found[program].append((setting, middle, taken))
            words = f"; {failures} rows failed" if failures else ""
            print(
                f"  {program:9} {setting:40} {1e3 * taken / ROWS / scene.end:8.3f} ms for 1 s, "
                f"error {middle:.1e} m, of 9 in 10 rows {most:.1e}{words}",
                flush=True,
            )
    floor = min(run[1] for run in found["MuJoCo"])
    for error in [*(e for e in ERRORS if e > floor), floor]:
        ours, theirs = (min((r for r in found[p] if r[1] <= error), key=lambda r: r[2], default=None) for p in found)
        if ours and theirs:
            ratio = theirs[2] / ours[2]
            print(f"  to {error:.1e} m: {ratio:.2f} times MuJoCo: {ours[0]} against {theirs[0]}")
        else:
            print(f"  to {error:.1e} m: {'MuJoCo' if ours is None else 'this package'} alone")


if __name__ == "__main__":
    rounds, *names = sys.argv[1:] or ["3"]
    for name in names or SCENES:
        times(name, int(rounds))
