"""Rollouts on many machines: a Dask client, a Ray cluster, or any executor of `concurrent.futures`.

>>> from dask.distributed import Client
>>> motion = multibody.distributed.rollout(model, (q, v), dt=1e-3, steps=1000, on=Client("scheduler:8786"))

Rows go to the workers in blocks, with the text of the model; each worker reads and compiles a model once. Blocks become as large
as their measured cost allows, those that fail are sent again, and the result has the order and the bits of a local rollout.
"""

from __future__ import annotations

import collections
import math
import pickle
import sys
import time
import zlib
from typing import Any, Callable, Deque, Dict, List, NamedTuple, Optional, Set, Tuple, Union

import numpy as np

from ._methods import Rollout, parameters
from ._types import ModelError, SimulationError

__all__ = ["rollout"]

#: Errors that another attempt does not mend.
FINAL = (ModelError, SimulationError, ValueError, TypeError, pickle.PicklingError)
#: Models that a worker keeps.
KEPT = 8

_models: "collections.OrderedDict[bytes, Any]" = collections.OrderedDict()


def _model(text: bytes) -> Any:
    """The model of a text, read and compiled once in each process."""
    model = _models.pop(text, None)
    if model is None:
        model = pickle.loads(zlib.decompress(text))
        # Compiles before anything is measured; two rows have code of their own.
        model.rollout(tuple(np.tile(part, (2, 1)) for part in model.start()), dt=1e-3, steps=0, on_error="mark")
    _models[text] = model
    while len(_models) > KEPT:
        _models.popitem(last=False)
    return model


def _block(text: bytes, x0: Any, u: Any, settings: Dict[str, Any]) -> Tuple[Rollout, float]:
    """Motions of some rows, and the time that they took, s, without that of reading and compiling; runs on a worker."""
    model = _model(text)
    start = time.perf_counter()
    motion = model.rollout(x0, u, on_error="mark", **settings)
    return motion, time.perf_counter() - start


class _Dask:
    def __init__(self, client: Any) -> None:
        import distributed

        self.client, self.distributed = client, distributed

    def slots(self) -> int:
        return max(1, sum(self.client.nthreads().values()))

    def submit(self, *arguments: Any) -> Any:
        # Nothing is looked up among earlier results, and a worker that ends is Dask's to replace.
        return self.client.submit(_block, *arguments, pure=False)

    def wait(self, futures: Set[Any]) -> Set[Any]:
        return self.distributed.wait(futures, return_when="FIRST_COMPLETED").done

    def result(self, future: Any) -> Any:
        return future.result()

    def cancel(self, futures: Set[Any]) -> None:
        self.client.cancel(list(futures))


class _Ray:
    def __init__(self, ray: Any) -> None:
        self.ray = ray
        self.remote = ray.remote(_block)

    def slots(self) -> int:
        return max(1, int(self.ray.cluster_resources().get("CPU", 1)))

    def submit(self, *arguments: Any) -> Any:
        return self.remote.remote(*arguments)

    def wait(self, futures: Set[Any]) -> Set[Any]:
        return set(self.ray.wait(list(futures), num_returns=1)[0])

    def result(self, future: Any) -> Any:
        try:
            return self.ray.get(future)
        except self.ray.exceptions.RayTaskError as error:
            raise error.cause from error

    def cancel(self, futures: Set[Any]) -> None:
        for future in futures:
            self.ray.cancel(future)


class _Executor:
    def __init__(self, executor: Any) -> None:
        import concurrent.futures

        self.executor, self.futures = executor, concurrent.futures

    def slots(self) -> int:
        return max(1, getattr(self.executor, "_max_workers", 1))

    def submit(self, *arguments: Any) -> Any:
        return self.executor.submit(_block, *arguments)

    def wait(self, futures: Set[Any]) -> Set[Any]:
        return self.futures.wait(futures, return_when="FIRST_COMPLETED").done

    def result(self, future: Any) -> Any:
        return future.result()

    def cancel(self, futures: Set[Any]) -> None:
        for future in futures:
            future.cancel()


