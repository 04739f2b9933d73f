"""What others take from this repository: hooks of pre-commit, and an action for workflows, its steps as they stand."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from softmark.interpreter.cli.main import COMMANDS

pytestmark = pytest.mark.slow
yaml = pytest.importorskip("yaml")
ROOT = Path(__file__).parents[1]
ACTION = ROOT / ".github" / "actions" / "softmark" / "action.yml"


def test_hooks_are_commands() -> None:
    hooks = yaml.safe_load((ROOT / ".pre-commit-hooks.yaml").read_text(encoding="utf-8"))
    assert [hook["id"] for hook in hooks] == ["softmark-fmt", "softmark-check"]
    for hook in hooks:
        program, command = hook["entry"].split()
        assert program == "dsl"
        assert command in COMMANDS
        assert (hook["language"], hook["files"]) == ("python", r"\.scene$")


@pytest.fixture
def steps(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> dict[str, dict[str, Any]]:
    """The steps of the action by name, in a folder of scenes, with a `dsl` on the path."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "bin").mkdir()
    (tmp_path / "bin" / "dsl").write_text(f'#!/bin/sh\nexec "{sys.executable}" -m softmark.interpreter "$@"\n')
    (tmp_path / "bin" / "dsl").chmod(0o755)
    (tmp_path / "a folder").mkdir()
    (tmp_path / "a folder" / "good, too.scene").write_text("param L = 178 mm\n")
    (tmp_path / "bad.scene").write_text("param L = 178 mn\n")
    action = yaml.safe_load(ACTION.read_text(encoding="utf-8"))
    named = {step["name"]: step for step in action["runs"]["steps"] if "run" in step}
    asked = {given.split()[1] for step in named.values() for given in step["env"].values()}
    assert asked <= {f"inputs.{name}" for name in action["inputs"]}
    assert all("${{" not in step["run"] for step in named.values()), "texts of others are no part of a script"
    return named


def carried_out(step: dict[str, Any], **given: str) -> subprocess.CompletedProcess[str]:
    assert set(given) == set(step["env"])
    path = f"{Path.cwd() / 'bin'}:{os.environ['PATH']}"
    own = {"PATH": path, "GITHUB_WORKSPACE": str(Path.cwd()), "GITHUB_STEP_SUMMARY": str(Path("summary.md").absolute())}
    command = ["bash", "--noprofile", "--norc", "-eo", "pipefail", "-c", step["run"]]
    return subprocess.run(command, env=os.environ | own | given, capture_output=True, text=True, check=False)


def test_the_action_checks_all_scenes_of_a_repository(steps: dict[str, dict[str, Any]]) -> None:
    done = carried_out(steps["check"], SCENES="**/*.scene\n", SARIF="found.sarif")
    assert done.returncode == 2
    (line,) = done.stdout.splitlines()
    assert line.startswith("::error file=bad.scene,line=1,")
    assert '"uri": "bad.scene"' in Path("found.sarif").read_text(encoding="utf-8")
    assert carried_out(steps["check"], SCENES="a folder/*.scene", SARIF="").returncode == 0
    assert carried_out(steps["check"], SCENES="", SARIF="").stdout == ""
    assert "title=E401" in carried_out(steps["check"], SCENES="$(id).scene", SARIF="").stdout


@pytest.mark.long
def test_the_action_runs_scenes_and_says_what_has_changed(steps: dict[str, dict[str, Any]]) -> None:
    first = carried_out(steps["run"], SCENES="stiff-cantilever\n\n", REPORTS="old", AGAINST="")
    assert first.returncode == 0, first.stderr
    assert Path("old/stiff-cantilever/junit.xml").is_file()
    again = carried_out(steps["run"], SCENES="stiff-cantilever\nbad.scene", REPORTS="new", AGAINST="old")
    assert again.returncode == 2, again.stderr
    assert "::error file=bad.scene" in again.stdout
    assert "stiff-cantilever" in Path("summary.md").read_text(encoding="utf-8")
    assert Path("summary.md").read_text(encoding="utf-8") == Path("new/comment.md").read_text(encoding="utf-8")
