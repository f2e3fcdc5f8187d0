"""Filter over generated Rust: products that are used once melt into the sum that uses them (`mul_add`).

An experiment: `RIVALS_FILTER="python3 ours_fma.py"` at the build of `ours`. Of two products in one sum the deeper one is fused.
"""

import re
import sys

LET = re.compile(r"^(\s*)let (\w+) = (-?[\w.]+) ([-+*/]) (-?[\w.]+);$")
WORD = re.compile(r"[A-Za-z_]\w*")


def number(x):
    """An operand that methods can be called on."""
    return f"({x}_f64)" if re.match(r"-?\d", x) else f"({x})" if x.startswith("-") else x


def contract(lines):
    """One function body."""
    parsed = [LET.match(line) for line in lines]
    uses, depth, product = {}, {}, {}
    for line, m in zip(lines, parsed):
        for word in WORD.findall(line.split("=", 1)[1] if "=" in line else line):
            uses[word] = uses.get(word, 0) + 1
    for k, m in enumerate(parsed):
        if not m:
            continue
        _, name, a, op, b = m.groups()
        depth[name] = 1 + max(depth.get(a.lstrip("-"), 0), depth.get(b.lstrip("-"), 0))
        if op == "*":
            product[name] = (k, a, b)
    out, gone = list(lines), set()
    for k, m in enumerate(parsed):
        if not m or m[4] not in "+-":
            continue
        space, name, a, op, b = m.groups()
        ready = [x for x in (a, b) if x in product and uses[x] == 1]
        if not ready or a == b:
            continue
        fused = max(ready, key=lambda x: depth[x])
        at, x, y = product[fused]
        gone.add(at)
        if fused == a:
            out[k] = f"{space}let {name} = {number(x)}.mul_add({y}, {'-' if op == '-' else ''}{b});".replace("--", "")
        else:
            out[k] = f"{space}let {name} = ({'-' if op == '-' else ''}{number(x)}).mul_add({y}, {a});"
    return [line for k, line in enumerate(out) if k not in gone]


def main():
    body, inside = [], False
    for line in sys.stdin.read().splitlines():
        if inside and line == "    }":
            print("\n".join(contract(body)))
            inside = False
        if inside:
            body.append(line)
            continue
        print(line)
        if re.match(r"    (pub )?fn \w+\(&self", line):
            body, inside = [], True


main()
