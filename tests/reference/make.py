"""Makes the reference data of this folder with Pinocchio: `python make.py [name ...]`.

README.md says what is in the files.
"""

import json
import pathlib
import sys

import numpy as np
import pinocchio as pin

import toml_model
import urdf_model
from system import System, rates

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parent.parent
STATES = 20
SCRATCH = "tests/reference/robots/"


def systems():
    """Name, loader and arguments of every file."""
    urdf, toml = urdf_model.load, toml_model.load
    return {
        "ur5": (urdf, "models/ur5.urdf", {"wrenches": ["forearm_link", "tool0"]}),
        "panda": (urdf, "models/panda.urdf", {}),
        "iiwa14": (urdf, "models/iiwa14.urdf", {}),
        "solo12": (urdf, "models/solo12.urdf", {"base": "floating", "wrenches": ["FL_FOOT", "HR_FOOT"]}),
        "g1": (urdf, "models/g1.urdf", {"base": "floating", "wrenches": ["left_ankle_roll_link", "right_rubber_hand"]}),
        "romeo": (urdf, SCRATCH + "romeo.urdf", {"base": "floating"}),
        "hyq": (urdf, SCRATCH + "hyq.urdf", {"base": "floating", "wrenches": ["lf_foot", "rh_lowerleg"]}),
        "anymal_c": (urdf, SCRATCH + "anymal_c.urdf", {"base": "floating"}),
        "kinova": (urdf, SCRATCH + "kinova.urdf", {}),
        "ur10": (urdf, SCRATCH + "ur10.urdf", {"base": "planar", "wrenches": ["base_link", "wrist_2_link"]}),
        "baxter": (urdf, SCRATCH + "baxter.urdf", {}),
        "pr2": (urdf, SCRATCH + "pr2.urdf", {"base": "planar"}),
        "double_pendulum": (toml, "models/double_pendulum.toml", {}),
        "chain6": (toml, "models/chain6.toml", {}),
        "chain10_planar": (toml, "models/chain10_planar.toml", {}),
        "spherical_pendulum": (toml, "models/spherical_pendulum.toml", {}),
        "satellite": (toml, "models/satellite.toml", {}),
        "mixed_tree": (toml, "tests/reference/mixed_tree.toml", {}),
        "driven_tree": (
            toml, "tests/reference/driven_tree.toml",
            {"gravity": [0.5, -1.5, -9.2], "params": {"load": 0.65, "reach": 0.22}},
        ),
    }


def configuration(system, rng):
    """Random coordinates: any angle, slides within half a metre, any orientation, origins within a metre."""
    q = np.zeros(system.model.nq)
    for joint in system.joints:
        angle = rng.uniform(-np.pi, np.pi, 2)
        quaternion = rng.normal(size=4)
        quaternion /= np.linalg.norm(quaternion)
        place = rng.uniform(-1, 1, 3)
        q[joint.q] = {
            "pin": angle[:1], "helical": angle[:1], "universal": angle,
            "pin_unbounded": [np.cos(angle[0]), np.sin(angle[0])],
            "slider": place[:1] / 2, "cylindrical": [place[0] / 2, angle[0]],
            "planar": [*place[:2], np.cos(angle[0]), np.sin(angle[0])],
            "spherical": quaternion, "floating": [*place, *quaternion],
        }[joint.kind]
    return system.follow(q)


def symmetric_mass(system, q):
    """M of the full model, rotor inertias included."""
    upper = np.triu(pin.crba(system.model, system.data, q))
    return upper + np.triu(upper, 1).T


def solve(system, q, v, tau, fext, drive):
    """Accelerations of the full model, forces of the drives. `tau` is on the joints, dampers and springs included."""
    model, data, G, f, d = system.model, system.data, system.G, system.f, system.d
    M = symmetric_mass(system, q)
    bias = pin.rnea(model, data, q, v, np.zeros(model.nv), fext).copy()
    u = np.zeros(G.shape[1])
    u[d] = drive
    reduced, rest = G.T @ M @ G, G.T @ (bias - tau)
    u[f] = np.linalg.solve(reduced[np.ix_(f, f)], -(rest[f] + reduced[np.ix_(f, d)] @ u[d]))
    a = G @ u
    if G.shape[0] == len(f):  # every joint free: the articulated-body algorithm, a second way
        dense, a = a, pin.aba(model, data, q, v, tau, fext).copy()
        system.spread = max(system.spread, np.max(np.abs(a - dense)) / np.max(np.abs(a)))
    return M, a, (reduced @ u + rest)[d]


