"""What every reference says of where it is known from."""

from __future__ import annotations

from typing import Any, ClassVar, Literal

How = Literal["solved", "measured", "refined", "scanned"]
Kind = Literal["theory", "measurement", "consensus", "one_code", "digitised", "published", "own_models", "virtual_scan"]
KINDS: dict[How, Kind] = {
    "solved": "theory", "measured": "measurement", "refined": "own_models", "scanned": "virtual_scan",
}  # fmt: skip
About = Literal["cantilever", "torsion", "inflation", "bar", "tendons", "sphere", "hole", "relaxing", "frame",
                "column", "pressed_column", "slab", "disc", "pressed", "stopped", "stacked"]  # fmt: skip


class Reference:
    """A reference, and by what it is known.

    `solved`: `solve(cantilever)` gives a CentreLine; so do others of what they are `about`: of a TwistedCylinder, a
    BlownBall, a PulledBar, a RelaxingBar, a DrivenRod, a RoundCore, a Column, a PressedColumn, a Squeezed, a Pressed, a
    StoppedBar, a Stack or what makes a Frame what that does. `measured`: `load()` gives a MeasuredSurface,
    MeasuredPoints, a MeasuredCurve or a KnownValue.
    `refined`: from models of the scene that are refined, its `methods`. `scanned`: from the shape that the model `of`
    computes, which `load(points, triangles)` takes.
    """

    how: ClassVar[How] = "solved"
    graded: ClassVar[bool] = False  # whether it supports bodies with varying constants, if it is solved
    wired: ClassVar[bool] = False  # whether it is about networks, and no other bodies
    with_stress: ClassVar[bool] = False  # whether it gives stress and strain
    with_forces: ClassVar[bool] = False  # whether it gives reactions and energies
    with_displacements: ClassVar[bool] = True  # whether it gives displacements
    table: ClassVar[str] = ""  # description of a wrong file, for messages
    about: ClassVar[About] = "cantilever"  # kind of problem that it is solved for
    means: ClassVar[str] = ""  # method of a theory: `closed form`
    usual: ClassVar[Kind | None] = None  # kind of truth, if `how` does not determine it
    source: ClassVar[str]  # who says so
    error_meaning: ClassVar[str]  # quantity that its estimated error bounds

    @classmethod
    def usually(cls) -> str:
        """What kind of truth it is where the scene says no other, as people read it: `one code`."""
        return (cls.usual or KINDS[cls.how]).replace("_", " ")

    @property
    def kind(self) -> str:
        """What kind of truth it is, as people read it: everything that names a reference says so."""
        said: str = vars(self).get("kind_") or ""
        return said.replace("_", " ") or self.usually()

    @property
    def registered(self) -> str:
        """How what was measured is moved onto the body: `none`, `clamp` or `icp`."""
        found: str = vars(self).get("register", "none")
        return found

    @property
    def file(self) -> str:
        """The file that it is read from, "" of none."""
        found: str = vars(self).get("path", "")
        return found

    @property
    def files(self) -> tuple[str, ...]:
        """The files that it is read from."""
        return (self.file,) if self.file else ()

    @property
    def own_young(self) -> float | None:
        """Young's modulus that it takes in place of the material's, Pa."""
        return vars(self).get("young")

    def unfit(self) -> tuple[Any, Any] | None:
        """Why its table cannot be used, and what to do, as far as a look at it tells; None where nothing is wrong."""
        return None
