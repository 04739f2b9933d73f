"""Configurations: families, labels, and keys that are equal exactly where the result is the same computation."""

from __future__ import annotations

from pathlib import Path

import pytest
from library import loaded

import softmark
from softmark.interpreter.language.scene_sources import standard_scenes
from softmark.interpreter.study.configurations import configuration_keys
from softmark.interpreter.study.configurations.configuration_expansion import (
    CommandLineAdditions,
    Configuration,
    expand,
    read_vary,
    split_values,
    subject_of,
)

BEAM = """
param    h      = 20 mm
param    n      = 10
material gel    = neo_hookean(young = 60 kPa, poisson = 0.3, density = 1000 kg/m^3)
body     beam   = solid(cylinder(length = 178 mm, radius = 19 mm), gel)
support  wall   = fixed(beam, where = x <= 0 mm)
load     weight = gravity(9.81 m/s^2)
analysis sag    = static()
model    rod    = beam6dof(segments = n)
model    tet    = fem(tet10, strain = finite, size = h)
model    hex    = fem(hex8, strain = finite, size = h)
reference theory = simo_reissner(beam)
probe    axis   = line(beam, from = (0, 0, 0) mm, to = (178, 0, 0) mm, points = 5)
metric   eta    = relative_l2_error(axis, against = theory)
"""


def expanded(
    text: str = BEAM, vary: tuple[str, ...] = (), study: str | None = None, models: tuple[str, ...] = ()
) -> list[Configuration]:
    values, more = read_vary(vary)
    return expand([subject_of(softmark.loads(text).scene)], CommandLineAdditions(values, models + more, study))


def labels(found: list[Configuration]) -> list[tuple[str | None, str]]:
    return [(c.study, c.label) for c in found]


# ------------------------------------------------------------------ families


def test_without_studies_every_model_stands_as_declared() -> None:
    assert labels(expanded()) == [(None, "rod"), (None, "tet"), (None, "hex")]


def test_a_model_that_does_not_depend_on_what_is_varied_is_there_once() -> None:
    found = expanded(BEAM + "study s = sweep(h, over = [30, 20] mm)")
    assert labels(found) == [
        (None, "rod"),
        ("s", "tet, h = 30 mm"),
        ("s", "hex, h = 30 mm"),
        ("s", "tet, h = 20 mm"),
        ("s", "hex, h = 20 mm"),
    ]
    assert len({c.key for c in found}) == 5
    assert [dict(c.numbers) for c in found[:2]] == [{}, {"h": 0.03}]


def test_a_field_of_another_model_says_nothing_of_a_model() -> None:
    """Of one value there was `hex, rod.segments = 8`, for nothing tells that it depends on that or not."""
    found = expanded(vary=("rod.segments=8",))
    assert labels(found) == [(None, "tet"), (None, "hex"), (None, "rod, segments = 8")]


def test_each_sweep_is_a_family_around_the_scene_as_declared() -> None:
    found = expanded(BEAM + "study s = sweep(h, over = [30] mm, models = [tet])\nstudy t = sweep(n, over = [5, 10])")
    assert labels(found) == [
        (None, "tet"), (None, "hex"), ("s", "tet, h = 30 mm"), ("t", "rod, n = 5"), ("t", "rod, n = 10")
    ]  # fmt: skip


def test_a_value_that_two_studies_share_is_one_computation() -> None:
    """h = 20 mm is the scene's own: the sweep of it and the sweep of the tolerance meet there."""
    studies = "study s = sweep(h, over = [20] mm)\nstudy t = sweep(sag.tolerance, over = [1e-8, 1e-6])"
    found = expanded(BEAM + studies, models=("tet",))
    assert labels(found) == [
        ("s", "tet, h = 20 mm"), ("t", "tet, sag.tolerance = 1e-8"), ("t", "tet, sag.tolerance = 1e-6")
    ]  # fmt: skip
    assert found[0].key == found[1].key != found[2].key


def test_with_makes_the_product_and_the_inner_sweep_is_no_family_of_its_own() -> None:
    studies = "study s = sweep(h, over = [30, 20] mm)\nstudy t = sweep(gel.poisson, over = [0.3, 0.4], with = s)"
    found = expanded(BEAM + studies, models=("tet", "rod"))
    assert [c.label for c in found if c.model == "tet"] == [
        "tet, gel.poisson = 0.3, h = 30 mm", "tet, gel.poisson = 0.3, h = 20 mm",
        "tet, gel.poisson = 0.4, h = 30 mm", "tet, gel.poisson = 0.4, h = 20 mm",
    ]  # fmt: skip
    assert [c.label for c in found if c.model == "rod"] == ["rod, gel.poisson = 0.3", "rod, gel.poisson = 0.4"]


