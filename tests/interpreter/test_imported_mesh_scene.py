"""The beam of 2008 on the mesh of its authors: what each of their models gives, locking included.

The expected tips are those of a re-run with a code of its own (REFERENCES, section 1.4): 60 kPa, nu = 0.49, 0.216 kg
shared equally among the nodes, clamped at z = 0. Its tip is where the node nearest to the axis goes, which is
0.6 mm off it. Two decimals, one for the linear rows. GAPS are the mean distances of their outer nodes from the CT
surface, in the same table.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest

import softmark
from softmark.interpreter.results.run_report import ModelResult

MESH = 'mesh("data:silicone-beam/cylinder_Hexa.msh", unit = 1 m{split})'

SCENE = """
material silicone = linear_elastic(young = 60 kPa, poisson = 0.49, density = 1076.9 kg/m^3)
body beam = solid(cylinder(length = 178 mm, radius = 19 mm, axis = z), silicone)
support wall = fixed(beam, where = z <= 0 mm)
load weight = gravity(9.81 m/s^2, direction = -y)
probe tip = point(beam, at = (-0.578, 0.242, 178) mm)
probe skin = surface(beam, mesh = {mesh}, where = sqrt(x^2 + y^2) > 18.5 mm)
reference scan = surface("data:silicone-beam/truthCylinder-Deformed.obj", unit = 1 m, uncertainty = 0.5 mm)
metric gap = surface_distance(skin, against = scan)
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


# mm, z and -y: the re-run takes the volume change at the centre of a cell, which fails the patch test on such irregular
# cells; softmark takes that of the mean gradient. Both are the same on boxes, and so far apart at this tip.
MEAN_GRADIENT = {"selective": (0.130, -0.107)}
QUICK = "alternating"
GAPS = {  # mm
    "hexahedra": 3.38,
    "selective": 5.97,
    "alternating": 0.58,
    "repeated": 1.41,
    "linear_alternating": 14.81,
    "linear_repeated": 18.49,
}


def line(name: str) -> str:
    """The declaration of a row."""
    element, strain, split, options, _ = ROWS[name]
    file = MESH.format(split=f", split = {split}")
    return f"model {name} = fem({element}, strain = {strain}, mesh = {file}, mass = uniform, {options})"


# one row for every change
SOME = [name if name == QUICK else pytest.param(name, marks=pytest.mark.slow) for name in ROWS]


@pytest.fixture(scope="module")
def row(needs_data: Callable[[str], None]) -> Callable[[str], ModelResult]:
    """The result of a row by its name, which is computed once."""
    text = SCENE.format(models="\n".join(map(line, ROWS)), mesh=MESH.format(split=""))
    needs_data(text)
    scene = softmark.loads(text)
    return cache(lambda name: scene.run(models=[name]).models[name])


@pytest.mark.slow
@pytest.mark.parametrize("name", SOME)
def test_tip(row: Callable[[str], ModelResult], name: str) -> None:
    found = row(name)
    assert found.status == "converged"
    assert found.solve["iterations"] <= 8
    _, y, z = 1e3 * found.probes["tip"].position[0]
    expected = np.add(ROWS[name][-1], MEAN_GRADIENT.get(name, (0.0, 0.0)))
    np.testing.assert_allclose((z, -y), expected, atol=0.051 if "linear" in name else 0.011)


@pytest.mark.slow
@pytest.mark.parametrize("name", SOME)
def test_distance_from_the_scan(row: Callable[[str], ModelResult], name: str) -> None:
    gap = row(name).metrics["gap"].value
    assert gap is not None
    # all the mass is on the mesh here, as in the re-run; how closest points are found differs, by up to 0.04 mm
    # and in the selective row half of the difference at the tip comes on top
    assert 1e3 * gap == pytest.approx(GAPS[name], abs=0.04 + 0.055 * (name == "selective"))
