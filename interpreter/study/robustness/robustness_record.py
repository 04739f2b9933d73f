"""What stability studies have found: `softmark-stress/1`, which is written and read here alone."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping
from dataclasses import field, fields, replace
from typing import Any, ClassVar, Self

from softmark.interpreter.planning.varied_quantities import Value, WalkedQuantity
from softmark.interpreter.results.error_statements import StatedError
from softmark.interpreter.results.json_records import Plain, several
from softmark.records import dataclass

SCHEMA = "softmark-stress/1"
CLASSES = (
    "right", "inaccurate", "silent", "not_converged", "diverged", "refused", "failed", "timed_out", "unjudged"
)  # fmt: skip
WORST = ("silent", "failed", "timed_out", "diverged", "not_converged", "refused", "inaccurate", "unjudged")


@dataclass(frozen=True)
class Classified(Plain):
    """What a point is, and the numbers that say so; `uncertainty` is that of the truth, relative."""

    NAMED: ClassVar = {"word": "class"}
    READ: ClassVar = {"stated": StatedError.from_json, "warnings": tuple}
    SELDOM: ClassVar = ("status",)

    word: str
    error: float | None = None
    stated: StatedError | None = None
    uncertainty: float | None = None
    message: str | None = None
    code: str | None = None
    warnings: tuple[str, ...] = ()
    status: str | None = None  # of the model; None where it is not known

    @property
    def states(self) -> float | None:
        """The error that the model states."""
        return None if self.stated is None else self.stated.value


@dataclass(frozen=True)
class StressPoint(Plain):
    """A model at some values of quantities, those that are not nominal, and what it turned out to be."""

    model: str
    values: Mapping[str, Value]
    found: Classified
    texts: Mapping[str, str] = field(default_factory=dict)  # what an override takes for each value
    key: str = ""
    cpu_s: float | None = None

    def entries(self) -> Mapping[str, object]:
        """With what it turned out to be among them."""
        own = replace(self.found, status=None).entries()
        return {"key": self.key, "model": self.model, "values": self.values, "texts": self.texts, **own,
                "cpu_s": self.cpu_s}  # fmt: skip

    @classmethod
    def from_json(cls, own: Mapping[str, Any]) -> Self:
        """From its entry."""
        texts = own.get("texts") or {}
        return cls(own["model"], own["values"], Classified.from_json(own), texts, own["key"], own.get("cpu_s"))


@dataclass(frozen=True)
class StressEdge(Plain):
    """Where what a model gets right ends in one direction, and the class beyond."""

    NAMED: ClassVar = {"word": "class"}

    model: str
    quantity: str
    direction: str
    last_right: float | None = None
    first_wrong: float | None = None
    word: str | None = None  # the class beyond; None where it is right as far as it was walked
    last_answer: float | None = None
    first_silence: float | None = None
    silence: str | None = None  # the class there
    reason: str | None = None
    remedy: str | None = None
    reached: float | None = None
    here: str | None = None  # the class of the scene as it is
    first_right: float | None = None
    judged: int = 0  # points of the walk
    blind: int = 0  # points that were not judged, this side of what is right
    first_unjudged: float | None = None

    @staticmethod
    def read(own: Mapping[str, Any]) -> StressEdge:
        """From its entry, which may be that of a choice."""
        return (StressEdge if own.get("right") is None else StressChoice).from_json(own)

    @property
    def met(self) -> float | None:
        """From where the class beyond is met."""
        return self.first_unjudged if self.word == "unjudged" else self.first_wrong


ALIKE = [f.name for f in fields(StressEdge)].index("here")  # first entries, that edges and choices have


@dataclass(frozen=True)
class StressChoice(StressEdge):
    """The edge of a quantity that is chosen: the worst that an option comes to, and the class of each."""

    right: tuple[str, ...] = ()
    classes: Mapping[str, str] = field(default_factory=dict)

    def entries(self) -> Mapping[str, object]:
        """Without what only walks have."""
        own = list(super().entries().items())[:ALIKE]
        return {**dict(own), "right": self.right, "wrong": self.wrong, "unjudged": self.under("unjudged"),
                "classes": self.classes}  # fmt: skip

    @classmethod
    def from_json(cls, own: Mapping[str, Any]) -> Self:
        """From its entry; older ones have no class for each option."""
        older = {**dict.fromkeys(own["right"], "right"), **dict.fromkeys(own.get("wrong") or (), own.get("class"))}
        found = super().from_json({**own, "classes": own.get("classes") or older})
        return replace(found, right=tuple(found.right))

    @property
    def wrong(self) -> list[str]:
        """Options with which it is wrong, the worst first."""
        ranked = sorted((WORST.index(w), o) for o, w in self.classes.items() if w not in ("right", "unjudged"))
        return [option for _, option in ranked]

    def under(self, word: str) -> list[str]:
        """Options that came to a class."""
        return [option for option, own in self.classes.items() if own == word]


@dataclass(frozen=True)
class StressMap(Plain):
    """A grid over a pair of quantities: classes and errors, rows by y, columns by x."""

    model: str
    x: str
    y: str
    xs: list[Value]
    ys: list[Value]
    classes: list[list[str | None]]
    errors: list[list[float | None]]


@dataclass(frozen=True)
class StressStudy(Plain):
    """One study: its points, and the edges and maps that they make."""

    READ: ClassVar = {
        "models": tuple, "quantities": several(WalkedQuantity.from_json), "points": several(StressPoint.from_json),
        "edges": several(StressEdge.read), "maps": several(StressMap.from_json),
    }  # fmt: skip

    name: str
    metric: str
    against: str
    within: float
    until: str
    models: tuple[str, ...]
    outlines: Mapping[str, str]
    quantities: tuple[WalkedQuantity, ...]
    points: tuple[StressPoint, ...] = ()
    edges: tuple[StressEdge, ...] = ()
    maps: tuple[StressMap, ...] = ()

    def edges_of(self, model: str, quantity: str) -> list[StressEdge]:
        """Those of a model along a quantity, the last of each direction."""
        return list({e.direction: e for e in self.edges if (e.model, e.quantity) == (model, quantity)}.values())


@dataclass(frozen=True)
class StressSummary(Plain):
    """How many points there are, of each class, and of those that are wrong without a word."""

    points: int
    classes: Mapping[str, int] = field(default_factory=dict)
    silent: int = 0


@dataclass(frozen=True)
class Stress(Plain):
    """What stability studies found."""

    READ: ClassVar = {"studies": several(StressStudy.from_json), "summary": StressSummary.from_json}

    created: str
    environment: Mapping[str, Any]
    command: str
    scene: Mapping[str, Any]
    studies: tuple[StressStudy, ...]
    summary: StressSummary

    @classmethod
    def of(cls, created: str, environment: Mapping[str, Any], command: str, scene: Mapping[str, Any],
           studies: tuple[StressStudy, ...]) -> Self:  # fmt: skip
        """With their points counted."""
        counts = Counter(p.found.word for s in studies for p in s.points)
        summary = StressSummary(counts.total(), {word: counts[word] for word in CLASSES}, counts["silent"])
        return cls(created, environment, command, scene, studies, summary)

    @property
    def points(self) -> list[StressPoint]:
        """Those of all studies."""
        return [p for s in self.studies for p in s.points]

    @property
    def silent(self) -> list[StressPoint]:
        """Points that look right and are wrong: there should be none."""
        return [p for p in self.points if p.found.word == "silent"]

    @property
    def exit_status(self) -> int:
        """1 where a point is silent, else 0: that a model has an edge is no failure."""
        return 1 if self.silent else 0

    def entries(self) -> Mapping[str, object]:
        """As `softmark-stress/1`."""
        return {"schema": SCHEMA, **super().entries()}

    def dumps(self) -> str:
        """The JSON text."""
        return json.dumps(self.to_json(), indent=1, allow_nan=False, ensure_ascii=False) + "\n"
