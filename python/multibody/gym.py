"""Environments of Gymnasium for any model, with a reward of the user's. Needs ``pip install gymnasium``.

>>> envs = multibody.gym.make_vec(model, reward=lambda state: -state.q[:, 0] ** 2, num_envs=64, dt=1e-3, frame_skip=10)
>>> observations, info = envs.reset(seed=1)
>>> observations, rewards, terminated, truncated, info = envs.step(envs.action_space.sample())
"""

from __future__ import annotations

from typing import Any, Callable, NamedTuple, Optional, Tuple

import numpy as np

__all__ = ["State", "make", "make_vec"]


class State(NamedTuple):
    """States after a step, row by row: coordinates ``(B, nq)``, velocities ``(B, nv)``, actions ``(B, nv)``, times ``(B,)`` in s."""

    q: np.ndarray
    v: np.ndarray
    action: np.ndarray
    time: np.ndarray


Function = Callable[[State], np.ndarray]


def _gymnasium() -> Any:
    try:
        import gymnasium
        import gymnasium.vector  # noqa: F401
    except ImportError as error:
        raise ImportError("multibody.gym needs Gymnasium: pip install gymnasium") from error
    return gymnasium


class _Motion:
    """Rows of states, and how they go on; what both kinds of environments share."""

    def __init__(
        self,
        model: Any,
        reward: Function,
        rows: int,
        *,
        dt: float = 1e-3,
        frame_skip: int = 10,
        method: str = "rk4",
        max_episode_steps: int = 1000,
        terminated: Optional[Function] = None,
        reset: Optional[Callable[[np.random.Generator, int], Tuple[np.ndarray, np.ndarray]]] = None,
        action_limit: Any = None,
        params: Any = None,
        threads: Optional[int] = 1,
    ) -> None:
        self.model, self.reward, self.rows = model, reward, rows
        self.dt, self.frame_skip, self.method = dt, frame_skip, method
        self.max_episode_steps, self.terminated = max_episode_steps, terminated
        self.start, self.params, self.threads = reset or self.near_start, params, threads
        limit = model.max_effort if action_limit is None else np.broadcast_to(action_limit, (model.nv,))
        self.limit = np.where(np.isfinite(limit), limit, 1.0).astype(np.float64)
        self.q, self.v = np.zeros((rows, model.nq)), np.zeros((rows, model.nv))
        self.steps = np.zeros(rows, dtype=np.int64)

    def near_start(self, random: np.random.Generator, rows: int) -> Tuple[np.ndarray, np.ndarray]:
        """The model's start, closed, with small velocities."""
        q, v = self.model.start()
        q = np.tile(self.model.close(q), (rows, 1))
        return q, v + random.uniform(-0.01, 0.01, (rows, self.model.nv))

    def reset(self, random: np.random.Generator, which: np.ndarray) -> None:
        q, v = self.start(random, int(which.sum()))
        self.q[which], self.v[which], self.steps[which] = q, v, 0

    def observations(self) -> np.ndarray:
        return np.concatenate([self.q, self.v], axis=1)

    def step(self, actions: np.ndarray) -> Tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Rewards, ends by the user's rule or by a failure, ends by time."""
        actions = np.clip(np.asarray(actions, dtype=np.float64), -self.limit, self.limit)
        u = np.broadcast_to(actions[:, None, :], (self.rows, self.frame_skip, self.model.nv))
        motion = self.model.rollout(
            (self.q, self.v),
            u,
            dt=self.dt,
            method=self.method,
            every=self.frame_skip,
            params=self.params,
            threads=self.threads,
            on_error="mark",
        )
        failed = np.isnan(motion.q[:, -1]).any(axis=1) | np.isnan(motion.v[:, -1]).any(axis=1)
        # A row that fails stays where it was and ends.
        self.q = np.where(failed[:, None], self.q, motion.q[:, -1])
        self.v = np.where(failed[:, None], self.v, motion.v[:, -1])
        self.steps += 1
        state = State(self.q, self.v, actions, self.steps * self.dt * self.frame_skip)
        rewards = np.broadcast_to(np.asarray(self.reward(state), dtype=np.float64), (self.rows,)).copy()
        ends = failed if self.terminated is None else failed | np.asarray(self.terminated(state), dtype=bool)
        return rewards, ends, self.steps >= self.max_episode_steps


