"""The problems of the comparison: `python scenes.py WORK`.

Writes for each what Pinocchio is built from (`NAME.model`, as in benches/rivals) and the problem (`NAME.problem`, plain numbers:
nodes, length of a step in s, sizes of the state and the input; then rows: start, goal, running weights and final weights of
`(q, v)`, weights of the inputs, their least and greatest, the first guess, and the joints that are driven).
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
import toml_model  # noqa: E402
import urdf_model  # noqa: E402


def acrobot(_):
    return {
        "nodes": 201,
        "length": 0.025,
        "start": [0.0] * 4,
        "goal": [math.pi, 0.0, 0.0, 0.0],
        "running": [1.0, 1.0, 0.1, 0.1],
        "end": [1000.0, 1000.0, 200.0, 200.0],
        "effort": [0.01],
        "most": [10.0],
        # Hanging down is at rest: without a push it stays so.
        "guess": [0.5],
        "driven": [1],
    }


def ur5(model):
    q = np.array([0.0, -1.5, 0.8, 0.0, 0.0, 0.0])
    return {
        "nodes": 101,
        "length": 0.01,
        "start": [*q, *[0.0] * 6],
        "goal": [1.0, -0.9, 1.2, -0.4, 0.6, 0.3, *[0.0] * 6],
        "running": [100.0] * 6 + [0.1] * 6,
        "end": [1000.0] * 6 + [100.0] * 6,
        "effort": [1e-4] * 6,
        "most": [150.0, 150.0, 150.0, 28.0, 28.0, 28.0],
        # Holds the arm against gravity.
        "guess": pin.computeGeneralizedGravity(model, model.createData(), q),
        "driven": range(6),
    }


SCENES = {
    "acrobot": (lambda: toml_model.load(ROOT / "models", "double_pendulum.toml").model, acrobot),
    "ur5": (lambda: urdf_model.load(ROOT, "models/ur5.urdf").model, ur5),
}


def main(folder):
    folder.mkdir(parents=True, exist_ok=True)
    for name, (load, problem) in SCENES.items():
        model = load()
        (folder / f"{name}.model").write_text(models.flat(name, model))
        p = problem(model)
        rows = [f"{p['nodes']} {p['length']!r} {len(p['start'])} {len(p['effort'])}"]
        rows += [models.numbers(p[key]) for key in ("start", "goal", "running", "end", "effort")]
        rows += [models.numbers([-x for x in p["most"]]), models.numbers(p["most"]), models.numbers(p["guess"])]
        rows.append(" ".join(str(j) for j in p["driven"]))
        (folder / f"{name}.problem").write_text("\n".join(rows) + "\n")


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]).resolve())
