"""What Python and notebooks are given: lines at a prompt, files, frames, plots, quantities, the magic, the examples."""

from __future__ import annotations

import json
import pickle
import re
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import softmark

ROOT = Path(__file__).parents[2]
NOTEBOOKS = sorted((ROOT / "interpreter" / "documentation" / "notebooks").glob("*.ipynb"))
BEAM = """
scene "A rod"
param L = 178 mm
param n = 8
material silicone = neo_hookean(young = 60 kPa, poisson = 0.49, density = 1070 kg/m^3)
body     beam     = solid(cylinder(length = L, radius = 19 mm, axis = +x), silicone)
support  wall     = fixed(beam, where = x <= 0 mm)
load     weight   = gravity(9.81 m/s^2, direction = -z)
model     rod    = beam6dof(segments = n)
reference theory = simo_reissner(beam)
probe  axis = line(beam, from = (0, 0, 0) mm, to = (L, 0 mm, 0 mm))
metric eta  = relative_l2_error(axis, against = theory)
metric drop = displacement(axis, along = -z)
expect rod.eta < 1e-9
expect rod.drop > 10 mm
"""


@pytest.fixture(scope="module")
def scene() -> Any:
    return softmark.loads(BEAM)


@pytest.fixture(scope="module")
def report(scene: Any) -> Any:
    return scene.run()


# ------------------------------------------------------------------ at a prompt


def test_a_line_says_what_a_scene_is_and_what_came_of_it(scene: Any, report: Any) -> None:
    assert repr(scene) == ("<Scene 'A rod': models rod; references theory; metrics eta, drop; 2 expectations>")
    assert repr(report) == (
        "<RunReport of 'A rod': model rod converged; reference theory converged; 1 of 2 expectations met>"
    )
    assert isinstance(report, softmark.Report)
    assert isinstance(report, softmark.RunReport)
    rod = report.models["rod"]
    assert repr(rod) == "<ModelResult 'rod' converged; probes axis; metrics eta, drop>"
    assert repr(rod.probes["axis"]) == "<ProbeResult: 41 points; points, displacement, position in m>"
    assert repr(rod.metrics["drop"]).startswith("<MetricResult: 0.13")
    assert repr(rod.metrics["drop"]).endswith(" m>")


def test_the_html_of_a_scene_has_its_parameters_and_its_text(scene: Any) -> None:
    found = scene._repr_html_()
    assert "178\u00a0mm" in found
    assert "neo_hookean" in found
    assert len(found) < 30_000
    hostile = softmark.loads(BEAM.replace("A rod", "</style><script>alert(1)</script>"))._repr_html_()
    assert "<script" not in hostile
    assert "alert(1)" in hostile


def test_errors_read_well_and_ipython_shows_no_traceback() -> None:
    with pytest.raises(softmark.SceneError) as refused:
        softmark.loads(BEAM, L="60 kPa")
    lines = str(refused.value).splitlines()
    assert lines[:3] == ["1 error; more: dsl explain E204", "", "error[E204]: expected a length, found a pressure"]
    (shown,) = refused.value._render_traceback_()
    assert "\x1b[1;31merror[E204]" in shown
    with pytest.raises(softmark.BadArgument) as bad:
        softmark.loads(3)  # type: ignore[arg-type]
    assert bad.value._render_traceback_() == [f"BadArgument: {bad.value}"]


def test_what_only_notebooks_need_is_imported_where_it_is_used() -> None:
    """At the head of a module only by the magic, which `%load_ext` loads."""
    heads = re.compile(r"^(?:import|from) (?:IPython|pandas|matplotlib|pint)\b", re.MULTILINE)
    files = sorted((ROOT / "interpreter").rglob("*.py"))
    found = [f.name for f in files if heads.search(f.read_text(encoding="utf-8"))]
    assert found == ["cell_magic.py"]


# ------------------------------------------------------------------ files


def test_write_makes_what_the_command_makes(report: Any, tmp_path: Path) -> None:
    written = report.write(tmp_path / "new" / "folder")
    assert [p.name for p in written] == ["report.json", "report.html"]
    assert json.loads(written[0].read_text(encoding="utf-8"))["schema"] == "softmark-report/1"
    assert written[1].read_text(encoding="utf-8").startswith("<!DOCTYPE html>")
    for place in ("", 3, None):
        with pytest.raises(softmark.BadArgument, match="`folder` must be a folder"):
            report.write(place)


