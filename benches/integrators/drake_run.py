"""Drake's error-controlled integrators: `python drake_run.py WORK ROUNDS|start`, one JSON line a run.

One `AdvanceTo` is one call into C++, so Python costs nothing that could be seen. Drake's wheel has no headers.
"""

import json
import pathlib
import sys
import time
from importlib.metadata import version

from pydrake.common import configure_logging
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator

# Name and least accuracy, as a power of ten.
SCHEMES = {"runge_kutta3": 11, "bogacki_shampine3": 10, "runge_kutta5": 15}
# Longest step, s: Drake's own default. With the whole time as the longest, runge_kutta5 did not come back within minutes.
LONGEST = 0.1
# s for one setting
BUDGET = 4.0


def scenes(work):
    for line in (work / "scenes.txt").read_text().splitlines():
        name, end, n, *rest = line.split()
        numbers, n = [float(x) for x in rest], int(n)
        yield name, float(end), numbers[:n], numbers[n:]


def plant(path):
    made = MultibodyPlant(0.0)
    Parser(made).AddModels(str(path))
    made.Finalize()
    return made


def run(system, q, v, end, scheme, accuracy):
    """Processor time of one run, s, and the simulator after it."""
    # A new one each time: no step size is left over from the last run.
    simulator = Simulator(system)
    if scheme:
        ResetIntegratorFromFlags(simulator, scheme, LONGEST)
        simulator.get_mutable_integrator().set_target_accuracy(accuracy)
    simulator.get_mutable_context().SetContinuousState([*q, *v])
    simulator.Initialize()
    simulator.get_mutable_integrator().ResetStatistics()
    begin = time.thread_time()
    simulator.AdvanceTo(end)
    return time.thread_time() - begin, simulator


def race(name, end, q, v, path, rounds):
    system = plant(path)
    n = system.num_velocities()
    assert system.num_positions() == n == len(q) and system.num_actuators() == 0
    settings = [(scheme, 10.0**-digits) for scheme, most in SCHEMES.items() for digits in range(2, most + 1)]
    for scheme, accuracy in [(None, None), *settings]:
        begin, times = time.thread_time(), []
        try:
            while len(times) < rounds and (not times or time.thread_time() - begin < BUDGET):
                seconds, simulator = run(system, q, v, end, scheme, accuracy)
                times.append(seconds)
        except RuntimeError as failure:
            print(f"{name}: {scheme} fails at accuracy {accuracy}: {failure}", file=sys.stderr)
            continue
        state = simulator.get_context().get_continuous_state_vector().CopyToVector()
        print(json.dumps({
            "tool": "drake", "version": version("drake"), "scene": name, "method": scheme or "default",
            "setting": f"accuracy={accuracy:g}" if accuracy else "as it comes", "cpu_s": min(times),
            "evaluations": simulator.get_integrator().get_num_derivative_evaluations(), "t_end": end,
            "q": list(state[:n]), "v": list(state[n:])}), flush=True)


def start(name, q, v, path):
    system = plant(path)
    context = system.CreateDefaultContext()
    context.SetContinuousState([*q, *v])
    rates = system.EvalTimeDerivatives(context).CopyToVector()
    print(json.dumps({"tool": "drake", "scene": name, "a": list(rates[len(q):])}))


def main(work, what):
    configure_logging()
    for name, end, q, v in scenes(work):
        path = work / f"{name}.urdf"
        if what == "start":
            start(name, q, v, path)
        else:
            race(name, end, q, v, path, int(what))


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]), sys.argv[2])
