"""Terminal lines that state which models agree with a given value, or lie in the band of results of several codes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from softmark.interpreter.language.number_formatting import format_quantity
from softmark.interpreter.report.run.report_summary import ReportSummary, kind_of_reference

SEVERAL = 6  # largest number of names listed in a line


def lines(findings: ReportSummary) -> Iterator[str]:
    """Yield a line for each given value or band of values, with the models whose results lie inside and outside.

    For example: `codes (consensus of 3 codes): 14.72 mm in 14.7 mm to 14.74 mm; inside: fine; outside: coarse
    (miss)`.
    """
    for name, reference in findings.report.references.items():
        if reference.status != "converged" or not ("value" in reference.facts or reference.drawn is not None):
            continue
        held = [*_agreement_phrases(findings, name)]
        band = _format_band(reference.facts)
        line = f"{name} ({kind_of_reference(reference)}){': ' if band or held else ''}{'; '.join([*band, *held])}"
        yield line.replace("\N{NO-BREAK SPACE}", " ")


def _format_band(facts: Mapping[str, Any]) -> list[str]:
    """Return the value with its uncertainty, or the ends of its band, as text; empty for a curve."""
    if "value" not in facts:
        return []
    unit = facts["unit"]
    value = format_quantity(facts["value"], unit, 5)
    if "low" in facts:
        return [f"{value} in {format_quantity(facts['low'], unit, 5)} to {format_quantity(facts['high'], unit, 5)}"]
    return [
        f"{value} ± {format_quantity(facts['uncertainty'], unit, 3)}" if facts["uncertainty"] else f"{value}, exactly"
    ]


def _agreement_phrases(findings: ReportSummary, name: str) -> Iterator[str]:
    """Yield phrases such as `inside: fine; outside: coarse (miss)` for the metrics compared with the reference `name`.

    For a curve, the phrase gives the fraction of the curve that is inside.
    """
    banded = findings.report.references[name].kind == "consensus"
    words = {True: "inside" if banded else "within", False: "outside" if banded else "not within"}
    same: dict[str, list[str]] = {}
    for metric in findings.metrics:
        named = findings.declared.get(metric.name)
        if named is None or named.against != name:
            continue
        found = {n: m.details for n, r in findings.all_results.items() if (m := r.metrics.get(metric.name)) is not None}
        shares = [f"{n} by {100.0 * float(d['inside_share']):.3g} %" for n, d in found.items() if "inside_share" in d]
        sides = {truth: [n for n, d in found.items() if d.get("within") is truth] for truth in words}
        said = [f"{words[truth]}: {_join_first_names(names)}" for truth, names in sides.items() if names]
        said += [f"{words[True]}: {_join_first_names(shares)}"] if shares else []
        if said:
            same.setdefault("; ".join(said), []).append(metric.name)
    yield from (f"{said} ({', '.join(metrics)})" for said, metrics in same.items())


def _join_first_names(names: list[str]) -> str:
    return ", ".join(names[:SEVERAL]) + (f" and {len(names) - SEVERAL} others" if len(names) > SEVERAL else "")
