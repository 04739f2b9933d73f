"""Directions of fibres found again for the watchdog, by formulas of their own, and forces of what is made of them."""

from __future__ import annotations

from typing import Any

import numpy as np

from softmark.interpreter.evidence.graded import values
from softmark.interpreter.evidence.unchecked import Unchecked
from softmark.interpreter.language.profiles import Streams
from softmark.interpreter.problem.case import Case
from softmark.interpreter.vocabulary.fibres import Helix
from softmark.solvers.checks import fibres
from softmark.solvers.checks.pressures import Pressed
from softmark.solvers.checks.solids import CheckedBody, Floats, StressTerm
from softmark.solvers.checks.varying import VaryingPressed
from softmark.solvers.materials.active import Active

HALVINGS = 60


def vectors(direction: Any, X: Floats) -> tuple[Floats, Floats | None]:
    """A direction at points X (n, 3), m, of any length (n, 3), and sheets by the same rule. Raises Unchecked."""
    match direction:
        case Helix():
            return wound(direction, X)
        case Streams(components=parts):
            return np.stack([values(part, X) for part in parts], axis=1), None
        case tuple():
            return np.broadcast_to(np.array(direction, dtype=float), X.shape), None
    raise Unchecked(f"there is no other formula for fibres by {type(direction).__name__}")


def wound(rule: Helix, X: Floats) -> tuple[Floats, Floats]:
    """Tangents of x = (a(t) sin u cos v, a(t) sin u sin v, b(t) cos u), at an angle, and the ellipsoids' normals."""
    e3 = np.array(rule.axis)
    e1 = np.cross(e3, np.eye(3)[np.argmin(np.abs(e3))])
    e1 /= np.linalg.norm(e1)
    Q = np.stack([e1, np.cross(e3, e1), e3])  # rows: the axes of the ellipsoids
    x, y, z = Q @ (X - np.array(rule.origin)).T
    low, high = np.full(len(X), -0.5), np.full(len(X), 1.5)
    for _ in range(HALVINGS):
        t = 0.5 * (low + high)
        a = rule.inner + t * (rule.outer - rule.inner)
        b = rule.inner_along + t * (rule.outer_along - rule.inner_along)
        inside = (x**2 + y**2) / a**2 + z**2 / b**2 < 1.0
        low, high = np.where(inside, low, t), np.where(inside, t, high)
    u, v = np.arctan2(np.hypot(x, y) / a, z / b), np.arctan2(y, x)
    by_u = np.stack([a * np.cos(u) * np.cos(v), a * np.cos(u) * np.sin(v), -b * np.sin(u)], axis=1)
    by_v = np.stack([-np.sin(v), np.cos(v), 0.0 * v], axis=1)
    up = -by_u / np.linalg.norm(by_u, axis=1, keepdims=True)  # u is 0 at the tip of the axis
    angle = (rule.endo + np.clip(t, 0.0, 1.0) * (rule.epi - rule.endo))[:, None]
    return (np.cos(angle) * by_v + np.sin(angle) * up) @ Q, np.cross(by_v, up) @ Q


def axes_of(material: Any) -> fibres.Axes:
    """What tells the axes of a material at points: along the fibres, and across them as sheets lie."""
    own = material.own if isinstance(material, Active) and material.own is not None else None
    law = material.law if isinstance(material, Active) else material
    if own is not None:
        raise Unchecked("there is no other formula for muscle with fibres of its own")

    def axes(X: Floats) -> Floats:
        f, known = vectors(law.fibres, X)
        s = known if law.sheets is None else vectors(law.sheets, X)[0]
        f = f / np.linalg.norm(f, axis=1, keepdims=True)
        if s is None:  # any will do
            s = np.cross(f, np.eye(3)[np.argmin(np.abs(f), axis=1)])
        n = np.cross(f, s)
        n /= np.linalg.norm(n, axis=1, keepdims=True)
        return np.stack([f, np.cross(n, f), n], axis=1)

    return axes


def _known(case: Case) -> Any:
    material = case.material
    if not fibres.known(material):
        raise Unchecked(f"there is no other formula for a {type(material).__name__} of this law")
    return material


def body_of(case: Case, points: Floats, cells: Any, kind: str, u: Floats) -> CheckedBody:
    """Some cells of one material, deformed. Raises Unchecked."""
    material = _known(case)
    mu = material.shear_modulus
    stiff = 6.0 * mu + 9.0 * abs(material.lame_lambda)
    term = (StressTerm(lambda F: F),)
    return fibres.DirectedBody(points, cells, kind, u, term, stiff, False, case.depth, material, axes_of(material))


def pressed_of(case: Case, points: Floats, cells: Any, kind: str, u: Floats, pressures: Floats | None) -> Pressed:
    """The same with pressures. Raises Unchecked."""
    material = _known(case)
    axes, mu = axes_of(material), material.shear_modulus
    anywhere = fibres.split_of(material, np.eye(3)[None])
    return VaryingPressed(
        points, cells, kind, u, anywhere, mu, pressures, case.depth,
        apart=lambda X: fibres.split_of(material, axes(X)),
    )  # fmt: skip
