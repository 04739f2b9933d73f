"""Arguments of the wrong type, sign or size are one error of our own, at once; and what can be pickled."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import softmark

BEAM = """
param    n = 4
param    L = 120 mm
material gel  = neo_hookean(young = 80 kPa, poisson = 0.3, density = 1000 kg/m^3)
body     beam = solid(cylinder(length = L, radius = 10 mm), gel)
support  wall = fixed(beam, where = x <= 0 mm and not z > 1 m)
load     pull = gravity(9.81 m/s^2, direction = -z)
model    rod  = beam6dof(segments = n)
reference theory = simo_reissner(beam)
probe    axis = line(beam, from = (0, 0, 0) mm, to = (L, 0 mm, 0 mm), points = 5)
metric   eta  = relative_l2_error(axis, against = theory)
"""
NAN = float("nan")


@pytest.fixture(scope="module")
def beam() -> Any:
    return softmark.loads(BEAM)


@pytest.mark.parametrize(("call", "said"), [
    (lambda b: softmark.load(3), "`file` must be the file of a scene"),
    (lambda b: softmark.load(b"beam.scene"), "`file` must be the file of a scene"),
    (lambda b: softmark.load(None), "`file` must be"),
    (lambda b: softmark.load(""), "`file` must be"),
    (lambda b: softmark.load("silicone-beam", L=None), "`L` must be a parameter"),
    (lambda b: softmark.load("silicone-beam", L=[1, 2]), "`L` must be a parameter"),
    (lambda b: softmark.load("silicone-beam", L=True), "`L` must be a parameter"),
    (lambda b: softmark.loads(BEAM, n=NAN), "`n` must be a parameter"),
    (lambda b: softmark.loads(BEAM.encode()), "`text` must be the text of a scene"),
    (lambda b: b.run(models=3), "`models` must be the name of a model"),
    (lambda b: b.run(models=["rod", 3]), "`models` must be"),
    (lambda b: b.run(models={"rod": 1}), "`models` must be"),
    (lambda b: b.run(models=[]), "`models` is empty"),
    (lambda b: b.run(repeat=0), "`repeat` must be a whole number from 1 to 1000, not 0 (int)"),
    (lambda b: b.run(repeat=-1), "`repeat` must be"),
    (lambda b: b.run(repeat=2.5), "`repeat` must be"),
    (lambda b: b.run(repeat="3"), "`repeat` must be"),
    (lambda b: b.run(repeat=True), "`repeat` must be"),
    (lambda b: softmark.compare(), "needs a scene"),
    (lambda b: softmark.compare(3), "`file` must be"),
    (lambda b: softmark.compare(b, jobs=0), "`jobs` must be a whole number from 1 to 1000, not 0 (int)"),
    (lambda b: softmark.compare(b, jobs=-2), "`jobs` must be"),
    (lambda b: softmark.compare(b, jobs="2"), "`jobs` must be"),
    (lambda b: softmark.compare(b, repeats=-1), "`repeats` must be a whole number from 0"),
    (lambda b: softmark.compare(b, timeout=0), "`timeout` must be a positive number of seconds or None"),
    (lambda b: b.run(stated=1), "`stated` must be True or False"),
    (lambda b: softmark.compare(b, timeout=NAN), "`timeout` must be"),
    (lambda b: softmark.compare(b, timeout="60"), "`timeout` must be"),
    (lambda b: softmark.compare(b, vary=["n"]), "`vary` must be a dict"),
    (lambda b: softmark.compare(b, vary={"n": None}), "`vary` must be a dict"),
    (lambda b: softmark.compare(b, vary={"n": []}), "`vary` must be a dict"),
    (lambda b: softmark.compare(b, vary={3: ["1"]}), "`vary` must be a dict"),
    (lambda b: softmark.compare(b, models=7), "`models` must be"),
    (lambda b: softmark.compare(b, study=7), "`study` must be"),
    (lambda b: softmark.compare(b, folder=7), "`folder` must be"),
    (lambda b: softmark.compare(b, folder=""), "`folder` must be"),
    (lambda b: softmark.compare(b, cluster=7), "`cluster` must be"),
    (lambda b: softmark.compare(b, resume=True, fresh=True), "give only one"),
    (lambda b: softmark.compare(b, allow_contaminated="no"), "`allow_contaminated` must be True or False"),
    (lambda b: softmark.stress(3), "`file` must be"),
    (lambda b: softmark.stress(b, jobs=0), "`jobs` must be"),
    (lambda b: softmark.stress(b, timeout=-1), "`timeout` must be"),
    (lambda b: softmark.stress(b, memory=0), "`memory` must be a positive number of GiB"),
    (lambda b: softmark.stress(b, memory=None), "`memory` must be"),
    (lambda b: softmark.stress(b, study=1), "`study` must be"),
    (lambda b: softmark.stress(b, fresh=1), "`fresh` must be True or False"),
])  # fmt: skip
def test_what_cannot_be_meant_is_one_error_at_once(call: Callable[[Any], object], said: str, beam: Any) -> None:
    with pytest.raises(softmark.SceneError) as refused:
        call(beam)
    assert isinstance(refused.value, softmark.BadArgument)
    assert isinstance(refused.value, ValueError)
    assert said in str(refused.value)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("n", [6, np.int64(6), "6", 6.0])
def test_numbers_are_taken_for_parameters_without_a_unit(n: Any) -> None:
    assert softmark.loads(BEAM, n=n).run().models["rod"].size["elements"] == 6


def test_numbers_with_a_unit_due_say_so() -> None:
    with pytest.raises(softmark.SceneError, match="E204"):
        softmark.loads(BEAM, L=0.12)


@pytest.mark.slow
@pytest.mark.long
def test_one_name_of_a_model_is_a_name(beam: Any, tmp_path: Path) -> None:
    found = softmark.compare(beam, models="rod", repeats=0)
    assert [p["model"] for p in found.points] == ["rod"]
    assert repr(found).startswith("<Comparison: 1 of 1 configurations of 1 models solved")
    assert "rod" in found._repr_html_()
    assert [p.name for p in found.write(tmp_path)] == ["compare.json", "compare.html"]
    assert list(beam.run(models=(n for n in ["rod"])).models) == ["rod"]


def test_scenes_reports_and_errors_can_be_pickled(beam: Any) -> None:
    """The copy gives the same numbers, and keeps what was overridden."""
    scene = softmark.loads(BEAM, n=6)
    again = pickle.loads(pickle.dumps(scene))
    assert again.title == scene.title
    assert again.models == scene.models
    report, other = scene.run(), again.run()
    assert other.models["rod"].size == report.models["rod"].size
    u, v = (r.models["rod"].probes["axis"].displacement for r in (report, other))
    np.testing.assert_array_equal(u, v)
    copy = pickle.loads(pickle.dumps(report))
    np.testing.assert_array_equal(copy.models["rod"].probes["axis"].displacement, u)
    assert copy.to_json() == report.to_json()
    for text, kind in (("nonsense", softmark.SceneError), (3, softmark.BadArgument)):
        with pytest.raises(softmark.SceneError) as refused:
            softmark.loads(text)  # type: ignore[arg-type]
        restored = pickle.loads(pickle.dumps(refused.value))
        assert isinstance(restored, kind)
        assert str(restored) == str(refused.value)


@pytest.mark.parametrize("name", ["silicone-beam", "cantilevers", "silicone-beam-release", "truth-cube"])
def test_scenes_of_the_library_can_be_pickled(name: str) -> None:
    scene = softmark.load(name)
    again = pickle.loads(pickle.dumps(scene))
    assert again.scene.declared.keys() == scene.scene.declared.keys()
    assert again.scene.parameters == scene.scene.parameters
