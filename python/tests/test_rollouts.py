"""Rollouts: order, bits, layouts, failures, interrupts."""

import os
import pickle
import signal
import threading
import time

import numpy as np
import pytest
from conftest import MODELS, states

import multibody


def test_gains_are_a_controller(arm):
    """Springs and dampers with the joint forces `kp q*` are a PD controller, and travel with the model."""
    gains = {name: (400.0 / (k + 1), 40.0 / (k + 1)) for k, name in enumerate(arm.velocity_names) if "wrist" not in name}
    held = multibody.load(MODELS / "ur5.urdf", gains=gains)
    assert (held.kp > 0).sum() == 3 and (held.kd[held.kp > 0] == held.kp[held.kp > 0] / 10).all()
    (q, v), targets = states(arm, 20), states(arm, 20, seed=1)[0]
    wanted = arm.accelerations(q, v, tau=held.kp * (targets - q) - held.kd * v)
    copy = pickle.loads(pickle.dumps(held))
    assert (copy.kp == held.kp).all()
    for model in (held, copy):
        np.testing.assert_allclose(model.accelerations(q, v, tau=held.kp * targets), wanted, rtol=1e-9, atol=1e-9)
    # A spring that was there goes on to pull to where it did.
    text = (MODELS / "contacts" / "quadruped_hop.toml").read_text()
    dog, stiffer = multibody.load(text=text, search=False), multibody.load(text=text, search=False, gains=(2.0, 0.1))
    q, v = states(dog, 20)
    extra = stiffer.kp * (0 - np.insert(q[:, 7:], [0] * 6, 0, axis=1)) - stiffer.kd * v
    wanted = dog.accelerations(q, v, tau=extra)
    np.testing.assert_allclose(stiffer.accelerations(q, v), wanted, rtol=1e-9, atol=1e-6)
    # What is free in space has no axes.
    assert (dog.axes == np.arange(6, 18)).all() and (stiffer.kp[:6] == 0).all()
    with pytest.raises(multibody.ModelError, match="did you mean"):
        multibody.load(MODELS / "ur5.urdf", gains={"elbow_join": (1.0, 1.0)})
    with pytest.raises(ValueError, match="from 0 on"):
        multibody.load(MODELS / "ur5.urdf", gains=(-1.0, 1.0))


def test_energy_error_falls_with_the_fourth_power(arm):
    q, v = states(arm, 1)
    errors = []
    for n in (200, 400):
        motion = arm.rollout((q[0], v[0]), dt=0.5 / n, steps=n)
        energy = arm.energy(motion.q, arm.momenta(motion.q, motion.v)).sum(axis=1)
        errors.append(abs(energy - energy[0]).max())
    assert 12 < errors[0] / errors[1] < 24, errors


@pytest.mark.parametrize("name", ["arm", "robot", "linkage"])
def test_threads_and_batches_change_no_bit(name, request):
    model = request.getfixturevalue(name)
    q, v = states(model, 7)
    if name == "linkage":
        q, v = np.tile(model.close(model.start()[0]), (7, 1)), v
    u = np.random.default_rng(3).uniform(-1, 1, (7, 50, model.nv))
    one = model.rollout((q, v), u, dt=1e-3, threads=1)
    for threads in (2, 3, 16, None):
        many = model.rollout((q, v), u, dt=1e-3, threads=threads)
        assert (many.q == one.q).all() and (many.v == one.v).all()
    for k in (0, 6):
        row = model.rollout((q[k], v[k]), u[k], dt=1e-3)
        assert (row.q == one.q[k]).all() and (row.v == one.v[k]).all()
    assert one.q.shape == (7, 51, model.nq) and one.v.shape == (7, 51, model.nv)
    last = model.rollout((q, v), u, dt=1e-3, every=50)
    assert (last.q[:, -1] == one.q[:, -1]).all() and last.q.shape == (7, 2, model.nq)


