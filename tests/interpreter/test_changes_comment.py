"""What changed between two results as a comment of a pull request: in which order, and whatever texts are in it."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest

from softmark.interpreter.cli.main import main
from softmark.interpreter.report.comparison.comparison_comment import comment
from softmark.interpreter.report.page.comment_markdown import LIMIT, MarkdownTable, code, document, strip_markup
from softmark.interpreter.study.analysis.comparison_point import Spread
from softmark.interpreter.study.analysis.result_changes import (
    Changes,
    FactChange,
    MetricChange,
    StatusChange,
    TimeChange,
)

HOSTILE = [
    "a|b",
    "a\\|b",
    "`",
    "``a`",
    "<script>",
    "@user #12",
    "**a** [b](c)",
    "a\nb\r\n|c|",
    "\x1b[2J\u202e",
    "&#124;",
    "",
]


def spread(median: float) -> Spread:
    return Spread(median=median, q1=median, q3=median, runs=5)


def changed(**what: Any) -> Changes:
    nothing: dict[str, Any] = {name: [] for name in ("environment", "scenes", "added", "removed", "status", "metrics")}
    own = nothing | {"times": [], "expectations": []} | what
    return Changes("softmark-changes/1", "softmark-report/1", ("old.json", "new.json"), **own, compared=3)


WORKED = changed(
    expectations=[FactChange("rod.eta > 0", "not met", "met"), FactChange("rod.eta < 1 %", "met", "not met")],
    status=[StatusChange("tets", "converged", "failed", "no `memory`")],
    added=["bricks"],
    metrics=[
        MetricChange("rod", "eta", "1", 0.01, 0.011, "changed", 0.1),
        MetricChange("rod", "tip", "m", 0.01, 0.02, "changed", 1.0),
        MetricChange("rod", "sag", "m", 0.01, 0.0101, "changed by less than the uncertainty", 0.01, 0.1),
        MetricChange("tets", "eta", "1", 0.01, None, "lost", reason="it has failed"),
    ],
    times=[
        TimeChange("rod", "solve_s", spread(1.0), spread(0.5), "quicker"),
        TimeChange("tets", "solve_s", spread(1.0), spread(1.5), "slower"),
        TimeChange("rod", "setup_s", spread(1.0), spread(1.5), "undecided", "timed once"),
    ],
    environment=[FactChange("numpy", "2.4", "2.5")],
)


def test_verdicts_come_first_then_numbers_beyond_noise_then_times() -> None:
    assert comment(WORKED).splitlines() == [
        "**`old.json` → `new.json`.** Changed: 4 verdicts, 3 numbers, 2 times.",
        "",
        "| verdict of | before | after |",
        "| --- | --- | --- |",
        "| `rod.eta < 1 %` | met | **not met** |",
        "| `tets` | converged | **failed**: `` no `memory` `` |",
        "| `rod.eta > 0` | not met | met |",
        "| `bricks` |  | added |",
        "",
        "| number | of | before | after | change |",
        "| --- | --- | --- | --- | --- |",
        "| `eta` | `tets` | 1 % | none | lost: `it has failed` |",
        "| `tip` | `rod` | 10 mm | 20 mm | +100 % |",
        "| `eta` | `rod` | 1 % | 1.1 % | +10 % |",
        "",
        "| time | of | before | after | change |",
        "| --- | --- | --- | --- | --- |",
        "| solve | `tets` | 1 s | 1.5 s | slower, × 1.5 |",
        "| solve | `rod` | 1 s | 500 ms | quicker, × 0.5 |",
        "",
        "1 more changes are below the uncertainty of their references; the noise of 1 times is unknown.",
        "",
        "Differences: numpy `2.4` → `2.5`.",
    ]


def test_nothing_is_one_sentence() -> None:
    assert comment(changed()).startswith("**`old.json` → `new.json`.** No changes")


@pytest.mark.parametrize("rows", [3, 3000])
def test_a_comment_has_room_at_github(rows: int) -> None:
    """What has none is counted, and what stands behind the tables is still there."""
    long = [FactChange(f"µ{i}" * 500, "met", "not met") for i in range(rows)]
    numbers = [MetricChange(f"m{i}", "e" * 900, "1", 1.0, 2.0, "changed", 1.0) for i in range(rows)]
    text = comment(changed(expectations=long, metrics=numbers, environment=WORKED.environment))
    assert len(text.encode()) <= LIMIT
    assert text.endswith("Differences: numpy `2.4` → `2.5`.\n")
    shown = sum(line.endswith("**not met** |") for line in text.splitlines())
    left = re.search(r"(\d+) more verdicts are not shown\.", text)
    assert shown + (int(left[1]) if left else 0) == rows
    assert bool(left) is (rows == 3000)


@pytest.mark.parametrize("text", HOSTILE)
def test_a_text_stays_in_its_cell(text: str) -> None:
    for told in (strip_markup(text), code(text)):
        assert "|" not in told
        assert "\n" not in told
        assert told.isprintable() or "\u200b" in told
        assert "<script" not in told or told.startswith("`")
        assert not re.search(r"@\w", told) or told.startswith("`")


@pytest.mark.slow
def test_a_reader_of_markdown_finds_each_text_as_it_was() -> None:
    markdown_it = pytest.importorskip("markdown_it")
    rows = [(strip_markup(text), code(text)) for text in HOSTILE]
    html = markdown_it.MarkdownIt().enable("table").render(document("head", [MarkdownTable("rows", ("a", "b"), rows)]))
    cells = re.findall(r"<td>(.*?)</td>", html, re.DOTALL)
    assert len(cells) == 2 * len(HOSTILE)
    assert not re.search(r"<(?!/?(code|p|table|thead|tbody|tr|td|th)\b)", html)


def test_the_command_writes_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    empty = {"schema": "softmark-compare/1", "points": [], "references": {}, "environment": {}}
    for name in ("old.json", "new.json"):
        Path(name).write_text(json.dumps(empty), encoding="utf-8")
    assert main(["compare", "old.json", "new.json", "--markdown", "comment.md"]) == 0
    assert Path("comment.md").read_text(encoding="utf-8").startswith("**`old.json` → `new.json`.** No changes")
    assert capsys.readouterr().out == ""
    assert main(["compare", "old.json", "new.json", "--markdown", "old.json"]) == 2
    assert "E394" in capsys.readouterr().err
    assert main(["compare", "old.json", "new.json", "--markdown", "no/where.md"]) == 3
    assert "--markdown" in capsys.readouterr().err
    assert main(["compare", "silicone-beam", "--markdown", "comment.md"]) == 2
    assert "two JSON files" in capsys.readouterr().err
