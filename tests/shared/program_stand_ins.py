"""Stand-ins for programs that are not installed: scripts of Python that check their deck and answer in their formats.

FEBio: FECore/DataRecord.cpp (the table), FEBioLib/FEBioModel.cpp (the log), FEBio/FEBioApp.cpp (options).
PolyFEM: io/VTUWriter.cpp and build_high_order_vis_mesh of io/OutData.cpp (nodes of each cell by themselves, base64 with
a header of 8 bytes), save_json there; polysolve's nonlinear/Solver.cpp (the log).
SOFA: IO/Mesh/VTKExporter.cpp (text of 6 digits), ODESolver/Backward/StaticSolver.cpp (the log).
"""

from __future__ import annotations

import json
import sys
import textwrap
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

BEGIN = """\
#!{python} -IS
import base64, json, re, struct, sys
from xml.etree import ElementTree
HOW, POINTS, CELLS, U = json.load(open({data!r}))
if HOW == "NaN":
    U[0][0] = float("nan")
if HOW == "dies":
    print("no licence")
    sys.exit(3)
"""
FEBIO = """
if "-info" in sys.argv:
    print("compiled on Jan  1 2026\\nFEBio version  = 4.12.0")
    sys.exit(1)
root = ElementTree.parse(sys.argv[sys.argv.index("-i") + 1]).getroot()
(record,) = root.iter("node_data")
assert (root.tag, record.get("data"), record.get("delim")) == ("febio_spec", "ux;uy;uz", ",")
assert len([own for own in root.iter("node") if "id" in own.attrib]) == len(U)
if HOW == "nothing":
    sys.exit(0)
log = "\\n===== beginning time step 1 : 0.1 =====\\n\\n------- converged at time : 0.1\\n\\n"
if HOW == "lost":
    words = "Negative jacobian.".ljust(70)
    box = " *" + 71 * "*" + "*\\n" + " *" + "ERROR".center(71) + "*\\n" + " * " + words + "*\\n"
    open("model.log", "w").write(log + box + "\\n\\n E R R O R   T E R M I N A T I O N\\n\\n")
    sys.exit(1)
if HOW != "unfinished":
    log += "\\tTotal number of equilibrium iterations ............ : 31\\n\\n"
    for name in ("Input time ......................", "Initialization time .............",
                 "Solve time ......................"):
        log += f"\\t{name} : 0:00:00 (0.003 sec)\\n\\n"
    log += "\\n N O R M A L   T E R M I N A T I O N\\n\\n"
open("model.log", "w").write(log)
if HOW == "cut":
    U = U[:-1]
with open(record.get("file"), "w") as table:
    for step in range(11):
        table.write(f"*Step  = {step}\\n*Time  = {0.1 * step:.9g}\\n*Data  = ux;uy;uz\\n")
        for i, u in enumerate(U, start=1):
            table.write(",".join([str(i), *(f"{100.0 * step * v:.12g}" for v in u)]) + "\\n")
"""
POLYFEM = """
asked = dict(zip(sys.argv[1::2], sys.argv[2::2]))
assert asked["--max_threads"] == "1"
deck = json.load(open(asked["--json"]))
assert open(deck["geometry"][0]["mesh"]).readline() == "$MeshFormat\\n"
where = asked["--output_dir"] + "/"
line = "[2026-01-01 12:00:00.000] [polyfem] [{}] [Newton][Backtracking] Finished: {} took 0.1s"
if HOW == "lost":
    print(line.format("error", "Reached iteration limit"))
    sys.exit(1)
if HOW == "nothing":
    sys.exit(0)
print(line.format("info", "Gradient vector norm tolerance reached"))
if HOW == "cut":
    CELLS = [cell for cell in CELLS if 0 not in cell]
each = [node for cell in CELLS for node in cell]

def array(kind, name, values, width, code):
    data = struct.pack(f"<{len(values)}{code}", *values)
    text = base64.b64encode(struct.pack("<Q", len(data)) + data).decode()
    named, many = f' Name="{name}"' if name else "", f' NumberOfComponents="{width}"' if width else ""
    return f'<DataArray type="{kind}"{named}{many} format="binary">\\n{text}\\n</DataArray>\\n'

flat = lambda rows: [v for node in each for v in rows[node]]
with open(where + deck["output"]["paraview"]["file_name"], "w") as vtu:
    vtu.write('<VTKFile type="UnstructuredGrid" version="1.0" header_type="UInt64">\\n<UnstructuredGrid>\\n')
    vtu.write(f'<Piece NumberOfPoints="{len(each)}" NumberOfCells="{len(CELLS)}">\\n<Points>\\n')
    vtu.write(array("Float64", "", flat(POINTS), 3, "d") + "</Points>\\n<PointData Vectors=\\"solution\\">\\n")
    vtu.write(array("Float64", "solution", flat(U), 3, "d") + "</PointData>\\n<Cells>\\n")
    vtu.write(array("Int64", "connectivity", range(len(each)), 0, "q"))
    vtu.write(array("UInt8", "types", [10 if len(CELLS[0]) == 4 else 71] * len(CELLS), 0, "B"))
    vtu.write(array("Int64", "offsets", range(len(CELLS[0]), len(each) + 1, len(CELLS[0])), 0, "q"))
    vtu.write("</Cells>\\n</Piece>\\n</UnstructuredGrid>\\n</VTKFile>\\n")
times = ("loading_mesh", "building_basis", "assigning_rhs", "assembling_stiffness_mat", "solving")
json.dump({f"time_{name}": 1.5e-3 for name in times}, open(where + deck["output"]["json"], "w"))
"""
SOFA = """
assert sys.argv[1:5] == ["-g", "batch", "-n", "1"]
root = ElementTree.parse(sys.argv[5]).getroot()
(vtk,), (solver,) = root.iter("VTKExporter"), root.iter("StaticSolver")
assert (vtk.get("pointsDataFields"), solver.get("printLog")) == ("u=moved.output", "1")
if HOW == "nothing":
    sys.exit(0)
print("[INFO]    [StaticSolver(StaticSolver1)] ======= Starting static ODE solver =======")
for i in (1, 2):
    print(f"Newton iteration #{i}      |R| = 1.0e-03      |R|/|R0| = 1.0e+00")
if HOW == "lost":
    print("[DIVERGED] The number of Newton iterations reached the maximum of 100 iterations.")
else:
    print("[CONVERGED] The correction's ratio |du|/|U| = 1e-11 is smaller than the threshold of 1e-09.")
if HOW == "cut":
    CELLS = [cell for cell in CELLS if len(POINTS) - 1 not in cell]
    POINTS, U = POINTS[:-1], U[:-1]
ends, kinds = " ".join(str(4 * i) for i in range(1, len(CELLS) + 1)), " ".join(["10"] * len(CELLS))
rows = lambda values: "".join("\\t" + " ".join(f"{v:.6g}" for v in row) + "\\n" for row in values)
with open(vtk.get("filename") + "0.vtu", "w") as vtu:
    vtu.write('<VTKFile type="UnstructuredGrid" version="0.1" byte_order="BigEndian">\\n  <UnstructuredGrid>\\n')
    vtu.write(f'    <Piece NumberOfPoints="{len(POINTS)}" NumberOfCells="{len(CELLS)}">\\n      <PointData>\\n')
    vtu.write('        <DataArray type="Float64" Name="u" NumberOfComponents="3" format="ascii">\\n' + rows(U))
    vtu.write('        </DataArray>\\n      </PointData>\\n      <Points>\\n')
    vtu.write('        <DataArray type="Float32" NumberOfComponents="3" format="ascii">\\n' + rows(POINTS))
    vtu.write('        </DataArray>\\n      </Points>\\n      <Cells>\\n')
    told = (("Int32", "connectivity", rows(CELLS)), ("Int32", "offsets", ends), ("UInt8", "types", kinds))
    for kind, name, text in told:
        vtu.write(f'        <DataArray type="{kind}" Name="{name}" format="ascii">\\n{text}\\n        </DataArray>\\n')
    vtu.write('      </Cells>\\n    </Piece>\\n  </UnstructuredGrid>\\n</VTKFile>\\n')
"""
PROGRAMS = {"febio": ("febio4", FEBIO), "polyfem": ("PolyFEM_bin", POLYFEM), "sofa": ("runSofa", SOFA)}


def stand_in(
    program: str, how: str, points: NDArray[np.float64], cells: NDArray[np.int64], u: NDArray[np.float64], folder: Path
) -> Path:
    """A folder with a program that has points (n, 3), m, of cells (m, 4 or 10), and answers u (n, 3), m."""
    name, script = PROGRAMS[program]
    data = folder / "data.json"
    data.write_text(json.dumps([how, points.tolist(), np.asarray(cells).tolist(), u.tolist()]))
    begin = textwrap.dedent(BEGIN).format(python=sys.executable, data=str(data))
    if program == "febio":  # which is asked for its version first
        begin = begin.replace('if HOW == "dies":', 'if HOW == "dies" and "-info" not in sys.argv:')
    folder = folder / "bin"
    folder.mkdir()
    (folder / name).write_text(begin + script)
    (folder / name).chmod(0o755)
    return folder
