"""Another process that compiles kernels: it helps or is done without, and is never left behind."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from softmark.solvers.runtime import kernel_cache, parallel_compilation


@pytest.fixture
def started(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[Any]]:
    """The processes that were started; there are two processors, whatever this machine has."""
    found: list[Any] = []
    start = parallel_compilation._start_helper

    def seen(code: str) -> Any:
        found.append(start(code))
        return found[-1]

    monkeypatch.setattr(parallel_compilation, "count_processors", lambda: 2)
    monkeypatch.setattr(parallel_compilation, "_start_helper", seen)
    monkeypatch.setattr(kernel_cache, "_made", 0)
    yield found
    assert all(process.poll() is not None for process in found)


def test_what_it_makes_is_counted_here(started: list[Any]) -> None:
    with parallel_compilation.allow_helper(True), parallel_compilation.helper_process("print(3)"):
        assert kernel_cache.count_compiled() == 0
    assert len(started) == 1
    assert kernel_cache.count_compiled() == 3


@pytest.mark.parametrize("code", ["import os; os.abort()", "import nothing_of_that_name", "print('three')"])
def test_one_that_crashes_is_done_without(started: list[Any], code: str) -> None:
    with parallel_compilation.allow_helper(True), parallel_compilation.helper_process(code):
        pass
    assert len(started) == 1
    assert kernel_cache.count_compiled() == 0


def test_one_that_does_not_end_is_ended(started: list[Any], monkeypatch: pytest.MonkeyPatch) -> None:
    """Both when all else is done, and when that failed: nobody waits a minute."""
    begin = time.monotonic()
    monkeypatch.setattr(parallel_compilation, "PATIENCE", 0.05)
    with parallel_compilation.allow_helper(True), parallel_compilation.helper_process("import time; time.sleep(60)"):
        pass
    with (
        pytest.raises(KeyboardInterrupt),
        parallel_compilation.allow_helper(True),
        parallel_compilation.helper_process("import time; time.sleep(60)"),
    ):
        raise KeyboardInterrupt
    assert len(started) == 2
    assert time.monotonic() - begin < 30.0


def test_none_is_started_where_it_would_not_help(started: list[Any], monkeypatch: pytest.MonkeyPatch) -> None:
    """Not where nobody asked, with one processor, in a program without a Python, or where nothing can be kept."""
    with parallel_compilation.helper_process("print(3)"):
        pass
    for place, name, value in (
        (parallel_compilation, "count_processors", lambda: 1),
        (sys, "executable", ""),
        (sys, "frozen", True),
        (kernel_cache, "CACHED", False),
        (os, "access", lambda path, mode: False),
    ):
        with monkeypatch.context() as other:
            other.setattr(place, name, value, raising=False)
            with parallel_compilation.allow_helper(True), parallel_compilation.helper_process("print(3)"):
                pass
    assert started == []
    assert kernel_cache.count_compiled() == 0


def test_nothing_is_imported_from_where_it_starts(
    started: list[Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A file of the same name as a package in the folder of a scene is somebody's own."""
    (tmp_path / "numpy.py").write_text("open('imported', 'w')\n", encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    with (
        parallel_compilation.allow_helper(True),
        parallel_compilation.helper_process(
            "import importlib.util as u; print(int('site' in u.find_spec('numpy').origin))"
        ),
    ):
        pass
    assert kernel_cache.count_compiled() == 1


@pytest.mark.long
@pytest.mark.slow
def test_a_cold_run_says_what_both_have_made(tmp_path: Path) -> None:
    """All kernels on disk are of the two, each made once; then all is there, and nothing is said or started."""
    said, answers, kernels = [], [], []
    if parallel_compilation.count_processors() < 2:
        pytest.skip("one processor")
    for _ in range(2):
        run = subprocess.run(
            [sys.executable, "-m", "softmark.interpreter", "run", "silicone-beam", "--model", "corot_tet"],
            cwd=tmp_path, capture_output=True, text=True, check=False,
            env={**os.environ, "XDG_CACHE_HOME": str(tmp_path / "cache")},
        )  # fmt: skip
        said.append([line for line in run.stderr.splitlines() if "compiling" in line])
        answers.append(next(line.split()[:12] for line in run.stdout.splitlines() if line.startswith("corot_tet")))
        kernels.append({file.name for file in (tmp_path / "cache").rglob(f"*{kernel_cache.SUFFIX}")})
    assert said[0][0] == "  compiling kernels, once for this version ..."
    assert said[0][1].startswith(f"  compiling kernels: {len(kernels[0])}, ")
    assert said[1] == []
    assert answers[0] == answers[1]
    assert kernels[0] == kernels[1]
