"""Methods of `Model`: one for each output of the generator's table, and rollouts."""

from __future__ import annotations

import inspect
import operator
from collections import namedtuple
from collections.abc import Mapping
from typing import Any, Callable, List, NamedTuple, Optional, Union

import numpy as np

from . import _native
from ._types import ContactEvent, Crossing, Event, SimulationError

INPUTS = ("tau", "drive_q", "drive_v", "drive_a", "wrenches", "gravity", "params")


class Rollout(NamedTuple):
    """Motions: coordinates ``(B, T+1, nq)``, velocities or momenta ``(B, T+1, nv)``, and the failures of rows.

    Where they are asked for: events, row by row and in the order of time, and the forces of contacts ``(B, T+1, C, 3)``.
    """

    q: np.ndarray
    v: np.ndarray
    failures: List[SimulationError]
    events: List[Union[Crossing, ContactEvent]]
    forces: Optional[np.ndarray]


def parameters(model: Any, given: Any) -> Any:
    """Parameters as an array ``(k,)`` or ``(B, k)``; a mapping changes the defaults by name."""
    if not isinstance(given, Mapping):
        return given
    names = model.parameter_names
    unknown = [name for name in given if name not in names]
    if unknown:
        raise ValueError(f"no parameter is called {unknown[0]!r}: the parameters are {', '.join(names) or 'none'}")
    values = {name: np.asarray(value, dtype=float) for name, value in given.items()}
    shape = np.broadcast_shapes(*(value.shape for value in values.values())) if values else ()
    array = np.empty(shape + (len(names),))
    array[...] = model.parameter_defaults
    for name, value in values.items():
        array[..., names.index(name)] = value
    return array


def _given(model: Any, inputs: dict) -> "Optional[dict]":
    if not inputs:
        return None
    if inputs.get("params") is not None:
        inputs["params"] = parameters(model, inputs["params"])
    return inputs


DIRECTIONS = {"falling": -1, "both": 0, "rising": 1}


def _asked(events: Any, forces: bool) -> dict:
    """What the native part is to tell beside states."""
    functions = []
    for event in () if events is None or isinstance(events, bool) else events:
        if not isinstance(event, Event):
            event = Event(event)
        if not callable(event.function):
            raise TypeError(f"`events` has {event.function!r}: give functions of time, coordinates and velocities")
        if event.direction not in DIRECTIONS:
            raise ValueError(f"the direction of an event is {event.direction!r}: take {', '.join(DIRECTIONS)}")
        functions.append((event.function, DIRECTIONS[event.direction], bool(event.terminal)))
    return {"contacts": events is True, "forces": bool(forces), "functions": functions}


#: What arrays hold, and in which units: those of a joint that turns, then of one that slides.
UNITS = {
    "q": "coordinates, rad or m; quaternions are unit, (x, y, z, w)",
    "v": "velocities, rad/s or m/s",
    "p": "momenta, kg m²/s or kg m/s",
    "a": "accelerations, rad/s² or m/s²",
    "qd": "rates of the coordinates, rad/s or m/s",
    "pd": "rates of the momenta, N m or N",
    "tau": "joint forces, N m or N",
    "h": "bias forces, N m or N",
    "m": "masses, kg m² or kg",
    "residual": "residuals of the constraints, rad or m",
    "freed": "momenta, kg m²/s or kg m/s",
    "sigma": "multipliers of momenta, kg m²/s or kg m/s",
    "lambda": "multipliers, N m or N",
    "dq": "change of the coordinates along the velocities, rad or m",
}


def _documentation(name: str, arguments: list, results: list, doc: str) -> str:
    def line(array: Any) -> str:
        array_name, dims = array
        single = f"{dims}," if "," not in dims else dims
        unit = f", {UNITS[array_name]}" if array_name in UNITS else ""
        return f"    ``{array_name}``: ``({single.lower()})`` or ``(B, {dims.lower()})``{unit}"

    parts = [doc.replace("`", "``"), "", "Arguments:"]
    parts += [line(array) for array in arguments]
    parts += ["", "Returns:"]
    parts += [line(array) for array in results]
    parts += [
        "",
        "Inputs beside the state are single rows or have one row for each state: ``tau`` (joint forces, N m or N), ``drive_q``,",
        "``drive_v``, ``drive_a`` (prescribed coordinates, rad or m, and their rates), ``wrenches`` (``[force; moment]``, N and N m,",
        "in the axes of their bodies or of the ground, as the description says), ``gravity`` (m/s²), ``params`` (SI units). ``out``",
        "is an array for the result, or a tuple of them.",
    ]
    return "\n".join(parts)


