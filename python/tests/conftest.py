"""Models of the repository and random states."""

import pathlib

import numpy as np
import pytest

import multibody

REPOSITORY = pathlib.Path(__file__).resolve().parents[2]
MODELS = REPOSITORY / "models"


def states(model, rows, seed=0):
    """Random coordinates, with unit quaternions, and velocities."""
    random = np.random.default_rng(seed)
    q = model.neutral() + random.uniform(-0.7, 0.7, (rows, model.nq))
    unit = [k for k, x in enumerate(model.neutral()) if x == 1.0]
    for k in unit:
        q[:, k - 3 : k + 1] /= np.linalg.norm(q[:, k - 3 : k + 1], axis=1, keepdims=True)
    return q, random.uniform(-1, 1, (rows, model.nv))


@pytest.fixture(scope="session")
def arm():
    return multibody.load(MODELS / "ur5.urdf")


@pytest.fixture(scope="session")
def robot():
    """A floating robot."""
    return multibody.load(MODELS / "solo12.urdf", base="floating", search=False)


@pytest.fixture(scope="session")
def linkage():
    """A mechanism with loops."""
    return multibody.load(MODELS / "mechanisms" / "fourbar.toml", search=False)
