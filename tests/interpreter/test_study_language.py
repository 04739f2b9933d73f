"""Studies in a scene: what they bind to, how values are written, and what is left alone; messages are golden files."""

from __future__ import annotations

from pathlib import Path

import pytest

import softmark
from softmark.grammar.diagnostic import Source
from softmark.interpreter.api.python_api import LoadedScene
from softmark.interpreter.cli.main import main
from softmark.interpreter.language.compiled_scene import Scene
from softmark.interpreter.planning.sweep_expansion import override_of, value_in
from softmark.interpreter.validation.scene_loader import load_scene
from softmark.interpreter.vocabulary.study_words import Sweep

BEAM = """
param    h      = 20 mm
param    n      = 10
param    loose  = 3 mm
material gel    = neo_hookean(young = 60 kPa, poisson = 0.3, density = 1000 kg/m^3)
body     beam   = solid(cylinder(length = 178 mm, radius = 19 mm), gel)
support  wall   = fixed(beam, where = x <= 0 mm)
load     weight = gravity(9.81 m/s^2)
analysis sag    = static()
model    rod    = beam6dof(segments = n)
model    tet    = fem(tet10, strain = finite, size = h)
reference theory = simo_reissner(beam)
probe    axis   = line(beam, from = (0, 0, 0) mm, to = (178, 0, 0) mm, points = 5)
metric   eta    = relative_l2_error(axis, against = theory)
"""


def scene_with(studies: str) -> Scene:
    return softmark.loads(BEAM + studies).scene


def texts(studies: str) -> list[str]:
    """The values of the study `s`, as they go to an override."""
    return [variant.text for variant in scene_with(studies).declared["s"].thing.over]


@pytest.mark.parametrize(
    ("study", "expected"),
    [
        ("sweep(h, over = [10, 5, 2.5] mm)", ["10 mm", "5 mm", "2.5 mm"]),
        ("sweep(h, over = [1 cm, 5] mm)", ["1 cm", "5 mm"]),  # the unit is that of the items without one
        ("sweep(h, over = [2 * 5, loose / 2] mm)", ["2 * 5 * 1 mm", "loose / 2"]),
        ("sweep(n, over = [5, 10])", ["5", "10"]),
        ("sweep(weight.direction, over = [-z, (0, 1, -1)])", ["-z", "(0, 1, -1)"]),
        ("sweep(tet.strain, over = [corotational, finite])", ["corotational", "finite"]),
        ("sweep(tet.element, over = [tet4, tet10])", ["tet4", "tet10"]),
        (
            "sweep(beam.shape, over = [cylinder(length = 178 mm, radius = 15 mm)])",
            ["cylinder(length = 178 mm, radius = 15 mm)"],
        ),
    ],
)
def test_values_are_kept_as_texts_with_their_units(study: str, expected: list[str]) -> None:
    assert texts(f"study s = {study}") == expected


@pytest.mark.parametrize(
    ("target", "value", "expected"),
    [
        ("h", "[5] mm", 0.005),
        ("h", "[2 * 5] mm", 0.01),
        ("h", "[-(-5)] mm", 0.005),
        ("sag.tolerance", "[1e-4]", 1e-4),  # the declaration does not give it
        ("rod.segments", "[7]", 7.0),
        ("gel.young", "[30] kPa", 30e3),
    ],
)
def test_a_value_takes_its_place(target: str, value: str, expected: float) -> None:
    from softmark.interpreter.validation.scene_checks import apply_overrides

    scene = scene_with(f"study s = sweep({target}, over = {value})")
    sweep: Sweep = scene.declared["s"].thing
    other, diagnostics = apply_overrides(scene, [override_of(sweep, sweep.over[0])])
    assert [d for d in diagnostics if d.severity == "error"] == []
    assert value_in(other, target) == pytest.approx(expected, rel=1e-15)
    assert value_in(scene, target) != pytest.approx(expected, rel=1e-3), "the scene itself stays as it is"


