"""A sweep that is killed again and again and resumed: everything is computed once, and the result is the same.

Each round is a process of its own that is killed by SIGKILL at a moment drawn from a seeded generator: a few finished
tasks after it began, plus a part of a task. Twice the power fails too: the journal's last line is torn.
"""

from __future__ import annotations

import json
import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest
from daily_selection import WHOLE

SCENE = """
scene "Quick tasks"
param    n      = 4
material gel    = neo_hookean(young = 60 kPa, poisson = 0.3, density = 1000 kg/m^3)
body     beam   = solid(cylinder(length = 178 mm, radius = 19 mm), gel)
support  wall   = fixed(beam, where = x <= 0 mm)
load     weight = gravity(9.81 m/s^2)
model    rod    = beam6dof(segments = n)
reference theory = elastica(beam)
probe    axis   = line(beam, from = (0, 0, 0) mm, to = (178, 0, 0) mm, points = 5)
metric   eta    = relative_l2_error(axis, against = theory)
study    finer  = sweep(n, over = [{values}])
"""
TASKS = 50
KILLS = 20 if WHOLE else 8
RUN = """
import json, sys
from pathlib import Path
import softmark
found = softmark.compare(sys.argv[1], folder=sys.argv[2], resume=True, repeats=0, jobs=int(sys.argv[3]))
Path(sys.argv[2], "found.json").write_text(json.dumps(found.to_json()), encoding="utf-8")
"""


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp("kill") / "quick.scene"
    values = ", ".join(str(3 + i) for i in range(TASKS))
    file.write_text(SCENE.format(values=values), encoding="utf-8")
    return file


def started(scene: Path, folder: Path, jobs: int) -> subprocess.Popen[bytes]:
    """A comparison in a session of its own, by which its workers can be found."""
    command = [sys.executable, "-c", RUN, str(scene), str(folder), str(jobs)]
    return subprocess.Popen(command, start_new_session=True, stderr=subprocess.DEVNULL)


def lines(folder: Path) -> list[bytes]:
    """The whole lines of the journal."""
    file = folder / "journal.jsonl"
    data = file.read_bytes() if file.exists() else b""
    return data[: data.rfind(b"\n") + 1].splitlines()


def alive(session: int) -> list[int]:
    """Processes of a session that have not ended."""
    found = []
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                state, _, _, own = (entry / "stat").read_text(encoding="utf-8").rpartition(")")[2].split()[:4]
            except OSError:
                continue
            if int(own) == session and state not in "ZX":
                found.append(int(entry.name))
    return found


def killed(process: subprocess.Popen[bytes], folder: Path, count: int, delay: float) -> bool:
    """Kill a process `delay` s after `count` more tasks are saved in the journal; whether it was still running."""
    due = len(lines(folder)) + count
    while process.poll() is None and len(lines(folder)) < due:
        time.sleep(0.002)
    time.sleep(delay)
    running = process.poll() is None
    process.kill()
    process.wait()
    until = time.monotonic() + 10
    while alive(process.pid) and time.monotonic() < until:
        time.sleep(0.01)
    assert alive(process.pid) == [], "the workers die with the process that started them"
    return running


def result(folder: Path) -> dict[str, Any]:
    """What a comparison found, without when and where."""
    found = json.loads((folder / "found.json").read_text(encoding="utf-8"))
    return {name: found[name] for name in ("points", "references", "analysis", "scenes", "studies")}


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="workers are looked for in /proc")
def test_killed_again_and_again_and_resumed(scene: Path, tmp_path: Path) -> None:
    generator = random.Random(20)
    folder, undisturbed = tmp_path / "killed", tmp_path / "undisturbed"
    cut = 0
    for i in range(KILLS):
        before = lines(folder)
        process = started(scene, folder, 1 + (i < 3))
        # the header is a line too
        cut += killed(process, folder, generator.randrange(1, 4) + (i == 0), generator.uniform(0.0, 0.03))
        after = lines(folder)
        assert after[: len(before)] == before, "nothing that was finished is lost or written again"
        if i in (3, 6):
            with (folder / "journal.jsonl").open("ab") as journal:
                journal.write(after[-1][: generator.randrange(1, len(after[-1]))])
    assert cut == KILLS, "each was killed while it was at work"
    assert started(scene, folder, 1).wait() == 0
    entries = [json.loads(line) for line in lines(folder)][1:]
    assert len(entries) == len({e["key"] for e in entries}) == TASKS, "every task exactly once"
    assert started(scene, undisturbed, 1).wait() == 0
    assert result(folder) == result(undisturbed)
    assert [p["status"] for p in result(folder)["points"]] == ["converged"] * TASKS


@pytest.mark.long
@pytest.mark.slow
def test_an_interrupt_keeps_what_is_finished_and_says_how_to_go_on(scene: Path, tmp_path: Path) -> None:
    """As Ctrl-C does it: the signal goes to the workers too, which leave it to their parent."""
    folder = tmp_path / "out"
    arguments = ["compare", str(scene), "--repeats", "0", "--out", str(folder)]
    command = [sys.executable, "-m", "softmark.interpreter", *arguments]
    process = subprocess.Popen(command, start_new_session=True, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL)
    while process.poll() is None and len(lines(folder)) < 3:
        time.sleep(0.002)
    os.killpg(process.pid, signal.SIGINT)
    said = process.communicate()[1].decode()
    assert process.returncode == 130
    finished = len(lines(folder)) - 1
    assert f"interrupted; {finished} of {TASKS} tasks are saved in" in said
    assert "; continue with the same command and `--resume`" in said
    assert "Traceback" not in said
    if Path("/proc/self/stat").exists():
        deadline = time.monotonic() + 10.0  # a worker that was just being started ends when it finds its pipe closed
        while alive(process.pid) and time.monotonic() < deadline:
            time.sleep(0.01)
        assert alive(process.pid) == []
