"""Latest results of the expectations and metrics of a scene, from reports in nearby folders.

A report belongs to a scene by its file name. It is current if its digest fits the text, and if the used scenes and
named files have not been written since the run. Reports are searched where `dsl run` writes them: in NAME-report/ of
the scene's folder, of a folder above it, or of the working folder.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from datetime import datetime
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any

from softmark.grammar import tree
from softmark.interpreter.language.compiled_scene import Expectation, Location
from softmark.interpreter.language.number_formatting import format_quantity
from softmark.interpreter.language.scene_sources import find_quoted_paths
from softmark.interpreter.language_server.text_document import Document
from softmark.interpreter.report.run.tables.error_statement_table import stated_error
from softmark.interpreter.results.error_statements import StatedError
from softmark.interpreter.results.run_report import SCHEMA, MetricResult, ModelResult
from softmark.safe_files import read_regular
from softmark.scenes import ROOT

ABOVE = 6  # maximum number of parent folders searched, up to the editor's open folder
LARGEST = 50_000_000  # maximum bytes of a report
LISTED = 3  # maximum number of values beside a metric; the others are in the tooltip
MOST = 2000  # maximum number of files of a folder
LONG = 60  # maximum characters of a reason in a hint
DIGITS = 4
VERDICTS = {"met": "met", "not_met": "NOT MET", "cannot_tell": "not judged"}
Json = Mapping[str, Any]


@dataclass(frozen=True)
class MeasuredHint:
    """Hint at the end of a line with its tooltip, and whether it is from the current text."""

    text: str
    more: str
    current: bool


@dataclass(frozen=True)
class LastReport:
    """Report of a scene, as read from its file."""

    file: Path
    report: Json
    same: bool  # whether it fits the current text
    since: str = ""  # file read by the scene that has changed since

    @property
    def current(self) -> bool:
        """True if the report fits the current scene and all its files."""
        return self.same and not self.since

    def of(self, document: Document, node: tree.Declaration) -> MeasuredHint | None:
        """Return the hint for an expectation or a metric; None for other declarations, or without a result."""
        said = None
        if isinstance(node, tree.Expect):
            said = self._expectation(document, node)
        elif isinstance(node, tree.Declare) and node.kind == "metric":
            said = self._metric_hint(node.name)
        if said is None:
            return None
        text, more = said
        marks = [*([] if self.same else ["of an earlier text"]), *self._override_marks]
        if self.same and self.since:
            marks.insert(0, f"of an earlier {self.since}")
        return MeasuredHint(
            f"{', '.join(marks)}: {text}" if marks else text,
            "\n\n".join([*more, self._source_description]),
            self.current,
        )

    @property
    def _override_marks(self) -> list[str]:
        """Overrides with which the run was started."""
        over = self.report["scene"].get("overrides") or []
        return [f"with {', '.join(map(str, over))}"] if over else []

    @property
    def _source_description(self) -> str:
        """Description of the report's source as text."""
        when = str((self.report.get("environment") or {}).get("started") or "").replace("T", " ")
        what = f"What it reads, {self.since}," if self.same else "The scene"
        changed = "" if self.current else f"{what} has changed since: run it again for current results. "
        return f"{changed}Measured {when[:16] or 'before'}, {self.file.parent.name}/{self.file.name}."

    # ------------------------------------------------------------------ expectations

    def _expectation(self, document: Document, node: tree.Expect) -> tuple[str, list[str]] | None:
        """Return the verdict of an expectation with its number, and the reasons; None without a result."""
        text = Expectation(node.condition, Location(document.source, node.span)).text
        judged = [e for e in self.report["expectations"] if e["text"] == text]
        if not judged:
            return None
        line = node.span.line
        own = min(judged, key=lambda e: abs(int(e.get("line") or 0) - line))  # of duplicates, the first counts
        verdict, reason = VERDICTS.get(own["verdict"], own["verdict"]), own.get("reason") or ""
        value = self._measured_number(node, own)
        said = f"{verdict}: {value}" if value else f"{verdict}: {_shorten_reason(reason)}" if reason else verdict
        return said, [f"**{verdict}**" + (f": {value}" if value else ""), *([reason] if reason else [])]

    def _measured_number(self, node: tree.Expect, own: Json) -> str:
        """Return the first number of an expectation's comparison as text, with its stated error if it is a metric."""
        value, unit = own.get("value"), own.get("unit")
        if value is None:
            return ""
        if unit is None:  # the report lacks it
            return f"{value:.{DIGITS}g} in SI units"
        first = next((n.operands[0] for n, _ in tree.walk(node.condition) if isinstance(n, tree.Compare)), None)
        if isinstance(first, tree.Name) and len(first.parts) == 2:
            return _format_result(value, unit, self._models.get(first.parts[0]), first.parts[1])
        return _amount(value, unit)

    # ------------------------------------------------------------------ metrics

    def _metric_hint(self, name: str) -> tuple[str, list[str]] | None:
        """Return a metric's value for each model and reference, and the number of its expectations that are met."""
        rows = list(self._values(name))
        if not rows:
            return None
        more = f" and {len(rows) - LISTED} more" if len(rows) > LISTED else ""
        asked = re.compile(rf"\.{re.escape(name)}\b")
        judged = [e["verdict"] for e in self.report["expectations"] if asked.search(e["text"])]
        counts = [f"{judged.count(v)} {VERDICTS[v]}" for v in VERDICTS if v in judged]
        said = ", ".join(f"{owner} {_shorten_reason(value)}" for owner, value in rows[:LISTED]) + more
        table = ["| | |\n| --- | --- |\n" + "\n".join(f"| {owner} | {value} |" for owner, value in rows)]
        expected = f"expected: {', '.join(counts)}" if counts else ""
        return said + (f"; {expected}" if expected else ""), table + ([expected] if expected else [])

    def _values(self, name: str) -> Iterator[tuple[str, str]]:
        """Yield each model or reference with its value of a metric, or with the reason why it has none."""
        for owner, result in {**self.report["models"], **self.report["references"]}.items():
            found = (result.get("metrics") or {}).get(name)
            if found is None:
                continue
            value = found.get("value")
            if value is None:
                yield owner, f"no value: {found.get('reason') or result.get('message') or 'no reason was given'}"
            else:
                said = _format_result(value, found.get("unit") or "1", self._models.get(owner), name)
                yield owner, f"{said}{_remarks_on_metric(found)}"

    @cached_property
    def _models(self) -> dict[str, ModelResult]:
        """Results of the models, with their stated errors."""
        return {
            name: ModelResult(name, str(m.get("status")), None, "", stated={
                n: StatedError.from_json(s) for n, s in (m.get("stated") or {}).items()
            })
            for name, m in self.report["models"].items()
        }  # fmt: skip