def make(model: Any, reward: Function, **settings: Any) -> Any:
    """An environment (`gymnasium.Env`) of one state. Settings as of `make_vec`; functions see batches of one row."""
    gymnasium = _gymnasium()
    motion = _Motion(model, reward, 1, **settings)
    observations, actions = _spaces(gymnasium, model, motion)

    class Environment(gymnasium.Env):
        """A mechanism as an environment."""

        metadata = {"render_modes": []}
        render_mode = None
        observation_space, action_space = observations, actions

        def reset(self, *, seed: Any = None, options: Any = None) -> Any:
            super().reset(seed=seed)
            motion.reset(self.np_random, np.ones(1, dtype=bool))
            return motion.observations()[0], {}

        def step(self, action: Any) -> Any:
            rewards, ends, cut = motion.step(np.asarray(action)[None])
            return motion.observations()[0], float(rewards[0]), bool(ends[0]), bool(cut[0]), {}

    return Environment()


def make_vec(model: Any, reward: Function, num_envs: int, **settings: Any) -> Any:
    """A vectorised environment (`gymnasium.vector.VectorEnv`) of ``num_envs`` states of one model.

    Observations are ``[q, v]``, actions joint forces ``(nv,)``, N m or N, within the efforts of the model (1 where it states none)
    or ``action_limit``. ``reward`` and ``terminated`` take a `State` and give one number, or truth, for each row. ``reset`` takes
    a generator of random numbers and a number of rows, and gives coordinates and velocities. ``dt`` is the step of integration,
    s, ``frame_skip`` the number of steps under one action, ``max_episode_steps`` the time limit (truncation), ``params`` the
    parameters of every row, ``threads`` the number of threads. Rows that end are reset at the next step, whose action and
    reward do not count (``AutoresetMode.NEXT_STEP``). A row whose motion fails is terminated.
    """
    gymnasium = _gymnasium()
    motion = _Motion(model, reward, num_envs, **settings)
    observations, actions = _spaces(gymnasium, model, motion)
    vector = gymnasium.vector

    class VectorEnvironment(vector.VectorEnv):
        """Many states of one mechanism as environments."""

        metadata = {"render_modes": [], "autoreset_mode": vector.AutoresetMode.NEXT_STEP}

        def __init__(self) -> None:
            self.num_envs = num_envs
            self.single_observation_space, self.single_action_space = observations, actions
            self.observation_space = vector.utils.batch_space(observations, num_envs)
            self.action_space = vector.utils.batch_space(actions, num_envs)
            self.ended = np.zeros(num_envs, dtype=bool)

        def reset(self, *, seed: Any = None, options: Any = None) -> Any:
            super().reset(seed=seed)
            which = np.ones(num_envs, dtype=bool)
            if options and "reset_mask" in options:
                which = np.asarray(options["reset_mask"], dtype=bool)
            motion.reset(self.np_random, which)
            self.ended[which] = False
            return motion.observations(), {}

        def step(self, actions: Any) -> Any:
            before = self.ended
            rewards, ends, cut = motion.step(actions)
            if before.any():
                motion.reset(self.np_random, before)
                rewards[before] = 0.0
            ends, cut = ends & ~before, cut & ~before
            self.ended = ends | cut
            return motion.observations(), rewards, ends, cut, {}

    return VectorEnvironment()


def _spaces(gymnasium: Any, model: Any, motion: _Motion) -> Any:
    n = model.nq + model.nv
    observations = gymnasium.spaces.Box(-np.inf, np.inf, (n,), dtype=np.float64)
    return observations, gymnasium.spaces.Box(-motion.limit, motion.limit, dtype=np.float64)
