"""Writes a model of this project as MJCF: the numbers of both are those of one file.

Bodies, joints, springs, dampers, limits, points, spheres, boxes and planes are translated, which is what the scenes of the
comparison have. Every pair of shapes that the model names becomes a <pair>; nothing else touches.
"""

import math
import tomllib

# Moments of inertia that are zero in the model, kg m²: MuJoCo refuses them.
LEAST = 1e-9


def number(x):
    return math.radians(x["deg"]) if isinstance(x, dict) else float(x)


def numbers(x):
    return [math.radians(v) for v in x["deg"]] if isinstance(x, dict) else [number(v) for v in x]


def words(x):
    return " ".join(repr(float(v)) for v in x)


def times(a, b):
    """Product of two quaternions w, x, y, z."""
    (p, q, r, s), (w, x, y, z) = a, b
    return [
        p * w - q * x - r * y - s * z,
        p * x + q * w + r * z - s * y,
        p * y - q * z + r * w + s * x,
        p * z + q * y - r * x + s * w,
    ]


def turned(a, v):
    w, x, y, z = times(times(a, [0.0, *v]), [a[0], -a[1], -a[2], -a[3]])
    return [x, y, z]


def quaternion(rpy):
    """Of Rz(yaw) Ry(pitch) Rx(roll)."""
    half = [0.5 * v for v in rpy]
    axes = ([1, 0, 0], [0, 1, 0], [0, 0, 1])
    q = [1.0, 0.0, 0.0, 0.0]
    for angle, axis in reversed(list(zip(half, axes))):
        q = times(q, [math.cos(angle), *(math.sin(angle) * v for v in axis)])
    return q


def towards(axis):
    """The smallest rotation that takes z to `axis`."""
    n = math.sqrt(sum(v * v for v in axis))
    x, y, z = (v / n for v in axis)
    q = [1.0 + z, -y, x, 0.0]
    n = math.sqrt(sum(v * v for v in q))
    return [v / n for v in q]


