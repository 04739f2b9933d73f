"""The board: suites, cells, profiles, merits, and what has changed since the last one, on boards made up by hand."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import pytest

from softmark.grammar.diagnostic import Source
from softmark.interpreter.cli.main import main
from softmark.interpreter.report.leaderboard.leaderboard_comment import comment
from softmark.interpreter.report.leaderboard.result_matrix import matrix
from softmark.interpreter.study.leaderboard.leaderboard_cells import Board, CaseCard, Cell, ModelCard, judge_error
from softmark.interpreter.study.leaderboard.leaderboard_changes import NotALeaderboard, describe_change, read_board
from softmark.interpreter.study.leaderboard.model_strengths import find_strengths
from softmark.interpreter.study.leaderboard.performance_profiles import (
    error_profiles,
    make_profiles,
    relative_costs,
    time_profiles,
)
from softmark.interpreter.study.leaderboard.suite_file import is_suite, standard_suites
from softmark.interpreter.study.leaderboard.suite_file import read_suite as read_suite
from softmark.scenes import ROOT

CASE = 'case lifted = judged("bend-45", by = off_lifted, kind = one_code, within = 2 %, asks = "How far?")\n'


def card(tolerance: float | None = 0.1) -> CaseCard:
    return CaseCard("How far?", "A scene", "a.scene", "eta", "1", "theory", "theory", "a book", tolerance, "a")


def cell(case: str, model: str, error: float | None, time: float | None = None, sure: float | None = None) -> Cell:
    status = "failed" if error is None else "converged"
    return Cell(case, model, model, status, error, sure, "1", time, judge_error(error, sure, 0.1), "cpu_s")


def board(cells: Sequence[Cell]) -> Board:
    models = {c.model: ModelCard(1, 1, None) for c in cells}
    cases = {c.case: card() for c in cells}
    return Board("softmark-board/1", "A board", "2026-11-23", "dsl board", {"cpu": "x"}, cases, models, tuple(cells))


# three cases, two models; times to a right answer are p: 1 and 2 s, q: 4 and 1 s, r: only a, in 3 s; of s nobody
WORKED = board(
    [
        cell("p", "a", 0.05, 1.0), cell("p", "b", 0.02, 2.0),
        cell("q", "a", 0.10, 4.0), cell("q", "b", 0.05, 1.0),
        cell("r", "a", 0.01, 3.0), cell("r", "b", 0.50, 1.0),
        cell("s", "a", 0.20, 1.0), cell("s", "b", None),
    ]
)  # fmt: skip


def test_profiles_of_times_are_those_of_dolan_and_more_by_hand() -> None:
    """Ratios are p: a 1, b 2; q: a 4, b 1; r: a 1, b endless: a is at 2/3 from 1 and at 1 from 4, b at 1/3 and 2/3."""
    found = {p.model: p for p in time_profiles(WORKED)}
    assert [found["a"].at(tau) for tau in (0.9, 1.0, 3.9, 4.0, 99.0)] == pytest.approx([0.0, 2 / 3, 2 / 3, 1.0, 1.0])
    assert [found["b"].at(tau) for tau in (1.0, 1.9, 2.0, 99.0)] == pytest.approx([1 / 3, 1 / 3, 2 / 3, 2 / 3])
    assert {p.of for p in found.values()} == {3}  # nobody is right in the fourth


def test_profiles_of_errors_count_tolerances() -> None:
    """Errors over the tolerance of 0.1 are a: 0.5, 1, 0.1, 2; b: 0.2, 0.5, 5 and none, of four cases."""
    found = {p.model: p for p in error_profiles(WORKED)}
    assert [found["a"].at(tau) for tau in (0.1, 0.5, 1.0, 2.0)] == pytest.approx([0.25, 0.5, 0.75, 1.0])
    assert [found["b"].at(tau) for tau in (0.2, 1.0, 5.0)] == pytest.approx([0.25, 0.5, 0.75])


def test_profiles_rise_and_somebody_is_quickest() -> None:
    ratios = {f"p{i}": relative_costs({"a": 1.0 + i % 3, "b": 2.0, "c": 1.5 + i % 2}) for i in range(7)}
    found = make_profiles(ratios, 7, ["a", "b", "c", "absent"])
    assert {p.model for p in found} == {"a", "b", "c"}
    assert all(s <= t for p in found for (_, s), (_, t) in zip(p.steps, p.steps[1:], strict=False))
    assert sum(p.at(1.0) for p in found) >= 1.0


def test_a_verdict_knows_what_the_reference_leaves_open() -> None:
    assert judge_error(0.1, None, 0.1) == "met"
    assert judge_error(0.11, 0.02, 0.1) == "cannot_tell"
    assert judge_error(0.13, 0.02, 0.1) == "not_met"
    assert judge_error(None, None, 0.1) is None is judge_error(0.1, 0.1, None)


def test_merits_say_who_is_right_quickest_and_closest() -> None:
    first, second = find_strengths(WORKED)
    assert (first.model, first.right, first.quickest, first.closest) == ("a", ("p", "q", "r"), ("p",), ("r",))
    assert (second.model, second.quickest, second.closest) == ("b", ("q",), ("p", "q"))
    assert first.wrong == ("s",)
    assert second.wrong == ("r",)
    assert second.lost == (("s", "failed"),)


def test_the_matrix_has_every_cell_once() -> None:
    markup = matrix(WORKED, ["a", "b"])
    signs = [markup.count(sign) - 1 for sign in "✓✗"]  # its lead has one of each
    assert signs == [5, 2]
    assert markup.count('class="none"') == 1
    assert markup.index("5\u00a0%") < markup.index("2\u00a0%") < markup.index("failed")


def test_the_best_setting_of_a_model_stands_for_it() -> None:
    twice = board([cell("p", "a", 0.2), replace(cell("p", "a", 0.03), name="finer"), cell("p", "a", None)])
    assert [c.error for c in twice.of("p", "a")] == [0.03, 0.2, None]
    assert "best of 3" in matrix(twice, ["a"])


# ------------------------------------------------------------------ what has changed


def test_the_difference_of_two_boards_is_a_table() -> None:
    cells = list(WORKED.cells)
    cells[0] = replace(cells[0], error=0.06)  # a fifth more
    cells[1] = replace(cells[1], time_s=2.5)  # noise
    cells[5] = replace(cells[5], error=0.05, verdict="met")
    new = board([*cells[:7], cell("t", "c", 0.1)])
    rows = [line for line in comment(WORKED, new).splitlines() if line.startswith("| ")][2:]
    assert rows == [
        "| p | a (`a`) | 5 %, 1 s | 6 %, 1 s | error × 1.2 |",
        "| r | b (`b`) | 50 %, 1 s | 5 %, 1 s | not met → met |",
        "| t | c (`c`) | – | 10 % | new |",
        "| s | b (`b`) | failed | – | gone |",
    ]
    assert "8 cells, 5 as before, 4 changed" in comment(WORKED, new)
    assert "0 changed" in comment(WORKED, WORKED)


def test_what_a_reference_cannot_tell_is_no_change() -> None:
    a = cell("p", "a", 0.01, sure=0.05)
    assert not describe_change(a, replace(a, error=0.04))
    assert describe_change(a, replace(a, error=0.08)) == "error × 1.6"
    assert describe_change(replace(a, time_s=1.0), replace(a, time_s=2.0)) == "time × 2"
    assert not describe_change(replace(a, time_s=1.0), replace(a, time_s=2.0), timed=False)


def test_a_board_is_read_as_it_was_written(tmp_path: Path) -> None:
    file = tmp_path / "board.json"
    file.write_text(json.dumps(WORKED.to_json(), allow_nan=False), encoding="utf-8")
    assert read_board(str(file)) == WORKED


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"schema": "softmark-board/1", "cells": 3}', "[" * 5000])
def test_what_is_no_board_is_refused_in_words(tmp_path: Path, text: str) -> None:
    file = tmp_path / "old.json"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(NotALeaderboard, match=r"--against|old\.json"):
        read_board(str(file))
    with pytest.raises(NotALeaderboard, match="--against"):
        read_board(str(tmp_path / "absent.json"))


# ------------------------------------------------------------------ suites


def test_a_suite_is_read() -> None:
    suite, found = read_suite(Source("my.suite", 'scene "Mine"\n' + CASE), Path())
    assert not found
    assert suite is not None
    assert suite.title == "Mine"
    (case,) = suite.cases
    assert (case.name, case.scene, case.by, case.kind) == ("lifted", "bend-45", "off_lifted", "one code")
    assert case.within == pytest.approx(0.02)
    assert case.asks == "How far?"
    assert is_suite(CASE)
    assert not is_suite('scene "In case"\nparam h = 1 mm\n')


@pytest.mark.parametrize(
    ("text", "codes"),
    [
        ("", ["E740"]),
        (CASE + CASE, ["E740"]),
        (CASE + CASE.replace("lifted =", "other ="), ["E740"]),
        ('case a = "bend-45"\n', ["E741"]),
        ("case a = judged()\n", ["E741"] * 5),
        (CASE.replace("off_lifted", "3"), ["E741"]),
        (CASE.replace("one_code", "one_cod"), ["E744"]),
        (CASE.replace("2 %", "2 furlongs"), ["E745"]),
        (CASE.replace("2 %", "0 %"), ["E745"]),
        (CASE.replace("judged(", "judged(("), ["E1"]),
    ],
)
def test_what_is_no_suite_is_refused_at_its_place(text: str, codes: list[str]) -> None:
    suite, found = read_suite(Source("my.suite", text), Path())
    assert suite is None
    assert [d.code[: len(c)] for d, c in zip(found, codes, strict=True)] == codes
    assert all(d.span is not None for d in found)


def test_the_shipped_suite_asks_twenty_things_and_more() -> None:
    text = (ROOT / "suites" / "2026.suite").read_text(encoding="utf-8")
    suite, found = read_suite(Source("2026.suite", text), ROOT / "suites")
    assert not found
    assert suite is not None
    assert len(suite.cases) >= 20
    assert len({c.kind for c in suite.cases}) >= 4
    assert set(standard_suites()) == {"2026", "std/suites/2026.suite"}


# ------------------------------------------------------------------ from end to end


SMALL = """
scene "A stretched block of two models"
param E = 60 kPa
material gel  = neo_hookean(young = E, poisson = 0.3, density = 1000 kg/m^3)
body     bar  = solid(box(size = (40, 20, 20) mm), gel)
support  wall = displaced(bar, by = (0, 0, 0) mm, components = x, where = x <= 0 mm)
support  side = displaced(bar, by = (0, 0, 0) mm, components = y, where = y <= 0 mm)
support  base = displaced(bar, by = (0, 0, 0) mm, components = z, where = z <= 0 mm)
support  pull = displaced(bar, by = (1, 0, 0) mm, components = x, where = x >= 40 mm)
model    hexes = fem(hex8, strain = small, size = 10 mm)
model    rough = fem(tet4, strain = finite, size = 10 mm)
metric   force = force(pull, along = +x)
reference form = values(E * 1 / 40 * 400 mm^2, uncertainty = 1e-9, source = "Hooke", kind = theory)
metric   off   = value_error(force, against = form)
"""
TWO = """
case pulled = judged("small.scene", by = off, kind = theory, within = 0.1 %, asks = "What force?")
case barely = judged("stiff-cantilever", by = eta, kind = theory, within = 1 %, asks = "How far?")
case broken = judged("broken.scene", by = off, kind = theory, within = 1 %, asks = "What?")
"""


@pytest.mark.slow
def test_a_board_of_two_scenes_and_a_broken_one(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Hooke's force E A u / L is met by both elements: strains are uniform; in finite strain of 2.5 % it is not."""
    (tmp_path / "small.scene").write_text(SMALL, encoding="utf-8")
    (tmp_path / "broken.scene").write_text(SMALL.replace("param E = 60 kPa", "param E = 60 m"), encoding="utf-8")
    (tmp_path / "two.suite").write_text(TWO, encoding="utf-8")
    out = tmp_path / "site"
    command = ["board", str(tmp_path / "two.suite"), "--out", str(out), "--repeats", "0", "--timeout", "300"]
    assert main(command) == 3  # for the broken one
    made = json.loads((out / "board.json").read_text(encoding="utf-8"))
    cells = {(c["case"], c["name"]): c for c in made["cells"]}
    assert set(cells) == {("pulled", "hexes"), ("pulled", "rough"), ("barely", "euler"), ("barely", "timoshenko")}
    assert cells["pulled", "hexes"]["verdict"] == "met"
    assert cells["pulled", "hexes"]["error"] < 1e-6
    assert cells["pulled", "rough"]["verdict"] == "not_met"
    assert 0.001 < cells["pulled", "rough"]["error"] < 0.1
    assert "E" in made["cases"]["broken"]["reason"]
    assert made["models"]["hex8, small strain"]["met"] == 1
    page = (out / "index.html").read_text(encoding="utf-8")
    assert "http" not in page.replace("http-equiv", "")
    assert 'id="case-broken"' in page
    capsys.readouterr()
    written = (out / "journal.jsonl").read_bytes()
    assert main([*command, "--against", str(out / "board.json")]) == 3
    assert "4 cells, 4 as before, 0 changed" in capsys.readouterr().out
    assert (out / "journal.jsonl").read_bytes() == written  # nothing was computed again
