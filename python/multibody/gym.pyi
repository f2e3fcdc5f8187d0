from typing import Any, Callable, List, Literal, NamedTuple, Optional, Tuple, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import Model

_Array = NDArray[np.float64]

__all__: List[str]

class State(NamedTuple):
    q: _Array
    v: _Array
    action: _Array
    time: _Array
    forces: _Array

def make(
    model: Model,
    reward: Callable[[State], ArrayLike],
    *,
    dt: float = ...,
    frame_skip: int = ...,
    method: str = ...,
    max_episode_steps: int = ...,
    terminated: Optional[Callable[[State], ArrayLike]] = ...,
    reset: Optional[Callable[[np.random.Generator, int], Tuple[ArrayLike, ArrayLike]]] = ...,
    action_limit: Union[ArrayLike, Tuple[ArrayLike, ArrayLike], None] = ...,
    params: Any = ...,
    threads: Optional[int] = ...,
    control: Literal["efforts", "targets"] = ...,
    contacts: Optional[Literal["automatic", "events", "steps"]] = ...,
    observe: Optional[Callable[[State], ArrayLike]] = ...,
) -> Any: ...
def make_vec(
    model: Model,
    reward: Callable[[State], ArrayLike],
    num_envs: int,
    *,
    dt: float = ...,
    frame_skip: int = ...,
    method: str = ...,
    max_episode_steps: int = ...,
    terminated: Optional[Callable[[State], ArrayLike]] = ...,
    reset: Optional[Callable[[np.random.Generator, int], Tuple[ArrayLike, ArrayLike]]] = ...,
    action_limit: Union[ArrayLike, Tuple[ArrayLike, ArrayLike], None] = ...,
    params: Any = ...,
    threads: Optional[int] = ...,
    control: Literal["efforts", "targets"] = ...,
    contacts: Optional[Literal["automatic", "events", "steps"]] = ...,
    observe: Optional[Callable[[State], ArrayLike]] = ...,
) -> Any: ...
