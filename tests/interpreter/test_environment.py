"""Machines that lack something: streams, room, memory, files, a home. A clear word and a status, never a traceback.

The many runs of `tests/benchmarks/siege.py` (a thousand at once, a hundred interrupts) are here in small.
"""

from __future__ import annotations

import errno
import importlib.util
import json
import os
import resource
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import pytest
from daily_selection import DAY, WHOLE

from softmark.interpreter.cli import exit_signals

DSL = (sys.executable, "-P", "-m", "softmark.interpreter")
SCENE = """material gel    = neo_hookean(young = 60 kPa, poisson = 0.4, density = 1000 kg/m^3)
body     beam   = solid(cylinder(length = 178 mm, radius = 19 mm), gel)
support  wall   = fixed(beam, where = x <= 0 mm)
load     weight = gravity(9.81 m/s^2)
model    rod    = beam6dof(segments = 8)
probe    tip    = point(beam, at = (178, 0, 0) mm)
metric   sag    = displacement(tip, along = -z)
study    finer  = sweep(rod.segments, over = [4, 8])
"""
MB = 1 << 20

SLOW = pytest.mark.slow  # further forms of what one process a test shows


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "rod.scene").write_text(SCENE, encoding="utf-8")
    return tmp_path


@pytest.fixture(scope="module")
def siege() -> ModuleType:
    file = Path(__file__).parents[1] / "benchmarks" / "siege.py"
    spec = importlib.util.spec_from_file_location("siege", file)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules["siege"] = module
    spec.loader.exec_module(module)
    return module


def dsl(folder: Path, *arguments: str, limit: tuple[int, int] | None = None, shell: str = "",
        **environment: str | None) -> subprocess.CompletedProcess[bytes]:  # fmt: skip
    """A command, with a limit of its own, or with streams as a shell redirects them."""
    # no bytecode: Python itself would keep what a limit cut off, and every later process would stumble over it
    merged = {**os.environ, "PYTHONDONTWRITEBYTECODE": "1", **environment}
    command: list[str] = [*DSL, *arguments]
    if shell:
        command = ["bash", "-c", f'"$@" {shell}', "bash", *command]

    def limited() -> None:
        if limit is not None:
            resource.setrlimit(limit[0], (limit[1], limit[1]))
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)

    return subprocess.run(
        command, cwd=folder, env={k: v for k, v in merged.items() if v is not None}, preexec_fn=limited,
        stdin=subprocess.DEVNULL, capture_output=True, check=False,
    )  # fmt: skip


def said(done: subprocess.CompletedProcess[bytes]) -> str:
    """What it wrote on standard error, without a traceback."""
    assert b"Traceback" not in done.stdout + done.stderr
    assert b"itself failed" not in done.stderr
    return done.stderr.decode(errors="replace")


# ------------------------------------------------------------------ streams


SAYING = [
    ("check", "rod.scene"),
    pytest.param(("list", "models"), marks=SLOW),
    pytest.param(("explain", "fem"), marks=SLOW),
    ("--version",),
]


@pytest.mark.parametrize("arguments", SAYING)
def test_standard_output_that_is_full(folder: Path, arguments: tuple[str, ...]) -> None:
    done = dsl(folder, *arguments, shell="> /dev/full")
    assert done.returncode == 3
    assert "error: No space left on device; make room" in said(done)


@pytest.mark.parametrize("arguments", [("check", "rod.scene"), ("check", "none.scene")])
def test_standard_error_that_is_full(folder: Path, arguments: tuple[str, ...]) -> None:
    """The exit status is 3 if a message cannot be printed, never that of an expectation or of Python's exit."""
    done = dsl(folder, *arguments, shell="2> /dev/full")
    assert done.returncode == (0 if "rod" in arguments[1] else 3)


@pytest.mark.parametrize("streams", [pytest.param(">&-", marks=SLOW), pytest.param("2>&-", marks=SLOW), "<&- >&- 2>&-"])
@pytest.mark.parametrize("arguments", [("check", "rod.scene"), ("run", "rod.scene", "--out", "o")])
def test_streams_that_are_closed(folder: Path, arguments: tuple[str, ...], streams: str) -> None:
    """A file that is opened would get the number of a closed stream, and what is printed would go into it."""
    done = dsl(folder, *arguments, shell=streams)
    said(done)
    assert done.returncode == 0
    if arguments[0] == "run":
        assert json.loads((folder / "o" / "report.json").read_text(encoding="utf-8"))["partial"] is False


