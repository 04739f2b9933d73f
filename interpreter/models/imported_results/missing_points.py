"""Detection of points that seem to be missing in a table without cells, whose displacements are interpolated."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language import units
from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.models.imported_results.point_matching import MatchedResults
from softmark.interpreter.problem.body_case import Case
from softmark.interpreter.problem.data_sets import download_shape
from softmark.interpreter.problem.probe_points import ProbePoints, points_throughout
from softmark.solvers.mesh.shapes import MeshFile

HOLE = 3.0  # times the typical distance: at larger distances points seem to be missing
SAME = 1e-4  # of the extent: a row so near to a node belongs to the node, within its printed digits
MOST = 0.5  # fraction of nodes with rows from which the table counts as one of nodes
WRITE = "displacements are interpolated linearly there: write all points, or a file with cells"


def find_missing_points(
    declared: Declared, case: Case, place: ProbePoints, found: MatchedResults
) -> tuple[dict[str, Any], tuple[Diagnostic, ...]]:
    """Return a report and the warning W702 about points that seem to be missing in a table of results.

    The report has the largest distance of a place in the body from the nearest row, `between`, m; the usual
    distance between rows, `usual`, m; and the number of mesh nodes without a row, `lacks`, None if the body has
    no mesh file. Both distances are zero for a table along a line or on a surface, which need not cover the body.
    """
    if not found.can_interpolate or len(found.X) < 2:
        return {"between": 0.0, "usual": 0.0, "lacks": None}, ()
    hole, usual = float(found.nearest_point_distances(points_throughout(case, place)).max(initial=0.0)), found.usual
    file = Path(declared.thing.path).name
    told = {"between": hole, "usual": usual, "lacks": None}
    if isinstance(shape := download_shape(case.shape, case.shape_location), MeshFile):
        off = found.nearest_point_distances(shape.points())
        none = off > SAME * found.extent
        told["lacks"] = int(none.sum())
        if 0.0 < none.mean() <= 1.0 - MOST:
            away = units.format_value(float(off.max()), units.LENGTH)
            problem = (
                f"{file} has no row for {none.sum()} of the {len(none)} nodes of `{case.body.name}` "
                f"({100 * none.mean():.3g} %): the farthest node is {away} from the nearest row"
            )
            return told, (diagnostic("W702", declared.at("path"), problem, "missing points?", WRITE),)
    if hole <= HOLE * usual:
        return told, ()
    away, near = (units.format_value(v, units.LENGTH) for v in (hole, usual))
    problem = (
        f"{file} has no point within {away} of a place in `{case.body.name}`, but its points are "
        f"usually at most {near} apart"
    )
    return told, (diagnostic("W702", declared.at("path"), problem, "missing points?", WRITE),)
