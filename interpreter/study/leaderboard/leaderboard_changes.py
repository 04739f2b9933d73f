"""Changes of a leaderboard since an older one, cell by cell.

Errors are the same on every machine, so a difference of one per cent is a change. Times differing by a factor below 1.5
are noise. Times are compared only on the same kind of processor.
"""

from __future__ import annotations

import json

from softmark.interpreter.results import json_validation
from softmark.interpreter.study.leaderboard.leaderboard_cells import SCHEMA, Board, Cell
from softmark.safe_files import read_regular

SAME, TIMES = 0.01, 1.5  # relative change of an error; ratio of times
NUMBER = json_validation.NUMBER
TAKES = "`--against` needs the board.json of an earlier `dsl board`"
FORM = {
    "schema!": str, "title": str, "created": str, "command": str, "environment": {},
    "cases!": {"*!": {"question": str, "scene": str, "unit": str, "tolerance": NUMBER}},
    "models!": {"*!": {"entered": NUMBER, "met": NUMBER}},
    "cells!": [{"case!": str, "model!": str, "name": str, "status!": str, "error": NUMBER, "uncertainty": NUMBER,
                "unit": str, "time_s": NUMBER, "verdict": str}],
}  # fmt: skip


class NotALeaderboard(Exception):
    """Error: a file is not a leaderboard. The text gives the reason."""


def read_board(path: str) -> Board:
    """Read a leaderboard from a file. Raises NotALeaderboard."""
    try:
        found = json.loads(read_regular(path).decode("utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        why = (error.strerror if isinstance(error, OSError) else None) or "it is not JSON"
        raise NotALeaderboard(f"cannot read {path}: {why}; {TAKES}") from error
    if problem := json_validation.find_misfit(found, FORM):
        raise NotALeaderboard(f"{path} is not a leaderboard: {problem}; {TAKES}")
    if found["schema"] != SCHEMA:
        raise NotALeaderboard(f"{path} is {found['schema'][:40]}, not {SCHEMA}")
    known = {"name": "", "title": "", "created": "", "command": "", "environment": {}}
    return Board.from_json({**known, **found})


def describe_change(old: Cell, new: Cell, timed: bool = True) -> str:
    """Return the change between two cells of the same model and case in words; empty if it is only noise."""
    if old.status != new.status:
        return f"{describe_status(old.status)} → {describe_status(new.status)}"
    if old.verdict != new.verdict:
        return f"{describe_status(old.verdict)} → {describe_status(new.verdict)}"
    said = []
    if (old.error is None) != (new.error is None):
        said.append("error lost" if new.error is None else "error found")
    elif old.error is not None and new.error is not None:
        floor = max(old.uncertainty or 0.0, new.uncertainty or 0.0)  # below it two errors are indistinguishable
        a, b = max(old.error, floor), max(new.error, floor)
        if abs(b - a) > SAME * max(a, b):
            said.append(f"error {_ratio(a, b)}")
    if timed and old.time_s and new.time_s and not 1 / TIMES <= new.time_s / old.time_s <= TIMES:
        said.append(f"time {_ratio(old.time_s, new.time_s)}")
    return ", ".join(said)


def _ratio(a: float, b: float) -> str:
    """Format the ratio b / a, such as `× 1.25`, or `from 0` if a is zero."""
    return f"× {b / a:.3g}" if a > 0 else "from 0"


def describe_status(word: str | None) -> str:
    """Return a status or a verdict in words; None is `not judged`."""
    return "not judged" if word is None else word.replace("_", " ")
