"""Materials whose constants vary in space: values of the constants on a mesh, and their integrals over cells.

The constants are evaluated at the integration points of the material law. Cells with constant strain need only
one point for the law; they get the means of their two moduli, by a rule that is exact for quadratic variation.
Warnings report cells in which a constant changes much, and integrals that differ from those of a finer rule.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import cache
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language import units
from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.language.spatial_profiles import Profile
from softmark.interpreter.models.shared.varying_quadrature import (
    CellQuadrature,
    CellRule,
    FunctionsOfConstants,
    choose_quadrature,
    constant_functions,
    key_of,
    stiffness_functions,
)
from softmark.interpreter.problem.body_case import Case, Fault, fault
from softmark.interpreter.problem.field_files import load_field, read_field
from softmark.interpreter.problem.heterogeneity_limits import is_allowed, out_of_range_fault
from softmark.interpreter.problem.representative_constants import profiles
from softmark.records import dataclass
from softmark.references.measured_data import Unreadable
from softmark.solvers.elements import CELLS, finer_element
from softmark.solvers.energies.energy import Floats
from softmark.solvers.materials.heterogeneous import average_moduli, map_arrays, with_constants
from softmark.solvers.mesh.element_interpolation import IntegrationPoints, integrate_cells
from softmark.solvers.mesh.mesh import Mesh

if TYPE_CHECKING:
    from softmark.solvers.mesh.element_interpolation import Rule

ACTIVE = ("tension", "shortening")  # constants of active muscle
OF_LAWS = ("young", "poisson")  # constants of the material law; masses have other quadrature points
FINE = 3  # Gauss points along each axis of a hexahedron in the finer rule
STEEP = 2.0  # ratio of extremes of a constant within a cell, above which the cell is too large
MANY = 0.01  # of the volume of the body: fewer such cells cause no warning
HARD = 1e4  # largest ratio of P-wave modulus to shear modulus
BEYOND = 1e-3  # of the volume of the body: a smaller part outside a field causes no warning
MISSED = 2e-3  # of the integral of a constant: a smaller error causes no warning
LOST = 1e-6  # of an integral: a smaller difference from a finer rule counts as rounding


def evaluate_profile(profile: Profile, X: Floats) -> Floats:
    """Return the values (...) of a varying constant at points X (..., 3), m. Raises Fault if its file is unusable."""
    try:
        found: Floats = profile.values(X.reshape(-1, 3), read_field).reshape(X.shape[:-1])
    except Unreadable as error:
        raise unreadable_constant(profile, error) from error
    return found


def unreadable_constant(profile: Profile, error: Unreadable) -> Fault:
    """Return the Fault for a constant whose file cannot be read."""
    problem = f"the field of `{profile.name}` cannot be used: {error.name}: {error.reason}"
    return Fault(diagnostic("E410", profile.at, problem, "cannot be used", error.remedy))


class Part(Protocol):
    """Interface of the cells of one material; `MaterialRegion` (material_regions.py) implements it."""

    @property
    def case(self) -> Case:
        """Case in which the whole body has this material."""

    @property
    def mesh(self) -> Mesh:
        """Mesh of the cells of this material, with all nodes of the whole mesh."""

    @property
    def which(self) -> Any:
        """Indices of the cells of this material in the whole mesh."""

    @property
    def number(self) -> int:
        """Index of the material."""


Parts = Callable[[], Sequence[Part]]  # parts of a mesh, evaluated once because results are cached


def sample_at_integration_points(own: Part, pressures: bool = False) -> tuple[Case, IntegrationPoints | None]:
    """Return the case of one material with its varying constants evaluated at integration points. Raises Fault.

    The second value is the integration at these points, None for those of the element. If `pressures` are
    unknowns, the inverse of the bulk modulus is integrated.
    """
    mesh, rule = own.mesh, _rule(own.mesh)
    must_be_in_range(own.case, mesh)
    seen = stiffness_of(own.case, mesh, pressures)
    known = None if seen is None else seen.rule
    turning = getattr(own.case.material, "turning", False)
    if turning:
        rule = mesh.element.quadrature()  # unlike constants of `tet4`, directions are not averaged
    X = rule_positions(mesh, rule) if known is None else known.places(mesh)
    if turning:
        return replace(own.case, other_material=with_fiber_directions(own.case, mesh, X)), _parts(mesh, known)
    sampled = _sample_constants(own.case, X)
    if mesh.element.constant and sampled.sampled:
        w = np.broadcast_to(rule[1], X.shape[:2]) if known is None else known.w
        return replace(own.case, other_material=average_moduli(sampled, w)), None
    return replace(own.case, other_material=sampled), _parts(mesh, known)


def _parts(mesh: Mesh, rule: CellRule | None) -> IntegrationPoints | None:
    """Return the shape gradients and volumes at the points of a quadrature rule, for each cell; None without a rule."""
    return None if rule is None else rule.integration(mesh)


def stiffness_of(case: Case, mesh: Mesh, pressures: bool) -> CellQuadrature | None:
    """Return the quadrature of the constants in the strain energy of one material; None if they do not vary.

    For muscle the varying constants are `tension` or `shortening`. They are evaluated at the points of the element
    and are not averaged over a cell, as moduli of `tet4` are. The passive law of a muscle does not vary.
    """
    material = case.material
    found = profiles(material)
    if case.porous or material.branches:  # poroelastic and viscoelastic materials use the points of the element
        return None
    if getattr(material, "turning", False) or getattr(material, "pulls", False):
        active = next((p for name, p in found.items() if name in ACTIVE), None)
        return (
            None
            if active is None
            else choose_quadrature(mesh, constant_functions(active, evaluate_profile), mesh.element.quadrature(), False)
        )
    if not any(name in OF_LAWS for name in found):
        return None
    return choose_quadrature(mesh, moduli_of(material, pressures), _rule(mesh), False)


def moduli_vary(case: Case) -> bool:
    """Return whether the moduli of a material vary in space."""
    material = case.material
    return not getattr(material, "turning", False) and any(name in OF_LAWS for name in profiles(material))


def moduli_of(material: Any, pressures: bool) -> FunctionsOfConstants:
    """Return the moduli of a material as functions of position, which `stiffness_of` integrates."""
    return stiffness_functions(material.young, material.poisson, pressures, evaluate_profile)


def density_quadrature(case: Case, mesh: Mesh) -> CellQuadrature | None:
    """Return the quadrature of the density of one material; None if the density is a single number."""
    rho = case.material.density
    return (
        choose_quadrature(mesh, constant_functions(rho, evaluate_profile), mesh.element.mass_quadrature(), True)
        if isinstance(rho, Profile)
        else None
    )


def _rule(mesh: Mesh) -> Rule:
    """Return the quadrature rule for constants: that of the element, or a finer one if it has one point."""
    return (finer_element(mesh.element) if mesh.element.constant else mesh.element).quadrature()


def must_be_in_range(case: Case, mesh: Mesh) -> None:
    """Raise Fault if a constant is out of its range at an integration point, a node or a point of a finer rule."""
    for profile in profiles(case.material).values():
        for X in (
            rule_positions(mesh, _rule(mesh)),
            mesh.points[mesh.cells],
            rule_positions(mesh, _finer_rule(mesh.kind)),
        ):
            _check_values_in_range(case, profile, evaluate_profile(profile, X), X)


def _sample_constants(case: Case, X: Floats) -> Any:
    """Return the material with its varying constants evaluated at points X (m, q, 3), m, as (m, q). Raises Fault."""
    new = {}
    for name, profile in profiles(case.material).items():
        if name in OF_LAWS:
            new[name] = evaluate_profile(profile, X)
            _check_values_in_range(case, profile, new[name], X)
    return with_constants(case.material, new)


def with_fiber_directions(case: Case, mesh: Mesh, X: Floats) -> Any:
    """Return the material with fibre directions evaluated at points X (m, q, 3), m, of cells. Raises Fault."""
    from softmark.interpreter.models.shared.undefined_fiber_directions import must_have_directions
    from softmark.solvers.materials.material_axes import InvalidDirection

    at = case.body.at("material")
    must_have_directions(case, mesh)
    try:
        return case.material.placed(X, read_field)
    except InvalidDirection as error:
        where = (
            "" if error.place is None else f" at {units.format_vector(tuple(map(float, error.place)), units.LENGTH)}"
        )
        raise fault(
            "E366", at, f"the material of `{case.body.name}` has no fibre direction{where}: {error.reason}",
            "no direction", "components must not all be zero at one point, a rule must be defined in the "
                            "whole body, and sheets must not be parallel to fibres",
        ) from error  # fmt: skip
    except Unreadable as error:
        raise fault("E410", at, f"the fibre field of `{case.body.name}` cannot be used: {error.name}: "
                                f"{error.reason}", "cannot be used", error.remedy) from error  # fmt: skip


def material_at(material: Any, mesh: Mesh, rule: Rule) -> Any:
    """Return a material with arrays (m, q) of its varying constants and fibre directions at the points of a rule."""
    if getattr(material, "turning", False):
        own = mesh.element.quadrature() if mesh.element.constant else rule
        found = material.placed(rule_positions(mesh, own), read_field)
        return map_arrays(found, lambda a: np.repeat(a, len(rule[1]), axis=1)) if mesh.element.constant else found
    own = _rule(mesh) if mesh.element.constant else rule
    X = rule_positions(mesh, own)
    found = with_constants(material, {n: evaluate_profile(p, X) for n, p in profiles(material).items() if n in OF_LAWS})
    if not (mesh.element.constant and found.sampled):
        return found
    mean = average_moduli(found, np.broadcast_to(own[1], X.shape[:2]))
    return map_arrays(mean, lambda a: np.repeat(a, len(rule[1]), axis=1))


def rule_positions(mesh: Mesh, rule: Rule) -> Floats:
    """Return the positions (m, q, 3), m, of the points of a quadrature rule in every cell."""
    found: Floats = np.einsum("qa,mai->mqi", mesh.element.shape(rule[0]), mesh.points[mesh.cells])
    return found


def _check_values_in_range(case: Case, profile: Profile, found: Floats, X: Floats) -> None:
    """Raise Fault if the values `found` of a constant at points X are out of its range; name the worst point."""
    odd = np.flatnonzero(~np.isfinite(found))
    for i in odd[:1] if len(odd) else (found.argmin(), found.argmax()):
        value = float(found.flat[i])
        if not is_allowed(profile, value):
            raise out_of_range_fault(case, profile, value, X.reshape(-1, 3)[i])


def must_be_compressible(declared: Declared, own: Part) -> None:
    """Raise Fault if Poisson's ratio reaches 0.5 at a point of a model that has no pressure unknowns."""
    nu = own.case.material.poisson
    if isinstance(nu, np.ndarray) and nu.max() >= 0.5:
        raise fault(
            "E552", declared.at("formulation" if declared.thing.formulation != "displacement" else "element"),
            f"the material of `{own.case.body.name}` is incompressible at some points, but this element "
            "needs a compressible material", "infinite bulk modulus",
            "use `tet10` or `hex8` with `formulation = mixed`, or a Poisson's ratio below 0.5 everywhere",
        )  # fmt: skip


