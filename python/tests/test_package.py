"""The stubs, the documentation, the environments."""

import concurrent.futures
import importlib.util
import inspect
import pathlib
import re
import subprocess
import sys

import numpy as np
import pytest
from conftest import MODELS, REPOSITORY

import multibody
import multibody.distributed
import multibody.gym

PACKAGE = pathlib.Path(multibody.__file__).parent


def public(of):
    return [name for name in dir(of) if not name.startswith("_")]


def test_every_public_name_is_documented_and_in_the_stubs():
    stub = (PACKAGE / "__init__.pyi").read_text()
    for name in multibody.__all__:
        assert inspect.getdoc(getattr(multibody, name)), name
        assert re.search(rf"^(def|class) {name}\b|^{name}:|import .*\b{name}\b", stub, re.M), name
    inside = stub[stub.index("class Model") :]
    for name in public(multibody.Model):
        assert inspect.getdoc(getattr(multibody.Model, name)), name
        assert re.search(rf"^    def {name}\(", inside, re.M), name
    for module in (multibody.gym, multibody.distributed):
        text = (PACKAGE / module.__name__.split(".")[-1]).with_suffix(".pyi").read_text()
        for name in module.__all__:
            assert inspect.getdoc(getattr(module, name)), name
            assert re.search(rf"^(def|class) {name}\b", text, re.M), name
    assert (PACKAGE / "py.typed").exists()


def test_the_stubs_are_those_of_the_table():
    specification = importlib.util.spec_from_file_location("make_stubs", REPOSITORY / "python" / "make_stubs.py")
    make_stubs = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(make_stubs)
    assert make_stubs.text() == (PACKAGE / "__init__.pyi").read_text()


def test_outputs_are_methods_with_shapes_and_units_in_their_documentation():
    for name, arguments, results, doc in multibody.outputs():
        method = getattr(multibody.Model, name)
        units = multibody._methods.UNITS
        assert all(f"{units[a]}\n" in method.__doc__ for a, _ in arguments)
        # What is not in the table of units is described above.
        assert all(r in units or len(doc) > 20 for r, _ in results)
        assert list(inspect.signature(method).parameters)[1 : 1 + len(arguments)] == [a for a, _ in arguments]
        assert all(f"``{r}``" in method.__doc__ for r, _ in results)


def test_import_is_light():
    code = "import sys, multibody; print([m for m in ('gymnasium', 'torch', 'mujoco', 'distributed', 'ray') if m in sys.modules])"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.strip() == "[]"


def test_import_takes_no_longer_than_numpy_and_a_little():
    """Most of the time is NumPy's; what is added is less than 0.1 s, here in processor time, which others disturb less."""
    code = """import time
t = time.process_time(); import numpy
u = time.process_time(); import multibody
print(time.process_time() - u, u - t)"""
    run = [sys.executable, "-c", code]
    added = [float(subprocess.run(run, capture_output=True, text=True, check=True).stdout.split()[0]) for _ in range(3)]
    assert min(added) < 0.1, added


def blocks():
    page = REPOSITORY / "book" / "src" / "python.md"
    return re.findall(r"^```python\n(.*?)^```", page.read_text(), re.M | re.S)


def test_the_programs_of_the_book_run(monkeypatch):
    monkeypatch.chdir(REPOSITORY)
    names = {}
    for block in blocks():
        if "gymnasium" in block or "multibody.gym" in block:
            pytest.importorskip("gymnasium")
        exec(compile(block, "python.md", "exec"), names)  # noqa: S102
    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        names["search"](pool)


def environment(**settings):
    pendulum = multibody.load(MODELS / "double_pendulum.toml")
    return pendulum, dict(reward=lambda s: -np.square(s.q).sum(axis=1), action_limit=2.0, **settings)


@pytest.mark.filterwarnings("ignore")
def test_gymnasium_accepts_the_environment():
    pytest.importorskip("gymnasium")
    from gymnasium.utils.env_checker import check_env

    pendulum, settings = environment()
    check_env(multibody.gym.make(pendulum, **settings), skip_render_check=True)


def test_vectors_of_environments():
    gymnasium = pytest.importorskip("gymnasium")
    pendulum, settings = environment(max_episode_steps=3, terminated=lambda s: s.q[:, 0] > 1e9)
    envs = multibody.gym.make_vec(pendulum, num_envs=4, **settings)
    assert isinstance(envs, gymnasium.vector.VectorEnv) and envs.metadata["autoreset_mode"].value == "NextStep"
    first, _ = envs.reset(seed=1)
    again, _ = envs.reset(seed=1)
    assert (first == again).all() and first.shape == (4, 4) and envs.observation_space.contains(first)
    actions = np.ones((4, 2))
    for k in range(3):
        observations, rewards, terminated, truncated, _ = envs.step(actions)
        assert not terminated.any() and (truncated == (k == 2)).all() and (rewards < 0).all()
    observations, rewards, terminated, truncated, _ = envs.step(actions)
    assert (rewards == 0).all() and not truncated.any() and abs(observations).max() <= 0.011
    for wrong in (-1.0, (2.0, 2.0), (1.0, -1.0)):
        with pytest.raises(ValueError, match="action_limit"):
            multibody.gym.make(pendulum, **{**settings, "action_limit": wrong})
    single = multibody.gym.make(pendulum, **settings)
    single.reset(seed=1)
    assert single.step(np.ones(2))[0].shape == (4,)
    for wrong in (np.zeros(4), np.zeros((4, 1)), 0.3):
        with pytest.raises(ValueError, match="2 actions each are expected"):
            envs.step(wrong)


