"""What has changed since another board, as a table for a pull request.

Errors are computed alike on every machine, so that a hundredth more or less is a change; times are noise below a half
more, and are compared on one kind of processor alone.
"""

from __future__ import annotations

import json
from pathlib import Path

from softmark.interpreter.language.amounts import quantity
from softmark.interpreter.results import forms
from softmark.interpreter.study.board.cells import SCHEMA, Board, Cell

SAME, TIMES = 0.01, 1.5  # relative change of an error; ratio of times
NUMBER = forms.NUMBER
TAKES = "`--against` takes the board.json of an earlier `dsl board`"
FORM = {
    "schema!": str, "title": str, "created": str, "command": str, "environment": {},
    "cases!": {"*!": {"question": str, "scene": str, "unit": str, "tolerance": NUMBER}},
    "models!": {"*!": {"entered": NUMBER, "met": NUMBER}},
    "cells!": [{"case!": str, "model!": str, "name": str, "status!": str, "error": NUMBER, "uncertainty": NUMBER,
                "unit": str, "time_s": NUMBER, "verdict": str}],
}  # fmt: skip
Key = tuple[str, str, str]


class Foreign(Exception):
    """A file that is no board; the text says why."""


def read(path: str) -> Board:
    """The board of a file. Raises Foreign."""
    try:
        found = json.loads(Path(path).read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        why = (error.strerror if isinstance(error, OSError) else None) or "it is no JSON"
        raise Foreign(f"cannot read {path}: {why}; {TAKES}") from error
    if problem := forms.misfit(found, FORM):
        raise Foreign(f"{path} is no board: {problem}; {TAKES}")
    if found["schema"] != SCHEMA:
        raise Foreign(f"{path} is {found['schema'][:40]}, not {SCHEMA}")
    known = {"name": "", "title": "", "created": "", "command": "", "environment": {}}
    return Board.from_json({**known, **found})


def markdown(old: Board, new: Board) -> str:
    """The cells that differ, and how many do not."""
    before, after = _by_key(old), _by_key(new)
    timed = (old.environment or {}).get("cpu") == (new.environment or {}).get("cpu")
    rows = [
        row for key in dict.fromkeys((*after, *before)) if (row := _row(key, before.get(key), after.get(key), timed))
    ]
    same = len(set(before) & set(after)) - sum(row[-1] not in ("new", "gone") for row in rows)
    counts = f"{len(after)} cells, {same} as before"
    note = "" if timed else " Times are not compared: the processors differ."
    head = f"**Board: {_line(new.title)}.** {counts}, {len(rows)} changed.{note}\n"
    if not rows:
        return head
    table = ["| case | model | before | after | change |", "| --- | --- | --- | --- | --- |"]
    table += ["| " + " | ".join(_line(part) for part in row) + " |" for row in rows]
    return head + "\n" + "\n".join(table) + "\n"


def _by_key(board: Board) -> dict[Key, Cell]:
    return {(c.case, c.model, c.name): c for c in board.cells}


def _row(key: Key, old: Cell | None, new: Cell | None, timed: bool) -> tuple[str, str, str, str, str] | None:
    case, model, name = key
    who = f"{model} (`{name}`)" if name else model
    if old is None or new is None:
        return case, who, _said(old), _said(new), "new" if old is None else "gone"
    change = changed(old, new, timed)
    return (case, who, _said(old), _said(new), change) if change else None


def changed(old: Cell, new: Cell, timed: bool = True) -> str:
    """What differs between two cells of one model and case, in words; nothing where that is noise."""
    if old.status != new.status:
        return f"{_words(old.status)} → {_words(new.status)}"
    if old.verdict != new.verdict:
        return f"{_words(old.verdict)} → {_words(new.verdict)}"
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


def _words(word: str | None) -> str:
    return "not judged" if word is None else word.replace("_", " ")


def _said(cell: Cell | None) -> str:
    if cell is None:
        return "–"
    if cell.error is None:
        return _words(cell.status)
    time = "" if cell.time_s is None else f", {quantity(cell.time_s, 's', 3)}"
    return f"{quantity(cell.error, cell.unit, 3, percent=True)}{time}"


def _line(text: str) -> str:
    """Text that breaks no table."""
    return " ".join(text.replace("|", "\\|").split())
