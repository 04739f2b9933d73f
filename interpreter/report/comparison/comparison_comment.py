"""Pull-request comment on the changes between two results: verdicts first, then changed numbers, then times."""

from __future__ import annotations

from softmark.interpreter.report.comparison.comparison_changes import (
    NOTHING,
    WORSE,
    format_time_spread,
    format_value_with_unit,
    plain_fact,
)
from softmark.interpreter.report.page.comment_markdown import LIMIT, MarkdownTable, Row, code, document, strip_markup
from softmark.interpreter.study.analysis.result_changes import (
    Changes,
    FactChange,
    MetricChange,
    StatusChange,
    TimeChange,
)

SORT = {"lost": 0, "found": 1, "changed": 2, "added": 3, "removed": 4}  # verdicts of numbers that are more than noise


def comment(changes: Changes, limit: int = LIMIT) -> str:
    """Return the comment as Markdown of at most `limit` characters."""
    verdicts = _verdict_rows(changes)
    numbers = sorted((m for m in changes.metrics if m.verdict in SORT), key=_sort_key)
    times = sorted((t for t in changes.times if t.verdict != "undecided"), key=lambda t: -t.ratio)
    tables = [
        MarkdownTable("verdicts", ("verdict of", "before", "after"), verdicts),
        MarkdownTable("numbers", ("number", "of", "before", "after", "change"), [_metric_row(m) for m in numbers]),
        MarkdownTable("times", ("time", "of", "before", "after", "change"), [_time_row(t) for t in times]),
    ]
    counts = [f"{len(t.rows)} {t.noun[:-1] if len(t.rows) == 1 else t.noun}" for t in tables if t.rows]
    said = f"Changed: {', '.join(counts)}." if counts else NOTHING
    head = f"**{' → '.join(map(code, changes.files))}.** {said}"
    return document(
        head, tables, "\n\n".join(filter(None, (_unclear_changes_sentence(changes), _possible_causes(changes)))), limit
    )


def _verdict_rows(changes: Changes) -> list[Row]:
    """Return rows for changed outcomes of expectations and changed statuses of results, worse ones first."""
    rows = [(_is_worse(f), _fact_row(f)) for f in changes.expectations]
    rows += [(s.new in WORSE, _status_row(s)) for s in changes.status]
    rows += [(False, (code(name), "", "added")) for name in changes.added]
    rows += [(False, (code(name), "", "removed")) for name in changes.removed]
    return [row for worse in (True, False) for bad, row in rows if bad is worse]


def _is_worse(fact: FactChange) -> bool:
    return fact.new in ("not met", "not judged") or (fact.new is None and fact.old == "met")


def _fact_row(fact: FactChange) -> Row:
    new = strip_markup(plain_fact(fact.new))
    return code(fact.what), strip_markup(plain_fact(fact.old)), f"**{new}**" if _is_worse(fact) else new


def _status_row(change: StatusChange) -> Row:
    old, new = (strip_markup((s or "nothing").replace("_", " ")) for s in (change.old, change.new))
    if change.new in WORSE:
        new = f"**{new}**" + (f": {code(change.message)}" if change.message else "")
    return code(change.name), old, new


def _sort_key(change: MetricChange) -> tuple[int, float]:
    return SORT[change.verdict], -abs(change.relative or 0.0)


def _metric_row(change: MetricChange) -> Row:
    unit, verdict = change.unit or "1", change.verdict
    if change.relative is not None:
        verdict = f"{100 * change.relative:+.3g} %"
    said = f"{verdict}: {code(change.reason)}" if change.reason else verdict
    return (
        code(change.metric),
        code(change.name),
        *(strip_markup(format_value_with_unit(v, unit)) for v in (change.old, change.new)),
        said,
    )


def _time_row(change: TimeChange) -> Row:
    clock = change.clock.removesuffix("_s").replace("_", " ")
    said = f"{change.verdict}, × {change.ratio:.3g}"
    return clock, code(change.name), format_time_spread(change.old), format_time_spread(change.new), said


def _unclear_changes_sentence(changes: Changes) -> str:
    """Return a sentence that counts the changes without a clear meaning.

    These are changes below the uncertainty of their references, and changes of times whose noise is unknown.
    """
    below = sum(m.verdict not in SORT for m in changes.metrics)
    undecided = sum(t.verdict == "undecided" for t in changes.times)
    numbers = f"{below} more changes are below the uncertainty of their references" if below else ""
    times = f"the noise of {undecided} times is unknown" if undecided else ""
    said = "; ".join(filter(None, (numbers, times)))
    return f"{said[:1].upper()}{said[1:]}." if said else ""


def _possible_causes(changes: Changes) -> str:
    """Return the possible causes of changes as text: changed scenes, parameters, versions and machines."""
    facts = [*changes.scenes, *changes.environment]
    told = [f"{strip_markup(f.what)} {code(plain_fact(f.old))} → {code(plain_fact(f.new))}" for f in facts[:12]]
    more = [f"{len(facts) - 12} more"] if len(facts) > 12 else []
    return f"Differences: {'; '.join([*told, *more])}." if facts else ""
