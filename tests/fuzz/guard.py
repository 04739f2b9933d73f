"""What every target shares: an input is judged within limits, and what is wrong with it is kept.

A target is a function of one input that returns a word of what the input was (`accepted`, `refused`), and raises
where softmark breaks a promise. `Watch.judge` calls it with a time limit, keeps the smallest input of every kind of
failure (the type of the exception and the innermost lines of softmark), and counts. While an input is read, the hook of
`arm` lets nothing but what the input names be opened, and nothing be run, imported from elsewhere or sent.
"""

from __future__ import annotations

import json
import os
import re
import resource
import signal
import sys
import tempfile
import time
import traceback
import zlib
from collections import Counter
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from types import FrameType
from typing import Any

REPOSITORY = Path(__file__).resolve().parents[2]
FREE = ("/proc/self/statm", "/proc/meminfo", "/sys/fs/cgroup/")  # what says how much memory readers may take
LIMIT_S = 10.0  # CPU seconds that one input may take
BLOCKED_S = 60.0  # wall seconds, which pass where something waits for ever, and on a machine that is busy
LIMIT_MB = 2048
SLOW_S = 2.0  # CPU seconds from which on an input is kept to look at

OFFENCES = (
    "socket.",
    "subprocess.",
    "os.system",
    "os.exec",
    "os.fork",
    "os.posix_spawn",
    "os.spawn",
    "pty.",
    "ftplib.",
    "urllib.",
    "http.",
    "os.remove",
    "os.rename",
    "os.rmdir",
    "os.mkdir",
    "os.chmod",
    "shutil.",
)


class TooSlow(BaseException):
    """An input took longer than it may; no `except Exception` of a reader swallows it."""


class Trespass(BaseException):
    """Reading an input did what no reading may do."""


# ------------------------------------------------------------------ what reading may do


class Fence:
    """An audit hook: armed, it takes for an offence whatever goes beyond reading files that the input names."""

    def __init__(self, *roots: Path) -> None:
        code = (REPOSITORY, Path(sys.prefix), Path(sys.base_prefix), Path(os.__file__).parent)
        self.code = tuple(str(p.resolve()) for p in code)
        self.roots = tuple(str(p.resolve()) for p in roots)
        self.named: str | None = None  # the input; None: not armed
        self.offences: list[str] = []
        sys.addaudithook(self.hear)

    def hear(self, event: str, arguments: tuple[Any, ...]) -> None:
        """Note an offence, and raise it."""
        if self.named is None or not self._offends(event, arguments):
            return
        named, self.named = self.named, None  # nothing is heard while this is written down
        offence = f"{event} {str(arguments)[:200]}"
        self.offences.append(offence)
        self.named = named
        raise Trespass(offence)

    def _offends(self, event: str, arguments: tuple[Any, ...]) -> bool:
        if event == "open":
            return self._foreign(arguments[0], arguments[1])
        if event in ("exec", "compile"):  # classes and modules of the program itself come this way
            name = arguments[0].co_filename if event == "exec" else str(arguments[1])
            return not (str(name).startswith((*self.code, "<frozen", "<string>")) or name is None)
        return event.startswith(OFFENCES)

    def _foreign(self, path: Any, mode: Any) -> bool:
        """Whether a file is none of the program, none of the scene's folder, and not named in the input."""
        if isinstance(path, int):
            return False
        name = os.fsdecode(path)
        if any(letter in (mode or "r") for letter in "wax+") and not name.startswith(self.roots):
            return True
        whole = os.path.abspath(name)
        if whole.startswith(FREE):
            return False
        if whole.startswith((*self.roots, *self.code)):
            return False
        return os.path.basename(name) not in (self.named or "")


# ------------------------------------------------------------------ judging and keeping


def _alarm(number: int, frame: FrameType | None) -> None:
    raise TooSlow(f"more than {LIMIT_S:g} s of CPU" if number == signal.SIGPROF else f"more than {BLOCKED_S:g} s")


