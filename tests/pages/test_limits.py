"""What the page of limits says is refused: each with the code that it names, where a scene is checked."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import softmark
from softmark.interpreter import documentation
from softmark.interpreter.language.compiled_scene import SceneError

PAGE = Path(documentation.__file__).resolve().parent / "limits.md"
GEL = "material gel = neo_hookean(young = 60 kPa, poisson = 0.3, density = 1000 kg/m^3)\n"
BAR = "body bar = solid(box(size = (100, 20, 20) mm), gel)\nsupport wall = fixed(bar, where = x <= 0 mm)\n"
LOOK = "probe tip = point(bar, at = (100, 10, 10) mm)\nmetric sag = displacement(tip, along = -z)\n"
WEIGHT = "load weight = gravity(9.81 m/s^2)\n"
HEX = "model cubes = fem(hex8, strain = finite, size = 10 mm)\n"
BEAM, SOLID = GEL + BAR + WEIGHT, GEL + BAR + WEIGHT + HEX + LOOK
FALL = "analysis fall = dynamic(duration = 10 ms, step = 1 ms)\n"
SLICE = (
    "shape strip = quadrilateral((0, 0, 0) mm, (40, 0, 0) mm, (40, 10, 0) mm, (0, 10, 0) mm)\n"
    "body bar = plane_stress(strip, gel, thickness = 1 mm)\nsupport wall = fixed(bar, where = x <= 0 mm)\n"
)
FIBRES = "material gel = guccione(2 kPa, 8, 2, 4, density = 1000 kg/m^3, fibres = +x, bulk = 20 kPa)\n"
VISCOUS = GEL.replace("gel =", "rest =") + "material gel = viscoelastic(rest, g = [0.3], tau = [1] s)\n"

CASES = {
    "plasticity": (SOLID + "material metal = plastic(young = 60 kPa)\n", "E203"),
    "heat": (SOLID + "load warm = temperature(bar, value = 30)\n", "E203"),
    "fluid at rest": (GEL + "material wet = biphasic(gel, permeability = 1e-12 m^4/(N*s))\n"
                      + BAR.replace("gel", "wet") + WEIGHT + HEX + LOOK, "E373"),
    "stress at the start": (SOLID.replace("gel)\nsupport", "gel, stress = 3 kPa)\nsupport"), "E205"),
    "shells": (SOLID.replace("solid(", "shell("), "E203"),
    "tendons in solids": (SOLID + "load pull = tendon(bar, from = (0, 15, 10) mm, to = (100, 15, 10) mm, "
                          "tension = 1 N)\n", "E501"),
    "pressure on a beam": (BEAM + "load push = pressure(bar, where = z >= 20 mm, magnitude = 10 Pa)\n"
                           "model rod = beam6dof(segments = 20)\n" + LOOK, "E501"),
    "springs of another ratio": (BEAM.replace("0.3", "0.4") + "model springs = "
                                 "mass_spring(from_material(), size = 10 mm)\n" + LOOK, "W321"),
    "mixed in motion": (SOLID.replace("size = 10", "formulation = mixed, size = 10") + FALL, "E553"),
    "incompressible": (SOLID.replace("poisson = 0.3", "poisson = 0.5"), "E552"),
    "frequencies of slices": (GEL + SLICE + "model own = fem(quad4, strain = small, size = 2 mm)\n"
                              "metric tone = frequency(bar)\n", "E545"),
    "fibres in small strain": (FIBRES + BAR + WEIGHT + HEX.replace("finite", "corotational") + LOOK, "E363"),
    "springs that relax": (VISCOUS + BAR + WEIGHT + "model net = mass_spring(from_material(), size = 10 mm)\n"
                           "analysis hold = quasistatic(duration = 1 s, step = 1 s)\n" + LOOK, "E358"),
    "fitting": (SOLID + "study fit = identify(E)\n", "E203"),
    "loops": (SOLID + "for i in 3 {}\n", "E1"),
    "conditions": (SOLID + "if x > 3 then y\n", "E1"),
    "numbers without units": (SOLID.replace("60 kPa", "60000"), "E204"),
}  # fmt: skip


@pytest.mark.parametrize("case", CASES)
def test_what_is_not_here_is_refused_as_the_page_says(case: str) -> None:
    text, code = CASES[case]
    try:
        found = softmark.loads(text).warnings
    except SceneError as error:
        found = error.diagnostics
    assert any(d.code.startswith(code) for d in found), [f"{d.code}: {d.message}" for d in found]
    assert code == "E1" or f"`{code}`" in PAGE.read_text(encoding="utf-8"), "a code that the page does not name"


def test_the_codes_of_the_page_are_tried() -> None:
    """Here, or by its own blocks; what is found only as bodies move by the example of its message."""
    text = PAGE.read_text(encoding="utf-8")
    named = set(re.findall(r"`([EW]\d{3})`", text)) | set(re.findall(r"fails=([EW]\d{3})", text))
    tried = {code for _, code in CASES.values()} | {"W639"} | set(re.findall(r"fails=([EW]\d{3})", text))
    assert named - tried == set()
