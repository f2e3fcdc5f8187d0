"""Builds a model of this project as a plant of Drake: the numbers are those of the file which `mjcf.py` also reads.

Bodies, joints, springs, dampers, limits and shapes become those of a MultibodyPlant; its reader of MJCF knows neither pairs nor
bodies with several joints well enough to be used. Point contact has one point for each pair of shapes: a box is therefore its
eight corners, as its documents advise and as this project has it. Every pair of shapes that the model names may touch; nothing
else does.
"""

import dataclasses
import itertools
import math
import time

import numpy as np
from pydrake.common.eigen_geometry import Quaternion
from pydrake.geometry import Box, CollisionFilterDeclaration, GeometrySet, HalfSpace, ProximityProperties, Sphere
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import AddMultibodyPlant, CoulombFriction, MultibodyPlantConfig
from pydrake.multibody.tree import (
    FixedOffsetFrame,
    PlanarJoint,
    PrismaticJoint,
    PrismaticSpring,
    QuaternionFloatingJoint,
    RevoluteJoint,
    RevoluteSpring,
    RotationalInertia,
    SpatialInertia,
)
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator
from pydrake.systems.framework import DiagramBuilder

from mjcf import number, numbers, quaternion, towards, turned

# Longest step of integrators with error control, s: Drake's own default.
LONGEST = 0.1


@dataclasses.dataclass
class Setting:
    """How contacts are computed. `None` is what Drake takes by itself."""

    # A step of time, s, of a discrete plant, or an integrator and its accuracy.
    step: float = 0.0
    approximation: str = "lagged"
    integrator: str = ""
    accuracy: float = 1e-3
    # Of a pair, N/m, s/m, s.
    stiffness: float | None = None
    dissipation: float | None = None
    relaxation: float | None = None
    # Depth from which Drake guesses stiffness and dissipation, m.
    allowance: float | None = None
    # Speed below which friction sticks, m/s, and the least softness of SAP.
    stiction: float | None = None
    near_rigid: float | None = None


def pose(place, turn):
    return RigidTransform(RotationMatrix(Quaternion(np.asarray(turn) / np.linalg.norm(turn))), np.asarray(place, float))


