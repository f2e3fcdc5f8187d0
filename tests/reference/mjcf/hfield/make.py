"""Makes the reference data of MuJoCo for height fields: `python make.py`, with the packages of ../requirements.txt.

Writes `ground.hf`, heights in MuJoCo's own format, which `hills.xml` names beside a field whose heights stand in the
model, and `data.json`, which ../README.md describes. The tests read these files; they need neither Python nor MuJoCo.
"""

import json
import os
import pathlib
import struct

import mujoco
import numpy as np

HERE = pathlib.Path(__file__).resolve().parent

# Rays hit triangles, whose common corners they may miss: they pass this far beside them, towards the middle, m.
BESIDE = 1e-10


def ground():
    """Heights of no symmetry, of which the least is not 0."""
    rows, columns = 6, 4
    heights = np.random.default_rng(5).uniform(-3.0, 9.0, (rows, columns)).astype("<f4")
    (HERE / "ground.hf").write_bytes(struct.pack("<ii", rows, columns) + heights.tobytes())


def field(model, data, geom):
    """The heights of a field, and where rays along its z meet its ground beside the places of the heights, in the world."""
    asset = model.geom_dataid[geom]
    rows, columns = int(model.hfield_nrow[asset]), int(model.hfield_ncol[asset])
    start = model.hfield_adr[asset]
    size = model.hfield_size[asset]
    heights = model.hfield_data[start : start + rows * columns].astype(float) * size[2]
    place, turn = data.geom_xpos[geom], data.geom_xmat[geom].reshape(3, 3)
    points = []
    for y in np.linspace(-size[1], size[1], rows):
        for x in np.linspace(-size[0], size[0], columns):
            beside = [at - BESIDE * np.sign(at) for at in (x, y)]
            above = place + turn @ [*beside, size[2] + 1.0]
            hit = np.array([-1], dtype=np.int32)
            groups = np.zeros(6, dtype=np.uint8)
            groups[model.geom_group[geom]] = 1
            distance = mujoco.mj_ray(model, data, above, -turn[:, 2], groups, 1, -1, hit)
            assert hit[0] == geom, (x, y)
            points.append(list(above - distance * turn[:, 2]))
    return {"name": model.geom(geom).name, "rows": rows, "columns": columns, "heights": list(heights), "points": points}


def main():
    ground()
    os.chdir(HERE)
    model = mujoco.MjModel.from_xml_path("hills.xml")
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    kind = mujoco.mjtGeom.mjGEOM_HFIELD
    fields = [field(model, data, geom) for geom in range(model.ngeom) if model.geom_type[geom] == kind]
    text = ",\n".join(json.dumps(entry, separators=(",", ":")) for entry in fields)
    (HERE / "data.json").write_text(f'{{"mujoco":"{mujoco.__version__}","fields":[\n{text}\n]}}\n')


if __name__ == "__main__":
    main()
