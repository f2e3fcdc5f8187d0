from typing import Any, Callable, List, Optional, Tuple, Union

from numpy.typing import ArrayLike

from . import Model, Rollout

__all__: List[str]

def rollout(
    model: Model,
    x0: Union[ArrayLike, Tuple[ArrayLike, ArrayLike]],
    u: Optional[ArrayLike] = ...,
    *,
    on: Any,
    block: Optional[int] = ...,
    seconds: float = ...,
    retries: int = ...,
    progress: Union[bool, Callable[[int, int], None]] = ...,
    threads: int = ...,
    on_error: str = ...,
    **settings: Any,
) -> Rollout: ...
