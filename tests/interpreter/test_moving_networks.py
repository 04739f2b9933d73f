"""Networks in motion: one beam cut in two, momenta of a free star, the same seen from another side."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import softmark
from softmark.interpreter.models.model_builders import build
from softmark.interpreter.models.procedures.dynamic_analysis import DynamicAnalysis
from softmark.interpreter.models.shared.prepared_model import BuildContext
from softmark.interpreter.problem.body_case import case_for
from softmark.solvers.dynamics.integrator import Motion
from softmark.solvers.dynamics.time_integration import march

HEAD = """softmark 1
scene "frames that move"
material gum = linear_elastic(young = 1 MPa, poisson = 0.3, density = 1000 kg/m^3)
"""
STAR = np.array([[0.0, 0.0, 0.0], [0.5, 0.0, 0.0], [-0.1, 0.4, 0.0], [0.1, 0.1, 0.45]])


def run(text: str) -> dict[str, Any]:
    models = softmark.loads(HEAD + text).run().models
    assert {n: m.message for n, m in models.items() if m.status != "converged"} == {}
    return dict(models)


def prepared(text: str) -> DynamicAnalysis:
    scene = softmark.loads(HEAD + text).scene
    declared = scene.declared["m"]
    found = build(declared, case_for(scene, declared), BuildContext(scene=scene))
    assert isinstance(found, DynamicAnalysis)
    return found


def vector(v: Any) -> str:
    return "(" + ", ".join(f"{c:.15g}" for c in v) + ")"


def star(R: np.ndarray) -> str:
    """Three arms of a rectangular section from one point, turned by R; its sections are upright along R z."""
    points = ", ".join(vector(R @ p) for p in STAR)
    return (
        f"body net = network([{points}] m, [(1, 2), (3, 1), (1, 4)], gum, side = 4 cm, height = 2 cm, "
        f"up = {vector(R @ [0.0, 0.0, 1.0])})\n"
    )


@pytest.mark.long
@pytest.mark.slow
def test_a_beam_of_two_members_moves_as_one() -> None:
    """A cantilever that falls by half its length, as `beam6dof` has it: by the same steps, to what these leave."""
    models = run("""body net = network([(0, 0, 0), (0.5, 0, 0), (1, 0, 0)] m, [(1, 2), (2, 3)], gum, side = 4 cm)
body box = solid(box(size = (1, 0.04, 0.04) m, origin = (0, -0.02, -0.02) m), gum)
support a = fixed(net, where = x <= 0 m)
support b = fixed(box, where = x <= 0 m)
load weight = gravity(9.81 m/s^2)
analysis fall = dynamic(duration = 0.2 s, step = 10 ms, integrator = midpoint)
model frame = frame6dof(segments = 4, body = net)
model rod = beam6dof(segments = 8, body = box)
probe one = point(net, at = (1, 0, 0) m)
probe two = point(box, at = (1, 0, 0) m)
metric here = displacement(one, along = -z)
metric there = displacement(two, along = -z)
""")
    here, there = models["frame"].metrics["here"].value, models["rod"].metrics["there"].value
    assert there > 0.1
    assert here == pytest.approx(there, rel=1e-8)


@pytest.mark.slow
def test_momenta_of_a_free_star() -> None:
    """Three arms that spin and bend, nothing holds them: by midpoint both momenta to rounding, energy to 1 %.

    Angular momentum is that of places and of sections, about the points' axes (Simo and Wong 1991).
    """
    model = prepared(star(np.eye(3)) + """analysis fly = dynamic(duration = 0.1 s, step = 1 ms, integrator = midpoint,
    velocity = (0.3, 0, 0) m/s, spin = (3, 6, 10) rad/s)