@pytest.mark.parametrize("name", [name for name, _, _ in multibody.methods()])
def test_every_method(arm, name):
    q, v = states(arm, 2, seed=4)
    reference = arm.rollout((q, v), dt=0.1, steps=1, tolerance=1e-12, method="dop853")
    low = ("euler", "semi-implicit-euler", "backward-euler")
    motion = arm.rollout((q, v), dt=1e-3, steps=100, method=name)
    np.testing.assert_allclose(motion.q[:, -1], reference.q[:, -1], atol=0.1 if name in low else 1e-3)
    adaptive = next(adaptive for method, _, adaptive in multibody.methods() if method == name)
    if adaptive:
        motion = arm.rollout((q, v), dt=0.1, steps=1, method=name, tolerance=1e-9)
        np.testing.assert_allclose(motion.q[:, -1], reference.q[:, -1], atol=1e-6)
    else:
        with pytest.raises(ValueError, match="has fixed steps"):
            arm.rollout((q, v), dt=1e-3, steps=1, method=name, tolerance=1e-6)


def test_driven_adaptive_steps(arm):
    q, v = states(arm, 1, seed=5)
    u = np.random.default_rng(6).uniform(-5, 5, (20, arm.nv))
    fine = arm.rollout((q[0], v[0]), np.repeat(u, 50, axis=0), dt=1e-4)
    adaptive = arm.rollout((q[0], v[0]), u, dt=5e-3, tolerance=1e-11)
    np.testing.assert_allclose(adaptive.q[-1], fine.q[-1], atol=1e-8)


def test_momenta_and_velocities(robot):
    q, v = states(robot, 3)
    by_v = robot.rollout((q, v), dt=1e-3, steps=10)
    by_p = robot.rollout((q, robot.momenta(q, v)), dt=1e-3, steps=10, state="momenta")
    assert (by_v.q == by_p.q).all()
    np.testing.assert_allclose(robot.velocities(by_p.q[:, -1], by_p.v[:, -1]), by_v.v[:, -1], rtol=1e-12)
    joined = robot.rollout(np.concatenate([q, v], axis=1), dt=1e-3, steps=10)
    assert (joined.q == by_v.q).all()


@pytest.mark.parametrize("method", ["euler", "rk4", "semi-implicit-euler", "tsit5", "gauss4"])
def test_recorded_velocities(arm, method):
    """Where the rates of a step tell them, too, they are those of the momenta, at every instant, however many are kept, and for rows
    that are computed one by one or together."""
    q, v = states(arm, 5)
    u = np.random.default_rng(3).uniform(-1, 1, (5, 12, arm.nv))
    by_p = arm.rollout((q, arm.momenta(q, v)), u, dt=1e-3, state="momenta", method=method)
    by_v = arm.rollout((q, v), u, dt=1e-3, method=method)
    assert (by_v.q == by_p.q).all()
    np.testing.assert_allclose(by_v.v, [arm.velocities(*row) for row in zip(by_p.q, by_p.v)], rtol=1e-11, atol=1e-12)
    some = arm.rollout((q, v), u, dt=1e-3, method=method, every=4)
    assert (some.v == by_v.v[:, ::4]).all() and (some.q == by_v.q[:, ::4]).all()
    alone = arm.rollout((q[2], v[2]), u[2, :8], dt=1e-3, method=method)
    assert (alone.v == by_v.v[2, :9]).all() and (alone.q == by_v.q[2, :9]).all()


@pytest.mark.parametrize("layout", ["pinocchio", "mujoco"])
def test_layouts(robot, layout):
    q, v = states(robot, 4)
    u = np.random.default_rng(7).uniform(-1, 1, (4, 20, robot.nv))
    if layout == "mujoco":
        # w first; linear velocity and force of the base in world axes.
        rotation = robot.frames(q, v).rotation[:, 0]
        there_q = np.concatenate([q[:, :3], q[:, 6:7], q[:, 3:6], q[:, 7:]], axis=1)
        there_v = v.copy()
        there_v[:, :3] = np.einsum("bij,bj->bi", rotation, v[:, :3])
        u[:, :, :3] = 0.0
        back = lambda m: np.concatenate([m.q[..., :3], m.q[..., 4:7], m.q[..., 3:4], m.q[..., 7:]], axis=-1)  # noqa: E731
    else:
        there_q, there_v, back = q, v, lambda m: m.q
    here = robot.rollout((q, v), u, dt=1e-3)
    there = robot.rollout((there_q, there_v), u, dt=1e-3, layout=layout)
    np.testing.assert_allclose(back(there), here.q, atol=1e-9)


