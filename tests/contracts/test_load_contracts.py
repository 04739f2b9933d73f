"""Contracts of loads that act on a whole body: they must report planes and axes about which they are not symmetric."""

from __future__ import annotations

from typing import Annotated, Any

import pytest

from softmark.interpreter.cli.conformance.load_contracts import load_breaches
from softmark.interpreter.vocabulary.loads.body_force import BodyForce
from softmark.interpreter.vocabulary.loads.load import NOTHING, Load, SolidAction
from softmark.records import dataclass

REASON = ("", "is not symmetric", "here", "remove it")


@dataclass(frozen=True)
class TidalForce(SolidAction):
    """Force per mass along y and z that grows linearly with z."""

    y: float  # 1/s^2
    z: float  # 1/s^2
    faults: tuple[str, ...] = ()

    def independent_forces(self, check: Any) -> Any:
        return check.mass_forces(NOTHING, (NOTHING, (0.0, 0.0, self.y), (0.0, 0.0, self.z)))

    def mirror_fault(self, axis: int, place: float, plane: str) -> Any:
        return REASON if "mirror" in self.faults else None

    def plane_fault(self, revolved: bool) -> Any:
        return REASON if "plane" in self.faults else None

    def axial_fault(self, body: str) -> Any:
        return REASON if "axial" in self.faults else None


@dataclass(frozen=True)
class Tidal(Load):
    """Tidal force."""

    strength = "rate"

    rate: Annotated[float, "s^-2", "growth along z"]
    across: Annotated[float, "1", "the same along y, relative"] = 0.0
    faults: tuple[str, ...] = ()

    @property
    def action(self) -> TidalForce:
        return TidalForce(self.across * self.rate, self.rate, self.faults)


@pytest.mark.parametrize(
    ("faults", "broken"),
    [
        (("mirror", "plane", "axial"), []),
        (("plane", "axial"), ["plane z = 0.013 m, but `mirror_fault`"]),  # at z = 0 it is symmetric
        (("mirror",), ["`plane_fault`", "`axial_fault`"]),
    ],
)
def test_a_load_that_forgets_a_symmetry_is_found(faults: tuple[str, ...], broken: list[str]) -> None:
    found = [breach.what for breach in load_breaches(Tidal(3.0, faults=faults))]
    assert len(found) == len(broken)
    assert all(words in what for words, what in zip(broken, found, strict=True))


def test_a_gradient_across_a_plane_breaks_its_symmetry_everywhere() -> None:
    found = [breach.what for breach in load_breaches(Tidal(3.0, 0.5, ("plane", "axial")))]
    assert ["y = 0 m" in found[0], "z = 0 m" in found[1], len(found)] == [True, True, 2]


def test_gravity_along_y_is_symmetric_about_the_y_axis_and_in_the_plane() -> None:
    @dataclass(frozen=True)
    class Down(Load):
        strength = "g"
        g: Annotated[float, "m/s^2", "acceleration"] = 9.81

        @property
        def action(self) -> BodyForce:
            return BodyForce((0.0, -self.g, 0.0))

    assert list(load_breaches(Down())) == []
