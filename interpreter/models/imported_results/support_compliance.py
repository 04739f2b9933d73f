"""Checks that imported results comply with the supports: held points stay, others move as prescribed.

The checks use points of the body's surface that a support selects and whose displacements are interpolated only
from file points that the support also selects. This is necessary because cells of another mesh may be held in
part at the border of a selection.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language import units
from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.language.coordinate_conditions import Condition
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.models.imported_results.point_matching import Floats, MatchedResults
from softmark.interpreter.problem.body_case import Case
from softmark.interpreter.problem.probe_points import ProbePoints, surface_points
from softmark.interpreter.problem.surface_selection.selected_pieces import selected_points
from softmark.interpreter.vocabulary.analysis_words import Dynamic
from softmark.records import dataclass

SLIPS = 0.01  # of the largest displacement: deviation from a support that reading a file may cause
ROUND = 1e-4  # of the diagonal: file points so near to a selection belong to it, within their printed digits
BESIDE = 1e-3  # largest interpolation weight of points that the support does not select
VAST = 10.0  # times the size of a static body: a larger displacement is suspicious
ANOTHER = (
    "if the displacements have another unit than the lengths, write both in one unit, or write "
    'positions, `at = "position"`'
)
POWER = 0.1  # tolerance, relative to a power of ten


@dataclass(frozen=True)
class SupportCompliance:
    """Deviation of imported displacements from the prescribed displacements of one support.

    `far`, m, is the largest deviation from the prescribed displacements, and `told`, m, the largest prescribed
    displacement. `times` is the ratio of found to prescribed displacements, by least squares.
    """

    support: Declared
    far: float
    told: float
    times: float


def check_supports(case: Case, place: ProbePoints, found: MatchedResults, u: Floats) -> list[SupportCompliance]:
    """Return the compliance with each support that can be checked, from displacements u (n, 3), m, at the end."""
    return list(_support_compliances(case, place, found, u)) if found.can_interpolate else []


def _support_compliances(
    case: Case, place: ProbePoints, found: MatchedResults, u: Floats
) -> Iterator[SupportCompliance]:
    """Yield the compliance with each support that can be checked."""
    for support in case.named_supports:
        thing = support.thing
        along = [c for c in thing.components if c < found.spatial_dimension]
        if thing.tracked or not along:
            continue
        X = surface_points(case, place, thing.where)
        X = X[_fully_interpolated(found, thing.where, X)]
        if len(X):
            told = thing.prescribed_displacements(X, _final_amplitude(case, thing))[:, along]
            seen = found.at(X, u[None])[0][:, along]
            square = float(np.sum(told**2))
            yield SupportCompliance(
                support,
                _largest_magnitude(seen - told),
                _largest_magnitude(told),
                float(np.sum(seen * told)) / square if square else 1.0,
            )


def _largest_magnitude(u: Floats) -> float:
    """Return the largest magnitude of displacements u (n, 3), m."""
    return float(np.linalg.norm(u, axis=1).max(initial=0.0))


def _final_amplitude(case: Case, thing: Any) -> float:
    """Return the fraction of its full motion that a support has at the end of the analysis.

    It is 1 in an analysis with states, whose supports are scaled already.
    """
    if not isinstance(case.analysis, Dynamic) or thing.amplitude is None:
        return 1.0
    return float(thing.amplitude.at(case.analysis.duration))


def _fully_interpolated(found: MatchedResults, where: Condition, X: Floats) -> NDArray[np.bool_]:
    """Return a mask (k,) of the points X (k, 3), m, that are interpolated only from points of the support.

    `where` is the condition that selects the points of the support.
    """
    which, share = found.places(X)[:2]
    if not len(X):
        return np.zeros(0, dtype=np.bool_)
    if where.groups:
        from scipy.spatial import cKDTree

        held = cKDTree(X).query(found.X)[0] <= ROUND * found.extent
    else:
        ways = ROUND * found.extent * np.concatenate([np.zeros((1, 3)), np.eye(3), -np.eye(3)])
        held = np.any([selected_points(where, found.X + way, found.extent) for way in ways], axis=0)
    certain: NDArray[np.bool_] = np.abs(np.where(held[which], 0.0, share)).sum(axis=1) <= BESIDE
    return certain


def compliance_warnings(
    declared: Declared, case: Case, each: list[SupportCompliance], most: float
) -> Iterator[Diagnostic]:
    """Yield a warning for each support that the results violate; `most`, m, is their largest displacement."""
    for own in each:
        if own.far <= SLIPS * max(most, own.told):
            continue
        file, body, name = Path(declared.thing.path).name, case.body.name, own.support.name
        far, told = units.format_value(own.far, units.LENGTH), units.format_value(own.told, units.LENGTH)
        remedy = (
            "check the supports of the solved problem: the largest displacement is "
            f"{units.format_value(most, units.LENGTH)}"
        )
        problem, label = f"{file} moves `{body}` by {far} where `{name}` holds it", "different supports?"
        if own.told:
            problem = f"{file} deviates by up to {far} where `{name}` moves `{body}` by {told}"
            remedy = f"check the supports of the solved problem: the file moves it {own.times:.3g} times as far there"
            if _is_near_power_of_ten(own.times):
                label = "wrong unit?"
                remedy = f"the file moves it {own.times:.3g} times as far there: {ANOTHER}"
        yield diagnostic("W703", declared.at("path"), problem, label, remedy)


def displacement_warnings(declared: Declared, case: Case, place: ProbePoints, most: float) -> Iterator[Diagnostic]:
    """Yield a warning if the largest displacement `most`, m, of a static body is many times its size."""
    size = float(np.linalg.norm(np.ptp(place.X, axis=0)))
    if not isinstance(case.analysis, Dynamic) and most > VAST * size:
        problem = (
            f"{Path(declared.thing.path).name} moves `{case.body.name}` by "
            f"{units.format_value(most, units.LENGTH)}, which is {most / size:.3g} times its diagonal"
        )
        yield diagnostic("W704", declared.at("unit"), problem, "wrong unit?", ANOTHER)


def _is_near_power_of_ten(times: float) -> bool:
    """Return whether a ratio is near a power of ten, which suggests a wrong unit of length."""
    if times <= 0.0 or not (power := round(math.log10(times))):
        return False
    return abs(times / 10.0**power - 1.0) <= POWER
