"""Construction and solution of material point models, with forces and stress of the homogeneous state."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cache, cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language import units
from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.language.coordinate_conditions import Condition
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.models.material_point.imposed_deformation import (
    NAMES,
    ImposedState,
    collect_imposed_on_faces,
    imposed_state,
)
from softmark.interpreter.models.material_point.material_point_declaration import Homogeneous
from softmark.interpreter.models.postprocessing.nodal_forces import NodalForces, SupportedNodes
from softmark.interpreter.models.shared.prepared_model import BuildContext, Meshless, Prepared, Solution
from softmark.interpreter.problem.body_case import Case
from softmark.records import dataclass
from softmark.solvers.materials import law_for, mixed_for
from softmark.solvers.statics.material_point import FLAT, Floats, ImposedDeformation, MaterialPoint, NoState, PointState
from softmark.solvers.stress_recovery.analytic_stress_field import AnalyticField
from softmark.solvers.stress_recovery.sampling_point_stress import SYMMETRIC
from softmark.solvers.stress_recovery.stress_field import tensor_norm
from softmark.solvers.stress_recovery.stress_measures import Tensors, von_mises

if TYPE_CHECKING:
    from softmark.solvers.statics.static_equilibrium import Watch
    from softmark.solvers.stress_recovery.stress_field import Stresses

PEAK = 0.1  # of the initial stiffness: below it the force counts as having reached its maximum
ALONG = 1e-9  # of the largest stress: a smaller shear stress counts as zero
CORNERS = np.array([(i, j, k) for i in (0, 1) for j in (0, 1) for k in (0, 1)])  # of a box, 0 low and 1 high


@dataclass(frozen=True)
class Block:
    """Bounding box of a body, with corners at which its faces are held; the body may fill only a part of the box."""

    case: Case

    @cached_property
    def X(self) -> Floats:
        """Corners (8, 3), m."""
        assert self.case.shape.bounds is not None
        low, high = (np.array(b) for b in self.case.shape.bounds)
        corners: Floats = low + CORNERS * (high - low)
        return corners

    @cached_property
    def volume(self) -> float:
        """Volume of the body, m^3."""
        return float(self.case.shape.volume or 0.0)

    @cached_property
    def areas(self) -> Floats:
        """Areas (3,), m^2, of the faces normal to x, y and z: the volume of the body over its extent."""
        found: Floats = self.volume / np.ptp(self.X, axis=0)
        return found

    def selected_corner_mask(self, where: Condition) -> NDArray[np.bool_]:
        """Return which of the corners a condition selects (8,)."""
        return np.array([bool(where.holds(x, y, z, self.case.shape.diagonal)) for x, y, z in self.X.tolist()])

    def forces(self, P: Floats) -> Floats:
        """Return the corner forces (8, 3), N, of a nominal stress P (3, 3), Pa: a quarter of each face force."""
        found: Floats = (2.0 * CORNERS - 1.0) * (0.25 * self.areas) @ P.T
        return found

    def holders(self) -> tuple[SupportedNodes, ...]:
        """Return the corners that each support holds."""
        held = collect_imposed_on_faces(self.case, "").held
        found = []
        for support in self.case.supports:
            mask = np.zeros((8, 6), dtype=np.bool_)
            on = self.selected_corner_mask(support.thing.where)
            for (axis, side), component in held:
                face = CORNERS[:, axis] == side
                if component in support.thing.components and np.all(on[face]):
                    mask[face, component] = True
            found.append(SupportedNodes(support.name, mask, np.asarray(mask.any(axis=1), dtype=np.float64)))
        return tuple(found)


@dataclass(frozen=True)
class PreparedPoint(Meshless):
    """Material point, with the deformation and stress that supports and loads impose."""

    declared: Declared
    case: Case
    made: ImposedState
    point: MaterialPoint
    block: Block

    @property
    def size(self) -> dict[str, int]:
        """Number of points: 1."""
        return {"nodes": 1, "elements": 1, "dofs": sum(s is None for s in self.made.stretches)}

    @property
    def points(self) -> Floats:
        """Points at which loads act: the undeformed corners of the body (8, 3), m."""
        return self.block.X

    def forces(self) -> Sequence[tuple[Declared, Floats]]:
        """Return each load with its forces at the corners (8, 3), N."""
        return [(load, self._traction_corner_forces(load)) for load in self.case.loads]

    def _traction_corner_forces(self, load: Declared) -> Floats:
        """Return the forces of a traction at the corners (8, 3), N: a quarter of its force at each corner of a face."""
        found, action = np.zeros((8, 3)), load.thing.action
        on = self.block.selected_corner_mask(action.where)
        for axis in range(3):
            for side in (0, 1):
                face = CORNERS[:, axis] == side
                if np.all(on[face]):
                    found[face] += 0.25 * self.block.areas[axis] * np.array(action.traction)
        return found

    @cached_property
    def drive(self) -> ImposedDeformation:
        """Imposed deformation and stress as arrays."""
        made = self.made
        stretches = np.array([np.nan if s is None else s for s in made.stretches])
        relieved = 2 if made.shear is None else 3 - made.shear[0] - made.shear[1]
        return ImposedDeformation(stretches, np.array(made.stresses), made.shear, made.driven, relieved)

    def solve(self, watch: Watch) -> Solution:
        """Return the state of the material point as a solution."""
        try:
            found = self.point.state(self.drive, self.case.analysis.max_iterations)
        except NoState as none:
            return Solution(
                "not_converged", self._no_state_message(none), {"iterations": 0, "steps": 0, "residual": None}
            )
        if (turned := self._shear_stress_message(found)) is not None:
            return Solution("not_converged", turned, {"iterations": found.iterations, "steps": 0, "residual": None})
        facts = {
            "iterations": found.iterations,
            "steps": 1,
            "residual": self._relative_residual(found),
            "linear_solver": "dense",
            "stable": bool(found.freed > FLAT),
            "stretches": found.F.diagonal().tolist(),
            "volume": found.volume,
            "nominal_stress": found.P.tolist(),
            "stiffness": {"held": _finite(found.held), "freed": _finite(found.freed)},
        }
        displacement = _HomogeneousDisplacement(found.F, np.array(self.made.anchors), np.array(self.made.shifts))
        stress: Stresses = HomogeneousStress(found, self.point.linear)  # type: ignore[assignment]
        return Solution("converged", None, facts, displacement, self._stability_warnings(found), stress=lambda: stress,
                        carried=cache(lambda: self._nodal_forces(found, displacement)))  # fmt: skip

    def _shear_stress_message(self, found: PointState) -> str | None:
        """Return an error message if the law has shear stress although strain is along the axes; else None."""
        across = np.abs(found.P - np.diag(found.P.diagonal())).max()
        if self.made.shear is not None or across <= ALONG * np.abs(found.P).max():
            return None
        shear = units.format_value(float(across), units.PRESSURE)
        return (
            f"its law has a shear stress of {shear} in this state, since its material axes are oblique "
            "to the coordinate axes: use `fem`"
        )

    def _relative_residual(self, found: PointState) -> float:
        """Return the residual force on the free faces, relative to the largest force on a face."""
        free = [axis for axis in range(3) if self.made.stretches[axis] is None]
        left = [abs(found.P[a, a] - self.made.stresses[a]) * self.block.areas[a] for a in free]
        largest = float((np.abs(found.P) * self.block.areas).max())
        return float(max(left, default=0.0)) / largest if largest else 0.0

    def _nodal_forces(self, found: PointState, displacement: _HomogeneousDisplacement) -> NodalForces:
        X, u = self.block.X, displacement(self.block.X)
        none, loads = np.zeros((8, 3)), {load.name: f for load, f in self.forces()}
        left = self.block.forces(found.P) - sum(loads.values(), none)
        work = {name: float((f * u).sum()) for name, f in loads.items()}
        wide = {name: np.hstack([f, none]) for name, f in loads.items()}
        x = X if self.point.linear else X + u
        return NodalForces(X, u, x, np.hstack([left, none]), wide, self.block.volume * found.psi, work,
                       holders=self.block.holders())  # fmt: skip

    # ------------------------------------------------------------------ what is said of it

    def _stability_warnings(self, found: PointState) -> tuple[Diagnostic, ...]:
        """Return warnings if the force decreases with stretch, or the law violates Drucker's stability postulate."""
        if self.point.linear:
            return ()
        return (*self._force_maximum_warnings(found), *self._drucker_warnings(found))

    def _drucker_warnings(self, found: PointState) -> tuple[Diagnostic, ...]:
        """Return a warning if the state violates Drucker's stability postulate."""
        if found.volume > getattr(self.case.material, "convex_above", math.inf) or self.point.is_drucker_stable(found):
            return ()
        at = self.point.first_drucker_unstable_state(self.drive)
        return (
            diagnostic(
                "W385",
                self.declared.at("state"),
                f"`{self.declared.name}` is beyond a {self._deformation_word} of {self._format_deformation(at)}, where "
                "its law violates Drucker's stability",
                "stress decreases as strain increases",
                "this compares Kirchhoff stress with Hencky strain; the body may have several "
                "equilibria: use constants fitted at such strains, or another law",
            ),
        )

    def _force_maximum_warnings(self, found: PointState) -> tuple[Diagnostic, ...]:
        """Return a warning if the stretch is beyond the maximum of the force."""
        if found.freed > FLAT:
            return ()
        at = self.point.first_unstable_state(self.drive)
        what = f"a {self._deformation_word} of {self._format_deformation(at)}"
        a = self.made.driven[0]
        b = a if self.made.shear is None else self.made.shear[1]
        force = units.format_value(float(at.P[a, b]), units.PRESSURE)
        return (
            diagnostic(
                "W366",
                self.declared.at("state"),
                f"`{self.declared.name}` is beyond the stability limit of its law, {what}: a nominal stress of {force} "
                "deforms it without limit",
                "unstable under an imposed force",
                "this state exists only with imposed displacements; a real body localizes there",
            ),
        )

    @property
    def _deformation_word(self) -> str:
        return "stretch" if self.made.shear is None else "shear"

    def _format_deformation(self, at: PointState) -> str:
        a = self.made.driven[0]
        return f"{at.F[a, a if self.made.shear is None else self.made.shear[1]]:.4g}"

    def _no_state_message(self, none: NoState) -> str:
        """Return the message why the law has no state for the imposed deformation."""
        axes = ", ".join(f"{NAMES[i]} {s:.4g}" for i, s in enumerate(none.stretches))
        why = "the law ends there, or becomes unstable transversely"
        if any(self.made.stresses):
            peak = none.share > 0.0 and self.point.state(self.drive.at(none.share)).freed < PEAK
            why = (
                "the force has its maximum there"
                if peak
                else "the force increases there, but less than 0.1 % of it per step"
            )
        return (
            f"the law has no state beyond {100.0 * none.share:.3g} % of the imposed loading, at "
            f"stretches of {axes}: {why}"
        )


