"""Compiled kernels: a cache on disk that never answers with what older sources computed."""

from __future__ import annotations

import gc
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from numba.core.errors import TypingError

from softmark.solvers.runtime import kernel_cache

SLOW = pytest.mark.slow  # processes that compile, in their second and later forms

CALLEE = """
from package.kernel_cache import kernel

@kernel
def factor(x):
    return {factor} * x
"""
CALLER = """
from package.kernel_cache import kernel
from package.callee import factor

@kernel
def twice(x):
    return 2.0 * factor(x)
"""
ASK = """
from package import caller, kernel_cache
before = kernel_cache.is_compiled()
print(caller.twice(1.0), before, kernel_cache.is_compiled(), len(caller.twice.stats.cache_hits))
"""


@pytest.fixture
def package(tmp_path: Path) -> Path:
    """A package with two kernels in two files, one calling the other, and our kernel_cache.py beside them."""
    folder = tmp_path / "package"
    folder.mkdir()
    (folder / "__init__.py").touch()
    shutil.copy(Path(kernel_cache.__file__), folder / "kernel_cache.py")
    (folder / "callee.py").write_text(CALLEE.format(factor=3.0), encoding="utf-8")
    (folder / "caller.py").write_text(CALLER, encoding="utf-8")
    return folder


def ask(folder: Path, **environment: str | None) -> list[str]:
    """What a new process says: the number, whether kernels were on disk before and after, cache hits."""
    # no bytecode: Python takes a source of the same length and age for the one that it compiled
    own = {"XDG_CACHE_HOME": str(folder.parent / "cache"), "PYTHONDONTWRITEBYTECODE": "1"}
    merged = {**os.environ, **own, **environment}
    settings = {name: value for name, value in merged.items() if value is not None}
    run = subprocess.run(
        [sys.executable, "-c", ASK],
        cwd=folder.parent,
        env=settings,
        capture_output=True,
        text=True,
        check=False,
    )
    assert run.returncode == 0, run.stderr
    return run.stdout.split()


@pytest.mark.long
@pytest.mark.slow
def test_an_edited_callee_is_never_answered_from_the_cache(package: Path) -> None:
    """numba itself looks at the file of the kernel that is called, not at those of the ones it calls."""
    assert ask(package) == ["6.0", "False", "True", "0"]
    assert ask(package) == ["6.0", "True", "True", "1"]  # from disk
    callee = package / "callee.py"
    times = callee.stat()
    callee.write_text(CALLEE.format(factor=5.0), encoding="utf-8")  # as long as before
    os.utime(callee, ns=(times.st_atime_ns, times.st_mtime_ns))  # and as old
    assert ask(package) == ["10.0", "False", "True", "0"]
    callee.write_text(CALLEE.format(factor=3.0), encoding="utf-8")
    assert ask(package)[0] == "6.0"


@pytest.mark.long
@pytest.mark.slow
def test_without_a_writable_cache_kernels_live_in_memory(package: Path) -> None:
    """A file where the folder should be: permissions do not stop a test that runs as root."""
    blocked = package.parent / "blocked"
    blocked.touch()
    assert ask(package, XDG_CACHE_HOME=str(blocked)) == ["6.0", "False", "False", "0"]
    assert blocked.read_bytes() == b""


@pytest.mark.long
@pytest.mark.slow
def test_without_a_home_nothing_is_written_where_one_happens_to_be(package: Path) -> None:
    """expanduser leaves "~" alone for a user that nobody knows; here by a variable that says so."""
    before = sorted(package.parent.iterdir())
    assert ask(package, XDG_CACHE_HOME=None, HOME="~") == ["6.0", "False", "False", "0"]
    assert sorted(package.parent.iterdir()) == before


def kept(folder: Path) -> list[Path]:
    """The files of the cache."""
    return sorted(p for p in (folder.parent / "cache").rglob("*") if p.is_file())


