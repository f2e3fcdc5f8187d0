"""heyoka's Taylor integrators: `python heyoka_run.py MBD ROUNDS [WORK]`, one JSON line a run.

heyoka compiles the equations that it is given and integrates them by Taylor series of an order that the tolerance sets. It
is given those of this project: the operations of generated code for the canonical form, which is less to compute than what
it would derive from a Lagrangian. The double pendulum is in its own equations of Newton and Euler in absolute angles, too,
which are the shortest. Whole runs are timed, without the compilation.

Scenes: those of `lab/src/scenes/list.rs` without loops and friction; MBD is the project's program. With WORK, the arms are
read from where `scenes.py` has written them.
"""

import json
import pathlib
import re
import subprocess
import sys
import time
from importlib.metadata import version

import heyoka as hy

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
TOLERANCES = [10.0**-k for k in range(6, 16)] + [2.220446049250313e-16]
BUDGET = 4.0  # s for one setting


def generated(mbd, model, snap):
    """The text of the function that computes the rates, and the number of velocities."""
    source = ROOT / "target" / "heyoka.rs"
    source.parent.mkdir(exist_ok=True)
    subprocess.run([mbd, "generate", str(model), "--outputs", "rates", "--arithmetic", "exact", "--no-efforts", "--rolled",
                    "never", "--name", "Model", *snap, "-o", str(source)], check=True, capture_output=True)
    text = source.read_text()
    body = text[text.index("fn rates_kernel"):]
    return body[:body.index("\n    }\n")], int(re.search(r"const NV: usize = (\d+)", text)[1])


def equations(mbd, model, snap):
    """The rates of a model as heyoka's expressions."""
    body, n = generated(mbd, model, snap)
    q = [hy.expression(f"q_{k}") for k in range(n)]
    p = [hy.expression(f"p_{k}") for k in range(n)]
    names, rates = {}, {}

    def value(text):
        text = re.sub(r"\bA::fma_f64", "fma", text).replace("[l]", "")
        return eval(text, {"fma": lambda a, b, c: a * b + c}, names)  # noqa: S307: text of the project's own generator

    # The function's local arrays.
    names |= {"given": {}, "sines": {}, "cosines": {}}
    for line in body.splitlines():
        if found := re.search(r"given\[(\d+)\]\[l\] = (\w+)\.get\((\d+), l\)", line):
            names["given"][int(found[1])] = {"p": p, "q": q}[found[2]][int(found[3])]
        elif found := re.fullmatch(r"\s*let (\w+) = q\.get\((\d+), l\);", line):
            names[found[1]] = q[int(found[2])]
        elif found := re.fullmatch(r"\s*angles\[(\d+)\]\[l\] = (.*);", line):
            k, angle = int(found[1]), value(found[2])
            names["sines"][k], names["cosines"][k] = hy.sin(angle), hy.cos(angle)
        elif found := re.fullmatch(r"\s*results\[(\d+)\]\[l\] = (.*);", line):
            rates[int(found[1])] = hy.expression(0.0) + value(found[2])
        elif found := re.fullmatch(r"\s*let (\w+) = ([^;]*);", line):
            if "::" not in found[2].replace("A::", ""):
                names[found[1]] = value(found[2])
    assert len(rates) == 2 * n
    return [(x, rates[k]) for k, x in enumerate(q + p)]


def double_pendulum():
    """Two bars of 1 m and 1 kg in absolute angles: Newton's and Euler's laws."""
    a, b, va, vb = hy.make_vars("a", "b", "va", "vb")
    mass, length, com, inertia, gravity = 1.0, 1.0, 0.5, 0.0834, 9.81
    upper, lower = inertia + mass * com**2 + mass * length**2, inertia + mass * com**2
    both, turn = mass * length * com * hy.cos(a - b), mass * length * com * hy.sin(a - b)
    first = -turn * vb * vb - (mass * com + mass * length) * gravity * hy.sin(a)
    second = turn * va * va - mass * com * gravity * hy.sin(b)
    det = upper * lower - both * both
    return [(a, va), (b, vb), (va, (lower * first - both * second) / det), (vb, (upper * second - both * first) / det)]


def momenta(mbd, model, snap, q, v):
    states = json.dumps({"states": [{"q": q, "v": v}]})
    command = [mbd, "eval", "--outputs", "p", *snap, "--input", "-", str(model)]
    answer = subprocess.run(command, input=states, text=True, capture_output=True, check=True).stdout
    return json.loads(answer)["states"][0]["p"]


def race(scene, variant, system, start, end, angles, tolerances=TOLERANCES):
    """Integrators of one scene, compiled: for each what its line says, and a function that runs it once."""
    for tolerance in tolerances:
        integrator = hy.taylor_adaptive(system, start, tol=tolerance)

        def run(integrator=integrator):
            integrator.state[:], integrator.time = start, 0.0
            at = time.thread_time()
            steps = integrator.propagate_until(end)[3]
            return time.thread_time() - at, steps, angles(list(integrator.state))

        yield {"tool": "heyoka", "version": version("heyoka"), "scene": scene, "variant": variant, "method": "taylor",
               "setting": f"tol={tolerance:.1e} order={integrator.order}", "t_end": end}, run


def timed(line, run, rounds):
    """The line of one integrator, with the least time of several runs."""
    begin, times, steps, q = time.thread_time(), [], 0, []
    while len(times) < rounds and (not times or time.thread_time() - begin < BUDGET):
        spent, steps, q = run()
        times.append(spent)
    return json.dumps({**line, "cpu_s": min(times), "steps": steps, "q": q})


def races(mbd, work, scenes=None, tolerances=TOLERANCES):
    """Integrators of all scenes, or of some; those of the arms where their files are in WORK."""
    start, end = [0.5, -0.3], 10.0
    if not scenes or "double_pendulum" in scenes:
        yield from race("double_pendulum", "absolute angles", double_pendulum(), [start[0], sum(start), 0.0, 0.0], end,
                        lambda y: [y[0], y[1] - y[0]], tolerances)
    at_rest = ("double_pendulum", ROOT / "models/double_pendulum.toml", end, start, [0.0, 0.0], [])
    arms = [("ur5", 5.0, 6), ("panda_arm", 1.0, 7)]
    moving = [(name, work / f"{name}.urdf", end, [0.3 * (-1) ** k for k in range(n)], [0.5] * n, ["--snap", "1e-6"])
              for name, end, n in arms] if work else []
    for scene, model, end, q, v, snap in [at_rest, *moving]:
        if scenes and scene not in scenes:
            continue
        system = equations(mbd, model, snap)
        n = len(q)
        yield from race(scene, "generated operations", system, [*q, *momenta(mbd, model, snap, q, v)], end,
                        lambda y, n=n: y[:n], tolerances)


def main(mbd, rounds, work):
    for line, run in races(mbd, work):
        print(timed(line, run, rounds), flush=True)


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]), pathlib.Path(sys.argv[3]) if len(sys.argv) > 3 else None)
