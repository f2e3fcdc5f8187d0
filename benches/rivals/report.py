"""Table and chart of a run: `python report.py FOLDER CLANG RUSTC PACKAGES ROUNDS`, from FOLDER/times.jsonl."""

import datetime
import json
import pathlib
import platform
import sys

NAMES = {
    "double_pendulum": "double pendulum", "chain10_planar": "planar chain, 10", "ur5": "UR5", "panda_arm": "Panda",
    "iiwa14": "iiwa 14", "chain6": "general chain, 6", "chain20": "general chain, 20", "solo12": "Solo 12",
    "g1": "Unitree G1", "talos": "Talos", "chain100": "general chain, 100", "planar100": "planar chain, 100",
}


def machine():
    """Processor and system."""
    fields = {}
    for line in pathlib.Path("/proc/cpuinfo").read_text().splitlines():
        if ":" in line:
            key, value = (x.strip() for x in line.split(":", 1))
            fields.setdefault(key, value)
    cpu = f"{fields.get('model name', '?')} (family {fields.get('cpu family')}, model {fields.get('model')})"
    return f"{cpu}, {platform.system()} {platform.machine()}"


class Robot:
    """Times of one robot, ns."""

    def __init__(self, rows):
        self.rows = {row["contestant"]: row for row in rows}
        self.name, self.nv = rows[0]["robot"], rows[0]["nv"]

    def ns(self, key):
        return self.rows[key]["ns_median"] if key in self.rows else None

    def best(self, keys):
        """The fastest of some contestants, if one of them ran."""
        return min((k for k in keys if k in self.rows), key=self.ns, default=None)

    @property
    def aba(self):
        return self.best(["pinocchio_local", "pinocchio_world"])

    @property
    def rival(self):
        return self.best(["casadi", "cppadcg"])

    @property
    def rival_lanes(self):
        return self.best(["casadi_lanes", "cppadcg_lanes"])


def number(x):
    return f"{x:.0f}" if x >= 100 else f"{x:.1f}"


def lines(header, rows):
    out = ["| " + " | ".join(header) + " |", "| --- |" + " ---: |" * (len(header) - 1)]
    return out + ["| " + " | ".join(row) + " |" for row in rows]


def table(robots, about, late):
    """Markdown: one call at a time, then eight lanes, then operations and agreement."""
    short = {"casadi": "CasADi", "cppadcg": "CppADCodeGen", "casadi_lanes": "CasADi", "cppadcg_lanes": "CppADCodeGen"}
    ns = lambda r, key: number(r.ns(key)) if r.ns(key) else "–"
    ratio = lambda r, key, other: f"{r.ns(key) / r.ns(other):.2f}" if r.ns(key) and other else "–"
    text = ["# Times of one run", "", *about, *late, "", "## One state a call", "",
            "ns, medians over the rounds. Ratios are our time divided by theirs: *rival* is the faster of CasADi and CppADCodeGen.", ""]
    header = ["robot (nv)", "Pinocchio ABA", "CasADi", "CppADCodeGen", "ours, q̈", "ours, (q̇, ṗ)", "q̈ / rival", "(q̇, ṗ) / rival", "q̈ / ABA", "(q̇, ṗ) / ABA"]
    keys = ["casadi", "cppadcg", "ours_accelerations", "ours_rates"]
    text += lines(header, [
        [f"{NAMES[r.name]} ({r.nv})", ns(r, r.aba), *(ns(r, k) for k in keys)]
        + [ratio(r, "ours" + k, other) for other in (r.rival, r.aba) for k in ("_accelerations", "_rates")] for r in robots])
    text += dependent(robots)
    text += ["", "## Eight states a call", "",
             "ns for each state. The rivals' C with eight doubles to a number and the C library's vector sine and cosine; our lanes; our batches of 256 states.", ""]
    header = ["robot (nv)", "CasADi", "CppADCodeGen", "ours, q̈", "ours, (q̇, ṗ)", "ours, batch of (q̇, ṗ)", "q̈ / rival", "(q̇, ṗ) / rival"]
    keys = ["casadi_lanes", "cppadcg_lanes", "ours_lanes_accelerations", "ours_lanes_rates", "ours_batch_rates"]
    text += lines(header, [
        [f"{NAMES[r.name]} ({r.nv})", *(ns(r, k) for k in keys), ratio(r, keys[2], r.rival_lanes), ratio(r, keys[3], r.rival_lanes)] for r in robots])
    text += ["", "## Operations and agreement", "",
             "Additions, multiplications, divisions of the generated code; sines, cosines, roots apart. Largest difference of any contestant from Pinocchio, relative.", ""]
    rows = []
    for r in robots:
        keys = ["casadi", "cppadcg", "ours_accelerations", "ours_rates"]
        error = max(row["error"] for row in r.rows.values())
        rows.append([NAMES[r.name], *(str(r.rows[k]["operations"]) if k in r.rows else "–" for k in keys), f"{error:.0e}"])
    text += lines(["robot", "CasADi, q̈", "CppADCodeGen, q̈", "ours, q̈", "ours, (q̇, ṗ)", "difference"], rows)
    return "\n".join(text) + "\n"