# ------------------------------------------------------------------ density


@dataclass(frozen=True)
class Density:
    """Density that varies in space, as given by `profile`."""

    profile: Profile
    case: Case

    def points(self, mesh: Mesh) -> tuple[Floats, Floats, Floats]:
        """Return shape functions (q, a) or (m, q, a), volumes (m, q), m^3, and positions (m, q, 3), m, for masses."""
        from softmark.solvers.dynamics.mass_matrices import mass_shapes_and_volumes

        seen = density_quadrature(self.case, mesh)
        if seen is not None and seen.rule is not None:
            return seen.rule.shape(mesh), seen.rule.w, seen.rule.places(mesh)
        N, w = mass_shapes_and_volumes(mesh.points, mesh.cells, mesh.element)
        return N, w, np.einsum("qa,mai->mqi", N, mesh.points[mesh.cells])

    def at(self, X: Floats) -> Floats:
        """Return the density (m, q), kg/m^3, at points X (m, q, 3), m. Raises Fault where the value is out of range."""
        found = evaluate_profile(self.profile, X)
        _check_values_in_range(self.case, self.profile, found, X)
        return found


def density_of(case: Case) -> Any:
    """Return the density of the material of a case, kg/m^3: a number, or a `Density` if it varies in space."""
    rho = case.material.density
    return Density(rho, case) if isinstance(rho, Profile) else rho


