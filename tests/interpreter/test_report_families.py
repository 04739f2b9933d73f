"""Families of models, refinement, several bodies, gravity and the table in the terminal."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scene_names import names_in

import softmark
from softmark.interpreter.language.number_formatting import format_reference_error, is_negligible
from softmark.interpreter.problem.body_case import case_for
from softmark.interpreter.report.run.model_families import families_by_poisson, families_by_size
from softmark.interpreter.report.run.report_bodies import bodies
from softmark.interpreter.report.run.report_page import render
from softmark.interpreter.report.run.report_summary import ReportSummary
from softmark.interpreter.report.run.report_terminal import WIDE, table
from softmark.interpreter.report.run.tables.line_probes import curve_styles, initially_shown
from softmark.interpreter.report.view3d.still_picture import axes_of, frame_of
from softmark.interpreter.report.view3d.view_camera import letters, upward, view_of
from softmark.interpreter.results.run_report import (
    DrawnSurface,
    MetricResult,
    ModelKind,
    ModelResult,
    ProbeResult,
    ReferenceResult,
    Report,
    Timing,
)

SCENE = """softmark 1
scene "Families"
material rubber = linear_elastic(young = 60 kPa, poisson = 0.49, density = 1000 kg/m^3)
body beam = solid(bar, rubber)
load weight = gravity(9.81 m/s^2, direction = -y)
probe axis = line(beam, from = (0, 0, 0) m, to = (0.1 m, 0 m, 0 m))
metric eta = relative_l2_error(axis, against = theory)
metric gap = mean_error(axis, against = scan)
"""
LINE = ProbeResult(np.linspace([0, 0, 0], [0.1, 0, 0], 5), np.linspace([0, 0, 0], [0, -0.02, 0], 5))


SIZE = re.compile(r"^(?P<element>\w+) of about (?P<size>[\d.eE+-]+ \S+?)(?=,|$)")
SEGMENTS = re.compile(r"^(?P<size>\d+) (?P<element>beam segments)(?=,|$)")
POISSON = re.compile(r",? *\bnu = (?P<nu>[\d.eE+-]+)")


def read(outline: str) -> ModelKind | None:
    """The kind that an outline tells of, as a person reads it."""
    found, rest = POISSON.search(outline), POISSON.sub("", outline)
    sized = SIZE.match(rest) or SEGMENTS.match(rest)
    if sized is None:
        return None
    return ModelKind(sized["element"] + rest[sized.end() :], sized["size"], float(found["nu"]) if found else None)


def model(name: str, outline: str, dofs: int, eta: float | None, gap: float | None) -> ModelResult:
    metrics = {
        "eta": MetricResult(eta, "1", None if eta is not None else "the reference `theory` has no solution"),
        "gap": MetricResult(gap, "m", None if gap is not None else "the reference `theory` has no solution"),
    }
    time = {"solve_s": Timing((0.2,)), "setup_s": Timing((0.1,))}
    return ModelResult(
        name, "converged", None, outline, {"dofs": dofs}, {"iterations": 3}, time, {"axis": LINE}, metrics,
        kind=read(outline),
    )  # fmt: skip


def report(*models: ModelResult, text: str = SCENE, **changes: Any) -> Report:
    references = {
        n: ReferenceResult(n, "converged", None, kind, "us", 1e-15, {"axis": LINE}, {})
        for n, kind in (("theory", "closed form"), ("scan", "measurement"))
    }
    own = Report(
        {"title": "Families", "file": "f.scene", "text": text},
        {},
        {m.name: m for m in models},
        references,
        (),
        (),
        names=names_in(text),
    )
    return replace(own, **changes)


def words(page: str) -> str:
    """The page without its tags, with plain spaces."""
    return re.sub(r"\s+", " ", re.sub(r"<[^>]*>", "", page))


# ------------------------------------------------------------------ outlines

TET, HEX = "tet4 of about {} mm, corotational strain", "hex8 of about {} mm, corotational strain"


OTHER = "neo_hookean(young = 1 MPa, poisson = 0.3, density = 1 g/cm^3)"


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("fem(tet4, strain = corotational, size = 7 mm)", ("tet4, corotational strain", "7 mm", None)),
        (
            f"fem(tet4, strain = corotational, size = 10.5 mm, material = {OTHER})",
            ("tet4, corotational strain", "10.5 mm", 0.3),
        ),
        (
            f"fem(hex8, strain = finite, size = 9 mm, integration = selective, linear = superlu, material = {OTHER})",
            ("hex8, finite strain, selectively integrated, superlu", "9 mm", 0.3),
        ),
        ("beam6dof(segments = 40)", ("beam segments, no mesh", "40", None)),
        ("beam6dof(segments = 4, shear = no)", ("beam segments, no mesh, without shear", "4", None)),
        (
            "mass_spring(stiffness = from_material(), size = 9 mm)",
            ("tet4, springs: stiffness from the material", "9 mm", None),
        ),
        ("modal(of = sel)", None),
    ],
)
def test_models_say_of_what_kind_they_are(words: str, said: tuple[str, str, float | None] | None) -> None:
    """As their outlines have it, without size and Poisson's ratio."""
    text = SCENE[: SCENE.index("probe axis")].replace("linear_elastic(", "neo_hookean(")
    text = text.replace("solid(bar,", "solid(cylinder(radius = 1 cm, length = 1 m),")
    scene = softmark.loads(f"{text}model sel = fem(hex8, strain = finite, size = 9 mm)\nmodel m = {words}\n"
                           "support wall = fixed(beam, where = x <= 0 mm)\n"
                           "probe axis = point(beam, at = (0, 0, 0) m)\n").scene  # fmt: skip
    case = case_for(scene, scene.declared["m"])
    kind = scene.declared["m"].thing.kind(case)
    assert kind == (None if said is None else ModelKind(*said))
    assert kind == read(scene.declared["m"].thing.outline(case))


