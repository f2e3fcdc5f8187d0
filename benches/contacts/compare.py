"""Error of the end state against run time: motions with contacts by this project, MuJoCo and Drake, in one run.

usage: compare.py OURS WORK [SCENE ...]

OURS is the executable of `ours/`, WORK a folder for models and results. Each scene is one TOML model of this project;
`mjcf.py` writes the same numbers for MuJoCo, `drake_scene.py` builds them in Drake, and before anything is timed, both are
compared with ours in a motion without contacts. The error is the largest distance, over all bodies, between where their
origins and centres of mass end and where they should: by analysis where the answer is known, else by this project's run at
its tightest tolerance. All run in one thread, and times are the least of several rounds within the process that runs them.
"""

import json
import math
import pathlib
import subprocess
import sys
import time

import mujoco
import numpy as np

import mjcf
import report

try:
    import drake_scene
except ImportError as missing:
    drake_scene = None
    print(f"Drake is left out: {missing}", file=sys.stderr)

MODELS = pathlib.Path(__file__).resolve().parents[2] / "models" / "contacts"
TOLERANCES = ["1e-3", "1e-4", "1e-5", "1e-6", "1e-7", "1e-8", "1e-9", "1e-10", "1e-11", "1e-12", "1e-13"]
STEPS = [2e-2, 1e-2, 4e-3, 2e-3, 1e-3, 5e-4, 2e-4, 1e-4, 5e-5, 2e-5, 1e-5]
ROUNDS = 3
# A run of a rival that takes longer than this is its last one with these settings, s.
PATIENCE = 3.0
# Seconds after which Drake is stopped: some of its integrators do not come back.
LIMIT = 15.0
# Without contacts, all programs are exact to rounding and to what their integrators leave over in this time, s: far below this
# bound, m or J. A wrong number of a model is far above. MuJoCo's least moments of inertia are within it.
FREE, BOUND = 0.3, 1e-8
# Of the ball, m/s², m, and of its restitution.
GRAVITY, HEIGHT, RESTITUTION = 9.81, 1.0, 0.8


def block():
    """Slides 2 m/s down an incline of 30 degrees and stops."""
    text = (MODELS / "block_on_incline.toml").read_text()
    text = text.replace("start = [0, 0, 0.05, 0, 0, 0, 1]", "start = [0, 0, 0.05, 0, 0, 0, 1]\nstart_velocity = [-2, 0, 0, 0, 0, 0]")
    slope = math.radians(30)
    way = 4 / (2 * 9.81 * (0.8 * math.cos(slope) - math.sin(slope)))
    at = [-way * math.cos(slope) - 0.05 * math.sin(slope), 0, -way * math.sin(slope) + 0.05 * math.cos(slope)]
    return text, 4.0, [at, at]


def ball():
    """Falls 1 m and bounces three times with a restitution of 0.8."""
    text = (MODELS / "bouncing_ball.toml").read_text()
    end, g, e = 2.0, GRAVITY, RESTITUTION
    t, v = math.sqrt(2 * HEIGHT / g), e * math.sqrt(2 * HEIGHT * g)
    while t + 2 * v / g < end:
        t, v = t + 2 * v / g, e * v
    at = [0, 0, 0.05 + v * (end - t) - 0.5 * g * (end - t) ** 2]
    return text, end, [at, at]


def plain(name, end):
    return lambda: ((MODELS / f"{name}.toml").read_text(), end, None)


SCENES = {
    "block": ("block stops on an incline", block),
    "ball": ("ball bounces three times", ball),
    "walker": ("compass gait, two steps", plain("compass_gait", 2.0)),
    "dropped": ("quadruped dropped", plain("quadruped", 0.3)),
    "standing": ("quadruped hops and stands", plain("quadruped_hop", 2.0)),
}


