"""Leaderboard and its cells: one cell for each model on each case, with error, uncertainty, time and status."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, ClassVar

from softmark.interpreter.results.json_records import Json, JsonRecord, list_reader, mapping_reader
from softmark.interpreter.study.analysis.comparison_point import (
    CLOCKS,
    INSIDE_OUT,
    ComparedPoint,
    Spread,
    error_metrics,
)
from softmark.interpreter.study.leaderboard.suite_cases import BoardCase, Entrant
from softmark.records import dataclass

SCHEMA = "softmark-board/1"
MET, NOT_MET, CANNOT_TELL = "met", "not_met", "cannot_tell"  # verdicts, as those of expectations


@dataclass(frozen=True)
class CaseCard(JsonRecord):
    """Case on the leaderboard; its numbers are in `unit`.

    `reason` is given if the scene could not be read, so that no model has a result.
    """

    SELDOM: ClassVar = ("reason",)

    question: str
    scene: str  # its title
    file: str  # as the suite names it
    metric: str | None
    unit: str
    against: str | None
    kind: str
    source: str
    tolerance: float | None
    subject: str = ""  # name of the scene in the comparison
    reason: str | None = None


@dataclass(frozen=True)
class ModelCard(JsonRecord):
    """Model on the leaderboard: the number of its cases, and of its cases with a right answer (`met`)."""

    entered: int
    met: int
    seconds: float | None  # of all cells that were timed


@dataclass(frozen=True)
class Cell(JsonRecord):
    """Result of one model in one case.

    `name` is the name of the model in the scene. `verdict` is None if the case has no tolerance or the model no error.
    """

    SELDOM: ClassVar = ("message", "flags")
    READ: ClassVar = {"flags": tuple}

    case: str
    model: str
    name: str
    status: str
    error: float | None = None
    uncertainty: float | None = None
    unit: str = "1"
    time_s: float | None = None
    verdict: str | None = None
    clock: str | None = None
    quartiles_s: Sequence[float] | None = None
    dofs: int | None = None
    outline: str = ""
    message: str | None = None
    flags: tuple[str, ...] | None = None


@dataclass(frozen=True)
class Board(JsonRecord):
    """Leaderboard (`board.json`): cases, models and results."""

    READ: ClassVar = {
        "cases": mapping_reader(CaseCard.from_json), "models": mapping_reader(ModelCard.from_json),
        "cells": list_reader(Cell.from_json),
    }  # fmt: skip

    schema: str
    title: str
    created: str
    command: str
    environment: Json
    cases: Mapping[str, CaseCard]
    models: Mapping[str, ModelCard]
    cells: tuple[Cell, ...]

    def of(self, case: str, model: str | None = None) -> list[Cell]:
        """Return the cells of a case, by default of all models; those with an error first, by increasing error."""
        own = [c for c in self.cells if c.case == case and model in (None, c.model)]
        return sorted(own, key=_error_sort_key)


def _error_sort_key(cell: Cell) -> tuple[bool, float]:
    return cell.error is None, cell.error if cell.error is not None else 0.0


def board_of(
    title: str, cases: Sequence[BoardCase], points: Sequence[ComparedPoint], saved: Mapping[str, Any]
) -> Board:  # fmt: skip
    """Return the leaderboard of a comparison; `saved` is the JSON of the comparison, `softmark-compare/1`."""
    cells = tuple(cell for case in cases for cell in _cells(case, points))
    names = dict.fromkeys(cell.model for cell in cells)
    models = {name: _model([c for c in cells if c.model == name]) for name in names}
    cards = {case.case.name: _card(case, points) for case in cases}
    return Board(SCHEMA, title, saved["created"], saved["command"], saved["environment"], cards, models, cells)


def _card(case: BoardCase, points: Sequence[ComparedPoint]) -> CaseCard:
    metric, subject = _judging_metric(case, points), case.subject.name if case.subject else ""
    return CaseCard(case.case.asks, case.title, case.case.scene, metric, case.unit, case.against, case.kind,
                    case.source, case.case.within, subject, case.reason)  # fmt: skip


def _model(cells: Sequence[Cell]) -> ModelCard:
    times = [c.time_s for c in cells if c.time_s is not None]
    met = {c.case for c in cells if c.verdict == MET}
    return ModelCard(len({c.case for c in cells}), len(met), sum(times) if times else None)


def _cells(case: BoardCase, points: Sequence[ComparedPoint]) -> Iterator[Cell]:
    own = {p.model: p for p in points if case.subject is not None and p.scene == case.subject.name}
    metric = _judging_metric(case, points)
    for entrant in case.entrants:
        if (point := own.get(entrant.name)) is not None:
            yield _cell(case, entrant, point, metric)


def _judging_metric(case: BoardCase, points: Sequence[ComparedPoint]) -> str | None:
    """Return the metric that judges a case: the declared one, or else the first error metric that was measured."""
    if case.case.by is not None or case.subject is None:
        return case.case.by
    return next(iter(error_metrics([p for p in points if p.scene == case.subject.name])), None)


def _cell(case: BoardCase, entrant: Entrant, point: ComparedPoint, metric: str | None) -> Cell:
    error = None if metric is None or not point.solved else point.error(metric)
    uncertainty = None if error is None or metric is None else point.uncertainty(metric)
    clock, effort = _clock_and_time(point)
    reason = INSIDE_OUT if point.inverted else point.message
    judged = CANNOT_TELL if point.inverted and error is not None else judge_error(error, uncertainty, case.case.within)
    if error is None and reason is None:
        reason = "it has no metric against a reference" if metric is None else point.metric(metric).reason
    return Cell(
        case.case.name, entrant.model, entrant.name, point.status, error, uncertainty, case.unit,
        effort.median if effort else None, judged, clock,
        (effort.q1, effort.q3) if effort else None, point.dofs, point.outline, reason, point.cost.flags or None,
    )  # fmt: skip


def _clock_and_time(point: ComparedPoint) -> tuple[str | None, Spread | None]:
    """Return the first clock of CLOCKS that measured a configuration, and its time, s."""
    return next(((clock, own) for clock in CLOCKS if (own := point.effort(clock)) is not None), (None, None))


def judge_error(error: float | None, uncertainty: float | None, tolerance: float | None) -> str | None:
    """Return the verdict on an error: MET, NOT_MET or CANNOT_TELL; None if there is no error or tolerance.

    CANNOT_TELL means that the uncertainty of the reference is too large to decide.
    """
    if error is None or tolerance is None:
        return None
    if error <= tolerance:
        return MET
    return CANNOT_TELL if error - (uncertainty or 0.0) <= tolerance else NOT_MET
