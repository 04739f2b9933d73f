"""Plugins: words of somebody else's file, what is broken of one, and who hears of it."""

from __future__ import annotations

import json
import pickle
import shutil
import subprocess
import sys
from importlib.metadata import EntryPoint
from pathlib import Path

import pytest

import softmark
from softmark.interpreter.cli.conformance.law_contracts import law_breaches
from softmark.interpreter.cli.conformance.plugin_contracts import check_plugin
from softmark.interpreter.cli.conformance.trial_scenes import Trial, example_call, trial_breaches
from softmark.interpreter.cli.main import main
from softmark.interpreter.language.loaded_plugin import FILES, find_faulty_plugin
from softmark.interpreter.study.configurations.configuration_expansion import subject_of, task_of
from softmark.interpreter.validation import plugin_loader
from softmark.interpreter.validation.constructor_registry import CATALOGUE, vocabulary_with
from softmark.solvers.materials import MATERIALS, law_for

PARTS = Path(__file__).parents[1] / "errors" / "parts"
SWAY = str(PARTS / "sway_plugin.py")
SCENE = """softmark 1
material gel  = linear_elastic(young = 60 kPa, poisson = 0, density = 1000 kg/m^3)
body     rod  = solid(box(size = (40, 10, 10) mm), gel)
support  wall = fixed(rod, where = x <= 0 mm)
load     pull = gravity(2 m/s^2, direction = +y)
model    soft = beam6dof(segments = 2)
probe    tip  = point(rod, at = (40, 5, 5) mm)
metric   far  = displacement(tip, along = +y)
metric   own  = sway(tip)
"""
WITHOUT = SCENE.replace("metric   own  = sway(tip)\n", "")
HEAD = (PARTS / "sway_plugin.py").read_text(encoding="utf-8").partition("@dataclass")[0]


def plugin(folder: Path, text: str, name: str = "mine.py") -> str:
    (folder / name).write_text(text, encoding="utf-8")
    return str(folder / name)


def codes(*files: str) -> list[str]:
    return [d.code for d in vocabulary_with(files)[1]]


def test_a_word_of_a_plugin_is_as_one_of_ours_and_no_scene_after_it_has_it() -> None:
    """A metric that is the displacement along y, which one of ours is too."""
    found = softmark.loads(SCENE, plugins=[SWAY]).run().models["soft"].metrics
    assert found["own"].value == pytest.approx(found["far"].value, rel=1e-12)  # the same array
    with pytest.raises(softmark.SceneError, match="E203"):
        softmark.loads(SCENE)
    assert CATALOGUE.constructor("metric", "sway") is None


def test_nothing_is_loaded_that_nobody_named(monkeypatch: pytest.MonkeyPatch) -> None:
    def asked(**selection: str) -> list[EntryPoint]:
        raise AssertionError("installed plugins were looked for")

    monkeypatch.setattr("importlib.metadata.entry_points", asked)
    monkeypatch.setattr(plugin_loader, "load_plugin", asked)
    softmark.loads(WITHOUT)


@pytest.mark.slow
def test_a_scene_without_plugins_imports_nothing_for_them() -> None:
    code = f"import softmark, sys; softmark.loads({WITHOUT!r}); print([m for m in sys.modules if 'front.plugins' in m])"
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60)
    assert said.stdout.strip() == "[]"


