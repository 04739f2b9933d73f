"""The beam of 2008 on the mesh of its authors: what each of their models gives, locking included.

The expected tips are those of a re-run with a code of its own (REFERENCES, section 1.4): 60 kPa, nu = 0.49, 0.216 kg
shared equally among the nodes, clamped at z = 0. Its tip is where the node nearest to the axis goes, which is
0.6 mm off it. Two decimals, one for the linear rows.
"""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

import softmark
from softmark.interpreter.results import Report

DATA = Path(os.environ.get("SOFTMARK_DATA", Path(softmark.__file__).parents[3] / "shared" / "data"))
FILE = DATA / "silicone-beam" / "cylinder_Hexa.msh"

SCENE = """
material silicone = linear_elastic(young = 60 kPa, poisson = 0.49, density = 1076.9 kg/m^3)
body beam = solid(cylinder(length = 178 mm, radius = 19 mm, axis = z), silicone)
support wall = fixed(beam, where = z <= 0 mm)
load weight = gravity(9.81 m/s^2, direction = -y)
probe tip = point(beam, at = (-0.578, 0.242, 178) mm)
{models}
"""

ROWS = {
    "hexahedra": ("hex8", "corotational", "five", "rotation = element", (117.24, 127.37)),
    "selective": (
        "hex8",
        "corotational",
        "five",
        "rotation = element, integration = selective",
        (110.88, 133.23),
    ),
    "alternating": ("tet4", "corotational", "alternating", "rotation = point", (127.24, 118.34)),
    "repeated": ("tet4", "corotational", "repeated", "rotation = point", (122.49, 122.60)),
    "linear_alternating": ("tet4", "small", "alternating", "rotation = point", (178.4, 182.2)),
    "linear_repeated": ("tet4", "small", "repeated", "rotation = point", (178.4, 199.9)),
}


def line(name: str) -> str:
    """The declaration of a row."""
    element, strain, split, options, _ = ROWS[name]
    file = f'mesh("{FILE}", unit = 1 m, split = {split})'
    return f"model {name} = fem({element}, strain = {strain}, mesh = {file}, mass = uniform, {options})"


@pytest.fixture(scope="module")
def report() -> Report:
    if not FILE.is_file():
        pytest.skip(f"the data set is not here: {FILE} (name its folder by SOFTMARK_DATA)")
    return softmark.loads(SCENE.format(models="\n".join(map(line, ROWS)))).run()


@pytest.mark.parametrize("name", ROWS)
def test_tip(report: Report, name: str) -> None:
    found = report.models[name]
    assert found.status == "converged"
    assert found.solve["iterations"] <= 8
    _, y, z = 1e3 * found.probes["tip"].position[0]
    np.testing.assert_allclose((z, -y), ROWS[name][-1], atol=0.051 if "linear" in name else 0.011)
