"""A case: one body with all that acts on it, as every model and reference of that body sees it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.conditions import Condition
from softmark.interpreter.scene import Declared, Location, Scene
from softmark.interpreter.vocabulary.analyses import Static
from softmark.interpreter.vocabulary.loads import Gravity


class Fault(Exception):
    """Something in the scene cannot be represented or built; carries its diagnostic."""

    def __init__(self, diagnostic: Diagnostic) -> None:
        super().__init__(diagnostic.message)
        self.diagnostic = diagnostic


def fault(code: str, at: Location, message: str, label: str = "", help: str = "") -> Fault:
    """A Fault at a place of the scene."""
    return Fault(Diagnostic(code, message, at.source, at.span, label, help))


@dataclass(frozen=True)
class Case:
    """A body, what it is made of, what holds it and what loads it."""

    body: Declared
    supports: tuple[Declared, ...]
    loads: tuple[Declared, ...]
    analysis: Static

    @property
    def shape(self) -> Any:
        """The body's geometry."""
        return self.body.thing.shape

    @property
    def material(self) -> Any:
        """What the body is made of."""
        return self.body.thing.material

    @property
    def gravity(self) -> tuple[float, float, float]:
        """Sum of all accelerations of gravity, m/s^2."""
        pulls = [d.thing for d in self.loads if isinstance(d.thing, Gravity)]
        return tuple(sum(p.magnitude * p.direction[i] for p in pulls) for i in range(3))  # type: ignore[return-value]


def case_of(scene: Scene, body: str) -> Case:
    """The case of a body."""

    def acts(d: Declared) -> bool:
        return getattr(d.thing, "body", body) == body

    analyses = list(scene.of_kind("analysis").values())
    return Case(
        body=scene.declared[body],
        supports=tuple(d for d in scene.of_kind("support").values() if acts(d)),
        loads=tuple(d for d in scene.of_kind("load").values() if acts(d)),
        analysis=analyses[0].thing if analyses else Static(),
    )


def body_of(scene: Scene, declared: Declared) -> str:
    """The body that a model, reference or probe is about: the one it names, or the only one. Raises Fault."""
    named: str | None = getattr(declared.thing, "body", None)
    if named is not None:
        return named
    bodies = list(scene.of_kind("body"))
    if len(bodies) == 1:
        return bodies[0]
    if not bodies:
        raise fault("E221", declared.location, f"`{declared.name}` has no body to work on", "no body is declared",
                    "declare one: `body beam = solid(cylinder(...), material)`")  # fmt: skip
    raise fault("E221", declared.location, f"`{declared.name}` could mean any of {len(bodies)} bodies", "which body?",
                f"say which: `body = {bodies[0]}`; bodies: {', '.join(bodies)}")  # fmt: skip


# ------------------------------------------------------------------ selections on a straight beam


def coverage(condition: Condition, shape: Any, station: float) -> str:
    """How much of the cross-section at `station` (m from the root) a condition selects: all, some or none."""
    low, high = shape.bounds
    extent = sum((b - a) ** 2 for a, b in zip(low, high, strict=True)) ** 0.5
    held = [bool(condition.holds(*p, extent)) for p in _section_points(shape, station)]
    return "all" if all(held) else "some" if any(held) else "none"


def _section_points(shape: Any, station: float) -> list[tuple[float, ...]]:
    from softmark.solvers.mesh.shapes import transverse

    first, second = transverse(shape.axis)
    centre = [r + station * a for r, a in zip(shape.root, shape.axis, strict=True)]
    return [
        tuple(c + u * f + v * s for c, f, s in zip(centre, first, second, strict=True))
        for u, v in shape.section.samples()
    ]
