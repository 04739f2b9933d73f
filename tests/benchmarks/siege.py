"""What a hostile machine does to `dsl`: many runs at once, signals at any moment, a cache that is spoilt.

    python tests/benchmarks/siege.py crowd --count 1000 --at-once 16     # one kernel cache, cold at the start
    python tests/benchmarks/siege.py interrupts --count 100 --seed 1     # SIGINT and SIGTERM at seeded moments
    python tests/benchmarks/siege.py cache --count 40                    # cut off, garbled, emptied kernels

Each prints its counts, and ends with status 1 if one process did what none may: fail, differ, or show a traceback.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import re
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

DSL = (sys.executable, "-P", "-m", "softmark.interpreter")
SCENE = """
material gel    = neo_hookean(young = 60 kPa, poisson = 0.4, density = 1000 kg/m^3)
body     beam   = solid(box(size = (40, 10, 10) mm), gel)
support  wall   = fixed(beam, where = x <= 0 mm)
load     weight = gravity(9.81 m/s^2)
model    rod    = beam6dof(segments = 8)
model    tets   = fem(tet4, strain = finite, size = 10 mm)
probe    tip    = point(beam, at = (40, 5, 5) mm)
metric   sag    = displacement(tip, along = -z)
study    finer  = sweep(rod.segments, over = [4, 8])
"""
PATIENCE = 60  # s in which a command that was sent a signal must have ended
OWN = re.compile(r"softmark[/.]|/(interpreter|grammar|solvers|references)/")  # frames of ours in a traceback


@dataclass
class Bench:
    """A folder with the scene, and a cache of its own."""

    folder: Path
    settings: dict[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.folder.mkdir(parents=True, exist_ok=True)
        (self.folder / "small.scene").write_text(SCENE, encoding="utf-8")
        ones = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS"), "1")
        self.settings = {**os.environ, **ones, "XDG_CACHE_HOME": str(self.folder / "cache"), **self.settings}

    def start(self, *arguments: str) -> subprocess.Popen[bytes]:
        """A command in a session of its own, which hears interrupts even where a shell has us ignore them."""
        if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
            signal.signal(signal.SIGINT, signal.default_int_handler)
        return subprocess.Popen(
            [*DSL, *arguments], cwd=self.folder, env=self.settings, start_new_session=True,
            stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        )  # fmt: skip

    def run(self, *arguments: str) -> tuple[int, bytes, bytes]:
        """Exit status and what was written, of a command that may end by itself."""
        process = self.start(*arguments)
        out, err = process.communicate()
        return process.returncode, out, err


def answer(file: Path) -> Any:
    """What a report says of every model, without times."""
    report = json.loads(file.read_text(encoding="utf-8"))
    return {n: (m["status"], m["metrics"]) for n, m in report["models"].items()}


def crowd(bench: Bench, count: int, at_once: int) -> Counter[str]:
    """`count` runs of one scene, `at_once` of them at a time, sharing a kernel cache that is empty at the start."""
    counts: Counter[str] = Counter()
    running: dict[int, subprocess.Popen[bytes]] = {}
    answers: set[str] = set()
    for number in [*range(count), *[-1] * at_once]:
        while len(running) >= at_once or (number < 0 and running):
            for name, process in list(running.items()):
                if process.poll() is not None:
                    counts[_finished(bench, name, running.pop(name), answers)] += 1
            time.sleep(0.005)
        if number >= 0:
            running[number] = bench.start("run", "small.scene", "--json", f"{number}.json")
    counts["different answers"] = len(answers) - 1
    return counts


def _finished(bench: Bench, name: int, process: subprocess.Popen[bytes], answers: set[str]) -> str:
    _, err = process.communicate()
    file = bench.folder / f"{name}.json"
    if process.returncode != 0:
        return f"failed with {process.returncode}: {err.decode(errors='replace').strip().splitlines()[-1:]}"
    answers.add(json.dumps(answer(file), sort_keys=True))
    file.unlink()
    return "compiled and finished" if b"compiling" in err else "finished"


# ------------------------------------------------------------------ signals

COMMANDS: dict[str, tuple[str, ...]] = {
    "check": ("check", "small.scene"),
    "run": ("run", "small.scene", "--out", "report"),
    "compare": ("compare", "small.scene", "--out", "comparison", "--repeats", "0", "--fresh"),
    "timed": ("compare", "small.scene", "--out", "comparison", "--repeats", "1", "--fresh", "--model", "rod"),
}


def durations(bench: Bench, names: Sequence[str]) -> dict[str, float]:
    """How long each command takes, s, with kernels compiled."""
    found = {}
    for name in names:
        arguments = COMMANDS[name]
        bench.run(*arguments)
        start = time.monotonic()
        bench.run(*arguments)
        found[name] = time.monotonic() - start
    return found


def interrupts(bench: Bench, count: int, seed: int, names: Sequence[str] = tuple(COMMANDS)) -> Counter[str]:
    """Commands that are sent a signal at a moment between their start and their end."""
    counts: Counter[str] = Counter()
    spans, chance = durations(bench, names), random.Random(seed)
    for i in range(count):
        name = names[i % len(names)]
        kind = chance.choice((signal.SIGINT, signal.SIGTERM))
        counts[interrupted(bench, name, kind, chance.uniform(0.0, 1.02) * spans[name])] += 1
    return counts


def interrupted(bench: Bench, name: str, kind: signal.Signals, delay: float) -> str:
    """How a command ends that is sent a signal after `delay` seconds, as Ctrl-C does: to all its processes."""
    before = [bench.folder / place for place in ("report/report.json", "comparison/compare.json")]
    for file in before:
        file.unlink(missing_ok=True)
    process = bench.start(*COMMANDS[name])
    time.sleep(delay)
    with suppress(ProcessLookupError):
        os.killpg(process.pid, kind)
    try:
        out, err = process.communicate(timeout=PATIENCE)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGABRT)  # with PYTHONFAULTHANDLER=1 it says where it is
        out, err = process.communicate()
        return f"{name}: HANGS {kind.name} after {delay:.2f} s: {err.decode(errors='replace')}"
    said = (out + err).decode(errors="replace")
    if any(not _whole(file) for file in before):
        return f"{name}: HALF A FILE"
    if "Traceback" in said:
        return f"{name}: in Python's own start-up" if not OWN.search(said) else f"{name}: TRACEBACK {said}"
    status = process.returncode
    if status == 0:
        return f"{name}: finished before"
    return (
        f"{name}: {kind.name}, {'status' if status > 0 else 'signal'} {abs(status)}"
        if _fair(status, kind)
        else (f"{name}: STATUS {status} after {kind.name}: {said}")
    )


def _fair(status: int, kind: int) -> bool:
    return status in (128 + kind, -kind)


def _whole(file: Path) -> bool:
    """Whether a file is absent or JSON."""
    try:
        json.loads(file.read_text(encoding="utf-8"))
    except FileNotFoundError:
        return True
    except ValueError:
        return False
    return True


# ------------------------------------------------------------------ the cache


def cut(data: bytes, chance: random.Random) -> bytes:
    """Some first part of it."""
    return data[: chance.randrange(len(data))]


def garbled(data: bytes, chance: random.Random) -> bytes:
    """Some bytes changed."""
    found = bytearray(data)
    for _ in range(8):
        found[chance.randrange(len(found))] ^= 1 << chance.randrange(8)
    return bytes(found)


SPOILERS: dict[str, Callable[[bytes, random.Random], bytes]] = {
    "cut off": cut,
    "garbled": garbled,
    "emptied": lambda data, chance: b"",
    "noise": lambda data, chance: chance.randbytes(len(data)),
}


def kernels(bench: Bench) -> list[Path]:
    """The files of the cache."""
    return sorted(p for p in (bench.folder / "cache").rglob("*") if p.is_file())


def cache(bench: Bench, count: int, seed: int) -> Counter[str]:
    """Runs on a cache of which some files were spoilt: the answer must be that of a sound one."""
    counts: Counter[str] = Counter()
    chance = random.Random(seed)
    bench.run("run", "small.scene", "--json", "sound.json")
    sound = answer(bench.folder / "sound.json")
    for i in range(count):
        spoiler = list(SPOILERS)[i % len(SPOILERS)]
        for file in chance.sample(kernels(bench), 5):
            file.write_bytes(SPOILERS[spoiler](file.read_bytes(), chance))
        status, _, err = bench.run("run", "small.scene", "--json", "now.json")
        same = status == 0 and answer(bench.folder / "now.json") == sound
        counts[f"{spoiler}: {'same answer' if same else f'FAILED ({status}) {err.decode()}'}"] += 1
    return counts


# ------------------------------------------------------------------ the command


def bad(counts: Counter[str]) -> Iterator[str]:
    """Outcomes that none may have."""
    for name, count in counts.items():
        if count and re.search("HALF|TRACEBACK|STATUS|FAILED|HANGS|failed|different", name):
            yield name


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("what", choices=("crowd", "interrupts", "cache"))
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--at-once", type=int, default=16)
    parser.add_argument("--seed", type=int, default=1)
    parsed = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        bench, start = Bench(Path(folder)), time.monotonic()
        if parsed.what == "crowd":
            counts = crowd(bench, parsed.count, parsed.at_once)
        else:
            counts = {"interrupts": interrupts, "cache": cache}[parsed.what](bench, parsed.count, parsed.seed)
        print(f"{parsed.what}, {parsed.count} in {time.monotonic() - start:.0f} s")
        for name, number in sorted(counts.items()):
            print(f"  {number:6}  {name}")
    return 1 if list(bad(counts)) else 0


if __name__ == "__main__":
    sys.exit(main())