def test_one_study_alone() -> None:
    studies = "study s = sweep(h, over = [30] mm, models = [hex])\nstudy t = sweep(n, over = [5])"
    assert labels(expanded(BEAM + studies, study="s")) == [("s", "hex, h = 30 mm")]
    studies += "\nstudy p = pareto(error = eta, over = t)"
    assert ("t", "rod, n = 5") in labels(expanded(BEAM + studies, study="p"))


# ------------------------------------------------------------------ the command line


def test_vary_takes_the_place_of_studies_and_several_make_a_product() -> None:
    found = expanded(BEAM + "study s = sweep(h, over = [1] mm)", ("h=30mm, 20 mm", "n=5,10", "model=rod,tet"))
    assert labels(found) == [
        (None, "rod, n = 5"), (None, "tet, h = 30 mm"), (None, "rod, n = 10"), (None, "tet, h = 20 mm")
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("10mm,5mm", ["10mm", "5mm"]),
        (" 10 mm , 5 mm ,", ["10 mm", "5 mm"]),
        ("(0, 0, 1),-z", ["(0, 0, 1)", "-z"]),
        ("box(size = (1, 2, 3) mm),[1,2]", ["box(size = (1, 2, 3) mm)", "[1,2]"]),
        ('"a,b","c"', ['"a,b"', '"c"']),
        ("", []),
    ],
)
def test_commas_inside_brackets_do_not_split(text: str, parts: list[str]) -> None:
    assert split_values(text) == parts


def test_a_list_is_its_values() -> None:
    assert [o.text for o in read_vary(["h=[10, 5]mm"])[0][0].values] == ["h=10 mm", "h=5 mm"]


@pytest.mark.parametrize("vary", ["h", "h=", "=3", "h=3 +", "hh=3mm", "h=3", "rod=3", "model=bar", "rod.segment=5"])
def test_what_cannot_be_meant_is_refused_before_anything_is_done(vary: str) -> None:
    with pytest.raises(softmark.SceneError):
        expanded(vary=(vary,))


def test_a_value_that_the_scene_does_not_bear_is_one_failed_point() -> None:
    """A probe at 178 mm is outside a beam of 100 mm: an error, but of this variation alone."""
    text = BEAM.replace("178 mm, radius", "L, radius") + "param L = 178 mm"
    found = expanded(text, ("L=100mm,200mm", "model=rod"))
    assert [(c.label, c.reason is None) for c in found] == [("rod, L = 100 mm", False), ("rod, L = 200 mm", True)]
    assert found[0].reason is not None
    assert found[0].reason.startswith("E504: `axis` is evaluated at (178, 0, 0) mm, outside `beam` (line 13 of <text>)")


def test_two_scenes_of_one_name_are_told_apart() -> None:
    scene = softmark.loads(BEAM).scene
    first = subject_of(scene)
    second = subject_of(scene, [first.name])
    assert (first.name, second.name) == ("scene", "scene-2")
    found = expand([first, second], CommandLineAdditions())
    assert [c.scene for c in found] == ["scene"] * 3 + ["scene-2"] * 3
    assert len({c.key for c in found}) == 3, "the same computation"


# ------------------------------------------------------------------ keys


def key(text: str, model: str = "rod") -> str:
    return configuration_keys.key_of(softmark.loads(text).scene, model)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("h      = 20 mm", "h      = 10 mm"),  # the rod has no mesh
        ("finite, size = h)\nmodel    hex", "small, size = h)\nmodel    hex"),  # another model
        ("param    h", "# why\nparam    h"),
        ("60 kPa", "0.06 MPa"),
        ("where = x <= 0 mm", "where =   x<=0 mm"),
        ("metric   eta", "expect rod.eta < 1\nmetric   eta"),
        ("metric   eta", "study s = sweep(n, over = [3, 4])\nmetric   eta"),
    ],
)
def test_what_does_not_decide_the_result_does_not_change_the_key(old: str, new: str) -> None:
    assert old in BEAM
    assert key(BEAM.replace(old, new)) == key(BEAM)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("n      = 10", "n      = 11"),
        ("60 kPa", "61 kPa"),
        ("where = x <= 0 mm", "where = x <= 1e-7 mm"),
        ("9.81", "9.8"),
        ("static()", "static(tolerance = 1e-6)"),
        ("simo_reissner", "elastica"),
        ("points = 5", "points = 6"),
        ("relative_l2_error", "tip_error"),
        ("178 mm, radius = 19 mm", "178 mm, radius = 19.0001 mm"),
    ],
)
def test_what_decides_the_result_changes_the_key(old: str, new: str) -> None:
    assert old in BEAM
    assert key(BEAM.replace(old, new)) != key(BEAM)


