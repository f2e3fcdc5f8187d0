"""Outputs: identities, batches, arguments."""

import tracemalloc

import numpy as np
import pytest
from conftest import MODELS, states

import multibody


@pytest.mark.parametrize("name", ["arm", "robot"])
def test_identities(name, request):
    model = request.getfixturevalue(name)
    q, v = states(model, 5)
    tau = np.random.default_rng(1).uniform(-1, 1, (5, model.nv))
    m = model.mass_matrix(q)
    p = model.momenta(q, v)
    np.testing.assert_allclose(np.einsum("bij,bj->bi", m, v), p, rtol=1e-10, atol=1e-10)
    np.testing.assert_allclose(model.velocities(q, p), v, rtol=1e-8, atol=1e-8)
    a = model.accelerations(q, v, tau=tau)
    np.testing.assert_allclose(model.inverse_dynamics(q, v, a), tau, rtol=1e-8, atol=1e-8)
    np.testing.assert_allclose(np.einsum("bij,bj->bi", m, a) + model.bias(q, v), tau, rtol=1e-8, atol=1e-8)
    kinetic = model.energy(q, p)[:, 0]
    np.testing.assert_allclose(kinetic, 0.5 * np.einsum("bi,bi->b", p, v), rtol=1e-10)


def test_derivatives_are_those_of_the_rates(arm):
    q, v = states(arm, 1)
    q, p = q[0], arm.momenta(q[0], v[0])
    exact, h = arm.derivatives(q, p), 1e-6
    for k in range(arm.nv):
        step = np.zeros(arm.nq)
        step[k] = h
        difference = (arm.rates(q + step, p).pd - arm.rates(q - step, p).pd) / (2 * h)
        np.testing.assert_allclose(exact.dpd_dq[:, k], difference, rtol=1e-6, atol=1e-6)


def test_frames_and_jacobians(arm):
    q, v = states(arm, 3)
    frames = arm.frames(q, v)
    n = len(arm.frame_names)
    assert frames.rotation.shape == (3, n, 3, 3) and frames.position.shape == (3, n, 3)
    velocity = np.einsum("bfij,bj->bfi", arm.jacobians(q), v)
    np.testing.assert_allclose(velocity, frames.velocity, atol=1e-12)


@pytest.mark.parametrize("rows", [4, 101])
@pytest.mark.parametrize("name", ["arm", "robot", "linkage", "contacts", "parameters"])
def test_rows_are_single_states_bit_for_bit(name, rows, request):
    """From 64 rows on several states are computed side by side."""
    files = {"contacts": "contacts/quadruped.toml", "parameters": "ur5_tool.toml"}
    model = multibody.load(MODELS / files[name]) if name in files else request.getfixturevalue(name)
    q, v = states(model, rows)
    random = np.random.default_rng(2)
    a = random.uniform(-1, 1, (rows, model.nv))
    given = {"q": q, "v": v, "a": a, "p": model.momenta(q, v)}
    arguments = {name: [array for array, _ in given] for name, given, _, _ in multibody._native.outputs()}
    inputs = {"tau": random.uniform(-1, 1, (rows, model.nv))}
    assert (model.parameter_defaults.size > 0) == (name == "parameters")
    if model.parameter_defaults.size:
        inputs["params"] = model.parameter_defaults * random.uniform(0.9, 1.1, (rows, model.parameter_defaults.size))
    assert set(model.outputs) >= {"rates", "energy", "frames", "reactions", "regressor", "centroidal", "derivatives"}
    for output in model.outputs:
        of_all = model.evaluate(output, *(given[x] for x in arguments[output]), **inputs)
        for k in (0, 1, 3, rows - 1):
            single = model.evaluate(
                output, *(given[x][k] for x in arguments[output]), **{name: of_each[k] for name, of_each in inputs.items()}
            )
            pairs = zip(of_all, single) if isinstance(single, tuple) else [(of_all, single)]
            for many, one in pairs:
                assert many[k].tobytes() == one.tobytes(), f"{output}, row {k}"


def test_arrays_are_read_and_written_without_copies(arm):
    """NumPy tells `tracemalloc` of its memory: there are a million bytes of results, whose memory is the package's own, and two of
    arguments, but none is allocated."""
    q, v = states(arm, 20_000)
    out = np.empty_like(v)
    arm.momenta(q[:100], v[:100])
    tracemalloc.start()
    try:
        arm.momenta(q, v, out=out)
        assert tracemalloc.get_traced_memory()[1] < 100_000
        arm.momenta(q, v)
        assert tracemalloc.get_traced_memory()[1] < 100_000
        # Anything but contiguous doubles is copied.
        arm.momenta(q.astype(np.float32), v, out=out)
        assert tracemalloc.get_traced_memory()[1] > q.nbytes
    finally:
        tracemalloc.stop()


