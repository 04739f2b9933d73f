"""Declaration of the geometrically exact beam."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING, Annotated, Any

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.models.beam import curved_beam_limits, flat_strips
from softmark.interpreter.models.shared.capabilities import PERTURBED_STARTS, VISCOELASTICITY, supported_features
from softmark.interpreter.models.shared.model_declaration import Model
from softmark.interpreter.problem.body_case import Fault
from softmark.interpreter.problem.cross_section_coverage import (
    coverages,
    inner_stations,
    selection_borders,
    selects_whole_sections,
    single_selected_end,
)
from softmark.interpreter.results.run_report import ModelKind
from softmark.interpreter.vocabulary.analysis_words import Dynamic
from softmark.interpreter.vocabulary.loads.body_force import BodyForce
from softmark.interpreter.vocabulary.loads.line_force import LineForce
from softmark.interpreter.vocabulary.loads.point_force import PointLoad
from softmark.interpreter.vocabulary.loads.pressure import PressureLoad
from softmark.interpreter.vocabulary.loads.surface_traction import SurfaceTraction
from softmark.interpreter.vocabulary.loads.tendon import TendonLoad
from softmark.interpreter.vocabulary.loads.torque import MomentLoad
from softmark.records import dataclass
from softmark.solvers.mesh.extruded_shapes import Extruded
from softmark.solvers.mesh.revolved_bodies import Cone
from softmark.solvers.mesh.shape import Prism, Swept

if TYPE_CHECKING:
    from softmark.interpreter.language.compiled_scene import Declared
    from softmark.interpreter.problem.body_case import Case

OF_SECTIONS = "finite", "sections"  # strain measure, and where stress is known
ACCEPTED_LOADS = (  # help of E501
    "use gravity, tendons, tractions and torques on an end face, or forces and lines of force along the beam"
)
MOST_WOUND = 0.5 * math.pi * (1.0 + 1e-9)  # rad, largest winding of a tendon along a segment
WHOLE_SECTIONS = "constrain whole cross-sections at nodes of the axis; more `segments` give more nodes"
ALL_DIRECTIONS = "constrain all three directions: leave out `components`"


@dataclass(frozen=True)
class Beam6Dof(Model):
    """Geometrically exact beam with six degrees of freedom per node, for bodies along an axis.

    Simo-Reissner theory: cross-sections stay plane and move rigidly, strains of the axis are small, and rotations are
    unlimited. Elements have two nodes and one integration point; they are of second order and path independent. Shear
    and axial flexibility can be switched off. The body must be slender: a cylinder, a tube, a box, an arc, a cone
    without a tip, or an extruded trapezoid. For the last two, which taper, the compliance of elements is integrated.
    Supports must select whole cross-sections. A torque on an end face is a moment of fixed direction on that section. A
    force at a point off the axis acts on an arm that rotates with its section, where a node is placed. Supports may
    rotate. An `arc(...)` is free of stress as declared; dynamics, frequencies and line loads are not available for
    curved beams.

    Static stress is that of sections that warp freely (Navier, Saint-Venant): of stretch, bending, torsion and
    transverse shear in circles, rings and rectangles. In a tapered beam it follows the sides, to first order in their
    slope. Within one width of a support, load or joint sections are not free and the theory is inaccurate; a warning
    reports this (W356).

    In dynamics, with every integrator, half the mass of a segment is lumped at either end, with the rotary inertia of
    its sections. Rotations are vectors relative to the start of each step and are never summed, so that a beam may
    rotate without limit. `midpoint` conserves linear and angular momentum. A step of 20 segments takes less than a
    millisecond.
    Source: Simo (1985); Simo and Vu-Quoc (1986, 1988); Crisfield and Jelenic (1999); Brüls and Cardona (2010).
    """

    loads = (
        BodyForce,
        SurfaceTraction,
        PressureLoad,
        MomentLoad,
        PointLoad,
        LineForce,
        TendonLoad,
    )  # of which `_unsupported_load` says more
    capabilities = supported_features(PERTURBED_STARTS, VISCOELASTICITY)
    moves_by_sections = True
    resolution_fields = ("segments",)

    segments: Annotated[int, "1 in [1, 10000]", "elements along the axis"]
    shear: Annotated[bool, "include shear flexibility"] = True
    axial: Annotated[bool, "include axial flexibility"] = True
    body: Annotated[str | None, "body", "body; needed if the scene has several"] = None

    def diagnostics(self, declared: Declared, case: Case) -> list[Diagnostic]:
        """Return errors and warnings about a beam model in a case."""
        if case.shape.swept is None:
            return [_no_axis_error(declared, case)]
        if beyond := curved_beam_limits.curved_beam_errors(declared, case):
            return beyond
        flat = flat_strips.curling_warning(declared, case)
        found = [*self.unsupported_feature_errors(declared, case), *self._unsupported_load_errors(declared, case)]
        found += self._unsupported_support_errors(declared, case)
        found += [
            *([] if found else self._constraint_errors(case)),
            *self._slenderness_warnings(declared, case),
            *self._rigid_option_errors(declared, case),
        ]
        return found if flat is None else [*found, flat]

    def _unsupported_load_errors(self, declared: Declared, case: Case) -> list[Diagnostic]:
        """Return errors for loads that a beam cannot represent."""
        found = []
        for load in case.loads:
            reason, help = _unsupported_load(load, case), ACCEPTED_LOADS
            if not reason:
                reason, help = self._missing_node_reason(load, case), "write a larger `segments` in the model"
            if reason and isinstance(load.thing.action, self.loads):
                found.append(
                    diagnostic(
                        "E501",
                        load.at(_position_field_name(load.thing.action, case)),
                        f"`{declared.name}` cannot represent the load `{load.name}`",
                        reason,
                        help,
                    )
                )
        return found

    def _missing_node_reason(self, load: Declared, case: Case) -> str:
        """Return the reason why no node is at a section that a load acts on, or "" if there is one.

        Tendons with guides and forces off the axis need a node within 1e-6 of the length from each guide or from the
        force. Other tendons must not wind too much within a segment.
        """
        action = load.thing.action
        if isinstance(action, TendonLoad) and action.guides is None:
            return self._tendon_winding_message(case, action)
        if isinstance(action, TendonLoad):
            places, what = guides(case, action), "guided"
        elif isinstance(action, PointLoad) and axis_station(case, action.at) is None:
            places, what = [section_station(case, action.at) or 0.0], "off the axis"
        else:
            return ""
        nodes, slack = self.stations(case), 1e-6 * case.prism.length
        near = all(any(abs(s - place) <= slack for s in nodes) for place in places)
        return "" if near else f"{what} at a point too far from a node"

    def _tendon_winding_message(self, case: Case, action: TendonLoad) -> str:
        """Return a message if a tendon winds by more than 90 degrees within a segment; else an empty text."""
        ends, nodes = guides(case, action), self.stations(case)
        longest = max(b - a for a, b in pairwise(nodes))
        turn = abs(action.winding) * min(longest / abs(ends[1] - ends[0]), 1.0)
        if turn <= MOST_WOUND:
            return ""
        return f"winds by {math.degrees(turn):.3g} deg per segment, more than 90 deg"

    def _unsupported_support_errors(self, declared: Declared, case: Case) -> list[Diagnostic]:
        """Return errors for supports that a beam cannot represent."""
        found = []
        for support in case.supports:
            if isinstance(support.thing, self.supports) and (why := self._unsupported_support(support, case)):
                problem = f"`{declared.name}` cannot represent the support `{support.name}`"
                found.append(diagnostic("E501", support.at("where"), problem, *why))
        return found

    def _unsupported_support(self, support: Declared, case: Case) -> tuple[str, str] | None:
        """Return why a beam cannot represent a support, and the remedy; None if it can."""
        between = {cover for _, cover in inner_stations(support.thing.where, case.prism)}
        cover = coverages(support.thing.where, case.prism, self.stations(case))
        straight = isinstance(case.prism, Prism)
        oblique = len(support.thing.components) < 3 and not (straight and _is_axis_aligned(case.prism.axis))
        if why := support.thing.nonrigid_reason:
            return why, WHOLE_SECTIONS
        if "some" in cover | between:
            return "selects only part of a cross-section", WHOLE_SECTIONS
        if cover == {"none"}:
            return "selects no cross-section at a node", WHOLE_SECTIONS
        if oblique:
            kind = "an oblique" if straight else "a curved"
            return f"constrains only some components of {kind} beam", ALL_DIRECTIONS
        if support.thing.rotates and _rotates_about_free_axis(case, support):
            return "rotates sections about an axis that its components leave free", ALL_DIRECTIONS
        return None

    def _constraint_errors(self, case: Case) -> list[Diagnostic]:
        """Return errors if supports conflict or leave the beam free to move."""
        if not case.supports or self._has_disjoint_clamps(case):
            return []  # no error is possible for these supports
        from softmark.interpreter.models.beam.beam_supports import constrained_dofs

        try:
            constrained_dofs(case, self.stations(case))
        except Fault as loose:
            return [loose.diagnostic]
        return []

    def _has_disjoint_clamps(self, case: Case) -> bool:
        """Return whether the supports are clamps that neither overlap nor hold all nodes, so that they cannot conflict.

        A single clamp satisfies this.
        """
        if any(len(support.thing.components) < 3 for support in case.supports):
            return False
        if len(case.supports) == 1:
            return True
        stations = tuple(self.stations(case))
        taken = [selects_whole_sections(support.thing.where, case.prism, stations) for support in case.supports]
        counts = [sum(at) for at in zip(*taken, strict=True)]
        return bool(min(counts) == 0 and max(counts) == 1)

    def _rigid_option_errors(self, declared: Declared, case: Case) -> list[Diagnostic]:
        """Return an error for `shear = no` or `axial = no` in dynamics.

        Stiff springs enforce these constraints. In statics a second solution makes them exact; in dynamics they would
        oscillate.
        """
        off = next((name for name in ("shear", "axial") if not getattr(self, name)), None)
        if off is None or not isinstance(case.analysis, Dynamic):
            return []
        return [
            diagnostic(
                "E533",
                declared.at(off),
                f"`{declared.name}` needs {'shear' if off == 'shear' else 'stretch'} deformation in a dynamic analysis",
                "only in static analyses",
                f"remove `{off} = no`: in a dynamic analysis this constraint would be a stiff spring that vibrates",
            )
        ]

    def _slenderness_warnings(self, declared: Declared, case: Case) -> list[Diagnostic]:
        """Return a warning for a beam that is not slender."""
        section = case.prism.section
        depth = 2 * max(max(abs(u), abs(v)) for u, v in section.samples())
        if case.prism.length >= 3 * depth:
            return []
        ratio = case.prism.length / depth
        return [
            diagnostic(
                "W304",
                declared.at(),
                f"the beam is only {ratio:.1f} times as long as deep",
                "not slender: beam theory is inaccurate",
                "below a ratio of about 3, sections warp: compare with `fem(...)`",
            )
        ]

    def stations(self, case: Case) -> list[float]:
        """Return the stations of the nodes, m from the root.

        Nodes are equally spaced, except that the nearest nodes are moved to the ends of supports and to eccentric
        loads.
        """
        found = [case.prism.length * i / self.segments for i in range(self.segments + 1)]
        inner = set(range(1, self.segments))  # indices of the nodes that may be moved
        places = {b for support in case.supports for b in selection_borders(support.thing.where, case.prism)}
        for border in sorted(places | _eccentric_stations(case)):
            if inner and not any(abs(s - border) <= 1e-6 * case.prism.length for s in found):
                nearest = min(inner, key=lambda i: abs(found[i] - border))
                found[nearest] = border
                inner.remove(nearest)
        return sorted(found)

    @property
    def stress_law(self) -> tuple[str, str] | str:
        """Message that stress is computed in cross-sections, by the theory of Saint-Venant."""
        return OF_SECTIONS

    def outline(self, case: Case) -> str:
        """Return a one-line description of the model for `dsl plan`."""
        return f"{self.segments} {self._description_without_segments}"

    @property
    def _description_without_segments(self) -> str:
        """Description of the model without its number of segments."""
        off = [name for name, on in (("shear", self.shear), ("stretch", self.axial)) if not on]
        return "beam segments, no mesh" + (f", without {' and '.join(off)}" if off else "")

    def kind(self, case: Case) -> ModelKind:
        """Return the kind of the model: its description without the number of segments, and that number as text."""
        return ModelKind(self._description_without_segments, str(self.segments), None)

    def orders(self) -> dict[str, int]:
        """Return the convergence order 2 of two-node elements with one integration point (Simo and Vu-Quoc 1986)."""
        return {"segments": 2}


def _no_axis_error(declared: Declared, case: Case) -> Diagnostic:
    """Return the error for a body that has no cross-sections along an axis.

    The message is different for a cone with a tip, which lacks only the last section.
    """
    name, body, use = declared.name, case.body.name, "or use `fem(...)`"
    if isinstance(case.shape, Cone):
        code, problem, reason = (
            "E348",
            f"`{name}` cannot represent a body with a sharp tip, `{body}`",
            "the section shrinks to a point",
        )
        remedy = f"add an `end` radius to the cone, {use}"
    elif isinstance(case.shape, Extruded):
        code, problem, reason = "E349", f"`{name}` finds no straight axis in the outline of `{body}`", "not a trapezoid"
        remedy = f"draw two parallel end faces normal to x, y or z whose centres face each other, {use}"
    else:
        code, problem = "E501", f"`{name}` needs a body with cross-sections along an axis"
        reason = f"`{body}` is not a cylinder, a tube, a box, an arc or a cone"
        remedy = "use `fem(...)` for this body"
    return diagnostic(code, declared.at(), problem, reason, remedy)


def _rotates_about_free_axis(case: Case, support: Declared) -> bool:
    """Return whether a support prescribes a rotation of sections about an axis about which it does not hold them."""
    if len(support.thing.components) == 3:
        return False
    from softmark.interpreter.models.beam.beam_supports import rotates_free_sections

    return rotates_free_sections(case, support)


def _position_field_name(action: Any, case: Case) -> str:
    """Return the name of the field that states where a load acts: `at`, `where`, `from` or, for a tendon, `to`.

    A tendon has `from` and `to`; the result is `to` only if it alone lies beyond the beam.
    """
    if isinstance(action, TendonLoad):
        return (
            "to"
            if section_station(case, action.end) is None and section_station(case, action.begin) is not None
            else "from"
        )
    return {PointLoad: "at", LineForce: "from"}.get(type(action), "where")


def _is_axis_aligned(axis: tuple[float, ...]) -> bool:
    """Return whether an axis is parallel to x, y or z."""
    return max(abs(a) for a in axis) > 1 - 1e-12


def _unsupported_load(load: Declared, case: Case) -> str:
    """Return the reason why a beam cannot represent a load, or "" if it can."""
    match load.thing.action:
        case BodyForce():
            return ""
        case PointLoad(at=at):
            return (
                ""
                if axis_station(case, at) is not None or section_station(case, at) is not None
                else "outside the beam"
            )
        case LineForce(begin=begin, end=end):
            if begin == end:
                return "the line has no length"
            on = axis_station(case, begin) is not None and axis_station(case, end) is not None
            return "" if on else "not along the axis of the beam"
        case TendonLoad(begin=begin, end=end):
            first, last = section_station(case, begin), section_station(case, end)
            if first is None or last is None:
                return "beyond the ends of the beam"
            slack = 1e-6 * case.prism.length
            return "" if abs(first - last) > slack else "the tendon does not run along the beam"
        case SurfaceTraction(where=where) | MomentLoad(where=where):
            return "" if single_selected_end(where, case.prism) is not None else "not on one whole end face"
    return "not a load of beam theory"


def _eccentric_stations(case: Case) -> set[float]:
    """Return the axial positions of eccentric forces and of tendon guides and ends, m from the root.

    An eccentric force acts at a point off the beam axis.
    """
    actions = [load.thing.action for load in case.loads]
    points = [a.at for a in actions if isinstance(a, PointLoad) and axis_station(case, a.at) is None]
    places = {s for s in (section_station(case, p) for p in points) if s is not None}
    return places | {s for a in actions if isinstance(a, TendonLoad) for s in guides(case, a)}


def guides(case: Case, action: TendonLoad) -> list[float]:
    """Return the axial positions of a tendon's guides and ends, m from the root.

    The list is empty if an end lies beyond the beam.
    """
    first, last = section_station(case, action.begin), section_station(case, action.end)
    if first is None or last is None:
        return []
    count = (action.guides or 2) - 1
    return [first + (last - first) * i / count for i in range(count + 1)]


def section_station(case: Case, point: tuple[float, float, float]) -> float | None:
    """Return the axial position (station), m from the root, of the section with a point; None beyond the ends."""
    shape = case.prism
    s, slack = shape.section_coordinates(point)[0], 1e-9 * shape.length
    return min(max(s, 0.0), shape.length) if -slack <= s <= shape.length + slack else None


def axis_station(case: Case, point: tuple[float, float, float]) -> float | None:
    """Return the axial position of a point on the beam axis, m from the root; None off the axis."""
    return on_axis(case.prism, point)


def on_axis(shape: Swept, point: tuple[float, float, float]) -> float | None:
    """Return the axial position, m, of a point on the axis of a swept shape; None if it is off the axis.

    The tolerance is 1e-9 of the length of the shape.
    """
    s, u, v = shape.section_coordinates(point)
    slack = 1e-9 * shape.length
    held = math.hypot(u, v) <= slack and -slack <= s <= shape.length + slack
    return min(max(s, 0.0), shape.length) if held else None