def test_parameters_of_rows():
    model = multibody.load(MODELS / "ur5_tool.toml", search=False)
    assert model.parameter_names == ["load"]
    q, v = states(model, 3)
    loads = np.array([[0.5], [1.5], [4.0]])
    motion = model.rollout((q[0], v[0]), dt=1e-3, steps=20, params=loads)
    named = model.rollout((q[0], v[0]), dt=1e-3, steps=20, params={"load": loads[:, 0]})
    assert motion.q.shape == (3, 21, 6) and (motion.q == named.q).all()
    assert (motion.q[0, -1] != motion.q[1, -1]).any()
    for k in range(3):
        assert (model.rollout((q[0], v[0]), dt=1e-3, steps=20, params=loads[k]).q == motion.q[k]).all()
    assert (model.rollout((q[0], v[0]), dt=1e-3, steps=20).q == motion.q[1]).all()


def test_failures(arm):
    q, v = states(arm, 3)
    q[1, 2] = np.nan
    v[2] = 1e200
    with pytest.raises(multibody.SimulationError) as raised:
        arm.rollout((q, v), dt=1e-3, steps=5)
    assert raised.value.row == 1 and raised.value.kind == "not_finite" and raised.value.numbers["index"] == 2
    motion = arm.rollout((q, v), dt=1e-3, steps=5, on_error="mark")
    assert [failure.row for failure in motion.failures] == [1, 2]
    assert np.isfinite(motion.q[0]).all() and np.isnan(motion.q[1]).all() and np.isnan(motion.q[2, -1]).all()
    assert motion.failures[1].time >= 0.0
    assert (motion.q[0] == arm.rollout((q[0], v[0]), dt=1e-3, steps=5).q).all()


def test_quaternions_are_checked(robot):
    q, v = states(robot, 1)
    q[0, 3:7] *= 2
    with pytest.raises(multibody.SimulationError) as raised:
        robot.rollout((q, v), dt=1e-3, steps=5)
    assert raised.value.kind == "quaternion" and abs(raised.value.numbers["norm"] - 2) < 1e-9


def test_loops_stay_closed(linkage):
    q, v = linkage.start()
    open_start = q + 0.3
    with pytest.raises(multibody.SimulationError, match="close"):
        linkage.rollout((open_start, v), dt=1e-3, steps=5)
    motion = linkage.rollout((linkage.close(q), v), dt=1e-3, steps=500)
    assert abs(linkage.constraint_residuals(motion.q).residual).max() < 1e-11


def test_contacts_are_followed():
    ball = multibody.load(MODELS / "contacts" / "bouncing_ball.toml")
    assert ball.contact_names
    q, v = ball.start()
    q, v = np.stack([q, q, q]), np.stack([v, v, v])
    v[1, 0] = 0.3
    one = ball.rollout((q, v), dt=5e-3, steps=300, tolerance=1e-9, threads=1)
    two = ball.rollout((q, v), dt=5e-3, steps=300, tolerance=1e-9, threads=2)
    assert (one.q == two.q).all() and (one.q[0] == one.q[2]).all()
    alone = ball.rollout((q[1], v[1]), dt=5e-3, steps=300, tolerance=1e-9)
    assert (alone.q == one.q[1]).all()
    # It falls 1 m and bounces with 0.8 of its speed.
    fall = np.sqrt(2 / 9.81)
    height, time = one.q[0, :, 2], 5e-3 * np.arange(301)
    assert height.min() > 0.05 - 1e-9
    up = (time > fall) & (time < fall * (1 + 2 * 0.8))
    expected = 0.05 + 0.8 * fall * 9.81 * (time - fall) - 0.5 * 9.81 * (time - fall) ** 2
    np.testing.assert_allclose(height[up], expected[up], atol=1e-8)
    q[1, 2] = -1.0
    below = ball.rollout((q, v), dt=5e-3, steps=2, tolerance=1e-9, on_error="mark")
    assert [(failure.row, failure.kind) for failure in below.failures] == [(1, "overlap")]
    # Time steps begin with what other time steps may have left, events do not.
    q[0, 2], q[1, 2] = ball.start()[0][2] - 1 - 1e-4, ball.start()[0][2] - 1 - 2e-3
    for contacts, failing in (("events", [0, 1]), ("automatic", [1]), ("steps", [1])):
        inside = ball.rollout((q, 0 * v), dt=5e-3, steps=2, on_error="mark", contacts=contacts)
        assert [(failure.row, failure.kind) for failure in inside.failures] == [(row, "overlap") for row in failing]