def test_a_report_keeps_what_it_can_when_it_is_pickled(report: Any) -> None:
    assert type(pickle.loads(pickle.dumps(report))) is softmark.RunReport


# ------------------------------------------------------------------ quantities


class Centimetres:
    """A unit of pint, in the form that is asked for."""

    def __format__(self, form: str) -> str:
        return {"~C": "cm"}[form]


class Lookalike:
    """What a quantity of pint shows of itself, without pint."""

    magnitude, dimensionality, units = 12.0, {"[length]": 1}, Centimetres()

    def to(self, unit: str) -> Any:
        assert unit == "meter**1"
        return type("Coherent", (), {"magnitude": 0.12})


Lookalike.__module__ = "pint.registry"


def test_a_quantity_is_taken_in_its_own_unit() -> None:
    found = softmark.loads(BEAM, L=Lookalike(), n="6").scene.parameters["L"]
    assert (found.value.value, found.text) == (pytest.approx(0.12), "12.0 cm")


def test_what_only_looks_like_a_quantity_is_refused() -> None:
    stranger = type("Stranger", (), {"magnitude": 1.0, "dimensionality": {}, "units": ""})()
    with pytest.raises(softmark.BadArgument, match="`L` must be a parameter"):
        softmark.loads(BEAM, L=stranger)


@pytest.mark.slow
def test_quantities_of_pint() -> None:
    unit = pytest.importorskip("pint").UnitRegistry()
    known = softmark.loads(BEAM, L=7 * unit.inch, **{"silicone.young": 0.6 * unit.bar}).scene
    assert known.parameters["L"].value.value == pytest.approx(0.1778)
    assert known.declared["silicone"].thing.young == pytest.approx(60e3)
    ounce = softmark.loads(BEAM, **{"silicone.density": 1070 * unit.gram / unit.liter}).scene
    assert ounce.declared["silicone"].thing.density == pytest.approx(1070.0)  # in SI, for there is no litre here
    assert softmark.loads(BEAM, n=6 * unit.dimensionless).scene.parameters["n"].value.value == 6.0
    for wrong, said in ((3 * unit.kilopascal, "expected a length"), (3 * unit.ampere, "`L` must be a parameter"),
                        ([1, 2] * unit.mm, "`L` must be a parameter"),
                        (unit.Quantity(20, unit.degC), "expected a length")):  # fmt: skip
        with pytest.raises(softmark.SceneError, match=said):
            softmark.loads(BEAM, L=wrong)


# ------------------------------------------------------------------ frames and plots


