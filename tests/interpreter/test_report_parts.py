"""Parts of the HTML report: numbers and axes, names of curves, colours, and files on disk."""

from __future__ import annotations

import html
import re
from importlib.resources import files
from pathlib import Path

import pytest

from softmark.interpreter.language.number_formatting import Scale, format_quantity
from softmark.interpreter.report.charts.chart_axes import linear, logarithmic
from softmark.interpreter.report.charts.curve_labels import place_labels
from softmark.interpreter.report.files import report_files as disk
from softmark.interpreter.report.run.report_page import render
from softmark.interpreter.report.run.tables.scene_listing import colour_line
from softmark.interpreter.results.run_report import Report
from softmark.scenes import ROOT

# ------------------------------------------------------------------ numbers


@pytest.mark.parametrize(
    ("value", "unit", "said"),
    [
        (0.128449, "m", "128.449 mm"),
        (-0.128449, "m", "−128.449 mm"),
        (2.85e-15, "m", "0.00285 pm"),
        (2.85e-16, "m", "2.85·10⁻¹⁶ m"),
        (60e3, "Pa", "60 kPa"),
        (3.0, "furlong", "3 furlong"),
        (1.5e12, "1", "1.5·10¹²"),
    ],
)
def test_quantities(value: float, unit: str, said: str) -> None:
    assert format_quantity(value, unit).replace("\u00a0", " ") == said


def test_ticks_are_round() -> None:
    assert [label for _, label in linear(-0.004, 0.105, "x", "m").ticks] == [
        "0",
        "20",
        "40",
        "60",
        "80",
        "100",
    ]
    assert [label for _, label in linear(0.0, 1e-5, "x", "m", 4).ticks] == [
        "0.0",
        "2.5",
        "5.0",
        "7.5",
        "10.0",
    ]
    lengths = logarithmic(3e-7, 0.03, "error", "m")
    assert (lengths.low, lengths.high) == pytest.approx((2e-7, 0.05))
    assert [label.replace("\u00a0", " ") for _, label in lengths.ticks] == [
        "1 µm",
        "10 µm",
        "100 µm",
        "1 mm",
        "10 mm",
    ]
    assert [label for _, label in logarithmic(1e-3, 1.0, "r", "1").ticks] == ["10⁻³", "10⁻²", "10⁻¹", "1"]


def test_a_column_keeps_its_decimals_and_shows_what_is_smaller() -> None:
    column = Scale(1e-3, "mm")
    assert [column.text(v, 2) for v in (0.0128, 0.1, 6.61e-6, 0.0)] == ["12.80", "100.00", "0.00661", "0"]
    assert [column.fixed(v, 3) for v in (-0.0128, -1e-18)] == ["−12.800", "0.000"]


# ------------------------------------------------------------------ the scene's text


def pieces(line: str) -> list[tuple[str, str]]:
    """(class, text) of every coloured piece of a line."""
    return [
        (kind, html.unescape(text)) for kind, text in re.findall(r'<span class="(.)">(.*?)</span>', colour_line(line))
    ]


@pytest.mark.parametrize(
    ("line", "marked"),
    [
        ('model a = fem("<b>") # <i>', [("k", "model"), ("f", "fem"), ("s", '"<b>"'), ("c", "# <i>")]),
        (
            "param h = 6.5 mm in 1 .. 9 mm",
            [("k", "param"), ("q", "6.5 mm"), ("k", "in"), ("q", "1"), ("q", "9 mm")],
        ),
        ("param n = 4 in 1 .. 9", [("k", "param"), ("q", "4"), ("k", "in"), ("q", "1"), ("q", "9")]),
        ("load g = gravity(9.81 m/s^2)", [("k", "load"), ("f", "gravity"), ("q", "9.81 m/s^2")]),
        ("expect a2.eta < 5 %", [("k", "expect"), ("q", "5 %")]),
        ('scene "not closed', [("k", "scene"), ("s", '"not closed')]),
    ],
)
def test_colours_of_a_line(line: str, marked: list[tuple[str, str]]) -> None:
    assert pieces(line) == marked


def test_colouring_changes_no_character() -> None:
    scenes = [path.read_text(encoding="utf-8") for path in ROOT.rglob("*.scene")]
    lines = [line for scene in scenes for line in scene.splitlines()]
    assert len(lines) > 40
    for line in (*lines, "<b>&\"'`", "§ ½ 1e5e5 ..", '"\\" "#" #'):
        assert html.unescape(re.sub(r"<[^>]*>", "", colour_line(line))) == line


