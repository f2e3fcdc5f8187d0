"""Builds a model of this project as a plant of Drake: the numbers are those of the file which `mjcf.py` reads.

Bodies, joints, springs, dampers, limits and shapes become those of a MultibodyPlant. Drake's point contact has one point for
each pair of shapes: a box is therefore its eight corners, as its documents advise and as this project has it. Every pair of
shapes that the model names may touch; nothing else does.
"""

import dataclasses
import itertools
import logging
import math
import os
import pickle
import select
import signal
import sys
import time
import traceback
from importlib.metadata import version

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

VERSION = version("drake")
ACCURACIES = [1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8]
# Half spaces do not work with deformable bodies, joint limits not with continuous plants: both are known.
logging.getLogger("drake").setLevel(logging.ERROR)


@dataclasses.dataclass
class Setting:
    """How contacts are computed. `None` is what Drake takes by itself."""

    # A step of time, s, of a discrete plant, or an integrator and its accuracy.
    step: float = 0.0
    approximation: str = "lagged"
    integrator: str = ""
    accuracy: float = 1e-3
    # Drake's own longest step of integrators with error control, s.
    longest: float = 0.1
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
        properties.AddProperty("material", "coulomb_friction", CoulombFriction(friction, friction))
        # Two springs in a row have half the stiffness; relaxation times add up.
        for key, value, share in (
            ("point_contact_stiffness", self.setting.stiffness, 2.0),
            ("hunt_crossley_dissipation", self.setting.dissipation, 1.0),
            ("relaxation_time", self.setting.relaxation, 0.5),
        ):
            if value is not None:
                properties.AddProperty("material", key, share * value)
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
            ResetIntegratorFromFlags(simulator, self.setting.integrator, self.setting.longest)
            simulator.get_mutable_integrator().set_target_accuracy(self.setting.accuracy)
        simulator.Initialize()
        return simulator

    def timed(self, end, rounds, patience):
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

    def gap(self, simulator):
        """The least distance of shapes that may touch, m."""
        port, context = self.plant.get_geometry_query_input_port(), self.plant.GetMyContextFromRoot(simulator.get_context())
        pairs = port.Eval(context).ComputeSignedDistancePairwiseClosestPoints(1.0)
        return min(pair.distance for pair in pairs)

    def start(self):
        """Mass, kg, kinetic and potential energy, J, at the start."""
        context = self.plant.GetMyContextFromRoot(self.simulator().get_context())
        energies = self.plant.EvalKineticEnergy(context), self.plant.EvalPotentialEnergy(context)
        return [self.plant.CalcTotalMass(context), *energies]

    def places(self, simulator):
        context = self.plant.GetMyContextFromRoot(simulator.get_context())
        places = []
        for body in self.source.model["body"]:
            frame = self.plant.GetBodyByName(body["name"]).EvalPoseInWorld(context)
            places += [frame.translation(), frame @ np.asarray(body.get("com", [0, 0, 0]), float)]
        return places


def within(limit, function):
    """What the function returns in a process of its own; `None` where it takes longer, or Drake gives up."""
    source, sink = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(source)
        code = 1
        try:
            with os.fdopen(sink, "wb") as file:
                file.write(pickle.dumps(function()))
            code = 0
        except RuntimeError as failure:
            print(f"Drake gives up: {str(failure).splitlines()[0][:200]}", file=sys.stderr, flush=True)
            code = 0
        except BaseException:
            traceback.print_exc()
        finally:
            os._exit(code)
    os.close(sink)
    with os.fdopen(source, "rb") as file:
        if not select.select([file], [], [], limit)[0]:
            os.kill(child, signal.SIGKILL)
        answer = file.read()
    if os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) > 0:
        raise ChildProcessError("a run of Drake failed")
    return pickle.loads(answer) if answer else None


def dissipation(e, speed):
    """Of Hunt and Crossley's law, s/m, for a restitution of `e` at this speed, m/s, by bisection.

    With the force k x (1 + d v), v dv / (1 + d v) is integrated from the speed of approach to that of departure.
    """
    low, high = 0.0, 1.0 / e
    for _ in range(60):
        u = 0.5 * (low + high)
        # What the compression takes less what the expansion gives.
        left = (u - math.log1p(u)) + (e * u + math.log1p(-e * u))
        low, high = (u, high) if left > 0 else (low, u)
    return low / speed


