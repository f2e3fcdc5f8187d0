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
    return next(f"{name} {run[name]:g}{unit}" for name, unit in (("step", " s"), ("accuracy", "")) if name in run)


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
                *([mine["setting"], metres(mine["error"]), seconds(mine["seconds"])] if mine else ["none", "", ""]),
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
        rows = [["multibody", r["setting"], "", seconds(r["seconds"]), metres(r["error"])] for r in scene["ours"]]
        for rival, runs in scene["rivals"].items():
            rows += [[rival, r["setting"], knob(r), seconds(r["seconds"]), metres(r["error"])] for r in runs]
        text += table(["program", "settings", "step or accuracy", "time", "error, m"], rows)
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

TEXT
![Error of the end state against run time](figures/contacts.svg)

"""


def write(result, work):
    programs = " and ".join(f"{name} {number}" for name, number in result["versions"].items())
    (work / "contacts.md").write_text(INTRODUCTION.format(programs=programs) + tables(result))
    chart(result, work / "contacts.svg")