# ------------------------------------------------------------------ what cells make of it


@dataclass(frozen=True)
class ConstantStatistics:
    """Statistics of a varying constant on a mesh: extremes and mean, SI, and measures of its resolution.

    `steep` is the volume fraction of cells in which the constant changes by more than the factor STEEP; `contrast`
    is the largest change within a cell. `lost` is the quadrature error: the sum over cells of the difference
    between the integral by the cell's rule and by a finer rule, relative to the integral over the body. For a
    constant that is read from a field file, `outside` is the volume fraction outside the field, and `there` has the
    least and largest value used outside.
    """

    least: float
    most: float
    mean: float
    steep: float
    contrast: float
    lost: float
    outside: float = 0.0
    there: tuple[float, float] = (0.0, 0.0)
    read: bool = False

    def facts(self) -> dict[str, Any]:
        """Return the statistics as entries of a report."""
        found: dict[str, Any] = {
            "least": self.least, "most": self.most, "mean": self.mean, "within_cells": self.contrast,
            "steep_share": self.steep, "integral_lost": self.lost,
        }  # fmt: skip
        return found | ({"outside_share": self.outside, "outside_values": list(self.there)} if self.read else {})


@cache
def _finer_rule(kind: str) -> Rule:
    """Return a quadrature rule that is finer than the rule of the element."""
    element = CELLS[kind]
    if element.family != "hexahedra":
        return element.mass_quadrature()
    one, w = np.polynomial.legendre.leggauss(FINE)
    grid = np.stack(np.meshgrid(one, one, one, indexing="ij"), axis=-1).reshape(-1, 3)
    return grid, np.einsum("i,j,k->ijk", w, w, w).ravel()


