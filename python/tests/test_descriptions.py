"""Reading, findings, conversion, generated code, malformed texts."""

import pickle
import random
import time

import numpy as np
import pytest
from conftest import MODELS

import multibody

BROKEN = """
[[body]]
name = "a"
mass = -1
com = [1, 0, 0]
[[joint]]
name = "j"
type = "revolut"
child = "a"
"""


def test_findings_have_places():
    findings = multibody.check(text=BROKEN)
    assert {f.severity for f in findings} >= {"error"}
    where = {(f.line, "revolut" in f.message) for f in findings}
    assert (8, True) in where
    assert all(f.help for f in findings if f.severity == "error")
    with pytest.raises(multibody.ModelError) as raised:
        multibody.load(text=BROKEN)
    assert raised.value.findings == findings and "text.toml:8:" in str(raised.value)
    assert pickle.loads(pickle.dumps(raised.value)).findings == findings
    assert str(findings[0]) in str(raised.value)


def test_files_that_cannot_be_read(tmp_path):
    with pytest.raises(FileNotFoundError, match="nothing.toml"):
        multibody.load("nothing.toml")
    bad = tmp_path / "bad.toml"
    bad.write_bytes(b"\xff\xfe")
    with pytest.raises(OSError, match="bad.toml"):
        multibody.load(bad)
    with pytest.raises(multibody.ModelError, match="cannot read files that end in `sdf`"):
        multibody.load(text="<sdf/>", format="sdf")
    with pytest.raises(ValueError, match="either a path or"):
        multibody.load()


def test_settings_of_reading():
    fixed = multibody.load(MODELS / "ur5.urdf")
    floating = multibody.load(str(MODELS / "ur5.urdf"), base="floating")
    planar = multibody.load(MODELS / "ur5.urdf", base="planar")
    assert (fixed.nv, floating.nv, planar.nv) == (6, 12, 9) and floating.nq == 13
    with pytest.raises(ValueError, match="no base is called `free`"):
        multibody.load(MODELS / "ur5.urdf", base="free")
    with pytest.raises(ValueError, match="no arithmetic"):
        multibody.load(MODELS / "ur5.urdf", arithmetic="slow")
    moon = multibody.load(MODELS / "ur5.urdf", gravity=(0, 0, -1.62))
    assert abs(moon.bias(moon.neutral(), [0.0] * 6)).max() < abs(fixed.bias(fixed.neutral(), [0.0] * 6)).max()
    assert multibody.load(MODELS / "ur5.urdf", limits=True).contact_names


def test_models_of_mujoco():
    text = """<mujoco><worldbody><body name="bob" pos="0 0 1"><joint name="hinge" axis="0 1 0"/>
        <geom type="sphere" size="0.1" pos="0 0 -1" mass="2"/></body></worldbody></mujoco>"""
    model = multibody.load(text=text, format="mjcf")
    assert model.body_names == ["bob"] and abs(model.mass_matrix([0.3])[0, 0] - 2 * (1 + 0.4 * 0.01)) < 1e-12


def test_variants():
    docked = MODELS / "variants" / "docking.toml"
    with pytest.raises(multibody.ModelError, match="no variant"):
        multibody.load(docked, variant="undocked and lost")


def test_conversion_gives_an_equal_model():
    text = multibody.convert(MODELS / "ur5.urdf")
    original, converted = multibody.load(MODELS / "ur5.urdf"), multibody.load(text=text)
    q, v = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6], [1.0] * 6
    assert (original.accelerations(q, v) == converted.accelerations(q, v)).all()
    with pytest.raises(multibody.ModelError):
        multibody.convert(text=BROKEN)


def test_generated_code():
    model = multibody.load(MODELS / "double_pendulum.toml")
    rust = model.generate("rust", ["rates", "energy"])
    assert list(rust) == ["double_pendulum.rs"] and "pub struct DoublePendulum" in rust["double_pendulum.rs"]
    c = model.generate("c", name="Arm", scalar="f32")
    assert sorted(c) == ["double_pendulum.c", "double_pendulum.h"] and "float" in c["double_pendulum.h"]
    wasm = model.generate("wasm")
    assert wasm["double_pendulum.wasm"][:4] == b"\0asm"
    for wrong in (dict(lang="ada"), dict(outputs=["rate"]), dict(name="arm"), dict(scalar="f16")):
        with pytest.raises(ValueError):
            model.generate(**wrong)
    with pytest.raises(multibody.ModelError):
        model.generate(outputs=["multipliers"])
    with pytest.raises(multibody.ModelError):
        model.generate(outputs=["frames"], frames=["nose"])


def mutated(text, seed):
    """The text with some pieces cut, doubled, exchanged or overwritten."""
    rng = random.Random(seed)
    words = ["nan", "inf", "-1", "1e400", "1e-320", "''", "\"", "[", "]", "{", "<", ">", "/>", "=", "\0", "连杆", "0", "name"]
    for _ in range(rng.randint(1, 6)):
        at, length = rng.randrange(len(text) + 1), rng.randrange(40)
        other = rng.randrange(len(text) + 1)
        piece = rng.choice(["", text[other : other + length], rng.choice(words), text[at : at + length] * 2])
        text = text[:at] + piece + text[at + length :]
    return text


def test_malformed_texts_never_end_the_process():
    names = ["double_pendulum.toml", "ur5.urdf", "mechanisms/fourbar.toml", "contacts/hopper.toml", "satellite.toml",
             "mjcf/hopping_leg.xml"]
    formats = {"toml": "toml", "urdf": "urdf", "xml": "mjcf"}
    texts = [((MODELS / name).read_text(), formats[name.rsplit(".")[-1]]) for name in names]
    read = moved = 0
    for seed in range(1000):
        text, format = texts[seed % len(texts)]
        text, begin = mutated(text, seed), time.process_time()
        try:
            model = multibody.load(text=text, format=format, search=False)
        except multibody.ModelError as error:
            assert error.findings
            assert any(finding.severity == "error" for finding in multibody.check(text=text, format=format)), seed
        else:
            read += 1
            assert model.nv == len(model.velocity_names)
            q, v = model.start()
            assert np.shape(model.momenta(q, v)) == (model.nv,)
            motion = model.rollout((q, v), dt=1e-3, steps=5, on_error="mark")
            # What fails says so, and what does not has numbers.
            moved += not motion.failures
            assert motion.failures or np.isfinite(motion.q).all(), seed
        assert time.process_time() - begin < 10, seed
    assert read > 10 and moved > 5
