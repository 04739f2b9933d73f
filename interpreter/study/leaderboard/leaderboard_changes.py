"""What has changed since another board: reading one, and what differs between two cells.

Errors are computed alike on every machine, so that a hundredth more or less is a change; times are noise below a half
more, and are compared on one kind of processor alone.
"""

from __future__ import annotations

import json

from softmark.interpreter.results import json_validation
from softmark.interpreter.study.leaderboard.leaderboard_cells import SCHEMA, Board, Cell
from softmark.safe_files import read_regular

SAME, TIMES = 0.01, 1.5  # relative change of an error; ratio of times
NUMBER = json_validation.NUMBER
TAKES = "`--against` takes the board.json of an earlier `dsl board`"
FORM = {
    "schema!": str, "title": str, "created": str, "command": str, "environment": {},
    "cases!": {"*!": {"question": str, "scene": str, "unit": str, "tolerance": NUMBER}},
    "models!": {"*!": {"entered": NUMBER, "met": NUMBER}},
    "cells!": [{"case!": str, "model!": str, "name": str, "status!": str, "error": NUMBER, "uncertainty": NUMBER,
                "unit": str, "time_s": NUMBER, "verdict": str}],
}  # fmt: skip


class Foreign(Exception):
    """A file that is no board; the text says why."""


def read(path: str) -> Board:
    """The board of a file. Raises Foreign."""
    try:
        found = json.loads(read_regular(path).decode("utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        why = (error.strerror if isinstance(error, OSError) else None) or "it is no JSON"
        raise Foreign(f"cannot read {path}: {why}; {TAKES}") from error
    if problem := json_validation.misfit(found, FORM):
        raise Foreign(f"{path} is no board: {problem}; {TAKES}")
    if found["schema"] != SCHEMA:
        raise Foreign(f"{path} is {found['schema'][:40]}, not {SCHEMA}")
    known = {"name": "", "title": "", "created": "", "command": "", "environment": {}}
    return Board.from_json({**known, **found})


def changed(old: Cell, new: Cell, timed: bool = True) -> str:
    """What differs between two cells of one model and case, in words; nothing where that is noise."""
    if old.status != new.status:
        return f"{words(old.status)} → {words(new.status)}"
    if old.verdict != new.verdict:
        return f"{words(old.verdict)} → {words(new.verdict)}"
    said = []
    if (old.error is None) != (new.error is None):
        said.append("error lost" if new.error is None else "error found")
    elif old.error is not None and new.error is not None:
        floor = max(old.uncertainty or 0.0, new.uncertainty or 0.0)  # below it nobody can tell two errors apart
        a, b = max(old.error, floor), max(new.error, floor)
        if abs(b - a) > SAME * max(a, b):
            said.append(f"error {_ratio(a, b)}")
    if timed and old.time_s and new.time_s and not 1 / TIMES <= new.time_s / old.time_s <= TIMES:
        said.append(f"time {_ratio(old.time_s, new.time_s)}")
    return ", ".join(said)


def _ratio(a: float, b: float) -> str:
    """`× 1.25`; from or to nothing as such."""
    return f"× {b / a:.3g}" if a > 0 else "from 0"


def words(word: str | None) -> str:
    """A status or a verdict as people say it."""
    return "not judged" if word is None else word.replace("_", " ")
