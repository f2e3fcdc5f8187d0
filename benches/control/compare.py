"""Runs both programs in turn and writes the table: `python compare.py WORK ROUNDS COMPILER RUST`."""

import json
import pathlib
import platform
import statistics
import subprocess
import sys

import crocoddyl
import pinocchio

SCENES = ["acrobot", "ur5"]
# Solves of one problem in each round.
SOLVES = 3
TITLES = {
    "ours": "multibody",
    "baseline": "multibody, instructions of the target's baseline only",
    "midpoint": "Crocoddyl, midpoint rule",
    "euler": "Crocoddyl, semi-implicit Euler rule",
}


def commands(work, scene):
    problem = str(work / f"{scene}.problem")
    theirs = [str(work / "crocoddyl"), str(work / f"{scene}.model"), problem]
    return {
        "ours": [str(work / "ours/release/control-ours"), scene, problem],
        "baseline": [str(work / "ours-baseline/release/control-ours"), scene, problem],
        "midpoint": [*theirs, "midpoint"],
        "euler": [*theirs, "euler"],
    }


def read(path):
    lines = path.read_text().splitlines()
    nodes, length, nx, nu = lines[0].split()
    rows = [[float(x) for x in line.split()] for line in lines[1:]]
    return {"nodes": int(nodes), "length": float(length), "nx": int(nx), "nu": int(nu), "rows": rows}


def evaluated(problem, x, u):
    """The cost of a trajectory in `(q, v)`, by the same formula for all programs: weights at the nodes."""
    _, goal, running, end, effort, *_ = problem["rows"]
    nodes, nx, nu = problem["nodes"], problem["nx"], problem["nu"]
    total = 0.0
    for k in range(nodes):
        weights = end if k == nodes - 1 else running
        total += 0.5 * sum(w * (a - g) ** 2 for w, a, g in zip(weights, x[k * nx : (k + 1) * nx], goal))
    for k in range(nodes - 1):
        total += 0.5 * sum(w * a * a for w, a in zip(effort, u[k * nu : (k + 1) * nu]))
    return total


def pressed(problem, u):
    """The share of the inputs that are at a bound."""
    low, high = problem["rows"][5:7]
    nu = problem["nu"]
    at = [a <= low[i % nu] * (1 - 1e-9) or a >= high[i % nu] * (1 - 1e-9) for i, a in enumerate(u)]
    return sum(at) / len(at)


def measured(work, scene, rounds):
    """For each program the last run, with the times of all rounds, which take turns."""
    runs = {}
    for _ in range(rounds):
        for name, command in commands(work, scene).items():
            done = subprocess.run([*command, str(SOLVES)], capture_output=True, text=True)
            if done.returncode != 0:
                sys.exit(f"{command}: {done.stderr}")
            new = json.loads(done.stdout)
            old = runs.setdefault(name, new)
            if old is not new:
                assert old["costs"] == new["costs"], command
                old["seconds"] += new["seconds"]
                old["full"] += new["full"]
    return runs


def table(problem, runs):
    numbers = {}
    for name, run in runs.items():
        count = len(run["costs"])
        solve = statistics.median(run["seconds"])
        numbers[name] = {
            "full": statistics.median(run["full"]),
            "least": min(run["full"]),
            "iteration": solve / count,
            "tried": sum(run["tried"]) / count,
            "count": count,
            "near": next(i for i, cost in enumerate(run["costs"], 1) if cost <= 1.01 * run["costs"][-1]),
            "solve": solve,
            "cost": evaluated(problem, run["x"], run["u"]),
            "pressed": pressed(problem, run["u"]),
        }
    ours = numbers["ours"]
    text = (
        "| program | derivatives, backward pass and one trajectory, us | of ours | its least, us | of ours | an iteration of the solve, us | of ours "
        "| trajectories tried in one | iterations | until within 1 % | solve, ms | cost | inputs at a bound |\n"
        "| --- |" + 12 * " ---: |" + "\n"
    )
    for name, n in numbers.items():
        cells = [
            TITLES[name],
            f"{1e6 * n['full']:.0f}",
            f"{n['full'] / ours['full']:.2f}",
            f"{1e6 * n['least']:.0f}",
            f"{n['least'] / ours['least']:.2f}",
            f"{1e6 * n['iteration']:.0f}",
            f"{n['iteration'] / ours['iteration']:.2f}",
            f"{n['tried']:.2f}",
            f"{n['count']}",
            f"{n['near']}",
            f"{1e3 * n['solve']:.1f}",
            f"{n['cost']:.2f}",
            f"{100 * n['pressed']:.0f} %",
        ]
        text += "| " + " | ".join(cells) + " |\n"
    return text


def processor():
    for line in pathlib.Path("/proc/cpuinfo").read_text().splitlines():
        if line.startswith("model name"):
            return line.split(":", 1)[1].strip()
    return platform.processor()


def main(work, rounds, compiler, rust):
    text = (
        "# Control-limited DDP: this project and Crocoddyl\n\n"
        f"Written by `benches/control/run.sh`; [README.md](README.md) says what the columns are and what could not be made equal. "
        f"Medians of {rounds} rounds in which the programs take turns; one thread of {processor()}, other work on the machine. "
        f"Crocoddyl {crocoddyl.__version__} and Pinocchio {pinocchio.__version__} of PyPI, {compiler}; {rust}.\n"
    )
    for scene in SCENES:
        problem = read(work / f"{scene}.problem")
        runs = measured(work, scene, rounds)
        text += f"\n## {scene}: {problem['nodes']} nodes of {problem['length']} s, {problem['nx']} states, {problem['nu']} inputs\n\n"
        text += table(problem, runs)
    (work / "result.md").write_text(text)
    print(text)


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]).resolve(), int(sys.argv[2]), sys.argv[3], sys.argv[4])
