"""Results of the studies that a scene declares: HTML tables, and lines for the terminal."""

from __future__ import annotations

from softmark.interpreter.language.number_formatting import group_digits
from softmark.interpreter.report.comparison.comparison_tables import (
    DASH,
    amount,
    cell,
    heading,
    limit_cells,
    row,
    row_head,
    table,
)
from softmark.interpreter.report.comparison.comparison_view import SceneView
from softmark.interpreter.study.analysis.comparison_point import UNKNOWNS
from softmark.interpreter.study.analysis.study_results import (
    Answer,
    ConvergenceAnswer,
    FrontMember,
    LineConvergence,
    ParetoAnswer,
)


def studies(view: SceneView) -> str:
    """Return an HTML table for each study of the scene; empty if it has none."""
    return "".join(
        _pareto_table(a) if isinstance(a, ParetoAnswer) else _convergence_table(a) for a in view.analysis.answers
    )


def _convergence_table(answer: ConvergenceAnswer) -> str:
    words = ("Line", "Members", "Finest", "Order", "Limit", "± (GCI)", "Asymptotic")
    head = [heading(w, w not in ("Line", "Asymptotic")) for w in words]
    caption = (
        f"`{answer.study}`: convergence of `{answer.metric}` over `{answer.over}`. ‡: outside the asymptotic range, "
        f"unreliable."
    )
    return table(caption, head, [_convergence_row(entry) for entry in answer.lines])


def _convergence_row(entry: LineConvergence) -> str:
    members = cell(DASH if entry.members is None else str(entry.members))
    return row(row_head(entry.line), members, *limit_cells(entry.finest, entry.limit, entry.unit or "1"))


def _pareto_table(answer: ParetoAnswer) -> str:
    cost = f"`{answer.cost}`" if answer.cost else answer.cost_name.capitalize()
    head = [heading("On the Pareto front"), heading(cost, True), heading(f"`{answer.error}`", True)]
    rows = [
        row(row_head(c.label, "capped" if c.capped else ""), cell(_cost(answer, c)),
            cell(amount(c.error, answer.error_unit or "1", 3)))
        for c in answer.front
    ]  # fmt: skip
    over = f" over `{answer.over}`" if answer.over else ""
    empty = " No configurations counted." if not answer.counted else f" {answer.counted} configurations counted."
    return table(
        f"`{answer.study}`: configurations{over} that no other one beats in both error and cost.{empty}", head, rows
    )


def _cost(answer: ParetoAnswer, member: FrontMember) -> str:
    median = member.cost.median
    return group_digits(round(median)) if answer.cost_name == UNKNOWNS else amount(median, answer.cost_unit or "1", 3)


def study_lines(answer: Answer) -> list[str]:
    """Return the results of a study as lines of text for the terminal.

    A line looks like `settling: drop over refine: tet10: order 2.01, limit 12.3 mm ± 0.1 mm`.
    """
    if isinstance(answer, ParetoAnswer):
        names = ", ".join(f"{c.label} ({_cost(answer, c)})" for c in answer.front) or "no configuration"
        return [f"{answer.study}: on the Pareto front of {answer.error} and {answer.cost_name}: {names}"]
    return [
        f"{answer.study}: {answer.metric} of {entry.line}: {_convergence_sentence(entry)}" for entry in answer.lines
    ]


def _convergence_sentence(entry: LineConvergence) -> str:
    found, unit = entry.limit, entry.unit or "1"
    if found.order is None:
        return f"no order: {found.reason}"
    said = f"order {found.order:.2f}, limit {amount(found.value, unit)} ± {amount(found.gci, unit, 2)}"
    return said if found.asymptotic else f"{said}; outside the asymptotic range: {found.doubt}"