def damping_ratio(e):
    """Of a spring that only pushes and gives back the part `e` of the speed, by bisection."""

    def kept(z):
        root = math.sqrt(1 - z * z)
        return math.exp(-2 * z / root * math.atan2(root, z))

    low, high = 0.0, 0.999
    for _ in range(60):
        z = 0.5 * (low + high)
        low, high = (z, high) if kept(z) > e else (low, z)
    return low


def mujoco_settings(scene, step):
    """Settings by name: MuJoCo's defaults, and what makes its contacts harder."""
    default, hard = "0.9 0.95 0.001 0.5 2", "0.99 0.9999 0.0001 0.5 2"

    def one(integrator, solref, solimp, **more):
        # Its own tolerance and limit of iterations with its own impedances.
        exact = {} if solimp == default else {"tolerance": 1e-12, "iterations": 200}
        option = {"timestep": step, "integrator": integrator, "cone": "elliptic"} | exact
        return {"option": option | more, "solref": solref, "solimp": solimp, "limits": solref if solref[0] != "-" else "0.02 1"}

    if scene == "ball":
        z = damping_ratio(RESTITUTION)
        bounce = {}
        for steps in (10, 40):
            frequency = math.pi / (steps * step)
            # Stiffness and damping without the weight of the body, which an impedance of nearly 1 gives.
            solref = f"{-frequency * frequency!r} {-2 * z * frequency!r}"
            for integrator in ("implicitfast", "RK4"):
                bounce[f"spring, bounce of {steps} steps, {integrator}"] = one(integrator, solref, "0.9999 0.9999 0.001 0.5 2")
        return bounce
    stiff = f"{2 * step!r} 1"
    return {
        "default": one("implicitfast", "0.02 1", default),
        "impratio 100": one("implicitfast", "0.02 1", default, impratio=100),
        "hard": one("implicitfast", stiff, hard, impratio=100),
        "hard, no slip": one("implicitfast", stiff, hard, impratio=100, noslip_iterations=20, noslip_tolerance=1e-12),
        "stiff": one("implicitfast", stiff, default, impratio=100),
        "hard, RK4": one("RK4", stiff, hard, impratio=100),
    }


def error(places, wanted):
    if not np.all(np.isfinite(places)):
        return math.inf
    return float(np.max(np.linalg.norm(np.asarray(places) - np.asarray(wanted), axis=1)))


def mujoco_run(scene, setting, end):
    """Seconds, and places of the bodies in the order of the file."""
    model = mujoco.MjModel.from_xml_string(scene.mjcf(setting))
    data = mujoco.MjData(model)
    count = round(end / setting["option"]["timestep"])
    least = math.inf
    for _ in range(ROUNDS):
        mujoco.mj_resetData(model, data)
        data.qpos[:], data.qvel[:] = scene.qpos, scene.qvel
        mujoco.mj_forward(model, data)
        clock = time.perf_counter()
        mujoco.mj_step(model, data, nstep=count)
        least = min(least, time.perf_counter() - clock)
        if least > PATIENCE / ROUNDS:
            break
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    places = []
    for name in scene.order():
        places += [data.body(name).xpos.copy(), data.body(name).xipos.copy()]
    return least, places


def without_contacts(text):
    """The model without contacts and limits of joints."""
    kept, skip = [], False
    for line in text.splitlines():
        if line.startswith("["):
            skip = line.startswith("[[contact]]")
        if not skip and not line.startswith("limits"):
            kept.append(line)
    return "\n".join(kept)


def our_runs(ours, path, end, rounds, ways):
    """Mass and energies at the start, and the runs by tolerances or time steps."""
    command = [ours, str(path), repr(end), str(rounds), *ways]
    lines = subprocess.run(command, check=True, capture_output=True, text=True).stdout.splitlines()
    start, *runs = [json.loads(line) for line in lines]
    return start, runs


