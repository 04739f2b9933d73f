"""Figures of the performance profiles of a leaderboard."""

from __future__ import annotations

import math
from collections.abc import Sequence

from softmark.interpreter.report.charts.chart_axes import linear, logarithmic
from softmark.interpreter.report.charts.curve_styles import model_look
from softmark.interpreter.report.charts.line_chart import Chart, Curve
from softmark.interpreter.report.page.embedded_csv import csv_link
from softmark.interpreter.report.page.figure_frame import SHOWN, ColumnGroup, figure_block, hidden_models_note
from softmark.interpreter.report.page.html_markup import section, tag, text
from softmark.interpreter.study.leaderboard.leaderboard_cells import Board
from softmark.interpreter.study.leaderboard.performance_profiles import (
    PerformanceProfile,
    error_profiles,
    time_profiles,
)

STEPS = 120  # samples along the axis, which limit the steepness of a step
WIDTH, HEIGHT = 620.0, 330.0
LEAST = 0.01  # tolerances: errors far below are drawn at the edge
FARTHEST = 1e3  # the axis goes no further
BY_TIME = (
    "Fraction of cases that a model solves right within τ times the time of the fastest right model, over the {} "
    "cases with a right result. At τ = 1: fraction where it is the fastest. At the far right: fraction that it "
    "solves right in any time. A case without a result of the model counts as not solved (Dolan and Moré 2002)."
)
BY_ERROR = (
    "Fraction of cases whose error is at most τ times the tolerance of the case, in any time, over the {} cases with "
    "an error. At τ = 1: fraction that is right. A case without a result of the model counts as not solved."
)


def profiles(board: Board) -> str:
    """Return the HTML section with performance profiles; empty if no model has a right answer."""
    quick, near = time_profiles(board), error_profiles(board)
    plates = []
    if quick:
        far = max(p.steps[-1][0] for p in quick)
        plates.append(
            _profile_figure(
                "time", quick, (1.0, min(max(far, 10.0), FARTHEST)), "τ, time relative to the fastest", BY_TIME
            )
        )
    if near:
        plates.append(_profile_figure("error", near, (LEAST, 100.0), "τ, tolerances", BY_ERROR))
    if not plates:
        return ""
    return section("profiles", "Performance profiles", *plates)


def _profile_figure(
    name: str, own: Sequence[PerformanceProfile], ends: tuple[float, float], label: str, caption: str
) -> str:
    across = logarithmic(*ends, label, "1")
    taus = [math.exp(math.log(across.low) + i / STEPS * math.log(across.high / across.low)) for i in range(STEPS + 1)]
    taus[-1] = across.high
    curves = tuple(
        Curve(p.model, model_look(i), tuple((t, p.at(t * (1 + 1e-12))) for t in taus), 1 + i, named=False)
        for i, p in enumerate(own)
    )
    best = ", ".join(f"{p.model} {p.steps[-1][1]:.0%}" for p in own[:3])
    title = f"Profile of {'times' if name == 'time' else 'errors'}"
    up = linear(0.0, max(math.ceil(10.0 * own[0].steps[-1][1]) / 10.0, 0.2), "fraction of cases", "1")
    chart = Chart(f"profile-{name}", title, f"Largest fractions: {best}.", across, up, WIDTH, HEIGHT, curves)
    shown = [p.model for p in own[:SHOWN]]
    columns = [ColumnGroup("τ", ("τ",), [(f"{t:.4g}",) for t in taus])]
    columns += [ColumnGroup(p.model, ("share",), [(f"{p.at(t * (1 + 1e-12)):.3g}",) for t in taus]) for p in own]
    rows = [(p.model, tau, share, p.of) for p in own for tau, share in p.steps]
    save = csv_link(f"profile-{name}", ["model", "tau", "share", "cases"], rows)
    said = tag("b", text(title)) + ". " + text(caption.format(own[0].of)) + hidden_models_note(len(own), len(shown))
    return figure_block(chart, said, columns, save, open_=shown if len(own) > SHOWN else None)
