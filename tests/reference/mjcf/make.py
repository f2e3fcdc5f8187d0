"""Makes the reference data of MuJoCo for the reader of MJCF: `python make.py`, with the packages of requirements.txt.

Copies the model files out of the packages `gymnasium` and `dm-control`, with the files that they include, and writes
`data.json`, which README.md describes. The tests read these files; they need neither Python nor MuJoCo.
"""

import importlib.util
import json
import pathlib
import re
import shutil

import mujoco
import numpy as np

HERE = pathlib.Path(__file__).resolve().parent

# Files with freedoms that need no mesh, by the folder of their package.
FILES = {
    "gymnasium/envs/mujoco/assets": """ant half_cheetah hopper humanoid humanoidstandup inverted_double_pendulum
        inverted_pendulum point pusher pusher_v5 reacher swimmer walker2d walker2d_v5""",
    "dm_control/suite": """acrobot ball_in_cup cartpole cheetah finger fish hopper humanoid humanoid_CMU manipulator
        pendulum point_mass quadruped reacher stacker swimmer walker""",
    "dm_control/locomotion/soccer/assets/boxhead": "boxhead",
    "dm_control/locomotion/walkers/assets": "humanoid_CMU_V2019 humanoid_CMU_V2020 rodent",
    "dm_control/locomotion/walkers/assets/jumping_ball": "jumping_ball_with_head",
    "dm_control/mjcf/test_assets": "robot_arm",
    "dm_control/mujoco/testing/assets": """arm cartpole cartpole_no_names humanoid model_with_ball_joints
        model_with_third_order_actuators""",
    "dm_control/third_party/ant": "ant",
}
STATES = 3


def copy(source, target):
    """Copies a model file and what it includes."""
    target.parent.mkdir(parents=True, exist_ok=True)
    shutil.copyfile(source, target)
    for name in re.findall(r'<include\s+file="([^"]+)"', source.read_text()):
        copy(source.parent / name, target.parent / name)


def moves(model, body):
    """Whether a joint moves a body; the user may move those with `mocap`, which are still here."""
    return body > 0 and (model.body_dofnum[body] > 0 or moves(model, model.body_parentid[body]))


def state(model, data, rng, with_matrix):
    """One random state and what MuJoCo computes for it."""
    q, v = model.qpos0.copy(), rng.normal(size=model.nv)
    # Quaternions turn with the displacement, too.
    mujoco.mj_integratePos(model, q, rng.normal(size=model.nv), 1.0)
    data.qpos[:], data.qvel[:] = q, v
    mujoco.mj_forward(model, data)
    matrix = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, matrix)
    # Bodies that nothing moves have a constant potential energy, which does not count here.
    still = [b for b in range(1, model.nbody) if not moves(model, b)]
    constant = sum(-model.body_mass[b] * model.opt.gravity @ data.xipos[b] for b in still)
    out = {
        "q": q, "v": v, "p": matrix @ v, "bias": data.qfrc_bias, "passive": data.qfrc_passive,
        "potential": [data.energy[0] - constant], "kinetic": [data.energy[1]],
    }
    if with_matrix:
        out["M"] = matrix.ravel()
    return {key: [float(x) + 0.0 for x in value] for key, value in out.items()}


def main():
    site = pathlib.Path(importlib.util.find_spec("gymnasium").origin).parent.parent
    models = []
    for folder, names in FILES.items():
        for name in names.split():
            file = f"{folder}/{name}.xml"
            copy(site / file, HERE / file)
            model = mujoco.MjModel.from_xml_path(str(site / file))
            # The fluid around a mechanism is no part of the model here, and no contact or limit acts.
            model.opt.density = model.opt.viscosity = 0
            model.opt.enableflags |= mujoco.mjtEnableBit.mjENBL_ENERGY
            data = mujoco.MjData(model)
            rng = np.random.default_rng(len(models))
            states = [state(model, data, rng, k == 0) for k in range(STATES)]
            moving = float(sum(model.body_mass[b] for b in range(model.nbody) if moves(model, b)))
            models.append({"file": file, "nq": model.nq, "nv": model.nv, "mass": moving, "states": states})
            print(file, model.nq, model.nv)
    text = ",\n".join(json.dumps(entry, separators=(",", ":")) for entry in models)
    (HERE / "data.json").write_text(f'{{"mujoco":"{mujoco.__version__}","models":[\n{text}\n]}}\n')


if __name__ == "__main__":
    main()