@pytest.mark.parametrize(
    ("text", "code", "reason"),
    [
        ("SOFTMARK = {", "W730", "never closed"),
        ("import softmark\n", "W730", "no table"),
        ("SOFTMARK = dict(metrics={})\n", "W730", "not a literal"),
        ('SOFTMARK = {"metrics": {"sway": "Sway"}}\nraise SystemExit(3)\n', "W730", "SystemExit: 3"),
        ('SOFTMARK = {"metrics": {"sway": "Sway"}}\n1 / 0\n', "W730", "ZeroDivisionError"),
        ('SOFTMARK = {"metrics": {"sway": 3}}\n', "W731", "a line"),
        ('SOFTMARK = {"metrics": {"Sway!": "Sway"}}\nSway = 3\n', "W731", "not a valid word"),
        ('SOFTMARK = {"metrics": {"sway": "Sway"}}\nSway = 3\n', "W731", "no class"),
        (HEAD + '@dataclass(frozen=True)\nclass Sway(DisplacementMetric):\n    """How far."""\n', "W731", "no `unit`"),
        (HEAD + 'class Sway(DisplacementMetric):\n    """How far."""\n    unit = "m"\n', "W731", "dataclass"),
        (HEAD + "@dataclass(frozen=True)\nclass Sway(DisplacementMetric):\n    unit = 'm'\n", "W731", "no docstring"),
        (HEAD + '@dataclass(frozen=True)\nclass Sway(DisplacementMetric):\n    """How far."""\n'
                '    f: Annotated[float, "furlong", "what"]\n', "W731", "cannot be read"),
    ],
)  # fmt: skip
def test_what_is_broken_is_said_at_its_place_and_stops_no_scene_without_it(
    text: str, code: str, reason: str, tmp_path: Path
) -> None:
    file = plugin(tmp_path, text)
    found = vocabulary_with([file])[1]
    assert [d.code for d in found] == [code]
    assert reason in found[0].message
    assert found[0].source is not None
    assert found[0].span is not None
    assert found[0].help
    scene = softmark.loads(WITHOUT, plugins=[file])
    assert [d.code for d in scene.warnings] == [code]
    with pytest.raises(softmark.SceneError) as error:
        softmark.loads(SCENE, plugins=[file])
    told = [d for d in error.value.diagnostics if d.severity == "error"]
    assert [d.code for d in told] == (["E203"] if "Sway!" in text or ": 3" in text else ["E730"])


def test_a_word_that_somebody_has_stays_theirs(tmp_path: Path) -> None:
    file = plugin(tmp_path, HEAD.replace('"sway"', '"stress"') + Path(SWAY).read_text().partition("}}\n")[2])
    assert codes(file) == ["W731"]
    shutil.copy(SWAY, tmp_path / "second.py")
    words, found = vocabulary_with([SWAY, str(tmp_path / "second.py")])
    assert [d.code for d in found] == ["W731"]
    owner = words.owner("metric", "sway")
    assert owner is not None
    assert owner.file == SWAY


def test_an_installed_plugin_is_taken_by_its_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shutil.copy(SWAY, tmp_path / "swaying_package.py")
    monkeypatch.syspath_prepend(str(tmp_path))
    point = EntryPoint("swaying", "swaying_package", plugin_loader.GROUP)
    monkeypatch.setattr("importlib.metadata.entry_points", lambda **_: [point])
    assert plugin_loader.installed_plugins() == {"swaying": "swaying_package"}
    assert codes("swaying") == []
    assert softmark.loads(SCENE, plugins="swaying").scene.vocabulary.plugins[0].asked == "swaying"
    absent = vocabulary_with(["swaing"])[1]
    assert [d.code for d in absent] == ["E731"]
    assert "swaying" in absent[0].help


def test_a_list_says_whose_a_word_is(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["list", "metrics", "--plugin", SWAY]) == 0
    marked = [line for line in capsys.readouterr().out.splitlines() if line.endswith(f"[plugin {SWAY}]")]
    assert [line.split()[0] for line in marked] == ["sway"]
    assert main(["list", "plugins", "--plugin", SWAY, "--plugin", str(PARTS / "broken_plugin.py")]) == 0
    out = capsys.readouterr().out
    assert "metric sway" in out
    assert "broken: metric sway: ModuleNotFoundError" in out
    assert main(["explain", "sway", "--plugin", SWAY]) == 0
    assert f"From the plugin {SWAY}: class Sway" in capsys.readouterr().out


def test_what_a_plugin_raises_while_it_runs_is_its_own_reason(tmp_path: Path) -> None:
    text = Path(SWAY).read_text().replace("return float(abs(u[:, 1]).max())", "return u[99, 0]")
    file = plugin(tmp_path, text)
    report = softmark.loads(SCENE, plugins=[file]).run()
    found = report.models["soft"].metrics
    assert found["far"].value is not None
    assert found["own"].value is None
    assert f"the plugin `{file}` failed in line" in (found["own"].reason or "")
    assert report.to_json()["scene"]["plugins"][0]["file"] == file
    assert find_faulty_plugin(ValueError("ours")) is None