class Scene:
    """A model's MJCF, and its initial state in the order of MuJoCo."""

    def __init__(self, path):
        with open(path, "rb") as file:
            self.model = tomllib.load(file)
        self.qpos, self.qvel = [], []
        self.bodies = {b["name"]: b for b in self.model["body"]}
        self.joints = self.model["joint"]
        self.names = {s["name"]: s for s in self.model.get("shape", [])}

    def place(self, item):
        """Of a joint's frame or of a shape in its body, and its orientation."""
        return item.get("xyz", [0, 0, 0]), quaternion(numbers(item.get("rpy", [0, 0, 0])))

    def friction(self, contact):
        return contact.get("friction", self.model.get("contacts", {}).get("friction", 0))

    def start(self, joint):
        """Coordinates and velocities at the start. Quaternions are w, x, y, z; linear velocities are in the axes of the joint's
        frame, the angular one of a floating joint in those of the body."""
        kind, q, v = joint["type"], joint.get("start"), joint.get("start_velocity")
        if kind == "floating":
            q, v = q or [0, 0, 0, 0, 0, 0, 1], v or [0.0] * 6
            own = [q[6], *q[3:6]]
            return [*q[:3], *own], [*turned(own, v[:3]), *v[3:]]
        if kind == "planar":
            q, v = q or [0.0] * 3, v or [0.0] * 3
            c, s = math.cos(q[2]), math.sin(q[2])
            return q, [c * v[0] - s * v[1], s * v[0] + c * v[1], v[2]]
        return [number(q or 0)], [number(v or 0)]

    def shapes(self, body):
        text = ""
        for shape in self.names.values():
            if shape.get("body", "ground") != body:
                continue
            place, turn = self.place(shape)
            kind = shape["type"]
            if kind == "plane":
                turn, size = times(turn, towards(shape.get("normal", [0, 0, 1]))), [0, 0, 1]
            elif kind == "box":
                size = [0.5 * v for v in shape["size"]]
            else:
                # A point is a ball of a micrometre.
                kind, size = "sphere", [shape.get("radius", 1e-6)]
            text += (
                f'<geom name="{shape["name"]}" type="{kind}" size="{words(size)}" pos="{words(place)}" '
                f'quat="{words(turn)}" mass="0" contype="0" conaffinity="0"/>\n'
            )
        return text

    def body(self, joint):
        body = self.bodies[joint["child"]]
        place, turn = self.place(joint)
        axis, kind, name = joint.get("axis", [0, 0, 1]), joint["type"], joint["name"]
        inertia = [max(v, LEAST) for v in body.get("inertia", [0, 0, 0])]
        start, rates = self.start(joint)
        text = f'<body name="{body["name"]}" pos="{words(place)}" quat="{words(turn)}">\n'
        if kind == "floating":
            at = [a + b for a, b in zip(place, turned(turn, start[:3]))]
            self.qpos += [*at, *times(turn, start[3:])]
            self.qvel += [*turned(turn, rates[:3]), *rates[3:]]
            text += f'<freejoint name="{name}"/>\n'
        elif kind == "planar":
            plane = towards(axis)
            x, y, n = (turned(plane, v) for v in ([1, 0, 0], [0, 1, 0], [0, 0, 1]))
            self.qpos += start
            self.qvel += rates
            for letter, direction in (("x", x), ("y", y)):
                text += f'<joint name="{name}_{letter}" type="slide" axis="{words(direction)}"/>\n'
            text += f'<joint name="{name}" type="hinge" axis="{words(n)}"/>\n'
        else:
            self.qpos += start
            self.qvel += rates
            more = ""
            if "limits" in joint:
                more += f' limited="true" range="{words(numbers(joint["limits"]))}" solreflimit="SOLREF" solimplimit="SOLIMP"'
            for key, attribute in (("stiffness", "stiffness"), ("damping", "damping"), ("rest", "springref")):
                if key in joint:
                    more += f' {attribute}="{number(joint[key])!r}"'
            text += f'<joint name="{name}" type="{ {"revolute": "hinge", "prismatic": "slide"}[kind] }" axis="{words(axis)}"{more}/>\n'
        text += (
            f'<inertial pos="{words(body.get("com", [0, 0, 0]))}" mass="{body["mass"]!r}" diaginertia="{words(inertia)}"/>\n'
            + self.shapes(body["name"])
        )
        for other in self.joints:
            if other.get("parent", "ground") == body["name"]:
                text += self.body(other)
        return text + "</body>\n"

    def mjcf(self, settings):
        """The file, with attributes of <option> and the `solref` and `solimp` of all contacts and limits."""
        self.qpos, self.qvel = [], []
        bodies = "".join(self.body(j) for j in self.joints if j.get("parent", "ground") == "ground")
        pairs = ""
        for contact in self.model.get("contact", []):
            a, b = contact["between"]
            mu = self.friction(contact)
            # Without friction one dimension; a coefficient of zero is not allowed.
            dimensions = 3 if mu > 0 else 1
            mu = max(mu, 1e-5)
            pairs += (
                f'<pair geom1="{a}" geom2="{b}" condim="{dimensions}" friction="{mu} {mu} 0 0 0" '
                f'solref="{settings["solref"]}" solimp="{settings["solimp"]}"/>\n'
            )
        option = " ".join(f'{key}="{value}"' for key, value in settings["option"].items())
        text = f"""<mujoco model="{self.model['name']}">
<compiler angle="radian" autolimits="false" balanceinertia="false"/>
<option gravity="{words(self.model.get('gravity', [0, 0, -9.81]))}" {option}/>
<worldbody>
{self.shapes("ground")}{bodies}</worldbody>
<contact>
{pairs}</contact>
</mujoco>
"""
        return text.replace("SOLREF", settings["limits"]).replace("SOLIMP", settings["solimp"])

    def order(self):
        """Names of the bodies in the order of the file."""
        return [b["name"] for b in self.model["body"]]
