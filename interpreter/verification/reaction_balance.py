"""Check of the global balance: forces and moments of supports and loads sum to zero at equilibrium.

The reaction of each support is also compared with that of independent formulas (verification/by_model), which sum the
forces of the cells around its nodes.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.interpreter.models.postprocessing.nodal_forces import (
    NOTHING,
    NodalForces,
    Wrench,
    reactions,
    supported_nodes,
)
from softmark.interpreter.models.postprocessing.reaction_and_work import forces_and_energies
from softmark.interpreter.results.reaction_results import Reaction
from softmark.interpreter.verification.facet_sweep import MOST_UNSURE
from softmark.interpreter.verification.unverified_model_error import NoIndependentFormula
from softmark.interpreter.vocabulary.self_contact_words import Tied
from softmark.solvers.independent_forces.solid_forces import EPS, Floats

if TYPE_CHECKING:
    from softmark.interpreter.problem.body_case import Case
    from softmark.interpreter.verification.by_model.verifier import VerifiedSolution, Verifier

EXACT = 1e-8  # relative to the largest load: allowed imbalance
AGREES = 2.0  # allowed ratio to the solver's residual
ROUNDING = 100.0  # multiple of eps times nodal forces
UNTURNED = "with `rotation = element` the internal forces have a net moment, so moments are not balanced exactly"


def check_balance(verifier: Verifier, found: VerifiedSolution) -> tuple[dict[str, Any], str | None]:
    """Return facts of the balance of supports and loads, and the reason if they do not balance, else None."""
    known = forces_and_energies(found.declared, found.case, found.prepared, found.solution).reactions
    if not known or found.solution.carried is None:
        return {}, None
    carried = found.solution.carried()
    scale, allowed = _force_scale_and_tolerance(carried, known, float(found.solution.facts.get("residual") or 0.0))
    again, noise, unknown = _independent_reactions(verifier, found) if scale != 0.0 else ({}, 0.0, None)
    if unknown is None and scale != 0.0:  # rigidly rotated cells have forces below rounding
        allowed += verifier.rounding(found)
    if scale <= noise:  # only rounding if the body moves rigidly
        why = "the loads are below rounding error" if scale > 0.0 else "no load acts"
        nothing = {"force": 0.0, "moment": 0.0, "allowed": 0.0, "apart": None, "reason": why}
        return {"reactions": nothing}, None
    within = {pair.name for pair in found.case.pairs}  # of whose forces those on one side are told
    outer = {name: own for name, own in known.items() if name not in within}
    force, moment = _relative_imbalance(_resultant_of_reactions_and_loads(carried, outer), carried, scale)
    facts: dict[str, Any] = {"force": force, "moment": moment, "allowed": allowed / scale}
    reason = None
    if not carried.turns_freely:
        facts["note"] = UNTURNED
    if not max(force, moment if carried.turns_freely else 0.0) * scale <= allowed:
        reason = (
            f"supports and loads do not balance: the net force is {force:.1e} of the largest load, and "
            f"the net moment is {moment:.1e} of it times the extent of the body"
        )
        if force * scale <= allowed:
            reason += _pair_moment_note(found)
    if unknown is not None:
        return {"reactions": facts | {"apart": None, "reason": unknown}}, reason
    apart = min(
        _reaction_distance(carried, own, again, scale)
        for own in (known, _reactions_of_rounded_state(found, carried) or known)
    )
    if reason is None and not apart * scale <= max(allowed, _unverified_share(found.case) * scale) + noise:
        reason = (
            f"the reaction of a support differs by {apart:.1e} of the largest load from that of independent formulas"
        )
    return {"reactions": facts | {"apart": apart}}, reason


def _reactions_of_rounded_state(found: VerifiedSolution, carried: NodalForces) -> Mapping[str, Reaction]:
    """Return the reactions in the rounded state of a solution, which independent formulas use; empty without one.

    Reactions found by balancing constraint forces are as free of rounding as the reported ones.
    """
    if carried.written is None:
        return {}
    held = supported_nodes(found.case, found.prepared.mesh, found.declared.thing)
    return reactions(replace(carried, left=carried.written), held)


def _pair_moment_note(found: VerifiedSolution) -> str:
    """Return a note, with a remedy, about moments from forces between parts of a body; "" if there are none.

    Forces along the line between two points have no moment. Forces of ties across a gap do not act along that line, and
    in small strain moments use undeformed positions.
    """
    for pair in found.case.pairs:
        if isinstance(pair.thing, Tied):
            return (
                f"; the tie constraint `{pair.name}` across a gap causes a net moment: let the surfaces "
                "meet before deformation"
            )
        if getattr(found.declared.thing, "strain", None) == "small":
            return f"; with small strain, sliding along `{pair.name}` causes a net moment: write `strain = finite`"
    return ""


def _independent_reactions(
    verifier: Verifier, found: VerifiedSolution
) -> tuple[Mapping[str, Wrench], float, str | None]:
    """Return independent reactions by support, their rounding error, N, and the reason if there are none, or None."""
    try:
        return *verifier.reactions(found), None
    except NoIndependentFormula as unknown:
        return {}, 0.0, str(unknown)


def _unverified_share(case: Case) -> float:
    """Return the fraction of the loads, near borders of loaded areas, that independent formulas cannot verify."""
    return MOST_UNSURE if any(load.thing.action.surface is not None for load in case.loads) else EXACT


def _resultant_of_reactions_and_loads(carried: NodalForces, known: Mapping[str, Reaction]) -> Wrench:
    """Return the sum of the forces and moments of supports and loads."""
    supports = (Wrench(np.array(r.force), np.array(r.moment)) for r in known.values())
    return sum((*supports, *carried.load_resultants.values()), NOTHING)


def _relative_imbalance(left: Wrench, carried: NodalForces, scale: float) -> tuple[float, float]:
    """Return an unbalanced force, and its moment about the centre over the body's extent, relative to `scale`."""
    moment = np.linalg.norm(left.about(carried.middle)) / carried.extent
    return float(np.linalg.norm(left.force)) / scale, float(moment) / scale


