"""Every reduced model is as near to the full model as it estimates, or it has no answer: 240 random ones, in 60 scenes.

The truth is the full model of the same scene, solved for itself. Nodes are compared, at the end and in all frames.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import softmark
from softmark.interpreter.verification.by_model.reduced_verifier import DOUBTFUL, LARGEST
from softmark.interpreter.verification.error_estimate import LEFT

QUICK = (0, 1, 2, 3)
SCENES = 60
SOLVED = 1e-5  # relative: what the tolerance 1e-8 of both solutions leaves in displacements of slender bodies


def scene_of(seed: int) -> str:
    """A random clamped bar under random loads, at rest or in motion, and four reduced models of it."""
    rng = np.random.default_rng([38, seed])
    length, wide, high = rng.uniform(50, 120), rng.uniform(8, 20), rng.uniform(8, 20)
    size = min(wide, high) / rng.choice([1.0, 1.0, 2.0]) * 1.001
    finite = rng.random() < 0.3
    law, strain = ("neo_hookean", "finite") if finite else ("linear_elastic", rng.choice(["corotational", "small"]))
    young = 10 ** rng.uniform(4.5, 6.5)
    down = rng.normal(size=3) * [0.3, 1.0, 1.0]
    moving = rng.random() < 0.4
    course = f", amplitude = ramp(over = {rng.uniform(20, 100):.3g} ms)" if moving else ""
    lines = [
        f"material gel = {law}(young = {young:.6g} Pa, poisson = {rng.uniform(0, 0.45):.3f}, density = 1000 kg/m^3)",
        f"body b = solid(box(size = ({length:.6g}, {wide:.6g}, {high:.6g}) mm), gel)",
        "support wall = fixed(b, where = x <= 0 mm)",
        f"load w = gravity({10 ** rng.uniform(-0.5, 1.3):.4g} m/s^2, direction = ({down[0]:.4f}, {down[1]:.4f}, "
        f"{down[2]:.4f}){course})",
    ]
    if rng.random() < 0.5:
        vector = rng.normal(size=3) * young * 1e-4
        lines.append(f"load t = traction(b, where = x >= {length:.6g} mm, vector = ({vector[0]:.4g}, {vector[1]:.4g}, "
                     f"{vector[2]:.4g}) Pa{course})")  # fmt: skip
    if moving:
        integrator = rng.choice(["generalized_alpha", "trapezoidal", "bdf2", "implicit_euler", "newmark"])
        damping = f", damping_mass = {rng.uniform(0, 10):.3g} Hz" if rng.random() < 0.5 else ""
        lines.append(f"analysis a = dynamic(duration = {rng.uniform(0.05, 0.3):.3g} s, "
                     f"step = {rng.uniform(2, 8):.2g} ms, integrator = {integrator}{damping})")  # fmt: skip
    lines.append(f"model full = fem(hex8, strain = {strain}, size = {size:.6g} mm)")
    sampled = "" if strain == "small" else ", cells = sampled"
    ways = [
        f"modal(of = full, modes = {rng.integers(1, 6)}, derivatives = no)",
        f"modal(of = full, modes = {rng.integers(1, 12)})",
        f"pod(of = full, training = [{rng.uniform(0.2, 1.2):.3g}], modes = 1)",
        f"pod(of = full, modes = {rng.integers(1, 5)}{sampled})",
    ]
    lines += [f"model r{i} = {way}" for i, way in enumerate(ways)]
    return "\n".join([*lines, f"probe p = point(b, at = ({length:.6g}, 0, 0) mm)", ""])


def motion(model: Any) -> np.ndarray:
    """Displacements of all nodes at the end, and of a motion at its frames (t, n, 3), m."""
    mesh = model.mesh
    return mesh.displacement[None] if mesh.frames is None else np.concatenate([mesh.frames, mesh.displacement[None]])


def distance(one: Any, other: Any) -> tuple[float, float]:
    """The largest distance of a node of two models, m, and the largest displacement of the first."""
    a, b = motion(one), motion(other)
    return float(np.linalg.norm(a - b, axis=-1).max()), float(np.linalg.norm(a, axis=-1).max())


def judge(seed: int) -> list[str]:
    """Which reduced models of a scene are farther from the full model than they say."""
    report = softmark.loads(scene_of(seed)).run()
    full, wrong = report.models["full"], []
    if full.status != "converged":
        return []
    for name, model in report.models.items():
        if name == "full" or model.status != "converged":
            continue
        known = model.solve["reduced"]
        warned = any(w.code == "W419" and f"`{name}`" in w.message for w in report.warnings)
        apart, size = distance(model, full)
        estimate = known["estimated_error"]
        if estimate > LARGEST or (estimate > DOUBTFUL and not warned):
            wrong.append(f"{name} estimates {estimate:.2g} without a word")
        if apart > (LEFT * (estimate + estimate**2) + SOLVED) * size:
            wrong.append(f"{name} is off by {apart / size:.3g}, and estimates {estimate:.3g}")
    return wrong


@pytest.mark.parametrize("seed", QUICK)
def test_reduced_models_are_as_near_as_they_estimate(seed: int) -> None:
    assert judge(seed) == []


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(len(QUICK), SCENES))
def test_many_more_reduced_models_are_as_near_as_they_estimate(seed: int) -> None:
    assert judge(seed) == []
