"""Curves and tables from files: values, repeats and uncertainty by the standard library; each defect with its place."""

from __future__ import annotations

import math
import random
import statistics
from pathlib import Path
from typing import Any

import pytest

from softmark.interpreter.language import units
from softmark.interpreter.language.expression_evaluation import Quantity
from softmark.references.csv_tables import read_columns
from softmark.references.measured_curve import CurveFromFile
from softmark.references.measured_data import Unreadable

MM, N = Quantity(1e-3, units.LENGTH), Quantity(1.0, units.FORCE)


def curve(*files: Path, y: tuple[str, ...] = ("f",), **more: Any) -> CurveFromFile:
    given: dict[str, Any] = {"x_unit": MM, "y_unit": N, "uncertainty": Quantity(0.0, units.NONE), **more}
    return CurveFromFile(tuple(map(str, files)), "x", y, **given)


def written(folder: Path, text: str, name: str = "a.csv") -> Path:
    (file := folder / name).write_text(text, encoding="utf-8")
    return file


@pytest.mark.parametrize("separator", [",", ";", "\t"])
@pytest.mark.parametrize("title", ["", "pulled on Monday\n;;;\n", "x;y,z\nf\n"])
def test_columns_are_found_by_name_below_titles(tmp_path: Path, separator: str, title: str) -> None:
    rows = [["f", "other", "x"], ["1", "a", "0"], ["-2.5e-1", "b", ".5"], ["", "", ""], ["3.", "", "1"]]
    file = written(tmp_path, title + "\n".join(separator.join(row) for row in rows) + "\n")
    found = read_columns(file, ["x", "f"])
    assert found.numbers == {"x": (0.0, 0.5, 1.0), "f": (1.0, -0.25, 3.0)}
    first = title.count("\n") + 2
    assert found.lines == (first, first + 1, first + 3)  # the empty row keeps its line


def test_a_row_of_units_is_read_as_such_and_said(tmp_path: Path) -> None:
    found = read_columns(written(tmp_path, "t,f\n(s),(N)\n0,1\n1,2\n"), ["t", "f"])
    assert found.numbers["f"] == (1.0, 2.0)
    assert found.notes == ("line 2, `(s)`, `(N)`, is not a row of numbers and is read as units",)


@pytest.mark.parametrize("bracket", ["{}", "({})", "[{}]"])
def test_every_unit_of_the_language_may_stand_there(tmp_path: Path, bracket: str) -> None:
    plain = [name for name in units.UNITS if name != "1"]  # which is a number
    for unit in (
        *plain,
        *(units.si_unit(d) for d in units.NAMES if d != units.NONE),
        "1/s",
        "kN/m^2",
        "m s-2",
        "°",
        "µm",
    ):
        file = written(tmp_path, f"t,f\n{bracket.format('ms')},{bracket.format(unit)}\n0,1\n1,2\n")
        assert read_columns(file, ["t", "f"]).lines == (3, 4), unit


def test_units_of_other_columns_are_a_row_of_units(tmp_path: Path) -> None:
    assert read_columns(written(tmp_path, "t,share,f\ns,,N\n0,1,5\n1,2,6\n"), ["share"]).lines == (3, 4)


