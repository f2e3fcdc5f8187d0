"""heyoka beside this project in one run: `python heyoka_table.py MBD MBD_LAB WORK [ROUNDS [SCENES]]`, tables in Markdown.

The programs take turns: in every round first heyoka's integrators run, compiled before (`heyoka_run.py`), then the project's
bench (MBD_LAB is the program `mbd-lab` with the feature `generated`). Of every setting the least processor time of all rounds
counts. Times at an error are
interpolated between neighbouring settings, in logarithms. SCENES are names separated by commas.

WORK is a folder for samples. Where `scenes.py` has not put the arms there, they are copied from `models/` without damping.
"""

import json
import math
import pathlib
import re
import subprocess
import sys

from heyoka_run import races, timed

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parent.parent
SCENES = ["double_pendulum", "ur5", "panda_arm"]
METHODS = ["rk4", "dop853", "verner9", "adams", "gauss12", "gauss16"]
TOLERANCES = [1e-9, 1e-10, 1e-11, 1e-12, 1e-13, 1e-14, 2.220446049250313e-16]
ERRORS = [1e-10, 1e-11, 1e-12, 1e-13]


def arms(work):
    work.mkdir(parents=True, exist_ok=True)
    for name in SCENES[1:]:
        path = work / f"{name}.urdf"
        if not path.exists():
            text = (ROOT / "models" / f"{name}.urdf").read_text()
            path.write_text(re.sub(r'(damping|friction)="[^"]*"', r'\1="0"', text))


def rounds(mbd, lab, work, number, scenes):
    """Least time of every setting."""
    best, integrators = {}, list(races(mbd, work, scenes, TOLERANCES))
    print("heyoka's integrators are compiled", file=sys.stderr, flush=True)
    for k in range(number):
        theirs, samples = work / "heyoka.jsonl", work / "samples.jsonl"
        theirs.write_text("".join(timed(line, run, 50) + "\n" for line, run in integrators))
        subprocess.run([lab, "bench", "work-precision", "--scenes", ",".join(scenes), "--methods", ",".join(METHODS),
                        "--rivals", theirs, "--samples", samples], check=True, stdout=subprocess.DEVNULL)
        print(f"round {k + 1} of {number}", file=sys.stderr, flush=True)
        for line in samples.read_text().splitlines():
            sample = json.loads(line)
            if sample.get("failure") or not sample["end_error"] or sample["variant"] not in (
                    "generated", "generated operations", "absolute angles"):
                continue
            key = tuple(sample[k] for k in ("scene", "tool", "variant", "method", "setting"))
            if key not in best or sample["cpu_s"] < best[key]["cpu_s"]:
                best[key] = sample
    return list(best.values())


def at(samples, error, what="cpu_s"):
    """What an error costs: on the line between the two neighbouring settings, of those that no other setting beats."""
    points = sorted((math.log(s["end_error"]), math.log(s[what])) for s in samples)
    front = []
    for e, t in points:
        if not front or t < front[-1][1]:
            front.append((e, t))
    wanted = math.log(error)
    for (e, t), (e2, t2) in zip(front, front[1:]):
        if e <= wanted <= e2:
            return math.exp(t + (t2 - t) * (wanted - e) / (e2 - e))
    return math.exp(front[-1][1]) if front and wanted > front[-1][0] else None


def table(samples, scene):
    here = [s for s in samples if s["scene"] == scene]
    series = {}
    for s in here:
        series.setdefault((s["tool"], s["variant"], s["method"]), []).append(s)
    print(f"\n### `{scene}`\n\n| program | method | " + " | ".join(f"{e:.0e}" for e in ERRORS) + " | least error |")
    print("|---|---|" + "---|" * (len(ERRORS) + 1))
    least = {}
    for (tool, variant, method), own in sorted(series.items()):
        times = [at(own, e) for e in ERRORS]
        for e, t in zip(ERRORS, times, strict=True):
            if t:
                least[tool, e] = min(t, least.get((tool, e), math.inf))
        if method == "rk4":
            each = min(s["cpu_s"] / s["evaluations"] for s in own)
            continue
        name = tool if tool == "multibody" else f"heyoka, {variant}"
        cells = " | ".join(f"{1e3 * t:.3f}" if t else "" for t in times)
        print(f"| {name} | {method} | {cells} | {min(s['end_error'] for s in own):.1e} |")
    ratios = []
    for e in ERRORS:
        ours, theirs = least.get(("multibody", e)), least.get(("heyoka", e))
        ratios.append(f"{ours / theirs:.2f}" if ours and theirs else "")
    print("| **ours / heyoka** | | " + " | ".join(ratios) + " | |")
    parts = []
    for method in ("verner9", "adams"):
        for e in ERRORS:
            own = series.get(("multibody", "generated", method), [])
            if own and at(own, e):
                n = at(own, e, "evaluations")
                parts.append(f"{method} at {e:.0e}: {n:.0f} evaluations, {n * each * 1e3:.3f} ms")
    print(f"\nOne evaluation that waits for the one before takes {each * 1e9:.0f} ns (`rk4`, its own work included). "
          f"At that rate: {'; '.join(parts)}.")


def main(mbd, lab, work, number, scenes):
    work = pathlib.Path(work)
    arms(work)
    samples = rounds(mbd, lab, work, number, scenes)
    print(f"Times in ms, the least of {number} rounds in which the programs took turns.")
    for scene in scenes:
        table(samples, scene)


if __name__ == "__main__":
    number = int(sys.argv[4]) if len(sys.argv) > 4 else 3
    main(*sys.argv[1:4], number, sys.argv[5].split(",") if len(sys.argv) > 5 else SCENES)