BAR = (
    HEAD.replace('{"metrics": {"sway": "Sway"}}', '{"models": {"bar": ("Bar", "made")}}')
    + '''
from softmark.interpreter.models.shared.model_declaration import Model


@dataclass(frozen=True)
class Bar(Model):
    """One linear cell."""

    def outline(self, case):
        """One line."""
        return "one linear cell"


def made(model, declared, case, workshop):
    return GIVEN
'''
)


@pytest.mark.slow
@pytest.mark.parametrize(("given", "reason"), [("1 / 0", "ZeroDivisionError"), ("{}", "returns a dict without `size`")])
def test_a_model_that_cannot_be_built_fails_alone(given: str, reason: str, tmp_path: Path) -> None:
    file = plugin(tmp_path, BAR.replace("GIVEN", given))
    models = softmark.loads(WITHOUT + "model theirs = bar()\n", plugins=[file]).run().models
    assert models["soft"].status == "converged"
    assert models["theirs"].status == "failed"
    assert reason in (models["theirs"].message or "")
    assert (models["theirs"].loads, models["theirs"].size) == ({}, {})  # not known, and not zero


@pytest.mark.slow
def test_another_process_takes_the_same_words_and_a_changed_file_is_another_result(tmp_path: Path) -> None:
    file = plugin(tmp_path, Path(SWAY).read_text())
    first = softmark.loads(SCENE, plugins=[file]).scene
    task = task_of(subject_of(first), first, "soft")
    assert json.loads(json.dumps(task.to_json()))["plugins"] == [file]
    assert pickle.loads(pickle.dumps(first)).vocabulary.plugins[0].file == file
    plugin(tmp_path, Path(SWAY).read_text().replace("abs(u[:, 1]).max()", "abs(u[:, 1]).min()"))
    second = softmark.loads(SCENE, plugins=[file]).scene
    assert task_of(subject_of(second), second, "soft").key != task.key
    plain = softmark.loads(WITHOUT).scene
    assert "plugins" not in task_of(subject_of(plain), plain, "soft").to_json()
    assert file in FILES


SLAB = (
    HEAD.replace('{"metrics": {"sway": "Sway"}}', '{"shapes": {"slab": "Slab"}}')
    + '''
from softmark.solvers.mesh.shapes import Box, Shape


@dataclass(frozen=True)
class Slab(Shape):
    """A flat box."""

    long: Annotated[float, "m in (0, inf)", "its longest side"]

    def mesh(self, kind, size, cuts=()):
        """Its cells."""
        return Box((self.long, self.long, self.long / 4)).mesh(kind, size)

    def surface(self, size):
        """Its surface."""
        return Box((self.long, self.long, self.long / 4)).surface(size)
'''
)
FLAT = WITHOUT.replace("box(size = (40, 10, 10) mm)", "slab(40 mm)").replace(
    "beam6dof(segments = 2)", "fem(hex8, strain = small, size = 10 mm)"
)
THEIRS = HEAD.replace('{"metrics": {"sway": "Sway"}}', '{"adapters": {"theirs": "PROGRAM"}}') + (
    "from softmark.interpreter.models.external.adapters import Program\n"
    'PROGRAM = Program("Theirs", ("hex8",), {"small": ("linear_elastic",)})\n'
    'install, refuses, write, command, read = "by hand", print, print, print, print\n'
    'def version():\n    return "1"\n'
)
OUTSIDE = WITHOUT.replace(
    "beam6dof(segments = 2)", "external_solver(theirs, element = hex8, strain = small, size = 10 mm)"
)


@pytest.mark.parametrize(("text", "scene"), [(SLAB, FLAT), (THEIRS, OUTSIDE)])
def test_a_changed_shape_or_adapter_of_a_plugin_is_another_result(text: str, scene: str, tmp_path: Path) -> None:
    """The shape stands inside of a body, and the adapter behind a word of ours."""
    keys = []
    for more in ("", "# mended\n", ""):
        file = plugin(tmp_path, text + more)
        found = softmark.loads(scene, plugins=[file]).scene
        keys.append(task_of(subject_of(found), found, "soft").key)
    assert keys[0] == keys[2] != keys[1]


