"""The table of mechanisms with loops: `python report.py loops.jsonl`."""

import json
import statistics
import sys

THEIRS = ["constraintDynamics", "lcaba"]
OURS = [("ours_plain", "accelerations"), ("ours_plain", "rates"), ("ours_native", "accelerations"), ("ours_native", "rates")]


def main(path):
    rows = [json.loads(line) for line in open(path)]
    print("Accelerations of mechanisms with loops, ns of one evaluation (median of the rounds). Theirs with the fewest proximal")
    print("iterations that bring the accelerations within 1e-10 of a dense solution in long double; in brackets where twenty do not: then")
    print("with the fewest that come within twice the best they reach.")
    print("Ratios: medians over the rounds of ours to Pinocchio's fastest, in brackets or not.\n")
    print("| mechanism | nv, rows: theirs | ours | " + " | ".join(THEIRS) + " | ours: q̈ (operations) | ours: q̇, ṗ (operations)"
          " | native: q̈ | native: q̇, ṗ | q̈ / fastest | q̇, ṗ / fastest | native: q̈ / fastest | native: q̇, ṗ / fastest |")
    print("| --- " * 13 + "|")
    notes = []
    for name in dict.fromkeys(r["mechanism"] for r in rows):
        at = {(r["contestant"], r["function"]): r for r in rows if r["mechanism"] == name}
        rivals = [at[n, "accelerations"] for n in THEIRS if (n, "accelerations") in at]
        median = lambda r: statistics.median(r["ns"])
        size = lambda r: f"{r['nv']}, {r['rows']}"

        def cell(n):
            r = at.get((n, "accelerations"))
            if r is None:
                return "–"
            return f"{median(r):.0f}" if r["error"] <= r["wanted"] else f"({median(r):.0f})"

        own = [at[o] for o in OURS]
        times = [f"{median(o):.0f} ({o['operations']})" for o in own[:2]] + [f"{median(o):.0f}" for o in own[2:]]
        best = min(rivals, key=median)
        ratios = [f"{statistics.median(a / b for a, b in zip(o['ns'], best['ns'])):.2f}" for o in own]
        print(f"| {name} | {size(rivals[0])} | {size(own[0])} | " + " | ".join([cell(n) for n in THEIRS] + times + ratios) + " |")
        settings = "; ".join(f"{r['contestant']} {r['settings']} ({r['error']:.0e})" for r in rivals)
        notes.append(f"- {name}: {settings}; ours {max(o['error'] for o in own):.0e}")
    print("\nSettings, and in parentheses the largest relative error of 64 states:\n")
    print("\n".join(notes))


if __name__ == "__main__":
    main(sys.argv[1])