def _method(name: str, arguments: list, results: list, doc: str) -> Callable[..., Any]:
    """The method of an output."""
    names = [array_name for array_name, _ in arguments]
    several = None
    if len(results) > 1:
        several = namedtuple("".join(part.title() for part in name.split("_")), [n for n, _ in results])._make  # type: ignore[misc]

    def method(self: Any, *args: Any, out: Any = None, **kwargs: Any) -> Any:
        if len(args) != len(names):
            for missing in names[len(args) :]:
                if missing not in kwargs:
                    raise TypeError(f"{name}() takes {', '.join(names)}; {missing!r} is missing")
                args += (kwargs.pop(missing),)
            if len(args) != len(names):
                raise TypeError(f"{name}() takes {', '.join(names)}; {len(args)} arrays were given")
        values = self._evaluate(name, args, _given(self, kwargs), out)
        return several(values) if several else values[0]

    method.__name__ = name
    method.__qualname__ = f"Model.{name}"
    method.__doc__ = _documentation(name, arguments, results, doc)
    kinds = inspect.Parameter
    positional = [kinds(n, kinds.POSITIONAL_OR_KEYWORD) for n in ["self", *names]]
    keywords = [kinds(n, kinds.KEYWORD_ONLY, default=None) for n in (*(i for i in INPUTS if i not in names), "out")]
    method.__signature__ = inspect.Signature(positional + keywords)  # type: ignore[attr-defined]
    return method


def evaluate(self: Any, output: str, *args: Any, out: Any = None, **inputs: Any) -> Any:
    """Any output by its name, as the method of that name: ``model.evaluate("mass_matrix", q)``."""
    method = METHODS.get(output)
    if method is None:
        raise ValueError(f"no output is called {output!r}: outputs are {', '.join(METHODS)}")
    return method(self, *args, out=out, **inputs)


