"""Solids that remember, for the watchdog: the stress of their past by its integral (solvers/checks/hereditary.py)."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import numpy as np

from softmark.interpreter.evidence.unchecked import Unchecked
from softmark.interpreter.models.shared.prepared import Moved
from softmark.interpreter.problem.case import Case
from softmark.solvers.checks import solids
from softmark.solvers.checks.hereditary import Course, RememberingBody, RememberingPressed
from softmark.solvers.checks.pressures import Pressed, isochoric

MOST = 2e9  # numbers that a past may be looked through


def course_of(case: Case, strain: str, mesh: Moved, points: int) -> Course:
    """How a body of one material that relaxes came to where it is. Raises Unchecked."""
    material = case.material
    past = getattr(mesh, "past", None)
    if past is None:
        raise Unchecked("how it came there is not known")
    if len(past.times) * points * 9.0 > MOST:
        raise Unchecked(f"its past of {len(past.times)} steps is too long to look through")
    g, tau = (np.array(column) for column in zip(*material.branches, strict=True))
    return Course(past.times, past.states, _part(material, strain), g, tau, strain == "small", case.depth)


def _part(material: Any, strain: str) -> solids.Stress:
    """The stress that relaxes: by formulas of the checks where they have one, else by the law of the material."""
    E, nu = material.young, material.poisson
    mu, lam = E / (2.0 * (1.0 + nu)), 0.0 if nu == 0.5 else E * nu / ((1.0 + nu) * (1.0 - 2.0 * nu))
    if strain == "small":
        return solids.small_stress(mu, lam if material.of == "whole" else -2.0 / 3.0 * mu)
    own = None if material.of == "whole" else isochoric(material.law, mu)
    if own is not None:
        return own
    from softmark.solvers.materials.relaxing import series_of

    return series_of(material, strain).part.P


def remembering(made: Any, course: Course) -> Any:
    """A body that is checked, with its past."""
    cls = RememberingPressed if isinstance(made, Pressed) else RememberingBody
    known = {f.name: getattr(made, f.name) for f in fields(made)}
    return cls(**known, course=course)