class Watch:
    """Counts inputs and keeps those that break a promise in `folder`."""

    def __init__(self, name: str, folder: Path, fence: Fence | None = None) -> None:
        self.name, self.folder, self.fence = name, folder, fence
        self.words: Counter[str] = Counter()
        self.kept: dict[str, int] = {}  # signature -> size of the smallest input
        self.slowest, self.slowest_wall, self.start, self.seen = 0.0, 0.0, time.monotonic(), set[int]()
        self.peak = _peak()
        folder.mkdir(parents=True, exist_ok=True)
        for number in (signal.SIGALRM, signal.SIGPROF):
            signal.signal(number, _alarm)

    def judge(self, target: Callable[[bytes], str], data: bytes) -> bool:
        """Whether the input was dealt with as promised; it is kept if not."""
        cpu, wall = time.process_time(), time.monotonic()
        fault: BaseException | None = None
        signal.setitimer(signal.ITIMER_REAL, BLOCKED_S)
        signal.setitimer(signal.ITIMER_PROF, LIMIT_S)
        try:
            if self.fence is not None:
                self.fence.named = data.decode("utf-8", errors="replace")
            word = target(data)
        except (Exception, TooSlow, Trespass, SystemExit) as error:
            word, fault = "failed", error
        finally:
            signal.setitimer(signal.ITIMER_REAL, 0)
            signal.setitimer(signal.ITIMER_PROF, 0)
            if self.fence is not None:
                self.fence.named = None
        self._count(word, data, time.process_time() - cpu, time.monotonic() - wall)
        if fault is not None:
            self._keep(signature(fault), data, "".join(traceback.format_exception(fault)))
        return fault is None

    def _count(self, word: str, data: bytes, cpu: float, wall: float) -> None:
        self.words[word] += 1
        self.seen.add(zlib.crc32(data))
        if cpu > self.slowest:
            self.slowest = cpu
            if cpu > SLOW_S:
                self._keep(f"slow-{int(cpu)}", data, f"{cpu:.2f} s of CPU, {wall:.2f} s")
        self.slowest_wall = max(self.slowest_wall, wall)
        if (peak := _peak()) > self.peak + 100:
            self._keep(f"memory-{int(peak)}", data, f"from {self.peak:.0f} MB to {peak:.0f} MB")
        self.peak = max(peak, self.peak)
        if sum(self.words.values()) % 500 == 0:
            self.report()

    def _keep(self, name: str, data: bytes, words: str) -> None:
        if len(data) >= self.kept.get(name, sys.maxsize):
            return
        self.kept[name] = len(data)
        (self.folder / f"{name}.input").write_bytes(data)
        (self.folder / f"{name}.txt").write_text(words, encoding="utf-8", errors="backslashreplace")

    def report(self) -> dict[str, Any]:
        """The figures so far, also in a file."""
        figures = {
            "target": self.name,
            "inputs": sum(self.words.values()),
            "unique": len(self.seen),
            "words": dict(self.words),
            "slowest_cpu_s": round(self.slowest, 3),
            "slowest_wall_s": round(self.slowest_wall, 3),
            "peak_rss_mb": round(self.peak),
            "wall_s": round(time.monotonic() - self.start),
            "kept": dict(self.kept),
        }
        (self.folder / "figures.json").write_text(json.dumps(figures, indent=1), encoding="utf-8")
        return figures


def signature(fault: BaseException) -> str:
    """One name for all failures of one kind: exception, and where in softmark it came from."""
    frames = [f for f in traceback.extract_tb(fault.__traceback__) if "/tests/fuzz/" not in f.filename]
    own = [f for f in frames if f.filename.startswith(str(REPOSITORY))][-2:]
    where = "-".join(f"{Path(f.filename).stem}.{f.name}.{f.lineno}" for f in own)
    text = f"{type(fault).__name__}-{where or re.sub('[0-9]+', '', str(fault))[:60]}"
    return "".join(c if c.isalnum() or c in "-._" else "_" for c in text)[:150]


def _peak() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def out(name: str) -> Path:
    """Where findings of a target go: SOFTMARK_FUZZ, or a folder for what is temporary."""
    return Path(os.environ.get("SOFTMARK_FUZZ", Path(tempfile.gettempdir()) / "softmark-fuzz")) / name


# ------------------------------------------------------------------ guided by coverage


def instrumented() -> Any:
    """A context in which the grammar and the interpreter are instrumented; kernels are not, whose code numba reads."""
    import atheris

    return atheris.instrument_imports(include=["softmark"], exclude=_others())


def _others() -> list[str]:
    found = ["softmark.solvers", "softmark.references", "softmark.scenes"]
    for part in ("solvers", "references"):
        for file in (REPOSITORY / part).rglob("*.py"):
            parts = file.relative_to(REPOSITORY).with_suffix("").parts
            found.append(".".join(("softmark", *parts)).removesuffix(".__init__"))
    return found


def guided(
    watch: Watch,
    target: Callable[[bytes], str],
    seeds: list[bytes],
    mutate: Callable[[bytes, int], bytes] | None = None,
) -> None:
    """Run libFuzzer over a target until its options (`-max_total_time=60`, `-runs=1000`) end it."""
    import atheris

    corpus = watch.folder / "corpus"
    corpus.mkdir(exist_ok=True)
    for seed in seeds:
        (corpus / f"seed-{zlib.crc32(seed):08x}").write_bytes(seed)
    for seed in seeds:  # what is imported on first use is imported here, before the fence is closed
        with suppress(Exception):
            target(seed)

    def one(data: bytes) -> None:
        watch.judge(target, data)

    def mixed(data: bytes, most: int, seed: int) -> bytes:
        if mutate is None or seed % 3 == 0:
            return bytes(atheris.Mutate(data, most))
        return mutate(data, seed)[:most]

    given = [a for a in sys.argv[1:] if not a.startswith("-")]
    options = [
        f"-rss_limit_mb={LIMIT_MB}",
        "-timeout=0",
        "-max_len=16384",
        f"-artifact_prefix={watch.folder}/",
    ]
    chosen = [a for a in sys.argv[1:] if a.startswith("-")]
    arguments = [sys.argv[0], *options, *chosen, *(given or [str(corpus)])]
    atheris.Setup(arguments, one, custom_mutator=mixed) if mutate else atheris.Setup(arguments, one)
    atheris.Fuzz()