model m = frame6dof(segments = 4)
probe tip = point(net, at = (0.5, 0, 0) m)
""")  # fmt: skip
    static: Any = model.static
    problem, layout = model.problem, static.layout
    rotations: Any = problem.turning
    v = np.array(problem.velocity).reshape(-1, 6)
    v[1, 2] += 1.0  # an arm is struck
    problem.velocity[:] = v.ravel()
    M = np.asarray(problem.mass).reshape(-1, 6)

    def seen(motion: Motion) -> np.ndarray:
        x = rotations.chart.state(motion.x)
        p, at = M * motion.v.reshape(-1, 6), x.reshape(-1, 7)[layout.first, :3]
        turning = np.einsum("pij,pj->i", layout.frames(x), p[:, 3:])
        return np.array([p[:, :3].sum(axis=0), np.cross(at, p[:, :3]).sum(axis=0) + turning])

    track = march(problem, 0.1, 1e-3, seen)
    found = np.array(track.observed)
    assert np.abs(found[:, 0] - found[0, 0]).max() < 1e-11 * np.abs(found[0, 0]).max()
    assert np.linalg.norm(found[:, 1] - found[0, 1], axis=1).max() < 1e-9 * np.linalg.norm(found[0, 1])
    energy = track.energies["kinetic"] + track.energies["strain"]
    assert np.ptp(energy) < 0.01 * energy[0]
    assert track.energies["strain"].max() > 0.01 * energy[0]
    for mass in layout.mass().reshape(-1, 6):
        assert mass[0] == mass[1] == mass[2] > 0.0
        assert mass[3:].min() > 0.0


def _struck(R: np.ndarray) -> np.ndarray:
    """Where the end of an arm of a held star is, 40 ms after a sudden force, turned back."""
    where = " and ".join(
        f"{c} >= {v - 1e-9:.15g} m and {c} <= {v + 1e-9:.15g} m" for c, v in zip("xyz", R @ STAR[2], strict=True)
    )
    model = run(star(R) + f"""support wall = fixed(net, where = {where})
load push = point_force(net, at = {vector(R @ STAR[3])} m, vector = {vector(R @ [150.0, 50.0, -100.0])} N)
analysis fly = dynamic(duration = 40 ms, step = 2 ms, integrator = generalized_alpha)
model m = frame6dof(segments = 3)
probe tip = point(net, at = {vector(R @ STAR[1])} m)
metric ux = displacement(tip, along = +x)
metric uy = displacement(tip, along = +y)
metric uz = displacement(tip, along = +z)
""")["m"]  # fmt: skip
    return R.T @ np.array([model.metrics[f"u{c}"].value for c in "xyz"])


@pytest.mark.slow
def test_it_moves_alike_seen_from_another_side() -> None:
    """All of it turned: the frames of points are others, and the motion is the same, to 1e-6 of it."""
    a, b = 0.4, 1.3
    R = np.array([[math.cos(a), -math.sin(a), 0.0], [math.sin(a), math.cos(a), 0.0], [0.0, 0.0, 1.0]]) @ np.array(
        [[1.0, 0.0, 0.0], [0.0, math.cos(b), -math.sin(b)], [0.0, math.sin(b), math.cos(b)]]
    )
    plain = _struck(np.eye(3))
    assert np.linalg.norm(plain) > 3e-3
    np.testing.assert_allclose(_struck(R), plain, atol=1e-9)


@pytest.mark.slow
def test_at_rest_it_is_as_stiff_as_at_rest() -> None:
    """The tangent in motion, about the axes of points, is that of statics: its kernels and numpy agree."""
    model = prepared(star(np.eye(3)) + """analysis fly = dynamic(duration = 0.1 s, step = 1 ms)
support wall = fixed(net, where = y >= 0.4 m)
model m = frame6dof(segments = 3)
probe tip = point(net, at = (0.5, 0, 0) m)
""")  # fmt: skip
    problem: Any = model.static
    K = model.problem.assembly.tangent(np.zeros(model.problem.assembly.dofs), 1.0).toarray()
    still = problem.problem.assembly.tangent(problem.layout.rest, 1.0).toarray()
    np.testing.assert_allclose(K, still, atol=1e-12 * np.abs(still).max())
