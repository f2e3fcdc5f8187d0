"""What rollouts tell beside states: events, forces of contacts; prescribed joints that move."""

import numpy as np
import pytest
from conftest import MODELS, states

import multibody

G = 9.81


@pytest.fixture(scope="module")
def pendulum():
    return multibody.load(
        text="""gravity = [0, 0, -9.81]
[[body]]
name = "bob"
mass = 1
com = [0, 0, -1]
inertia = [0, 0, 0]
[[joint]]
name = "hinge"
type = "revolute"
axis = [0, 1, 0]
child = "bob"
"""
    )


@pytest.fixture(scope="module")
def ball():
    return multibody.load(MODELS / "contacts" / "bouncing_ball.toml")


@pytest.mark.parametrize("settings", [dict(dt=1e-3, steps=3000), dict(dt=0.1, steps=30, tolerance=1e-11)])
def test_zeros_of_functions(pendulum, settings):
    """A pendulum passes its lowest point every half of its period, which an elliptic integral gives."""
    amplitude = 1.0
    a, b = 1.0, np.cos(amplitude / 2)
    for _ in range(6):
        a, b = (a + b) / 2, np.sqrt(a * b)
    period = 2 * np.pi * np.sqrt(1 / G) / a
    low = lambda t, q, v: q[0]  # noqa: E731
    late = multibody.Event(lambda t, q, v: t - 1.7)
    motion = pendulum.rollout(([amplitude], [0.0]), events=[low, multibody.Event(low, "rising"), late], **settings)
    times = [event.time for event in motion.events if event.event == 0]
    np.testing.assert_allclose(times, period * (0.25 + 0.5 * np.arange(len(times))), atol=1e-9)
    assert len(times) == 3 and all(abs(event.q[0]) < 1e-9 for event in motion.events if event.event == 0)
    assert [event.time for event in motion.events if event.event == 1] == times[1::2]
    assert [event.time for event in motion.events if event.event == 2] == pytest.approx([1.7], abs=1e-12)
    assert sorted(event.time for event in motion.events) == [event.time for event in motion.events]
    # Looking changes the motion by no more than rounding.
    np.testing.assert_allclose(motion.q, pendulum.rollout(([amplitude], [0.0]), **settings).q, atol=1e-11)


def test_contacts_collide_together_or_one_after_the_other():
    """Newton's cradle: the last ball flies on alone, or two do."""
    cradle = multibody.load(MODELS / "contacts" / "newtons_cradle.toml", search=False)
    ends = [cradle.rollout(cradle.start(), dt=0.01, steps=50, tolerance=1e-9, impacts=how).v[-1] for how in ("together", "sequential")]
    assert abs(ends[1][:2]).max() < 1e-6 < 0.5 < ends[1][2]
    np.testing.assert_allclose(ends[0] / ends[1][2], [-1 / 3, 2 / 3, 2 / 3], atol=0.02)
    with pytest.raises(ValueError, match="contacts do not collide `both`: take together or sequential"):
        cradle.rollout(cradle.start(), dt=0.01, steps=5, impacts="both")
    with pytest.raises(ValueError, match="no impacts are looked for"):
        cradle.rollout(cradle.start(), dt=0.01, steps=5, impacts="sequential", contacts="steps")


def test_terminal_events_end_their_rows(pendulum):
    starts = (np.array([[1.0], [0.5], [1.2]]), np.zeros((3, 1)))
    stop = multibody.Event(lambda t, q, v: q[0], "falling", terminal=True)
    one = pendulum.rollout(starts, dt=1e-2, steps=100, events=[stop], threads=1)
    two = pendulum.rollout(starts, dt=1e-2, steps=100, events=[stop], threads=2)
    assert [event.row for event in one.events] == [0, 1, 2] and not one.failures
    assert np.array_equal(one.q, two.q, equal_nan=True) and [e[:3] for e in one.events] == [e[:3] for e in two.events]
    for row, event in enumerate(one.events):
        rows = int(event.time / 1e-2) + 1
        assert np.isfinite(one.q[row, :rows]).all() and np.isnan(one.q[row, rows:]).all()


