"""Solutions that stating an error takes: none where nobody asked, and else those of the model's own equations."""

from __future__ import annotations

from typing import Any

import pytest

import softmark
from softmark.interpreter.cli.main import main
from softmark.interpreter.models.fem.fem_builder import PreparedSolid
from softmark.interpreter.pipeline.run_pipeline import RunOptions, run_scene

# cells of 5 mm, and supports or parts whose borders they do not follow: both have an error of their own
HELD = """
material gel  = neo_hookean(young = 60 kPa, poisson = 0.3, density = 1000 kg/m^3)
body     b    = solid(box(size = (40, 10, 10) mm), gel)
support  wall = fixed(b, where = x + y <= 8 mm)
load     down = gravity(1 m/s^2, direction = -z)
model    own  = fem(hex8, strain = small, size = 5 mm)
probe    tip  = point(b, at = (40, 5, 5) mm)
metric   sag  = displacement(tip, along = -z)
metric   push = force(wall, along = +z)
metric   most = stress(tip)
"""
PARTS = HELD.replace("x + y <= 8 mm", "x <= 0 mm").replace("support ", """\
material hard = neo_hookean(young = 200 kPa, poisson = 0.3, density = 1000 kg/m^3)
region   core = part(b, where = (x - 21 mm)^2 + (y - 5 mm)^2 + (z - 5 mm)^2 <= (6.3 mm)^2, material = hard)
support """, 1)  # fmt: skip


@pytest.fixture
def solves(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The names of models, one for each solution that is begun."""
    found: list[str] = []
    plain = PreparedSolid.solve

    def counted(self: PreparedSolid, watch: Any) -> Any:
        found.append(self.declared.name)
        return plain(self, watch)

    monkeypatch.setattr(PreparedSolid, "solve", counted)
    return found


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize("text", [HELD, PARTS], ids=["a support between nodes", "a part between nodes"])
def test_a_plain_run_solves_once(
    text: str, solves: list[str], tmp_path: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    """A second one was solved of what supports hold a part of, unasked: 21.6 s became 62.7."""
    file = tmp_path / "a.scene"
    file.write_text("softmark 1\n" + text, encoding="utf-8")
    assert main(["run", str(file), "--out", str(tmp_path / "plain")]) == 0
    assert solves == ["own"]
    assert "no error estimate for `own`" in capsys.readouterr().out
    assert main(["run", str(file), "--fresh", "--stated", "--out", str(tmp_path / "asked")]) == 0
    assert len(solves) > 2


def test_a_model_with_its_own_material_is_held_against_that_law() -> None:
    """Twice as stiff as the body: what is stated is the error of a mesh, and not the half that the law makes.

    In uniaxial tension with sides that slide, every element is exact: nothing but rounding is left, and the finite
    strain of a stretch of 1e-7.
    """
    scene = softmark.loads("""
material gel  = linear_elastic(young = 60 kPa, poisson = 0.3, density = 1000 kg/m^3)
material hard = linear_elastic(young = 120 kPa, poisson = 0.3, density = 1000 kg/m^3)
body     b    = solid(box(size = (10, 10, 10) mm), gel)
support  sx   = symmetric(b, where = x <= 0 mm)
support  sy   = symmetric(b, where = y <= 0 mm)
support  sz   = symmetric(b, where = z <= 0 mm)
load     pull = traction(b, where = x >= 10 mm, vector = (0.01, 0, 0) Pa)
model    own  = fem(hex8, strain = small, size = 5 mm, material = hard)
probe    tip  = point(b, at = (10, 0, 0) mm)
metric   way  = displacement(tip, along = +x)
metric   work = strain_energy(b)
""")
    own = run_scene(scene.scene, list(scene.warnings), RunOptions(draw=False, stated=("own",))).models["own"]
    way = own.metrics["way"].value
    assert way == pytest.approx(0.01 * 0.01 / 120e3, rel=1e-9)  # sigma L / E of the model's own law
    assert own.stated["way"].value < 1e-6 * way
    assert own.stated["work"].value < 1e-5 * own.metrics["work"].value
