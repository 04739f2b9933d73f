"""Stress, strain and stretch of a model held against those of another one, at the same points."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import softmark
from softmark.interpreter.metrics.probe_samples import ProbeSamples
from softmark.interpreter.metrics.stress import Stress
from softmark.interpreter.pipeline.run_options import RunOptions
from softmark.interpreter.pipeline.run_pipeline import run_scene as pipeline
from softmark.interpreter.planning.robustness_plan import find_judging_metrics
from softmark.solvers.stress_recovery.stress_measures import Tensors, TensorsBySide

# incompressible neo-Hooke drawn to twice its length: sigma = mu (k^2 - 1 / k) = 70 kPa per deformed area, 35 kPa per
# area at rest, E = diag(3/2, -1/4, -1/4); where strains are small 60 kPa, both measures, and diag(1, -1/2, -1/2)
BLOCK = """softmark 1
material rubber = neo_hookean(young = 60 kPa, poisson = 0.5, density = 1000 kg/m^3)
body    block = solid(box(size = (20, 20, 20) mm), rubber)
support left  = fixed(block, where = x <= 0 mm, components = x)
support front = fixed(block, where = y <= 0 mm, components = y)
support under = fixed(block, where = z <= 0 mm, components = z)
support right = displaced(block, where = x >= 20 mm, by = (20, 0, 0) mm, components = x)
model large = fem(hex8, strain = finite, formulation = mixed, size = 10 mm)
model small = fem(hex8, strain = small, formulation = mixed, size = 10 mm)
probe inner = point(block, at = (7, 11, 13) mm)
probe whole = volume(block, size = 10 mm)
"""


def run(tmp_path: Path, text: str, only: str | None = None, **options: Any) -> Any:
    file = tmp_path / "a.scene"
    file.write_text(text, encoding="utf-8")
    scene = softmark.load(file)
    given = RunOptions(draw=False, only=(only,) if only else (), **options)
    return pipeline(scene.scene, list(scene.warnings), given)


@pytest.mark.slow
@pytest.mark.long
def test_differences_are_relative_to_the_tensor_that_is_right(tmp_path: Path) -> None:
    report = run(
        tmp_path,
        BLOCK
        + "metric cauchy = stress(inner, component = xx, against = large)\n"
        + "metric across = stress(inner, component = yy, against = large)\n"
        + "metric nominal = stress(whole, component = xx, measure = nominal, against = large)\n"
        + "metric mean = stress(whole, component = xx, over = mean, against = large)\n"
        + "metric green = strain(inner, component = xx, against = large)\n"
        + "metric longer = stretch(whole, component = x, against = large)\n",
    )
    found = {name: metric.value for name, metric in report.models["small"].metrics.items()}
    green = 0.5 / np.linalg.norm([1.5, -0.25, -0.25])
    expected = {
        "cauchy": 10 / 70, "across": 0.0, "nominal": 25 / 35, "mean": 10 / 70, "green": green, "longer": 0.0
    }  # fmt: skip
    assert found == pytest.approx(expected, abs=1e-6)  # the tolerance of Newton's iterations
    cauchy = report.models["small"].metrics["cauchy"]
    assert cauchy.unit == "1"
    assert cauchy.details["difference_Pa"] == pytest.approx(10e3, rel=1e-5)
    assert cauchy.details["size_Pa"] == pytest.approx(70e3, rel=1e-5)
    assert not report.models["large"].metrics  # a model is not held against itself


def test_what_is_not_there_is_said(tmp_path: Path) -> None:
    gap = "metric gap = stress(inner, against = large)\n"
    alone = run(tmp_path, BLOCK + gap, "small").models["small"].metrics["gap"]
    assert alone.value is None
    assert alone.reason is not None
    assert alone.reason.endswith("with `large`, which was left out of this run: add `--model small --model large`")
    idle = run(tmp_path, BLOCK.replace("by = (20, 0, 0) mm", "by = (0, 0, 0) mm") + gap).models["small"].metrics["gap"]
    assert idle.reason == "the value of `large` is zero, so there is no relative error"


@pytest.mark.parametrize(("over", "far"), [("largest", 3.0), ("mean", 1.5)])
def test_an_error_counts_in_the_units_of_what_is_right(over: Any, far: float) -> None:
    """Of a model whose stress is ten times too large: an error of 3 Pa is 3 of the 1 Pa that are right, not 0.3.

    Stresses of 10 Pa and 13 Pa at one point, and of 10 Pa twice at another; the norm bounds von Mises' with sqrt(3/2).
    """

    def field(*pulls: float) -> Any:
        cauchy = np.zeros((len(pulls), 3, 3))
        cauchy[:, 0, 0] = pulls
        rows = np.arange(len(pulls))
        sides = TensorsBySide(
            rows, np.zeros(len(pulls), dtype=np.int64), Tensors(cauchy[:, 0, :1] @ np.eye(1, 6), cauchy, True)
        )
        return SimpleNamespace(sides=lambda _: sides, usual=(10.0, 0.0))

    own, other, right = field(10.0, 10.0), field(13.0, 10.0), field(1.0, 1.0)
    metric, samples = (
        Stress("p", component="xx", over=over, against="m"),
        ProbeSamples(np.zeros((2, 3)), np.full(2, 0.5)),
    )
    assert metric.field_difference(own, other, samples, right) == pytest.approx(1.5**0.5 * far)
    assert metric.extent(own, right, samples) == 10.0


BAR = """softmark 1
material gel   = linear_elastic(young = 1 MPa, poisson = 0.3, density = 1000 kg/m^3)
body     bar   = solid(box(size = (100, 20, 20) mm), gel)
support  wall  = fixed(bar, where = x <= 0 mm)
load     push  = traction(bar, where = x >= 100 mm, vector = (0, 0, -10) Pa)
model    fine  = fem(hex20, strain = small, size = 10 mm)
model    own   = fem(tet10, strain = small, size = 10 mm)
probe    top   = point(bar, at = (50, 10, 20) mm)
metric   gap   = stress(top, component = xx, against = fine)
"""


@pytest.mark.slow
def test_the_stated_error_holds_what_the_truth_would_give(tmp_path: Path) -> None:
    """F (L - x) c / I = 150 Pa is there, whatever either model finds."""
    own = run(tmp_path, BAR, stated=("own",)).models["own"]
    gap, said = own.metrics["gap"], own.stated["gap"]
    right = gap.details["size_Pa"]
    assert said.unit == "1"
    assert abs(gap.value - abs(150.0 - right) / right) <= said.value < 0.05


def test_it_can_tell_right_from_wrong() -> None:
    """As every error relative to a model, it judges a walk to the edges of another."""
    scene = softmark.loads(BAR + "metric much = stress(top)\n").scene
    assert list(find_judging_metrics(scene)) == ["gap"]
