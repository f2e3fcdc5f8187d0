"""The table and the chart of a comparison."""

import math

import matplotlib

matplotlib.use("svg")
import matplotlib.pyplot as plt

# Okabe and Ito's colours, which colour-blind readers tell apart; marks differ too.
OURS, RIVALS = ("#0072B2", "o"), {"MuJoCo": ("#D55E00", "s"), "Drake": ("#009E73", "^")}
# Errors below this are rounding, m; the chart ends there.
FLOOR = 1e-15
# Errors of a rival's runs that every one of them is compared at, m.
USEFUL = 1e-3


def seconds(x):
    return f"{1e3 * x:.3g} ms" if x < 1 else f"{x:.3g} s"


def metres(x):
    return "diverges" if not math.isfinite(x) else f"{x:.1e}"


def knob(run):
    return next(f"{name} {run[name]:g}{unit}" for name, unit in (("step", " s"), ("accuracy", ""), ("tolerance", "")) if name in run)


def fastest(runs, least):
    """The fastest run whose error is at most `least`; `None` where there is none."""
    good = [r for r in runs if r["error"] <= least]
    return min(good, key=lambda r: r["seconds"], default=None)


def faster(run, ours):
    """How many times faster than a run our fastest one with no more error is; 0 where there is none."""
    mine = fastest(ours, run["error"])
    return run["seconds"] / mine["seconds"] if mine else 0.0


def times(x):
    return f"{x:.3g} times" if x else "none as exact"


def table(header, rows):
    lines = [header, ["---"] * len(header), *rows]
    return "".join("| " + " | ".join(cells) + " |\n" for cells in lines)


def summary(result):
    """For each scene and rival: its best run, and how much faster ours are."""
    short, long = [], []
    for scene in result["scenes"]:
        own = min(scene["ours"], key=lambda r: r["error"])
        cells = []
        for rival in result["versions"]:
            best = min(scene["rivals"][rival], key=lambda r: r["error"])
            mine = fastest(scene["ours"], best["error"])
            useful = [faster(r, scene["ours"]) for r in scene["rivals"][rival] if r["error"] <= USEFUL]
            cells += [times(faster(best, scene["ours"])), times(min(useful)) if useful else "no such run"]
            long.append([
                scene["title"], rival, metres(best["error"]), f'{best["setting"]}, {knob(best)}', seconds(best["seconds"]),
                *([f'{mine["setting"]}, {knob(mine)}', metres(mine["error"]), seconds(mine["seconds"])] if mine else ["none", "", ""]),
            ])
        short.append([scene["title"], *cells, metres(own["error"]), seconds(own["seconds"])])
    columns = [c.format(rival) for rival in result["versions"] for c in ("faster than {}", "least advantage over {}")]
    text = table(["scene", *columns, "our least error, m", "its time"], short)
    columns = ["scene", "program", "its least error, m", "its settings", "its time"]
    return text + "\n" + table([*columns, "our fastest run with no more error", "its error, m", "our time"], long)


def tables(result):
    text = summary(result)
    for scene in result["scenes"]:
        reference = "the analytic answer" if scene["known"] else "our run at a tolerance of 1e-13"
        text += f"\n### {scene['title'].capitalize()}\n{scene['end']:g} s; errors against {reference}.\n\n"
        rows = []
        for rival, runs in ({"multibody": scene["ours"]} | scene["rivals"]).items():
            rows += [[rival, r["setting"], knob(r), seconds(r["seconds"]), metres(r["error"])] for r in runs]
        text += table(["program", "settings", "step, accuracy or tolerance", "time", "error, m"], rows)
    return text


def front(runs):
    """The runs that no faster one is as exact as."""
    best = []
    for r in sorted(runs, key=lambda r: r["seconds"]):
        if not best or r["error"] < best[-1]["error"]:
            best.append(r)
    return best


def chart(result, path):
    plt.rcParams.update({"font.size": 9, "svg.fonttype": "none", "font.family": "sans-serif", "svg.hashsalt": "contacts"})
    figure, axes = plt.subplots(2, 3, figsize=(10.5, 6.4), layout="constrained")
    axes = axes.ravel()
    handles = {}
    for axis, scene in zip(axes, result["scenes"]):
        programs = {"multibody": (scene["ours"], *OURS)} | {n: (runs, *RIVALS[n]) for n, runs in scene["rivals"].items()}
        for name, (runs, colour, mark) in programs.items():
            places = lambda some: ([r["seconds"] for r in some], [max(r["error"], FLOOR) for r in some])
            runs = [r for r in runs if math.isfinite(r["error"])]
            axis.loglog(*places(runs), mark, color=colour, ms=3, alpha=0.35, mew=0)
            (line,) = axis.loglog(*places(front(runs)), mark, ls="-", color=colour, lw=1.4, ms=4.5)
            handles.setdefault(name, line)
        axis.set_title(f"{scene['title'].capitalize()}, {scene['end']:g} s", fontsize=9.5, loc="left")
        axis.grid(True, which="major", color="#dddddd", lw=0.6)
        axis.spines[["top", "right"]].set_visible(False)
    for k in range(0, 6, 3):
        axes[k].set_ylabel("error of the end state, m")
    for axis in axes[2:5]:
        axis.set_xlabel("run time, s")
    axes[5].axis("off")
    title = "Marks: all runs. Lines: those\nthat no faster run is as exact as."
    axes[5].legend(handles.values(), handles.keys(), loc="center left", frameon=False, title=title, alignment="left")
    figure.savefig(path, metadata={"Date": None})
    plt.close(figure)


