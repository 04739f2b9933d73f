"""Other programs as they should not be: each ends, in time, as what it is, and leaves nothing behind."""

from __future__ import annotations

import os
import subprocess
import sys
import textwrap
import time
from pathlib import Path

import pytest

from softmark.interpreter.models.external.external_process import LOG, MARK, ProgramEnd, run, strip_control_characters

GB = 1e9


def ended(folder: Path, program: str, seconds: float = 20.0, memory: float = 2 * GB, most: int = 2**20) -> ProgramEnd:
    """How a Python program ends; without its site packages, which it does not need, it begins in 10 ms."""
    (folder / "program.py").write_text(textwrap.dedent(program))
    return run([sys.executable, "-I", "-S", "program.py"], folder, seconds, memory, most=most)


def gone(pid: int) -> bool:
    """Whether a process has ended: what is killed may wait for its parent to hear of it."""
    for _ in range(100):
        try:
            state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
        except (FileNotFoundError, ProcessLookupError):
            return True
        if state in "ZX":
            return True
        time.sleep(0.02)
    return False


def test_what_ends_is_done_and_what_it_said_is_kept(tmp_path: Path) -> None:
    end = ended(tmp_path, """
        import os, sys
        print("one"); print("two", file=sys.stderr)
        print(os.environ["OMP_NUM_THREADS"], repr(sys.stdin.read()), os.getcwd() == os.environ["TMPDIR"])
    """)  # fmt: skip
    assert (end.how, end.code) == ("done", 0)
    assert sorted(end.last) == sorted(("one", "two", "1 '' True"))  # no input, one thread, its own folder
    assert 0.0 < end.wall_s < 20.0
    assert end.cpu_s is not None
    assert end.cpu_s <= end.wall_s
    assert MARK not in os.environ


def test_what_is_not_there_says_so(tmp_path: Path) -> None:
    end = run(["./no-such-program"], tmp_path, 5.0, GB)
    assert (end.how, end.code) == ("died", 127)
    assert "no-such-program" in end.message


def test_what_hangs_is_stopped(tmp_path: Path) -> None:
    end = ended(tmp_path, "import signal, time\nsignal.signal(signal.SIGTERM, signal.SIG_IGN)\ntime.sleep(60)", 0.3)
    assert end.how == "timed_out"
    assert 0.3 <= end.wall_s < 5.0
    assert end.message == "it did not finish within 0.3 s and was stopped; it printed nothing"


def test_what_floods_its_log_is_cut_and_stopped(tmp_path: Path) -> None:
    end = ended(tmp_path, "while True:\n    print('x' * 1000)", most=10_000)
    assert end.how == "flooded"
    assert (tmp_path / LOG).stat().st_size == 10_000
    assert max(map(len, end.last)) <= 160


@pytest.mark.parametrize(
    ("program", "why"),
    [
        ("import sys\nprint('no good')\nsys.exit(3)", "it ended with exit status 3"),
        ("import os, signal\nos.kill(os.getpid(), signal.SIGSEGV)", "it was terminated by a signal (SIGSEGV)"),
        pytest.param(
            "import os, signal\nos.kill(os.getpid(), signal.SIGKILL)",
            "it was terminated by a signal (SIGKILL)",
            marks=pytest.mark.slow,
        ),
    ],
)
def test_what_dies_says_how(tmp_path: Path, program: str, why: str) -> None:
    end = ended(tmp_path, program)
    assert (end.how, end.why) == ("died", why)


@pytest.mark.slow
@pytest.mark.long
def test_what_eats_memory_is_told_from_what_dies(tmp_path: Path) -> None:
    end = ended(tmp_path, "kept = []\nwhile True:\n    kept.append(bytearray(2**26))", memory=0.5 * GB)
    assert end.how == "out_of_memory"
    assert end.why == "it ran out of memory (limit 0.5 GB)"


CHILDREN = """
    import os, sys, time
    for away in (False, True):
        if os.fork() == 0:
            if away and os.fork() > 0:
                os._exit(0)  # its child has another parent
            if away:
                os.setsid()
            with open("pids", "a") as out:
                print(os.getpid(), file=out, flush=True)
            while True:
                time.sleep(60)  # with the log held open
    while not os.path.exists("pids") or len(open("pids").readlines()) < 2:
        time.sleep(0.01)
    {then}
"""


@pytest.mark.parametrize(
    ("then", "how"), [("time.sleep(60)", "timed_out"), pytest.param("print('bye')", "done", marks=pytest.mark.slow)]
)
def test_children_are_not_left_behind(tmp_path: Path, then: str, how: str) -> None:
    """One in its group, and one that went out of it."""
    end = ended(tmp_path, CHILDREN.format(then=then), 2.0 if how == "done" else 0.5)
    assert end.how == how
    assert end.wall_s < 2.0
    pids = [int(line) for line in (tmp_path / "pids").read_text().split()]
    assert len(pids) == 2
    assert all(map(gone, pids))


@pytest.mark.slow
def test_what_is_busy_without_us_ends_by_itself(tmp_path: Path) -> None:
    """The kernel's limit on CPU time, which needs nobody to look at a clock: of two seconds and one for 0.5 s asked."""
    end = ended(tmp_path, """
        import os, resource
        print(resource.getrlimit(resource.RLIMIT_CPU), resource.getrlimit(resource.RLIMIT_CORE))
    """, 0.5)  # fmt: skip
    assert end.last == ("(2, 2) (0, 0)",)


@pytest.mark.slow
def test_it_goes_where_we_go(tmp_path: Path) -> None:
    """We are killed, as a worker is that takes too long: nothing of ours is left to look at a clock."""
    (tmp_path / "program.py").write_text("import os, time\nopen('pid', 'w').write(str(os.getpid()))\ntime.sleep(60)")
    ours = f"""
        from pathlib import Path
        from softmark.interpreter.models.external.external_process import run
        run([{sys.executable!r}, "-I", "-S", "program.py"], Path({str(tmp_path)!r}), 60.0, 1e9)
    """
    worker = subprocess.Popen([sys.executable, "-c", textwrap.dedent(ours)])
    for _ in range(500):
        if (tmp_path / "pid").exists() and (tmp_path / "pid").read_text():
            break
        time.sleep(0.02)
    worker.kill()
    worker.wait()
    assert gone(int((tmp_path / "pid").read_text()))


@pytest.mark.slow
def test_a_file_has_a_largest_size(tmp_path: Path) -> None:
    end = ended(tmp_path, "with open('big', 'wb') as out:\n    out.truncate(2**33)")
    assert end.how == "died"
    assert "File too large" in end.message


def test_what_it_says_moves_no_cursor() -> None:
    said = "\x1b[2J\x1b[31mred\x1b[0m\rover\x07 \x1b]0;title\x07end\u202e\x9b1m\x00"
    assert strip_control_characters(said) == "red\nover end1m"
