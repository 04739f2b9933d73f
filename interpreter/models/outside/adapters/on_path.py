"""Programs that are run by their names: whether they are on the PATH, what they call themselves, and what they leave."""

from __future__ import annotations

import re
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path

from softmark.interpreter.models.outside.problem import NoAnswer
from softmark.interpreter.models.outside.running import LOG, plain

UNSAID = "of a version that it does not say"
PATIENCE = 20.0  # s that it may take to say it
SAID, WIDE = 4, 160  # of what it has to say: how many lines are told, and of how many characters each


def version(program: str, ask: Sequence[str] = (), found_by: str = "") -> str | None:
    """What a program says when it is asked so, the first group of a pattern; None where it is not on the PATH."""
    if shutil.which(program) is None:
        return None
    if not ask:
        return UNSAID
    try:
        told = subprocess.run(
            [program, *ask], stdin=subprocess.DEVNULL, capture_output=True, text=True, errors="replace",
            timeout=PATIENCE, check=False,
        )  # fmt: skip
    except (OSError, subprocess.TimeoutExpired):
        return UNSAID
    found = re.search(found_by, told.stdout + told.stderr)
    return found[1] if found else UNSAID


def places(program: str) -> tuple[Path, ...]:
    """The file that is run; none where it is not on the PATH."""
    found = shutil.which(program)
    return () if found is None else (Path(found).resolve(),)


def log(folder: Path) -> str:
    """What it said while it ran, without control characters; empty where it said nothing."""
    try:
        return plain((folder / LOG).read_text(encoding="utf-8", errors="replace"))
    except OSError:
        return ""


def text(path: Path) -> str:
    """A file of its own. Raises NoAnswer where there is none."""
    try:
        return path.read_text(encoding="ascii", errors="replace")
    except OSError as error:
        raise NoAnswer(f"it left no {path.name} ({error.strerror})") from error


def lines(told: str, about: str) -> str:
    """The first SAID lines of a log that a pattern is found in, as one."""
    found = dict.fromkeys(" ".join(line.split())[:WIDE] for line in told.splitlines() if re.search(about, line))
    more = f"; and {len(found) - SAID} more" if len(found) > SAID else ""
    return "; ".join(list(found)[:SAID]) + more
