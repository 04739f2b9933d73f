"""Units that decks of FEBio declare, and load curves that end at zero."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from softmark.interpreter.cli.main import main
from softmark.interpreter.importers import deck_units, import_formats
from softmark.interpreter.importers.deck_units import MissingUnit
from softmark.interpreter.importers.imported_deck import NotImportable

PARTS = Path(__file__).parents[1] / "errors" / "parts"


@pytest.mark.parametrize(
    ("declared", "system"),
    [("SI", "m-kg-s"), ("mm-N-s", "mm-t-s"), ("mm-kg-s", "mm-kg-s"), ("um-nN-s", "um-g-s"), ("CGS", "cm-g-s"),
     ("mm-g-s", "mm-g-s"), ("mm-mg-s", "mm-mg-s"), ("mm_N_s", "mm-t-s")],
)  # fmt: skip
def test_units_that_a_deck_of_febio_declares_are_used_and_compared(declared: str, system: str, tmp_path: Path) -> None:
    """The names and their meaning are those of FEBio's manual: mm, N and s make MPa and t."""
    text = (PARTS / "cube-pressed.feb").read_text().replace("mm-N-s", declared)
    (tmp_path / "cube.feb").write_text(text)
    own = import_formats.read(tmp_path / "cube.feb").units
    found = deck_units.agree_on_units(None, own)
    assert found == deck_units.units_of_system(system)
    assert (
        deck_units.agree_on_units(deck_units.read_unit_options(None, f"{found.length.factor} m", None, None), own)
        == found
    )
    other = "m-kg-s" if system != "m-kg-s" else "mm-t-s"
    with pytest.raises(deck_units.ContradictoryUnits, match="declares the units"):
        deck_units.agree_on_units(deck_units.units_of_system(other), own)


def test_units_that_are_declared_in_no_known_system_are_asked_for(tmp_path: Path) -> None:
    (tmp_path / "cube.feb").write_text((PARTS / "cube-pressed.feb").read_text().replace("mm-N-s", "in-lbf-s"))
    own = import_formats.read(tmp_path / "cube.feb").units
    with pytest.raises(MissingUnit, match="declares the unknown unit system `in-lbf-s`"):
        deck_units.agree_on_units(None, own)
    assert deck_units.agree_on_units(deck_units.units_of_system("mm-t-s"), own) == deck_units.units_of_system("mm-t-s")


def test_a_curve_of_febio_that_ends_at_zero_loads_nothing_without_a_word() -> None:
    """The curve of `cube-released.feb` is 1 at time 0.5 and 0 at time 1; the pressure is 0.001 times the curve."""
    with pytest.raises(NotImportable, match=r"but its load curve 1 is 1 at time 0\.5") as refused:
        import_formats.read(PARTS / "cube-released.feb")
    assert refused.value.code == "E758"
    assert "--at 0.5" in refused.value.remedy
    found = import_formats.read(PARTS / "cube-weighed.feb")
    assert (found.pushes, len(found.weights), len(found.ended)) == ([], 1, 1)
    assert import_formats.read(PARTS / "cube-released.feb", 0.5).pushes[0].pressure == pytest.approx(0.001, rel=1e-14)
    later = import_formats.read(PARTS / "cube-released.feb", 0.75)
    assert later.pushes[0].pressure == pytest.approx(0.0005, rel=1e-14)
    assert not later.ended
    assert any("load curve 1: 0.5 at time 0.75, 1 at time 0.5" in own for own in later.taken)


def test_what_was_taken_in_one_way_is_printed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["import", str(PARTS / "cube-pressed.feb")]) == 0
    assert "values that follow a load curve are taken at the end of the analysis" in capsys.readouterr().err
    assert "unit = 1 mm" in (tmp_path / "cube-pressed.scene").read_text()
