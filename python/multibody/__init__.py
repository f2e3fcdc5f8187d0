"""Dynamics of multibody systems in Hamilton's canonical form.

>>> import multibody
>>> model = multibody.load("robot.urdf", base="floating")
>>> accelerations = model.accelerations(q, v, tau=tau)
>>> motion = model.rollout((q, v), u, dt=1e-3)

A state is ``(q, v)`` or ``(q, p)``: coordinates in rad and m (unit quaternions x, y, z, w), velocities, momenta. Every function
takes one state ``(n,)`` or many ``(B, n)``. Functions are compiled to machine code when they are first called.
"""

from . import _methods
from ._methods import Rollout
from ._native import Model, check, convert, load, methods, outputs
from ._types import ContactEvent, Crossing, Event, Finding, ModelError, SimulationError

_methods.attach()

__version__ = "0.1.0"
__all__ = [
    "ContactEvent",
    "Crossing",
    "Event",
    "Finding",
    "Model",
    "ModelError",
    "Rollout",
    "SimulationError",
    "check",
    "convert",
    "load",
    "methods",
    "outputs",
]
