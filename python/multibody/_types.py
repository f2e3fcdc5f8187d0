"""Types that the native part makes: findings and exceptions."""

from __future__ import annotations

from typing import Any, Callable, Dict, List, NamedTuple


class Finding(NamedTuple):
    """What is to be said about a place of a description.

    ``severity`` is ``"error"``, ``"warning"`` or ``"notice"``. Lines and columns count from 1; 0 is the file as a whole.
    """

    severity: str
    file: str
    line: int
    column: int
    message: str
    help: str

    def __str__(self) -> str:
        place = f"{self.file}:{self.line}:{self.column}" if self.line else self.file
        help = f"\n  help: {self.help}" if self.help else ""
        return f"{place}: {self.severity}: {self.message}{help}"


class Event(NamedTuple):
    """A function of time and state whose zeros are events of a rollout: ``function(t, q, v)`` gives a number.

    ``direction`` is ``"both"``, ``"rising"`` (from negative values to zero) or ``"falling"``. A ``terminal`` event ends the row.
    The function should be smooth; the threads of a rollout call it, so that calls for other rows
    may come before one has ended: it must not share memory between calls, or the rollout needs ``threads=1``.
    """

    function: "Callable[[float, Any, Any], float]"
    direction: str = "both"
    terminal: bool = False


class Crossing(NamedTuple):
    """An event of a row: its time, s, the index of the function that reached zero, and the state there."""

    row: int
    time: float
    event: int
    q: Any
    v: Any


class ContactEvent(NamedTuple):
    """An event of a contact in a row: its time, s, and the name of the contact.

    ``cause`` is ``"lands"``, ``"opens"``, ``"slips"``, ``"stops"`` or ``"jams"`` (friction stops or turns a contact that slides by
    an impulse), ``mode`` what the contact does then (``"open"``, ``"closed"`` without friction, ``"sliding"``, ``"sticking"``),
    ``approach`` the speed at which the bodies met, m/s, ``energy`` what an impact has changed the kinetic energy by, J.
    """

    row: int
    time: float
    contact: str
    cause: str
    mode: str
    approach: float
    energy: float


class ModelError(ValueError):
    """A description that cannot be used, or something that its model does not have.

    ``findings`` lists everything that was found in the description; it is empty for errors about the model as a whole.
    """

    findings: List[Finding]

    def __init__(self, message: str, findings: "List[Finding] | None" = None) -> None:
        super().__init__(message)
        self.findings = list(findings or [])

    def __reduce__(self) -> Any:
        return (type(self), (str(self), self.findings))


class SimulationError(RuntimeError):
    """A motion that did not reach its end.

    ``kind`` is a word (``"not_finite"``, ``"quaternion"``, ``"step_too_small"``, ``"no_convergence"``, ``"constraint"``, ...),
    ``time`` the start of the step that failed, s, ``row`` the row of the batch, ``numbers`` what belongs to the kind, by name.
    """

    kind: str
    time: float
    row: int
    numbers: Dict[str, float]

    def __init__(self, message: str, kind: str, time: float, row: int, numbers: Dict[str, float]) -> None:
        super().__init__(message)
        self.kind = kind
        self.time = time
        self.row = row
        self.numbers = numbers

    def __reduce__(self) -> Any:
        return (type(self), (str(self), self.kind, self.time, self.row, self.numbers))
