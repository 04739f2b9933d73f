"""Declaration of solid finite element models."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Any, Literal

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language import units
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.models.fem import element_formulations
from softmark.interpreter.models.fem import solver_options as options
from softmark.interpreter.models.shared.capabilities import PERTURBED_STARTS, SOLID_FEATURES, supported_features
from softmark.interpreter.models.shared.model_declaration import Model
from softmark.interpreter.problem.conforming_mesh import Cuts, cuts_of, graded_cuts
from softmark.interpreter.problem.deflection_estimates import bending_angle
from softmark.interpreter.results.run_report import ModelKind
from softmark.interpreter.vocabulary.analysis_words import Dynamic
from softmark.interpreter.vocabulary.loads.line_force import LineForce
from softmark.interpreter.vocabulary.values_in_states import HasMaterial
from softmark.records import dataclass
from softmark.solvers.elements import WORDS, find_element, unknown_element_error

if TYPE_CHECKING:
    from softmark.interpreter.language.compiled_scene import Declared, Scene
    from softmark.interpreter.problem.body_case import Case
    from softmark.solvers.mesh.shape import Shape

LARGE_ANGLE = 0.1  # rad: a rotation that appears as 0.5 % strain (1 - cos) in small strain
PLAIN: dict[str, Any] = {
    "max_iterations": None,
    "max_linear_iterations": None,
    "initial_guess": None,
    "precision": "double",
    "linear": "auto",
    "factorisation": "fresh",
}
SHORTCUTS = ("max_iterations", "max_linear_iterations", "precision", "initial_guess")
TOUCHED = "; with few cells in contact the force is too small, so errors can have either sign"
FORMULATIONS = {"mixed": "with pressures", "mean_dilatation": "mean dilatation"}  # in an outline


@dataclass(frozen=True)
class Fem(HasMaterial, Model):
    """Finite elements over the volume of a body, with a choice of element and strain measure.

    `strain = small`: strain is linear in the displacements. It is accurate for rotations of a few degrees; a body that
    rotates more appears to grow. `corotational`: linear elasticity in the frame of the polar rotation of each
    integration point, with exact derivatives, for large rotations and small strains. `finite`: the material's own law,
    for large rotations and strains. The first two use the initial moduli of the material.

    `integration = selective` (hex8): the energy of the modulus lambda is evaluated once per cell, for the cell's mean
    deformation gradient, so that the element does not lock. `rotation = element` (corotational): one rotation per cell,
    as in real-time simulators; its forces have no energy. `mass`: `consistent` integrates the shape functions, `lumped`
    distributes each cell's mass by the diagonal of its mass matrix, and `uniform` gives every node of the mesh the same
    mass, which is wrong wherever the mesh is graded.

    `formulation` avoids locking near incompressibility. `mixed` has pressures as additional unknowns and accepts every
    Poisson's ratio up to and including 0.5. Pressures are linear and continuous in tet10, hex20 and hex27 (Taylor and
    Hood), the recommended elements, or constant in each hex8 (Q1/P0, whose displacements are good but whose pressures
    may alternate from cell to cell). It is for statics. `mean_dilatation` (hex8) uses the mean volume change of each
    cell: B-bar for small strain, the consistent form of F-bar for finite strain. It has the same displacements as mixed
    hex8 without further unknowns, for Poisson's ratios below 0.5, in statics and dynamics.

    The following options make a model faster, some at the expense of accuracy; `sweep` varies them, and `dsl compare`
    shows the effect on error and cost.

    `max_iterations` stops Newton's method after this number of linear systems, in total in statics and per time step
    in dynamics, as in programs that must keep a frame rate. Such a state is `capped`: it is not converged and never
    counts as real time; its residual is that of the state, and its metrics show the effect of the cap.

    `linear` names the linear solver; `auto` selects a suitable one. `conjugate_gradients` is preconditioned by the
    diagonal, and `max_linear_iterations` stops it after this number of iterations in every Newton step; the state is
    `capped` if it is then not in equilibrium.

    `precision = single` stores geometry, state, forces, tangent and factor in 32 bits. The reported residual is
    computed in 64 bits; `converged` then means that only rounding errors remain, at most 1e-3 of the residual or in the
    energy norm.

    `factorisation = reused` keeps a factor as long as conjugate gradients with it cost less than a new one, and solves
    early Newton steps only as accurately as needed (Eisenstat and Walker 1996). The result is the same, to the same
    tolerance.

    `quality` moves the nodes of the mesh at random, reproducibly, until its worst cell has this mean ratio (Knupp 2001;
    1 is a regular cell, 0 a flat one), to study the effect of bad meshes. The shape of the body is kept: nodes of plane
    faces move within them, those of straight edges along them, and others stay.

    `refine_factor` and `refine_at` grade the mesh. At the border of the condition `refine_at`, if it is a plane or a
    circle that a mesh of the shape can follow, the cell size normal to the border is `size / refine_factor`; it grows
    to `size` at half the body's extent from there. In a filled surface, cells are smaller by that factor where the
    condition holds; facets of combined shapes have the smallest size. If `size` is halved, all cells are halved.

    `initial_guess` names another model of the body whose solution is the initial guess of Newton's method, for example
    on a coarser mesh or with a cheaper strain measure; its cost is part of the cost of this model.
    """

    capabilities = supported_features(*SOLID_FEATURES, PERTURBED_STARTS)
    resolution_fields = ("size",)

    element: Annotated[
        str,
        "element",
        "element: tet4, tet10, hex8, hex20 or hex27; for plane bodies quad4, quad8, quad9, tri3 or tri6",
    ]
    strain: Annotated[Literal["small", "corotational", "finite"], "strain measure"]
    size: Annotated[float | None, "m in (0, inf)", "target edge length of cells"] = None
    body: Annotated[str | None, "body", "body; needed if the scene has several"] = None
    mesh: Annotated[Any | None, "shape", "mesh from a file, used instead of a mesh of the body's shape"] = None
    integration: Annotated[
        Literal["full", "selective"], "quadrature of hexahedra: full, or selective for the volumetric part"
    ] = "full"
    formulation: Annotated[
        Literal["displacement", "mixed", "mean_dilatation"], "treatment of near-incompressible materials, see above"
    ] = "displacement"
    rotation: Annotated[
        Literal["point", "element"], "one rotation per integration point or per element, in corotational strain"
    ] = "point"
    mass: Annotated[Literal["consistent", "lumped", "uniform"], "distribution of the mass to nodes"] = "consistent"
    max_iterations: Annotated[
        int | None,
        "1 in [1, 1000]",
        "number of Newton iterations after which a state or time step is accepted even if not converged; default: no "
        "limit",
    ] = None
    material: Annotated[Any | None, "material", "material of this model; default: that of the body"] = None
    precision: Annotated[Literal["double", "single"], "floating-point precision, 64 or 32 bits"] = "double"
    linear: Annotated[
        Literal["auto", "cholesky", "superlu", "pardiso", "multigrid", "conjugate_gradients"],
        "linear solver",
    ] = "auto"
    max_linear_iterations: Annotated[
        int | None,
        "1 in [1, 100000]",
        "largest number of conjugate gradient iterations in a Newton step; default: no limit",
    ] = None
    factorisation: Annotated[
        Literal["fresh", "reused"], "factorise in every Newton step, or reuse a factor for several"
    ] = "fresh"
    initial_guess: Annotated[str | None, "model", "model whose solution is the initial guess; default: rest"] = None
    quality: Annotated[
        float | None,
        "1 in [1e-9, 1]",
        "mean ratio of the worst cell of a mesh distorted on purpose; default: the generated mesh",
    ] = None
    refine_factor: Annotated[
        float | None, "1 in (1, 100]", "ratio of `size` to the cell size at `refine_at`; default: uniform mesh"
    ] = None
    refine_at: Annotated[
        Any | None,
        "condition",
        "condition at whose border cells are smaller, for example a clamp: `refine_at = x <= 0 mm`",
    ] = None

    loads = (*Model.loads, LineForce)

    @property
    def constant(self) -> bool:  # type: ignore[override]
        """True if the stiffness is constant, because strain is linear in the displacements."""
        return self.strain == "small"

    @property
    def may_be_unconverged(self) -> bool:  # type: ignore[override]  # the default is a class attribute
        """True if the model may accept states that are not converged."""
        return self.max_iterations is not None or self.max_linear_iterations is not None

    @property
    def own_mesh(self) -> Shape | None:
        """Mesh read from a file, which replaces a mesh generated from the body's shape; None if there is no file."""
        return self.mesh

    @property
    def other_material(self) -> Any:
        """Material of the model in place of the body's material; None if the model uses the body's material."""
        return self.material

    @property
    def iteration_cap(self) -> int | None:
        """Number of Newton iterations after which an unconverged state is accepted; None if none is accepted."""
        return self.max_iterations

    @property
    def shortcuts(self) -> tuple[str, ...]:
        """Options that leave a step unconverged, use single precision, or start from another model."""
        return tuple(lever for lever in SHORTCUTS if getattr(self, lever) != PLAIN[lever])

    @property
    def stress_law(self) -> tuple[str, str] | str:
        """Strain measure and volumetric formulation of the stress law, or the reason why the model has no stress."""
        if self.rotation == "element":
            return "with `rotation = element`, forces do not follow from a stress (use `rotation = point`)"
        volume = "full" if self.integration == "full" else "selective"
        return self.strain, volume if self.formulation == "displacement" else self.formulation

    @property
    def order(self) -> int:
        """Convergence order of displacements for smooth solutions: element degree + 1 (Strang and Fix 1973, 1.5)."""
        return int(find_element(self.element).order) + 1

    def orders(self) -> dict[str, int]:
        """Return the convergence order in `size`; empty if states may be unconverged or theory does not apply."""
        known = self.mass != "uniform" and self.rotation != "element" and not self.may_be_unconverged
        return {"size": self.order} if known else {}

    def plain(self, **changes: Any) -> Fem:
        """Return the model without the options that trade accuracy for speed."""
        return replace(self, **{**PLAIN, **changes})

    def mesh_key(self) -> tuple[Any, ...]:
        """Return a key that is equal for models of a body that can share a mesh."""
        moved = () if self.quality is None else (("quality", self.quality),)
        if self.mesh is None:
            return self.element, self.size, *moved
        return self.element, self.size, self.mesh, *moved

    def meshed_as(self, case: Case) -> tuple[Any, ...]:
        """Return the key of the mesh in a case: body, element, size, and planes on which supports need nodes."""
        return (case.body.name, *self.mesh_key(), *(() if self.mesh else self.cuts(case)))

    def cuts(self, case: Case, shape: Shape | None = None) -> Cuts:
        """Return the planes and surfaces on which the mesh needs nodes, and those near which its cells are smaller."""
        found = cuts_of(case, shape)
        if self.refine_at is None or self.refine_factor is None:
            return found
        return (*found, *graded_cuts(self.refine_at, shape or case.shape, self.refine_factor))

    def _has_mesh_from_file(self, case: Case) -> bool:
        """Return whether the mesh is read from a file, given by the model or by the body."""
        return (self.own_mesh or case.shape).prebuilt

    def diagnostics(self, declared: Declared, case: Case) -> list[Diagnostic]:
        """Return errors and warnings about this model in a case, for every material if there are several."""
        # typical values would say nothing of these
        if (case.porous and case.parts) or (case.has_material_history and not case.uniform):
            return list(self.unsupported_feature_errors(declared, case))
        if case.parts:
            return self._problems_by_material(declared, case)
        case = case.plain
        if self.element not in WORDS:
            return [options.unknown_element(declared, unknown_element_error(self.element))]
        found = [
            *self.unsupported_feature_errors(declared, case),
            self.one_mesh(declared, case),
            options.check_grading(self, declared, case),
            *options.unused_size(self, declared, case),
            self._check_finite_strain_law(declared, case),
            self.locking(declared, case),
            self._large_rotation_warning(declared, case),
        ]
        found += options.explicit_integrator_errors(self, declared, case)
        found += [
            *options.check_options(self, declared, case),
            *element_formulations.check_formulation(self, declared, case),
        ]
        found.append(self.coarse(declared, case))
        return [d for d in found if d is not None]

    def _problems_by_material(self, declared: Declared, case: Case) -> list[Diagnostic]:
        """Return errors and warnings for each material; warnings about large rotations only for the stiffest one."""
        stiffest = max(case.typical, key=lambda material: material.young)
        found: dict[tuple[object, ...], Diagnostic] = {}
        for part, material in zip((None, *case.parts), case.typical, strict=True):
            for doubt in self.diagnostics(declared, replace(case, other_material=material, parts=())):
                if doubt.code == "W302" and material is not stiffest:
                    continue
                note = () if part is None else (f"this is about the material of the region `{part.name}`",)
                key = (doubt.code, doubt.span, doubt.message)
                found.setdefault(key, replace(doubt, notes=(*doubt.notes, *note)))
        return list(found.values())

    def scene_diagnostics(self, scene: Scene, declared: Declared, case: Case) -> list[Diagnostic]:
        """Return errors about the model that provides the initial guess."""
        return options.check_initial_guess(scene, declared, case)

    def one_mesh(self, declared: Declared, case: Case) -> Diagnostic | None:
        """Return an error unless the scene states exactly one of `size` and `mesh`, else None.

        A body that is itself read from a mesh file needs neither.
        """
        prebuilt = self.mesh is None or self.mesh.prebuilt
        both = self.size is not None and self.mesh is not None
        neither = self.size is None and self.mesh is None and not case.shape.prebuilt
        if prebuilt and not both and not neither:
            return None
        problem, label, help = (
            (f"`{declared.name}` needs a `size` or a `mesh`", "no cell size",
             'add `size = 5 mm`, or a mesh: `mesh = mesh("file.msh", unit = 1 mm)`')
            if neither
            else (f"`{declared.name}` has both a `size` and a `mesh`", "only one of them",
                  "remove `size`: a mesh from a file has its own")
            if both
            else (f"the `mesh` of `{declared.name}` is a shape, which has no cells", "not a mesh",
                  'write a file: `mesh = mesh("file.msh", unit = 1 mm)`')
        )  # fmt: skip
        return diagnostic("E507", declared.at("mesh" if self.mesh is not None else "element"), problem, label, help)

    def _check_finite_strain_law(self, declared: Declared, case: Case) -> Diagnostic | None:
        """Return an error if finite strain is requested and the material has no law for it."""
        if self.strain != "finite" or case.material.finite_law() is not None:
            return None
        at, body = declared.at("strain"), case.body.name
        return diagnostic(
            "E502",
            at,
            f"the material of `{body}` has no law for finite strain",
            "no finite-strain law",
            "use a `neo_hookean(...)` or `st_venant_kirchhoff(...)` material, or `strain = corotational`",
        )

    def locks_at(self, poisson: float) -> bool:
        """Return whether the element is noticeably too stiff (locks) at a Poisson's ratio."""
        free = self.integration == "selective" or self.formulation != "displacement"
        return not free and bool(poisson >= find_element(self.element).locks)

    def locking(self, declared: Declared, case: Case) -> Diagnostic | None:
        """Return a warning if the element is noticeably too stiff (locks) at the Poisson's ratio of the body."""
        nu = case.material.poisson
        if not self.locks_at(nu) or case.material.incompressible or case.material.thin:
            return None
        element = find_element(self.element)
        cure = (
            "use `formulation = mixed`"
            if element.pressures == "corners"
            else element_formulations.name_plane_elements(self, element_formulations.FREE)
        )
        return diagnostic(
            "W301",
            declared.at("element"),
            f"{element.briefly} lock at a Poisson's ratio of {nu:g}",
            "too stiff",
            f"displacements are too small, and more so on coarser meshes{TOUCHED if case.contacts else ''}: {cure}",
        )

    def _large_rotation_warning(self, declared: Declared, case: Case) -> Diagnostic | None:
        """Return a warning if small strain is used with supports or loads that cause large rotations."""
        if self.strain != "small":
            return None
        if (turned := max((math.hypot(*s.thing.rotation) for s in case.supports), default=0.0)) > LARGE_ANGLE:
            return self._small_strain_warning(declared, "this support imposes", f"{math.degrees(turned):.0f} deg")
        if (angle := bending_angle(case)) is None or angle < LARGE_ANGLE:
            return None
        far = f"about {math.degrees(angle):.0f} deg at the tip" if angle < 1.5 else "far too large for small strain"
        return self._small_strain_warning(declared, "this load causes", far)

    def _small_strain_warning(self, declared: Declared, what: str, far: str) -> Diagnostic:
        """Return the warning about large rotations in small strain."""
        return diagnostic(
            "W302",
            declared.at("strain"),
            f"small strain cannot represent the rotation that {what}",
            far,
            "rotation will appear as growth of the body: use `strain = corotational` or `finite`",
        )

    def coarse(self, declared: Declared, case: Case) -> Diagnostic | None:
        """Return an error if the mesh does not fit into memory, or a warning if cells are too large for the body."""
        shape = case.shape
        if self.size is None or shape.bounds is None or not (volume := shape.least) or self._has_mesh_from_file(case):
            return None
        low, high = shape.bounds
        at = declared.at("size")
        element = find_element(self.element)
        cells = len(element.split[0]) * volume / self.size**3
        if shape.flat:  # one through the thickness
            cells = len(element.split[0]) * volume / (high[2] - low[2]) / self.size**2
            thick = max(high[0] - low[0], high[1] - low[1])
            low, high = (*low[:2], 0.0), (*high[:2], thick)
        if cells > element.most:
            size = units.format_value(self.size, units.LENGTH)
            extent = units.format_value(max(b - a for a, b in zip(low, high, strict=True)), units.LENGTH)
            return diagnostic(
                "E304",
                at,
                f"a mesh of about {cells:.0e} {element.family} does not fit into memory",
                f"{size} for a body of {extent}",
                "use a larger size",
            )
        least = min(b - a for a, b in zip(low, high, strict=True))
        if self.size > 0.5 * least * (1 + 1e-9):
            return diagnostic(
                "W312",
                at,
                f"the cells of `{declared.name}` are larger than half the thickness of the body",
                f"the body is {units.format_value(least, units.LENGTH)} thick",
                "use a smaller size; bending needs four or more cells across the thickness",
            )
        return None

    def mesh_words(self, case: Case) -> str:
        """Return a description of the mesh, such as `tet4 of about 7 mm`."""
        size = "" if self.size is None else f"of about {units.format_value(self.size, units.LENGTH)}"
        return f"{self.element} {'of the file' if self._has_mesh_from_file(case) else size}"

    def outline(self, case: Case) -> str:
        """Return a one-line description of the model for `dsl plan` and the report."""
        return f"{self.mesh_words(case)}, {self._describe_options(case, self.material)}"

    def kind(self, case: Case) -> ModelKind | None:
        """Return the kind of the model: its description without mesh size, the mesh size, and Poisson's ratio.

        The description consists of the element and options. Poisson's ratio is None if it varies in the body. The
        result is None if the model has no mesh size or its mesh is read from a file. Models with equal descriptions are
        grouped.
        """
        if self.size is None or self._has_mesh_from_file(case):
            return None
        nu = None if self.material is None or not self.material.uniform else float(f"{self.material.poisson:g}")
        return ModelKind(
            f"{self.element}, {self._describe_options(case, None)}", units.format_value(self.size, units.LENGTH), nu
        )

    def _describe_options(self, case: Case, material: Any) -> str:
        """Return a description of the strain measure and the options."""
        options = (
            ", selectively integrated" if self.integration == "selective" else "",
            f", {FORMULATIONS[self.formulation]}" if self.formulation != "displacement" else "",
            ", one rotation for each cell" if self.rotation == "element" else "",
            _describe_iteration_cap(self.max_iterations, case) if self.max_iterations is not None else "",
            f", nu = {material.poisson:g}" if material is not None and material.uniform else "",
            *self._describe_shortcuts(),
        )
        return f"{self.strain} strain{''.join(options)}"

    def _describe_shortcuts(self) -> tuple[str, ...]:
        """Return descriptions of the options that trade accuracy for speed."""
        return (
            ", single precision" if self.precision == "single" else "",
            f", {self.linear}".replace("_", " ") if self.linear != "auto" else "",
            f" of at most {self.max_linear_iterations} iterations" if self.max_linear_iterations is not None else "",
            ", factors reused" if self.factorisation == "reused" else "",
            f", started from {self.initial_guess}" if self.initial_guess is not None else "",
            f", worst cell of quality {self.quality:g}" if self.quality is not None else "",
        )


def _describe_iteration_cap(cap: int, case: Case) -> str:
    """Return a description of the limit on Newton iterations: per time step in dynamics, in total in statics."""
    each = "a step" if isinstance(case.analysis, Dynamic) else "in all"
    return f", capped at {cap} iterations {each}"
