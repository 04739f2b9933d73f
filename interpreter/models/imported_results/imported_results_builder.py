"""Construction of models from imported displacements: reading, matching to the body, and warnings."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language import units
from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.models.imported_results.imported_results_declaration import Results
from softmark.interpreter.models.imported_results.matching_error import Unmatched
from softmark.interpreter.models.imported_results.missing_points import find_missing_points
from softmark.interpreter.models.imported_results.point_matching import POSITION, Floats, MatchedResults, match_points
from softmark.interpreter.models.imported_results.readers import read
from softmark.interpreter.models.imported_results.readers.result_frames import describe_count
from softmark.interpreter.models.imported_results.result_file import ResultFile
from softmark.interpreter.models.imported_results.support_compliance import (
    check_supports,
    compliance_warnings,
    displacement_warnings,
)
from softmark.interpreter.models.shared.deformed_mesh import DeformedBody
from softmark.interpreter.models.shared.prepared_model import BuildContext, Meshless, Prepared, Solution
from softmark.interpreter.problem.body_case import Case, Fault, fault
from softmark.interpreter.problem.data_sets import download_shape
from softmark.interpreter.problem.probe_points import ProbePoints, drawn_surface
from softmark.interpreter.results.motion_history import History
from softmark.interpreter.vocabulary.analysis_words import Dynamic, InState, Quasistatic
from softmark.records import dataclass
from softmark.references.measured_data import Unreadable

if TYPE_CHECKING:
    from softmark.solvers.mesh.mesh import Mesh
    from softmark.solvers.statics.static_equilibrium import Watch

WITHIN = 0.01  # of the diagonal of a body: how far it may lie outside the file's points
SIMILAR = 0.05  # of a volume: larger differences are reported
MOVES = 0.01  # of the largest displacement: a smaller one at the start counts as none
FEW, GAP = 4, 3.0  # smallest number of times that define a usual step; ratio to it from which times seem to be missing
SAME = 1e-6  # relative: nearer times or states count as equal
FACTORS = (1e-3, 1e-2, 0.0254, 0.1, 1.0, 10.0, 100.0, 1e3)  # ratios of units of length
NEAR = 0.05  # relative tolerance of such a ratio
ROW = "add a row for each point of a probe"
ROUGH, CLOSER = 1e-3, 0.1  # of the diagonal: largest misfit of another unit; factor by which its misfit must be smaller
MOVED = (
    "its points already include the displacements: points minus displacements match the body",
    'use the deformed points: write `at = "position"` and `rest`, a file with the undeformed points',
)


@dataclass(frozen=True)
class PreparedResults(Meshless):
    """Displacements of a body read from a file: `u` (t, n, 3), m, of the file's points at `times` (t,), s.

    In a static analysis, `u` has one state. In a dynamic analysis, its last state is that at the end of the motion.
    `body` (b, 3), m, are points of the body's surface.
    """

    declared: Declared
    case: Case
    found: MatchedResults
    body: Floats
    times: Floats | None
    u: Floats
    facts: dict[str, Any]
    doubts: tuple[Diagnostic, ...]

    @property
    def notes(self) -> tuple[Diagnostic, ...]:
        """Warnings about the file and how it matches the body."""
        return self.doubts

    @property
    def size(self) -> dict[str, int]:
        """Numbers of points and cells of the file; there are no unknowns."""
        return {"nodes": len(self.found.X), "elements": 0 if self.found.mesh is None else len(self.found.mesh.cells)}

    @property
    def points(self) -> Floats:
        """Points at which loads act: none."""
        return np.zeros((0, 3))

    def forces(self) -> Sequence[tuple[Declared, Floats]]:
        """Return no loads, because nothing is solved."""
        return []

    def outside(self, X: Floats) -> float:
        """Return the largest distance, m, by which points X (n, 3), m, lie outside the file's points.

        Distances within the tolerance count as 0. Raises Fault if displacements are known only at the points of the
        file and X has other points.
        """
        far = float(self.found.outside(X).max(initial=0.0))
        if far > 0.0 and not self.found.can_interpolate:
            away = f"a probe is {units.format_value(far, units.LENGTH)} away from them"
            if self.found.wired:
                raise _unmatched_fault(
                    self.declared, Unmatched(f"rods are not interpolated between points of the file, and {away}", ROW)
                )
            raise _unmatched_fault(
                self.declared, Unmatched(f"its points span no volume, and {away}", f"{ROW}, or a mesh")
            )
        return far if far > _matching_tolerance(self.declared.thing, self.body) else 0.0

    def solve(self, watch: Watch) -> Solution:
        """Return the displacements of the file as a solution."""
        found, last = self.found, self.u[-1:]
        history = frames = None
        if self.times is not None:
            step = float(np.diff(self.times).max(initial=0.0))
            history, frames = History(self.times, lambda X: found.at(X, self.u), (), (), step), self.u
        mesh = None if found.mesh is None else DeformedBody(found.mesh, last[0], self.times, frames)

        def displacement(X: Floats) -> Floats:
            """Return the displacements (n, 3), m, of material points X (n, 3), m, at the end."""
            moved: Floats = found.at(X, last)[0]
            return moved

        return Solution("read", None, {"match": self.facts}, displacement, history=history, mesh=mesh)


def load(model: Results) -> None:
    """Do nothing, because importing this module has already imported all libraries that `prepare` needs."""


def prepare(model: Results, declared: Declared, case: Case, workshop: BuildContext) -> Prepared:
    """Read the file and match it to the body. Raises Fault."""
    key = ("results", model.path, model.at, model.rest, model.unit, model.time, model.by, case.body.name)
    if key not in workshop.meshes:
        workshop.meshes[key] = _match_file_to_body(model, declared, case)
    found, told = workshop.meshes[key]
    times, u, said = _times_and_displacements(declared, case, found)
    if ("drawn", case.body.name) not in workshop.meshes:
        workshop.meshes["drawn", case.body.name] = drawn_surface(case)
    place = workshop.meshes["drawn", case.body.name]
    if (*key, model.within) not in workshop.meshes:
        workshop.meshes[*key, model.within] = _compare_with_body(model, declared, case, place, found)
    fits, notes = workshop.meshes[*key, model.within]
    each, most = check_supports(case, place, found, u[-1]), float(np.linalg.norm(u[-1], axis=1).max())
    notes = (
        *notes,
        *_time_gap_warnings(declared, times),
        *_start_warning(declared, times, u),
        *compliance_warnings(declared, case, each, most),
    )
    notes = (*notes, *displacement_warnings(declared, case, place, most))
    strays = {own.support.name: own.far for own in each}
    facts = {"field": found.name, **said, **fits, "supports": strays, "unused": _unused_content(told, case)}
    return PreparedResults(declared, case, found, place.X, times, u, facts, notes)


def _read(declared: Declared, field: str) -> ResultFile:
    """Return the content of the file that a field names. Raises Fault."""
    try:
        return read(Path(getattr(declared.thing, field)))
    except Unreadable as error:
        at = declared.at(field)
        raise fault("E700", at, f"{error.name}: {error.reason}", "cannot be used", error.remedy) from None


def _match_file_to_body(model: Results, declared: Declared, case: Case) -> tuple[MatchedResults, ResultFile]:
    """Return the result file matched to the body, and the content of the file. Raises Fault."""
    told, rest = _read(declared, "path"), _read(declared, "rest") if model.rest else None
    nodes: Mesh | None = (
        download_shape(case.shape, declared.at("by")).mesh_with_groups() if model.by == "nodes" else None
    )
    try:
        depth = case.body.thing.thickness if case.planar else None
        return match_points(told, model.at, rest, model.unit, model.time, nodes, depth, case.shape.wired), told
    except Unmatched as error:
        raise _unmatched_fault(declared, error) from None


def _unmatched_fault(declared: Declared, error: Unmatched) -> Fault:
    """Return the Fault for a result file whose points cannot be matched to the body."""
    at = declared.at("at") if "at" in declared.fields else declared.at("path")
    return fault("E701", at, f"{Path(declared.thing.path).name}: {error.reason}", "cannot be used", error.remedy)


def _unused_content(told: ResultFile, case: Case) -> list[str]:
    """Return descriptions of the file's content that is not used, such as plane cells for a solid body."""
    seen = describe_count(len(told.flat[1]), told.flat[0]) if told.flat and case.planar else ""
    return [word for word in told.left if word != seen]