@pytest.mark.parametrize(("method", "adaptive"), [(name, adaptive) for name, _, adaptive in multibody.methods()])
def test_contacts_are_followed_by_every_method(method, adaptive):
    """A double pendulum strikes a wall: half the step takes the errors of the first order, or of the second and higher ones, away."""
    pendulum = multibody.load(MODELS / "contacts" / "pendulum_on_wall.toml", search=False)
    start, dt, steps = pendulum.start(), 2e-3, 600
    reference = pendulum.rollout(start, dt=dt, steps=steps, tolerance=1e-12, method="dop853", events=True)
    errors = []
    for parts in (1, 2):
        motion = pendulum.rollout(start, dt=dt / parts, steps=parts * steps, every=parts, method=method, events=True)
        assert len(motion.events) == len(reference.events) == 1
        errors.append(abs(motion.q - reference.q).max())
    first = method in ("euler", "semi-implicit-euler", "backward-euler")
    assert errors[1] < max(errors[0] / (1.9 if first else 3.8), 1e-11) and errors[0] < (0.1 if first else 2e-4), errors
    if adaptive:
        motion = pendulum.rollout(start, dt=dt, steps=steps, tolerance=1e-9, method=method)
        assert abs(motion.q - reference.q).max() < 1e-8


def test_legs_creep_with_the_square_of_the_step():
    dog = multibody.load(MODELS / "contacts" / "quadruped.toml", gains=(20.0, 0.5), search=False)
    sinks = []
    for dt in (2e-3, 1e-3):
        u = np.tile(dog.kp * np.insert(dog.start()[0][7:], [0] * 6, 0), (round(1.5 / dt), 1))
        height = dog.rollout(dog.start(), u, dt=dt, contacts="steps").q[:, 2]
        sinks.append((height[round(1.35 / dt)] - height[-1]) / 0.15)
    assert 3 < sinks[0] / sinks[1] < 5 and 0 < sinks[1] < 1e-6, sinks


def sum_of_masses(model):
    """Of a floating robot."""
    return model.mass_matrix(model.neutral())[0, 0]


