"""Stated errors beside closed forms: sharp, and known of stresses, energies and torques."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import pytest

import softmark
from softmark.interpreter.pipeline.run_pipeline import RunOptions, run_scene

sys.path.insert(0, str(Path(__file__).parents[1] / "benchmarks"))
import closed_forms

SHARP = 4.0  # times the true error: twice what theory has of an order of 2, and a chance at one point


def stated(case: Any) -> list[dict[str, tuple[float, float]]]:
    """By model, of every quantity: the true error and the stated one, which it must not be larger than."""
    scene = softmark.loads(case.scene().replace("softmark 1\n", ""))
    names = tuple(f"m{i}" for i in range(len(case.models)))
    report, found = run_scene(scene.scene, list(scene.warnings), RunOptions(draw=False, stated=names)), []
    for name in names:
        model, own = report.models[name], {}
        for metric, (_, truth, scale) in case.truths.items():
            said, value = model.stated[f"q_{metric}"], model.metrics[f"q_{metric}"].value
            assert said.value is not None, said.reason
            off = abs(value - truth)
            assert off <= said.value + 1e-9 * scale
            own[metric] = off / scale, said.value / scale
        found.append(own)
    return found


@pytest.mark.slow
@pytest.mark.long
def test_hoop_stress_with_pressures_as_unknowns_is_settled() -> None:
    """0.71 % off in an incompressible cylinder: 31 % was stated, of the tensor on coarser meshes; at 3 mm none."""
    models = ("quad8, formulation = mixed, strain = small, size = 2 mm",)
    (own,) = stated(closed_forms.cylinder("cylinder", "held", 0.5, models))
    for metric in ("ui", "hoop", "W"):
        off, said = own[metric]
        assert said <= SHARP * off + 1e-5  # that much is the strain measure


@pytest.mark.slow
@pytest.mark.long
def test_a_smooth_ball_has_what_its_cells_make() -> None:
    """Displacements of a ball under pressure are linear: the energy alone is off, by the volume that cells miss."""
    (own,) = stated(closed_forms.ball("ball", "held", ("hex8, strain = small, size = 2.5 mm",)))
    assert own["u"][1] < 1e-5  # 2.1 % was stated, for the area that facets miss
    assert own["W"][1] <= SHARP * own["W"][0]  # 56 % for 2.9 %


@pytest.mark.slow
@pytest.mark.long
def test_a_torque_is_stated_to_be_off_by_less_on_a_finer_mesh() -> None:
    """Two coarse meshes agreed by chance: 1e-12 was stated, and 4 % of half the size."""
    models = tuple(f"hex20, strain = small, size = {size}" for size in ("5 mm", "2.5 mm"))
    coarse, fine = stated(closed_forms.torsion("torsion", "tune", models))
    for metric in ("T", "tau", "W"):
        assert fine[metric][1] < 0.5 * coarse[metric][1]
        assert fine[metric][1] <= SHARP * fine[metric][0]
