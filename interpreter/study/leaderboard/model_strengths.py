"""Strengths of each model on a leaderboard: cases where it is right, fastest, most accurate, or wrong."""

from __future__ import annotations

from softmark.interpreter.study.leaderboard.leaderboard_cells import MET, Board, Cell
from softmark.records import dataclass


@dataclass(frozen=True)
class ModelStrengths:
    """Names of the cases where a model is right, fastest, most accurate, wrong, or without an answer.

    A model counts as fastest or most accurate only in cases that another model also answers.
    """

    model: str
    right: tuple[str, ...]
    quickest: tuple[str, ...]
    closest: tuple[str, ...]
    wrong: tuple[str, ...]
    lost: tuple[tuple[str, str], ...]  # no answer: the case, and its status


def find_strengths(board: Board) -> list[ModelStrengths]:
    """Return the strengths of every model, ordered by decreasing number of right answers."""
    found = [_strengths_of_model(board, model) for model in board.models]
    return sorted(found, key=lambda m: (-len(m.right), len(m.wrong) + len(m.lost)))


def _strengths_of_model(board: Board, model: str) -> ModelStrengths:
    own = {case: cells for case in board.cases if (cells := board.of(case, model))}
    right = [case for case, cells in own.items() if any(c.verdict == MET for c in cells)]
    judged = [case for case, cells in own.items() if any(c.verdict for c in cells)]
    lost = [(case, cells[0].status) for case, cells in own.items() if all(c.error is None for c in cells)]
    return ModelStrengths(
        model, tuple(right), tuple(c for c in right if _is_fastest(board, c, model)),
        tuple(c for c in right if _is_most_accurate(board, c, model)), tuple(c for c in judged if c not in right),
        tuple(lost),
    )  # fmt: skip


def _is_fastest(board: Board, case: str, model: str) -> bool:
    """Return whether a model is the fastest of several models with a right answer in a case."""
    times = [(c.time_s, c.model) for c in board.of(case) if c.verdict == MET and c.time_s is not None]
    return len({m for _, m in times}) > 1 and min(times)[1] == model


def _is_most_accurate(board: Board, case: str, model: str) -> bool:
    """Return whether a model is the most accurate of several models in a case.

    Errors below the uncertainty of the reference are equal.
    """
    errors = [(_error_or_uncertainty(c), c.model) for c in board.of(case) if c.error is not None]
    least = min(error for error, _ in errors)
    return len({m for _, m in errors}) > 1 and any(m == model and error <= least for error, m in errors)


def _error_or_uncertainty(cell: Cell) -> float:
    return max(cell.error or 0.0, cell.uncertainty or 0.0)