def test_observations_are_copies_and_begin_with_a_state():
    pytest.importorskip("gymnasium")
    robot = multibody.load(MODELS / "solo12.urdf", base="floating", search=False)

    def observe(state):
        assert (abs(np.square(state.q[:, 3:7]).sum(axis=1) - 1) < 1e-9).all()
        return state.q

    envs = multibody.gym.make_vec(robot, lambda state: state.q[:, 2], 3, observe=observe)
    first, _ = envs.reset(seed=1)
    kept = first.copy()
    first[:] = 7.0
    second, *_ = envs.step(np.zeros((3, 12)))
    assert abs(second - kept).max() < 0.1
    before = second.copy()
    envs.reset(seed=2)
    assert (second == before).all()


def test_targets_of_joints_with_one_end():
    pytest.importorskip("gymnasium")
    text = """
name = "lift"
[[body]]
name = "cabin"
mass = 1
[[joint]]
name = "rail"
type = "prismatic"
child = "cabin"
start = 5
range = { lower = 4 }
"""
    lift = multibody.load(text=text, format="toml", gains=(100.0, 10.0))
    space = multibody.gym.make(lift, lambda state: state.q[:, 0], control="targets").action_space
    assert space.low == [4.0] and space.high == [4.0 + 2 * np.pi]


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("file", ["mechanisms/fourbar.toml", "satellite.toml", "ur5_tool.toml"])
def test_environments_of_loops_prescribed_joints_and_parameters(file):
    """Loops stay closed, and parameters may differ from row to row."""
    pytest.importorskip("gymnasium")
    from gymnasium.utils.env_checker import check_env

    model = multibody.load(MODELS / file, search=False)
    params = None
    if model.parameter_defaults.size:
        params = model.parameter_defaults * np.array([[1.0], [1.0], [1.1]])
    settings = dict(reward=lambda state: np.square(state.v).sum(axis=1), frame_skip=5)
    check_env(multibody.gym.make(model, **settings), skip_render_check=True)
    q, v = model.start()
    start = model.close(q), v
    envs = multibody.gym.make_vec(model, num_envs=3, reset=lambda random, rows: start, params=params, **settings)
    envs.reset(seed=1)
    actions = np.full((3, *envs.single_action_space.shape), 0.1)
    for _ in range(20):
        observations, rewards, terminated, truncated, _ = envs.step(actions)
        assert not terminated.any() and not truncated.any() and np.isfinite(rewards).all()
    assert (observations[0] == observations[1]).all()
    assert (observations[0] != observations[2]).any() == (params is not None)
    if "constraint_residuals" in model.outputs:
        assert abs(model.constraint_residuals(observations[:, : model.nq]).residual).max() < 1e-9


@pytest.mark.filterwarnings("ignore")
def test_environments_with_contacts():
    """A quadruped that is held at the positions of its joints stays up on its feet, which carry its weight."""
    pytest.importorskip("gymnasium")
    from gymnasium.utils.env_checker import check_env

    dog = multibody.load(MODELS / "contacts" / "quadruped.toml", gains=(20.0, 0.5), search=False)
    stand = dog.start()[0][7:]
    settings = dict(
        reward=lambda state: state.forces[:, :4, 0].sum(axis=1),
        terminated=lambda state: state.q[:, 2] < 0.1,
        observe=lambda state: np.concatenate([state.q[:, 2:], state.v, state.forces[:, :4, 0] > 0], axis=1),
        control="targets",
        dt=2e-3,
        frame_skip=10,
    )
    check_env(multibody.gym.make(dog, **settings), skip_render_check=True)
    envs = multibody.gym.make_vec(dog, num_envs=3, **settings)
    first, _ = envs.reset(seed=1)
    assert first.shape == (3, 17 + 18 + 4) and envs.single_action_space.shape == (12,)
    assert (envs.single_action_space.low[2::3] == [-2.6, -2.6, 0.1, 0.1]).all()
    for _ in range(75):
        observations, rewards, terminated, truncated, _ = envs.step(np.tile(stand, (3, 1)))
        assert not terminated.any() and not truncated.any()
    weight = 9.81 * dog.mass_matrix(dog.neutral())[0, 0]
    assert (observations[:, -4:] == 1).all() and abs(rewards - weight).max() < 1e-2 * weight
    # The same with its motors off: it falls.
    slack = multibody.load(MODELS / "contacts" / "quadruped.toml", search=False)
    envs = multibody.gym.make_vec(slack, num_envs=1, **(settings | {"control": "efforts"}))
    envs.reset(seed=1)
    assert envs.single_action_space.shape == (12,)
    assert any(envs.step(np.zeros((1, 12)))[2].any() for _ in range(75))
    with pytest.raises(ValueError, match="gains"):
        multibody.gym.make(slack, **settings)
