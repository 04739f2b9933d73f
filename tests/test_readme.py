"""README.md is true: its scene runs and prints its table, its message is the one that is given, its commands exist.

So are the guide to the vocabulary in grammar/README.md, whose scenes are sound and which names every constructor, the
table of shipped scenes and the example of the solvers in the documentation.
"""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

import softmark
from softmark.grammar.diagnostic import Source, render
from softmark.interpreter.cli.main import COMMANDS
from softmark.interpreter.validation.constructor_registry import CATALOGUE
from softmark.interpreter.validation.scene_loader import load_scene
from softmark.scenes import ROOT

HERE = Path(__file__).parents[1]
TEXT = (HERE / "README.md").read_text(encoding="utf-8")
PAGES = HERE / "interpreter" / "documentation"
SCENES = (PAGES / "scenes.md").read_text(encoding="utf-8")
NOTEBOOK = (PAGES / "howto-notebook.md").read_text(encoding="utf-8")
GUIDE = (HERE / "grammar" / "README.md").read_text(encoding="utf-8").split("## The vocabulary")[1].split("\n## ")[0]
PRELUDE, *EXAMPLES = re.findall(r"```scene\n(.*?)```", GUIDE, re.DOTALL)


def block(kind: str) -> str:
    found = re.search(rf"^```{kind}\n(.*?)^```$", TEXT, re.MULTILINE | re.DOTALL)
    assert found is not None
    return found[1]


def test_the_scene_runs_and_meets_its_expectation() -> None:
    report = softmark.loads(block("scene")).run()
    assert report.exit_status == 0
    assert [e.passed for e in report.expectations] == [True]
    shown = dict(re.findall(r"^(corotational|rod) +([\d.]+) %", TEXT, re.MULTILINE))
    assert shown == {name: f"{100 * model.metrics['eta'].value:.3g}" for name, model in report.models.items()}


def test_the_message_is_the_one_that_is_given() -> None:
    shown = re.search(r"^```\n(error\[E204\].*?)^```$", TEXT, re.MULTILINE | re.DOTALL)
    assert shown is not None
    wrong = block("scene").replace("young = 60 kPa", "young = 60 mm")
    _, found = load_scene(Source("beam.scene", wrong), Path(), None)
    assert render([d for d in found if d.severity == "error"], colour=False).strip() == shown[1].strip()


def test_the_python_example_runs() -> None:
    names: dict[str, object] = {}
    exec(compile(block("python"), "README.md", "exec"), names)
    report = names["report"]
    assert isinstance(report, softmark.Report)
    assert list(report.models) == ["rod"]


def test_the_solvers_alone_find_the_tip_of_the_silicone_beam() -> None:
    """At most 30 lines, nothing of softmark beside the solvers, and the tip that another program finds.

    (111.9, -133.8) mm is from mixed 27-node hexahedra of code of its own (tests/interpreter/test_converged_beam.py
    has its digits); 0.7 mm is what the first scene expects of this element at this size.
    """
    found = re.search(r"^```python\n(from softmark.solvers .*?)^```$", NOTEBOOK, re.MULTILINE | re.DOTALL)
    assert found is not None
    assert len(found[1].splitlines()) <= 30
    told = "\nimport sys\nprint(sorted(m for m in sys.modules if m.startswith('softmark.')))"
    done = subprocess.run([sys.executable, "-c", found[1] + told], capture_output=True, text=True, check=True)
    tip, loaded = done.stdout.splitlines()
    assert [float(n) for n in re.findall(r"-?\d+\.\d", tip)] == pytest.approx([111.9, -133.8], abs=0.7)
    ground = ("softmark.solvers", "softmark.records", "softmark.ranges", "softmark.resource_limits")
    others = [m for m in eval(loaded) if not m.startswith(ground)]
    assert others == []


MAIN_NAMES = {module: name for name, (module, _) in reversed(COMMANDS.items())}  # an alias is covered by the first name


@pytest.mark.parametrize("command", MAIN_NAMES.values())
def test_every_command_is_in_the_table(command: str) -> None:
    assert f"`dsl {command}" in TEXT


@pytest.mark.parametrize("example", EXAMPLES, ids=range(len(EXAMPLES)))
def test_the_examples_of_the_vocabulary_are_sound(example: str) -> None:
    _, found = load_scene(Source("README.md", PRELUDE + example), HERE / "tests" / "errors" / "parts", None)
    assert [(d.code, d.message) for d in found] == []


def test_the_guide_names_every_constructor_of_the_kinds_that_it_is_about() -> None:
    kinds = ("analysis", "model", "reference", "probe", "metric", "published", "amplitude", "stiffness")
    words = {*(name for kind in kinds for name in CATALOGUE[kind]), *CATALOGUE.words()}
    assert words - {"static"} - set(re.findall(r"\w+", GUIDE)) == set()


def test_every_shipped_scene_is_in_its_table() -> None:
    own = {f.stem for f in ROOT.rglob("*.scene") if f.parent.name not in ("templates", "materials")}
    assert own - set(re.findall(r"^\| `([\w-]+)` \|", SCENES, re.MULTILINE)) == set()
