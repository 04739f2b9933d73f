"""Element formulations that avoid volumetric locking: checks of a declaration, and construction of their energies."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.problem.body_case import fault
from softmark.interpreter.vocabulary.analysis_words import Dynamic
from softmark.records import dataclass
from softmark.solvers.elements import PLANE, find_element

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from softmark.interpreter.language.compiled_scene import Declared
    from softmark.interpreter.models.fem.fem_declaration import Fem
    from softmark.interpreter.models.shared.material_regions import MaterialRegion
    from softmark.interpreter.problem.body_case import Case
    from softmark.solvers.assembly.assembly import Assembly
    from softmark.solvers.energies.energy import Energy
    from softmark.solvers.linear.linear_solver import LinearSolverOptions
    from softmark.solvers.mesh.element_interpolation import IntegrationPoints
    from softmark.solvers.mesh.mesh import Mesh

    Floats = NDArray[np.float64]

T = TypeVar("T")
FREE = (
    "use tet10 or hex8 with `formulation = mixed`, or hex8 with `integration = selective` or `formulation ="
    " mean_dilatation`"
)
DIRECT = {"linear": ("conjugate_gradients", "multigrid"), "precision": ("single",), "factorisation": ("reused",)}

Clash = tuple[str, str, str, str, str]  # code, field, problem, label, help


def check_formulation(model: Fem, declared: Declared, case: Case) -> list[Diagnostic]:
    """Return errors if the formulation does not fit the element, law or analysis, or the body is incompressible."""
    found = []
    for code, field, problem, label, help in (
        *_formulation_errors(model, case),
        *_incompressible_material_errors(model, declared, case),
    ):
        found.append(
            diagnostic(
                code, declared.at(field), problem, name_plane_elements(model, label), name_plane_elements(model, help)
            )
        )
    return found


def name_plane_elements(model: Fem, text: str) -> str:
    """Replace 3D elements in a help text by plane ones if the model uses plane elements."""
    if model.element not in PLANE:
        return text
    return text.replace("tet10", "tri6" if model.element in ("tri3", "tri6") else "quad9").replace("hex8", "quad4")


def _formulation_errors(model: Fem, case: Case) -> Iterator[Clash]:
    """Yield errors if the formulation does not fit the element, another option or the material law."""
    if model.formulation == "displacement":
        return
    word = f"`formulation = {model.formulation}`"
    if model.formulation not in find_element(model.element).formulations:
        yield (
            "E551",
            "formulation",
            f"{word} is not available for the element `{model.element}`",
            *_element_error_texts(model),
        )
    elif model.integration == "selective" or model.rotation == "element":
        other = "`integration = selective`" if model.integration == "selective" else "`rotation = element`"
        yield (
            "E551", "formulation", f"{word} and {other} cannot be combined",
            f"not with {other}", "remove one of the two",
        )  # fmt: skip
    elif model.strain == "finite" and _lacks_volumetric_split(case):
        yield (
            "E551", "formulation", f"the law of `{case.body.name}` has no separate volumetric part, which "
                                   "the pressure unknowns need",
            "needs an isochoric-volumetric split", "use another material or `strain = corotational`, or remove "
                                            "`formulation`",
        )  # fmt: skip
    elif model.formulation == "mixed":
        yield from _check_mixed(model, case)


def _lacks_volumetric_split(case: Case) -> bool:
    """Return whether the finite-strain law has no separate volumetric part."""
    return case.material.finite_law() is not None and case.material.finite_mixed() is None


def _element_error_texts(model: Fem) -> tuple[str, str]:
    """Return label and help of the error about an element that lacks the formulation."""
    if model.formulation == "mixed":
        return (
            "no stable pressure interpolation",
            "use `tet10`, which has linear pressures, or `hex8`, which has one pressure per cell",
        )
    return "only with hex8", "use `hex8`, or `tet10` with `formulation = mixed`"


def _check_mixed(model: Fem, case: Case) -> Iterator[Clash]:
    """Yield errors for options that are incompatible with pressure unknowns."""
    if isinstance(case.analysis, Dynamic):
        help = "use `hex8` with `formulation = mean_dilatation` and a Poisson's ratio below 0.5, or a static analysis"
        problem = "mixed elements work only in static analyses, since pressure unknowns have no mass"
        yield "E553", "formulation", problem, "not in a dynamic analysis", help
        return
    if case.analysis.disturbed != "none":
        problem = "a disturbed start is solved by energy minimization, which is not possible with pressure unknowns"
        help = "use `formulation = mean_dilatation` with hex8, or remove `disturbed` from the analysis"
        yield "E554", "formulation", problem, "not with `disturbed`", help
    for field, values in DIRECT.items():
        if getattr(model, field) in values:
            problem = (
                f"`{field} = {getattr(model, field)}` cannot solve the saddle point systems of the mixed formulation"
            )
            help = "leave it out, or use `formulation = mean_dilatation` with hex8"
            yield "E554", field, problem, "not with `formulation = mixed`", help


def _incompressible_material_errors(model: Fem, declared: Declared, case: Case) -> Iterator[Clash]:
    """Yield an error for an incompressible material in an element that needs a compressible one."""
    if case.material.incompressible and model.formulation != "mixed" and not case.porous:
        field = "formulation" if model.formulation != "displacement" else "element"
        where = f"the material of `{case.body.name}`"
        if model.material is not None:
            field, where = "material", f"the material of the model `{declared.name}`"
        problem = f"{where} is incompressible, but this element needs a compressible material"
        softer = "a Poisson's ratio below 0.5 such as 0.4999"
        if getattr(case.material, "directed", False):
            softer = "a finite `bulk` modulus"
        help = f"use `tet10` or `hex8` with `formulation = mixed`, or {softer}"
        yield "E552", field, problem, "infinite bulk modulus", help


# ------------------------------------------------------------------ building them


class EnergyFactory(Protocol):
    """Function that creates the energy of the cells of one material and, for finite strain, a corotational energy.

    The corotational energy helps the solver to start.
    """

    def __call__(
        self, model: Fem, case: Case, mesh: Mesh, parts: IntegrationPoints
    ) -> tuple[Energy, Energy | None]: ...


def energies_of_regions(
    model: Fem, pieces: Sequence[MaterialRegion], make: EnergyFactory
) -> tuple[list[Energy], list[Energy] | None]:
    """Return one energy for the cells of each material, and the corresponding corotational energies, if any.

    Mixed energies have separate pressure unknowns, numbered one after another, so that pressure is discontinuous
    between materials.
    """
    found = [make(model, own.case, own.mesh, own.parts) for own in pieces]
    twins = [twin for _, twin in found if twin is not None]
    return _number_pressures([energy for energy, _ in found]), _number_pressures(twins) if twins else None


def _number_pressures(energies: list[Energy]) -> list[Energy]:
    """Return the energies with their pressure unknowns numbered one after another."""
    from softmark.solvers.energies.mixed_displacement_pressure import MixedSolid

    found: list[Energy] = []
    behind = 0
    for energy in energies:
        if isinstance(energy, MixedSolid):
            own = energy.dofs - 3 * energy.nodes
            energy = replace(energy, pressures=energy.pressures + behind) if behind else energy
            behind += own
        found.append(energy)
    return found


def energies(model: Fem, case: Case, mesh: Mesh, parts: IntegrationPoints) -> tuple[Energy, Energy | None]:
    """Return the energy of a mixed or mean dilatation formulation, and a corotational energy for finite strain."""
    if case.porous:
        return _convert_to_axisymmetric(_porous(model, case, mesh, parts), case, mesh, parts), None
    energy = _energy(model, case, mesh, parts, model.strain)
    return energy, _energy(model, case, mesh, parts, "corotational") if model.strain == "finite" else None


def _energy(model: Fem, case: Case, mesh: Mesh, parts: IntegrationPoints, strain: str) -> Energy:
    """Return the energy of a mixed or mean dilatation formulation."""
    from softmark.solvers.assembly.mixed_elements import mixed_energy
    from softmark.solvers.energies.mixed_displacement_pressure import MeanDilatation
    from softmark.solvers.materials import mixed_for

    split = mixed_for(case.material, strain)
    if split is None:  # `diagnostics` refuses it
        raise KeyError(strain)
    if model.formulation == "mixed":
        made: Any = mixed_energy(mesh, parts, split, _mean(case.material.shear_modulus, parts.w))
    else:
        body = (mesh.cells, parts.dNdX, parts.w)
        made = MeanDilatation(
            *body, split.shape, split.constraint, _mean_bulk_modulus(split.modulus, _volumes(case, mesh, parts))
        )
    return _convert_to_axisymmetric(made, case, mesh, parts)


def _convert_to_axisymmetric(made: Any, case: Case, mesh: Mesh, parts: IntegrationPoints) -> Energy:
    """Return the energy of a plane section, converted to a body of revolution if the case is axisymmetric."""
    if not case.depth:
        return made  # type: ignore[no-any-return]
    from softmark.solvers.energies.axisymmetric import hoop_terms_and_ring_volumes

    hoop, w = hoop_terms_and_ring_volumes(made, parts.N, mesh.points, case.depth)
    return replace(made, w=w, hoop=hoop)  # type: ignore[no-any-return]


def _porous(model: Fem, case: Case, mesh: Mesh, parts: IntegrationPoints) -> Energy:
    """Return the energy of a poroelastic solid before any fluid has moved."""
    from softmark.solvers.assembly.taylor_hood import poroelastic_energy
    from softmark.solvers.materials import law_for
    from softmark.solvers.materials.volumetric_constraints import Dilatation, VolumeRatio

    small = model.strain == "small"
    pair = law_for(case.material, model.strain), Dilatation() if small else VolumeRatio()
    return poroelastic_energy(mesh, parts, pair, _mean(case.material.shear_modulus, parts.w), case.material, not small)


def _volumes(case: Case, mesh: Mesh, parts: IntegrationPoints) -> Floats:
    """Return the volumes of integration points (m, q), m^3; for a body of revolution, in proportion to whole rings."""
    return parts.w * parts.at_points(mesh.points[mesh.cells, 0]) if case.depth else parts.w


def _mean(modulus: Any, w: Floats) -> float:
    """Return a modulus, Pa, or its volume mean if it varies between integration points."""
    return modulus if isinstance(modulus, float | int) else float((modulus * w).sum() / w.sum())


def _mean_bulk_modulus(modulus: Any, w: Floats) -> Any:
    """Return the bulk modulus of cells with one pressure, Pa; if M varies, its harmonic mean V / int 1/M dV."""
    if isinstance(modulus, float | int):
        return modulus
    return w.sum(axis=1) / (w / modulus).sum(axis=1)


def must_be_compressible(declared: Declared, pieces: Sequence[MaterialRegion]) -> None:
    """Raise Fault if a varying Poisson's ratio reaches 0.5 at a point of a model that has no pressure unknowns."""
    if declared.thing.formulation == "mixed" or all(own.graded is None for own in pieces):
        return
    from softmark.interpreter.models.shared import heterogeneous_material

    for own in pieces:
        heterogeneous_material.must_be_compressible(declared, own)


