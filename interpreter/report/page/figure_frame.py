"""Figure on an HTML page: chart, caption, legend that shows and hides curves, and data as table and CSV.

The legend works with style sheets only. `report.js` adds the coordinates of points, which it reads from the table.
"""

from __future__ import annotations

from collections.abc import Sequence

from softmark.interpreter.report.charts.line_chart import Chart, legend_sample_svg
from softmark.interpreter.report.page.html_markup import count, prose, tag, text, wrappable_name
from softmark.records import dataclass

SHOWN = 12  # curves of models that are drawn at first; the legend has the others


@dataclass(frozen=True)
class ColumnGroup:
    """Group of columns of a data table under one name.

    `symbols` are the column headers with units (`x / mm`). `cells` has the texts of each row, one for each symbol.
    """

    name: str
    symbols: tuple[str, ...]
    cells: Sequence[Sequence[str]]  # rows, symbols


def figure_block(
    chart: Chart,
    caption: str,
    columns: Sequence[ColumnGroup],
    save: str,
    legend: bool = True,
    open_: Sequence[str] | None = None,
) -> str:
    """Return the HTML of a figure.

    `caption` is markup, `save` the HTML link to the CSV file. `open_` names the curves that are shown initially, None
    for all.
    """
    drawing = tag("div", chart.svg(), class_="drawing")
    side = _legend(chart, open_) if legend else ""
    numbers = details("Data of this figure", data_table(f"Data: {chart.title}", columns), save)
    body = tag("div", drawing, side, class_="beside" if side else "alone")
    below = tag("figcaption", tag("p", caption), numbers)
    return tag("figure", body, below, class_="plate", id=chart.identity)


def _legend(chart: Chart, open_: Sequence[str] | None) -> str:
    rows = []
    for index, curve in enumerate(chart.curves):
        checked = open_ is None or curve.name in open_ or curve.look.role != "model"
        box = tag("input", type="checkbox", value=f"k{index}", checked=checked)
        rows.append(
            tag(
                "label",
                box,
                legend_sample_svg(curve.look),
                tag("span", wrappable_name(curve.name)),
                class_=curve.look.role,
            )
        )
    return tag("fieldset", tag("legend", "Curves"), *rows, class_="legend")


def legend_css_rules(curves: int) -> str:
    """Return the CSS rules by which the checkboxes of a legend hide their curves."""
    return "".join(f'.plate:has(input[value="k{i}"]:not(:checked)) .k{i}{{display:none}}' for i in range(curves))


def details(summary: str, *content: str) -> str:
    """Return HTML content that is hidden until the reader opens it."""
    return tag("details", tag("summary", text(summary)), *content)


def data_table(caption: str, columns: Sequence[ColumnGroup]) -> str:
    """Return an HTML table of numbers; the first column has row headers, and names span the columns of their group."""
    first, *rest = columns
    names = [tag("th", text(first.name), rowspan=2, scope="col", data_q=first.symbols[0])]
    names += [tag("th", text(c.name), colspan=len(c.symbols), scope="colgroup") for c in rest]
    symbols = [tag("th", text(s), scope="col") for c in rest for s in c.symbols]
    head = tag("thead", tag("tr", *names), tag("tr", *symbols))
    body = tag("tbody", *(_row(i, columns) for i in range(max((len(c.cells) for c in columns), default=0))))
    table = tag("table", tag("caption", tag("span", prose(caption))), head, body, class_="data")
    return tag("div", table, class_="scroll", tabindex=0, role="region", aria_label=caption.replace("`", ""))


def _row(index: int, columns: Sequence[ColumnGroup]) -> str:
    cells = [cell for c in columns for cell in (c.cells[index] if index < len(c.cells) else ("–",) * len(c.symbols))]
    return tag("tr", tag("th", text(cells[0]), scope="row"), *(tag("td", text(cell)) for cell in cells[1:]))


def hidden_models_note(total: int, shown: int, where: str = "legend") -> str:
    """Return a sentence for the caption if not all models are drawn initially."""
    return (
        f" {count(shown, 'model')} of {total} are shown at first: select others in the {where}."
        if shown < total
        else ""
    )
