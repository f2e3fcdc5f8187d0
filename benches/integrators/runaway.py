"""The mechanism of google-deepmind/mujoco issue 2896 in MuJoCo: `python runaway.py [MBD]`.

Prints one JSON line for each method and step: when MuJoCo finds a number that is none or huge, and the greatest energy until
then (the motion has no friction, so it should stay 196.2 J). With MBD, the project's program, it first compares
accelerations of `models/mujoco2896.toml` with MuJoCo's, so that both are of the same mechanism.
"""

import json
import math
import pathlib
import subprocess
import sys

import mujoco
import numpy as np

MODEL = pathlib.Path(__file__).resolve().parent.parent.parent / "models" / "mujoco2896.toml"
# Made from the description: two boxes of 2 kg, on a hinge at the ground and on a ball joint at the first one's end.
MJCF = """
<mujoco>
  <compiler angle="radian"/>
  <option timestep="{step}" integrator="{method}"/>
  <worldbody>
    <body pos="1 0 5">
      <joint type="hinge" axis="0 1 0" pos="-1 0 0"/>
      <geom type="box" size="1 0.1 0.1" mass="2"/>
      <body pos="1 1 0" euler="0 0 1.57">
        <joint type="ball" pos="-1 0 0"/>
        <geom type="box" size="1 0.1 0.1" mass="2"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"""
LIMIT = 300.0  # s


def system(method, step):
    model = mujoco.MjModel.from_xml_string(MJCF.format(step=step, method=method))
    # Otherwise MuJoCo starts anew, silently but for a warning in a file.
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
    model.opt.enableflags |= mujoco.mjtEnableBit.mjENBL_ENERGY
    return model, mujoco.MjData(model)


def run(method, step):
    model, data = system(method, step)
    mujoco.mj_forward(model, data)
    begin = greatest = data.energy.sum()
    bad = [mujoco.mjtWarning.mjWARN_BADQPOS, mujoco.mjtWarning.mjWARN_BADQVEL, mujoco.mjtWarning.mjWARN_BADQACC]
    while data.time < LIMIT:
        before = data.time
        mujoco.mj_step(model, data)
        if any(data.warning[k].number for k in bad):
            return {"bad_at": round(before, 9), "energy": begin, "greatest_energy": greatest}
        greatest = max(greatest, data.energy.sum())
    return {"bad_at": None, "energy": begin, "greatest_energy": greatest}


def compare(mbd):
    """Largest difference of accelerations from the project's, relative to the largest of its state."""
    random = np.random.default_rng(1)
    model, data = system("Euler", 0.01)
    states, wanted = [], []
    for _ in range(50):
        quaternion = random.normal(size=4)
        q = [random.uniform(-math.pi, math.pi), *(quaternion / np.linalg.norm(quaternion))]
        v = random.uniform(-5, 5, 4)
        data.qpos[:], data.qvel[:] = q, v
        mujoco.mj_forward(model, data)
        states.append({"q": [float(x) for x in q], "v": [float(x) for x in v]})
        wanted.append(data.qacc.copy())
    command = [mbd, "eval", "--layout", "mujoco", "--outputs", "qdd", "--input", "-", str(MODEL)]
    answer = json.loads(subprocess.run(command, input=json.dumps({"states": states}), text=True, capture_output=True, check=True).stdout)
    got = [np.array(s["qdd"]) for s in answer["states"]]
    return max(float(np.abs(g - w).max() / np.abs(w).max()) for g, w in zip(got, wanted))


def main():
    if len(sys.argv) > 1:
        off = compare(sys.argv[1])
        print(f"accelerations of {MODEL.name} and MuJoCo differ by {off:.1e}", file=sys.stderr)
        if off > 1e-12:
            sys.exit("not the same mechanism")
    for method in ["Euler", "implicitfast", "implicit", "RK4"]:
        for step in [0.02, 0.01, 0.005]:
            line = {"tool": "mujoco", "version": mujoco.__version__, "scene": "mujoco2896", "method": method.lower(), "setting": f"h={step:g}"}
            print(json.dumps({**line, **run(method, step)}), flush=True)


if __name__ == "__main__":
    main()