@dataclass(frozen=True)
class Unknowns:
    """Unknowns of a solid: nodal displacements, followed by pressures if the formulation has them.

    The first `displacements` unknowns are displacements; `all` is the total number.
    """

    displacements: int
    all: int

    @classmethod
    def of(cls, energies: Sequence[Energy], mesh: Mesh) -> Unknowns:
        """Return the unknowns of elastic energies over a mesh, one energy for each material."""
        from softmark.solvers.energies.mixed_displacement_pressure import MixedSolid

        last = energies[-1]
        return cls(mesh.points.size, last.dofs if isinstance(last, MixedSolid) else mesh.points.size)

    @property
    def pressures(self) -> int:
        """Number of pressure unknowns."""
        return self.all - self.displacements

    def loads(self, loads: list[Energy]) -> list[Energy]:
        """Return loads on displacements as energies in terms of all unknowns."""
        if not self.pressures:
            return loads
        from softmark.solvers.energies.mixed_displacement_pressure import DisplacementEnergy

        return [DisplacementEnergy(load, self.displacements) for load in loads]

    def extend_function(self, of: Callable[[Floats], T]) -> Callable[[Floats], T]:
        """Return a function of displacements as a function of all unknowns."""
        return lambda x: of(self.moved(x))

    def moved(self, x: Floats) -> Floats:
        """Return the displacement unknowns of a state x (dofs,), without its pressures."""
        return x[: self.displacements]

    def cell_pressures(self, energies: Sequence[Energy], pieces: Sequence[MaterialRegion], x: Floats) -> Floats | None:
        """Return the pressures of each cell (m, b), Pa, in a state x (dofs,); None if pressures are not unknowns.

        Each of the energies belongs to the cells of the corresponding piece.
        """
        import numpy as np

        if not self.pressures:
            return None
        each: list[Any] = list(energies)
        if len(each) == 1:
            return each[0].unit * x[each[0].pressures]  # type: ignore[no-any-return]
        found = np.empty((sum(len(e.cells) for e in each), each[0].pressures.shape[1]))
        for energy, own in zip(each, pieces, strict=True):
            found[own.which] = energy.unit * x[energy.pressures]
        return found

    def start_state(self, u: Floats | None) -> Floats | None:
        """Return a state with displacements u and zero pressures; None without u.

        The first Newton step finds the pressures.
        """
        import numpy as np

        return u if u is None or not self.pressures else np.concatenate([u, np.zeros(self.pressures)])


