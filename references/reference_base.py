"""Base class of all references."""

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
    """A reference, and the way it is obtained, `how`.

    `solved`: `solve(cantilever)` returns a CentreLine; a reference that is `about` something else returns the solution
    of that: of a TwistedCylinder, a BlownBall, a PulledBar, a RelaxingBar, a DrivenRod, a RoundCore, a Column, a
    PressedColumn, a CompressedPorousBody, an Indentation, a StoppedBar, a Stack or a function that makes a Frame.
    `measured`: `load()` returns a MeasuredSurface, MeasuredPoints, a MeasuredCurve or a KnownValue. `refined`: from
    refined models of the scene, its `methods`. `scanned`: from the shape that the model `of` computes, which
    `load(points, triangles)` takes.
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
        """Return the default kind of truth as text: `one code`."""
        return (cls.usual or KINDS[cls.how]).replace("_", " ")

    @property
    def kind(self) -> str:
        """Kind of truth as text, shown wherever the reference is named."""
        said: str = vars(self).get("kind_") or ""
        return said.replace("_", " ") or self.usually()

    @property
    def registered(self) -> str:
        """Registration of measured data with the body: `none`, `clamp` or `icp`."""
        found: str = vars(self).get("register", "none")
        return found

    @property
    def file(self) -> str:
        """File that it is read from; "" if none."""
        found: str = vars(self).get("path", "")
        return found

    @property
    def files(self) -> tuple[str, ...]:
        """Files that it is read from."""
        return (self.file,) if self.file else ()

    @property
    def own_young(self) -> float | None:
        """Young's modulus used instead of the material's, Pa."""
        return vars(self).get("young")

    def unfit(self) -> tuple[Any, Any] | None:
        """Return why its table cannot be used, and the remedy, before numbers are read; None if it can."""
        return None
