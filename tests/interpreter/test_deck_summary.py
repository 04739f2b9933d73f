"""What other programs are told of a model: all that its answer follows from, or why it cannot be told."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import softmark
from softmark.interpreter.models.external.problem_transfer import NotTransferable, problem_of, untransferable_features
from softmark.interpreter.models.model_preparation import prepared_model
from softmark.interpreter.models.shared.prepared_model import BuildContext
from softmark.interpreter.problem.body_case import case_for

BAR = """
softmark 1
scene "A bar of two materials"
material soft = neo_hookean(young = 10 kPa, poisson = 0.3, density = 1000 kg/m^3)
material hard = neo_hookean(young = 30 kPa, poisson = 0.2, density = 1200 kg/m^3)
body bar = solid(box(size = (30, 10, 10) mm), soft)
region half = part(bar, where = x >= 15 mm, material = hard)
support wall = fixed(bar, where = x <= 0 mm)
support pull = displaced(bar, where = x >= 30 mm, by = (1 mm, 0 mm, 0 mm), components = x)
load weight = gravity(9.81 m/s^2, direction = -z)
load push = traction(bar, where = z >= 10 mm, vector = (0, 20, 5) Pa)
analysis rest = static()
model small = fem(tet4, strain = small, size = 5 mm)
model large = fem(tet4, strain = finite, size = 5 mm)
model turning = fem(tet4, strain = corotational, size = 5 mm)
"""


def prepared(text: str, name: str) -> Any:
    """A model of a scene, prepared, with its case."""
    scene = softmark.loads(text).scene
    declared = scene.declared[name]
    case = case_for(scene, declared)
    return prepared_model(declared, case, BuildContext(scene=scene))[0], case


def by_hand(problem: Any) -> Any:
    """Displacements (n, 3), m, of linear tetrahedra in small strain, dense: from what was told alone."""
    n = len(problem.points)
    K, f = np.zeros((3 * n, 3 * n)), problem.forces.ravel()
    for stuff in problem.stuff:
        E, nu = stuff.constants["young"], stuff.constants["poisson"]
        mu, lam = E / 2 / (1 + nu), E * nu / (1 + nu) / (1 - 2 * nu)
        for cell in problem.cells[stuff.cells]:
            corners = np.hstack([np.ones((4, 1)), problem.points[cell]])
            G, volume = np.linalg.inv(corners)[1:].T, np.linalg.det(corners) / 6  # gradients (4, 3)
            k = mu * (np.einsum("ak,bk,ij->aibj", G, G, np.eye(3)) + np.einsum("aj,bi->aibj", G, G))
            k += lam * np.einsum("ai,bj->aibj", G, G)
            dofs = (3 * cell[:, None] + np.arange(3)).ravel()
            K[np.ix_(dofs, dofs)] += volume * k.reshape(12, 12)
    held = 3 * problem.held[:, 0] + problem.held[:, 1]
    free = np.setdiff1d(np.arange(3 * n), held)
    u = np.zeros(3 * n)
    u[held] = problem.values
    u[free] = np.linalg.solve(K[np.ix_(free, free)], f[free] - K[np.ix_(free, held)] @ problem.values)
    return u.reshape(-1, 3)


def test_what_is_told_is_all_that_the_answer_follows_from() -> None:
    """A dense solution from the arrays alone is ours: two materials, weight, a traction, a moved face.

    1e-9: both are direct solutions of one linear system, ours to the analysis' tolerance of 1e-8 of the forces.
    """
    solid, case = prepared(BAR, "small")
    problem = problem_of(solid, case)
    assert [s.law for s in problem.stuff] == ["linear_elastic"] * 2
    assert sorted(np.concatenate([s.cells for s in problem.stuff])) == list(range(len(problem.cells)))
    ours = solid.solve(lambda *_: None).mesh.displacement
    assert np.abs(by_hand(problem) - ours).max() < 1e-9 * np.abs(ours).max()


def test_finite_strain_tells_the_law_by_its_word() -> None:
    problem = problem_of(*prepared(BAR, "large"))
    assert [(s.law, s.constants, s.density) for s in problem.stuff] == [
        ("neo_hookean", {"young": 1e4, "poisson": 0.3}, 1000.0),
        ("neo_hookean", {"young": 3e4, "poisson": 0.2}, 1200.0),
    ]
    assert problem.strain == "finite"
    assert problem.element == "tet4"


def test_what_has_no_words_is_not_told() -> None:
    with pytest.raises(NotTransferable, match="corotational"):
        problem_of(*prepared(BAR, "turning"))


@pytest.mark.parametrize(
    ("before", "after", "what"),
    [
        ("analysis rest = static()", "analysis rest = dynamic(duration = 1 s, step = 10 ms)", "dynamic"),
        ("displaced(bar, where = x >= 30 mm, by = (1 mm, 0 mm, 0 mm), components = x)",
         "rotated(bar, where = x >= 30 mm, axis = +x, angle = 30 deg)", "support `pull`"),
        ("traction(bar, where = z >= 10 mm, vector = (0, 20, 5) Pa)",
         "pressure(bar, where = z >= 10 mm, magnitude = 5 Pa)", "load `push`"),
        ("strain = finite,", "strain = finite, max_iterations = 3,", "max_iterations"),
        ("young = 10 kPa", "young = 10 kPa * (2 + x / 15 mm)", "NeoHookean"),
    ],
)  # fmt: skip
def test_each_thing_that_cannot_be_told_is_named(before: str, after: str, what: str) -> None:
    scene = softmark.loads(BAR.replace(before, after)).scene
    declared = scene.declared["large"]
    assert any(what in found for found, _ in untransferable_features(declared.thing, case_for(scene, declared)))
