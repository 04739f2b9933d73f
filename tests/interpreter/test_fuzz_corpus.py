"""Inputs that once broke a promise keep it; and a short random version of the same promises, the same in every run.

The promises are those of tests/fuzz: texts end in a scene or in errors that can be shown, mesh files in a mesh or a
reason; overrides, reports and journals are used or refused in words. To keep an input that broke one: put it into
tests/fuzz/corpus under a name that says what it is, with the ending of its kind.
"""

from __future__ import annotations

import os
import random
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

FUZZ = Path(__file__).parents[1] / "fuzz"
CORPUS = sorted((FUZZ / "corpus").iterdir())
TARGETS = {
    ".scene": "scene",
    ".overrides": "overrides",
    ".results": "journals",
    ".journal": "journals",
}  # others: meshes
DRAWN = settings(
    derandomize=True, deadline=None, max_examples=40, suppress_health_check=list(HealthCheck), database=None
)


@pytest.mark.parametrize("file", CORPUS, ids=lambda p: p.name)
def test_what_broke_a_promise_keeps_it(file: Path, fuzz_folder: Path) -> None:
    name = TARGETS.get(file.suffix)
    if name is None:
        word = import_module("meshes").examine(file)
    else:
        word = import_module(name).target(fuzz_folder)(file.read_bytes())
    assert word  # `refused`, `accepted` ...: raises where a promise is broken


@DRAWN
@given(seed=st.integers(0, 2**32))
def test_changed_scenes(fuzz_folder: Path, seed: int) -> None:
    """A standard scene or a golden after some changes of its tokens and declarations."""
    scene, mutate = import_module("scene"), import_module("mutate")
    chance, others = random.Random(seed), SEEDS or SEEDS.extend(scene.texts(scene.seeds())) or SEEDS
    scene.examine(mutate.changed(chance.choice(others), chance, others), fuzz_folder)


SEEDS: list[str] = []


@DRAWN
@given(
    text=st.text(st.characters(codec="utf-8"), max_size=60)
    | st.text("()[]{}=<>.,\"'#^*/-+0123 \nmkPaxe\r\t\0", max_size=60)
)
def test_letters(fuzz_folder: Path, text: str) -> None:
    import_module("scene").examine(text, fuzz_folder)


@DRAWN
@given(seed=st.integers(0, 2**32))
def test_changed_overrides(fuzz_folder: Path, seed: int) -> None:
    overrides, mutate = import_module("overrides"), import_module("mutate")
    chance = random.Random(seed)
    text = mutate.changed(chance.choice(overrides.SEEDS), chance, list(overrides.SEEDS))
    overrides.target(fuzz_folder)(text.encode("utf-8", errors="replace"))


@DRAWN
@given(seed=st.integers(0, 2**32))
def test_changed_results_and_journals(fuzz_folder: Path, seed: int) -> None:
    journals = import_module("journals")
    chance = random.Random(seed)
    journals.target(fuzz_folder)(journals.changed(chance.choice(journals.seeds()), chance))


@pytest.mark.slow
@pytest.mark.long
@DRAWN
@given(seed=st.integers(0, 2**32))
def test_changed_mesh_files(fuzz_folder: Path, seed: int) -> None:
    meshes = import_module("meshes")
    chance, own = random.Random(seed), FILES or FILES.extend(meshes.seeds()) or FILES
    meshes.target(fuzz_folder)(meshes.changed(chance.choice(own), chance, own))


FILES: list[bytes] = []


@pytest.mark.parametrize("script", [["spoilt_files.py", "20", "3"], ["editor.py", "20", "3"]], ids=lambda s: s[0])
@pytest.mark.long
@pytest.mark.slow
def test_spoilt_files_and_texts_in_an_editor(script: list[str], tmp_path: Path) -> None:
    """The fuzzers of spoilt files and of editor requests find nothing, in processes with limited memory."""
    command = [sys.executable, str(FUZZ / script[0]), *script[1:]]
    environment = {**os.environ, "SOFTMARK_FUZZ": str(tmp_path)}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.long
@pytest.mark.slow
def test_reading_a_scene_does_nothing_but_read(tmp_path: Path) -> None:
    """In a process of its own, since an audit hook stays: no file that is not named, no process, no network."""
    environment = {**os.environ, "SOFTMARK_FUZZ": str(tmp_path)}
    command = [sys.executable, str(FUZZ / "mass.py"), "60", "5"]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    kept = [p for p in (tmp_path / "mass").iterdir() if p.suffix == ".txt"]
    assert not kept


def test_the_fence_hears_what_it_must() -> None:
    """A fence that would let everything pass would make the test above empty."""
    script = "\n".join(
        [
            "import guard, socket, subprocess, pathlib, os",
            "fence, heard = guard.Fence(pathlib.Path('/nowhere')), 0",
            "for offence in (lambda: open('/etc/hostname'), lambda: socket.socket(), lambda: subprocess.run(['true']),",
            "                lambda: exec(compile('1', 'scene', 'exec')), lambda: os.system('true')):",
            "    fence.named = 'text'",
            "    try: offence()",
            "    except guard.Trespass: heard += 1",
            "    fence.named = None",
            "print(heard)",
        ]
    )
    done = subprocess.run([sys.executable, "-c", script], cwd=FUZZ, capture_output=True, text=True, check=False)
    assert done.stdout == "5\n", done.stderr