def test_contacts_by_time_steps():
    dog = multibody.load(MODELS / "contacts" / "quadruped.toml", wrenches=["trunk"], search=False)
    q, v = dog.start()
    q, v = np.stack([q, q, q]), np.stack([v, v, v])
    v[1, 0], v[2, 7] = 0.3, 1.0
    wanted = dog.rollout((q, v), dt=0.2, steps=1, tolerance=1e-8).q[:, -1]
    errors = []
    for dt in (4e-3, 1e-3, 1e-4):
        steps = round(0.2 / dt)
        motion = dog.rollout((q, v), dt=dt, steps=steps, contacts="steps", threads=1, forces=True)
        errors.append(abs(motion.q[:, -1] - wanted).max())
        # Mean forces of the steps carry the weight and change the momentum: but for what the explicit midpoint rule errs by.
        ends = [np.einsum("bij,bj->bi", dog.centroidal(motion.q[:, k], motion.v[:, k]).matrix, motion.v[:, k])[:, 2] for k in (0, -1)]
        weight = 9.81 * sum_of_masses(dog)
        pushed = dt * (motion.forces[:, 1:, :4, 0].sum(axis=(1, 2)) - weight * steps)
        assert (motion.forces[:, 0] == 0).all() and motion.forces[:, 1:, :4, 0].max() > weight
        assert abs(ends[1] - ends[0] - pushed).max() < 100 * dt**2 * weight
    # Of the first order, irregularly: steps meet a landing sooner or later. Feet move at some 2 m/s and land four times: a step
    # of 4 ms errs by less than four times 2 m/s in one of its lengths, and shorter ones by less and less.
    assert errors[0] < 4 * 2.0 * 4e-3 and errors[1] < 0.5 * errors[0] and errors[2] < 0.5 * errors[1]
    # Neither threads, nor other rows, nor calls before have an influence.
    motion = dog.rollout((q, v), dt=1e-3, steps=200, contacts="steps", threads=1)
    again = dog.rollout((q, v), dt=1e-3, steps=200, contacts="steps", threads=3)
    alone = dog.rollout((q[1], v[1]), dt=1e-3, steps=200, contacts="steps")
    assert (again.q == motion.q).all() and (alone.q == motion.q[1]).all()
    pulled = dog.rollout((q[1], v[1]), dt=1e-3, steps=200, contacts="steps", wrenches=np.ones((1, 6)))
    alone = dog.rollout((q[1], v[1]), dt=1e-3, steps=200, contacts="steps")
    assert (pulled.q != alone.q).any() and (alone.q == motion.q[1]).all()
    with pytest.raises(ValueError, match="leave `tolerance` out"):
        dog.rollout((q, v), dt=1e-3, steps=2, contacts="steps", tolerance=1e-6)
    with pytest.raises(ValueError, match="contacts are not followed by `both`: take automatic, events, steps"):
        dog.rollout((q, v), dt=1e-3, steps=2, contacts="both")
    with pytest.raises(ValueError, match="no contacts that `steps` could follow"):
        multibody.load(MODELS / "ur5.urdf", search=False).rollout((np.zeros(6), np.zeros(6)), dt=1e-3, steps=2, contacts="steps")


def test_a_stop_holds_against_a_force():
    """A joint that is driven against its stop does not pass it."""
    arm = multibody.load(MODELS / "ur5.urdf", limits=True, gravity=(0, 0, 0), search=False)
    assert arm.contact_names
    low, high = arm.joint_ranges.T
    elbow = arm.velocity_names.index("elbow_joint")
    q0 = arm.neutral()
    q0[elbow] = high[elbow] - 0.05
    u = np.zeros((300, arm.nv))
    u[:, elbow] = 20.0
    motion = arm.rollout((q0, np.zeros(arm.nv)), u, dt=2e-3, tolerance=1e-8)
    free = multibody.load(MODELS / "ur5.urdf", gravity=(0, 0, 0), search=False)
    assert free.rollout((q0, np.zeros(arm.nv)), u, dt=2e-3).q[:, elbow].max() > high[elbow] + 0.1
    assert motion.q[:, elbow].max() < high[elbow] + 1e-6


def test_out(arm):
    q, v = states(arm, 2)
    expected = arm.rollout((q, v), dt=1e-3, steps=5)
    out = (np.empty((2, 6, 6)), np.empty((2, 6, 6)))
    motion = arm.rollout((q, v), dt=1e-3, steps=5, out=out)
    assert motion.q is out[0] and motion.v is out[1] and (motion.q == expected.q).all()
    with pytest.raises(ValueError, match="`out` for `q`"):
        arm.rollout((q, v), dt=1e-3, steps=4, out=out)
    with pytest.raises(ValueError, match="shares memory"):
        arm.rollout((q, v), dt=1e-3, steps=5, out=(out[0], out[0]))