def test_memory_of_results_is_used_again_when_nobody_sees_it(arm):
    q, v = states(arm, 20_000)
    first = arm.momenta(q, v)
    expected, part, place = first.copy(), first[10:20], first.ctypes.data
    assert place % 64 == 0 and first.flags.writeable and first.flags.c_contiguous
    del first
    # A part of it is still seen.
    second = arm.momenta(q, 2 * v)
    assert second.ctypes.data != place and np.array_equal(part, expected[10:20])
    del part
    third = arm.momenta(q, v)
    assert third.ctypes.data == place and np.array_equal(third, expected)


def test_single_rows_hold_for_all(arm):
    q, v = states(arm, 3)
    expected = arm.momenta(np.tile(q[0], (3, 1)), v)
    assert (arm.momenta(q[0], v) == expected).all()


def test_inputs_do_not_stay(arm):
    q, v = states(arm, 1)
    before = arm.accelerations(q, v)
    assert (arm.accelerations(q, v, tau=np.ones(arm.nv)) != before).any()
    assert (arm.accelerations(q, v) == before).all()


def test_exact_arithmetic_has_small_differences(arm):
    exact = multibody.load(MODELS / "ur5.urdf", arithmetic="exact", search=False)
    q, v = states(arm, 2)
    np.testing.assert_allclose(exact.accelerations(q, v), arm.accelerations(q, v), rtol=1e-9)


def test_out(arm):
    q, v = states(arm, 3)
    p = arm.momenta(q, v)
    out = np.empty((3, arm.nv))
    assert arm.momenta(q, v, out=out) is out and (out == p).all()
    rates = arm.rates(q, p)
    qd, pd = np.empty_like(rates.qd), np.empty_like(rates.pd)
    arm.rates(q, p, out=(qd, pd))
    assert (qd == rates.qd).all() and (pd == rates.pd).all()
    with pytest.raises(ValueError, match=r"shape \(2, 6\); a C-contiguous array of shape \(3, 6\)"):
        arm.momenta(q, v, out=np.empty((2, 6)))
    with pytest.raises(TypeError, match="no NumPy array of float64"):
        arm.momenta(q, v, out=np.empty((3, 6), dtype=np.float32))
    with pytest.raises(ValueError, match="shares memory"):
        arm.momenta(q, v, out=v)
    frozen = np.empty((3, 6))
    frozen.flags.writeable = False
    with pytest.raises(ValueError, match="read-only"):
        arm.momenta(q, v, out=frozen)


def test_arrays_that_are_not_contiguous_or_double(arm):
    q, v = states(arm, 3)
    wide = np.zeros((6, 12))
    wide[::2, ::2] = q
    assert (arm.momenta(wide[::2, ::2], v) == arm.momenta(q, v)).all()
    assert (arm.momenta(q.tolist(), np.asfortranarray(v)) == arm.momenta(q, v)).all()
    single = q.astype(np.float32)
    assert (arm.mass_matrix(single) == arm.mass_matrix(single.astype(float))).all()
    assert arm.mass_matrix([0, 0, 0, 0, 0, 0]).shape == (6, 6)
    # As arrays that came by a network may lie in memory.
    shifted = np.frombuffer(b"\0" + q.tobytes(), dtype=np.uint8)[1:].view(np.float64).reshape(q.shape)
    assert shifted.flags.c_contiguous and not shifted.flags.aligned
    assert (arm.momenta(shifted, v) == arm.momenta(q, v)).all()
    assert (arm.momenta(q.astype(">f8"), v) == arm.momenta(q, v)).all()