def _force_scale_and_tolerance(
    carried: NodalForces, known: Mapping[str, Reaction], residual: float
) -> tuple[float, float]:
    """Return the largest load or reaction, N, including moments over the body's extent, and the allowed imbalance, N.

    The size of a load is the sum of the sizes of its nodal forces: a uniform pressure has no resultant, but is a load.
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


def _reaction_distance(
    carried: NodalForces, known: Mapping[str, Reaction], again: Mapping[str, Wrench], scale: float
) -> float:
    """Return the largest difference of reactions from the independent ones, relative to `scale`."""
    most = 0.0
    for name, own in known.items():
        other = again[name]
        apart = Wrench(np.array(own.force) - other.force, np.array(own.moment) - other.moment)
        most = max(most, *_relative_imbalance(apart, carried, scale))
    return most


def sum_by_support(masks: Mapping[str, Any], left: Floats, x: Floats, axial: bool = False) -> dict[str, Wrench]:
    """Return the sum of residual forces (n, 6), N, at nodes x (n, 3), m, for each support by its mask (n, 6).

    A component that several supports hold counts for the first of them. With `axial`, nodes are rings around the y
    axis, whose other force components cancel.
    """
    found, taken = {}, np.zeros(left.shape, dtype=np.bool_)
    for name, mask in masks.items():
        own = np.where(mask & ~taken, left, 0.0)
        moment = own[:, 3:].sum(axis=0) + np.cross(x, own[:, :3]).sum(axis=0)
        force = own[:, :3].sum(axis=0)
        found[name] = Wrench(force * (0.0, 1.0, 0.0), 0.0 * moment) if axial else Wrench(force, moment)
        taken |= mask
    return found
