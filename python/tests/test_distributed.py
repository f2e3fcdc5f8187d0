"""Rollouts on other processes: bits, order, failures of workers, errors, progress."""

import concurrent.futures
import multiprocessing
import pickle
import signal
import subprocess
import sys
import threading
import zlib

import numpy as np
import pytest
from conftest import MODELS, states

import multibody
import multibody.distributed as many


@pytest.fixture(scope="module")
def pool():
    with concurrent.futures.ProcessPoolExecutor(2, mp_context=multiprocessing.get_context("spawn")) as pool:
        yield pool


def same(one, two):
    return all(np.array_equal(a, b, equal_nan=True) for a, b in zip(one[:2], two[:2]))


def test_models_are_pickled_as_texts(arm, robot, tmp_path):
    q, v = states(arm, 3)
    again = pickle.loads(pickle.dumps(arm))
    assert (again.accelerations(q, v) == arm.accelerations(q, v)).all()
    assert pickle.loads(pickle.dumps(robot)).nq == 19
    wrenched = multibody.load(MODELS / "ur5.urdf", wrenches=["forearm_link"], gravity=(0, 0, -1), search=False)
    assert pickle.loads(pickle.dumps(wrenched)).wrench_names == ["forearm_link"]
    # Files that a description reads travel with it.
    (tmp_path / "base.urdf").write_text((MODELS / "ur5.urdf").read_text())
    (tmp_path / "over.toml").write_text('[base]\nfile = "base.urdf"\n')
    text = pickle.dumps(multibody.load(tmp_path / "over.toml", search=False))
    (tmp_path / "base.urdf").unlink()
    assert pickle.loads(text).nv == 6


def test_a_worker_reads_a_model_once(arm, monkeypatch):
    text, loads = zlib.compress(pickle.dumps(arm)), []
    read = pickle.loads
    monkeypatch.setattr(many.pickle, "loads", lambda text: loads.append(text) or read(text))
    assert many._model(text) is many._model(text) and len(loads) == 1
    # Texts that differ in bytes behind their ends, which are not read. Of too many, the one goes that was used the longest time ago.
    others = [text + bytes([k]) for k in range(many.KEPT)]
    monkeypatch.setattr(many.zlib, "decompress", lambda text: zlib.decompressobj().decompress(text))
    for other in others[: many.KEPT - 1]:
        many._model(other)
    many._model(text)
    assert len(loads) == many.KEPT
    many._model(others[-1])
    assert text in many._models and others[0] not in many._models and len(many._models) == many.KEPT
    many._models.clear()


def test_blocks_change_no_bit(arm, pool):
    q, v = states(arm, 23)
    u = np.random.default_rng(1).uniform(-1, 1, (23, 40, arm.nv))
    local = arm.rollout((q, v), u, dt=1e-3)
    told = []
    for block in (None, 1, 7, 100):
        motion = many.rollout(arm, (q, v), u, dt=1e-3, on=pool, block=block, progress=lambda done, rows: told.append((done, rows)))
        assert same(local, motion), block
        assert told[-1] == (23, 23)
    joined = many.rollout(arm, np.concatenate([q, v], axis=1), u[0], dt=1e-3, on=pool, block=9)
    assert same(joined, arm.rollout((q, v), u[0], dt=1e-3))
    single = many.rollout(arm, (q[0], v[0]), u[0], dt=1e-3, on=pool)
    assert single.q.shape == (41, 6) and (single.q == local.q[0]).all()


def test_parameters_failures_and_events_keep_their_rows(pool):
    tool = multibody.load(MODELS / "ur5_tool.toml", search=False)
    q, v = states(tool, 1)
    loads = np.linspace(0, 5, 9)
    motion = many.rollout(tool, (q[0], v[0]), dt=1e-3, steps=5, params={"load": loads}, on=pool, block=2)
    assert same(motion, tool.rollout((q[0], v[0]), dt=1e-3, steps=5, params={"load": loads}))
    ball = multibody.load(MODELS / "contacts" / "bouncing_ball.toml")
    q, v = (np.tile(part, (6, 1)) for part in ball.start())
    v[:, 0] = np.arange(6)
    q[4] = np.nan
    settings = dict(dt=0.05, steps=12, tolerance=1e-8, events=True, forces=True, on_error="mark")
    local, far = ball.rollout((q, v), **settings), many.rollout(ball, (q, v), **settings, on=pool, block=2)
    assert same(local, far) and np.array_equal(local.forces, far.forces, equal_nan=True)
    assert local.events == far.events and len(local.events) == 5 and [failure.row for failure in far.failures] == [4]
    with pytest.raises(multibody.SimulationError) as raised:
        many.rollout(ball, (q, v), **{**settings, "on_error": "raise"}, on=pool, block=1)
    assert raised.value.row == 4