@pytest.mark.parametrize(
    "call, error, words",
    [
        (lambda m: m.momenta(np.zeros(5), np.zeros(6)), ValueError, r"`q` has the shape \(5,\); \(6,\) or \(B, 6\)"),
        (lambda m: m.momenta(np.zeros((2, 6)), np.zeros((3, 6))), ValueError, "`v` has 3 rows, `q` has 2"),
        (lambda m: m.momenta(np.zeros((1, 1, 6)), np.zeros(6)), ValueError, "has the shape"),
        (lambda m: m.momenta(1.0, np.zeros(6)), ValueError, "has the shape"),
        (lambda m: m.momenta(np.zeros(6, dtype=complex), np.zeros(6)), TypeError, "dtype complex128"),
        (lambda m: m.momenta(["a"] * 6, np.zeros(6)), TypeError, "dtype"),
        (lambda m: m.momenta([[0.0] * 6, [0.0]], np.zeros(6)), TypeError, "no array|dtype"),
        (lambda m: m.momenta(None, np.zeros(6)), TypeError, "dtype object"),
        (lambda m: m.momenta(np.zeros(6)), TypeError, "'v' is missing"),
        (lambda m: m.momenta(np.zeros(6), np.zeros(6), np.zeros(6)), TypeError, "3 arrays were given"),
        (lambda m: m.momenta(np.zeros(6), np.zeros(6), bogus=1), TypeError, "`bogus` is no input"),
        (lambda m: m.momenta(np.zeros(6), np.zeros(6), gravity=np.zeros(3)), ValueError, "no input `gravity`"),
        (lambda m: m.momenta(np.zeros(6), np.zeros(6), params={"x": 1}), ValueError, "no parameter is called 'x'"),
        (lambda m: m.multipliers(np.zeros(6), np.zeros(6)), multibody.ModelError, "multipliers"),
        (lambda m: m.evaluate("rate", np.zeros(6)), ValueError, "no output is called 'rate'"),
        (lambda m: m.shapes("rate"), ValueError, "did you mean `rates`"),
    ],
)
def test_wrong_arguments(arm, call, error, words):
    with pytest.raises(error, match=words):
        call(arm)


def test_names_and_limits(arm):
    assert (arm.nq, arm.nv, len(arm.coordinate_names), len(arm.velocity_names)) == (6, 6, 6, 6)
    assert arm.joint_ranges.shape == (6, 2) and (arm.joint_ranges[:, 0] < arm.joint_ranges[:, 1]).all()
    assert (arm.max_effort > 0).all() and (arm.max_velocity > 0).all()
    assert arm.neutral().shape == (6,) and [x.shape for x in arm.start()] == [(6,), (6,)]
    assert arm.shapes("momenta") == {"q": (6,), "v": (6,), "p": (6,)}
    assert "multipliers" not in arm.outputs and "rates" in arm.outputs


def test_empty_batches(arm):
    assert arm.momenta(np.zeros((0, 6)), np.zeros((0, 6))).shape == (0, 6)
    assert arm.rollout((np.zeros((0, 6)), np.zeros((0, 6))), dt=1e-3, steps=3).q.shape == (0, 4, 6)


def test_loops(linkage):
    q, v = linkage.start()
    q = linkage.close(q)
    residual, _ = linkage.constraint_residuals(q)
    assert abs(residual).max() < 1e-11
    p = linkage.project_momenta(q, linkage.momenta(q, v + 1.0))
    np.testing.assert_allclose(linkage.momenta(q, p.v), p.freed, atol=1e-12)
    assert linkage.multipliers(q, v).shape == (len(residual),)
    with pytest.raises(multibody.ModelError):
        linkage.momentum_derivatives(q, v)


def test_wrenches():
    model = multibody.load(MODELS / "ur5.urdf", wrenches=["forearm_link"], search=False)
    assert model.wrench_names == ["forearm_link"]
    q, v = states(model, 2)
    pushed = model.accelerations(q, v, wrenches=np.ones((1, 6)))
    assert (pushed != model.accelerations(q, v)).any()
    with pytest.raises(multibody.ModelError, match="no body is named"):
        multibody.load(MODELS / "ur5.urdf", wrenches=["nose"])


def test_torch_takes_results_without_a_copy(arm):
    torch = pytest.importorskip("torch")
    q, v = states(arm, 2)
    p = arm.momenta(q, v)
    there = torch.from_dlpack(p)
    assert (there.numpy() == p).all() and there.data_ptr() == p.ctypes.data


def test_results_are_shared_and_aligned(arm):
    """DLPack shares memory; JAX does so where it begins at a multiple of 64 bytes."""
    for rows in (2, 100, 333):
        q, v = states(arm, rows)
        motion = arm.rollout((q, v), dt=1e-3, steps=3)
        for array in (arm.momenta(q, v), arm.mass_matrix(q), motion.q, motion.v):
            there = np.from_dlpack(array)
            assert there.ctypes.data == array.ctypes.data
            assert array.size < 512 or array.ctypes.data % 64 == 0
            assert array.flags.c_contiguous and array.flags.writeable


def test_jax_takes_results_without_a_copy(arm):
    jax = pytest.importorskip("jax")
    jax.config.update("jax_enable_x64", True)
    q, v = states(arm, 100)
    for array in (arm.momenta(q, v), arm.mass_matrix(q), arm.rollout((q, v), dt=1e-3, steps=3).q):
        there = jax.dlpack.from_dlpack(array)
        assert there.unsafe_buffer_pointer() == array.ctypes.data and (np.asarray(there) == array).all()