# ------------------------------------------------------------------ names of curves


def test_names_stand_apart_and_off_the_curves() -> None:
    # two curves with one end, one alone, and one that ends outside
    ends = [(100.0, 100.0), (100.0, 100.0), (100.0, 40.0), (900.0, 900.0)]
    paths = [((0.0, y + 20.0 * i), (x, y)) for i, (x, y) in enumerate(ends)]
    names = ["one", "two", "alone", "outside"]
    found = place_labels(paths, names, (0.0, 0.0, 300.0, 200.0))
    assert set(found) == {0, 1, 2}
    assert found[2].line is None
    assert found[0].line is not None
    boxes = [place.box(names[i]) for i, place in found.items()]
    for a in boxes:
        for b in boxes:
            assert a is b or a[2] <= b[0] or b[2] <= a[0] or a[3] <= b[1] or b[3] <= a[1]


# ------------------------------------------------------------------ colours


def themes() -> list[dict[str, str]]:
    """The colours of light and of dark paper."""
    style = files("softmark.interpreter.report.page").joinpath("report.css").read_text(encoding="utf-8")
    blocks = re.findall(r":root \{(.*?)\}", style, re.S)
    light, dark = (dict(re.findall(r"--([\w-]+): (#[0-9a-f]{3,6})", block)) for block in blocks)
    return [light, {**light, **dark}]


def luminance(colour: str) -> float:
    """Relative luminance by WCAG 2.2."""
    digits = colour[1:] if len(colour) == 7 else "".join(2 * c for c in colour[1:])
    parts = [int(digits[i : i + 2], 16) / 255 for i in (0, 2, 4)]
    r, g, b = (c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in parts)
    return 0.2126 * r + 0.7152 * g + 0.0722 * b


def contrast(a: str, b: str) -> float:
    """(L1 + 0.05) / (L2 + 0.05), WCAG 2.2."""
    high, low = sorted((luminance(a), luminance(b)), reverse=True)
    return (high + 0.05) / (low + 0.05)


@pytest.mark.parametrize("theme", [0, 1], ids=["light", "dark"])
def test_contrast(theme: int) -> None:
    # WCAG 2.2: 4.5 for text (1.4.3), 3 for curves and their markers (1.4.11)
    colours = themes()[theme]
    for text in ("ink", "soft", "link", "good", "bad", "warn"):
        for under in ("paper", "surface", "quiet-tint"):
            assert contrast(colours[text], colours[under]) >= 4.5, (text, under)
    for mood in ("good", "bad", "warn"):
        assert contrast(colours["ink"], colours[f"{mood}-tint"]) >= 4.5
        assert contrast(colours[mood], colours[f"{mood}-tint"]) >= 4.5
    for curve in ("c0", "c1", "c2", "c3", "c4", "c5", "c6", "c7", "c8", "reference", "rest"):
        assert contrast(colours[curve], colours["surface"]) >= 3.0, curve


# ------------------------------------------------------------------ on disk

REPORT = Report({"title": "Empty", "text": ""}, {}, {}, {}, (), ())


def test_files(tmp_path: Path) -> None:
    one = REPORT
    written = disk.write(one, tmp_path / "deep" / "folder")
    assert [p.name for p in written] == ["report.json", "report.html"]
    assert written[0].read_text(encoding="utf-8") == one.dumps()
    assert written[1].read_text(encoding="utf-8") == render(one)
    disk.write(one, tmp_path / "deep" / "folder")  # again, over the first
    assert sorted(p.name for p in written[0].parent.iterdir()) == ["report.html", "report.json"]


def test_an_interruption_leaves_the_old_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    disk.write(REPORT, tmp_path)
    before = (tmp_path / "report.json").read_bytes()

    def interrupted(*args: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("os.replace", interrupted)
    with pytest.raises(KeyboardInterrupt):
        disk.write(REPORT, tmp_path)
    assert (tmp_path / "report.json").read_bytes() == before
    assert sorted(p.name for p in tmp_path.iterdir()) == ["report.html", "report.json"]


def test_a_folder_that_cannot_be_made_is_an_oserror(tmp_path: Path) -> None:
    (tmp_path / "taken").write_text("a file")
    with pytest.raises(OSError, match="taken"):
        disk.write(REPORT, tmp_path / "taken")
