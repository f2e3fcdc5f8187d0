"""The table of derivatives: `python report.py derivatives.jsonl`."""

import json
import sys

NAMES = ["pinocchio", "casadi_algorithm", "casadi_jacobian", "ours_plain", "ours_native"]


def main(path):
    rows = [json.loads(line) for line in open(path)]
    robots = list(dict.fromkeys(r["robot"] for r in rows))
    print("Derivatives, ns of one evaluation (median of the rounds), operations in parentheses. Pinocchio's")
    print("`computeABADerivatives` and C that CasADi makes of it, or of forward dynamics by its own `jacobian`, give")
    print("`∂q̈/∂(q, v, τ)`; ours give `∂(v, ṗ)/∂(q, p)`.\n")
    print("| robot | nv | Pinocchio | CasADi, algorithm | CasADi, jacobian | ours | ours, native | ours / Pinocchio | ours / best CasADi |")
    print("| --- " * 9 + "|")
    for robot in robots:
        at = {r["contestant"]: r for r in rows if r["robot"] == robot}
        cell = lambda n: "–" if n not in at else f"{at[n]['ns_median']:.0f}" + (
            f" ({at[n]['operations']})" if at[n]["operations"] else "")
        ours = at["ours_plain"]["ns_median"]
        casadi = min(at[n]["ns_median"] for n in NAMES[1:3] if n in at)
        nv = at["pinocchio"]["nv"]
        ratios = f"{ours / at['pinocchio']['ns_median']:.2f} | {ours / casadi:.2f}"
        print(f"| {robot} | {nv} | " + " | ".join(cell(n) for n in NAMES) + f" | {ratios} |")


if __name__ == "__main__":
    main(sys.argv[1])