def mass_rate(system, q, v):
    """dM/dt along the motion = C + C^T, with C the Coriolis matrix whose dM/dt - 2 C is skew."""
    C = pin.computeCoriolisMatrix(system.model, system.data, q, v)
    return C + C.T


def check(system, q, v, a, results, power):
    """Momentum rate, coordinate rates and energy against differences along the motion, of fourth order in the step."""
    h = 1e-4
    ends = {}
    for k in (-2, -1, 1, 2):
        t = k * h
        qt = pin.integrate(system.model, q, v * t + a * (t * t / 2))
        vt = v + a * t
        M = symmetric_mass(system, qt)
        energy = 0.5 * vt @ M @ vt + potential_energy(system, qt)
        ends[k] = system.G.T @ M @ vt, qt, energy
    rate = [(8 * (ends[1][i] - ends[-1][i]) - (ends[2][i] - ends[-2][i])) / (12 * h) for i in range(3)]
    p, pd = results
    qd = rates(system.joints, q, v)
    # The points are on the motion only up to the second order, which costs an error of second order in h where turns
    # do not commute; the rest is rounding, some 1e-15 / h of what is differenced.
    errors = [
        np.max(np.abs(rate[0] - pd)) / (np.max(np.abs(pd)) + np.max(np.abs(p))),
        np.max(np.abs(rate[1] - qd)) / (1 + np.max(np.abs(qd))),
        abs(rate[2] - power) / (1 + np.abs(a) @ np.abs(system.G @ p) + abs(ends[1][2])),
    ]
    system.worst = np.maximum(system.worst, errors)
    assert np.all(np.array(errors) < 1e-8), f"{system.file}: rates of momentum, coordinates, energy off by {errors}"


def potential_energy(system, q):
    """Gravity, zero with all mass at the ground's origin, and springs."""
    springs = system.passive(q, np.zeros(system.model.nv))[1]
    return float(pin.computePotentialEnergy(system.model, system.data, q)) + springs


def state(system, rng):
    """One random state and all results on it."""
    model, data, G, f, d = system.model, system.data, system.G, system.f, system.d
    q = configuration(system, rng)
    u = np.round(rng.uniform(-2, 2, G.shape[1]), 6)
    v = G @ u
    size = G.T @ symmetric_mass(system, q) @ G
    tau = np.round(size[np.ix_(f, f)] @ rng.uniform(-10, 10, len(f)), 6)  # asks for moderate accelerations
    drive = np.round(rng.uniform(-3, 3, len(d)), 6)
    wrenches = [np.round(rng.uniform(-1, 1, 6) * scale, 6) for scale in system.wrench_scales()]
    fext = pin.StdVec_Force()
    fext.extend(system.external(q, wrenches))
    passive, _ = system.passive(q, v)
    total = passive.copy()
    full = np.zeros(G.shape[1])
    full[f] = tau
    for joint in system.free:  # the joint forces act on the leaders, not on the mimics
        columns = np.flatnonzero(G[joint.iv])[0] + np.arange(joint.nv)
        total[joint.v] += full[columns]
    M, a, effort = solve(system, q, v, total, fext, drive)
    p_full, pd_full = G.T @ (M @ v), G.T @ (M @ a + mass_rate(system, q, v) @ v)
    potential = potential_energy(system, q)
    pin.forwardKinematics(model, data, q, v)
    springs = system.passive(q, np.zeros_like(v))[0]
    power = v @ (total - springs) + u[d] @ effort + sum(fext[i].dot(data.v[i]) for i in range(1, model.njoints))
    check(system, q, v, a, (p_full, pd_full), power)
    pin.rnea(model, data, q, v, a, fext)
    reaction = [j.child.actInv(data.f[j.ident]).vector for j in system.joints]
    pin.forwardKinematics(model, data, q, v)
    pin.updateFramePlacements(model, data)
    links = []
    for name in system.reported:
        ident = system.links[name]
        place, speed = data.oMf[ident], pin.getFrameVelocity(model, data, ident, pin.ReferenceFrame.LOCAL)
        links.append({"R": place.rotation.flatten(), "r": place.translation.copy(), "v": speed.vector.copy()})
    out = {"q": pick(system.free, q, "q"), "v": u[f], "tau": tau}
    if system.wrenches:
        out["wrenches"] = wrenches
    if system.drives:
        out["drive"] = drives(system, q, v, a)
    reduced = G.T @ M @ G
    reduced = (reduced + reduced.T) / 2
    out |= {
        "force": (G.T @ total)[f], "p": p_full[f], "pd": pd_full[f],
        "qd": pick(system.free, rates(system.joints, q, v), "q"), "qdd": pick(system.free, a, "v"),
        "kinetic": 0.5 * float(v @ M @ v), "potential": potential,
        "M": reduced[np.ix_(f, f)], "links": links, "reaction": reaction,
    }
    if system.drives:
        out["drive_force"] = effort
    system.condition = max(system.condition, np.linalg.cond(out["M"]))
    return out