# ------------------------------------------------------------------ which of its times


def _times_and_displacements(
    declared: Declared, case: Case, found: MatchedResults
) -> tuple[Floats | None, Floats, dict[str, Any]]:
    """Return the times of a motion (t,), s, the requested displacements (t, n, 3), m, and a report. Raises Fault.

    Times are None for a static analysis.
    """
    count, times, analysis = len(found.u), found.times, case.analysis
    said = {"times": count, "first": _time_at_index(times, 0), "last": _time_at_index(times, -1)}
    if isinstance(analysis, Dynamic):
        return *_interpolate_to_duration(declared, found, analysis.duration), said
    at = analysis.at if isinstance(analysis, InState) else analysis.now if isinstance(analysis, Quasistatic) else None
    if at is None:
        return None, found.u[-1:], said
    near = None if times is None else np.flatnonzero(np.abs(times - at) <= SAME * max(1.0, abs(at)))
    if near is not None and len(near):
        return None, found.u[near[:1]], said | {"state": at}
    of = "time" if isinstance(analysis, Quasistatic) else "state"
    shown = units.format_value(at, units.TIME) if of == "time" else f"{100 * at:.6g} %"
    has = "it has no times" if times is None else f"it has {count}, from {times[0]:.6g} to {times[-1]:.6g}"
    remedy = "write a series (.pvd) with one entry for each state, or remove `states` from the analysis"
    if of == "time":
        remedy = "write a series (.pvd) with an entry for each requested time, and its unit, `time = 1 ms`"
    at_file = declared.at("path")
    raise fault(
        "E703", at_file, f"{Path(declared.thing.path).name} has no displacements for the {of} {shown}", has, remedy
    )


