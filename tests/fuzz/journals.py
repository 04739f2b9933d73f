"""Journals and reports: whatever `dsl compare old.json new.json` and `--resume` read, it is used or refused in words.

    python tests/fuzz/journals.py -max_total_time=600     guided by coverage; needs atheris
    python tests/fuzz/journals.py FILE...                 each file once

An input that starts with `J` is a journal; another is two results with a NUL between them.
"""

from __future__ import annotations

import json
import os
import random
import sys
import tempfile
from contextlib import nullcontext
from pathlib import Path
from typing import Any

if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).parent))

import guard

GUIDED = __name__ == "__main__" and not any(os.path.isfile(a) for a in sys.argv[1:])
with guard.instrumented() if GUIDED else nullcontext():
    from softmark.interpreter.report.comparison.comparison_changes import changes_table
    from softmark.interpreter.results.result_authentication import code_of
    from softmark.interpreter.study.analysis import result_changes, timing_quality
    from softmark.interpreter.study.workers.task_journal import CODE, SCHEMA, Journal, JournalRefused, _serialize_entry

SPREAD = {"median": 1.0, "q1": 0.9, "q3": 1.2, "min": 0.8, "max": 2.0, "runs": 5}
MODEL = {
    "status": "converged",
    "metrics": {"eta": {"value": 0.1, "unit": "1", "against": "e"}},
    "time": {"cpu_s": SPREAD},
}
REPORT = {
    "schema": "softmark-report/1",
    "environment": {"numpy": "2"},
    "scene": {"sha256": "a", "parameters": {"L": {"text": "1 m"}}},
    "models": {"a": MODEL},
    "references": {"e": {"status": "converged", "metrics": {}}},
    "expectations": [{"text": "a.eta < 1", "passed": True}],
}
POINT = {
    "key": "k",
    "scene": "s",
    "model": "a",
    "label": "a",
    "study": None,
    "variation": {"h": "5 mm"},
    "numbers": {"h": 0.005},
    "status": "converged",
    "message": None,
    "outline": "x",
    "size": {"nodes": 4, "elements": 1, "dofs": 12},
    "errors": {"eta": {"value": 0.1, "unit": "1", "against": "e"}},
    "cost": {"cpu_s": SPREAD, "wall_s": SPREAD, "frame_s": 0.1},
}
COMPARISON = {
    "schema": "softmark-compare/1",
    "environment": {},
    "scenes": [{"file": "s", "sha256": "b", "title": "t"}],
    "points": [POINT],
    "references": {"s": {"e": {"kind": "x", "status": "converged"}}},
}
JOURNAL = [
    {"schema": "softmark-journal/1"},
    {"kind": "accuracy", "key": "k", "repeat": 0, "outcome": {"key": "k", "point": POINT, "references": {}}},
    {
        "kind": "timing",
        "key": "k",
        "repeat": 0,
        "record": {
            "key": "k",
            "kind": "timed",
            "status": "converged",
            "wall_s": [1.0],
            "cpu_s": [1.0],
            "pace_s": 1.0,
            "threads": {"asked": 1},
            "setup": {"mesh": [0.1, 0.1], "set-up": [0.1, 0.1]},
            "memory": {"peak": 5, "before": 1},
            "cores": [0],
            "during": {"wall_s": 1.0, "steal_s": 0.0, "waited_s": 0.0, "pressure_s": 0.0, "involuntary": 3},
            "phases": {"other": 1.0},
            "steps": {"wall_s": {"median": 1.0}, "cpu_s": {"median": 1.0}, "steps": 3},
        },
    },
]
ODD: tuple[Any, ...] = (
    None,
    [],
    {},
    "",
    "x",
    0,
    -1,
    1.5,
    True,
    1e308,
    [None],
    {"": {}},
    [[]],
    {"median": None},
    {"median": "x"},
    "9" * 5000,
)


def compare(data: bytes, folder: Path) -> str:
    """What has changed between two files, or why that cannot be said."""
    first, _, second = data.partition(b"\0")
    paths = [folder / "old.json", folder / "new.json"]
    for path, words in zip(paths, (first, second), strict=True):
        path.write_bytes(words)
    try:
        old, new = (result_changes.read_result(path) for path in paths)
        found = result_changes.find_changes(old, new, ("old.json", "new.json"))
    except result_changes.NotComparable as foreign:
        if not str(foreign):
            raise ValueError("a reason says something") from foreign
        return "refused"
    json.dumps(found.to_json(), indent=1, ensure_ascii=False)
    changes_table(found, False)
    return "compared"