@pytest.mark.parametrize(
    "settings, words",
    [
        (dict(dt=0.0, steps=1), "`dt` is 0"),
        (dict(dt=float("nan"), steps=1), "`dt` is NaN"),
        (dict(dt=1e-3), "give `steps`"),
        (dict(dt=1e-3, steps=-1), "`steps` is -1"),
        (dict(dt=1e-3, steps=3, every=2), "does not divide 3"),
        (dict(dt=1e-3, steps=3, every=0), "`every` is 0"),
        (dict(dt=1e-3, steps=3, threads=-1), "`threads` is -1"),
        (dict(dt=1e-3, steps=1, method="rk5"), "no method is called `rk5`"),
        (dict(dt=1e-3, steps=1, tolerance=2.0), "between 0 and 1"),
        (dict(dt=1e-3, steps=1, layout="drake"), "no layout is called `drake`"),
        (dict(dt=1e-3, steps=1, threads=0), "`threads` is 0"),
        (dict(dt=1e-3, steps=1, on_error="ignore"), "take 'raise' or 'mark'"),
        (dict(dt=1e-3, steps=1, state="x"), "take 'velocities' or 'momenta'"),
        (dict(dt=1e-3, u=np.zeros(6)), "`u` has the shape"),
        (dict(dt=1e-3, u=np.zeros((3, 5))), r"`u` has the shape \(3, 5\)"),
        (dict(dt=1e-3, steps=4, u=np.zeros((3, 6))), r"`u` has the shape \(3, 6\); \(4, 6\)"),
        (dict(dt=1e-3, u=np.zeros((3, 4, 6))), "`u` has 3 rows, `q0` has 2"),
    ],
)
def test_wrong_settings(arm, settings, words):
    with pytest.raises(ValueError, match=words):
        arm.rollout((np.zeros((2, 6)), np.zeros((2, 6))), **settings)


@pytest.mark.parametrize("steps", [10**15, 2**63 - 1, 2**64 - 1, 2**80])
def test_more_steps_than_there_is_memory_for(arm, steps):
    with pytest.raises((MemoryError, ValueError, OverflowError)):
        arm.rollout((np.zeros(6), np.zeros(6)), dt=1e-3, steps=steps)


def test_other_threads_of_python_run_meanwhile(arm):
    ticks, stop = [0], threading.Event()

    def count():
        while not stop.wait(0.001):
            ticks[0] += 1

    other = threading.Thread(target=count)
    other.start()
    arm.rollout((np.zeros((8, 6)), np.zeros((8, 6))), dt=1e-4, steps=40_000, every=40_000, threads=1)
    stop.set()
    other.join()
    assert ticks[0] >= 10


@pytest.mark.skipif(os.name != "posix", reason="sends itself a signal")
@pytest.mark.parametrize("threads, rows", [(1, 1), (2, 2)])
def test_an_interrupt_is_answered_within_a_second(arm, threads, rows, request):
    # A process that was begun in the background may ignore interrupts.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    request.addfinalizer(lambda: signal.signal(signal.SIGINT, before))
    sent = [0.0]

    def interrupt():
        time.sleep(0.3)
        sent[0] = time.perf_counter()
        os.kill(os.getpid(), signal.SIGINT)

    other = threading.Thread(target=interrupt)
    other.start()
    with pytest.raises(KeyboardInterrupt):
        arm.rollout((np.zeros((rows, 6)), np.zeros((rows, 6))), dt=1e-9, steps=10**9, every=10**9, threads=threads)
    assert time.perf_counter() - sent[0] < 1.0
    other.join()


def test_one_model_on_many_threads_of_python(arm):
    q, v = states(arm, 16)
    expected = arm.rollout((q, v), dt=1e-3, steps=200)
    results = [None] * 4

    def work(k):
        results[k] = arm.rollout((q, v), dt=1e-3, steps=200)

    workers = [threading.Thread(target=work, args=(k,)) for k in range(4)]
    [worker.start() for worker in workers]
    [worker.join() for worker in workers]
    assert all((result.q == expected.q).all() for result in results)
