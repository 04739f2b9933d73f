"""Declaration of models from imported results."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Literal

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.models.shared.capabilities import (
    NETWORK_START_TEXTS,
    NETWORKS,
    PERTURBED_STARTS,
    SOLID_FEATURES,
    supported_features,
)
from softmark.interpreter.models.shared.model_declaration import Model
from softmark.records import dataclass

if TYPE_CHECKING:
    from softmark.interpreter.language.compiled_scene import Declared
    from softmark.interpreter.problem.body_case import Case

NOTHING = "the displacements were read from a file, which has"


@dataclass(frozen=True)
class Results(Model):
    """Displacements from a file written by another program, assessed like any model; nothing is solved.

    Files are VTU, PVD, VTK, XDMF, CalculiX's FRD, FEBio's XPLT and CSV tables. Points of the file are undeformed, and
    `at` names the vectors that are their displacements. If the file has only moved points, use `at = "position"`, with
    `rest` a file of the same points undeformed, unless the first state of the series is undeformed. Programs that write
    moved points in addition to displacements need `position` too. If the file has cells, a point of the body moves with
    the cell that it lies in. If it has only points, it moves with the nearest one if that is within 1e-6 of the body's
    size, else by linear interpolation between surrounding points. `by = nodes` uses node numbers instead of positions:
    those of the body's own mesh file, in its order.

    For plane bodies, files have plane cells, points at one z, or a slice one cell thick, of any thickness; positions
    are compared by x and y, for a body of revolution by the distance from its axis and y. For networks a file has the
    points of the probes, because rods are bent between them.

    The body must lie within the points of the file. The largest distance of its surface outside, and the volume of the
    file's mesh relative to the body, are in `solve.match` of the report; distances beyond `within` are refused. A
    series is matched by its `time`: a motion is that of the series, linear between its times; a state is the one of the
    same value. Nothing is solved, so there is no residual, stability, stress, reaction or time, and each is refused
    with that reason. Its status is `read`, it takes no part in `dsl robustness`, and it is unchecked: only references
    assess it.
    """

    loads = (object,)
    supports = (object,)
    capabilities = supported_features(*SOLID_FEATURES, NETWORKS) | {PERTURBED_STARTS: NETWORK_START_TEXTS}
    reads_file = True
    timed = False
    reason_without_robustness = "results from a file do not change with parameters"
    reason_without_forces = f"{NOTHING} no forces"

    path: Annotated[str, "file", "file: .vtu, .pvtu, .pvd, .vtk, .xdmf, .frd, .xplt or .csv"]
    unit: Annotated[float, "m in (0, inf)", "length unit of the file, such as 1 mm"]
    at: Annotated[str, 'name of the displacement vectors in the file, or "position"; default: the only candidate'] = ""
    rest: Annotated[str, "file", "file with the same points undeformed, for `position`"] = ""
    time: Annotated[float, "s in (0, inf)", "time unit of the file"] = 1.0
    by: Annotated[Literal["place", "nodes"], "how points are matched: by position, or by node number"] = "place"
    within: Annotated[
        float | None,
        "m in (0, inf)",
        "largest distance of the body outside the file's points; default: 1 % of the body's diagonal",
    ] = None
    body: Annotated[str | None, "body", "body; needed if the scene has several"] = None

    @property
    def stress_law(self) -> str:
        """Message why an imported result has no stress."""
        return f"{NOTHING} no stress"

    def diagnostics(self, declared: Declared, case: Case) -> list[Diagnostic]:
        """Return errors if the body or the analysis does not allow matching a file."""
        if self.by == "nodes" and (case.planar or not case.shape.file):
            why = "a slice with plane cells" if case.planar else "not a mesh file"
            also = "" if case.planar or case.shape.wired else ", or use the solved mesh file as the body"
            remedy = f"write `by = place`{also}"
            return [
                diagnostic("E705", declared.at("by"), f"`{case.body.name}` has no node numbers to match", why, remedy)
            ]
        return []

    def outline(self, case: Case) -> str:
        """Return a one-line description of the model for `dsl plan`."""
        return f"read from {self.path}, nothing is solved"