def constant_statistics(case: Case, mesh: Mesh, profile: Profile) -> ConstantStatistics:
    """Return the statistics of one varying constant of the material of a case on a mesh."""
    own, fine = _rule(mesh), _finer_rule(mesh.kind)
    X, w = rule_positions(mesh, fine), integrate_cells(mesh, rule=fine).w
    c = evaluate_profile(profile, X)
    coarse = evaluate_profile(profile, rule_positions(mesh, own)) * integrate_cells(mesh, rule=own).w
    each, total = (c * w).sum(axis=1), float(w.sum())
    seen = np.concatenate([c, evaluate_profile(profile, mesh.points[mesh.cells])], axis=1)
    low, high = seen.min(axis=1), seen.max(axis=1)
    most, least = (_stiffness_measure(profile, v) for v in (high, low))
    with np.errstate(all="ignore"):
        change = np.where(most * least > 0.0, np.maximum(np.abs(most / least), np.abs(least / most)), 1.0)
    size = each + w.sum(axis=1) if profile.name == "poisson" else each  # the shear modulus depends on 1 + nu
    lost = float(np.abs(each - coarse.sum(axis=1)).sum() / np.abs(size).sum()) if np.any(each) else 0.0
    known = density_quadrature(case, mesh) if profile.name == "density" else _known_stiffness(case, mesh)
    if known is not None:
        lost = float(known.missed.sum())
        row = (
            1
            if profile.name == "poisson" and len(known.least) > 1 and isinstance(case.material.poisson, Profile)
            else 0
        )
        with np.errstate(all="ignore"):
            change = np.maximum(change, np.nan_to_num(known.largest[row] / known.least[row], nan=1.0, posinf=np.inf))
        if row == 0 and not isinstance(getattr(case.material, "poisson", 0.0), Profile):
            least_seen, most_seen = float(known.least[0].min()), float(known.largest[0].max())
            seen = np.concatenate([seen.ravel(), [least_seen, most_seen]])
            each = known.means[0] * w.sum(axis=1)
    steep = float(w.sum(axis=1)[change > STEEP].sum()) / total
    found = ConstantStatistics(
        float(seen.min()), float(seen.max()), float(each.sum()) / total, steep, float(change.max()), lost
    )
    out = _outside_fields(profile, X)
    if out is None:
        return found
    share = float(w[out].sum()) / total
    there = (float(c[out].min()), float(c[out].max())) if out.any() else (0.0, 0.0)
    return replace(found, outside=share, there=there, read=True)