def _finite(value: float) -> float | None:
    return value if np.isfinite(value) else None


@dataclass(frozen=True)
class _HomogeneousDisplacement:
    """Homogeneous displacement field: deformation gradient F about an anchor point, and displacement of the anchor."""

    F: Floats
    anchor: Floats
    shift: Floats

    def __call__(self, X: Floats) -> Floats:
        """Return the displacements (n, 3), m, of points X (n, 3), m."""
        found: Floats = (X - self.anchor) @ (self.F - np.eye(3)).T + self.shift
        return found


@dataclass(frozen=True)
class HomogeneousStress(AnalyticField):
    """Homogeneous stress field of the material point."""

    state: PointState
    small: bool

    @cached_property
    def _tensors(self) -> Tensors:
        F, P = self.state.F, self.state.P
        sigma = P if self.small else P @ F.T / np.linalg.det(F)
        six = np.array([[0.5 * (sigma[i, j] + sigma[j, i]) for i, j in SYMMETRIC]])
        return Tensors(six, (F - np.eye(3)).reshape(1, 9), self.small)

    def at(self, X: Floats) -> Tensors:
        """Return stress and deformation at points X (n, 3), m, of the undeformed body."""
        one = self._tensors
        return Tensors(np.tile(one.six, (len(X), 1)), np.tile(one.H, (len(X), 1)), self.small)

    @property
    def usual(self) -> tuple[float, float, float]:
        """Norms of stress, Pa, of Green strain, and of deviatoric stress, Pa."""
        one = self._tensors
        deviator = float(von_mises(one.cauchy)[0]) / 1.5**0.5
        return float(tensor_norm(one.six)[0]), float(np.linalg.norm(one.strain("green"))), deviator


def load(model: Homogeneous) -> None:
    """Do nothing, because importing this module has already imported all libraries that `prepare` needs."""


def prepare(model: Homogeneous, declared: Declared, case: Case, workshop: BuildContext) -> Prepared:
    """Build a material point with the deformation that supports and loads impose. Raises Fault."""
    return PreparedPoint(
        declared,
        case,
        imposed_state(case, model.state, declared),
        build_material_point(case, model.strain),
        Block(case),
    )


def build_material_point(case: Case, strain: str) -> MaterialPoint:
    """Return the material point of a body's material."""
    material = case.material
    if not material.incompressible:
        return MaterialPoint(law_for(material, strain), None, strain == "small")
    split = mixed_for(material, strain)
    assert split is not None
    return MaterialPoint(split.shape, split.constraint, strain == "small")