def _interpolate_to_duration(declared: Declared, found: MatchedResults, duration: float) -> tuple[Floats, Floats]:
    """Return times (t,), s, and displacements (t, n, 3), m, up to the end of a motion. Raises Fault.

    The last state is interpolated linearly at the `duration`, s.
    """
    times, name = found.times, Path(declared.thing.path).name
    if times is None or len(times) < 2:
        raise fault(
            "E703",
            declared.at("path"),
            f"{name} has no time history",
            "fewer than two times",
            "write a series (.pvd), or a table with a column of times",
        )
    step = float(np.diff(times).max())
    if abs(times[0]) > SAME * duration or times[-1] < duration - SAME * duration:
        begin, end_time = (units.format_value(float(times[i]), units.TIME) for i in (0, -1))
        span = f"from {begin} to {end_time}"
        raise fault("E703", declared.at("path"), f"{name} covers the motion {span}",
                    f"needed: 0 to {units.format_value(duration, units.TIME)}",
                    "write `time = 1 ms` if that is the unit of its times; otherwise write the whole "
                    "motion, from rest on")  # fmt: skip
    last = int(np.searchsorted(times, duration - SAME * step))
    if times[last] <= duration + SAME * step:
        return times[: last + 1], found.u[: last + 1]
    share = (duration - times[last - 1]) / (times[last] - times[last - 1])
    end = (1.0 - share) * found.u[last - 1] + share * found.u[last]
    return np.append(times[:last], duration), np.concatenate([found.u[:last], end[None]])


def _time_gap_warnings(declared: Declared, times: Floats | None) -> Iterator[Diagnostic]:
    """Yield a warning if a gap between the times (t,), s, of a motion is much longer than its usual time step."""
    if times is None or len(times) < FEW:
        return
    steps = np.diff(times)
    usual, i = float(np.median(steps)), int(np.argmax(steps))
    if steps[i] > GAP * usual:
        start, end = (units.format_value(float(t), units.TIME) for t in times[i : i + 2])
        yield diagnostic("W701", declared.at("path"), f"{Path(declared.thing.path).name} has no "
                                                      f"displacements between {start} and {end}, a gap of "
                                                      f"{steps[i] / usual:.3g} times its usual step", "missing times?",
                         "displacements are interpolated linearly in the gap: write all times")  # fmt: skip