class Scene:
    """A model in Drake, at its initial state."""

    def __init__(self, source, setting, contacts=True):
        """`source` is the model as `mjcf.Scene` reads it."""
        self.source, self.setting = source, setting
        config = {"discrete_contact_approximation": setting.approximation, "time_step": setting.step, "contact_model": "point"}
        # Without it, a discrete plant computes its outputs once more in every step.
        config["use_sampled_output_ports"] = False
        for key, value in (
            ("penetration_allowance", setting.allowance),
            ("stiction_tolerance", setting.stiction),
            ("sap_near_rigid_threshold", setting.near_rigid),
        ):
            if value is not None:
                config[key] = value
        builder = DiagramBuilder()
        plant, geometry = AddMultibodyPlant(MultibodyPlantConfig(**config), builder)
        self.plant = plant
        plant.mutable_gravity_field().set_gravity_vector(source.model.get("gravity", [0, 0, -9.81]))
        self.starts = []
        for body in source.model["body"]:
            inertia = SpatialInertia.MakeFromCentralInertia(
                body["mass"], body.get("com", [0, 0, 0]), RotationalInertia(*body.get("inertia", [0, 0, 0]))
            )
            plant.AddRigidBody(body["name"], inertia)
        for joint in source.joints:
            self.joint(joint)
        pairs = [(*c["between"], source.friction(c)) for c in source.model.get("contact", [])] if contacts else []
        shapes = {}
        for a, b, friction in pairs:
            for name in (a, b):
                if name not in shapes:
                    shapes[name] = (friction, self.shape(source.names[name], friction))
                # Drake knows a friction of a shape, not of a pair.
                assert shapes[name][0] == friction, name
        plant.Finalize()
        every = GeometrySet([i for _, ids in shapes.values() for i in ids])
        filters = geometry.collision_filter_manager()
        filters.Apply(CollisionFilterDeclaration().ExcludeWithin(every))
        for a, b, _ in pairs:
            filters.Apply(CollisionFilterDeclaration().AllowBetween(GeometrySet(shapes[a][1]), GeometrySet(shapes[b][1])))
        self.diagram = builder.Build()

    def body(self, item, key):
        name = item.get(key, "ground")
        return self.plant.world_body() if name == "ground" else self.plant.GetBodyByName(name)

    def joint(self, joint):
        kind, name = joint["type"], joint["name"]
        # The plane of a planar joint of Drake is that of x and y of its frames.
        plane = towards(joint.get("axis", [0, 0, 1])) if kind == "planar" else [1.0, 0.0, 0.0, 0.0]
        q, v = self.source.start(joint)
        inboard, outboard = (
            self.plant.AddFrame(FixedOffsetFrame(f"{key}_of_{name}", self.body(joint, key).body_frame(), at))
            for key, at in (("parent", pose(*self.source.place(joint)) @ pose([0, 0, 0], plane)), ("child", pose([0, 0, 0], plane)))
        )
        if kind == "floating":
            made = self.plant.AddJoint(QuaternionFloatingJoint(name, inboard, outboard))

            def start(context):
                made.SetTranslation(context, q[:3])
                made.SetQuaternion(context, Quaternion(np.asarray(q[3:])))
                made.set_translational_velocity(context, v[:3])
                made.set_angular_velocity(context, turned(q[3:], v[3:]))

        elif kind == "planar":
            made = self.plant.AddJoint(PlanarJoint(name, inboard, outboard))

            def start(context):
                made.set_pose(context, q[:2], q[2])
                made.set_translational_velocity(context, v[:2])
                made.set_angular_velocity(context, v[2])

        else:
            hinge = kind == "revolute"
            type_, spring = (RevoluteJoint, RevoluteSpring) if hinge else (PrismaticJoint, PrismaticSpring)
            axis, damping = joint.get("axis", [0, 0, 1]), number(joint.get("damping", 0))
            made = self.plant.AddJoint(type_(name, inboard, outboard, axis, damping=damping))
            if "limits" in joint:
                low, high = numbers(joint["limits"])
                made.set_position_limits([low], [high])
            if "stiffness" in joint:
                self.plant.AddForceElement(spring(made, number(joint.get("rest", 0)), number(joint["stiffness"])))

            def start(context):
                (made.set_angle if hinge else made.set_translation)(context, q[0])
                (made.set_angular_rate if hinge else made.set_translation_rate)(context, v[0])

        self.starts.append(start)

    def shape(self, shape, friction):
        """The geometries of a shape."""
        body, frame, kind = self.body(shape, "body"), pose(*self.source.place(shape)), shape["type"]
        if kind == "plane":
            parts = [(frame @ pose([0, 0, 0], towards(shape.get("normal", [0, 0, 1]))), HalfSpace())]
        elif kind == "box" and "body" in shape:
            corners = itertools.product(*((-0.5 * s, 0.5 * s) for s in shape["size"]))
            parts = [(frame @ pose(corner, [1, 0, 0, 0]), Sphere(0)) for corner in corners]
        elif kind == "box":
            parts = [(frame, Box(*shape["size"]))]
        else:
            parts = [(frame, Sphere(shape.get("radius", 0)))]
        properties = ProximityProperties()
        add = lambda key, value: value is None or properties.AddProperty("material", key, value)
        add("coulomb_friction", CoulombFriction(friction, friction))
        # Two springs in a row have half the stiffness; relaxation times add up.
        add("point_contact_stiffness", self.setting.stiffness and 2 * self.setting.stiffness)
        add("hunt_crossley_dissipation", self.setting.dissipation)
        add("relaxation_time", None if self.setting.relaxation is None else 0.5 * self.setting.relaxation)
        return [
            self.plant.RegisterCollisionGeometry(body, at, part, f"{shape['name']}_{k}", properties)
            for k, (at, part) in enumerate(parts)
        ]

    def simulator(self):
        """At the initial state."""
        simulator = Simulator(self.diagram)
        context = self.plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
        for start in self.starts:
            start(context)
        if self.setting.integrator:
            ResetIntegratorFromFlags(simulator, self.setting.integrator, LONGEST)
            simulator.get_mutable_integrator().set_target_accuracy(self.setting.accuracy)
        simulator.Initialize()
        return simulator

    def run(self, end, rounds, patience):
        """Seconds, and places of the bodies in the order of the file."""
        least = math.inf
        for _ in range(rounds):
            simulator = self.simulator()
            clock = time.perf_counter()
            simulator.AdvanceTo(end)
            least = min(least, time.perf_counter() - clock)
            if least > patience / rounds:
                break
        return least, self.places(simulator)

    def places(self, simulator):
        context = self.plant.GetMyContextFromRoot(simulator.get_context())
        places = []
        for body in self.source.model["body"]:
            frame = self.plant.GetBodyByName(body["name"]).EvalPoseInWorld(context)
            places += [frame.translation(), frame @ np.asarray(body.get("com", [0, 0, 0]), float)]
        return places