@pytest.mark.parametrize("plain", ["", "-", "[-]", "(1)", "\N{EN DASH}"])
def test_a_column_of_plain_numbers_has_no_unit_in_it(tmp_path: Path, plain: str) -> None:
    assert read_columns(written(tmp_path, f"t,share\ns,{plain}\n0,1\n1,2\n"), ["t", "share"]).lines == (3, 4)


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("x,f\n0,0\n1,n/a\n", "line 3, column `f`: `n/a` is not a number"),
        ("x,f\n0,0\n1,1_000\n", "line 3, column `f`: `1_000` is not a number"),
        ("x,f\n0,0\n1,nan\n", "line 3, column `f`: `nan` is not a number"),
        ("x,f\nNaN,NaN\n0,0\n1,1\n", "line 2, column `x`: `NaN` is not a number"),  # which is no row of units
        ("x,f\nempty,empty\n0,0\n1,1\n", "line 2, column `x`: `empty` is not a number"),
        ("x,f\nn.d.,N.D.\n0,0\n1,1\n", "line 2, column `x`: `n.d.` is not a number"),
        ("x,f\n-,-\n0,0\n1,1\n", "line 2, column `x`: `-` is not a number"),
        ("x,f\n#N/A,N/A\n0,0\n1,1\n", "line 2, column `x`: `#N/A` is not a number"),
        ("x,f\ns,NaN\n0,0\n1,1\n", "line 2, column `x`: `s` is not a number"),
        ("x,f,g\n,,-\n0,0,0\n1,1,1\n", "line 2, column `x`: the number is missing"),
        ("x,f\n0,0\n1,inf\n", "line 3, column `f`: `inf` is not a number"),
        ("x,f\n0,0\n1,1e999\n", "line 3, column `f`: `1e999` is too large"),
        ("x,f\n0,0\n1,\n", "line 3, column `f`: the number is missing"),
        ("x,f\n0,0\n1\n", "line 3, column `f`: the number is missing"),
        ("x,f\n0,0\n1,1,5\n", "line 3 has 3 fields, but its header has 2"),
        ("x;f\n0;0\n1;1,5\n", "line 3, column `f`: `1,5` is not a number"),
        ("x,f,f\n0,0,0\n1,1,1\n", "several columns are called `f`: number 2, 3"),
        ("x,g\n0,0\n1,1\n", "it has no column `f`"),
        ("x,f\n", "it has no rows of numbers below the header"),
        ("", "it has no column `x`"),
        ("x,f\n0,0\n", "a curve needs at least two rows"),
        ("x,f\n0,0\n1,1\n1,2\n2,2\n", "line 4, column `x`: it stays at 1"),
        ("x,f\n0,0\n2,1\n1.5,2\n3,3\n", "line 4, column `x`: it turns back from 2 to 1.5"),
    ],
)
def test_a_defect_is_told_with_its_place(tmp_path: Path, text: str, place: str) -> None:
    with pytest.raises(Unreadable) as told:
        curve(written(tmp_path, text)).load()
    assert told.value.reason == place
    assert told.value.remedy
    assert curve(written(tmp_path, text)).unfit() == (told.value.reason, told.value.remedy)


@pytest.mark.parametrize("content", [b"\xff\xfex\x00,\x00f\x00", b"x,f\n\x80\x81,1\n", b"x,f\n0,\x000\n"])
def test_what_is_no_text_is_refused(tmp_path: Path, content: bytes) -> None:
    (file := tmp_path / "a.csv").write_bytes(content)
    with pytest.raises(Unreadable, match=r"is not (UTF-8 text|a text file)"):
        curve(file).load()


def test_units_and_origins(tmp_path: Path) -> None:
    """Stress in MPa per 18 mm^2 is a force of 18 N a unit; strain times 33 mm a travel."""
    file = written(tmp_path, "x,f\n0.1,0\n0.2,0.5\n")
    long, force = Quantity(0.033, units.LENGTH), Quantity(18.0, units.FORCE)
    found = curve(file, x_unit=long, y_unit=force, x_origin=Quantity(-0.0033, units.LENGTH)).load()
    assert found.x == pytest.approx([0.0, 0.0033])
    assert found.y == pytest.approx([0.0, 9.0])


def test_a_falling_x_is_turned_round(tmp_path: Path) -> None:
    found = curve(written(tmp_path, "x,f\n2,5\n1,3\n0,0\n")).load()
    assert found.x.tolist() == pytest.approx([0.0, 1e-3, 2e-3])
    assert found.y.tolist() == [0.0, 3.0, 5.0]


def test_repeats_give_mean_and_standard_deviation(tmp_path: Path) -> None:
    """At any x the mean and the deviation (n - 1) of the standard library of straight lines between each one's rows.

    Between the rows of all of them the deviation is below the straight line that stands for it: it is a norm.
    """
    draw, files, tables = random.Random(5), [], []
    for i in range(3):
        x = sorted(draw.sample(range(1, 99), 8))
        rows = [(0, 0.0), *((v, v + draw.uniform(-1, 1)) for v in x), (100, 100.0 + i)]
        tables.append(rows)
        files.append(written(tmp_path, "x,f\n" + "\n".join(f"{a},{b!r}" for a, b in rows), f"{i}.csv"))
    found = curve(*files, uncertainty=Quantity(0.3, units.FORCE)).load()
    assert found.repeats == 3
    knots = sorted({a for rows in tables for a, _ in rows})
    assert (1e3 * found.x).tolist() == pytest.approx(knots)
    for k, x in enumerate(knots):
        values = [_at(rows, x) for rows in tables]
        assert found.y[k] == pytest.approx(statistics.mean(values), abs=1e-12)
        assert found.u[k] == pytest.approx(math.hypot(statistics.stdev(values), 0.3), rel=1e-9)
    for a, b, p, q in zip(knots[:-1], knots[1:], found.u[:-1], found.u[1:], strict=True):
        middle = statistics.stdev(_at(rows, 0.5 * (a + b)) for rows in tables)
        assert math.hypot(middle, 0.3) <= 0.5 * (p + q) + 1e-12