@pytest.mark.parametrize(("call", "module", "extra"), [
    (lambda r: r.frame(), "pandas", "notebook"), (lambda r: r.plot(), "matplotlib", "plot"),
])  # fmt: skip
def test_what_is_missing_is_said_with_the_remedy(
    call: Callable[[Any], object], module: str, extra: str, report: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delitem(sys.modules, "matplotlib.pyplot", raising=False)
    monkeypatch.setitem(sys.modules, module, None)  # as if it were not there
    with pytest.raises(softmark.MissingExtra) as missing:
        call(report)
    assert str(missing.value).endswith(f'needs {module}, which is not installed: pip install "softmark[{extra}]"')


def test_what_cannot_be_drawn_says_so_and_what_can(report: Any) -> None:
    for arguments, why in [
        (("drop",), "`drop` cannot be drawn: it has one number for each model; {}"),
        (
            ("nix",),
            "`nix` cannot be drawn: the report has no probe or metric of this name; available: `axis` (line)",
        ),
        (
            ("axis", "history"),
            "`axis` cannot be drawn as `history`: it has data of another kind; available: `axis` (line)",
        ),
        ((None, "states"), "This report cannot be drawn as `states`: it has no data; available: `axis` (line)"),
    ]:
        with pytest.raises(softmark.BadArgument) as refused:
            report.plot(*arguments)
        assert str(refused.value) == why.format("available: `axis` (line)")
    with pytest.raises(softmark.BadArgument, match="`kind` must be one of `line`, `history`, `curve`"):
        report.plot("axis", "pie")


def test_rows_of_a_frame_are_numbers_with_what_they_are_worth(report: Any) -> None:
    from softmark.interpreter.api.pandas_tables import COLUMNS, rows

    eta, drop, known = list(rows(report))
    assert list(eta) == list(COLUMNS)
    assert (eta["model"], eta["metric"], eta["unit"], eta["reference"]) == ("rod", "eta", "1", "theory")
    assert (eta["verdict"], drop["verdict"], known["verdict"]) == ("not_met", "met", None)
    assert eta["value"] == report.models["rod"].metrics["eta"].value
    assert eta["seconds"] > 0
    assert (known["model"], known["metric"], known["kind"]) == ("theory", "drop", "theory")


@pytest.mark.slow
def test_a_frame_is_tidy(report: Any) -> None:
    pandas = pytest.importorskip("pandas")
    found = report.frame()
    assert isinstance(found, pandas.DataFrame)
    assert list(found.query("verdict == 'not_met'").metric) == ["eta"]
    assert found.pivot(index="model", columns="metric", values="value").loc["rod", "drop"] > 0.1
    assert found.state.isna().all()


@pytest.mark.slow
def test_plots_have_units_and_everybody(report: Any, report_of: Callable[[str], Any]) -> None:
    pyplot = pytest.importorskip("matplotlib.pyplot")
    pyplot.switch_backend("Agg")
    ax = report.plot("axis")
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("x / mm", "z / mm")
    assert [line.get_label() for line in ax.lines] == ["undeformed", "theory", "rod"]
    end = 1e3 * report.models["rod"].probes["axis"].position[-1]
    assert tuple(ax.lines[-1].get_xydata()[-1]) == pytest.approx((end[0], end[2]))
    assert report.plot("axis", ax=ax) is ax
    pyplot.close("all")


# ------------------------------------------------------------------ notebooks


@pytest.mark.slow
def test_the_magic_runs_a_cell_and_leaves_names(capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("IPython")
    from IPython.core.interactiveshell import InteractiveShell

    shell = InteractiveShell()
    shell.run_cell("%load_ext softmark")
    shell.run_cell(f'%%scene soft -p "L=120 mm" -p n=6 --model rod{BEAM}')
    assert shell.user_ns["report"] is shell.user_ns["soft"]
    assert shell.user_ns["scene"].title == "A rod"
    assert shell.user_ns["soft"].models["rod"].size["elements"] == 6
    assert shell.user_ns["soft"].scene["overrides"] == ["L=120 mm", "n=6"]
    assert "met         line" in capsys.readouterr().out  # the table: this shell is in a terminal
    wrong = shell.run_cell("%%scene bad" + BEAM.replace("60 kPa", "60 mm"))
    assert isinstance(wrong.error_in_exec, softmark.SceneError)
    said = capsys.readouterr().out
    assert "bad:4:41" in said
    assert "Traceback" not in said
    assert not {"report", "scene", "bad"} & set(shell.user_ns)
    for line, why in [("--modle x", "unrecognized arguments: --modle"), ("a-b", "`a-b` is not a valid Python name"),
                      ("'x", "No closing quotation")]:  # fmt: skip
        shell.run_cell(f"%%scene {line}\nscene 'x'")
        told = capsys.readouterr()
        assert f"UsageError: %%scene: {why}" in told.err
        assert "Traceback" not in told.out + told.err


def test_the_examples_are_stripped_and_small() -> None:
    assert [p.stem for p in NOTEBOOKS] == ["first-look", "what-accuracy-costs"]
    for path in NOTEBOOKS:
        cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
        assert not any(cell.get("outputs") or cell.get("execution_count") for cell in cells)
        assert path.stat().st_size < 20_000


@pytest.mark.long
@pytest.mark.slow
def test_the_examples_run() -> None:
    """One after the other in one kernel, which forgets all names between them."""
    nbformat, nbclient = pytest.importorskip("nbformat"), pytest.importorskip("nbclient")
    for module in ("ipykernel", "pandas", "matplotlib"):
        pytest.importorskip(module)
    book = nbformat.v4.new_notebook()
    for path in NOTEBOOKS:
        book.cells += [*nbformat.read(path, as_version=4).cells, nbformat.v4.new_code_cell("%reset -f")]
    nbclient.NotebookClient(book, timeout=120, kernel_name="python3").execute()  # an error that is not meant raises
    shown = [o for cell in book.cells for o in cell.get("outputs", ())]
    assert sum('class="softmark"' in o.get("data", {}).get("text/html", "") for o in shown) == 4
    said = [o.data["text/plain"] for o in shown if o.output_type == "display_data" and len(o.data) == 1]
    assert not any(said)  # the line of what was being done is gone
    assert not any(o.get("name") == "stderr" for o in shown)