def _known_stiffness(case: Case, mesh: Mesh) -> CellQuadrature | None:
    """Return the quadrature of the moduli, from the cache of a model on this mesh if there is one."""
    for pressures in (True, False):
        key = key_of(moduli_of(case.material, pressures), _rule(mesh), False) if moduli_vary(case) else None
        if key in mesh.selections:
            found: CellQuadrature = mesh.selections[key]
            return found
    return stiffness_of(case, mesh, False)


def _stiffness_measure(profile: Profile, found: Floats) -> Floats:
    """Return the values of a constant; for Poisson's ratio, of P-wave modulus / shear modulus, limited by HARD."""
    if profile.name != "poisson":
        return found
    told: Floats = 2.0 * (1.0 - found) / np.maximum(1.0 - 2.0 * found, 1.0 / HARD)
    return told


def _outside_fields(profile: Profile, X: Floats) -> Any:
    """Return which points X (m, q, 3), m, lie outside the field file of a constant, as (m, q); None without a field."""
    found = [load_field(field).outside(X.reshape(-1, 3)).reshape(X.shape[:-1]) for field in profile.fields]
    return np.any(found, axis=0) if found else None


def _varying_constants(case: Case, mesh: Mesh, parts: Parts) -> Iterator[tuple[str, Profile, ConstantStatistics]]:
    """Yield each varying constant with the name of its owner and its statistics, which are cached in the mesh."""
    key = constant_statistics, case.materials, case.leaning
    if key not in mesh.selections:
        names, found = (case.body.name, *(part.name for part in case.parts)), []
        for own in parts():
            for profile in profiles(own.case.material).values():
                of = names[own.number]
                found.append((of, profile, constant_statistics(own.case, own.mesh, profile)))
        mesh.selections[key] = found
    yield from mesh.selections[key]


def cell_means(mesh: Mesh, each: Sequence[Part]) -> dict[str, Floats]:
    """Return cell means (m,), SI, of the varying constants, by name; `each` has the cells of every material."""
    names = dict.fromkeys(name for own in each for name in profiles(own.case.material))
    found = {name: np.empty(len(mesh.cells)) for name in names}
    rule = _finer_rule(mesh.kind)
    for own in each:
        w = integrate_cells(own.mesh, rule=rule).w
        for name, known in found.items():
            constant = getattr(own.case.material, name)
            if isinstance(constant, Profile):
                constant = (evaluate_profile(constant, rule_positions(own.mesh, rule)) * w).sum(axis=1) / w.sum(axis=1)
            known[own.which] = constant
    return found


