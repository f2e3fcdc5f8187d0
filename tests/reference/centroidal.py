"""Makes `centroidal.json` with Pinocchio, out of the states of the other files of this folder: `python centroidal.py`.

Centre of mass, centroidal momentum matrix of the free velocities, and the rate of the momentum at zero accelerations of the
free joints: what `computeCentroidalMapTimeVariation` gives, with mimic joints gathered and prescribed accelerations added.
"""

import json

import numpy as np
import pinocchio as pin

from make import HERE, ROOT, plain, systems

STATES = 3
NAMES = ["ur5", "panda", "solo12", "g1", "anymal_c", "baxter", "pr2", "spherical_pendulum", "satellite", "mixed_tree", "driven_tree"]


def full(system, state):
    """Coordinates, velocities of the free and the prescribed joints, accelerations of the prescribed ones alone."""
    q, u, a = np.zeros(system.model.nq), np.zeros(system.G.shape[1]), np.zeros(system.G.shape[1])
    at = 0
    for joint in system.free:
        q[joint.q] = state["q"][at : at + joint.nq]
        at += joint.nq
    u[system.f] = state["v"]
    at = 0
    for joint, drive in zip(system.drives, state.get("drive", [])):
        q[joint.q] = drive["q"]
        u[system.d[at : at + joint.nv]], a[system.d[at : at + joint.nv]] = drive["v"], drive["a"]
        at += joint.nv
    return system.follow(q), u, a


def centroidal(system, state):
    model, data, G = system.model, system.data, system.G
    q, u, a = full(system, state)
    v = G @ u
    change = pin.computeCentroidalMapTimeVariation(model, data, q, v).copy() @ v
    matrix = data.Ag @ G
    pin.centerOfMass(model, data, q)
    return {"center": data.com[0].copy(), "matrix": matrix[:, system.f], "bias": change + matrix @ a}


def main():
    document = {"pinocchio": pin.__version__, "systems": {}}
    for name in NAMES:
        loader, file, arguments = systems()[name]
        states = json.loads((HERE / f"{name}.json").read_text())["states"][:STATES]
        system = loader(ROOT, file, **arguments)
        document["systems"][name] = [centroidal(system, state) for state in states]
    rows = ",\n".join(f"  {json.dumps(name)}: {json.dumps(plain(x))}" for name, x in document["systems"].items())
    text = f'{{\n"pinocchio": {json.dumps(document["pinocchio"])},\n"systems": {{\n{rows}\n}}\n}}\n'
    (HERE / "centroidal.json").write_text(text)


if __name__ == "__main__":
    main()
