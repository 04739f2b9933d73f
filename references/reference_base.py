"""Base class of all references."""

from __future__ import annotations

from typing import Any, ClassVar, Literal

How = Literal["solved", "measured", "refined", "scanned"]
Kind = Literal["theory", "measurement", "consensus", "one_code", "digitised", "published", "own_models", "virtual_scan"]
KINDS: dict[How, Kind] = {
    "solved": "theory", "measured": "measurement", "refined": "own_models", "scanned": "virtual_scan",
}  # fmt: skip


class Reference:
    """Base class of references; `how` names the way in which the solution is obtained.

    `solved`: `solve(cantilever)` returns a CentreLine. A reference with another `problem_kind` takes the data of that
    problem, such as a TwistedCylinder, BlownBall, PulledBar, RelaxingBar, DrivenRod, RoundCore, Column, PressedColumn,
    CompressedPorousBody, Indentation, StoppedBar, Stack or a function that makes a Frame, and returns its solution.
    `measured`: `load()` returns a MeasuredSurface, MeasuredPoints, a MeasuredCurve or a KnownValue.
    `refined`: the solution comes from refined models of the scene, its `methods`. `scanned`: it comes from the shape
    that the model `of` computes, which `load(points, triangles)` takes.
    """

    how: ClassVar[How] = "solved"
    supports_varying_constants: ClassVar[bool] = False  # supports constants that vary in space, if it is solved
    supports_networks: ClassVar[bool] = False  # spring and beam networks, and no other bodies
    with_displacements: ClassVar[bool] = True  # whether it gives displacements
    table: ClassVar[str] = ""  # description of a wrong file, for messages
    problem_kind: ClassVar[str] = "cantilever"  # kind of problem that it solves, if it is solved
    means: ClassVar[str] = ""  # method of a theory: `closed form`
    usual: ClassVar[Kind | None] = None  # kind of truth, if `how` does not determine it
    source: ClassVar[str]  # who says so
    error_meaning: ClassVar[str]  # quantity that its estimated error bounds

    def __init_subclass__(cls) -> None:
        """Raise TypeError if a reference defines `about`, the earlier name of `problem_kind`, which nothing reads."""
        kind = vars(cls).get("__annotations__", {}).get("about", "ClassVar")
        if "about" in vars(cls) and "ClassVar" in str(kind):  # fields of scenes may have this name
            raise TypeError(f"`{cls.__name__}` defines `about`, which is called `problem_kind` now")

    @classmethod
    def usually(cls) -> str:
        """Return the default kind of truth as text, such as `one code`."""
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
        """File from which the reference is read; "" if none."""
        found: str = vars(self).get("path", "")
        return found

    @property
    def files(self) -> tuple[str, ...]:
        """Files from which the reference is read."""
        return (self.file,) if self.file else ()

    @property
    def own_young(self) -> float | None:
        """Young's modulus that the reference uses instead of the material's, Pa; None if it has none."""
        return vars(self).get("young")

    def unfit(self) -> tuple[Any, Any] | None:
        """Return the reason why the reference's table cannot be used, and the remedy; None if it can.

        The check reads no numbers.
        """
        return None