# eta falls and gap rises with refinement, as in silicone-beam-refined
REFINED = report(
    model("t9", TET.format(9), 2460, 0.146, 0.73e-3),
    model("t5", TET.format(5), 10476, 0.072, 3.48e-3),
    model("t7", TET.format(7), 3075, 0.112, 1.93e-3),
    model("h9", HEX.format(9), 2460, 0.166, 0.60e-3),
    model("h7", HEX.format(7), 3075, 0.139, 0.89e-3),
    model("t7_30", TET.format(7) + ", nu = 0.3", 3075, 0.030, 5.09e-3),
    model("t7_4999", TET.format(7) + ", nu = 0.4999", 3075, 0.288, 5.25e-3),
    model("alone", "tet10 of about 9 mm, corotational strain", 9000, 0.01, 5e-3),
)


def test_families_by_size_and_by_poisson() -> None:
    findings = ReportSummary(REFINED)
    sizes = families_by_size(findings)
    assert {f: list(m) for f, m in sizes.items()} == {
        "tet4, corotational strain": ["t9", "t7", "t5"],
        "hex8, corotational strain": ["h9", "h7"],
    }
    # the scene's own ratio is that of the body's material
    ratios = families_by_poisson(findings)
    assert ratios == {"tet4, corotational strain, 7 mm": {"t7_30": 0.3, "t7": 0.49, "t7_4999": 0.4999}}


def test_a_parameter_gives_poissons_ratio() -> None:
    text = SCENE.replace("poisson = 0.49", "poisson = nu")
    ratios = families_by_poisson(ReportSummary(replace(REFINED, names=names_in(text, {"nu": 0.45}))))
    assert ratios["tet4, corotational strain, 7 mm"]["t7"] == 0.45


def test_refinement_is_drawn_and_said() -> None:
    page = render(REFINED)
    said = words(page).replace("\u202f", " ")
    assert page.count('id="refinement-') >= 2
    assert 'id="poisson-1' in page
    assert "tet4 falls from 14.6 % at 2 460 to 7.2 % at 10 476" in said
    assert "Under refinement, tet4 and hex8 come closer to theory and farther from scan." in said
    # tet4 at 0.3, 0.49, 0.4999: 5.09, 1.93, 5.25 mm
    assert "falls from 5.09 mm at 0.3 to 1.93 mm at 0.49, then rises to 5.25 mm at 0.4999" in said
    assert page.count('download="gap-refinement.csv"') == 1


def test_no_family_no_refinement() -> None:
    assert 'id="refinement"' not in render(report(model("a", TET.format(7), 30, 0.1, 1e-3)))
    same = report(*(model(n, "tet4 of the file, small strain", 30, 0.1, 1e-3) for n in "ab"))
    assert 'id="refinement"' not in render(same)


def test_an_error_of_zero_has_no_place_on_a_logarithm() -> None:
    exact = report(model("a", TET.format(7), 30, 0.0, 1e-3), model("b", TET.format(5), 90, 0.0, 1e-4))
    page = render(exact)
    assert 'id="refinement-0"' not in page
    assert 'id="refinement-1"' in page


# ------------------------------------------------------------------ looks


