"""A mechanism as Pinocchio sees it, and what it leaves out: mimics, drives, springs, dampers, named wrenches."""

from dataclasses import dataclass, field

import numpy as np
import pinocchio as pin

# Coordinates and velocities of each kind of joint in the layout of the reference data.
SIZES = {
    "pin": (1, 1), "pin_unbounded": (2, 1), "slider": (1, 1), "helical": (1, 1), "cylindrical": (2, 2),
    "universal": (2, 2), "planar": (4, 3), "spherical": (4, 3), "floating": (7, 6),
}


@dataclass
class Joint:
    """A joint of the description; it may be several Pinocchio joints in a row (cylindrical, universal)."""

    name: str
    kind: str
    ident: int  # of the last Pinocchio joint
    iq: int  # first coordinate in the full layout
    iv: int  # first velocity in the full layout
    child: pin.SE3  # child frame of the description in the frame of the last Pinocchio joint
    role: str = "free"  # or prescribed, mimic
    leader: str = ""
    ratio: float = 1.0
    offset: float = 0.0
    damping: np.ndarray | None = None
    stiffness: np.ndarray | None = None
    rest: np.ndarray | None = None

    @property
    def nq(self):
        return SIZES[self.kind][0]

    @property
    def nv(self):
        return SIZES[self.kind][1]

    @property
    def q(self):
        return slice(self.iq, self.iq + self.nq)

    @property
    def v(self):
        return slice(self.iv, self.iv + self.nv)


@dataclass
class System:
    """`model` holds all joints; `joints` in Pinocchio order; `links` maps a name to a Pinocchio frame."""

    file: str
    base: str
    model: pin.Model
    joints: list[Joint]
    links: dict[str, int]
    reported: list[str] = field(default_factory=list)
    wrenches: list[tuple[str, str, str]] = field(default_factory=list)  # name, link, axes
    params: dict[str, float] = field(default_factory=dict)

    def __post_init__(self):
        self.data = self.model.createData()
        self.byname = {joint.name: joint for joint in self.joints}
        for joint in self.joints:
            zero = np.zeros(joint.nv)
            for key in ("damping", "stiffness", "rest"):
                if getattr(joint, key) is None:
                    setattr(joint, key, zero)
        self.free = [j for j in self.joints if j.role == "free"]
        self.drives = [j for j in self.joints if j.role == "prescribed"]
        self.mimics = [j for j in self.joints if j.role == "mimic"]
        self.mass = sum(i.mass for i in self.model.inertias[1:])
        # v = G u, u the velocities of the free and the prescribed joints; constant, as only one-freedom joints mimic
        columns = [j for j in self.joints if j.role != "mimic"]
        self.G = np.zeros((self.model.nv, sum(j.nv for j in columns)))
        self.f, self.d, at, start = [], [], 0, {}
        for joint in columns:
            self.G[joint.v, at : at + joint.nv] = np.eye(joint.nv)
            (self.f if joint.role == "free" else self.d).extend(range(at, at + joint.nv))
            start[joint.name] = at
            at += joint.nv
        for joint in self.mimics:
            leader, ratio, _ = self.root_leader(joint)
            self.G[joint.iv, start[leader.name]] = ratio

    def root_leader(self, joint):
        """The joint at the end of the chain of mimics, with ratio and offset relative to it."""
        ratio, offset = 1.0, 0.0
        while joint.role == "mimic":
            offset += ratio * joint.offset
            ratio *= joint.ratio
            joint = self.byname[joint.leader]
        assert joint.kind in ("pin", "slider", "helical"), "the leader of a mimic has one coordinate"
        return joint, ratio, offset

    def follow(self, q):
        """Fills in the coordinates of the mimics."""
        for joint in self.mimics:
            leader, ratio, offset = self.root_leader(joint)
            q[joint.iq] = ratio * q[leader.iq] + offset
        return q

    def passive(self, q, v):
        """Forces of dampers and springs on all joints, and the energy of the springs."""
        force, energy = np.zeros(self.model.nv), 0.0
        for joint in self.joints:
            force[joint.v] -= joint.damping * v[joint.v]
            if not joint.stiffness.any():
                continue
            x = q[joint.q]
            if joint.kind == "planar":
                x = np.array([x[0], x[1], np.arctan2(x[3], x[2])])
            pull = joint.stiffness * (x - joint.rest)
            energy += 0.5 * float(pull @ (x - joint.rest))
            if joint.kind == "planar":  # the velocities are in the axes of the child, the spring in those of the parent
                c, s = q[joint.iq + 2], q[joint.iq + 3]
                pull = np.array([c * pull[0] + s * pull[1], -s * pull[0] + c * pull[1], pull[2]])
            force[joint.v] -= pull
        return force, energy

    def wrench_scales(self):
        """Sizes of wrenches that move the body they act on by moderate accelerations."""
        carried = [self.model.inertias[self.model.frames[self.links[link]].parentJoint] for _, link, _ in self.wrenches]
        return [inertia.mass * np.array([10, 10, 10, 0.3, 0.3, 0.3]) for inertia in carried]

    def external(self, q, wrenches):
        """External wrenches, summed per Pinocchio joint in its frame."""
        pin.framesForwardKinematics(self.model, self.data, q)
        total = [pin.Force.Zero() for _ in range(self.model.njoints)]
        for (_, link, axes), wrench in zip(self.wrenches, wrenches):
            ident = self.links[link]
            frame = self.model.frames[ident]
            local = pin.Force(wrench[:3], wrench[3:])
            if axes == "world":
                turn = self.data.oMf[ident].rotation.T
                local = pin.Force(turn @ wrench[:3], turn @ wrench[3:])
            total[frame.parentJoint] += frame.placement.act(local)
        return total


def rates(joints, q, v):
    """Time derivatives of the coordinates of `joints`, in the layout of `q`."""
    result = np.zeros_like(q)
    for joint in joints:
        x, u = q[joint.q], v[joint.v]
        if joint.kind == "pin_unbounded":
            out = [-x[1] * u[0], x[0] * u[0]]
        elif joint.kind == "planar":
            c, s = x[2], x[3]
            out = [c * u[0] - s * u[1], s * u[0] + c * u[1], -s * u[2], c * u[2]]
        elif joint.kind == "spherical":
            out = quaternion_rate(x, u)
        elif joint.kind == "floating":
            turn = pin.Quaternion(x[3:]).toRotationMatrix()
            out = np.concatenate([turn @ u[:3], quaternion_rate(x[3:], u[3:])])
        else:
            out = u
        result[joint.q] = out
    return result


def quaternion_rate(q, omega):
    """Half of q times (omega, 0), the scalar last."""
    x, y, z, w = q
    a, b, c = omega
    return 0.5 * np.array(
        [w * a + y * c - z * b, w * b + z * a - x * c, w * c + x * b - y * a, -x * a - y * b - z * c]
    )
