"""Rounding error of an answer, from the condition number of the stiffness or from forces and coordinates."""

from __future__ import annotations

import math

import numpy as np

from softmark.interpreter.models.shared.material_regions import representative_materials
from softmark.interpreter.models.shared.prepared_model import DeformedMesh
from softmark.interpreter.problem.body_case import Case
from softmark.interpreter.results.run_report import ModelResult
from softmark.interpreter.verification.frequency_errors import FrequencyUnderTest
from softmark.interpreter.verification.grid_convergence import COARSE
from softmark.interpreter.verification.probe_errors import Floats, NoErrorEstimate, ProbeResultUnderTest

EPS = float(np.finfo(np.float64).eps)
USUAL = 1e6 * EPS  # what rounding does at least where the stiffness was not looked at: a condition number of 1e6
LOST = 1e-6  # of a cell that the rounding of coordinates may take: with more, nobody knows what it does


def rounding_error(
    result: ModelResult, case: Case, mesh: DeformedMesh | None, cells: int, seen: ProbeResultUnderTest
) -> float:
    """Return the rounding error in the metric's unit. Raises NoErrorEstimate."""
    facts, (far, cell) = result.solve, _largest_coordinate_and_shortest_side(case, mesh, cells, seen)
    if EPS * far > LOST * cell:
        raise NoErrorEstimate(
            f"the body is so far from the origin that rounding errors reach {EPS * far / cell:.1g} of a cell"
        )
    if isinstance(seen, FrequencyUnderTest):
        return seen.lost(representative_materials(case, None if mesh is None else mesh.mesh), far, cell)
    if facts.get("rounding") is not None:
        return float(facts["rounding"]) * seen.acting
    if facts.get("condition") is not None:
        return 10.0 * EPS * float(facts["condition"]) * seen.acting
    checks = facts.get("checks") or {}
    # differences of coordinates along a cell, of which strain is a part
    strain = float(checks.get("largest_strain") or 0.0)
    strain = strain or float(np.abs(seen.u).max(initial=0.0)) / _extent(case, mesh, seen)
    strain = max(strain, _free_muscle_strain(case, mesh))
    lost = EPS * far / (cell * strain) if strain > 0.0 else math.inf
    found = 10.0 * (max(USUAL, float(checks.get("rounding") or 0.0)) + lost)
    if not found <= COARSE:
        raise NoErrorEstimate(
            "displacements are so small compared with the coordinates that strains may be rounding error only"
        )
    return found * seen.acting


def _free_muscle_strain(case: Case, mesh: DeformedMesh | None) -> float:
    """Return the strain that active muscle would cause in an unsupported body; 0 without muscle."""
    if not any(hasattr(material, "passive") for material in case.materials):
        return 0.0
    known = [m for m in representative_materials(case, None if mesh is None else mesh.mesh) if hasattr(m, "passive")]
    return max(float(abs(m.activation_value)) / (3.0 * m.shear_modulus if m.pulls else 1.0) for m in known)


def _points(case: Case, mesh: DeformedMesh | None, seen: ProbeResultUnderTest) -> Floats:
    """Return the points of the mesh (n, 3), m; without a mesh those of the probe, or the ends of the body."""
    if mesh is not None and len(mesh.points):
        return mesh.points
    if len(seen.X) or not (case.shape.swept or case.shape.wired):
        return seen.X
    if (along := case.shape.swept) is not None:
        return np.array([along.centre(0.0), along.centre(along.length)])
    return np.array(case.shape.bounds)


def _extent(case: Case, mesh: DeformedMesh | None, seen: ProbeResultUnderTest) -> float:
    """Return the extent of the body, m."""
    bounds = np.ptp(_points(case, mesh, seen), axis=0).max()
    return float(bounds) or (along.length if (along := case.shape.swept) is not None else 0.0) or 1.0


def _largest_coordinate_and_shortest_side(
    case: Case, mesh: DeformedMesh | None, count: int, seen: ProbeResultUnderTest
) -> tuple[float, float]:
    """Return the largest coordinate, before or after deformation, and the shortest cell side, m."""
    points, cells = _points(case, mesh, seen), None if mesh is None else mesh.cells
    far = float(np.abs(points).max() + np.abs(seen.u).max(initial=0.0))
    if cells is not None and len(cells) and points is not seen.X:
        corners = points[np.asarray(cells)]  # (m, a, 3)
        sides = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
        return far, float(sides.min()) or math.ulp(0.0)
    return far, _extent(case, mesh, seen) / count