def _signed(line: bytes) -> bytes:
    """The line as this user would have written it, so that its values are read."""
    try:
        entry = json.loads(line)
        return (
            _serialize_entry({**entry, CODE: code_of(SCHEMA, _serialize_entry(entry))})
            if "schema" not in entry
            else line
        )
    except (ValueError, RecursionError, TypeError):
        return line


def resume(data: bytes, folder: Path) -> str:
    """What a journal tells, and that it can be gone on with."""
    from softmark.interpreter.study.comparison_study import (
        ACCURACY,
        TIMING,
        ComparisonRequest,
        _compute_outcomes,
        _is_complete,
        _SavedTasks,
    )
    from softmark.interpreter.study.configurations.task_outcome import PointTask

    path = folder / "journal.jsonl"
    path.write_bytes(b"\n".join(map(_signed, data.split(b"\n"))))
    (folder / "journal.lock").unlink(missing_ok=True)
    try:
        with Journal.open(folder) as journal:
            outcomes = _compute_outcomes({}, ComparisonRequest(folder), _SavedTasks(journal, frozenset()))
            for key, entry in journal.of_kind(ACCURACY).items():
                if _is_complete(entry):  # what is not is computed anew, which takes too long here
                    _compute_outcomes(
                        {key: PointTask(key, "s", "a")},
                        ComparisonRequest(folder, resume=True),
                        _SavedTasks(journal, frozenset([key])),
                    )
            records = [e["record"] for (kind, _, _), e in journal.entries.items() if kind == TIMING and _is_complete(e)]
            timing_quality.summarize_cost(records)
            journal.append("accuracy", "new", outcome={})
            journal.on_disk(ACCURACY)
    except JournalRefused as refused:
        if not str(refused):
            raise ValueError("a reason says something") from refused
        return "journal refused"
    with Journal.open(folder) as journal:
        if ("accuracy", "new", 0) not in journal.entries:
            raise ValueError("what was appended is read again")
    return "journal" + str(min(len(outcomes), 1))


def target(folder: Path) -> Any:
    """The promises as a function of bytes."""

    def one(data: bytes) -> str:
        return resume(data[1:], folder) if data[:1] == b"J" else compare(data, folder)

    return one


def seeds() -> list[bytes]:
    """A report, a comparison, a journal, and some that are odd."""
    report, comparison = (json.dumps(x).encode() for x in (REPORT, COMPARISON))
    journal = b"J" + b"".join(json.dumps(line).encode() + b"\n" for line in JOURNAL)
    return [
        report + b"\0" + report,
        comparison + b"\0" + comparison,
        report + b"\0" + comparison,
        b"",
        b"\0",
        b"[]\0{}",
        journal,
        journal[:-9],
        b"J",
        b"J\n",
        b"J{}\n",
        b"[" * 100_000,
        b"J" + b"[" * 100_000 + b"\n",
    ]


def changed(data: bytes, chance: random.Random) -> bytes:
    """One or more values of the JSON replaced by odd ones; a key gone or renamed."""
    if data[:1] == b"J":
        parts, glue, lead = data[1:].split(b"\n"), b"\n", b"J"
    else:
        parts, glue, lead = data.split(b"\0", 1), b"\0", b""
    i = chance.randrange(len(parts))
    try:
        value = json.loads(parts[i])
    except (ValueError, RecursionError):
        return lead + glue.join(parts)[: chance.randint(0, len(data))]
    for _ in range(chance.choice([1, 1, 2, 3])):
        value = _replaced(value, chance)
    parts[i] = json.dumps(value).encode()
    return lead + glue.join(parts)


def _replaced(value: Any, chance: random.Random) -> Any:
    if isinstance(value, dict) and value and chance.random() < 0.9:
        key = chance.choice(list(value))
        if chance.random() < 0.08:
            return {k: v for k, v in value.items() if k != key}
        return {**value, key: _replaced(value[key], chance)}
    if isinstance(value, list) and value and chance.random() < 0.85:
        i = chance.randrange(len(value))
        return [
            *value[:i],
            _replaced(value[i], chance),
            *value[i + 1 :],
            *([value[i]] if chance.random() < 0.1 else []),
        ]
    return chance.choice(ODD)


def main() -> None:
    """Guided by coverage, or over files that are named."""
    folder = Path(tempfile.mkdtemp(prefix="softmark-fuzz-"))
    if not GUIDED:
        for name in sys.argv[1:]:
            print(name, target(folder)(Path(name).read_bytes()))
        return
    watch = guard.Watch("journals", guard.out("journals"))
    guard.guided(watch, target(folder), seeds(), lambda data, seed: changed(data, random.Random(seed)))


if __name__ == "__main__":
    main()
