"""Declaration of the material point model."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.models.shared.capabilities import DYNAMICS, Table
from softmark.interpreter.models.shared.model_declaration import Model
from softmark.interpreter.problem.body_case import Fault
from softmark.interpreter.vocabulary.loads.surface_traction import SurfaceTraction
from softmark.interpreter.vocabulary.supports.support import UniformSupport
from softmark.interpreter.vocabulary.supports.symmetry_plane import Symmetric
from softmark.records import dataclass

if TYPE_CHECKING:
    from softmark.interpreter.language.compiled_scene import Declared
    from softmark.interpreter.problem.body_case import Case


@dataclass(frozen=True)
class Homogeneous(Model):
    """Single material point instead of a body: homogeneous strain, no mesh, solved in tens of microseconds.

    It gives the response of a law in an ideal test, without effects of grips, ends or a mesh. The body is a box, a
    cylinder or a tube along x, y or z. Supports must select whole faces; they impose stretches along normals, or a
    shear of two opposite faces. A traction along the normal of a face is a nominal stress. Free faces are free of
    stress: their stretch is found by Newton's method on the law, at a Poisson's ratio of 0.5 with a pressure.
    `uniaxial`: one axis is pulled, the others are free. `equibiaxial`: two axes are stretched equally. `planar` (pure
    shear): one axis is pulled and one held, which wide grips also do. `simple_shear`: one face slides along the
    opposite one; the other faces are assumed to be held as needed, and at a Poisson's ratio of 0.5 the face normal to
    the third axis is free. `confined`: one axis is moved, the others are held.

    If grips hold a width that is free in the state, a warning reports this (W365). Beyond a maximum of the force, a
    state is found if the stretch is imposed, with a warning that it is unstable under that force and where that begins
    (W366). The same applies to a state that violates Drucker's stability postulate in Hencky strain (W385). If the law
    has no state, beyond its domain or the largest force, the model does not converge and reports how far it came.
    Forces are verified by finite differences of the energy only.
    """

    loads = (SurfaceTraction,)
    supports = (UniformSupport, Symmetric)
    capabilities: ClassVar[Table] = {DYNAMICS: False}
    homogeneous_strain = True

    state: Annotated[
        Literal["uniaxial", "equibiaxial", "planar", "simple_shear", "confined"],
        "deformation that supports and loads impose; they must agree with it",
    ]
    strain: Annotated[
        Literal["small", "corotational", "finite"], "strain measure; `finite` uses the law of the material"
    ] = "finite"
    material: Annotated[Any | None, "material", "material of this model; default: that of the body"] = None
    body: Annotated[str | None, "body", "body; needed if the scene has several"] = None

    @property
    def other_material(self) -> Any:
        """Material of the model in place of the body's material; None if the model uses the body's material."""
        return self.material

    @property
    def stress_law(self) -> tuple[str, str]:
        """Strain measure and volumetric formulation of the material law."""
        return self.strain, "full"

    def diagnostics(self, declared: Declared, case: Case) -> list[Diagnostic]:
        """Return errors and warnings about the model in a case."""
        from softmark.interpreter.models.material_point.imposed_deformation import is_block

        found = list(self.unsupported_feature_errors(declared, case))
        if not is_block(case) or case.planar:
            return [
                diagnostic("E355", declared.at(), f"`{declared.name}` needs a box, or a round body along x, "
                                                  "y or z",
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
                diagnostic(
                    "E357",
                    declared.at("state"),
                    f"`{declared.name}` compresses an incompressible solid that is held on all sides",
                    "impossible state",
                    "use a Poisson's ratio below 0.5, or leave a side free: `planar`",
                )
            )
        return found or list(self._state_diagnostics(declared, case))

    def _state_diagnostics(self, declared: Declared, case: Case) -> Iterator[Diagnostic]:
        """Yield an error if supports and loads do not impose the model's `state`, such as uniaxial tension.

        Otherwise yield a warning if the state violates the constraint of a support.
        """
        from softmark.interpreter.models.material_point.imposed_deformation import NAMES, imposed_state

        if getattr(case.analysis, "path", "load") == "arc_length":
            yield diagnostic(
                "E501",
                declared.at(),
                f"`{declared.name}` cannot follow an equilibrium path by arc length",
                "no arc length",
                "impose a stretch instead: states beyond the maximum force are then found, and reported as such",
            )
            return
        try:
            made = imposed_state(case, self.state, declared)
        except Fault as other:
            yield other.diagnostic
            return
        if made.let_go:
            names = " and ".join(f"`{n}`" for n in dict.fromkeys(name for name, _ in made.let_go))
            axes = " and ".join(sorted({NAMES[axis] for _, axis in made.let_go}))
            yield diagnostic(
                "W365",
                declared.at(),
                f"`{declared.name}` leaves the width of `{case.body.name}` along {axes} free, but {names} hold it",
                "no grips in this model",
                "a gripped body is stiffer near "
                "its ends: compare with "
                "`fem(...)`, or hold only "
                "normal displacements, "
                "`components = x`",
            )

    def outline(self, case: Case) -> str:
        """Return a one-line description of the model for `dsl plan`, such as the imposed kind of strain."""
        return f"{self._state_text}, no mesh"

    @property
    def _state_text(self) -> str:
        measure = "" if self.strain == "finite" else f", {self.strain} strain"
        return f"one material point, {self.state.replace('_', ' ')}{measure}"