def _at(rows: list[tuple[int, float]], x: float) -> float:
    i = next(i for i in range(1, len(rows)) if x <= rows[i][0])
    (a, p), (b, q) = rows[i - 1], rows[i]
    return p + (q - p) * (x - a) / (b - a)


def test_columns_are_repeats_too_and_their_common_range_counts(tmp_path: Path) -> None:
    one = written(tmp_path, "x,f,g\n0,0,2\n4,4,6\n", "one.csv")
    two = written(tmp_path, "x,f,g\n1,1,3\n5,5,7\n", "two.csv")
    found = curve(one, two, y=("f", "g")).load()
    assert found.repeats == 4
    assert found.x[[0, -1]].tolist() == pytest.approx([1e-3, 4e-3])
    assert found.y.tolist() == pytest.approx([2.0, 5.0])
    assert found.u.tolist() == pytest.approx([statistics.stdev([1, 1, 3, 3])] * 2)
    apart = written(tmp_path, "x,f,g\n6,1,3\n7,5,7\n", "apart.csv")
    with pytest.raises(Unreadable, match="no common range of x"):
        curve(one, apart).load()


def test_uncertainties_add_in_quadrature(tmp_path: Path) -> None:
    file = written(tmp_path, "x,f,off\n0,10,0.3\n1,20,0.6\n")
    found = curve(file, uncertainty=Quantity(0.04, units.NONE), deviation="off").load()
    assert found.u.tolist() == pytest.approx([0.5, 1.0])  # 3-4-5: 0.3 with 4 % of 10, 0.6 with 4 % of 20
    with pytest.raises(Unreadable, match="line 3, column `off`: an uncertainty is negative"):
        curve(written(tmp_path, "x,f,off\n0,10,0.3\n1,20,-0.6\n"), deviation="off").load()


def test_of_a_curve_that_turns_one_branch_is_taken_and_the_rest_said(tmp_path: Path) -> None:
    """Triangles: 4 N at 2 mm on the way up, 1 N in the middle on the way down; the areas say what is lost."""
    file = written(tmp_path, "x,f\n0,0\n1,2\n2,4\n1.5,2\n1,1\n0,0\n")
    up, down = curve(file).load(), curve(file, branch="unloading").load()
    assert up.y.tolist() == [0.0, 2.0, 4.0]
    assert down.y.tolist() == [0.0, 1.0, 2.0, 4.0]
    assert up.notes == ("a.csv: 3 of 6 rows do not belong to the loading branch and are omitted",)
    unloading = 0.5 * 1.0 * 1.0 + 0.5 * 0.5 * (1.0 + 2.0) + 0.5 * 0.5 * (2.0 + 4.0)
    assert up.lost == pytest.approx(1.0 - unloading / 4.0)
    assert curve(written(tmp_path, "x,f\n0,0\n1,2\n2,4\n")).load().lost is None


def test_named_units_of_columns() -> None:
    assert units.unit_in_column_name("Load (kN)") == units.parse_unit("kN")
    assert units.unit_in_column_name("Time [ms] ") == units.parse_unit("ms")
    assert units.unit_in_column_name("Compression") is None
    assert units.unit_in_column_name("Strain [-]") is None
    assert units.unit_in_column_name("run (second)") is None


@pytest.mark.parametrize(
    ("rows", "why", "remedy"),
    [
        ('0,"0\n1,1\n2,2\n', "line 2, column `f`", "remove the row"),  # the row begins there, and never ends
        ('0,"0\n1"\n1,a\n', "line 2, column `f`", "remove the row"),
        ('0,0\n1,"1,000.5"\n', "line 3, column `f`: `1,000.5` is not a number", "thousands separator: `1000.5`"),
        ('0,0\n1,"0,5"\n', "line 3, column `f`: `0,5` is not a number", "use a decimal point: `0.5`"),
    ],
)
def test_a_defect_has_the_line_where_its_row_begins(tmp_path: Path, rows: str, why: str, remedy: str) -> None:
    with pytest.raises(Unreadable, match=why) as refused:
        curve(written(tmp_path, f"x,f\n{rows}")).load()
    assert remedy in refused.value.remedy
