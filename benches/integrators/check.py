"""Do the rivals simulate the same motion? `python check.py WORK [MBD]`; fails if not.

1. Accelerations at the start agree, with the project's too if its program MBD is given.
2. The reference, long double at two tolerances, agrees with itself.
3. The best end state of each tool is the reference.
4. Each method tends to the reference; those of first order at first order.
"""

import json
import pathlib
import subprocess
import sys

# Relative to the largest acceleration: round-off times the condition of the mass matrices; 4e-15 is seen.
START = 1e-13
# rad and rad/s. Errors of long double, grown by the chaos of the motion (README.md); 2e-14 and 5e-14 are seen.
REFERENCE = 1e-12
# The same of doubles; Drake's best is 9e-11 by what its method leaves over, the others' 7e-12 and less.
BEST = 5e-10
# Drake's methods of third order do not get further in seconds; 2e-7 is seen.
METHOD = 1e-6
FIRST_ORDER = {"euler", "implicitfast"}


def lines(path):
    return [json.loads(line) for line in path.read_text().splitlines()]


def distance(a, b):
    if None in a:
        return float("inf")
    return max(abs(x - y) for x, y in zip(a, b, strict=True))


def state(line):
    return line["q"] + line.get("v", [])


def ours(mbd, work):
    for line in (work / "scenes.txt").read_text().splitlines():
        name, _, n, *rest = line.split()
        numbers, n = [float(x) for x in rest], int(n)
        command = [mbd, "eval", "--outputs", "qdd", "--snap", "1e-6", "--input", "-", str(work / f"{name}.urdf")]
        states = json.dumps({"states": [{"q": numbers[:n], "v": numbers[n:]}]})
        answer = subprocess.run(command, input=states, text=True, capture_output=True, check=True).stdout
        yield {"tool": "mbd", "scene": name, "a": json.loads(answer)["states"][0]["qdd"]}


def main(work, mbd):
    sound = True

    def judge(what, value, limit):
        nonlocal sound
        sound &= value <= limit
        print(f"{what:55} {value:8.1e}   limit {limit:.0e}{'' if value <= limit else '   NO'}")

    starts = lines(work / "start.jsonl") + (list(ours(mbd, work)) if mbd else [])
    wanted = {s["scene"]: s["a"] for s in starts if s["tool"] == "pinocchio"}
    for s in starts:
        a = wanted[s["scene"]]
        judge(f"{s['scene']} {s['tool']}: start", distance(s["a"], a) / max(map(abs, a)), START)

    reference, errors = {}, {}
    for line in lines(work / "reference.jsonl"):
        if line["scene"] in reference:
            judge(f"{line['scene']}: reference", distance(state(line), reference[line["scene"]]), REFERENCE)
        reference[line["scene"]] = state(line)
    for line in lines(work / "rivals.jsonl"):
        if line["scene"] not in reference:
            continue
        key, found = (line["scene"], line["tool"], line["method"]), state(line)
        # heyoka has momenta in place of velocities.
        errors.setdefault(key, []).append(distance(found, reference[line["scene"]][:len(found)]))
    best = {}
    for (scene, tool, method), found in errors.items():
        best[scene, tool] = min([best.get((scene, tool), float("inf")), *found])
        if method in FIRST_ORDER:
            # The last step is half the one before.
            judge(f"{scene} {tool} {method}: error halves, but for", abs(found[-2] / found[-1] / 2 - 1), 0.1)
        elif method != "default":
            judge(f"{scene} {tool} {method}: finest", found[-1], METHOD)
    for (scene, tool), error in best.items():
        judge(f"{scene} {tool}: best", error, BEST)
    sys.exit(0 if sound else "the rivals do not agree")


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]), sys.argv[2] if len(sys.argv) > 2 else None)