def test_a_sweep_of_a_copy_has_the_values_of_its_own_list() -> None:
    """Values that were found are known by their list's node, whose number may be that of another list in a copy."""
    from softmark.interpreter.validation.scene_checks import apply_overrides

    scene = scene_with("study s = sweep(h, over = [10, 5] mm)\nstudy t = sweep(n, over = [2, 4])")
    assert scene.table is not None
    first, second = scene.table.listed
    known = scene.table.listed
    known[first], known[second] = known[second], known[first]
    other, _ = apply_overrides(scene, [])
    assert [v.text for v in other.declared["s"].thing.over] == ["10 mm", "5 mm"]
    assert [v.text for v in other.declared["t"].thing.over] == ["2", "4"]


def test_what_a_study_refers_to_is_used_and_a_study_need_not_be() -> None:
    def unused(text: str) -> list[str]:
        found = load_scene(Source("<text>", text), Path(), None)[1]
        return [d.message for d in found if d.code == "W309"]

    assert unused(BEAM) == ["nothing uses the parameter `loose`"]
    assert unused(BEAM + "study s = sweep(loose, over = [1, 2] mm)") == []
    assert unused(BEAM + "study s = sweep(h, over = [loose, 2 * loose])") == []


def test_fields_by_their_defaults() -> None:
    scene = scene_with(
        "study s = sweep(h, over = [20, 10, 5] mm)\n"
        "study t = sweep(n, over = [5, 10], with = s, models = [rod])\n"
        "study c = convergence(eta, over = s)\n"
        "study p = pareto(error = eta)"
    )
    assert (scene.declared["s"].thing.with_, scene.declared["s"].thing.models) == (None, None)
    assert (scene.declared["t"].thing.with_, scene.declared["t"].thing.models) == ("s", ("rod",))
    assert (scene.declared["c"].thing.metric, scene.declared["c"].thing.over) == ("eta", "s")
    assert (scene.declared["p"].thing.cost, scene.declared["p"].thing.over) == (None, None)


def test_an_override_of_the_command_line_changes_what_a_sweep_is_checked_against() -> None:
    text = BEAM.replace("param    h      = 20 mm", "param    h      = 20 mm in 1 mm .. 2 * n * 1 mm")
    text += "study s = sweep(h, over = [15] mm)"
    assert softmark.loads(text, n="10").models == ("rod", "tet")
    with pytest.raises(softmark.SceneError, match="must be between 1 mm and 10 mm"):
        softmark.loads(text, n="5", h="4 mm")


def test_several_wrong_values_are_told_at_once_each_at_its_place() -> None:
    text = BEAM + "study s = sweep(rod.segments, over = [1.5, 10, 0])"
    found = [d for d in load_scene(Source("<text>", text), Path(), None)[1] if d.severity == "error"]
    assert [(d.code, text[d.span.start : d.span.end]) for d in found if d.span] == [("E204", "1.5"), ("E301", "0")]


def test_run_leaves_studies_alone_and_plan_names_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    file = tmp_path / "my.scene"
    file.write_text(BEAM + "study s = sweep(h, over = [20, 10] mm)", encoding="utf-8")
    assert main(["plan", str(file)]) == 0
    assert "studies, computed by `dsl compare`: s" in capsys.readouterr().out
    scene = softmark.load(file)
    assert isinstance(scene, LoadedScene)
    assert list(scene.run(models="rod").models) == ["rod"]


@pytest.mark.parametrize("name", ["sweep", "convergence", "pareto", "study"])
def test_explain_knows_studies(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["explain", name]) == 0
    assert "study" in capsys.readouterr().out


def test_checking_a_study_compiles_and_computes_nothing(tmp_path: Path) -> None:
    import subprocess
    import sys

    file = tmp_path / "my.scene"
    file.write_text(BEAM + "study s = sweep(h, over = [20, 10, 5, 2] mm)", encoding="utf-8")
    code = (
        f"import sys; from softmark.interpreter.cli.main import main; main(['check', {str(file)!r}]);"
        "print(sorted({'numpy', 'scipy', 'numba'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "[]"
