"""Report of a trajectory: iterations, residuals, energies, momentum, impacts and friction."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.interpreter.results.even_thinning import pick_evenly

if TYPE_CHECKING:
    from softmark.interpreter.problem.body_case import Case
    from softmark.solvers.dynamics.trajectory import ContactHistory, Trajectory

MOMENTS = 200  # number of times at which a report has energies
BOUNCES = 50  # largest number of impacts in a report


def solve_report(track: Trajectory, tolerance: float) -> dict[str, Any]:
    """Return the `solve` part of a report. Residuals of solved steps are reported as at most the tolerance."""
    left = np.where(track.solved, np.minimum(track.residuals, tolerance), track.residuals)
    facts: dict[str, Any] = {
        "iterations": int(track.iterations.sum()),
        "steps": len(track.steps),
        "residual": float(left.max()) if len(left) else None,
        "lagged": int(track.lagged.sum()),
        "fallbacks": int(track.fallbacks),
        "unsolved": int((~track.solved).sum()),
        "reached_s": float(track.times[-1]) if len(track.times) else 0.0,
        "events": [{"time": e.time, "what": e.text} for e in track.events[:200]],
        "halved": len(track.events),
    }
    if len(track.times):
        some = pick_evenly(len(track.times), MOMENTS)
        facts["times"] = track.times[some].tolist()
        facts["energies"] = {name: values[some].tolist() for name, values in track.energies.items()}
        facts["energy"] = track.balance.facts
        facts["drift_J"] = float(track.energies["drift"][-1])
    if track.touched is not None:
        facts["momentum"] = _momentum_report(track.touched)
    if track.impacts is not None:
        facts["impacts"] = [
            {"begin_s": b.begin, "end_s": b.end, "before_m_s": b.before.tolist(), "after_m_s": b.after.tolist(),
             "restitution": b.restitution}
            for b in track.impacts[:BOUNCES]
        ]  # fmt: skip
    return facts


def _momentum_report(touched: ContactHistory) -> dict[str, Any]:
    """Return the momentum balance of the deformable body, N s: momentum change, and impulses of its causes.

    `off` is the imbalance relative to the largest of these, about the solver tolerance; with supports, bdf2,
    generalised-alpha and implicit Euler add the impulse of one step.
    """
    each = dict(zip(("contacts_Ns", "loads_Ns", "supports_Ns", "damping_Ns"), touched.impulses, strict=True))
    missing = float(np.linalg.norm(touched.change - touched.impulses.sum(axis=0)))
    most = max(float(np.linalg.norm(one)) for one in (touched.change, *touched.impulses))
    told = {"change_Ns": touched.change.tolist()} | {name: one.tolist() for name, one in each.items()}
    return told | {"off": missing / most if most else 0.0}


def friction_report(track: Trajectory, case: Case) -> dict[str, Any]:
    """Return the report of friction of every contact, at the times of the energies; empty without friction."""
    if not track.rubbed:
        return {}
    meet: tuple[Any, ...] = (*case.contacts, *case.pairs)
    names = [touch.name for touch in meet if getattr(touch.thing, "friction", 0.0)]
    own = [track.rubbed[i] for i in pick_evenly(len(track.times), MOMENTS)]
    each = {name: [seen[k] for seen in own] for k, name in enumerate(names)}
    return {"friction": {n: {"slip_m": [s.slip for s in seen], "sticks": [s.sticks for s in seen]}
                         for n, seen in each.items()}}  # fmt: skip
