"""Writes `multibody/__init__.pyi` from the table of outputs: `python make_stubs.py`, after a change of either."""

import pathlib

import multibody

HEAD = '''# Written by make_stubs.py.
import os
from typing import Any, Callable, Dict, List, Literal, Mapping, NamedTuple, Optional, Sequence, Tuple, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

_Array = NDArray[np.float64]
_Path = Union[str, "os.PathLike[str]"]
_Base = Literal["fixed", "floating", "planar"]
_Params = Union[ArrayLike, Mapping[str, ArrayLike]]

__version__: str
__all__: List[str]

class Finding(NamedTuple):
    severity: str
    file: str
    line: int
    column: int
    message: str
    help: str

_EventFunction = Callable[[float, _Array, _Array], float]

class Event(NamedTuple):
    function: _EventFunction
    direction: Literal["both", "rising", "falling"] = ...
    terminal: bool = ...

class Crossing(NamedTuple):
    row: int
    time: float
    event: int
    q: _Array
    v: _Array

class ContactEvent(NamedTuple):
    row: int
    time: float
    contact: str
    cause: Literal["lands", "opens", "slips", "stops", "jams"]
    mode: Literal["open", "closed", "sliding", "sticking"]
    approach: float
    energy: float

class ModelError(ValueError):
    findings: List[Finding]

class SimulationError(RuntimeError):
    kind: str
    time: float
    row: int
    numbers: Dict[str, float]

class Rollout(NamedTuple):
    q: _Array
    v: _Array
    failures: List[SimulationError]
    events: List[Any]
    forces: Optional[_Array]

def load(
    path: Optional[_Path] = ...,
    *,
    text: Optional[str] = ...,
    format: str = ...,
    base: _Base = ...,
    gravity: Optional[Sequence[float]] = ...,
    limits: bool = ...,
    floor: Optional[Tuple[float, float]] = ...,
    self_contact: Optional[float] = ...,
    variant: Optional[str] = ...,
    wrenches: Sequence[str] = ...,
    gains: Union[Tuple[float, float], Mapping[str, Tuple[float, float]], None] = ...,
    arithmetic: Literal["fast", "exact"] = ...,
    search: bool = ...,
) -> Model: ...
def check(
    path: Optional[_Path] = ...,
    *,
    text: Optional[str] = ...,
    format: str = ...,
    base: _Base = ...,
    gravity: Optional[Sequence[float]] = ...,
    limits: bool = ...,
    floor: Optional[Tuple[float, float]] = ...,
    self_contact: Optional[float] = ...,
) -> List[Finding]: ...
def convert(
    path: Optional[_Path] = ...,
    *,
    text: Optional[str] = ...,
    format: str = ...,
    base: _Base = ...,
    gravity: Optional[Sequence[float]] = ...,
    limits: bool = ...,
) -> str: ...
def methods() -> List[Tuple[str, str, bool]]: ...
def outputs() -> List[Tuple[str, List[Tuple[str, str]], List[Tuple[str, str]], str]]: ...
'''

MODEL = '''
class Model:
    @property
    def name(self) -> str: ...
    @property
    def findings(self) -> List[Finding]: ...
    @property
    def nq(self) -> int: ...
    @property
    def nv(self) -> int: ...
    @property
    def coordinate_names(self) -> List[str]: ...
    @property
    def velocity_names(self) -> List[str]: ...
    @property
    def body_names(self) -> List[str]: ...
    @property
    def joint_names(self) -> List[str]: ...
    @property
    def frame_names(self) -> List[str]: ...
    @property
    def parameter_names(self) -> List[str]: ...
    @property
    def parameter_defaults(self) -> _Array: ...
    @property
    def wrench_names(self) -> List[str]: ...
    @property
    def constraint_names(self) -> List[str]: ...
    @property
    def contact_names(self) -> List[str]: ...
    @property
    def joint_ranges(self) -> _Array: ...
    @property
    def max_velocity(self) -> _Array: ...
    @property
    def max_effort(self) -> _Array: ...
    @property
    def axes(self) -> NDArray[np.uintp]: ...
    @property
    def kp(self) -> _Array: ...
    @property
    def kd(self) -> _Array: ...
    @property
    def outputs(self) -> List[str]: ...
    def neutral(self) -> _Array: ...
    def start(self) -> Tuple[_Array, _Array]: ...
    def close(self, q: ArrayLike) -> _Array: ...
    def shapes(self, output: str) -> Dict[str, Tuple[int, ...]]: ...
    def generate(
        self,
        lang: Literal["rust", "c", "wasm", "wasm-lanes"] = ...,
        outputs: Optional[Sequence[str]] = ...,
        *,
        name: Optional[str] = ...,
        scalar: Literal["f64", "f32"] = ...,
        frames: Optional[Sequence[str]] = ...,
    ) -> Dict[str, Union[str, bytes]]: ...
    def rollout(
        self,
        x0: Union[ArrayLike, Tuple[ArrayLike, ArrayLike]],
        u: Optional[ArrayLike] = ...,
        *,
        dt: float,
        steps: Optional[int] = ...,
        method: Optional[str] = ...,
        tolerance: Optional[float] = ...,
        state: Literal["velocities", "momenta"] = ...,
        layout: Literal["mbd", "pinocchio", "mujoco"] = ...,
        every: int = ...,
        params: Optional[_Params] = ...,
        wrenches: Optional[ArrayLike] = ...,
        gravity: Optional[ArrayLike] = ...,
        drive_q: Optional[ArrayLike] = ...,
        drive_v: Optional[ArrayLike] = ...,
        events: Union[bool, Sequence[Union[Event, _EventFunction]], None] = ...,
        forces: bool = ...,
        contacts: Literal["automatic", "events", "steps"] = ...,
        impacts: Literal["together", "sequential"] = ...,
        threads: Optional[int] = ...,
        out: Optional[Tuple[_Array, _Array]] = ...,
        on_error: Literal["raise", "mark"] = ...,
    ) -> Rollout: ...
    def evaluate(self, output: str, *args: ArrayLike, out: Any = ..., **inputs: Any) -> Any: ...
'''


def text() -> str:
    """The stubs."""
    results_of, methods = [], []
    for name, arguments, results, _ in multibody.outputs():
        title = "_" + "".join(part.title() for part in name.split("_"))
        if len(results) > 1:
            results_of.append(f"\nclass {title}(NamedTuple):\n" + "".join(f"    {r}: _Array\n" for r, _ in results))
        out, back = ("Optional[_Array]", "_Array") if len(results) == 1 else ("Optional[Tuple[_Array, ...]]", title)
        parts = [f"{argument}: ArrayLike" for argument, _ in arguments] + ["*"]
        names = {argument for argument, _ in arguments}
        for other in ("tau", "drive_q", "drive_v", "drive_a", "wrenches", "gravity", "params"):
            if other not in names:
                parts.append(f"{other}: Optional[{'_Params' if other == 'params' else 'ArrayLike'}] = ...")
        parts.append(f"out: {out} = ...")
        lines = "".join(f"        {part},\n" for part in ["self", *parts])
        methods.append(f"    def {name}(\n{lines}    ) -> {back}: ...\n")
    return HEAD + "".join(results_of) + MODEL + "".join(methods)


if __name__ == "__main__":
    (pathlib.Path(__file__).parent / "multibody" / "__init__.pyi").write_text(text())