INTRODUCTION = """# Contacts: error against run time

Written by `KEEP=1 benches/contacts/run.sh VENV` ([`benches/contacts`](../benches/contacts/README.md)), with {programs}. Each scene
is one model of `models/contacts/`, read by all programs, so that masses, inertias, shapes, pairs, springs, limits and friction
are the same numbers. Before anything is timed, masses and energies at the start, a motion without contacts and the place of the
first contact are compared: they agree with ours to 1e-8. One thread, other work on the machine: compare times within this
report only.

- *Error*: the largest distance, over all bodies, between where their origins and centres of mass end and where they should:
  by analysis for the block and the ball, elsewhere by this project's own run at a tolerance of 1e-13, which is no independent
  answer. What is compared there is how far each program is from the motion of rigid bodies with Coulomb friction and the
  restitution of the model; `testing/tests/contacts` compares that motion with independent answers. As steps get shorter and
  contacts harder, Drake comes to within 10 µm of our end of the dropped quadruped, and both programs within 2 µm of the one that
  stands; our own time steps come to within 2 µm and 0.2 µm.
- This project moves *by events*, from one to the next at a tolerance, or by *time steps* of one length with the impulses of all
  contacts at once, whose error is of the first order where bodies land.
- *Time*: the least of three rounds within the process. Machine code of this project is made before; Drake's time is that of one
  call into C++.
- MuJoCo's contacts are soft by design: forces follow from a depth of penetration and a speed of slip that never vanish. It
  solves another problem than rigid contact, on purpose, and no step makes its answers converge to that of the rigid one:
  only harder settings do, until the step is too long for them. Its settings: `default` (implicitfast, elliptic cones),
  `impratio 100`, `stiff` (and a time constant of two steps, its least), `hard` (and impedances of 0.99 to 0.9999), `no slip`
  (and 20 iterations that reduce slip), `RK4`. Its solver has its own tolerance and iterations in `default`, `impratio 100` and
  `stiff`, and 1e-12 and 200 in the others. The ball needs a spring and damper that give the restitution: as stiff as 10
  or 40 steps resolve. Moments of inertia of zero, which it refuses, are 1e-9 kg m² there, and points are balls of 1 µm.
{drake}- *Faster* is the time of a program for its least error over ours for no more. The aim is 10. *Least advantage* is the same for
  the worst for us of all its runs with errors of at most {useful:g} m: programs that need not be exact are quick. Best errors of
  settings that do not converge are also luck of a step: look at their neighbours.
- MuJoCo's least error for the dropped quadruped is 1 mm, which its neighbours do not reach, and which our time steps of 10 ms
  do. *Least advantage* is far from the aim where an error of 0.1 to 1 mm is enough for a block that slides or a quadruped that
  stands: motions by events take a time that hardly depends on the tolerance, and MuJoCo a few long steps.

![Error of the end state against run time](figures/contacts.svg)

"""

DRAKE = """\
- Drake's contacts are springs and dampers with friction that depends on the speed of slip, by design too; its documents advise
  to approximate rigid contact by great stiffness. Discrete plants take fixed steps with an implicit solver: `SAP`, `lagged`
  (Drake's default), `similar` and `TAMSI`. `SAP, rigid` has a stiffness of 1e12 N/m, which SAP bounds by itself, and a relaxation
  time of a step divided by π. Continuous plants have error control, to accuracies of 1e-2 to 1e-8: `CENIC`, `radau3`,
  `implicit_euler`, `runge_kutta3`. Without a word, a setting has Drake's own stiffness, dissipation and speed of stiction; `hard`
  has 1e6 N/m, 500 s/m and 1e-5 m/s, `harder` 1e8 N/m, 5000 s/m and 1e-7 m/s. A box is its eight corners. The stops of the knees
  are those of Drake; continuous plants have none except with CENIC, so that the dropped quadruped has no other integrator. A run
  that does not end within {limit:g} s has no line, nor has one that Drake gives up, and is the last of its settings.
- Drake has no coefficient of restitution. `SAP, spring` is a linear spring and damper that gives it at every speed, as stiff as
  40, 160 or 640 steps resolve, less the damping of the step itself. All else has the damping of Hunt and Crossley,
  whose restitution depends on the speed: it is 0.8 at the first impact, and more at the later ones, which no accuracy mends.
"""


def write(result, work):
    programs = " and ".join(f"{name} {number}" for name, number in result["versions"].items())
    drake = DRAKE.format(limit=result["limit"]) if "Drake" in result["versions"] else "- Drake is not in this comparison.\n"
    (work / "contacts.md").write_text(INTRODUCTION.format(programs=programs, useful=USEFUL, drake=drake) + tables(result))
    chart(result, work / "contacts.svg")
