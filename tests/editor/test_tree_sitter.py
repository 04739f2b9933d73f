"""The grammar of tree-sitter, built by its own program: it reads every scene that is shipped, and what is no scene not.

The program is `tree-sitter`, of npm or cargo (`tree-sitter-cli`); what it builds needs a compiler of C.
"""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import pytest

from softmark.interpreter.language_server.syntax_highlighting import tree_sitter_grammar
from softmark.scenes import ROOT

pytestmark = pytest.mark.slow
SCENES = sorted(ROOT.rglob("*.scene"))
WRONG = {  # what no scene has
    "a bracket that is open": "body a = solid(box(",
    "two values": "param L = 3 mm 4 mm",
    "no name": "param = 3 mm",
    "a foreign mark": "param L = 3 mm;",
}


@pytest.fixture(scope="module")
def parser(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a parser that was made of the grammar."""
    if not shutil.which("tree-sitter") or not any(map(shutil.which, ("cc", "gcc", "clang"))):
        pytest.skip("no tree-sitter, or no compiler of C, is here")
    folder = tmp_path_factory.mktemp("tree-sitter")
    for name, content in tree_sitter_grammar.files().items():
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_bytes(content)
    for step in (["generate", "src/grammar.json"], ["build"]):
        done = _ask(folder, *step)
        assert done.returncode == 0, done.stderr
    return folder


def _ask(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    """Its program, which keeps what it builds in this folder alone."""
    own = {**os.environ, "HOME": str(folder), "XDG_CACHE_HOME": str(folder), "XDG_CONFIG_HOME": str(folder)}
    return subprocess.run(["tree-sitter", *words], cwd=folder, env=own, capture_output=True, text=True, timeout=120)


def test_every_shipped_scene_is_read_without_an_error(parser: Path) -> None:
    done = _ask(parser, "parse", "--quiet", *map(str, SCENES))  # which names those with a node ERROR or MISSING
    assert (done.returncode, done.stdout) == (0, ""), done.stdout


@pytest.mark.parametrize("what", WRONG)
def test_what_is_no_scene_has_an_error(parser: Path, tmp_path: Path, what: str) -> None:
    scene = tmp_path / "wrong.scene"
    scene.write_text(WRONG[what], encoding="utf-8")
    done = _ask(parser, "parse", str(scene))
    assert done.returncode != 0
    assert "(ERROR" in done.stdout or "(MISSING" in done.stdout


def test_the_colours_fit_the_grammar(parser: Path) -> None:
    """The names of nodes in the queries are those of the grammar, else its program refuses them."""
    done = _ask(parser, "query", "--quiet", "queries/highlights.scm", str(SCENES[0]))
    assert done.returncode == 0, done.stderr
