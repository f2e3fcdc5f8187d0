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
    """States after a step, row by row: coordinates ``(B, nq)``, velocities ``(B, nv)``, actions ``(B, n)``, times ``(B,)`` in s,
    and forces of contacts ``(B, C, 3)``, N, along their normals and two tangents."""

    q: np.ndarray
    v: np.ndarray
    action: np.ndarray
    time: np.ndarray
    forces: np.ndarray


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
        control: str = "efforts",
        contacts: Optional[str] = None,
        observe: Optional[Function] = None,
    ) -> None:
        self.model, self.reward, self.rows = model, reward, rows
        self.dt, self.frame_skip, self.method = dt, frame_skip, method
        self.max_episode_steps, self.terminated = max_episode_steps, terminated
        self.start, self.params, self.threads = reset or self.near_start, params, threads
        touches = len(model.contact_names) > 0
        self.contacts = contacts or ("steps" if touches else "automatic")
        self.axes, self.scale, self.low, self.high = self.actions(control, action_limit)
        self.observe = observe or (lambda state: np.concatenate([state.q, state.v], axis=1))
        self.touches, self.steps = touches, np.zeros(rows, dtype=np.int64)
        shapes = [(model.nq,), (model.nv,), self.axes.shape, (), (len(model.contact_names), 3)]
        self.state = State(*(np.zeros((rows, *shape)) for shape in shapes))
        # Before the first reset it is a state, too: functions of the user are called on it for the shapes of what they give.
        self.state.q[:], self.state.v[:] = model.start()

    def actions(self, control: str, limit: Any) -> Tuple[np.ndarray, ...]:
        """Velocities on which actions act, the efforts of actions of 1 (N m or N), least and greatest actions."""
        axes = self.model.axes
        if control == "efforts":
            scale = np.ones(len(axes))
            high = np.where(np.isfinite(self.model.max_effort[axes]), self.model.max_effort[axes], 1.0)
            low = -high
        elif control == "targets":
            axes = axes[self.model.kp[axes] > 0]
            if not len(axes):
                raise ValueError("control='targets' needs joints with gains: multibody.load(..., gains=(kp, kd))")
            scale, ranges = self.model.kp[axes], self.model.joint_ranges[axes]
            # Where one end of a range is missing, it is a turn away from the other if that is beyond π.
            low, high = ranges.T
            low, high = (
                np.where(np.isfinite(low), low, np.minimum(-np.pi, np.where(np.isfinite(high), high, np.pi) - 2 * np.pi)),
                np.where(np.isfinite(high), high, np.maximum(np.pi, np.where(np.isfinite(low), low, -np.pi) + 2 * np.pi)),
            )
        else:
            raise ValueError(f"`control` is {control!r}: take 'efforts' or 'targets'")
        if isinstance(limit, tuple):
            low, high = limit
        elif limit is not None:
            low, high = -np.asarray(limit), limit
        whole = [np.broadcast_to(np.asarray(end, dtype=np.float64), axes.shape) for end in (low, high)]
        if (whole[0] > whole[1]).any() or (len(axes) and (whole[0] == whole[1]).all()):
            raise ValueError(f"`action_limit` is {limit!r}: give a bound from 0 on, or a tuple of the least and the greatest action")
        return axes, scale, whole[0], whole[1]

    def near_start(self, random: np.random.Generator, rows: int) -> Tuple[np.ndarray, np.ndarray]:
        """The model's start, closed, with small velocities."""
        q, v = self.model.start()
        q = np.tile(self.model.close(q), (rows, 1))
        return q, v + random.uniform(-0.01, 0.01, (rows, self.model.nv))

    def reset(self, random: np.random.Generator, which: np.ndarray) -> None:
        q, v = self.start(random, int(which.sum()))
        self.state.q[which], self.state.v[which], self.steps[which] = q, v, 0
        self.state.action[which], self.state.time[which], self.state.forces[which] = 0, 0, 0

    def observations(self) -> np.ndarray:
        # A copy: what `observe` gives may be a view of the state.
        return np.array(self.observe(self.state), dtype=np.float64)

    def step(self, actions: np.ndarray) -> Tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Rewards, ends by the user's rule or by a failure, ends by time."""
        actions = np.asarray(actions, dtype=np.float64)
        if actions.shape != (self.rows, len(self.axes)):
            raise ValueError(f"actions have the shape {actions.shape}: {self.rows} states with {len(self.axes)} actions each are expected")
        actions = np.clip(actions, self.low, self.high)
        u = np.zeros((self.rows, 1, self.model.nv))
        u[:, 0, self.axes] = self.scale * actions
        motion = self.model.rollout(
            (self.state.q, self.state.v),
            np.broadcast_to(u, (self.rows, self.frame_skip, self.model.nv)),
            dt=self.dt,
            method=self.method,
            every=self.frame_skip,
            params=self.params,
            contacts=self.contacts,
            forces=self.touches,
            threads=self.threads,
            on_error="mark",
        )
        failed = np.isnan(motion.q[:, -1]).any(axis=1) | np.isnan(motion.v[:, -1]).any(axis=1)
        # A row that fails stays where it was and ends.
        q = np.where(failed[:, None], self.state.q, motion.q[:, -1])
        v = np.where(failed[:, None], self.state.v, motion.v[:, -1])
        forces = self.state.forces
        if self.touches:
            forces = np.where(failed[:, None, None], forces, motion.forces[:, -1])
        self.steps += 1
        self.state = State(q, v, actions, self.steps * self.dt * self.frame_skip, forces)
        rewards = np.broadcast_to(np.asarray(self.reward(self.state), dtype=np.float64), (self.rows,)).copy()
        ends = failed if self.terminated is None else failed | np.asarray(self.terminated(self.state), dtype=bool)
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

    ``control`` says what actions are: ``"efforts"``, joint forces, N m or N, within the efforts of the model (1 where it states
    none), or ``"targets"``, positions of joints, rad or m, within their ranges (π where there are none), which a model that was
    loaded with ``gains=`` follows. Both act on the axes ``model.axes`` alone (``"targets"`` on those with gains), and not on what is
    free in space. ``action_limit`` is another bound, or a tuple of the least and the greatest action.

    Observations are ``[q, v]``, or what ``observe`` gives. ``observe``, ``reward`` and ``terminated`` take a `State` of all rows and
    give an array ``(B, n)``, one number, and truth for each row. ``reset`` takes a generator of random numbers and a number of
    rows, and gives coordinates and velocities. ``dt`` is the step of integration, s, ``frame_skip`` the number of steps under one
    action, ``max_episode_steps`` the time limit (truncation), ``params`` the parameters of every row, ``threads`` the number of
    threads. Contacts are followed by time steps of ``dt``, or as ``contacts`` says (see `Model.rollout`). Rows that end are reset
    at the next step, whose action and reward do not count (``AutoresetMode.NEXT_STEP``). A row whose motion fails is terminated.
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
    box = gymnasium.spaces.Box
    return box(-np.inf, np.inf, motion.observations().shape[1:], dtype=np.float64), box(motion.low, motion.high, dtype=np.float64)