def test_kinds_share_a_colour_where_colours_run_out() -> None:
    many = report(
        *(model(f"t{i}", TET.format(i), 100 * i, 0.1 * i, 1e-3) for i in range(1, 9)),
        *(model(f"h{i}", HEX.format(i), 100 * i, 0.2 * i, 1e-3) for i in range(1, 9)),
    )
    known = curve_styles(many)
    assert {known[f"t{i}"].colour for i in range(1, 9)} == {known["t1"].colour}
    assert known["t1"].colour != known["h1"].colour
    assert len({(k.role, k.colour, k.dash, k.marker) for k in known.values()}) == len(known)
    assert initially_shown(ReportSummary(many)) == ["t1", "t8", "h1", "h8"]


# ------------------------------------------------------------------ gravity


@pytest.mark.parametrize(
    ("direction", "up"),
    [("-y", (0, 1, 0)), ("-z", (0, 0, 1)), ("+x", (-1, 0, 0)), ("(0, 0, -1)", (0, 0, 1))],
)
def test_gravity_points_down(direction: str, up: tuple[int, int, int]) -> None:
    findings = ReportSummary(report(text=SCENE.replace("direction = -y", f"direction = {direction}")))
    np.testing.assert_array_equal(upward(findings), up)
    frame = frame_of(upward(findings))
    np.testing.assert_allclose(frame @ frame.T, np.eye(3), atol=0)
    assert math.isclose(float(np.linalg.det(frame)), 1.0)  # no mirror image
    np.testing.assert_array_equal(frame[2], up)


def test_the_longer_level_direction_runs_from_left_to_right() -> None:
    # along z with y upwards, as on the authors' scan
    X = np.array([[0, 0, 0], [0.02, 0, 0], [0, 0.02, 0], [0, 0, 0.2]], float)
    view = view_of(ReportSummary(report()), [DrawnSurface(X, np.array([[0, 1, 2], [0, 2, 3]]))])
    right, above, _ = axes_of(view)
    assert letters(view) == "zxy"
    assert right @ [0, 0, 1] > 0.8
    assert above @ [0, 1, 0] > 0.9


# ------------------------------------------------------------------ bodies

TWO = """softmark 1
scene "Two"
body left = solid(a, rubber)
body right = solid(b, rubber)
probe axis_l = line(left, from = (0, 0, 0) m, to = (1, 0, 0) m)
probe axis_r = line(right, from = (0, 0, 0) m, to = (1, 0, 0) m)
metric eta_l = relative_l2_error(axis_l, against = theory)
metric eta_r = relative_l2_error(axis_r, against = scan)
metric frame = realtime_factor(rate = 25 Hz)
reference theory = elastica(left)
reference scan = surface("a.obj")
model a = beam6dof(segments = 4, body = left)
model b = beam6dof(segments = 4, body = right)
model lost = beam6dof(segments = 4, body = right)
"""


def frame(share: float, verdict: bool | None = None) -> MetricResult:
    good = share <= 1 if verdict is None else verdict
    known = {"verdict": good, "margin": 1 - share, "limit_s": 0.04, "rate_Hz": 25.0, "median_s": 0.04 * share}
    return MetricResult(share, "1", None, {**known, "verdict_reason": "too slow", "frames": 1, "missed": 0})


def two() -> Report:
    def one(name: str, end: str, eta: float, share: float) -> ModelResult:
        metrics = {f"eta_{end}": MetricResult(eta, "1"), "frame": frame(share)}
        return replace(
            model(name, "4 beam segments, no mesh", 24, 0.1, 0.1),
            probes={f"axis_{end}": LINE},
            metrics=metrics,
            shape=DrawnSurface(*box()),
        )

    lost = ModelResult("lost", "failed", "no equilibrium", "4 beam segments, no mesh")
    references = {
        "theory": ReferenceResult(
            "theory", "converged", None, "closed form", "us", None, {"axis_l": LINE}, {}, DrawnSurface(*box())
        ),
        "scan": ReferenceResult("scan", "converged", None, "measurement", "us", None),
    }
    models = {"a": one("a", "l", 0.1, 0.54), "b": one("b", "r", 0.2, 3.77), "lost": lost}
    return Report({"title": "Two", "file": "t.scene", "text": TWO}, {}, models, references, (), (), names=names_in(TWO))


def box() -> tuple[Any, Any]:
    """A tetrahedron."""
    X = np.array([[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0], [0, 0, 0.1]], float)
    return X, np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])


def test_every_result_and_metric_is_with_its_body() -> None:
    found = {b.name: (b.results, [m.name for m in b.metrics]) for b in bodies(ReportSummary(two()))}
    assert found == {
        "left": (("a", "theory"), ["eta_l", "frame"]),
        "right": (("b", "lost", "scan"), ["eta_r", "frame"]),
    }


def test_one_body_has_no_name() -> None:
    (only,) = bodies(ReportSummary(REFINED))
    assert only.name == ""
    assert only.results == (*REFINED.models, *REFINED.references)


