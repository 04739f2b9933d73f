"""Declaration of the geometrically exact frame: beams that meet in rigid joints."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated

from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.models.beam.beam_declaration import OF_SECTIONS
from softmark.interpreter.models.beam_frame import frame_selection
from softmark.interpreter.models.shared.capabilities import (
    NETWORK_START_TEXTS,
    NETWORKS,
    PERTURBED_STARTS,
    supported_features,
)
from softmark.interpreter.models.shared.model_declaration import Model
from softmark.interpreter.problem.body_case import Fault
from softmark.interpreter.results.run_report import ModelKind
from softmark.interpreter.vocabulary.analysis_words import Dynamic
from softmark.interpreter.vocabulary.loads.body_force import BodyForce
from softmark.interpreter.vocabulary.loads.line_force import LineForce
from softmark.interpreter.vocabulary.loads.point_force import PointLoad
from softmark.interpreter.vocabulary.loads.torque import MomentLoad
from softmark.interpreter.vocabulary.supports.pinned_points import Pinned
from softmark.interpreter.vocabulary.supports.support import Support, UniformSupport
from softmark.records import dataclass
from softmark.solvers.mesh.shape import cross

if TYPE_CHECKING:
    from collections.abc import Iterator

    from softmark.grammar.diagnostic import Diagnostic
    from softmark.interpreter.language.compiled_scene import Declared
    from softmark.interpreter.problem.body_case import Case
    from softmark.solvers.mesh.frame_shapes import Network

Vector3 = tuple[float, float, float]
SLENDER = 3.0  # smallest ratio of length to depth of a slender member
CLEAR = 1e-3  # of a distance: smallest lever arm that counts


@dataclass(frozen=True)
class Frame6Dof(Model):
    """Geometrically exact beams with six degrees of freedom per node that meet in rigid joints: a `network(...)`.

    Every member is modelled as `beam6dof` is: sections stay plane and move rigidly, rotations are unlimited, shear and
    stretch are included. Members that meet at a point keep their angles, however the point rotates. Members are lines
    without extent at joints: their overlap there is ignored, in stiffness and in mass, and the stated error includes
    its possible effect. Stress is that of `beam6dof`. For members that taper, the compliance of elements is integrated.
    Supports hold points of axes: `fixed` and `displaced` with their sections, `pinned` without. Loads are gravity,
    forces and line forces on axes, and torques at a point, the last only in statics. Conditions select points of the
    axes, and whole members. In dynamics, with every integrator, masses are at nodes, with the rotary inertia of
    sections.

    Source: Simo and Vu-Quoc (1986, 1988); Crisfield and Jelenic (1999); joints as in Ibrahimbegovic and Mamouri (2000).
    """

    loads = (BodyForce, PointLoad, LineForce, MomentLoad)
    supports = (UniformSupport, Pinned)
    capabilities = supported_features(NETWORKS) | {PERTURBED_STARTS: NETWORK_START_TEXTS}
    moves_by_sections = True
    resolution_fields = ("segments",)

    segments: Annotated[int, "1 in [1, 1000]", "elements along each member"]
    body: Annotated[str | None, "body", "body; needed if the scene has several"] = None

    def diagnostics(self, declared: Declared, case: Case) -> list[Diagnostic]:
        """Return errors and warnings about a frame model in a case."""
        if not case.shape.wired:
            return [
                diagnostic("E344", declared.at(), f"`{declared.name}` needs a body made by `network(...)`, "
                                                  f"but `{case.body.name}` is not a network",
                           "only for networks", "use `beam6dof(...)` or `fem(...)`, or declare the body as "
                           "`network(...)`")
            ]  # fmt: skip
        network: Network = case.shape  # type: ignore[assignment]
        found = [
            *self.unsupported_feature_errors(declared, case),
            *_unsupported_load_errors(declared, case, network),
            *_unsupported_support_errors(declared, case, network),
        ]
        if not found and case.supports and not plainly_held(case, network):
            found += _check_supports(self, case)
        return [*found, *_slenderness_warnings(declared, network), *_warn_of_crossing_members(declared, case, network)]

    @property
    def stress_law(self) -> tuple[str, str] | str:
        """Message that stress is computed in cross-sections, as for beams."""
        return OF_SECTIONS

    def outline(self, case: Case) -> str:
        """Return a one-line description of the model for `dsl plan`."""
        pairs = getattr(case.body.thing, "members", ())
        return f"{len(pairs)} members of {self.segments} {self._description_without_segments}"

    @property
    def _description_without_segments(self) -> str:
        """Description of the model without its number of segments."""
        return "beam segments each, no mesh"

    def kind(self, case: Case) -> ModelKind:
        """Return the kind of the model: its description without the number of segments, and that number as text."""
        return ModelKind(self._description_without_segments, str(self.segments), None)

    def orders(self) -> dict[str, int]:
        """Return the convergence order of the beam elements (Simo and Vu-Quoc 1986)."""
        return {"segments": 2}


def _unsupported_load_errors(declared: Declared, case: Case, network: Network) -> Iterator[Diagnostic]:
    """Yield errors for loads that do not act on a point or an axis of the network."""
    for load in case.loads:
        match load.thing.action:
            case PointLoad(at=at) if frame_selection.locate_on_member(network, at) is None:
                field, reason = "at", "off the axes of the members"
            case LineForce(begin=begin, end=end) if begin == end:
                field, reason = "from", "the line has no length"
            case LineForce(begin=begin, end=end) if frame_selection.locate_line_on_member(network, begin, end) is None:
                field, reason = "from", "not along the axis of one member"
            case MomentLoad() if isinstance(case.analysis, Dynamic):
                field, reason = "where", "torques only in static analyses"
            case MomentLoad(where=where) if (count := _count_selected_points(network, where)) != 1:
                many = "on more than one point"
                field, reason = "where", many if count else "on no end point of a member"
            case _:
                continue
        yield diagnostic("E345", load.at(field), f"`{declared.name}` cannot represent the load `{load.name}`", reason,
                         "use gravity, forces and line forces on the axes of members, or a torque at a point of the "
                         "network")  # fmt: skip


def _count_selected_points(network: Network, where: object) -> int:
    """Return the number of points that a condition selects; 2 or more if it selects members."""
    points, whole, part = frame_selection.select_points_and_members(where, network)
    return len(points) + len(whole) + len(part)


def _unsupported_support_errors(declared: Declared, case: Case, network: Network) -> Iterator[Diagnostic]:
    """Yield errors for supports that hold no points, or only a part of a member."""
    for support in case.supports:
        if not isinstance(support.thing, declared.thing.supports):
            continue
        points, _, part = frame_selection.select_points_and_members(support.thing.where, network)
        field, reason = "where", ""
        if part:
            a, b = network.pairs[part[0]]
            reason = f"selects only part of the member from point {a} to point {b}"
        elif not points:
            reason = "selects no end point of a member"
        elif support.thing.clamps and len(support.thing.components) < 3:
            field, reason = "components", "cannot hold single components"
        if reason:
            yield diagnostic("E343", support.at(field), f"`{declared.name}` cannot represent the support "
                             f"`{support.name}`", reason, "hold points and whole members: add a point where "
                                                          "the support ends, and write `pinned(...)` for a "
                                                          "joint that may rotate")  # fmt: skip


def plainly_held(case: Case, network: Network) -> bool:
    """Return whether supports obviously hold the whole network without conflicts.

    If False, only a computation with arrays can decide. One clamp holds a network. A hinge about an axis also does,
    together with another support that prevents rotation about that axis.
    """
    moving = [support for support in case.supports if support.thing.displaces]
    clamps = [support for support in case.supports if support.thing.clamps]
    points = {s.name: set(frame_selection.select_points_and_members(s.thing.where, network)[0]) for s in case.supports}
    shared = any(
        points[s.name] & points[o.name] and set(s.thing.components) & set(o.thing.components)
        for s in moving for o in case.supports if o is not s
    )  # fmt: skip
    if shared or set().union(*(points[s.name] for s in clamps)) == set(range(len(network.points))):
        return False
    return bool(clamps) or any(
        _prevents_hinge_rotation(one.thing, two.thing, network.points[i], network.points[j])
        for one in case.supports for two in case.supports for i in points[one.name] for j in points[two.name]
    )  # fmt: skip


def _prevents_hinge_rotation(one: Support, two: Support, here: Vector3, there: Vector3) -> bool:
    """Return whether support `two`, at the point `there`, prevents hinge `one`, at the point `here`, from rotating."""
    axis = one.hinge_axis
    if axis is None or len(one.components) < 3 or two.hinge_axis not in (None, axis):
        return False
    way = cross(axis, tuple(b - a for a, b in zip(here, there, strict=True)))
    return any(abs(way[c]) > CLEAR * math.dist(here, there) > 0.0 for c in two.components)


def _check_supports(model: Frame6Dof, case: Case) -> list[Diagnostic]:
    """Return errors for supports that conflict or leave the network free to move."""
    from softmark.interpreter.models.beam_frame.frame_layout import Layout

    try:
        Layout.of(case, model.segments).held()
    except Fault as loose:
        return [loose.diagnostic]
    return []


def _slenderness_warnings(declared: Declared, network: Network) -> Iterator[Diagnostic]:
    """Yield a warning for the first member that is not slender."""
    for number, member in enumerate(network.members, start=1):
        ratio = member.length / max(member.section.extents)
        if ratio < SLENDER:
            yield diagnostic(
                "W304",
                declared.at(),
                f"member {number} is only {ratio:.1f} times as long as deep",
                "not slender: beam theory is inaccurate",
                "below a ratio of about 3, sections warp and joints are as large as members: compare with `fem(...)`",
            )
            return


def _warn_of_crossing_members(declared: Declared, case: Case, network: Network) -> Iterator[Diagnostic]:
    """Yield a warning if members pass through each other without a joint."""
    pair = network.find_crossing_members()
    if pair is not None:
        one, other = pair
        shared = set(network.pairs[one - 1]) & set(network.pairs[other - 1])
        where = f"overlap beyond point {min(shared)}" if shared else "cross without a common point"
        yield diagnostic("W358", case.body.at(), f"members {one} and {other} of `{case.body.name}` {where}",
                         "not joined there", "members are joined only at points: add a point where they "
                                             "cross or end, or separate them")  # fmt: skip