def test_functions_see_the_layout_of_the_rollout(robot):
    q, v = robot.neutral(), np.zeros(robot.nv)
    seen = []
    there = np.concatenate([q[:3], q[6:7], q[3:6], q[7:]])
    robot.rollout((there, v), dt=1e-3, steps=2, layout="mujoco", events=[lambda t, q, v: seen.append(q.copy()) or 1.0])
    assert all(abs(np.linalg.norm(q[3:7]) - 1) < 1e-12 and q[3] > 0.9 for q in seen) and len(seen) > 2


def test_what_functions_raise_is_raised(pendulum):
    def broken(t, q, v):
        return 1.0 / (t - t)

    starts = (np.ones((4, 1)), np.zeros((4, 1)))
    with pytest.raises(ZeroDivisionError):
        pendulum.rollout(starts, dt=1e-3, steps=10, events=[broken], threads=2)
    with pytest.raises(TypeError):
        pendulum.rollout(starts, dt=1e-3, steps=10, events=[lambda t, q, v: "zero"])
    with pytest.raises(TypeError, match="give functions"):
        pendulum.rollout(starts, dt=1e-3, steps=10, events=["q"])
    with pytest.raises(ValueError, match="direction of an event"):
        pendulum.rollout(starts, dt=1e-3, steps=10, events=[multibody.Event(broken, "up")])
    with pytest.raises(ValueError, match="give 16 at most"):
        pendulum.rollout(starts, dt=1e-3, steps=10, events=[broken] * 17)
    with pytest.raises(ValueError, match="no contacts"):
        pendulum.rollout(starts, dt=1e-3, steps=10, events=True)
    with pytest.raises(ValueError, match="no contacts whose forces"):
        pendulum.rollout(starts, dt=1e-3, steps=10, forces=True)


def test_events_of_contacts(ball):
    q, v = (np.tile(part, (3, 1)) for part in ball.start())
    v[1, 0] = 0.3
    settings = dict(dt=5e-3, steps=300, tolerance=1e-9)
    motion = ball.rollout((q, v), events=True, forces=True, **settings)
    plain = ball.rollout((q, v), **settings)
    assert (motion.q == plain.q).all() and plain.events == [] and plain.forces is None
    first = motion.events[0]
    assert first.row == 0 and first.cause == "lands" and first.contact == ball.contact_names[0]
    # It falls 1 m and leaves with 0.8 of its speed.
    fall = np.sqrt(2 / G)
    assert first.time == pytest.approx(fall, abs=1e-9) and first.approach == pytest.approx(fall * G, abs=1e-8)
    mass = ball.mass_matrix(q[0])[0, 0]
    assert first.energy == pytest.approx(-mass * G * (1 - 0.8**2), rel=1e-8) and first.mode == "open"
    assert [event.row for event in motion.events] == sorted(event.row for event in motion.events)
    with pytest.raises(ValueError, match="cannot be looked for in a motion with contacts"):
        ball.rollout((q, v), events=[lambda t, q, v: 1.0], **settings)


def test_forces_of_contacts_carry_the_weight(ball):
    text = (MODELS / "contacts" / "bouncing_ball.toml").read_text().replace("restitution = 0.8", "friction = 0.5")
    rough = multibody.load(text=text, search=False)
    q, v = rough.start()
    q[2] = 0.05
    motion = rough.rollout((q, v), dt=1e-2, steps=10, forces=True, events=True)
    assert motion.forces.shape == (11, 1, 3) and motion.events == []
    np.testing.assert_allclose(motion.forces[:, 0], np.tile([0.2 * G, 0, 0], (11, 1)), atol=1e-9)
    stepped = rough.rollout((q, v), dt=1e-2, steps=10, forces=True, contacts="steps")
    assert (stepped.forces[0] == 0).all()
    np.testing.assert_allclose(stepped.forces[1:, 0], np.tile([0.2 * G, 0, 0], (10, 1)), atol=1e-9)
    above = rough.rollout((q + [0, 0, 1, 0, 0, 0, 0], v), dt=1e-2, steps=10, every=5, forces=True)
    assert above.forces.shape == (3, 1, 3) and (above.forces == 0).all()