def _cluster(on: Any) -> Any:
    """What blocks are given to."""
    if hasattr(on, "scheduler_info") and hasattr(on, "submit"):
        return _Dask(on)
    if getattr(on, "__name__", "") == "ray":
        if not on.is_initialized():
            raise ValueError("Ray has not been started: call ray.init() before")
        return _Ray(on)
    if hasattr(on, "submit"):
        return _Executor(on)
    raise TypeError(f"`on` is {type(on).__name__}: give a Dask client, the module ray, or an executor of concurrent.futures")


class _Rows(NamedTuple):
    """What is given to the rows: arrays with an axis for them are cut, everything else holds for all."""

    arrays: Dict[str, Any]
    cut: Dict[str, int]
    settings: Dict[str, Any]

    def of(self, begin: int, end: int) -> Tuple[Any, Any, Dict[str, Any]]:
        parts = {name: array[begin:end] if name in self.cut else array for name, array in self.arrays.items()}
        x0 = (parts.pop("q0"), parts.pop("v0")) if "q0" in parts else parts.pop("x0")
        u = parts.pop("u", None)
        return x0, u, {**parts, **self.settings}


def _rows(model: Any, x0: Any, u: Any, settings: Dict[str, Any]) -> _Rows:
    """Finds the arrays that have a row for each motion."""
    arrays = {"q0": x0[0], "v0": x0[1]} if isinstance(x0, tuple) and len(x0) == 2 else {"x0": x0}
    arrays.update({"u": u} if u is not None else {})
    moving = settings.get("drive_v") is not None
    axes = {"q0": 1, "v0": 1, "x0": 1, "u": 2, "params": 1, "wrenches": 2, "gravity": 1, "drive_q": 2 if moving else 1, "drive_v": 2}
    for name in ("params", "wrenches", "gravity", "drive_q", "drive_v"):
        given = settings.pop(name, None)
        if given is not None:
            arrays[name] = parameters(model, given) if name == "params" else given
    arrays = {name: np.asarray(array) for name, array in arrays.items()}
    cut = {name: len(array) for name, array in arrays.items() if array.ndim > axes[name]}
    if len(set(cut.values())) > 1:
        raise ValueError("numbers of rows differ: " + ", ".join(f"`{name}` has {count}" for name, count in cut.items()))
    return _Rows(arrays, cut, settings)


class _Gathered:
    """Results of blocks, put together in the order of the rows."""

    def __init__(self, rows: int) -> None:
        self.rows, self.q, self.v, self.forces = rows, None, None, None
        self.lists: Dict[int, Tuple[List[Any], List[Any]]] = {}

    def take(self, begin: int, motion: Rollout) -> None:
        if self.q is None:
            self.q, self.v = (np.empty((self.rows, *part.shape[1:])) for part in motion[:2])
            self.forces = None if motion.forces is None else np.empty((self.rows, *motion.forces.shape[1:]))
        end = begin + len(motion.q)
        self.q[begin:end], self.v[begin:end] = motion.q, motion.v
        if self.forces is not None:
            self.forces[begin:end] = motion.forces
        for failure in motion.failures:
            failure.row += begin
        self.lists[begin] = (motion.failures, [event._replace(row=event.row + begin) for event in motion.events])

    def rollout(self) -> Rollout:
        parts = [self.lists[begin] for begin in sorted(self.lists)]
        failures, events = ([item for part in parts for item in part[k]] for k in range(2))
        return Rollout(self.q, self.v, failures, events, self.forces)


