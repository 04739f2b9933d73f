"""A body cut by its planes of symmetry answers as the whole does: to round-off, on meshes that are mirror images."""

from __future__ import annotations

from pathlib import Path

import pytest

import softmark

BODY = """softmark 1
scene "symmetry"
material gel = neo_hookean(young = 60 kPa, poisson = 0.3, density = 1000 kg/m^3)
body bar = solid({shape}, gel)
{supports}
load weight = gravity(9.81 m/s^2, direction = {down})
{loads}
analysis rest = static(tolerance = 1e-12)
{models}
probe look = point(bar, at = {at} mm)
metric first = displacement(look, along = +x)
metric second = displacement(look, along = +y)
metric third = displacement(look, along = +z)
"""
SOLIDS = """model tets = fem(tet4, strain = corotational, size = {size} mm)
model curved = fem(tet10, strain = finite, size = {size} mm)
model hexes = fem(hex8, strain = finite, formulation = mixed, size = {size} mm)
model bricks = fem(hex20, strain = small, size = {size} mm)"""
X, Y = (f"support mirror{c} = symmetric(bar, where = {c} <= 0 mm)\n" for c in "xy")


def found(**parts: str) -> dict[str, list[float]]:
    """Displacements of the point that is looked at, m, of every model."""
    text = BODY.format(**{"loads": "", "down": "-z", **parts})
    report = softmark.loads(text).run()
    for name, model in report.models.items():
        assert model.status == "converged", (name, model.message)
    return {k: [m.metrics[n].value for n in ("first", "second", "third")] for k, m in report.models.items()}


def agree(whole: dict[str, list[float]], part: dict[str, list[float]]) -> None:
    """Relative to how far the point moves: 1e-10, the round-off of two linear systems with condition 1e4."""
    assert whole.keys() == part.keys()
    for name, u in whole.items():
        size = max(map(abs, u))
        assert size > 1e-7
        assert part[name] == pytest.approx(u, abs=1e-10 * size), name


@pytest.mark.slow
def test_half_and_quarter_of_a_bar() -> None:
    """A bar that hangs: each quarter is a bar with two planes of symmetry."""
    models = SOLIDS.format(size=10)
    hold = "support top = fixed(bar, where = z >= 0 mm)\n"
    push = "load push = traction(bar, where = z <= -60 mm, vector = (0, 0, -200) Pa)"
    common = {"models": models, "loads": push, "at": "(20, 10, -60)"}
    whole = found(shape="box(size = (40, 40, 60) mm, origin = (-20, -20, -60) mm)", supports=hold, **common)
    half = found(shape="box(size = (20, 40, 60) mm, origin = (0, -20, -60) mm)", supports=hold + X, **common)
    quarter = found(shape="box(size = (20, 20, 60) mm, origin = (0, 0, -60) mm)", supports=hold + X + Y, **common)
    agree(whole, half)
    agree(whole, quarter)


@pytest.mark.parametrize(
    ("shape", "at"),
    [
        pytest.param("sphere(radius = 10 mm, part = {part})", "(0, 0, 10)", marks=pytest.mark.slow),
        pytest.param("ellipsoid(semiaxes = (12, 8, 10) mm, part = {part})", "(12, 0, 0)", marks=pytest.mark.slow),
        pytest.param(
            "spherical_shell(radius = 10 mm, inner = 6 mm, part = {part})", "(6, 0, 0)", marks=pytest.mark.slow
        ),
    ],
)
def test_half_and_quarter_of_round_bodies(shape: str, at: str) -> None:
    """A ball that rests on a cap under its weight and a pressure, which planes of symmetry bear where it meets them."""
    common = {"models": SOLIDS.format(size=5), "at": at}
    hold = "support cap = fixed(bar, where = z <= -8 mm)\n"
    common["loads"] = "load push = pressure(bar, where = z >= 5 mm, magnitude = 100 Pa)"
    whole = found(shape=shape.format(part="whole"), supports=hold, **common)
    agree(whole, found(shape=shape.format(part="half"), supports=hold + X, **common))
    agree(whole, found(shape=shape.format(part="quarter"), supports=hold + X + Y, **common))


def test_half_a_beam() -> None:
    """Clamped at both ends and loaded by its weight: the section in the plane keeps its direction."""
    clamp = "support wall = fixed(bar, where = x >= 100 mm)\n"
    both = clamp + "support other = fixed(bar, where = x <= -100 mm)\n"
    shape = "box(size = ({} mm, 10 mm, 10 mm), origin = ({} mm, -5 mm, -5 mm))"
    rod = "model rod = beam6dof(segments = {})"
    common = {"at": "(25, 0, 0)"}
    whole = found(shape=shape.format(200, -100), supports=both, models=rod.format(20), **common)
    agree(whole, found(shape=shape.format(100, 0), supports=clamp + X, models=rod.format(10), **common))


def test_a_plane_of_symmetry_of_a_file_is_not_loaded_either(tmp_path: Path) -> None:
    """Nodes of a file lie in it to rounding: here 1e-9 mm beside it, of a body of 20 mm."""
    sound = (Path(__file__).parents[1] / "errors" / "parts" / "sound.mesh").read_text()
    lines = [f"1e-9{line[1:]}" if line.startswith("0 ") else line for line in sound.splitlines()]
    (tmp_path / "half.mesh").write_text("\n".join(lines))
    text = BODY.format(
        shape=f'mesh("{tmp_path / "half.mesh"}", unit = 1 mm)',
        supports="support end = fixed(bar, where = x >= 20 mm)\n" + X,
        loads="load push = traction(bar, where = x <= 0 mm, vector = (0, 0, -200) Pa)",
        models="model hexes = fem(hex8, strain = small)",
        down="-z",
        at="(10, 5, 5)",
    )
    with pytest.raises(softmark.SceneError, match="acts on the plane of symmetry"):
        softmark.loads(text).run()