def settings(scene, steps, restitution):
    """Settings by name, each with the name of what is varied and the `Setting` of each value.

    `restitution` is that of the ball: its coefficient, the damping ratio and mass of a spring that has it, and the speed of
    the first impact.
    """

    def discrete(approximation, of_step=lambda step: {}):
        return "step", {step: Setting(step=step, approximation=approximation, **of_step(step)) for step in steps}

    def continuous(integrator, **more):
        return "accuracy", {a: Setting(integrator=integrator, accuracy=a, **more) for a in ACCURACIES}

    if scene == "ball":
        e, ratio, mass, speed = restitution

        def spring(count):
            def of_step(step):
                frequency = math.pi / (count * step)
                # An implicit step damps a spring as one more step of relaxation does.
                relaxation = max(2 * ratio / frequency - step, 0.0)
                return {"stiffness": mass * frequency * frequency, "relaxation": relaxation, "near_rigid": 0.0}

            return of_step

        bounce = {f"SAP, spring, bounce of {n} steps": discrete("sap", spring(n)) for n in (40, 160, 640)}
        damping = dissipation(e, speed)
        for name, integrator in (("runge_kutta3", "runge_kutta3"), ("radau3", "radau3"), ("CENIC", "cenic")):
            for level, stiffness in (("hard", 1e6), ("harder", 1e8)):
                bounce[f"{name}, {level}"] = continuous(integrator, stiffness=stiffness, dissipation=damping)
        return bounce
    levels = {
        "": {},
        ", hard": {"stiffness": 1e6, "dissipation": 500.0, "stiction": 1e-5},
        ", harder": {"stiffness": 1e8, "dissipation": 5000.0, "stiction": 1e-7},
    }
    made = {
        "SAP": discrete("sap"),
        # Its own bound of the stiffness, and the relaxation that goes with it.
        "SAP, rigid": discrete("sap", lambda step: {"stiffness": 1e12, "relaxation": step / math.pi}),
        "lagged": discrete("lagged"),
    }
    for name, values in levels.items():
        made[f"similar{name}"] = discrete("similar", lambda step, values=values: values)
        made[f"TAMSI{name}"] = discrete("tamsi", lambda step, values=values: values)
        made[f"CENIC{name}"] = continuous("cenic", **values)
        # Continuous plants have no limits of joints but with CENIC, and the dropped quadruped comes to the stops of its knees.
        if scene != "dropped":
            made[f"radau3{name}"] = continuous("radau3", **values)
            if name != ", harder":
                made[f"implicit_euler{name}"] = continuous("implicit_euler", **values)
                made[f"runge_kutta3{name}"] = continuous("runge_kutta3", **values)
    return made


def run(source, setting, end, rounds, patience, limit):
    """Seconds, and places of the bodies; `None` where there is no answer within the limit, s."""
    scene = Scene(source, setting)
    return within(limit, lambda: scene.timed(end, rounds, patience))


def check(source, free, start, first, end, places):
    """Compares the model with ours: mass and energies at the start, a motion without contacts, and the shapes.

    `free` is the model without contacts, whose bodies we have at `places` at `end`; `start` are our mass and energies, and
    `first` the time of our first event. Returns the largest differences.
    """
    # Of fifth order: errors of both programs are far below the bounds, and wrong numbers of a model far above.
    # With a longer first step, it does not come back from the quadruped with stiff springs.
    exact = Setting(integrator="runge_kutta5", accuracy=1e-11, longest=0.01)
    scene = Scene(free, exact, contacts=False)
    energy = max(abs(a - b) for a, b in zip(scene.start(), start))
    simulator = scene.simulator()
    simulator.AdvanceTo(end)
    motion = float(np.max(np.abs(np.asarray(scene.places(simulator)) - np.asarray(places))))
    # Shapes touch at the start or at the first event: nothing pushes before.
    scene = Scene(source, exact)
    simulator = scene.simulator()
    gap = scene.gap(simulator)
    if abs(gap) > 1e-9:
        simulator.AdvanceTo(first)
        gap = scene.gap(simulator)
    return {"mass and energies": energy, "motion without contacts": motion, "distance at the first contact": abs(gap)}
