"""The thrust of a twisted cylinder is the small difference that coarse tetrahedra miss, whatever the law."""

from __future__ import annotations

import pytest

import softmark

LAWS = {
    "soft": "veronda_westmann(c = 5 kPa, a = 2, poisson = 0.5, density = 1000 kg/m^3)",
    "plain": "neo_hookean(young = 60 kPa, poisson = 0.5, density = 1000 kg/m^3)",
}


def twisted(law: str, element: str, size: float) -> tuple[float, float]:
    """Half a turn: by how much the thrust is off, N, and of what size it is, 1."""
    metrics = softmark.loads(f"""softmark 1
material rubber = {LAWS[law]}
body     rod    = solid(cylinder(length = 60 mm, radius = 10 mm, axis = +x), rubber)
support  wall   = fixed(rod, where = x <= 0 mm)
support  grip   = rotated(rod, where = x >= 60 mm, axis = +x, angle = 180 deg)
model    cells  = fem({element}, strain = finite, formulation = mixed, size = {size} mm)
reference theory = torsion(rod)
metric   thrust  = force(grip, along = -x)
metric   pressed = force(grip, along = -x, against = theory)
""").run().models["cells"].metrics  # fmt: skip
    thrust, pressed = metrics["thrust"].value, metrics["pressed"].value
    assert thrust is not None
    assert pressed is not None
    return pressed * thrust / (1.0 + pressed), pressed


@pytest.mark.long
@pytest.mark.slow
def test_what_tetrahedra_miss_of_a_thrust_is_of_the_mesh_and_not_of_the_law() -> None:
    """Of Veronda's and Westmann's law 2.7 % at 7 mm, of neo-Hooke's 1.3 %: the same force, and its thrust is half.

    Hexahedra on a mesh as coarse are within 0.2 %; with 5 mm the 2.7 % are 0.8 % (order 3.7), which is not repeated.
    """
    soft, share = twisted("soft", "tet10", 7.0)
    plain, less = twisted("plain", "tet10", 7.0)
    assert share == pytest.approx(0.0267, rel=0.1)
    assert less == pytest.approx(0.0131, rel=0.1)
    assert soft == pytest.approx(plain, rel=0.15)
    assert twisted("soft", "hex20", 6.0)[1] < 2e-3
