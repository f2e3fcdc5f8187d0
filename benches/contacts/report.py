"""The table and the chart of a comparison."""

import math

import matplotlib

matplotlib.use("svg")
import matplotlib.pyplot as plt

# Okabe and Ito's colours, which colour-blind readers tell apart; marks differ too.
OURS = "#0072B2"
THEIRS = [("#D55E00", "s"), ("#E69F00", "^"), ("#CC79A7", "D"), ("#000000", "v"), ("#009E73", "P"), ("#56B4E9", "X")]
# Errors below this are rounding, m; the chart ends there.
FLOOR = 1e-15


def seconds(x):
    return f"{1e3 * x:.3g} ms" if x < 1 else f"{x:.3g} s"


def metres(x):
    return "diverges" if not math.isfinite(x) else f"{x:.1e}"


def fastest(runs, least):
    """The fastest run whose error is at most `least`; `None` where there is none."""
    good = [r for r in runs if r["error"] <= least]
    return min(good, key=lambda r: r["seconds"], default=None)


def summary(scene):
    theirs = [r for r in scene["mujoco"] if math.isfinite(r["error"])]
    best = min(theirs, key=lambda r: r["error"])
    mine = fastest(scene["ours"], best["error"])
    own = min(scene["ours"], key=lambda r: r["error"])
    return best, mine, own


def tables(result):
    text = (
        "| scene | MuJoCo's least error, m | its settings | its time | our fastest run with no more error | its error, m "
        "| our time | faster | our least error, m | its time |\n| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n"
    )
    for scene in result["scenes"]:
        best, mine, own = summary(scene)
        cells = [scene["title"], metres(best["error"]), f'{best["setting"]}, step {best["step"]:g} s', seconds(best["seconds"])]
        if mine is None:
            cells += ["none", "", "", ""]
        else:
            ratio = best["seconds"] / mine["seconds"]
            cells += [mine["setting"], metres(mine["error"]), seconds(mine["seconds"]), f"{ratio:.3g} times"]
        text += "| " + " | ".join([*cells, metres(own["error"]), seconds(own["seconds"])]) + " |\n"
    for scene in result["scenes"]:
        reference = "the analytic answer" if scene["known"] else "our run at a tolerance of 1e-13"
        text += f"\n### {scene['title'].capitalize()}\n{scene['end']:g} s; errors against {reference}.\n\n"
        text += "| program | settings | step, s | time | error, m |\n| --- | --- | --- | --- | --- |\n"
        for r in scene["ours"]:
            text += f"| multibody | {r['setting']} | | {seconds(r['seconds'])} | {metres(r['error'])} |\n"
        for r in sorted(scene["mujoco"], key=lambda r: (r["setting"], -r["step"])):
            text += f"| MuJoCo | {r['setting']} | {r['step']:g} | {seconds(r['seconds'])} | {metres(r['error'])} |\n"
    return text


def chart(result, path):
    plt.rcParams.update({"font.size": 9, "svg.fonttype": "none", "font.family": "sans-serif", "svg.hashsalt": "contacts"})
    figure, axes = plt.subplots(2, 3, figsize=(10.5, 6.4), layout="constrained")
    axes = axes.ravel()
    styles, handles = {}, {}
    for axis, scene in zip(axes, result["scenes"]):
        shown = [r for r in scene["ours"] if math.isfinite(r["error"])]
        (line,) = axis.loglog(
            [r["seconds"] for r in shown], [max(r["error"], FLOOR) for r in shown], "o-", color=OURS, lw=1.6, ms=4.5, zorder=3
        )
        handles.setdefault("multibody, tolerances 1e-3 to 1e-13", line)
        for setting in dict.fromkeys(r["setting"] for r in scene["mujoco"]):
            runs = [r for r in scene["mujoco"] if r["setting"] == setting and math.isfinite(r["error"])]
            # Springs that bounce have a legend of their own: they take the marks in turn.
            at = styles.setdefault(setting, len(styles))
            colour, mark = THEIRS[at % len(THEIRS)]
            dashes = "--" if at < len(THEIRS) else ":"
            (line,) = axis.loglog(
                [r["seconds"] for r in runs], [max(r["error"], FLOOR) for r in runs], mark, ls=dashes, color=colour, lw=1.1, ms=4.5
            )
            handles.setdefault(f"MuJoCo, {setting}", line)
        axis.set_title(f"{scene['title'].capitalize()}, {scene['end']:g} s", fontsize=9.5, loc="left")
        axis.grid(True, which="major", color="#dddddd", lw=0.6)
        axis.spines[["top", "right"]].set_visible(False)
    for k in range(0, 6, 3):
        axes[k].set_ylabel("error of the end state, m")
    for axis in axes[2:5]:
        axis.set_xlabel("run time, s")
    axes[5].axis("off")
    axes[5].legend(handles.values(), handles.keys(), loc="center left", frameon=False, fontsize=9)
    figure.savefig(path, metadata={"Date": None})
    plt.close(figure)


INTRODUCTION = """# Contacts: error against run time

Written by `KEEP=1 benches/contacts/run.sh VENV` ([`benches/contacts`](../benches/contacts/README.md)), with MuJoCo {mujoco}. Each scene
is one model of `models/contacts/`, translated to MJCF, so that masses, inertias, shapes, pairs, springs and friction of both
programs are the same numbers. One thread, other work on the machine: compare times within this report only.

- *Error*: the largest distance, over all bodies, between where their origins and centres of mass end and where they should:
  by analysis for the block and the ball, elsewhere by this project's own run at a tolerance of 1e-13, which is no independent
  answer. What is compared there is how far each program is from the motion of rigid bodies with Coulomb friction and the
  restitution of the model; `testing/tests/contacts` compares that motion with independent answers.
- *Time*: the least of three rounds within the process. Machine code of this project is made before.
- MuJoCo's contacts are soft by design: forces follow from a depth of penetration and a speed of slip that never vanish. It
  solves another problem than rigid contact, on purpose, and no step makes its answers converge to that of the rigid one:
  only harder settings do, until the step is too long for them. Its settings: `default` (implicitfast, elliptic cones),
  `impratio 100`, `stiff` (and a time constant of two steps, its least), `hard` (and impedances of 0.99 to 0.9999), `no slip`
  (and 20 iterations that reduce slip), `RK4`. The ball needs a spring and damper that give the restitution: as stiff as 10
  or 40 steps resolve. Best errors of settings that do not converge are also luck of a step: look at their neighbours.
- *Faster* is MuJoCo's time for its least error over ours for no more. The aim is 10; where the column is below, it is missed:
  the dropped quadruped takes us longer than MuJoCo takes to its least error, which is 1 mm there, and which its neighbours
  do not reach. Moments of inertia of zero, which MuJoCo refuses, are 1e-9 kg m² there, and points are balls of 1 µm.
- Drake is not in this comparison.

![Error of the end state against run time](figures/contacts.svg)

"""


def write(result, work):
    (work / "contacts.md").write_text(INTRODUCTION.format(mujoco=result["mujoco"]) + tables(result))
    chart(result, work / "contacts.svg")
