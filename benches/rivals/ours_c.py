"""Our statements as C: `python ours_c.py ROBOT GENERATED.rs OUT.c`.

The generated Rust, statement by statement, for the compiler and the flags that the rivals' code gets. Not a product: it
tells what is due to the mathematics and what to the compiler, and what eight lanes would give.
"""

import pathlib
import re
import sys

FUNCTION = re.compile(r"    (?:pub )?fn (rates|accelerations)(?:_part(\d+))?\(&self, [^\n]*\) \{\n(.*?)\n    \}\n", re.S)
SINCOS = re.compile(r"let \((\w+), (\w+)\) = \S+::sincos_f64\((\w+)\);")


def statement(line, nq):
    """One statement of Rust in C."""
    pair = SINCOS.match(line)
    if pair:
        sine, cosine, angle = pair.groups()
        halves = [f"{name} = {f}({angle})" for name, f in ((sine, "sin"), (cosine, "cos")) if name != "_"]
        return f"const real {', '.join(halves)};"
    line = re.sub(r"^let ", "const real ", line)
    line = line.replace("self.tau[", "tau[")
    line = re.sub(r"^(?:qd|a)\[(\d+)\] =", r"out[\1] =", line)
    return re.sub(r"^pd\[(\d+)\] =", lambda m: f"out[{nq + int(m[1])}] =", line)


def kernel(robot, name, nq, functions):
    """The C of one function; parts become blocks of it."""
    main = functions[name, None]
    second = "p" if name == "rates" else "v"
    text = [f"void {robot}_{name}(const real * q, const real * {second}, const real * tau, real * restrict out)\n{{"]
    for line in main:
        part = re.match(rf"self\.{name}_part(\d+)\(", line)
        slots = re.match(r"let mut kept = \[0.0; (\d+)\];", line)
        if slots:
            text.append(f"real kept[{slots[1]}];")
        elif part:
            text += ["{", *(statement(s, nq) for s in functions[name, part[1]]), "}"]
        else:
            text.append(statement(line, nq))
    return "\n".join(text) + "\n}\n"


def main(robot, source, target):
    code = pathlib.Path(source).read_text()
    nq = int(re.search(r"const NQ: usize = (\d+);", code)[1])
    functions = {}
    for name, part, body in FUNCTION.findall(code):
        lines = [line.strip() for line in body.splitlines()]
        functions[name, part or None] = [line for line in lines if line and not line.startswith("//")]
    parts = [kernel(robot, name, nq, functions) for name in ("rates", "accelerations")]
    pathlib.Path(target).write_text('#include "lanes.h"\n' + "\n".join(parts))


if __name__ == "__main__":
    main(*sys.argv[1:])
