"""What the refinement of a line tells: order of its errors, limit of its displacements, and whether to rely on them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import takewhile
from typing import Any

from softmark.interpreter.study.analysis.point import SOLVED, Line, Point, measured, stated, uncertainty_of
from softmark.records import dataclass
from softmark.references.orders import Refined, order_of_errors, refined, unlike

AXES = "xyz"
TARGETS = ("size", "segments", "step")  # fields that decide how finely a thing is solved


@dataclass(frozen=True)
class Refinement:
    """Solved members of a line that differ in how finely they are solved, and in nothing else."""

    target: str  # size, segments or step
    formal: float | None  # order in displacements that theory gives it
    members: list[tuple[float, Point]]  # h, coarse to fine: of cells that of the mesh, in any unit
    unlike: str | None  # why its meshes are not similar, if they are not


def orders_of(line: Line, label: str, metrics: Sequence[str], points: Sequence[Point]) -> dict[str, Any]:
    """Orders of every error and limits of every probe along a line; `doubt` where they are not to be relied upon.

    `asymptotic` is None for a single configuration and for what is no refinement: there is nothing to rely on.
    """
    own: dict[str, Any] = {"line": label, "model": line.model, "study": line.study, "varied": line.varied}
    found = refinement_of(line)
    if isinstance(found, str):
        return {
            **own,
            "varied": None,
            "asymptotic": None,
            "doubt": None,
            "reason": None if line.varied is None else found,
            "errors": {},
            "limits": [],
        }
    members = found.members
    errors = {m: _errors(members, m, points) for m in metrics}
    limits = [_limit(found, probe) for probe in _shared([p for _, p in members])]
    doubts = [str(limit.get("doubt") or limit.get("reason")) for limit in limits if not limit.get("asymptotic")]
    doubt = doubts[0] if doubts else None if limits else "no probe that all of its members have"
    return {
        **own, "refines": found.target, "formal": found.formal, "asymptotic": doubt is None, "doubt": doubt,
        "reason": None, "members": len(members), "errors": errors, "limits": limits,
    }  # fmt: skip


def refinement_of(line: Line) -> Refinement | str:
    """What a line refines, or why it is no refinement: its number must decide a size, segments or a step alone."""
    if line.varied is None:
        return "one configuration tells no order"
    solved = [p for p in line.members if p.get("status") in SOLVED and p.get("resolution")]
    if not solved:
        return "none of its members has a solution"
    if len({p["resolution"]["problem"] for p in solved}) > 1:
        return f"`{line.varied}` changes what is solved, not how finely"
    decided = [t for t in TARGETS if len({p["resolution"]["of"].get(t) for p in solved}) > 1]
    if len(decided) != 1:
        what = "no size, no segments and no step" if not decided else f"{' and '.join(decided)} at once"
        return f"`{line.varied}` decides {what}"
    return _refinement(decided[0], solved)


def _refinement(target: str, solved: Sequence[Point]) -> Refinement:
    formal = {p["resolution"]["formal"].get(target) for p in solved}
    rows = sorted({_h(target, p): p for p in solved}.items(), key=lambda row: -row[0])  # of two of one mesh, the last
    counts = [p["resolution"].get("counts") for _, p in rows]
    why = unlike(counts) if target == "size" and all(counts) else None
    return Refinement(target, formal.pop() if len(formal) == 1 else None, rows, why)


def _h(target: str, point: Point) -> float:
    """The size of a cell as ASME V&V 20-2009 has it, (V / N)^(1/3), but for a factor; or the step."""
    cells = (point.get("size") or {}).get("elements")
    if target == "size" and point["resolution"]["meshed"] and cells:
        return float(cells ** (-1 / 3))
    value = float(point["resolution"]["of"][target])
    return 1.0 / value if target == "segments" else value


def _errors(members: Sequence[tuple[float, Point]], metric: str, points: Sequence[Point]) -> dict[str, Any]:
    """`cut`: finer members are left out, as their errors are within the uncertainty of the reference."""
    floor = uncertainty_of(points, metric)
    family = [(h, e) for h, p in members if (e := measured(p, metric)) is not None]
    above = list(takewhile(lambda pair: pair[1] > floor, family))
    found = order_of_errors(above, floor).to_json()
    cut = len(above) < len(family)
    if cut and "reason" in found:
        found["reason"] = "its errors are within the uncertainty of the reference" if floor else "it has no error left"
    return {"unit": stated(points, metric, "unit"), "cut": cut, **found}


def _shared(members: Sequence[Point]) -> list[str]:
    """Probes that all have at the same points."""
    first = members[0].get("probes") or {} if members else {}
    names = []
    for name, probe in first.items():
        everyone = [(p.get("probes") or {}).get(name) for p in members]
        if probe["points"] and all(own is not None and _same(own["points"], probe["points"]) for own in everyone):
            names.append(name)
    return names


def _same(a: Sequence[Sequence[float]], b: Sequence[Sequence[float]]) -> bool:
    """Whether two probes have the same points, to rounding."""
    extent = max(abs(c) for X in b for c in X)
    return len(a) == len(b) and all(
        abs(x - y) <= 1e-9 * extent for X, Y in zip(a, b, strict=True) for x, y in zip(X, Y, strict=True)
    )


def _limit(line: Refinement, probe: str) -> dict[str, Any]:
    """Order, limit and grid convergence index of the displacement that is largest on the finest mesh."""
    members = line.members
    finest = members[-1][1]["probes"][probe]["displacement"]
    i, axis = max(
        ((i, a) for i in range(len(finest)) for a in range(3)),
        key=lambda place: abs(finest[place[0]][place[1]]),
    )
    family = [(h, float(p["probes"][probe]["displacement"][i][axis])) for h, p in members]
    return {
        "probe": probe, "what": f"displacement along {AXES[axis]} of the point that moves furthest", "unit": "m",
        "finest": family[-1][1], **settled(line, family, line.formal).to_json(),
    }  # fmt: skip


def settled(line: Refinement, family: Sequence[tuple[float, float]], formal: float | None) -> Refined:
    """What values along a line tell of their limit, in doubt where its meshes are not similar."""
    found = refined(family, formal)
    if line.unlike is None or found.order is None:
        return found
    doubt = line.unlike if found.doubt is None else f"{found.doubt}; {line.unlike}"
    return replace(found, asymptotic=False, doubt=doubt)