def test_a_parameter_in_a_condition_enters_by_its_value() -> None:
    text = BEAM.replace("x <= 0 mm", "x <= a") + "param a = {} mm"
    assert key(text.format("1e-7")) == key(text.format("0.0000001"))
    assert key(text.format("1e-7")) != key(text.format("2e-7"))


def test_the_model_that_a_metric_is_measured_against_belongs_to_the_key() -> None:
    text = BEAM + "metric other = relative_l2_error(axis, against = hex)"
    scene = softmark.loads(text).scene
    assert configuration_keys.needed_models(scene, "rod") == ("rod", "hex")
    assert key(text) != key(text.replace("h      = 20 mm", "h      = 10 mm"))
    assert key(text) == key(text.replace("fem(tet10, strain = finite", "fem(tet4, strain = finite"))


def test_models_that_a_reference_refines_enter_without_their_size() -> None:
    text = BEAM + "reference limit = self_converged(methods = [tet, hex], sizes = [30, 20, 15] mm)"
    scene = softmark.loads(text).scene
    assert configuration_keys.needed_models(scene, "rod") == ("rod",)
    assert key(text) == key(text.replace("h      = 20 mm", "h      = 10 mm"))
    assert key(text) != key(text.replace("fem(tet10,", "fem(tet4,"))


def test_what_a_model_is_made_from_enters_its_key_however_far_away() -> None:
    """A reduced model of one that starts from another: all three, and nothing else."""
    more = (
        BEAM
        + "model near = fem(hex8, strain = finite, size = 30 mm, initial_guess = tet)\nmodel few = modal(of = near)"
    )
    few = key(more, "few")
    assert few != key(more.replace("h      = 20 mm", "h      = 10 mm"), "few")
    assert few != key(more.replace("fem(tet10, strain = finite", "fem(tet10, strain = corotational"), "few")
    assert few == key(more.replace("n      = 10", "n      = 11"), "few")
    assert configuration_keys.needed_models(softmark.loads(more).scene, "few") == ("few",)


def test_a_model_that_is_trained_on_a_sweep_depends_on_it() -> None:
    study = "param k = 70\nstudy ways = sweep(gel.young, over = [50, k] kPa)\n"
    more = BEAM + study + "model few = pod(of = hex, over = ways)"
    assert [c.label for c in expanded(more)] == ["rod", "tet", "hex", "few"], "it is no family, but for training"
    few = key(more, "few")
    assert few != key(more.replace("[50, k]", "[55, k]"), "few")
    assert few != key(more.replace("k = 70", "k = 71"), "few")
    assert key(more, "hex") == key(more.replace("[50, k]", "[55, k]"), "hex")


def test_the_content_of_a_file_enters_the_key_and_its_place_does_not(tmp_path: Path) -> None:
    from softmark.interpreter.api.python_api import load

    def with_scan(folder: str, content: str) -> str:
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "scan.obj").write_text(content, encoding="utf-8")
        scene = 'reference scan = surface("scan.obj", unit = 1 mm, uncertainty = 0.1 mm)'
        (tmp_path / folder / "my.scene").write_text(BEAM + scene, encoding="utf-8")
        return configuration_keys.key_of(load(tmp_path / folder / "my.scene").scene, "rod")

    first = with_scan("a", "v 0 0 0\n")
    assert with_scan("b", "v 0 0 0\n") == first
    assert with_scan("c", "v 0 0 1\n") != first


@pytest.mark.parametrize("name", sorted(standard_scenes()))
def test_keys_are_the_same_in_every_process(name: str) -> None:
    """No address of an object gets into what is digested."""
    scene = loaded(standard_scenes()[name]).scene
    assert not [d.name for d in scene.declared.values() if " at 0x" in configuration_keys.declaration_text(d)]