def dependent(robots):
    """The same, where every evaluation waits for the one before it; and how far the rounds lie apart."""
    keys = ["casadi", "cppadcg", "ours_accelerations", "ours_rates"]
    robots = [r for r in robots if r.rows["ours_rates"].get("ns_dependent")]
    if not robots:
        return []
    ns = lambda r, key: r.rows[key]["ns_dependent"] if key in r.rows else None
    text = ["", "## One state a call, each moved by the results of the one before", "",
            "ns, medians. An integrator calls the functions like this. *Spread*: half of the rounds lie within so many percent of the "
            "median, the worst of all contestants, here / in the table above.", ""]
    header = ["robot (nv)", "CasADi", "CppADCodeGen", "ours, q̈", "ours, (q̇, ṗ)", "q̈ / rival", "(q̇, ṗ) / rival", "spread"]
    rows = []
    for r in robots:
        rival = min((ns(r, k) for k in keys[:2] if k in r.rows), default=None)
        away = lambda row, name, median: max(abs(x / row[median] - 1) for x in row[name]) * 100
        ours = [r.rows[k] for k in keys if k in r.rows]
        spread = [max(away(row, *names) for row in ours) for names in
                  (("ns_dependent_quartiles", "ns_dependent"), ("ns_quartiles", "ns_median"))]
        rows.append([f"{NAMES[r.name]} ({r.nv})", *(number(ns(r, k)) if ns(r, k) else "–" for k in keys),
                     *(f"{ns(r, k) / rival:.2f}" if rival else "–" for k in keys[2:]), " / ".join(f"{x:.1f}" for x in spread)])
    return text + lines(header, rows)


GREY, BLUE, ORANGE, RED = "#9aa3ad", "#5b8db8", "#e0a03c", "#c8502d"
LEGEND = [
    (GREY, "Pinocchio’s articulated-body algorithm, C++"),
    (BLUE, "best code generated from it (CasADi or CppADCodeGen; clang -O3 -march=native -ffast-math)"),
    (ORANGE, "this project, (q, v, τ) → q̈"),
    (RED, "this project, (q, p, τ) → (q̇, ṗ)"),
]
PANELS = [
    ("one state a call", [(GREY, lambda r: r.aba), (BLUE, lambda r: r.rival), (ORANGE, lambda r: "ours_accelerations"), (RED, lambda r: "ours_rates")]),
    ("eight states a call", [(BLUE, lambda r: r.rival_lanes), (ORANGE, lambda r: "ours_lanes_accelerations"), (RED, lambda r: "ours_lanes_rates")]),
]