def check(name, text, ours, work, scene, first):
    """Stops where a rival's model is not ours."""
    path = work / f"{name}_free.toml"
    path.write_text(without_contacts(text))
    start, (run,) = our_runs(ours, path, FREE, 1, ["1e-12"])
    free = mjcf.Scene(path)
    exact = {"option": {"timestep": 1e-4, "integrator": "RK4"}, "solref": "0.02 1", "solimp": "0.9 0.95 0.001 0.5 2", "limits": "0.02 1"}
    apart = {"MuJoCo, motion without contacts": error(mujoco_run(free, exact, FREE)[1], run["places"])}
    if drake_scene:
        found = drake_scene.check(scene, free, start, first, FREE, run["places"])
        apart |= {f"Drake, {what}": value for what, value in found.items()}
    for what, value in apart.items():
        print(f"{name}: {what}: {value:.1e} from ours", flush=True)
        if not value < BOUND:
            sys.exit(f"{name}: the models differ")


def series(run, settings):
    """Runs of settings by name; one that takes too long is the last of its setting."""
    runs = []
    for setting, (knob, values) in settings.items():
        for value, how in values.items():
            answer = run(how)
            if answer is not None:
                seconds, off = answer
                runs.append({"setting": setting, knob: value, "seconds": seconds, "error": off})
            if answer is None or seconds > PATIENCE:
                break
    return runs


def compare(name, ours, work):
    title, make = SCENES[name]
    text, end, known = make()
    path = work / f"{name}.toml"
    path.write_text(text)
    # All tolerances twice: in the first pass, machine code is made for the modes in which the motion stays.
    steps = [f"steps:{step!r}" for step in STEPS]
    _, runs = our_runs(ours, path, end, ROUNDS, TOLERANCES * 2 + steps)
    runs = runs[len(TOLERANCES) :]
    by_events, by_steps = runs[: len(TOLERANCES)], runs[len(TOLERANCES) :]
    wanted = known or by_events[-1]["places"]

    def mine_of(run):
        kind, _, length = run["way"].rpartition(":")
        how = {"setting": "time steps", "step": float(length)} if kind else {"setting": "by events", "tolerance": float(length)}
        return how | {"seconds": run["seconds"], "error": error(run["places"], wanted)}

    mine = [mine_of(run) for run in (by_events if known else by_events[:-1]) + by_steps]
    scene = mjcf.Scene(path)
    check(name, text, ours, work, scene, by_events[-1]["events"][0])

    def measured(answer):
        return answer and (answer[0], error(answer[1], wanted))

    by_step = {step: mujoco_settings(name, step) for step in STEPS}
    settings = {s: ("step", {step: by_step[step][s] for step in STEPS}) for s in by_step[STEPS[0]]}
    rivals = {"MuJoCo": series(lambda how: measured(mujoco_run(scene, how, end)), settings)}
    if drake_scene:
        speed = math.sqrt(2 * GRAVITY * HEIGHT)
        ball = RESTITUTION, damping_ratio(RESTITUTION), scene.model["body"][0]["mass"], speed
        settings = drake_scene.settings(name, STEPS, ball)
        rivals["Drake"] = series(lambda how: measured(drake_scene.run(scene, how, end, ROUNDS, PATIENCE, LIMIT)), settings)
    return {"name": name, "title": title, "end": end, "known": known is not None, "ours": mine, "rivals": rivals}


def main():
    ours, work, *names = sys.argv[1:]
    work = pathlib.Path(work)
    work.mkdir(parents=True, exist_ok=True)
    results = []
    for name in names or SCENES:
        results.append(compare(name, ours, work))
        print(f"{name}: done", flush=True)
    versions = {"MuJoCo": mujoco.__version__} | ({"Drake": drake_scene.VERSION} if drake_scene else {})
    result = {"versions": versions, "limit": LIMIT, "scenes": results}
    (work / "result.json").write_text(json.dumps(result, indent=1) + "\n")
    report.write(result, work)


if __name__ == "__main__":
    main()
