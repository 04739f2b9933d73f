"""Supports and loads hold each other: forces and moments of a state of rest add up to nothing, or it is no answer.

And what each support does is found again by the formulas that forces are found again by (verification/by_model): at
the nodes that it holds, from the cells around them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.interpreter.models.postprocessing.nodal_forces import NOTHING, Carried, Wrench, holders, reactions
from softmark.interpreter.models.postprocessing.reaction_and_work import at_rest
from softmark.interpreter.results.reaction_results import Reaction
from softmark.interpreter.verification.load_forces_check import MOST_UNSURE
from softmark.interpreter.verification.unverified_models import Unchecked
from softmark.interpreter.vocabulary.load_words import MomentLoad, PressureLoad, RemoteStress, SurfaceTraction
from softmark.interpreter.vocabulary.self_contact_words import Tied
from softmark.solvers.independent_forces.solid_forces import EPS, Floats

if TYPE_CHECKING:
    from softmark.interpreter.problem.body_case import Case
    from softmark.interpreter.verification.by_model.verifier import Found, Voucher

EXACT = 1e-8  # of the largest load: what supports and loads may leave
AGREES = 2.0  # times what the solver says that it left
ROUNDING = 100.0  # times eps, of all that acts at nodes
UNTURNED = "internal forces of cells that turn as a whole (`rotation = element`) have a moment: it is left over"


def checked(voucher: Voucher, found: Found) -> tuple[dict[str, Any], str | None]:
    """What the report says of supports and loads together, and why the state is no answer, if they do not balance."""
    known = at_rest(found.declared, found.case, found.prepared, found.solution).reactions
    if not known or found.solution.carried is None:
        return {}, None
    carried = found.solution.carried()
    scale, allowed = _measures(carried, known, float(found.solution.facts.get("residual") or 0.0))
    again, noise, unknown = _again(voucher, found) if scale != 0.0 else ({}, 0.0, None)
    if unknown is None and scale != 0.0:  # cells that turn as a whole have forces that are less than their rounding
        allowed += voucher.rounding(found)
    if scale <= noise:  # which is all that there is where a body is moved as a whole
        why = "what acts is less than rounding leaves" if scale > 0.0 else "nothing acts"
        nothing = {"force": 0.0, "moment": 0.0, "allowed": 0.0, "apart": None, "reason": why}
        return {"reactions": nothing}, None
    within = {pair.name for pair in found.case.pairs}  # of whose forces those on one side are told
    outer = {name: own for name, own in known.items() if name not in within}
    force, moment = _relative(_total(carried, outer), carried, scale)
    facts: dict[str, Any] = {"force": force, "moment": moment, "allowed": allowed / scale}
    reason = None
    if not carried.turns_freely:
        facts["note"] = UNTURNED
    if not max(force, moment if carried.turns_freely else 0.0) * scale <= allowed:
        reason = (
            f"its supports and loads do not balance: {force:.1e} of the largest load is left of forces, and "
            f"{moment:.1e} of it times the extent of the body of moments"
        )
        if force * scale <= allowed:
            reason += _of_pairs(found)
    if unknown is not None:
        return {"reactions": facts | {"apart": None, "reason": unknown}}, reason
    apart = min(_apart(carried, own, again, scale) for own in (known, _written(found, carried) or known))
    if reason is None and not apart * scale <= max(allowed, _unsure(found.case) * scale) + noise:
        reason = f"the reaction of a support is {apart:.1e} of the largest load away from what other formulas find"
    return {"reactions": facts | {"apart": apart}}, reason


def _written(found: Found, carried: Carried) -> Mapping[str, Reaction]:
    """Reactions in the state as its numbers are, which is what other formulas see; nothing where there is no other.

    What constraints carry they find by balance, and are as free of rounding as the reactions that are told.
    """
    if carried.written is None:
        return {}
    held = holders(found.case, found.prepared.mesh, found.declared.thing)
    return reactions(replace(carried, left=carried.written), held)


def _of_pairs(found: Found) -> str:
    """What makes a moment of forces that pieces of a body exchange, and what to do; nothing where none do.

    They are along the line between their points where these are: not of ties across a gap, nor in small strain, whose
    moments are those of places before deformation.
    """
    for pair in found.case.pairs:
        if isinstance(pair.thing, Tied):
            return f"; what `{pair.name}` ties across a gap has a moment: let the surfaces meet before deformation"
        if getattr(found.declared.thing, "strain", None) == "small":
            return f"; in small strain what slides along `{pair.name}` leaves one: take `strain = finite`"
    return ""


def _again(voucher: Voucher, found: Found) -> tuple[Mapping[str, Wrench], float, str | None]:
    """Reactions by other formulas, what rounding leaves of them, N, and why there are none, if there are none."""
    try:
        return *voucher.reactions(found), None
    except Unchecked as unknown:
        return {}, 0.0, str(unknown)


def _unsure(case: Case) -> float:
    """How much of the loads, relative, was perhaps not found again: near the borders of what is loaded."""
    return (
        MOST_UNSURE
        if any(
            isinstance(load.thing.action, SurfaceTraction | RemoteStress | PressureLoad | MomentLoad)
            for load in case.loads
        )
        else EXACT
    )


def _total(carried: Carried, known: Mapping[str, Reaction]) -> Wrench:
    """Supports and loads together."""
    supports = (Wrench(np.array(r.force), np.array(r.moment)) for r in known.values())
    return sum((*supports, *carried.applied.values()), NOTHING)


def _relative(left: Wrench, carried: Carried, scale: float) -> tuple[float, float]:
    """A force relative to the largest load, and its moment about the middle of the body to that times its extent."""
    moment = np.linalg.norm(left.about(carried.middle)) / carried.extent
    return float(np.linalg.norm(left.force)) / scale, float(moment) / scale


def _measures(carried: Carried, known: Mapping[str, Reaction], residual: float) -> tuple[float, float]:
    """The largest load or reaction, N, moments over the extent included, and what balance may leave, N.

    A load counts by the sizes of its forces at nodes: a pressure all around comes to no force, and is none the less.
    """
    per_length = 1.0 / np.array([1.0, 1.0, 1.0, *[carried.extent] * 3])
    acting = [*carried.loads.values(), *([] if carried.pulling is None else [carried.pulling])]
    sizes = [float(np.linalg.norm(f * per_length, axis=1).sum()) for f in acting]
    forces = (float(np.linalg.norm(r.force)) for r in known.values())
    moments = (float(np.linalg.norm(r.own_moment)) / carried.extent for r in known.values())
    scale = max((*sizes, *forces, *moments), default=0.0)
    left, n = carried.left * per_length, len(carried.left)
    norms = [np.linalg.norm(left), *(np.linalg.norm(f * per_length) for f in acting)]
    rounding = ROUNDING * EPS * float(np.linalg.norm(left, axis=1).sum() + sum(sizes))
    return scale, EXACT * scale + AGREES * residual * float(np.sqrt(n) * max(norms)) + rounding


def _apart(carried: Carried, known: Mapping[str, Reaction], again: Mapping[str, Wrench], scale: float) -> float:
    """How far reactions are from those by other formulas."""
    most = 0.0
    for name, own in known.items():
        other = again[name]
        apart = Wrench(np.array(own.force) - other.force, np.array(own.moment) - other.moment)
        most = max(most, *_relative(apart, carried, scale))
    return most


def summed(masks: Mapping[str, Any], left: Floats, x: Floats, axial: bool = False) -> dict[str, Wrench]:
    """Of what is left (n, 6) at nodes x (n, 3), in space: what each support has by its mask (n, 6), the first first.

    `axial`: at nodes that are rings around the y axis, whose other forces cancel.
    """
    found, taken = {}, np.zeros(left.shape, dtype=np.bool_)
    for name, mask in masks.items():
        own = np.where(mask & ~taken, left, 0.0)
        moment = own[:, 3:].sum(axis=0) + np.cross(x, own[:, :3]).sum(axis=0)
        force = own[:, :3].sum(axis=0)
        found[name] = Wrench(force * (0.0, 1.0, 0.0), 0.0 * moment) if axial else Wrench(force, moment)
        taken |= mask
    return found