def _format_result(value: float, unit: str, model: ModelResult | None, metric: str) -> str:
    """Format a value with the error that its model states: `3.32 mm ± 0.25`."""
    said = model.stated.get(metric) if model else None
    if said is None or said.value is None:
        return _amount(value, unit)
    return f"{_amount(value, unit)} {stated_error(said.value, MetricResult(value, unit))}"


def _remarks_on_metric(found: Json) -> str:
    """Return remarks on a metric's value: reached in time or not, within the uncertainty of the reference."""
    own = "" if "verdict" not in found else ", in time" if found["verdict"] else ", NOT in time"
    return own + ("" if found.get("meaningful", True) else ", within the uncertainty of the reference")


def _amount(value: float, unit: str) -> str:
    return format_quantity(value, unit, DIGITS, percent=True)


def _shorten_reason(reason: str) -> str:
    return reason if len(reason) <= LONG else f"{reason[: LONG - 1].rstrip()}…"


# ------------------------------------------------------------------ reports on disk


def find_last_report(document: Document) -> LastReport | None:
    """Return the latest report of the document's current text, else its latest report; None if there is no report."""
    if document.file is None:
        return None
    found = [(file, report) for file, _, report in _reports(document.file)]
    if not found:
        return None
    texts = (document.text, f"\ufeff{document.text}")  # editors strip the byte order mark
    digests = [hashlib.sha256(text.encode("utf-8", errors="surrogatepass")).hexdigest() for text in texts]
    same = [(file, report) for file, report in found if report["scene"].get("sha256") in digests]
    file, report = (same or found)[0]
    return LastReport(file, report, bool(same), _find_newer_file(document, file, report))


def _find_newer_file(document: Document, file: Path, report: Json) -> str:
    """Return the file that the scene reads and that changed after the run began; empty if there is none."""
    plugins = report["scene"].get("plugins") or ()
    if not plugins and any(d.severity == "error" for d in document.available_diagnostics):
        return "state of its files"  # the same text was run
    texts = [m for m in document.table.modules if m.file is None or not m.file.is_relative_to(ROOT)]
    used = [path for text in texts for path in find_quoted_paths(text.source.text, text.folder)]
    used += [file.parent.parent / str(plugin["file"]) for plugin in plugins]
    try:
        begun = datetime.fromisoformat(report["environment"]["started"]).timestamp()
    except (KeyError, TypeError, ValueError):
        begun = -1.0  # the report lacks the time: every file may be newer
    return next((path.name for path in used if _last_write_time(path) > begun), "")


def _last_write_time(path: Path) -> float:
    """Return the time when a file, or anything in a folder, was last written or renamed; 0 if it does not exist."""
    from itertools import islice

    try:
        own = path.stat()
        if path.is_dir():
            with os.scandir(path) as entries:
                inner = [e.stat() for e in islice(entries, MOST) if not e.is_dir()]
            return max((max(s.st_mtime, s.st_ctime) for s in inner), default=0.0)
        return max(own.st_mtime, own.st_ctime)
    except OSError:
        return 0.0


def _reports(scene: Path) -> Iterator[tuple[Path, int, Json]]:
    """Yield each report file of a scene with its time of writing, ns, and its content, the latest report first."""
    own = scene.resolve()
    folders = dict.fromkeys([own.parent, *list(own.parents)[1 : ABOVE + 1], Path.cwd()])
    found = []
    for folder in folders:
        file = folder / f"{own.stem}-report" / "report.json"
        try:
            known = file.stat()
        except OSError:
            continue
        report = _read(file, known.st_mtime_ns, known.st_size) if known.st_size <= LARGEST else None
        if report is not None and _is_report_of(own, folder, str(report["scene"].get("file"))):
            found.append((file, known.st_mtime_ns, report))
    yield from sorted(found, key=lambda one: -one[1])


def _is_report_of(scene: Path, folder: Path, file: str) -> bool:
    """Return whether a report belongs to the file `scene`, by the name `file` of the scene that the report contains.

    Both files must have the same name. A report does not belong to `scene` if `file`, relative to `folder`, is another
    existing scene.
    """
    if Path(file).name != scene.name:
        return False
    try:
        other = (folder / file).resolve()
        return other == scene or not other.is_file()
    except (OSError, ValueError):  # not a valid file name
        return False


@lru_cache(maxsize=8)
def _read(file: Path, written: int, size: int) -> Json | None:
    """Read a report; cached by time of writing and size. None if the file is not a report."""
    try:
        report = json.loads(read_regular(file, LARGEST))
        whole = report["schema"] == SCHEMA and isinstance(report["scene"], dict)
        return report if whole and all(isinstance(report[k], t) for k, t in PARTS.items()) else None
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return None


PARTS = {"models": dict, "references": dict, "expectations": list}