@pytest.mark.slow
@pytest.mark.parametrize(
    "arguments",
    [("list",), pytest.param(("explain", "fem"), marks=SLOW), ("run", "rod.scene", "--json", "-")],
)
def test_a_reader_that_goes_away(folder: Path, arguments: tuple[str, ...]) -> None:
    said(dsl(folder, *arguments, shell="| head -1"))


@pytest.mark.slow
@pytest.mark.parametrize("encoding", ["ascii:strict", pytest.param("cp1252:strict", marks=SLOW)])
def test_terminals_that_lack_characters(folder: Path, encoding: str) -> None:
    """`corotational` has Greek letters and dashes; the scene a comment in Japanese where an error is shown."""
    settings = {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0", "PYTHONIOENCODING": encoding}
    for word in ("corotational", "fem", "W301"):
        done = dsl(folder, "explain", word, **settings)
        assert (done.returncode, said(done)) == (0, "")
    (folder / "jp.scene").write_text("param L = 1 furlong # 長さ\n", encoding="utf-8")
    assert "error[" in said(dsl(folder, "check", "jp.scene", **settings))


@pytest.mark.slow
def test_no_locale(folder: Path) -> None:
    done = dsl(folder, "run", "rod.scene", LC_ALL="xx_XX.none", LANG="xx_XX.none", LANGUAGE=None)
    assert (done.returncode, "error" in said(done)) == (0, False)


# ------------------------------------------------------------------ room, memory, files, folders


@pytest.mark.slow
@pytest.mark.parametrize("size", [pytest.param(0, marks=SLOW), 5000])
def test_a_disk_that_is_full(folder: Path, size: int) -> None:
    """By a limit on the size of files, which fails where a full disk does: after some bytes."""
    done = dsl(folder, "run", "rod.scene", "--out", "o", limit=(resource.RLIMIT_FSIZE, size))
    assert done.returncode == 3
    assert "error[E404]: cannot write o: File too large" in said(done)
    for file in (f for f in (folder / "o").iterdir() if f.name != "kept"):  # whole by its digest, or nothing
        json.loads(file.read_text(encoding="utf-8"))
    assert not list((folder / "o").rglob(".*")), "no part of a file is left"


@pytest.mark.long
@pytest.mark.slow
def test_a_journal_that_does_not_fit(folder: Path) -> None:
    arguments = ("compare", "rod.scene", "--out", "c", "--repeats", "0")
    done = dsl(folder, *arguments, limit=(resource.RLIMIT_FSIZE, 1000))
    assert done.returncode == 3
    assert "error[E404]: cannot write c: the journal could not be written completely" in said(done)
    whole = dsl(folder, *arguments, "--resume")
    assert whole.returncode == 0, said(whole)


def test_too_little_memory(folder: Path) -> None:
    done = dsl(folder, "run", "rod.scene", limit=(resource.RLIMIT_AS, 300 * MB))
    assert done.returncode == 3
    assert "this process is limited to 300 MB of memory (`ulimit -v`), but numpy, scipy and numba alone need" in said(
        done
    )
    assert dsl(folder, "check", "rod.scene", limit=(resource.RLIMIT_AS, 300 * MB)).returncode == 0


@pytest.mark.slow
def test_few_files(folder: Path) -> None:
    """Eight descriptors are enough."""
    done = dsl(folder, "run", "rod.scene", limit=(resource.RLIMIT_NOFILE, 8))
    assert done.returncode == 0, said(done)


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize(
    "settings",
    [
        {"HOME": None, "XDG_CACHE_HOME": None},
        pytest.param({"HOME": "/proc", "XDG_CACHE_HOME": None}, marks=SLOW),
        pytest.param({"HOME": "~", "XDG_CACHE_HOME": "relative"}, marks=SLOW),
        {"XDG_CACHE_HOME": "/dev/null"},
        pytest.param({"TMPDIR": "/nonexistent"}, marks=SLOW),
        {"TERM": "none", "COLUMNS": "0"},
        {"TZ": "Nowhere/Never"},
    ],
    ids=lambda s: " ".join(f"{k}={v}" for k, v in s.items()),
)
def test_homes_caches_and_folders_that_are_not_there(folder: Path, settings: dict[str, str | None]) -> None:
    done = dsl(folder, "run", "rod.scene", "--out", "o", **settings)
    assert done.returncode == 0, said(done)
    assert sorted(p.name for p in folder.iterdir()) == ["o", "rod.scene"]


def test_errors_of_the_system_are_named() -> None:
    assert "raise the limit on open files" in str(
        exit_signals.exhausted_resource(OSError(errno.EMFILE, "Too many open files"))
    )
    assert "out of memory" in str(exit_signals.exhausted_resource(MemoryError()))
    unmapped = ImportError("x.so: failed to map segment from shared object")
    assert "while loading libraries" in str(exit_signals.exhausted_resource(unmapped))
    assert exit_signals.exhausted_resource(ValueError("ours")) is None
    assert exit_signals.exhausted_resource(FileNotFoundError(errno.ENOENT, "No such file")) is None


# ------------------------------------------------------------------ signals


@pytest.mark.long
@pytest.mark.slow
def test_interrupts_at_any_moment(siege: ModuleType, tmp_path: Path) -> None:
    """A seeded moment of each of check, run and compare, another every day, or three; a hundred by the siege."""
    bench = siege.Bench(tmp_path / "bench")
    (bench.folder / "small.scene").write_text(SCENE, encoding="utf-8")
    bench.settings["XDG_CACHE_HOME"] = os.environ.get("XDG_CACHE_HOME", str(Path.home() / ".cache"))
    count, seed = (9, 7) if WHOLE else (3, DAY.toordinal())
    counts = siege.interrupts(bench, count, seed, ("check", "run", "compare"))
    assert sum(counts.values()) == count
    assert list(siege.bad(counts)) == [], f"seed {seed}"


@pytest.mark.parametrize("kind", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_while_a_file_is_written_leaves_no_part_of_it(tmp_path: Path, kind: signal.Signals) -> None:
    text = f"""
import os, signal
from pathlib import Path
from softmark.interpreter.cli import exit_signals
from softmark.interpreter.results import atomic_files
exit_signals.install_handlers()
exit_signals.set_interrupt_message(lambda: "2 models are kept")
os.replace = lambda old, new: os.kill(os.getpid(), {int(kind)})  # the moment before the file has its name
atomic_files.replace(Path("report.json"), "text")
print("went on")
"""
    done = subprocess.run([sys.executable, "-P", "-c", text], cwd=tmp_path, capture_output=True, text=True, check=False)
    word = "interrupted" if kind == signal.SIGINT else "terminated"
    assert (done.returncode, done.stdout, done.stderr) == (128 + kind, "", f"{word}; 2 models are kept\n")
    assert list(tmp_path.iterdir()) == []


def test_a_signal_in_a_destructor_is_not_swallowed(tmp_path: Path) -> None:
    """Python prints what a destructor raises, with a traceback, and goes on."""
    text = """
import os, signal
from softmark.interpreter.cli import exit_signals
exit_signals.install_handlers()
class Last:
    def __del__(self):
        os.kill(os.getpid(), signal.SIGINT)
Last()
print("went on")
"""
    done = subprocess.run([sys.executable, "-P", "-c", text], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "interrupted\n")


@pytest.mark.slow
def test_who_ignores_signals_goes_on_doing_so(folder: Path) -> None:
    """As `nohup dsl ... &` in a script."""
    done = dsl(folder, "run", "rod.scene", shell="& wait")
    assert done.returncode == 0, said(done)


def test_calls_from_python_leave_signals_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    from softmark.interpreter.cli.main import main

    before: tuple[Callable[..., object] | int | None, ...]
    before = signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGTERM)
    main(["--version"])
    assert (signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGTERM)) == before