def varying_constants_report(case: Case, mesh: Mesh, parts: Parts) -> dict[str, Any]:
    """Return the `graded` part of a report: statistics of the varying constants."""
    return {
        "graded": {
            f"{of}.{profile.name}": spread.facts() for of, profile, spread in _varying_constants(case, mesh, parts)
        }
    }


def _warn_of_locking(declared: Declared, case: Case, poisson: float) -> Iterator[Diagnostic]:
    """Yield a warning if the element locks at the largest Poisson's ratio of cells and validation did not warn."""
    before, known = (
        declared.thing.locking(declared, replace(case, other_material=replace(case.typical[0], poisson=nu), parts=()))
        for nu in (case.largest_poisson, poisson)
    )
    if before is None and known is not None:
        yield known


def representative_materials(case: Case, mesh: Mesh, parts: Parts) -> tuple[Any, ...]:
    """Return the materials of a case with varying constants replaced by mesh means; Poisson's ratio by its maximum."""
    names, found = [case.body.name, *(part.name for part in case.parts)], list(case.materials)
    for of, profile, spread in _varying_constants(case, mesh, parts):
        number = names.index(of)
        value = spread.most if profile.name == "poisson" else spread.mean
        found[number] = with_constants(found[number], {profile.name: value})
    return tuple(m if getattr(m, "uniform", True) else known for m, known in zip(found, case.typical, strict=True))


def largest_quadrature_error(case: Case, mesh: Mesh, parts: Parts) -> float:
    """Return the largest relative error of the integral of a varying constant; 0 if it is only rounding."""
    found = max((spread.lost for _, _, spread in _varying_constants(case, mesh, parts)), default=0.0)
    return found if found > LOST else 0.0


def notes(declared: Declared, case: Case, mesh: Mesh, parts: Parts) -> Iterator[Diagnostic]:
    """Yield warnings if the mesh is too coarse for a varying constant, or the body extends beyond a field file."""
    if any(getattr(material, "turning", False) for material in case.materials):
        from softmark.interpreter.models.shared import undefined_fiber_directions

        for own in parts():
            yield from undefined_fiber_directions.notes(own.case, own.mesh)
    for of, profile, spread in _varying_constants(case, mesh, parts):
        if spread.outside > BEYOND:
            low, high = (units.format_value(float(f"{v:.4g}"), profile.dimension) for v in spread.there)
            got = low if low == high else f"{low} to {high}"
            yield diagnostic(
                "W336", profile.at, f"{100 * spread.outside:.3g} % of the volume of `{of}` lies outside the "
                                    f"field of its `{profile.name}`", f"`{profile.name}` is {got} there",
                "the nearest value of the field is used outside it: check `origin`, `x`, `z` and `length` "
                "of the field, and the position of the body",
            )  # fmt: skip
        if profile.name == "poisson":
            yield from _warn_of_locking(declared, case, spread.most)
        if spread.lost > MISSED:
            yield diagnostic(
                "W402", declared.at("size" if declared.thing.own_mesh is None else "mesh"),
                f"`{profile.name}` of `{of}` varies too much inside cells of `{declared.name}` to be "
                "integrated accurately",
                f"up to {100 * spread.lost:.2g} % of the integrals may be missed",
                "use a finer mesh, or an expression or image without such fine features; the stated error "
                "includes this",
            )  # fmt: skip
        pressed = profile.name == "poisson" and declared.thing.formulation == "mixed"  # which takes any
        if spread.steep > MANY and not pressed:
            what = "the bulk modulus (by `poisson`)" if profile.name == "poisson" else f"`{profile.name}`"
            yield diagnostic(
                "W337", declared.at("size" if declared.thing.own_mesh is None else "mesh"),
                f"{what} changes by more than a factor {STEEP:g} inside cells of `{declared.name}` that "
                f"fill {100 * spread.steep:.3g} % of the volume of `{of}`",
                f"up to a factor {spread.contrast:.3g} in one cell",
                "use a finer mesh, or a region with nodes where the constant jumps: the displacement of a "
                "cell cannot follow such changes",
            )  # fmt: skip