def spoilt(data: bytes, how: str) -> bytes:
    """What a crash, a bad disk or somebody else leaves of a file."""
    middle = len(data) // 2
    return {
        "cut off": data[:middle],
        "empty": b"",
        "one bit": data[:middle] + bytes([data[middle] ^ 1]) + data[middle + 1 :],
        "longer": data + b"x",
    }[how]


WAYS = ["cut off", pytest.param("empty", marks=SLOW), "one bit", pytest.param("longer", marks=SLOW)]


@pytest.mark.slow
@pytest.mark.parametrize("how", WAYS)
def test_a_kernel_that_was_spoilt_is_compiled_anew(package: Path, how: str) -> None:
    """numba alone ends with an error of pickle at some of these, and runs what is left at others."""
    assert ask(package) == ["6.0", "False", "True", "0"]
    files = kept(package)
    assert len(files) == 2
    for file in files:
        file.write_bytes(spoilt(file.read_bytes(), how))
    assert ask(package) == ["6.0", "True", "True", "0"]
    assert all(spoilt(file.read_bytes(), how) != file.read_bytes() for file in files)  # kept again, whole


@pytest.mark.long
@pytest.mark.slow
def test_a_kernel_under_the_name_of_another_is_not_taken(package: Path) -> None:
    ask(package)
    one, other = kept(package)
    data = one.read_bytes()
    one.write_bytes(other.read_bytes())
    other.write_bytes(data)
    assert ask(package) == ["6.0", "True", "True", "0"]


@pytest.mark.long
@pytest.mark.slow
def test_a_folder_in_the_place_of_a_kernel_is_done_without(package: Path) -> None:
    ask(package)
    for file in kept(package):
        file.unlink()
        file.mkdir()
    assert ask(package)[0] == "6.0"
    assert not list((package.parent / "cache").rglob(".part-*"))


@pytest.mark.long
@pytest.mark.slow
def test_two_versions_share_a_cache(package: Path) -> None:
    """As two environments of one person; the second has one more line in a source that kernels call."""
    other = package.parent / "other" / "package"
    shutil.copytree(package, other)
    (other / "callee.py").write_text(CALLEE.format(factor=5.0), encoding="utf-8")
    cache = str(package.parent / "cache")
    assert ask(package)[0] == "6.0"
    assert ask(other, XDG_CACHE_HOME=cache)[0] == "10.0"
    assert [ask(p, XDG_CACHE_HOME=cache)[3] for p in (package, other)] == ["1", "1"]  # both from disk


@pytest.mark.long
@pytest.mark.slow
def test_types_that_are_compiled_at_once_do_not_take_each_others_place(package: Path) -> None:
    """Six processes, three types, an empty cache: numba's own index would give two of them one file."""
    arguments = ["1.0", "1", "1j"]
    text = "import numpy as np\nfrom package import caller\nprint(complex(caller.twice({})))"
    environment = {**os.environ, "XDG_CACHE_HOME": str(package.parent / "cache")}
    for _ in range(2):  # compiled, then from disk
        running = [
            subprocess.Popen(
                [sys.executable, "-c", text.format(a)],
                cwd=package.parent,
                env=environment,
                stdout=subprocess.PIPE,
                text=True,
            )
            for a in arguments * 2
        ]
        assert [p.communicate()[0].strip() for p in running] == ["(6+0j)", "(6+0j)", "6j"] * 2
    assert len(kept(package)) == 2 * len(arguments)