def test_prescribed_joints_move():
    """Angular momentum about a fixed axis is conserved: the bus turns against its panels."""
    satellite = multibody.load(MODELS / "satellite.toml")
    rng = np.random.default_rng(0)
    q, _ = states(satellite, 2, seed=1)
    p = rng.uniform(-1, 1, (2, satellite.nv))
    steps, dt = 100, 1e-2
    t = dt * np.arange(steps + 1)[:, None]
    drive_q, drive_v = 0.3 * np.sin([2, 3] * t), 0.3 * np.array([2, 3]) * np.cos([2, 3] * t)
    settings = dict(drive_q=drive_q, drive_v=drive_v, dt=dt)
    motion = satellite.rollout((q, p), steps=steps, state="momenta", **settings)
    # Momenta in the axes of the world stay: rotation of the bus times its momenta.
    rows = [satellite.frames(m, np.zeros((steps + 1, satellite.nv)), drive_q=drive_q).rotation[:, 0] for m in motion.q]
    for rotation, momenta in zip(rows, motion.v):
        linear = np.einsum("tij,tj->ti", rotation, momenta[:, :3])
        np.testing.assert_allclose(linear, np.tile(linear[0], (steps + 1, 1)), atol=1e-5)
    # The same by velocities, and the order of the method: errors fall with the fourth power of the step.
    v = satellite.velocities(q, p, drive_q=drive_q[0], drive_v=drive_v[0])
    by_v = satellite.rollout((q, v), steps=steps, **settings)
    np.testing.assert_allclose(by_v.q, motion.q, atol=1e-12)
    ends = []
    for n in (25, 50, 100, 800):
        s = np.linspace(0, 1, n + 1)[:, None]
        given = dict(drive_q=0.3 * np.sin([2, 3] * s), drive_v=0.3 * np.array([2, 3]) * np.cos([2, 3] * s))
        ends.append(satellite.rollout((q, p), dt=1 / n, steps=n, state="momenta", **given).q[:, -1])
    errors = [abs(end - ends[-1]).max() for end in ends[:-1]]
    assert errors[0] / errors[1] > 10 and errors[1] / errors[2] > 10, errors
    adaptive = satellite.rollout((q, p), dt=dt, steps=steps, state="momenta", tolerance=1e-10, drive_q=drive_q, drive_v=drive_v)
    np.testing.assert_allclose(adaptive.q[:, -1], motion.q[:, -1], atol=1e-7)
    # Inputs of one call do not stay, and rows have motions of their own.
    still = satellite.rollout((q, p), dt=dt, steps=steps, state="momenta")
    assert (still.q[:, -1] != motion.q[:, -1]).any()
    each = np.stack([drive_q, np.zeros_like(drive_q)]), np.stack([drive_v, np.zeros_like(drive_v)])
    both = satellite.rollout((q, p), dt=dt, steps=steps, state="momenta", drive_q=each[0], drive_v=each[1])
    assert (both.q[0] == motion.q[0]).all()
    np.testing.assert_allclose(both.q[1], still.q[1], atol=1e-13)


def test_wrong_motions_of_prescribed_joints(arm):
    satellite = multibody.load(MODELS / "satellite.toml", search=False)
    start = (satellite.neutral(), np.zeros(satellite.nv))
    for given, words in (
        (dict(drive_v=np.zeros((4, 2))), "needs `drive_q`"),
        (dict(drive_q=np.zeros((3, 2)), drive_v=np.zeros((4, 2))), r"`drive_q` has the shape \(3, 2\); \(4, 2\)"),
        (dict(drive_q=np.zeros(2), drive_v=np.zeros((4, 2))), "`drive_q` has the shape"),
    ):
        with pytest.raises(ValueError, match=words):
            satellite.rollout(start, dt=1e-3, steps=3, **given)
    with pytest.raises(ValueError, match="no input `drive_q`"):
        arm.rollout((np.zeros(6), np.zeros(6)), dt=1e-3, steps=3, drive_q=np.zeros((4, 1)), drive_v=np.zeros((4, 1)))
    docked = multibody.load(MODELS / "variants" / "docking.toml", variant="docked", search=False)
    start, poses = (docked.neutral(), np.zeros(docked.nv)), np.tile([0.0] * 6 + [1.0], (4, 1))
    with pytest.raises(ValueError, match="`dock` stands still in rollouts"):
        docked.rollout(start, dt=1e-3, steps=3, drive_q=poses, drive_v=np.zeros((4, 6)))
    assert not docked.rollout(start, dt=1e-3, steps=3, drive_q=poses[0]).failures