def test_bodies_have_tables_and_figures_of_their_own() -> None:
    page = render(two())
    assert page.count('class="results"') == 2
    assert page.count("<figure") == page.count("<figcaption") == page.count("<desc")
    assert page.count('class="shapes"') == 2
    ids = re.findall(r' id="([^"]*)"', page)
    assert len(ids) == len(set(ids))
    # buttons of one figure do not switch those of the other
    names = re.findall(r'type="radio" name="([^"]*)"', page)
    assert set(names) == {"layout", "layout-1"}
    shown = page.index('class="results"')
    first = page[shown : page.index("</table>", shown)]
    assert "eta_l" in first
    assert "eta_r" not in first


# ------------------------------------------------------------------ terminal


def test_the_terminal_has_a_table_for_each_body() -> None:
    lines = table(two(), terminal=False).splitlines()
    assert lines[2] == "left"
    assert "eta_l" in lines[3]
    assert "frame (real time)" in lines[3]
    assert "eta_r" not in lines[3]
    assert next(line for line in lines if line.startswith("a ")).endswith(
        "yes, uses 54 % of 40 ms        24       3  200 ms  ok"
    )
    assert "NO, takes 3.77 x 40 ms" in next(line for line in lines if line.startswith("b "))


def test_a_step_longer_than_a_frame_is_no_real_time_whatever_it_takes() -> None:
    one = two()
    metrics = {"frame": frame(0.5, verdict=False)}
    shown = table(replace(one, models={"a": replace(one.models["a"], metrics=metrics)}), terminal=False)
    assert "NO, step over 40 ms" in shown


def test_wide_tables_go_on_below() -> None:
    metrics = {f"a_long_name_of_a_metric_{i}": MetricResult(0.1 * i, "m") for i in range(9)}
    wide = replace(model("a", TET.format(7), 30, 0.1, 0.1), metrics=metrics)
    shown = table(report(wide), terminal=False)
    assert max(len(line) for line in shown.splitlines()) <= WIDE
    for name in metrics:
        assert shown.count(name) == 1
    assert sum(line.startswith("a ") for line in shown.splitlines()) >= 3
    assert shown.count("unknowns") == 1


def test_a_reason_is_said_once() -> None:
    shown = table(report(*(model(n, "", 30, None, None) for n in "abcdefg")), terminal=False)
    assert shown.count("the reference `theory` has no solution") == 1
    assert "no eta, gap for 7 models and references: the reference `theory` has no solution" in shown


def test_rounding_reads_as_zero() -> None:
    metrics = {"drop": MetricResult(4.97771e-15, "m"), "eta": MetricResult(0.1, "1")}
    other = {"drop": MetricResult(-0.058, "m"), "eta": MetricResult(1e-4, "1")}
    one, far = (replace(model(n, "", 30, 0.1, 0.1), metrics=m) for n, m in (("a", metrics), ("b", other)))
    both = report(one, far)
    assert "e-15" not in table(both, terminal=False)
    page = render(both)
    # the number itself stays in the page and in its CSV
    assert '<data value="4.97771e-15">0</data>' in page


def test_what_is_negligible() -> None:
    assert is_negligible(4.98e-15, 0.067, "m")
    assert is_negligible(4.98e-15, 4.98e-15, "m")  # where nothing is known of how far anything moves
    assert is_negligible(5.6e-17, 5.6e-17, "m", 1.9e-3)
    assert not is_negligible(5.6e-17, 5.6e-17, "m", 5.6e-17)
    assert not is_negligible(1.9e-12, 1.9e-12, "m", 1.9e-12)
    assert not is_negligible(1e-14, 1e-14, "1", 1.9e-15)  # a strain
    assert is_negligible(1e-14, 1e-14, "1", 1.9e-3)
    assert not is_negligible(2.1e-9, 2.1e-9, "m")
    assert not is_negligible(1.75e-4, 0.67, "1")
    assert format_reference_error(2.9e-15) == "below 1\u00a0nm"
    assert format_reference_error(5e-4).replace("\u00a0", " ") == "estimated at 500 µm"


# ------------------------------------------------------------------ histories


def test_two_probes_of_one_point_have_one_chart() -> None:
    times = np.linspace(0.0, 1.0, 20)
    course = np.sin(times)[:, None, None] * LINE.displacement[None]
    line = replace(LINE, times=times, course=course)
    tip = ProbeResult(LINE.points[-1:], LINE.displacement[-1:], times, course[:, -1:])
    one = replace(model("a", "", 30, 0.1, 0.1), probes={"tip": tip, "axis": line})
    page = render(report(one))
    assert 'id="course-0"' in page
    assert 'id="course-1"' not in page