def panel(robots, title, series, left, top, width, room):
    """Bars of one panel: how many times as fast as Pinocchio."""
    bar, gap = 13, 14
    speed = lambda r, key: r.ns(r.aba) / r.ns(key)
    present = lambda r, pick: pick(r) if pick(r) in r.rows else None
    most = max(speed(r, present(r, pick)) for r in robots for _, pick in series if present(r, pick))
    step = next(s for s in (1, 2, 5, 10, 20, 50) if most / s <= 8)
    scale = width / most
    block = 4 * bar + gap
    bottom = top + len(robots) * block - gap + 4
    out = [f'<text x="{left}" y="{top - 14}" font-weight="bold" fill="#222">{title}</text>']
    for tick in range(0, int(most / step) + 1):
        x = left + tick * step * scale
        out.append(f'<line x1="{x:.1f}" y1="{top - 6}" x2="{x:.1f}" y2="{bottom}" stroke="#e3e6e9"/>'
                   f'<text x="{x:.1f}" y="{bottom + 14}" text-anchor="middle" fill="#555">{tick * step}×</text>')
    for k, r in enumerate(robots):
        y = top + k * block + (4 - len(series)) * bar / 2
        for colour, pick in series:
            key = present(r, pick)
            if key:
                length = speed(r, key) * scale
                out.append(f'<rect x="{left}" y="{y:.1f}" width="{length:.1f}" height="{bar - 2}" fill="{colour}"/>'
                           f'<text x="{left + length + 4:.1f}" y="{y + bar - 3:.1f}" font-size="10" fill="#333">{number(r.ns(key))} ns</text>')
            y += bar
    return out


def chart(robots, about):
    """Two panels of bars beside one another."""
    left, top, width, room = 130, 132, 330, 62
    height = top + len(robots) * 66 + 34
    total = left + 2 * (width + room) + 10
    out = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {total} {height}" font-family="Helvetica, Arial, sans-serif" font-size="12">',
           '<rect width="100%" height="100%" fill="#ffffff"/>',
           '<text x="12" y="22" font-size="15" font-weight="bold" fill="#222">Forward dynamics: speed relative to Pinocchio, time of each state</text>']
    for k, (colour, label) in enumerate(LEGEND):
        y = 42 + 16 * k
        out.append(f'<rect x="14" y="{y - 9}" width="10" height="10" fill="{colour}"/><text x="30" y="{y}" fill="#333">{label}</text>')
    for k, r in enumerate(robots):
        out.append(f'<text x="{left - 8}" y="{top + k * 66 + 30}" text-anchor="end" fill="#222">{NAMES[r.name]}</text>')
    for k, (title, series) in enumerate(PANELS):
        out += panel(robots, title, series, left + k * (width + room), top, width, room)
    out.append(f'<text x="12" y="{height - 6}" font-size="9" fill="#777">{about}</text></svg>')
    return "\n".join(out) + "\n"


def main(folder, clang, rustc, packages, rounds):
    folder = pathlib.Path(folder)
    rows = [json.loads(line) for line in (folder / "times.jsonl").read_text().splitlines()]
    robots = [Robot([row for row in rows if row["robot"] == name]) for name in dict.fromkeys(row["robot"] for row in rows)]
    date = datetime.date.today().isoformat()
    about = [f"- Machine: {machine()}.", f"- {clang}; {rustc}; {packages.strip()}.",
             f"- {date}; `benches/rivals/run.sh VENV WORK {rounds}`: 256 random states, {rounds} rounds in changing order."]
    late = folder / "late.txt"
    late = [f"- {line}." for line in late.read_text().splitlines()] if late.exists() else []
    (folder / "table.md").write_text(table(robots, about, late))
    versions = f"{clang.split(' (')[0]}; {rustc.split(' (')[0]}; {packages.strip()}; {date}. Medians of one run."
    (folder / "chart.svg").write_text(chart(robots, f"{machine()}; {versions}"))


if __name__ == "__main__":
    main(*sys.argv[1:])
