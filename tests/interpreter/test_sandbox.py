"""What reading a scene never does: run code, write, open what nobody named, start a process, touch the network.

Python tells an audit hook of every file that is opened, every socket and every process. The hook sits in a process of
its own and lists what is outside the promise; the list must be empty.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest
from daily_selection import DAY, PARTS, WHOLE

from softmark.scenes import ROOT

ERRORS = Path(__file__).parents[1] / "errors"
WATCH = r"""
import os, sys
from pathlib import Path

# a folder and what is in it; Python's own, with the libraries, and softmark's
import softmark, softmark.grammar, softmark.interpreter, softmark.references, softmark.scenes, softmark.solvers
parts = (softmark, softmark.grammar, softmark.interpreter, softmark.references, softmark.scenes, softmark.solvers)
own = [Path(sys.prefix), Path(sys.base_prefix), Path(os.__file__).parent]
own += [Path(p) for p in sys.path if p]
own += [Path(p) for part in parts for p in part.__path__]
allowed = {str(p.resolve()) for p in own}
cache = os.path.realpath(os.path.join(os.environ["XDG_CACHE_HOME"], "softmark"))  # of the grammar's tables
free = ("/proc/self/statm", "/proc/meminfo", "/sys/fs/cgroup/")  # what says how much memory readers may take
writes = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND
NEVER = ("socket.", "subprocess.", "os.system", "os.exec", "os.posix_spawn", "os.fork", "os.spawn", "urllib.",
         "ctypes.dlopen", "os.remove", "os.rename", "os.mkdir", "os.rmdir", "os.chmod", "os.symlink", "os.link",
         "shutil.", "tempfile.", "ftplib.", "http.", "smtplib.", "webbrowser.", "pickle.find_class")
here, broken, busy = [""], [], []

def outside(path):
    real = os.path.realpath(path)
    return not any(real == a or real.startswith(a + os.sep) for a in (*allowed, cache, here[0]))

def hook(event, arguments):
    if not here[0] or busy:
        return
    busy.append(1)
    try:
        if event == "ctypes.dlopen" and arguments[0] is None:  # Python's own symbols, as numpy asks for them
            return
        if event.startswith(NEVER) and not any(cache in str(a) for a in arguments):
            broken.append((event, *map(str, arguments)))
        elif event == "open" and isinstance(arguments[0], (str, bytes)):
            path, _, flags = arguments
            if path == os.devnull or os.fsdecode(path).startswith(free):
                return
            if os.fsdecode(path).startswith(cache):
                return
            if flags & writes and not os.fsdecode(path).endswith(".pyc") and ".pyc." not in os.fsdecode(path):
                broken.append(("write", os.fsdecode(path)))
            elif outside(path):
                broken.append(("read", os.fsdecode(path)))
    finally:
        busy.pop()

sys.addaudithook(hook)
from softmark.interpreter.cli.main import main
stdout, sys.stdout, sys.stderr = sys.stdout, open(os.devnull, "w"), open(os.devnull, "w")
for scene in sys.stdin.read().split("\n"):
    for command in sys.argv[1:]:
        here[0] = os.path.realpath(os.path.dirname(scene))
        os.chdir(here[0])
        main([command, os.path.basename(scene)])
        for what in broken:
            print(command, scene, *what, file=stdout)
        broken.clear()
        here[0] = ""
print("done", file=stdout)
"""


def watched(scenes: list[Path], *commands: str) -> str:
    """What commands on scenes did that they may not do, a line each, and `done`."""
    with tempfile.TemporaryDirectory() as cache:
        settings = {**os.environ, "PYTHONDONTWRITEBYTECODE": "1", "XDG_CACHE_HOME": cache}
        done = subprocess.run(
            [sys.executable, "-P", "-c", WATCH, *commands], input="\n".join(map(str, scenes)), env=settings,
            capture_output=True, text=True, check=False,
        )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.parametrize("folder", [ROOT, pytest.param(ERRORS, marks=pytest.mark.slow)], ids=["library", "goldens"])
def test_checking_and_planning_open_nothing_but_the_scene_its_folder_and_softmark(folder: Path) -> None:
    scenes = sorted(folder.rglob("*.scene"))[None if WHOLE else DAY.toordinal() % PARTS :: 1 if WHOLE else PARTS]
    assert len(scenes) > 10
    assert watched(scenes, "check", "plan") == "done\n"


@pytest.mark.slow
@pytest.mark.long
def test_a_data_set_is_not_fetched_by_checking(tmp_path: Path) -> None:
    scene = tmp_path / "data.scene"
    text = (ERRORS / "data-offline.scene").read_text(encoding="utf-8")
    scene.write_text(text, encoding="utf-8")
    assert watched([scene], "check", "plan") == "done\n"


def test_the_watch_sees_what_it_is_to_see(tmp_path: Path) -> None:
    """`use` leaves the folder of the scene, as it says: the hook tells of it."""
    (tmp_path / "inner").mkdir()
    (tmp_path / "lengths.scene").write_text("param L = 1 m\n", encoding="utf-8")
    scene = tmp_path / "inner" / "a.scene"
    scene.write_text('use "../lengths.scene" as lengths\nparam k = 2\n', encoding="utf-8")
    told = watched([scene], "check")
    assert f"read {tmp_path / 'inner' / '..' / 'lengths.scene'}" in told or "lengths.scene" in told


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize(
    "value",
    ['__import__("os").system("touch here")', "`touch here`", '"$(touch here)"', "${HOME}", "{0.__class__}", "exec(1)"],
)
def test_no_value_is_run(tmp_path: Path, value: str) -> None:
    scene = tmp_path / "code.scene"
    scene.write_text(f"param L = {value}\n", encoding="utf-8")
    assert watched([scene], "check", "plan") == "done\n"
    assert [p.name for p in tmp_path.iterdir()] == ["code.scene"]