def rollout(
    self: Any,
    x0: Any,
    u: Any = None,
    *,
    dt: float,
    steps: Optional[int] = None,
    method: Optional[str] = None,
    tolerance: Optional[float] = None,
    state: str = "velocities",
    layout: str = "mbd",
    every: int = 1,
    params: Any = None,
    wrenches: Any = None,
    gravity: Any = None,
    drive_q: Any = None,
    drive_v: Any = None,
    events: Any = None,
    forces: bool = False,
    contacts: str = "automatic",
    impacts: str = "together",
    threads: Optional[int] = None,
    out: Any = None,
    on_error: str = "raise",
) -> Rollout:
    """Motions from starts, many at once.

    Arguments:
        ``x0``: starts ``(q0, v0)``, each ``(n,)`` or ``(B, n)``, or one array ``(nq + nv,)`` or ``(B, nq + nv)``.
        ``u``: joint forces ``tau``, N m or N, held constant over each step, ``(T, nv)`` or ``(B, T, nv)``; zero without.
        ``dt``: step, s. Methods that choose their steps give a state after every ``dt``.
        ``steps``: number ``T`` of steps; that of ``u`` if it is given.
        ``method``: one of ``multibody.methods()``; ``"rk4"`` without a tolerance, ``"dop853"`` with one.
        ``tolerance``: error that a step may have (rad and m for coordinates, relative for momenta): adaptive steps.
        ``state``: ``"velocities"`` or ``"momenta"``: what the second half of ``x0`` and of the result holds.
        ``layout``: order and representation of states and ``u``: ``"mbd"``, ``"pinocchio"`` or ``"mujoco"``.
        ``every``: every how many steps a state is kept.
        ``params``: parameters ``(k,)`` or ``(B, k)``, or a mapping from names to numbers or arrays ``(B,)``.
        ``wrenches``, ``gravity``: further inputs, constant in time.
        ``drive_q``, ``drive_v``: positions and rates of prescribed joints at the ends of all steps, ``(T + 1, n)`` or
            ``(B, T + 1, n)``, with cubic polynomials between them. With ``drive_q`` alone, ``(n,)`` or ``(B, n)``, they stand still.
        ``events``: functions ``f(t, q, v)`` whose zeros are looked for, or `Event` with a direction and whether the row ends;
            states are in the layout of ``x0``. ``True`` asks for the events of contacts.
        ``forces``: whether the forces of contacts are told, N along the normal and two tangents (N m for stops of rotations).
        ``contacts``: how contacts are followed: ``"events"``, from event to event; ``"steps"``, by time steps of ``dt`` with the
            impulses of all contacts at once, whose error is of the first order in ``dt``; or ``"automatic"``, by events, and
            by time steps of 1 ms or less where these crowd or fail.
        ``impacts``: how contacts act that collide at the same instant of a motion by events: ``"together"``, or
            ``"sequential"``, the one whose bodies approach fastest, then the next, as in Newton's cradle.
        ``threads``: number of threads, all cores without; the results are the same bits for any number.
        ``out``: a pair of arrays for ``q`` and ``v``.
        ``on_error``: ``"raise"`` the failure of the first row that fails, or ``"mark"``: rows are NaN from where they failed.

    Returns a `Rollout` of ``q`` ``(B, T + 1, nq)``, ``v`` ``(B, T + 1, nv)``, without ``B`` for a single start, the list of
    failures (`SimulationError` with ``row`` and ``time``), that of events (`Crossing`, `ContactEvent`) and the forces
    ``(B, T + 1, C, 3)``: those of time steps are means over the last one, in which impacts have a part, and zero before the first.
    States after a terminal event are NaN.
    The lock of the interpreter is released meanwhile.
    """
    if on_error not in ("raise", "mark"):
        raise ValueError(f"`on_error` is {on_error!r}: take 'raise' or 'mark'")
    if state not in ("velocities", "momenta"):
        raise ValueError(f"`state` is {state!r}: take 'velocities' or 'momenta'")
    if isinstance(x0, tuple):
        if len(x0) != 2:
            raise ValueError(f"`x0` has {len(x0)} parts: give coordinates and velocities")
        start = x0
    else:
        x0 = np.asarray(x0)
        nv = self.nv
        if x0.ndim not in (1, 2) or x0.shape[-1] <= nv:
            raise ValueError(f"`x0` has the shape {x0.shape}: (nq + nv,) or (B, nq + nv) is expected")
        start = (x0[..., :-nv] if nv else x0, x0[..., x0.shape[-1] - nv :])
    if steps is None:
        if u is None:
            raise ValueError("give `steps`, or `u` with one row for each step")
        if np.ndim(u) not in (2, 3):
            raise ValueError(f"`u` has the shape {np.shape(u)}: (T, nv) or (B, T, nv) is expected")
        steps = np.shape(u)[-2]
    for name, number, least in (("steps", steps, 0), ("every", every, 1), ("threads", 1 if threads is None else threads, 1)):
        if not least <= operator.index(number) < 2**62:
            raise ValueError(f"`{name}` is {number}: give a number from {least} on")
    inputs = {"params": params, "wrenches": wrenches, "gravity": gravity}
    if drive_v is None:
        inputs["drive_q"] = drive_q
    elif drive_q is None:
        raise ValueError("`drive_v` needs `drive_q` with as many positions")
    drives = None if drive_v is None else (drive_q, drive_v)
    settings = {
        "dt": float(dt),
        "steps": steps,
        "every": every,
        "method": method or ("rk4" if tolerance is None else "dop853"),
        "tolerance": None if tolerance is None else float(tolerance),
        "momenta": state == "momenta",
        "layout": layout,
        "contacts": contacts,
        "impacts": impacts,
        "threads": threads,
    }
    motion = Rollout(*self._rollout(start, u, settings, _asked(events, forces), _given(self, inputs), drives, out))
    if motion.failures and on_error == "raise":
        raise motion.failures[0]
    return motion


METHODS = {row[0]: _method(*row) for row in _native.outputs()}


def attach() -> None:
    """Gives the native class its methods."""
    for name, method in METHODS.items():
        setattr(_native.Model, name, method)
    _native.Model.evaluate = evaluate
    _native.Model.rollout = rollout