class _Sizes:
    """Sizes of blocks: some rows at first, then what takes `seconds`, and no more than a worker's share of what is left."""

    def __init__(self, block: Optional[int], seconds: float, slots: int, rows: int) -> None:
        self.block, self.seconds, self.slots = block, seconds, slots
        self.first = max(1, min(16, rows // (8 * slots)))
        self.spent, self.done = 0.0, 0

    def measured(self, rows: int, seconds: float) -> None:
        self.spent, self.done = self.spent + seconds, self.done + rows

    def next(self, left: int) -> int:
        if self.block is not None:
            return min(self.block, left)
        share = math.ceil(left / self.slots)
        if not self.done:
            return min(self.first, share)
        return max(1, min(share, int(self.seconds * self.done / max(self.spent, 1e-9))))


def _show(done: int, rows: int) -> None:
    print(f"\r{done} of {rows} rows", end="\n" if done == rows else "", file=sys.stderr, flush=True)


def rollout(
    model: Any,
    x0: Any,
    u: Any = None,
    *,
    on: Any,
    block: Optional[int] = None,
    seconds: float = 2.0,
    retries: int = 3,
    progress: Union[bool, Callable[[int, int], None]] = False,
    threads: int = 1,
    on_error: str = "raise",
    **settings: Any,
) -> Rollout:
    """`Model.rollout` on many machines, whose settings it takes but ``out``.

    Arguments:
        ``on``: a Dask client, the module ``ray`` after ``ray.init()``, or an executor of ``concurrent.futures``.
        ``block``: rows of a block; without it, as many as take ``seconds`` by what blocks before have taken.
        ``retries``: how often a block is sent again whose worker failed. Errors in arguments are raised at once.
        ``progress``: ``True`` writes the number of finished rows to standard error; or a function of it and the number of all.
        ``threads``: threads of each block; a worker has one for each block that it computes at a time.

    The result has the bits of a local rollout if the workers' processors have the same vector instructions and fused
    multiplications; with models of ``arithmetic="exact"``, on all processors.
    """
    if on_error not in ("raise", "mark"):
        raise ValueError(f"`on_error` is {on_error!r}: take 'raise' or 'mark'")
    if block is not None and block < 1:
        raise ValueError(f"`block` is {block}: give at least one row")
    if "out" in settings:
        raise TypeError("`out` is not possible: results come from other machines")
    cluster, given = _cluster(on), _rows(model, x0, u, {**settings, "threads": threads})
    if not given.cut or not next(iter(given.cut.values())):
        x0, u, settings = given.of(0, 0)
        return model.rollout(x0, u, on_error=on_error, **settings)
    rows = next(iter(given.cut.values()))
    tell = _show if progress is True else progress or (lambda done, rows: None)
    motion = _run(cluster, zlib.compress(pickle.dumps(model)), given, rows, (block, seconds, retries), tell)
    if motion.failures and on_error == "raise":
        raise motion.failures[0]
    return motion


def _run(cluster: Any, text: bytes, given: _Rows, rows: int, how: Tuple[Any, float, int], tell: Any) -> Rollout:
    """Sends blocks, two for each slot at a time, and takes their results."""
    block, seconds, retries = how
    slots = cluster.slots()
    sizes, gathered = _Sizes(block, seconds, slots, rows), _Gathered(rows)
    again: Deque[Tuple[int, int, int]] = collections.deque()
    flying: Dict[Any, Tuple[int, int, int]] = {}
    begin, done = 0, 0
    try:
        while done < rows:
            while len(flying) < 2 * slots and (again or begin < rows):
                if again:
                    part = again.popleft()
                else:
                    part = (begin, begin + sizes.next(rows - begin), 0)
                    begin = part[1]
                flying[cluster.submit(text, *given.of(*part[:2]))] = part
            for future in cluster.wait(set(flying)):
                first, last, tried = flying.pop(future)
                try:
                    motion, spent = cluster.result(future)
                except FINAL:
                    raise
                except Exception:
                    if tried >= retries:
                        raise
                    again.append((first, last, tried + 1))
                    continue
                gathered.take(first, motion)
                sizes.measured(last - first, spent)
                done += last - first
                tell(done, rows)
    finally:
        if flying:
            cluster.cancel(set(flying))
    return gathered.rollout()
