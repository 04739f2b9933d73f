"""One material point."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated, Any, Literal

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.models.shared.model_declaration import Model
from softmark.interpreter.problem.body_case import Fault
from softmark.interpreter.vocabulary.load_words import SurfaceTraction
from softmark.interpreter.vocabulary.support_words import Displaced, Fixed, Symmetric
from softmark.records import dataclass

if TYPE_CHECKING:
    from softmark.interpreter.language.compiled_scene import Declared
    from softmark.interpreter.problem.body_case import Case


@dataclass(frozen=True)
class Homogeneous(Model):
    """One material point in place of a body: the same strain everywhere, no mesh, some tens of microseconds.

    What a law of its own says of a pull test, without grips, ends or a mesh. The body is a box, a cylinder or a tube
    along x, y or z. Supports take whole faces, and what they impose along normals are stretches, or a shear of two
    opposite faces; a traction along the normal of a face is a nominal stress. What is free is free of stress: its
    stretch is found by Newton's method on the law, at a Poisson's ratio of 0.5 with a pressure. `uniaxial`: one axis is
    pulled, the others are free. `equibiaxial`: two alike. `planar` (pure shear): one is pulled, one held, which wide
    grips do as well. `simple_shear`: one face slides along the opposite one; the sides are taken to be held as it
    needs, and at a Poisson's ratio of 0.5 the side beside the plane is free. `confined`: one axis is moved, the others
    are held.

    Where grips hold a width that the state lets go, a warning says so (W365). Past a maximum of the force a state is
    found where the stretch is imposed, and said to give way under that force, with where that begins (W366); so is a
    state in which the law is no longer stable after Drucker, in Hencky's strain (W385). Where the law has no state,
    beyond its domain or the largest force, it is not converged and says how far it came. Forces are found again from
    finite differences of the energy alone.
    """

    loads = (SurfaceTraction,)
    supports = (Fixed, Displaced, Symmetric)
    moves = False
    even = True

    state: Annotated[
        Literal["uniaxial", "equibiaxial", "planar", "simple_shear", "confined"],
        "what supports and loads make of the body; it is refused where they make something else",
    ]
    strain: Annotated[
        Literal["small", "corotational", "finite"], "the measure of strain: the law of the material is `finite`"
    ] = "finite"
    material: Annotated[Any | None, "material", "what it is made of in this model, where not of the body's"] = None
    body: Annotated[str | None, "body", "the body, where a scene has several"] = None

    @property
    def other_material(self) -> Any:
        """The material that it takes in place of the body's, if it does."""
        return self.material

    @property
    def stress_law(self) -> tuple[str, str]:
        """Its own law at the point."""
        return self.strain, "full"

    def doubts(self, declared: Declared, case: Case) -> list[Diagnostic]:
        """What speaks against it in this case."""
        from softmark.interpreter.models.material_point.imposed_deformation import is_block

        found = list(self.refusals(declared, case))
        if not is_block(case) or case.planar:
            return [
                diagnostic("E355", declared.at(), f"`{declared.name}` is of a box, or a round body along x, y or z",
                           f"`{case.body.name}` is another shape", "use `fem(...)` for this body")
            ]  # fmt: skip
        if self.strain == "finite" and case.material.finite_law() is None:
            found.append(
                diagnostic("E502", declared.at("strain"), f"the material of `{case.body.name}` has no law for finite "
                           "strain", "needs such a law", "declare a `neo_hookean(...)` or `st_venant_kirchhoff(...)`, "
                           "or use `strain = corotational`")
            )  # fmt: skip
        if self.state == "confined" and case.largest_poisson >= 0.5:
            found.append(
                diagnostic("E357", declared.at("state"), f"`{declared.name}` squeezes a solid that cannot change its "
                           "volume between walls", "no such state", "use a Poisson's ratio below 0.5, or leave a side "
                           "free: `planar`")
            )  # fmt: skip
        return found or list(self._made(declared, case))

    def _made(self, declared: Declared, case: Case) -> Iterator[Diagnostic]:
        """Why supports and loads make no such state, or what of theirs it lets go."""
        from softmark.interpreter.models.material_point.imposed_deformation import NAMES, driven

        if getattr(case.analysis, "path", "load") == "arc_length":
            yield diagnostic("E501", declared.at(), f"`{declared.name}` follows no path of equilibria", "not by its "
                             "length", "impose a stretch: past a maximum of its force that is a state, and said to "
                             "be one")  # fmt: skip
            return
        try:
            made = driven(case, self.state, declared)
        except Fault as other:
            yield other.diagnostic
            return
        if made.let_go:
            names = " and ".join(f"`{n}`" for n in dict.fromkeys(name for name, _ in made.let_go))
            axes = " and ".join(sorted({NAMES[axis] for _, axis in made.let_go}))
            yield diagnostic("W365", declared.at(), f"`{declared.name}` lets go what {names} hold: the width of "
                             f"`{case.body.name}` along {axes}", "no ends", "near its ends a body that is gripped is "
                             "stiffer: compare with `fem(...)`, or hold normals alone, `components = x`")  # fmt: skip

    def outline(self, case: Case) -> str:
        """One line for the plan."""
        return f"{self._words}, no mesh"

    @property
    def _words(self) -> str:
        measure = "" if self.strain == "finite" else f", {self.strain} strain"
        return f"one material point, {self.state.replace('_', ' ')}{measure}"