def test_wrong_arguments(arm, pool):
    q, v = states(arm, 4)
    for wrong, words in (
        (dict(u=np.zeros((3, 5, 6))), "numbers of rows differ"),
        (dict(u=np.zeros((4, 5, 5))), "`u` has the shape"),
        (dict(steps=3, block=0), "`block` is 0"),
        (dict(steps=3, method="rk5"), "no method is called"),
        (dict(steps=3, on_error="x"), "take 'raise' or 'mark'"),
    ):
        with pytest.raises(ValueError, match=words):
            many.rollout(arm, (q, v), dt=1e-3, on=pool, **wrong)
    with pytest.raises(TypeError, match="give a Dask client"):
        many.rollout(arm, (q, v), dt=1e-3, steps=1, on="cluster")
    with pytest.raises(TypeError, match="`out` is not possible"):
        many.rollout(arm, (q, v), dt=1e-3, steps=1, on=pool, out=(q, v))


class Failing:
    """An executor whose blocks fail now and then, as workers do that are lost."""

    _max_workers = 2

    def __init__(self, fails):
        self.fails, self.sent = fails, 0

    def submit(self, function, *arguments):
        self.sent += 1
        future = concurrent.futures.Future()
        if self.fails(self.sent):
            future.set_exception(OSError("the worker is gone"))
        else:
            future.set_result(function(*arguments))
        return future


def test_blocks_that_fail_are_sent_again(arm):
    q, v = states(arm, 12)
    local = arm.rollout((q, v), dt=1e-3, steps=5)
    pool = Failing(lambda sent: sent % 3 == 1)
    assert same(local, many.rollout(arm, (q, v), dt=1e-3, steps=5, on=pool, block=2)) and pool.sent > 6
    pool = Failing(lambda sent: True)
    with pytest.raises(OSError, match="the worker is gone"):
        many.rollout(arm, (q, v), dt=1e-3, steps=5, on=pool, block=12, retries=2)
    assert pool.sent == 3


def test_blocks_follow_the_measured_cost():
    sizes = many._Sizes(None, 2.0, 2, 1000)
    assert sizes.next(1000) == 16
    sizes.measured(16, 0.16)
    assert sizes.next(984) == 200 and sizes.next(100) == 50
    sizes.measured(200, 400.0)
    assert sizes.next(784) == 1


def test_dask_with_a_worker_that_is_killed(arm):
    """Two workers, of which one is killed while both compute."""
    distributed = pytest.importorskip("distributed")
    q, v = states(arm, 40)
    local = arm.rollout((q, v), dt=1e-4, steps=2000)
    with distributed.LocalCluster(n_workers=0, dashboard_address=None) as cluster:
        # Nobody starts these again.
        command = [sys.executable, "-m", "distributed.cli.dask_worker", cluster.scheduler_address]
        command += ["--no-nanny", "--nthreads", "1", "--no-dashboard"]
        workers = [subprocess.Popen(command, stderr=subprocess.DEVNULL) for _ in range(2)]
        try:
            with distributed.Client(cluster) as client:
                client.wait_for_workers(2, timeout=60)
                # In the middle of the blocks that follow the first.
                kill = threading.Timer(0.02, workers[0].kill)
                told = lambda done, rows: kill.ident or kill.start()  # noqa: E731
                motion = many.rollout(arm, (q, v), dt=1e-4, steps=2000, on=client, block=2, progress=told)
                assert workers[0].wait(10) == -signal.SIGKILL and len(client.nthreads()) == 1
        finally:
            for worker in workers:
                worker.kill()
                worker.wait()
    assert same(local, motion)


def test_ray(arm):
    """By hand, `pip install ray`: `.ci/python.sh -k ray`."""
    ray = pytest.importorskip("ray")
    q, v = states(arm, 20)
    ray.init(num_cpus=2, include_dashboard=False)
    try:
        motion = many.rollout(arm, (q, v), dt=1e-3, steps=200, on=ray, block=3)
        with pytest.raises(ValueError, match="no method is called"):
            many.rollout(arm, (q, v), dt=1e-3, steps=200, on=ray, method="rk5")
    finally:
        ray.shutdown()
    assert same(arm.rollout((q, v), dt=1e-3, steps=200), motion)