def test_our_laws_keep_the_contract_of_laws_and_a_wrong_slope_is_found() -> None:
    law = law_for(MATERIALS["neo_hookean"](1.0, 0.3, 1.0), "finite")
    mu, lam = 1.0 / 2.6, 0.3 / (1.3 * 0.4)
    assert list(law_breaches(law, mu, lam)) == []

    class Off:
        """The same with a stress that is 0.1 % too large."""

        psi, dPdF = law.psi, law.dPdF

        def P(self, F: object) -> object:
            return 1.001 * law.P(F)  # type: ignore[arg-type]

    assert [b.what.partition(":")[0] for b in law_breaches(Off(), mu, lam)] == [
        "P is not the derivative of psi", "dPdF is not the derivative of P"
    ]  # fmt: skip


def test_conformance_says_which_contracts_are_broken(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["conformance", str(PARTS / "breaking_plugin.py")]) == 1
    out, err = capsys.readouterr()
    assert "contracts are broken" in out
    assert err.count("error[E732]") == 4
    assert main(["conformance", str(PARTS / "nowhere.py")]) == 2


TWIST = (
    HEAD.replace(
        '{"metrics": {"sway": "Sway"}}',
        '{"loads": {"twist": "Twist"}, "examples": {"twist": "twist(bar, by = 10 nN*m, where = x >= 40 mm)"}}',
    )
    + '''
from typing import Any
from softmark.interpreter.vocabulary.loads.load import Load
from softmark.interpreter.vocabulary.loads.torque import MomentLoad


@dataclass(frozen=True)
class Twist(Load):
    """A small moment about x, on a part of the surface."""

    strength = "by"
    body: Annotated[str, "body", "the body that is loaded"]
    by: Annotated[float, "N*m", "how strong it is"]
    where: Annotated[Any, "condition", "which part of its surface"]

    @property
    def action(self):
        """How it acts."""
        return MomentLoad(self.where, (self.by * abs(self.by) / 1e-8, 0.0, 0.0))
'''
)


def test_a_small_load_is_held_to_its_proportion_as_a_large_one(tmp_path: Path) -> None:
    """Half of it acts a quarter as much."""
    found = check_plugin(plugin(tmp_path, TWIST)).diagnostics
    assert [d.message.rpartition(": ")[2] for d in found] == ["half of it does not have half of the effect"]
    sound = check_plugin(plugin(tmp_path, TWIST.replace(" * abs(self.by) / 1e-8", "")))
    assert sound.sound


@pytest.mark.parametrize("name", ["force", "moment", "strain_energy", "work"])
def test_metrics_of_forces_keep_the_contract_as_they_are_called_in_scenes(name: str, tmp_path: Path) -> None:
    """Those of a support find it; those that may have a reference and have none are no errors."""
    word = CATALOGUE.constructor("metric", name)
    assert word is not None
    assert list(trial_breaches(Trial(word, example_call(word, {}), tmp_path))) == []


def test_a_shape_is_tried_by_itself_and_one_whose_surface_is_anothers_is_found(tmp_path: Path) -> None:
    found = check_plugin(plugin(tmp_path, SLAB))
    assert found.diagnostics == ()
    assert found.words == ("shape slab",)
    bulky = SLAB.replace("self.long / 4)).surface", "self.long / 2)).surface")
    (breach,) = check_plugin(plugin(tmp_path, bulky)).diagnostics
    assert "its surface encloses 4e-06 m^3, its cells are 2e-06" in breach.message


@pytest.mark.slow
def test_a_sound_plugin_keeps_all_contracts(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["conformance", SWAY]) == 0
    assert "metric sway; all contracts kept" in capsys.readouterr().out


@pytest.mark.long
@pytest.mark.slow
def test_compare_and_its_clock_take_plugins(tmp_path: Path) -> None:
    (tmp_path / "my.scene").write_text(SCENE, encoding="utf-8")
    out, json_ = str(tmp_path / "out"), tmp_path / "found.json"
    arguments = ["compare", str(tmp_path / "my.scene"), "--plugin", SWAY, "--out", out, "--json", str(json_),
                 "--repeats", "1", "--jobs", "2", "--vary", "soft.segments=2,4", "--allow-contaminated"]  # fmt: skip
    assert main(arguments) == 0
    points = json.loads(json_.read_text())["points"]
    assert [p["status"] for p in points] == ["converged"] * 2
    assert all(p["errors"]["own"]["value"] == p["errors"]["far"]["value"] for p in points)
    assert all(p["cost"] for p in points)
