"""Tendons of a beam: their paths, given as arms from the axis at the middle of segments or at guides."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.problem.body_case import Case
from softmark.interpreter.vocabulary.loads.tendon import TendonLoad
from softmark.solvers.energies.energy import Energy, Floats
from softmark.solvers.energies.rod_guides import GuidedTendon
from softmark.solvers.energies.rod_state import chain_elements
from softmark.solvers.energies.rod_tendons import RodTendons

if TYPE_CHECKING:
    from softmark.solvers.energies.incremental_rotation.moving_rods import RodChart

NEAR = 0.2  # of their undeformed distance: nearer guides would touch, far beyond the validity of beam theory


def guide_warnings(declared: Declared, applied: Sequence[tuple[Declared, Energy]], x: Floats) -> tuple[Diagnostic, ...]:
    """Return warnings if a tendon pulls its guides together in a state x (nodes * 7,)."""
    found = []
    for load, energy in applied:
        if isinstance(energy, RodTendons | GuidedTendon) and (least := float(energy.nearest(x).min())) < NEAR:
            found.append(
                diagnostic(
                    "W367",
                    declared.at(),
                    f"the guides of `{load.name}` approach each other to {100 * least:.2g} % of their initial distance"
                    f" in `{declared.name}`",
                    "bent too sharply for the tendon's offset",
                    "contact between guides is not modelled: reduce the tension, or move the tendon closer to the axis",
                )
            )
    return tuple(found)


def tendon(case: Case, action: TendonLoad, rest: Floats, stations: Floats) -> Energy:
    """Return the energy of a tendon along a rod with nodes at stations (n,), m."""
    begin, end = sorted(case.prism.section_coordinates(p) for p in (action.begin, action.end))
    first, last, span = np.array(begin[1:]), np.array(end[1:]), end[0] - begin[0]
    if action.guides is not None:
        t = np.linspace(0.0, 1.0, action.guides)
        places = begin[0] + span * t
        nodes = np.abs(stations - places[:, None]).argmin(axis=1)
        arms, _ = _tendon_arms(first, last, action.winding, t)
        arms[:, 0] = places - stations[nodes]
        return GuidedTendon(rest, nodes, arms, action.tension)
    low, high = (np.clip(s, begin[0], end[0]) for s in (stations[:-1], stations[1:]))
    shares = (high - low) / np.diff(stations)
    arms, slopes = _tendon_arms(first, last, action.winding, (0.5 * (low + high) - begin[0]) / span)
    tension = np.array([action.tension])
    return RodTendons(rest, chain_elements(len(stations)), arms[None], slopes[None] / span, shares[None], tension)


def _tendon_arms(first: Floats, last: Floats, winding: float, t: Floats) -> tuple[Floats, Floats]:
    """Return the arms of a tendon from the axis (m, 3), m, in material axes, and their derivatives by t.

    `first` and `last` (2,), m, are its places in the first and the last section without winding, and t (m,)
    fractions of its length. The straight line between the places is rotated by the fraction t of the angle
    `winding`.
    """
    c, s = np.cos(winding), np.sin(winding)
    unwound = np.array([c * last[0] + s * last[1], c * last[1] - s * last[0]])
    line, way = (1.0 - t)[:, None] * first + t[:, None] * unwound, unwound - first
    c, s = np.cos(winding * t), np.sin(winding * t)
    arms, slopes = np.zeros((2, len(t), 3))
    arms[:, 1], arms[:, 2] = c * line[:, 0] - s * line[:, 1], s * line[:, 0] + c * line[:, 1]
    slopes[:, 1] = c * way[0] - s * way[1] - winding * arms[:, 2]
    slopes[:, 2] = s * way[0] + c * way[1] + winding * arms[:, 1]
    return arms, slopes


def tendon_in_rotational_unknowns(energy: Energy, chart: RodChart) -> Energy:
    """Return the energy of a tendon in terms of rotational unknowns."""
    if isinstance(energy, RodTendons):
        from softmark.solvers.energies.incremental_rotation.moving_rod_tendons import MovingRodTendons

        return MovingRodTendons(chart, energy)
    from softmark.solvers.energies.incremental_rotation.moving_rod_loads import MovingGuidedTendon

    assert isinstance(energy, GuidedTendon)
    return MovingGuidedTendon(chart, energy)
