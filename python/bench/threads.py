"""Rollouts on more and more threads: `python bench/threads.py`.

Many rows of the UR5 and of the G1 with a fixed root, 200 steps of 1 ms of the classical Runge-Kutta method with random joint forces, all of
which are recorded. The best of four rounds counts. No bit may depend on the number of threads.
"""

import os
import pathlib
import time

import numpy as np

import multibody

MODELS = pathlib.Path(__file__).resolve().parents[2] / "models"
DT, STEPS, ROUNDS = 1e-3, 200, 4
ROWS = {"ur5.urdf": 4096, "g1.urdf": 1024}


def compare(name, rows):
    """Prints the steps a second of one model."""
    model = multibody.load(MODELS / name)
    random = np.random.default_rng(0)
    q, v = random.uniform(-1, 1, (rows, model.nq)), np.zeros((rows, model.nv))
    u = random.uniform(-1, 1, (rows, STEPS, model.nv))
    first = one = None
    threads = 1
    while threads <= (os.cpu_count() or 1):
        best = np.inf
        for _ in range(ROUNDS):
            start = time.perf_counter()
            motion = model.rollout((q, v), u, dt=DT, threads=threads)
            best = min(best, time.perf_counter() - start)
        if first is None:
            first, one = motion, best
        assert (first.q == motion.q).all() and (first.v == motion.v).all()
        print(f"{name}, {threads:2} threads: {rows * STEPS / best / 1e6:7.3f} million steps a second, {one / best:5.2f} times one thread")
        threads *= 2


for name, rows in ROWS.items():
    compare(name, rows)