def pick(joints, x, layout):
    """The entries of `joints`, one after the other."""
    return np.concatenate([x[getattr(joint, layout)] for joint in joints])


def drives(system, q, v, a):
    """Position, rate and acceleration of each prescribed joint."""
    return [{"q": q[j.q], "v": v[j.v], "a": a[j.v]} for j in system.drives]


def table(joints):
    """Joints with their places in the layout of the file."""
    rows, iq, iv = [], 0, 0
    for joint in joints:
        rows.append({"name": joint.name, "kind": joint.kind, "iq": iq, "nq": joint.nq, "iv": iv, "nv": joint.nv})
        iq, iv = iq + joint.nq, iv + joint.nv
    return rows


def plain(x):
    """Numbers for JSON: the shortest text that reads back to the same double (17 digits at most)."""
    if isinstance(x, dict):
        return {k: plain(e) for k, e in x.items()}
    if isinstance(x, (list, tuple, np.ndarray)):
        return [plain(e) for e in x]
    if isinstance(x, (float, np.floating)):
        assert np.isfinite(x)
        return int(x) if x == int(x) and abs(x) < 1e6 else float(x)
    return x


def make(name, loader, file, arguments):
    """One file of reference data."""
    system: System = loader(ROOT, file, **arguments)
    system.spread, system.worst, system.condition = 0.0, np.zeros(3), 0.0
    rng = np.random.default_rng([ord(c) for c in name])
    states = [state(system, rng) for _ in range(STATES)]
    document = {
        "name": name, "file": file, "base": system.base, "pinocchio": pin.__version__,
        "gravity": system.model.gravity.linear, "params": system.params,
        "joints": table(system.free), "drives": table(system.drives),
        "mimics": [{"name": j.name, "leader": j.leader, "ratio": j.ratio, "offset": j.offset} for j in system.mimics],
        "wrenches": [{"name": n, "link": link, "axes": axes} for n, link, axes in system.wrenches],
        "links": system.reported, "reactions": [joint.name for joint in system.joints],
        "condition": system.condition, "qdd_spread": system.spread, "states": states,
    }
    text = json.dumps(plain(document), separators=(",", ":"), allow_nan=False)
    (HERE / f"{name}.json").write_text(text + "\n")
    nq, nv = sum(j.nq for j in system.free), len(system.f)
    print(
        f"{name:20} nq {nq:3} nv {nv:3} mass {system.mass:8.3f} cond(M) {system.condition:.1e} "
        f"aba-dense {system.spread:.1e} differences {system.worst} {len(text):8} bytes"
    )


def main():
    """Command line."""
    np.set_printoptions(precision=1)
    known = systems()
    for name in sys.argv[1:] or known:
        loader, file, arguments = known[name]
        make(name, loader, file, arguments)


if __name__ == "__main__":
    main()
