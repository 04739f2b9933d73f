"""Parts of other materials: a line for each, with the volume that is asked for and what cells of each mesh have."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from softmark.interpreter.language import units
from softmark.interpreter.report.page.markup import prose, section, tag, text
from softmark.interpreter.report.run.findings import Findings

LEAD = "The volume of every part with a material of its own, and that of the cells that have it."
VOLUME: units.Dimension = units.power(units.LENGTH, 3)
SHOWN = 1e-4  # of a part: what may be of the wrong material without a number


def section_of(findings: Findings) -> str:
    """A table of all parts; empty where no model has any."""
    known = {n: m.solve.get("regions") or {} for n, m in findings.report.models.items()}
    names = dict.fromkeys(name for regions in known.values() for name in regions)
    rows = [_row(name, {n: own[name] for n, own in known.items() if name in own}) for name in names]
    if not rows:
        return ""
    head = tag("tr", *(tag("th", text(h), scope="col") for h in ("Region", "Volume", "Cells")))
    table = tag("table", tag("caption", text(LEAD)), tag("thead", head), tag("tbody", *rows))
    return section("regions", "Regions", tag("div", table, class_="scroll"))


def _row(name: str, own: Mapping[str, Mapping[str, Any]]) -> str:
    asked = units.show(float(f"{max(v['asked_m3'] for v in own.values()):.5g}"), VOLUME)
    cells = (tag("td", text(asked)), tag("td", prose(_taken(own))))
    return tag("tr", tag("th", tag("code", text(name)), scope="row"), *cells)


def _taken(own: Mapping[str, Mapping[str, Any]]) -> str:
    """`followed`, or the models whose cells miss some of it or have too much."""
    off = []
    for model, v in own.items():
        missed, beyond = v["missed_m3"] / v["asked_m3"], v["beyond_m3"] / v["asked_m3"]
        if missed + beyond > SHOWN:
            share = 100 * v["taken_m3"] / v["asked_m3"]
            off.append(f"{share:.4g} % in `{model}`: {100 * missed:.3g} % missed, {100 * beyond:.3g} % too much")
    rest = ["followed by the others" if off else "followed"] if len(off) < len(own) else []
    return "; ".join((*off, *rest))