@pytest.mark.long
@pytest.mark.slow
def test_a_disk_that_is_full_keeps_no_kernel_and_stops_nothing(package: Path) -> None:
    """A limit on the size of files fails where a full disk does."""
    limited = "import resource, signal\nsignal.signal(signal.SIGXFSZ, signal.SIG_IGN)\n"
    limited += "resource.setrlimit(resource.RLIMIT_FSIZE, (100, 100))\n"
    limited += "from package import caller\nprint(caller.twice(1.0))"
    environment = {**os.environ, "XDG_CACHE_HOME": str(package.parent / "cache"), "PYTHONDONTWRITEBYTECODE": "1"}
    run = subprocess.run(
        [sys.executable, "-c", limited], cwd=package.parent, env=environment,
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert (run.stdout, run.stderr) == ("6.0\n", "")
    assert kept(package) == []


def told(folder: Path, text: str) -> str:
    """What a new process prints, which never takes bytecode for a source."""
    environment = {**os.environ, "XDG_CACHE_HOME": str(folder.parent / "cache"), "PYTHONDONTWRITEBYTECODE": "1"}
    run = subprocess.run(
        [sys.executable, "-c", text], cwd=folder.parent, env=environment,
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert run.returncode == 0, run.stderr
    return run.stdout.strip()


EDITED = """
import re
from pathlib import Path
import package.kernel_cache
file = Path("package/{file}.py")
old = file.read_text()
file.write_text(old.replace("{old}", "{new}"))
from package import caller
print(caller.twice(1.0))
file.write_text(old)
"""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("file", "old", "new", "answer"),
    [
        ("callee", "3.0", "5.0", "10.0"),
        pytest.param("caller", "2.0", "4.0", "12.0", marks=SLOW),
        pytest.param("callee", "* x", "+ x", "8.0", marks=SLOW),
    ],
)
def test_a_source_that_is_edited_while_a_process_starts(
    package: Path, file: str, old: str, new: str, answer: str
) -> None:
    """Between the import of kernel_cache.py, which takes the digest of all sources, and that of the kernel."""
    edited = EDITED.format(file=file, old=old, new=new)
    assert told(package, edited) == answer  # kept under the digest of the sources that are there again
    assert ask(package)[0] == "6.0"
    assert told(package, edited) == answer  # and the other way round
    assert ask(package) == ["6.0", "True", "True", "1"]


OUTSIDE = """
from package.kernel_cache import kernel
{constant}

@kernel
def f(x):
    return x * {factor}
"""


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.parametrize("named", [pytest.param(False, marks=SLOW), True])
def test_a_kernel_elsewhere_whose_constant_is_edited(package: Path, named: bool) -> None:
    """Its file is not among the sources, and its operations stay the same: a script of somebody else's."""
    script = package.parent / "script.py"
    for number in ("2.0", "3.0", "2.0"):
        script.write_text(
            OUTSIDE.format(constant=f"A = {number}" if named else "", factor="A" if named else number),
            encoding="utf-8",
        )
        assert told(package, "import script; print(script.f(1.0))") == number
    assert told(package, "import script; script.f(1.0); print(len(script.f.stats.cache_hits))") == "1"


def of(text: str, **names: object) -> str:
    """The stamp of a function f of such a text, which has no file."""
    exec(text, names)
    return kernel_cache.kernel_digest(names["f"])


@pytest.mark.slow
def test_the_stamp_of_a_kernel_tells_what_it_computes_with() -> None:
    """The same in every process, too: no address and no order of a set."""
    g, h = (kernel_cache.numba.njit(eval(f"lambda x: x * {c}")) for c in (2.0, 3.0))
    v, w = (kernel_cache.kernel_part(eval(f"lambda x: x * {c}")) for c in (4.0, 5.0))
    text = "def f(x): return A * x"
    stamps = [
        of(text, A=2.0), of(text, A=2), of(text, A=True), of(text, A=(1.0, 2.0)), of(text, A=np.arange(3)),
        of(text, A=np.arange(4)), of(text, A=g), of(text, A=h), of(text, A=np), of("def f(x): return B * x", B=2.0),
        of(text, A=v), of(text, A=w),
        of("def f(x): return 2.0 * x"), of("def f(x): return 3.0 * x"), of("def f(x, y=1): return 2.0 * x"),
        of("def f(x): return (lambda y: 2.0 * y)(x)"), of("def f(x): return (lambda y: 3.0 * y)(x)"),
    ]  # fmt: skip
    assert len(set(stamps)) == len(stamps)
    assert of(text, A=2.0, unused=1.0) == stamps[0]
    itself = "def f(x): return f(x - 1) if x in {'a', 'b', 'c', 'd'} else 0"
    script = "from softmark.solvers.runtime import kernel_cache\n"
    script += f"n = {{}}; exec({itself!r}, n); print(kernel_cache.kernel_digest(n['f']))"
    seeds = [{**os.environ, "PYTHONHASHSEED": str(seed)} for seed in (1, 2)]
    found = {subprocess.run([sys.executable, "-c", script], env=e, capture_output=True).stdout for e in seeds}
    assert found == {f"{of(itself)}\n".encode()}


@kernel_cache.kernel_part
def _doubled(x: float) -> float:
    return 2.0 * x


@kernel_cache.kernel
def _doubled_in(x: np.ndarray) -> None:
    for i in range(len(x)):
        x[i] = _doubled(x[i])


def test_a_part_is_compiled_within_its_kernel_and_runs_by_itself_as_it_is_written() -> None:
    """A Python that called machine code without a wrapper for it would crash; numba's own decorator allows that."""
    x = np.ones(3)
    _doubled_in(x)
    np.testing.assert_array_equal(x, 2.0)
    assert _doubled(1.5) == 3.0
    assert _doubled(1) == 2.0  # a type that no kernel called it with


@pytest.mark.parametrize("enabled", [True, False])
def test_compiling_leaves_the_collection_of_garbage_as_it_was(enabled: bool) -> None:
    """Off meanwhile, also within another kernel and where it fails."""
    seen: list[bool] = []

    class Watch(kernel_cache.event.Listener):  # type: ignore[misc]
        def on_start(self, event: object) -> None:
            seen.append(gc.isenabled())

        on_end = on_start

    def broken(x: np.ndarray) -> None:
        x[0] = undefined(x)  # type: ignore[name-defined]  # noqa: F821

    was, watch = gc.isenabled(), Watch()
    gc.enable() if enabled else gc.disable()
    try:
        with kernel_cache.event.install_listener("numba:run_pass", watch), pytest.raises(TypingError):
            kernel_cache.kernel(broken)(np.ones(1))
        assert seen
        assert not any(seen)
        assert gc.isenabled() == enabled
    finally:
        gc.enable() if was else gc.disable()


def copied(tmp_path: Path) -> list[Path]:
    """All solver sources elsewhere, so that they may be edited."""
    root = Path(kernel_cache.__file__).parents[1]
    shutil.copytree(root, tmp_path / "solvers", ignore=shutil.ignore_patterns("__pycache__"))
    return sorted((tmp_path / "solvers").rglob("*.py"))


@pytest.mark.long
@pytest.mark.slow
def test_any_edit_of_any_source_changes_the_folder(tmp_path: Path) -> None:
    """One byte more in each file in turn, none of which may go unnoticed."""
    files = copied(tmp_path)
    assert len(files) == len(kernel_cache.sources()) > 20
    seen = {kernel_cache.digest(files)}
    for file in files:
        text = file.read_bytes()
        file.write_bytes(text + b"#")
        seen.add(kernel_cache.digest(files))
        file.write_bytes(text)
    assert len(seen) == len(files) + 1
    assert kernel_cache.digest(files) == kernel_cache.digest(kernel_cache.sources())


def test_what_moves_between_files_changes_the_folder(tmp_path: Path) -> None:
    (tmp_path / "a.py").write_bytes(b"one two")
    (tmp_path / "b.py").write_bytes(b" three")
    files = sorted(tmp_path.iterdir())
    before = kernel_cache.digest(files)
    (tmp_path / "a.py").write_bytes(b"one")
    (tmp_path / "b.py").write_bytes(b" two three")
    assert kernel_cache.digest(files) != before
    assert kernel_cache.digest(files, "other numba") != kernel_cache.digest(files)


def test_the_folder_follows_the_environment(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert kernel_cache.cache_folder().parent == tmp_path / "softmark" / "kernels"
    monkeypatch.delenv("XDG_CACHE_HOME")
    monkeypatch.setenv("HOME", str(tmp_path))
    assert kernel_cache.cache_folder().parent == tmp_path / ".cache" / "softmark" / "kernels"
