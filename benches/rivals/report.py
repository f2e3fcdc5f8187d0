"""Table and chart of a run: `python report.py FOLDER CLANG RUSTC PACKAGES ROUNDS`, from FOLDER/times.jsonl."""

import datetime
import json
import pathlib
import platform
import sys

NAMES = {
    "double_pendulum": "double pendulum", "chain10_planar": "planar chain, 10", "ur5": "UR5", "panda_arm": "Panda",
    "iiwa14": "iiwa 14", "chain6": "general chain, 6", "chain20": "general chain, 20", "solo12": "Solo 12",
    "g1": "Unitree G1",
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
        """The fastest of some contestants."""
        return min((k for k in keys if k in self.rows), key=self.ns)

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


def table(robots, about):
    """Markdown: one call at a time, then eight lanes, then what each contestant needs."""
    text = ["# Times of one run", "", *about, "", "## One state a call", "",
            "ns for each state, medians over the rounds. In brackets: the best generated rival's time divided by ours.", ""]
    rows = []
    for r in robots:
        rival = r.ns(r.rival)
        ours = lambda key: f"{number(r.ns(key))} ({rival / r.ns(key):.2f})"
        rows.append([
            f"{NAMES[r.name]} ({r.nv})", number(r.ns(r.aba)), f"{number(rival)} ({r.rival})",
            ours("ours_native_accelerations"), ours("ours_plain_accelerations"), ours("ours_native_rates"), ours("ours_plain_rates"),
            f"{r.ns(r.aba) / r.ns('ours_native_accelerations'):.1f}", f"{r.ns(r.aba) / r.ns('ours_native_rates'):.1f}",
        ])
    text += lines(["robot (nv)", "Pinocchio ABA", "best generated rival", "ours, q̈, native", "ours, q̈, plain", "ours, (q̇, ṗ), native",
                   "ours, (q̇, ṗ), plain", "ABA / ours q̈", "ABA / ours (q̇, ṗ)"], rows)
    text += ["", "## The same C compiler for all", "",
             "Our statements as C, with the rivals' compiler, flags and C library: one state a call, then eight lanes (ns for each state).", ""]
    rows = []
    for r in robots:
        keys = [r.rival, "ours_clang_accelerations", "ours_clang_rates", r.rival_lanes, "ours_clang_lanes_accelerations", "ours_clang_lanes_rates"]
        cells = []
        for k, key in enumerate(keys):
            reference = r.ns(keys[0 if k < 3 else 3])
            cells.append(number(r.ns(key)) + (f" ({reference / r.ns(key):.2f})" if k % 3 else f" ({key.split('_')[0]})"))
        rows.append([NAMES[r.name], *cells])
    text += lines(["robot", "rival", "q̈", "(q̇, ṗ)", "rival, lanes", "q̈, lanes", "(q̇, ṗ), lanes"], rows)
    text += ["", "## Operations and agreement", "",
             "Additions, multiplications, divisions of the generated code; sines, cosines, roots apart. Largest difference from Pinocchio, relative.", ""]
    rows = []
    for r in robots:
        keys = ["casadi", "cppadcg", "ours_native_accelerations", "ours_native_rates"]
        error = max(row["error"] for row in r.rows.values())
        rows.append([NAMES[r.name], *(str(r.rows[k]["operations"]) for k in keys), f"{error:.0e}"])
    text += lines(["robot", "CasADi, q̈", "CppADCodeGen, q̈", "ours, q̈", "ours, (q̇, ṗ)", "difference"], rows)
    return "\n".join(text) + "\n"


SERIES = [
    ("Pinocchio ABA", "#9aa3ad", lambda r: r.aba),
    ("best code generated from Pinocchio (CasADi, CppADCodeGen; clang -O3 -march=native -ffast-math)", "#5b8db8", lambda r: r.rival),
    ("this project: (q, v, τ) → q̈", "#e0a03c", lambda r: "ours_native_accelerations"),
    ("this project: (q, p, τ) → (q̇, ṗ)", "#c8502d", lambda r: "ours_native_rates"),
]


def chart(robots, about):
    """Bars: how many times as fast as Pinocchio's forward dynamics, with the time at the end of each bar."""
    left, top, bar, gap, width = 150, 108, 13, 14, 560
    speed = lambda r, key: r.ns(r.aba) / r.ns(key)
    most = max(speed(r, pick(r)) for r in robots for _, _, pick in SERIES)
    step = next(s for s in (1, 2, 5, 10, 20) if most / s <= 12)
    scale = width / most
    height = top + len(robots) * (len(SERIES) * bar + gap) + 44
    out = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {left + width + 90} {height}" font-family="Helvetica, Arial, sans-serif" font-size="12">',
           f'<rect width="100%" height="100%" fill="#ffffff"/>',
           '<text x="12" y="22" font-size="15" font-weight="bold" fill="#222">Forward dynamics: speed relative to Pinocchio’s articulated-body algorithm</text>']
    for k, (label, colour, _) in enumerate(SERIES):
        y = 40 + 15 * k
        out.append(f'<rect x="14" y="{y - 9}" width="10" height="10" fill="{colour}"/><text x="30" y="{y}" fill="#333">{label}</text>')
    bottom = height - 40
    for tick in range(0, int(most / step) + 1):
        x = left + tick * step * scale
        out.append(f'<line x1="{x:.1f}" y1="{top - 6}" x2="{x:.1f}" y2="{bottom}" stroke="#e3e6e9"/>'
                   f'<text x="{x:.1f}" y="{bottom + 14}" text-anchor="middle" fill="#555">{tick * step}×</text>')
    y = top
    for r in robots:
        out.append(f'<text x="{left - 8}" y="{y + 2 * bar + 4}" text-anchor="end" fill="#222">{NAMES[r.name]}</text>')
        for _, colour, pick in SERIES:
            key = pick(r)
            length = speed(r, key) * scale
            out.append(f'<rect x="{left}" y="{y}" width="{length:.1f}" height="{bar - 2}" fill="{colour}"/>'
                       f'<text x="{left + length + 4:.1f}" y="{y + bar - 3}" font-size="10" fill="#333">{number(r.ns(key))} ns</text>')
            y += bar
        y += gap
    out.append(f'<text x="12" y="{height - 8}" font-size="9" fill="#777">{about}</text></svg>')
    return "\n".join(out) + "\n"


def main(folder, clang, rustc, packages, rounds):
    folder = pathlib.Path(folder)
    rows = [json.loads(line) for line in (folder / "times.jsonl").read_text().splitlines()]
    robots = [Robot([row for row in rows if row["robot"] == name]) for name in dict.fromkeys(row["robot"] for row in rows)]
    date = datetime.date.today().isoformat()
    about = [f"- Machine: {machine()}.", f"- {clang}; {rustc}; {packages.strip()}.",
             f"- {date}; `benches/rivals/run.sh VENV WORK {rounds}`: 256 random states, {rounds} rounds in changing order."]
    (folder / "table.md").write_text(table(robots, about))
    (folder / "chart.svg").write_text(chart(robots, f"{machine()}; {clang.split(' (')[0]}; {rustc.split(' (')[0]}; {packages.strip()}; {date}. Medians of one run."))


if __name__ == "__main__":
    main(*sys.argv[1:])
