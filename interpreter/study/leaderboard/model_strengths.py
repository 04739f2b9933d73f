"""Strengths of each model on a leaderboard: the cases where it is right, fastest or most accurate, and the others."""

from __future__ import annotations

from softmark.interpreter.study.leaderboard.leaderboard_cells import MET, Board, Cell
from softmark.records import dataclass


@dataclass(frozen=True)
class ModelStrengths:
    """Cases of a model by name; `quickest` compares models with right answers, if there are several."""

    model: str
    right: tuple[str, ...]
    quickest: tuple[str, ...]
    closest: tuple[str, ...]
    wrong: tuple[str, ...]
    lost: tuple[tuple[str, str], ...]  # no answer: the case, and its status


def find_strengths(board: Board) -> list[ModelStrengths]:
    """Return the strengths of every model, the one with most right answers first."""
    found = [_merit(board, model) for model in board.models]
    return sorted(found, key=lambda m: (-len(m.right), len(m.wrong) + len(m.lost)))


def _merit(board: Board, model: str) -> ModelStrengths:
    own = {case: cells for case in board.cases if (cells := board.of(case, model))}
    right = [case for case, cells in own.items() if any(c.verdict == MET for c in cells)]
    judged = [case for case, cells in own.items() if any(c.verdict for c in cells)]
    lost = [(case, cells[0].status) for case, cells in own.items() if all(c.error is None for c in cells)]
    return ModelStrengths(
        model, tuple(right), tuple(c for c in right if _quickest(board, c, model)),
        tuple(c for c in right if _closest(board, c, model)), tuple(c for c in judged if c not in right), tuple(lost),
    )  # fmt: skip


def _quickest(board: Board, case: str, model: str) -> bool:
    """Return whether no other model is right in less time."""
    times = [(c.time_s, c.model) for c in board.of(case) if c.verdict == MET and c.time_s is not None]
    return len({m for _, m in times}) > 1 and min(times)[1] == model


def _closest(board: Board, case: str, model: str) -> bool:
    """Return whether no model has a smaller error; errors below the reference's uncertainty are equal."""
    errors = [(_told(c), c.model) for c in board.of(case) if c.error is not None]
    least = min(error for error, _ in errors)
    return len({m for _, m in errors}) > 1 and any(m == model and error <= least for error, m in errors)


def _told(cell: Cell) -> float:
    return max(cell.error or 0.0, cell.uncertainty or 0.0)