def must_determine_pressure(
    declared: Declared, case: Case, pieces: Sequence[MaterialRegion], assembly: Assembly
) -> None:
    """Raise Fault if supports leave a uniform pressure in an incompressible body undetermined.

    This happens if supports hold the whole surface: a prescribed change of volume is impossible, and without such a
    change the pressure is arbitrary.
    """
    import numpy as np

    energies: Any = [energy for energy in assembly.internal if energy.saddle]
    if not assembly.saddle or not all(own.case.material.incompressible for own in pieces):
        return
    same = np.zeros(assembly.dofs)  # the same pressure everywhere, in the units of the state
    for energy in energies:
        same[energy.pressures] = energies[0].unit / energy.unit
    pressures = assembly.free >= 3 * energies[0].nodes
    B = assembly.tangent(np.zeros(assembly.dofs), 0.0)[~pressures][:, pressures].multiply(
        same[assembly.free][pressures]
    )
    if B.size and np.abs(B.sum(axis=1)).max() > 1e-9 * abs(B).sum(axis=1).max():
        return
    at = case.supports[-1].at()
    help = "leave part of the surface free, or use a Poisson's ratio below 0.5 such as 0.4999"
    raise fault("E555", at, f"the supports enclose the incompressible `{case.body.name}` completely, so its "
                            f"pressure in `{declared.name}` is undetermined", "no room to deform", help)  # fmt: skip


def saddle_point_solver(choice: LinearSolverOptions, assembly: Assembly) -> LinearSolverOptions:
    """Return a linear solver that can solve saddle point systems if the assembly has pressures; else the given one."""
    import numpy as np

    if not assembly.saddle:
        return choice
    spare, energies = np.zeros(assembly.dofs), [e for e in list[Any](assembly.internal) if e.saddle]
    for energy in energies:
        spare[: energy.dofs] += energy.spare
    return replace(choice, spare=spare[assembly.free], modes=None)
