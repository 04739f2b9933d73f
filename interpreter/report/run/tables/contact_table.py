"""Contact table: a row for each contact and each model on the page, and a line in the terminal."""

from __future__ import annotations

from collections.abc import Iterator

from softmark.interpreter.language import units
from softmark.interpreter.language.number_formatting import round_significant
from softmark.interpreter.report.page.html_markup import prose, tag, text
from softmark.interpreter.report.run.report_summary import ReportSummary
from softmark.interpreter.report.run.tables.table_section import (
    format_force,
    newtons,
    row_head,
    table_section,
    transpose_by_name,
)
from softmark.interpreter.results.reaction_results import ContactResult
from softmark.interpreter.results.run_report import Report
from softmark.interpreter.results.state_results import SOLVED

LEAD = (
    "Contact force on the deformable body{}, contact area, largest contact pressure, and smallest gap over all "
    "contact points. Area and pressure refer to the deformed body."
)
ENDED = " at the end of the motion"
HEAD = ("Contact", "Model", "Force", "Area", "Largest pressure", "Gap", "Note")
NOTHING = "\N{EN DASH}"
ROUNDING = 1e-8  # relative to the largest component
DIGITS = 4  # digits of areas and of numbers in the terminal
MISSED = 0.005  # fraction of the selected area; smaller differences are not mentioned


def section_of(findings: ReportSummary) -> str:
    """Return an HTML table of all contacts; empty if no model has contacts."""
    models = findings.report.models
    known = transpose_by_name({n: m.contacts for n, m in models.items() if m.status in SOLVED})
    rows = [_row(contact, name, own) for contact, each in known.items() for name, own in each.items()]
    moving = any("momentum" in model.solve for model in models.values())
    return table_section("Contacts", LEAD.format(findings.last_state_phrase or (ENDED if moving else "")), HEAD, rows)


def _row(contact: str, model: str, own: ContactResult) -> str:
    touch = own.touch
    said = []
    if touch.left:
        said.append(f"mean gap in contact {units.format_value(round_significant(touch.left, 2), units.LENGTH)}")
    if own.overlap:
        depth = units.format_value(round_significant(own.overlap, 2), units.LENGTH)
        said.append(f"facets penetrate by up to {depth} between contact points")
    if own.taken is not None and abs(1.0 - own.taken) > MISSED:
        said.append(f"the facets are {100.0 * own.taken:.4g} % of the selected area")
    if own.beyond is not None:
        said.append(
            f"too few cells in contact: the force is {round_significant(own.beyond, 2):g} times area and largest "
            f"pressure"
        )
    cells = (
        newtons(own.reaction.force, ROUNDING) if touch.area else "none",
        _area(touch.area),
        units.format_value(round_significant(touch.pressure, DIGITS), units.PRESSURE),
        NOTHING if touch.gap is None else units.format_value(round_significant(touch.gap, DIGITS), units.LENGTH),
    )
    return tag("tr", *(row_head(contact), tag("td", tag("code", text(model)))), *(tag("td", text(c)) for c in cells),
               tag("td", prose("; ".join(said) or NOTHING)))  # fmt: skip


def _area(area: float) -> str:
    """Return an area as text with four digits."""
    return units.format_value(round_significant(area, DIGITS), units.AREA)


def lines(report: Report) -> Iterator[str]:
    """Yield a line of text for each contact: its force, area and largest pressure, or the remaining distance.

    For example: `touch presses with 14.1 mN on 8.82 mm^2, 2.75 kPa at most, in hexes`.
    """
    for contact, each in transpose_by_name(
        {n: m.contacts for n, m in report.models.items() if m.status == "converged"}
    ).items():
        for model, own in each.items():
            if not own.touch.pressure:
                gap = own.touch.gap
                left = (
                    "" if gap is None else f": gap {units.format_value(round_significant(gap, DIGITS), units.LENGTH)}"
                )
                yield f"{contact} is not in contact in {model}{left}"
                continue
            force = format_force(own.reaction.force, DIGITS, ROUNDING)
            if own.beyond is not None:
                yield f"{contact} presses with {force} in {model}, on too few cells for an area or a pressure"
                continue
            most = units.format_value(round_significant(own.touch.pressure, DIGITS), units.PRESSURE)
            yield f"{contact} presses with {force} on {_area(own.touch.area)}, largest pressure {most}, in {model}"
    yield from _rigid_body_travel_lines(report)


def _rigid_body_travel_lines(report: Report) -> Iterator[str]:
    """Yield lines such as `ball goes 1.39 mm along -z in hexes` for rigid bodies moved by loads in static analyses."""
    for name, model in report.models.items():
        for body, own in (model.solve.get("rigid") or {}).items():
            way = own.get("travel_m")
            if model.status != "converged" or way is None or not any(way):
                continue
            along = max(range(3), key=lambda i: abs(way[i]))
            far = units.format_value(round_significant(abs(way[along]), DIGITS), units.LENGTH)
            yield f"{body} moves {far} along {'-' if way[along] < 0.0 else '+'}{'xyz'[along]} in {name}"
