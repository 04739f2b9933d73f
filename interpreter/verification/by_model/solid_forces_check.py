"""Forces of finite elements, assembled from energy densities independently of the solver."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softmark.interpreter.models.fem.fem_declaration import Fem
from softmark.interpreter.models.postprocessing.nodal_forces import Wrench
from softmark.interpreter.models.shared.material_regions import stiffness_points
from softmark.interpreter.models.shared.prepared_model import DeformedMesh
from softmark.interpreter.problem.body_case import Case
from softmark.interpreter.verification.cell_materials_check import split_by_material
from softmark.interpreter.verification.load_forces_check import load_forces
from softmark.interpreter.verification.reaction_balance import sum_by_support
from softmark.interpreter.verification.support_reactions_check import held_components
from softmark.interpreter.verification.unverified_model_error import NoIndependentFormula
from softmark.records import dataclass
from softmark.solvers.elements import CELLS
from softmark.solvers.independent_forces import solid_forces
from softmark.solvers.independent_forces.mixed_formulation_forces import MixedBody, split_law
from softmark.solvers.independent_forces.solid_forces import CheckedBody, Floats, ForceBalance, StressTerm
from softmark.solvers.independent_forces.stress_by_differences import EnergyStress, PlaneStressLaw

LEFT = 50.0  # times the estimate of what rounding leaves


@dataclass(frozen=True)
class SolidState:
    """Deformed state of a finite element model, whose forces are verified; they are computed once."""

    model: Fem
    case: Case
    mesh: DeformedMesh

    @cached_property
    def u(self) -> Floats:
        """Displacements of the nodes (n, 3), m, in double precision."""
        return np.asarray(self.mesh.displacement, dtype=np.float64)

    @cached_property
    def held(self) -> NDArray[np.bool_]:
        """Mask of degrees of freedom that supports hold (n, 3)."""
        return held_components(self.case, self.mesh)

    @cached_property
    def loads(self) -> tuple[Floats, float]:
        """External nodal forces (n, 3), N, and their uncertainty, N.

        They are the forces of loads, active muscle, foundations and contacts. Raises NoIndependentFormula.
        """
        found, unsure = load_forces(self.case, self.mesh, self.u, self.model.strain == "small", self.model.mass)
        if any(getattr(material, "pulls", False) for material in self.case.materials):
            from softmark.interpreter.verification import fiber_directions_check

            found = found + fiber_directions_check.muscle_forces(self.case, self.mesh, self.u)
        beds, vague = self.beds
        return sum(beds.values(), found), unsure + vague

    @cached_property
    def beds(self) -> tuple[dict[str, Floats], float]:
        """Nodal forces (n, 3), N, of every elastic foundation, contact and tie by name, and their uncertainty, N.

        Raises NoIndependentFormula.
        """
        found, unsure = dict[str, Floats](), 0.0
        if self.case.beds:
            from softmark.interpreter.verification.foundation_forces import foundation_forces

            found, unsure = foundation_forces(self.case, self.mesh, self.u)
        if self.case.contacts:
            from softmark.interpreter.verification.contact_forces_check import all_contact_forces

            touched, left = all_contact_forces(self.case, self.mesh, self.u)
            found, unsure = found | touched, unsure + left
        if self.case.pairs:
            from softmark.interpreter.verification.self_contact_forces_check import pair_forces

            found = found | pair_forces(self.case, self.mesh, self.u)
        return found, unsure

    @cached_property
    def checked_nodes(self) -> Any:
        """Numbers (k,) of the nodes at which forces are checked: a sample of a large mesh, or None for all nodes."""
        if self.model.formulation != "displacement" or self.case.porous:
            return None
        return solid_forces.sample_nodes(
            len(self.mesh.points), self.mesh.cells, len(solid_forces.quadrature_rule(self.mesh.kind)[1])
        )[0]

    @cached_property
    def balanced(self) -> tuple[Floats, float, float]:
        """Internal nodal forces (n, 3), N, at the checked nodes, residual of the pressure equations, and rounding, N.

        Raises NoIndependentFormula.
        """
        return self.inside(self.checked_nodes)

    def inside(self, chosen: Any) -> tuple[Floats, float, float]:
        """Return internal nodal forces (n, 3), N, the residual of the pressure equations, and the rounding.

        The forces are those of the cells around the `chosen` nodes; mixed formulations use all cells. Raises
        NoIndependentFormula.
        """
        try:
            return self._compute_internal_forces(chosen)
        except ValueError as reason:  # the energy has no differences there
            raise NoIndependentFormula(str(reason)) from reason

    def _compute_internal_forces(self, chosen: Any) -> tuple[Floats, float, float]:
        if self.case.porous:
            return self._porous_forces
        if self.model.formulation != "displacement":
            return self._mixed_forces
        near = _cells_around(chosen, self.mesh)
        found, noise = np.zeros_like(self.mesh.points), 0.0
        for own, which in split_by_material(self.case, self.mesh):
            cells = self.mesh.cells[which][near[which]]
            rules = stiffness_points(own, self.mesh.mesh, which, False)
            rules = None if rules is None else (rules[0][near[which]], rules[1][near[which]])
            body = checked_body(self.model, own, self.mesh.points, cells, self.mesh.kind, self.u, rules)
            body = self._add_deformation_history(own, body)
            f, left = body.forces(cells)
            found, noise = found + f, noise + left
        return found, 0.0, noise

    def _add_deformation_history(self, own: Case, body: Any) -> Any:
        """Return a body with the deformation history of a viscoelastic material; unchanged for other materials.

        Raises NoIndependentFormula.
        """
        if not own.material.branches:
            return body
        from softmark.interpreter.verification import viscoelastic_forces_check

        points = len(self.mesh.cells) * len(solid_forces.quadrature_rule(self.mesh.kind)[1])
        return viscoelastic_forces_check.with_history(
            body, viscoelastic_forces_check.deformation_history(own, self.model.strain, self.mesh, points)
        )

    @cached_property
    def _porous_forces(self) -> tuple[Floats, float, float]:
        """Return the internal forces of skeleton and fluid in a porous body, with their residual and rounding."""
        from softmark.interpreter.verification import poroelastic_forces_check

        body = checked_body(
            self.model,
            poroelastic_forces_check.drained_case(self.case),
            self.mesh.points,
            self.mesh.cells,
            self.mesh.kind,
            self.u,
        )
        f, noise = body.forces(self.mesh.cells)
        fluid, lacking, more = poroelastic_forces_check.fluid_forces(
            self.case, self.mesh, self.u, self.model.strain == "small"
        )
        return f + fluid, lacking, noise + more

    @cached_property
    def _mixed_forces(self) -> tuple[Floats, float, float]:
        found, lacking, noise = np.zeros_like(self.mesh.points), 0.0, 0.0
        for own, which in split_by_material(self.case, self.mesh):
            f, less, left = self._add_deformation_history(own, mixed_solid(self.model, own, self.mesh, which)).forces()
            found, lacking, noise = found + f, float(np.hypot(lacking, less)), noise + left
        return found, lacking, noise


def solid_state(model: Fem, case: Case, mesh: DeformedMesh | None) -> SolidState:
    """Return the finite element state on a deformed mesh. Raises NoIndependentFormula."""
    if mesh is None or mesh.kind not in CELLS:
        raise NoIndependentFormula(f"no independent formula is available for the element {model.element}")
    return SolidState(model, case, mesh)


def balance_of(state: SolidState) -> ForceBalance:
    """Compute the force balance of finite elements. Raises NoIndependentFormula."""
    inside, lacking, noise = state.balanced
    outside, unsure = state.loads
    return solid_forces.force_balance(inside, outside, state.held, noise + unsure / LEFT, state.checked_nodes, lacking)


def reactions_of(state: SolidState) -> tuple[dict[str, Wrench], float]:
    """Return the reaction of every support, from the cells around it, and its rounding error, N.

    Raises NoIndependentFormula.
    """
    every = state.checked_nodes is None
    inside, _, noise = state.balanced if every else state.inside(np.flatnonzero(state.held.any(axis=1)))
    outside, unsure = state.loads
    x = state.mesh.points if state.model.strain == "small" else state.mesh.points + state.u
    held = residuals_by_support(state.case, state.mesh, inside - outside, x)
    beds = {
        name: _resultant(state.case, _forces_without_first_part(state, name, f), x) for name, f in state.beds[0].items()
    }
    return held | beds, LEFT * noise + unsure


def _forces_without_first_part(state: SolidState, name: str, f: Floats) -> Floats:
    """Return the nodal forces (n, 3), N, of a contact or tie.

    Between two parts of a body, the forces on the first part are set to zero.
    """
    if all(pair.name != name for pair in state.case.pairs):
        return f
    from softmark.solvers.contact.contact_surface import mask_nodes_after_first_piece

    told = mask_nodes_after_first_piece(state.mesh.mesh)
    return f if told is None else np.where(told[:, None], f, 0.0)


def _resultant(case: Case, f: Floats, x: Floats) -> Wrench:
    """Return the resultant of forces f (n, 3), N, at nodes x (n, 3), m, of one foundation."""
    whole = np.hstack([f, np.zeros_like(f)])
    return sum_by_support({"bed": np.ones(whole.shape, dtype=np.bool_)}, whole, x, case.depth > 0.0)["bed"]


def residuals_by_support(case: Case, mesh: DeformedMesh, left: Floats, x: Floats) -> dict[str, Wrench]:
    """Return the resultant of the residual forces `left` (n, 3) at nodes x (n, 3), m, that each support carries."""
    masks = {}
    for support in case.supports:
        own = held_components(replace(case, supports=(support,)), mesh)
        masks[support.name] = np.hstack([own, np.zeros_like(own)])
    return sum_by_support(masks, np.hstack([left, np.zeros_like(left)]), x, case.depth > 0.0)


def _cells_around(chosen: Any, mesh: DeformedMesh) -> Any:
    """Return a mask of the cells that contain any of the chosen nodes (m,)."""
    mask = np.zeros(len(mesh.points), dtype=np.bool_)
    mask[chosen] = True
    return mask[mesh.cells].any(axis=1)


def mixed_solid(model: Fem, case: Case, mesh: DeformedMesh, which: Any = slice(None)) -> MixedBody:
    """Return the cells `which`, all of one material, as a deformed solid in mixed formulation.

    Raises NoIndependentFormula.
    """
    u, own = np.asarray(mesh.displacement, dtype=np.float64), None
    if model.formulation == "mixed":
        if mesh.pressures is None:
            raise NoIndependentFormula("the pressures of the mixed formulation are not available")
        own = mesh.pressures[which]
    elif model.formulation != "mean_dilatation":
        raise NoIndependentFormula(f"no independent formula is available for formulation = {model.formulation}")
    case = _passive_case(case)
    material, body = case.plain.material, (mesh.points, mesh.cells[which], mesh.kind, u)
    rules = stiffness_points(case, mesh.mesh, which, True)
    if getattr(material, "directed", False):
        from softmark.interpreter.verification import fiber_directions_check

        return fiber_directions_check.mixed_body_of(case, *body, own, rules)
    material = getattr(material, "law", material)  # of what relaxes, that which it is at once
    E, nu = material.young, material.poisson
    split, mu = split_law(material, model.strain, E, nu), E / (2.0 * (1.0 + nu))
    if split is None:
        raise NoIndependentFormula(
            f"the material {type(case.material).__name__} cannot be split into isochoric and volumetric parts"
        )
    if case.uniform:
        return MixedBody(*body, split, mu, own, case.depth)
    from softmark.interpreter.verification.heterogeneous_constants_check import elastic_constants_function
    from softmark.solvers.independent_forces.heterogeneous_forces import HeterogeneousMixedBody
    from softmark.solvers.independent_forces.heterogeneous_forces import split_at_points as varying

    constants = elastic_constants_function(case)
    E, nu = constants(mesh.points[mesh.cells[which]].mean(axis=1))
    mu = float((E / (2.0 * (1.0 + nu))).max(initial=0.0))
    apart = varying(material, model.strain, constants)
    return HeterogeneousMixedBody(*body, split, mu, own, case.depth, rules, apart=apart)


def checked_body(
    model: Fem, case: Case, points: Floats, cells: Any, kind: str, u: Floats, rules: Any = None
) -> CheckedBody:
    """Return cells of one material in their deformed state, with their stress law. Raises NoIndependentFormula.

    `rules` are local points (m, q, 3) and weights (m, q) of each cell, if they differ from those of the element.
    Varying constants are integrated at these points; `verification/heterogeneous_constants_check.py` checks that with
    another quadrature.
    """
    turned, case = model.rotation == "element", _passive_case(case)
    if getattr(case.material, "directed", False):
        from softmark.interpreter.verification import fiber_directions_check

        return fiber_directions_check.body_of(case, points, cells, kind, u, rules)
    if case.uniform:
        terms, stiff = terms_of(model, case)
        return CheckedBody(points, cells, kind, u, terms, stiff, turned, case.depth)
    from softmark.interpreter.verification.heterogeneous_constants_check import elastic_constants_function
    from softmark.solvers.independent_forces import heterogeneous_forces

    strain = "small" if turned else model.strain
    own = heterogeneous_forces.stress_terms(case.plain.material, strain, model.integration == "selective")
    if model.integration not in ("full", "selective") or own is None:
        raise NoIndependentFormula(
            f"no independent formula is available for the material {type(case.material).__name__} with "
            "varying constants"
        )
    if case.material.thin:
        own = tuple(heterogeneous_forces.plane_stress_term(term) for term in own)
    constants = elastic_constants_function(case)
    mu, lam = heterogeneous_forces.lame_moduli(*constants(points[cells].reshape(-1, 3)))
    stiff = float((6.0 * mu + 9.0 * np.abs(lam)).max(initial=0.0))
    return heterogeneous_forces.HeterogeneousBody(
        points, cells, kind, u, own, stiff, turned, case.depth, rules, constants=constants
    )


def _passive_case(case: Case) -> Case:
    """Return the case of one material without active tension, because muscle forces are counted as loads."""
    if not getattr(case.material, "pulls", False):
        return case
    from softmark.interpreter.verification import fiber_directions_check

    return fiber_directions_check.passive_case(case)


def terms_of(model: Fem, case: Case) -> tuple[tuple[StressTerm, ...], float]:
    """Return the stress terms of a model, and the largest elastic modulus, Pa. Raises NoIndependentFormula."""
    terms, stiff = _solid_stress_terms(model, case)
    if case.material.thin:
        return tuple(replace(term, stress=PlaneStressLaw(term.stress)) for term in terms), stiff
    return terms, stiff


def _solid_stress_terms(model: Fem, case: Case) -> tuple[tuple[StressTerm, ...], float]:
    E, nu = case.material.young, case.material.poisson
    mu, lam = E / (2.0 * (1.0 + nu)), E * nu / ((1.0 + nu) * (1.0 - 2.0 * nu))
    stiff = 6.0 * mu + 9.0 * abs(lam)
    if model.integration not in ("full", "selective"):
        raise NoIndependentFormula(f"no independent formula is available for {model.integration} integration")
    selective, strain = model.integration == "selective", "small" if model.rotation == "element" else model.strain
    if strain == "finite":
        return _finite_terms(case.material, selective), stiff
    law = solid_forces.small_strain_stress if strain == "small" else solid_forces.corotational_stress
    if selective:
        return (StressTerm(law(mu, 0.0)), StressTerm(law(0.0, lam), mean=True)), stiff
    return (StressTerm(law(mu, lam)),), stiff


def _finite_terms(material: Any, selective: bool) -> tuple[StressTerm, ...]:
    """Return the stress terms of a material at finite strain, by finite differences of its energy density.

    There is one term, or with selective integration two: the isochoric term, and the volumetric term averaged over each
    cell. Raises NoIndependentFormula.
    """
    of = material.of if material.thin else material  # of a plate: the solid that it is made of
    law, parts = of.finite_law(), of.finite_parts() if selective else None
    if law is None or (selective and parts is None):
        raise NoIndependentFormula(
            f"the material {type(of).__name__} has no finite-strain energy that splits into isochoric and "
            "volumetric parts"
        )
    if parts is None:
        return (StressTerm(EnergyStress(law.psi)),)
    shear = parts[0]
    rest = EnergyStress(lambda F: law.psi(F) - shear.psi(F))
    return StressTerm(EnergyStress(shear.psi)), StressTerm(rest, mean=True)