def _start_warning(declared: Declared, times: Floats | None, u: Floats) -> Iterator[Diagnostic]:
    """Yield a warning if the first state of displacements u (t, n, 3), m, of a motion is not undeformed."""
    if times is None:
        return
    start, most = (float(np.linalg.norm(own, axis=-1).max()) for own in (u[0], u))
    if start > MOVES * most:
        by, name = units.format_value(start, units.LENGTH), Path(declared.thing.path).name
        problem = f"{name} displaces `{declared.name}` by {by} at 0 s, but a motion starts undeformed"
        remedy = "write the motion from its first time on"
        yield diagnostic("W701", declared.at("path"), problem, "missing times?", remedy)


def _time_at_index(times: Floats | None, which: int) -> float | None:
    return None if times is None else float(times[which])


# ------------------------------------------------------------------ how well it fits


def _diagonal(X: Floats) -> float:
    """Return the diagonal of the bounding box of points X (n, 3), m."""
    return float(np.linalg.norm(np.ptp(X, axis=0)))


def _matching_tolerance(model: Any, body: Floats) -> float:
    within: float | None = model.within
    return WITHIN * _diagonal(body) if within is None else within


def _compare_with_body(
    model: Results, declared: Declared, case: Case, place: ProbePoints, found: MatchedResults
) -> tuple[dict[str, Any], tuple[Diagnostic, ...]]:
    """Return a report of how the file matches the body, and warnings about differences. Raises Fault.

    `place` has points of the body.
    """
    X = place.X
    try:
        far, beyond = _one_sided_distances(found, X)
        most = max(far, beyond)
        if most > ROUGH * _diagonal(X) and found.name != POSITION:
            rest = replace(found, X=found.X - found.u[-1], mesh=None)
            if max(_one_sided_distances(rest, X)) < CLOSER * most:
                raise _unmatched_fault(declared, Unmatched(*MOVED))
    except Unmatched as error:
        raise _unmatched_fault(declared, error) from None
    if most > _matching_tolerance(model, X):
        raise Fault(_outside_error(model, declared, case, found, X, most))
    told = {"outside": far, "beyond": beyond, "volume": None}
    whole = case.shape.volume
    if found.mesh is None:
        facts, notes = find_missing_points(declared, case, place, found)
        return told | facts, notes
    if not whole:
        return told, ()
    share = float(found.mesh.volumes.sum()) / whole
    told["volume"] = share
    if abs(share - 1.0) <= SIMILAR:
        return told, ()
    note = diagnostic(
        "W700",
        declared.at("path"),
        f"the mesh of `{declared.name}` has {100 * share:.3g} % of the volume of `{case.body.name}`",
        "different body?",
        "on a coarse mesh of this body this is a discretization error; results of another body need another scene",
    )
    return told, (note,)


def _one_sided_distances(found: MatchedResults, body: Floats) -> tuple[float, float]:
    """Return the largest distance, m, of the body's surface outside the file's points, and vice versa.

    `body` (n, 3), m, are points of the surface; file points are compared with its bounding box. Both distances are zero
    for a table along a line or on a surface, which need not cover the body: its probes are evaluated at its points.
    """
    low, high = body.min(axis=0), body.max(axis=0)
    beyond = float(np.maximum(low - found.X, found.X - high)[:, : found.spatial_dimension].max())
    far = float(found.outside(body).max(initial=0.0)) if found.can_interpolate else 0.0
    return far, max(0.0, beyond)


def _outside_error(
    model: Results, declared: Declared, case: Case, found: MatchedResults, body: Floats, most: float
) -> Diagnostic:
    """Return the error for a body that extends beyond the file's points; it names a unit that would fit, if any."""
    spans = (" x ".join(units.format_value(float(s), units.LENGTH) for s in np.ptp(X, axis=0)) for X in (found.X, body))
    ratio = _diagonal(body) / found.extent if found.extent else 0.0
    factor = next((f for f in FACTORS if f != 1.0 and abs(ratio / f - 1.0) <= NEAR), None)
    remedy = "use results of the same body at the same position, or increase `within`"
    if factor is not None:
        unit = units.format_value(model.unit * factor, units.LENGTH)
        remedy = f"wrong unit? write `unit = {unit}`, which gives the size of the body"
    return diagnostic(
        "E702", declared.at("unit") if factor is not None else declared.at("path"),
        f"{Path(model.path).name} does not cover `{case.body.name}`: their boundaries differ by up to "
        f"{units.format_value(most, units.LENGTH)}",
        "its points span {}, the body {}".format(*spans), remedy,
    )  # fmt: skip
