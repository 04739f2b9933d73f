"""Results of robustness studies as records of the schema `softmark-stress/1`, written and read only here."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping
from dataclasses import field, fields, replace
from typing import Any, ClassVar, Self

from softmark.interpreter.planning.varied_quantities import Value, WalkedQuantity
from softmark.interpreter.results.error_statements import StatedError
from softmark.interpreter.results.json_records import JsonRecord, list_reader
from softmark.records import dataclass

SCHEMA = "softmark-stress/1"
CLASSES = (
    "right", "inaccurate", "silent", "not_converged", "diverged", "refused", "failed", "timed_out", "unjudged"
)  # fmt: skip
WORST = ("silent", "failed", "timed_out", "diverged", "not_converged", "refused", "inaccurate", "unjudged")


@dataclass(frozen=True)
class ClassifiedPoint(JsonRecord):
    """Class of one result in a robustness study, such as right or wrong, with the numbers that decide the class.

    `uncertainty` is the relative uncertainty of the reference.
    """

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
        """Error that the model states for its result, or None."""
        return None if self.stated is None else self.stated.value


@dataclass(frozen=True)
class RobustnessPoint(JsonRecord):
    """One solved configuration of a robustness study: a model with changed values, and the class of its result."""

    model: str
    values: Mapping[str, Value]
    found: ClassifiedPoint
    texts: Mapping[str, str] = field(default_factory=dict)  # text of each value for an override
    key: str = ""
    cpu_s: float | None = None

    def entries(self) -> Mapping[str, object]:
        """Return the JSON entries of the configuration and of its class."""
        own = replace(self.found, status=None).entries()
        return {"key": self.key, "model": self.model, "values": self.values, "texts": self.texts, **own,
                "cpu_s": self.cpu_s}  # fmt: skip

    @classmethod
    def from_json(cls, own: Mapping[str, Any]) -> Self:
        """Read a solved configuration from its JSON entry."""
        texts = own.get("texts") or {}
        return cls(own["model"], own["values"], ClassifiedPoint.from_json(own), texts, own["key"], own.get("cpu_s"))


@dataclass(frozen=True)
class ValidityEdge(JsonRecord):
    """Validity edge of a model: the value of a quantity beyond which results are no longer right, for one direction.

    It also contains the class of the results beyond the edge.
    """

    NAMED: ClassVar = {"word": "class"}

    model: str
    quantity: str
    direction: str
    last_right: float | None = None
    first_wrong: float | None = None
    word: str | None = None  # class beyond the edge; None if right as far as tested
    last_answer: float | None = None
    first_silence: float | None = None
    silence: str | None = None  # the class there
    reason: str | None = None
    remedy: str | None = None
    reached: float | None = None
    here: str | None = None  # class of the unchanged scene
    first_right: float | None = None
    judged: int = 0  # points of the walk
    blind: int = 0  # unjudged points inside the right range
    first_unjudged: float | None = None

    @staticmethod
    def read(own: Mapping[str, Any]) -> ValidityEdge:
        """Read a validity edge from its JSON entry, which may be a ChoiceEdge."""
        return (ValidityEdge if own.get("right") is None else ChoiceEdge).from_json(own)

    @property
    def met(self) -> float | None:
        """First tested value at which the result has the class beyond the edge."""
        return self.first_unjudged if self.word == "unjudged" else self.first_wrong


ALIKE = [f.name for f in fields(ValidityEdge)].index("here")  # first entries, that edges and choices have


@dataclass(frozen=True)
class ChoiceEdge(ValidityEdge):
    """Validity edge of a quantity with discrete options: class of each option, and the worst class.

    A class states whether the result with an option is right.
    """

    right: tuple[str, ...] = ()
    classes: Mapping[str, str] = field(default_factory=dict)

    def entries(self) -> Mapping[str, object]:
        """Return the JSON entries without those that only numeric quantities have."""
        own = list(super().entries().items())[:ALIKE]
        return {**dict(own), "right": self.right, "wrong": self.wrong_options,
                "unjudged": self.options_of_class("unjudged"), "classes": self.classes}  # fmt: skip

    @classmethod
    def from_json(cls, own: Mapping[str, Any]) -> Self:
        """Read a choice from its JSON entry; entries of older versions lack the class of each option."""
        older = {**dict.fromkeys(own["right"], "right"), **dict.fromkeys(own.get("wrong") or (), own.get("class"))}
        found = super().from_json({**own, "classes": own.get("classes") or older})
        return replace(found, right=tuple(found.right))

    @property
    def wrong_options(self) -> list[str]:
        """Options with a judged result that is not right, the worst class first."""
        ranked = sorted((WORST.index(w), o) for o, w in self.classes.items() if w not in ("right", "unjudged"))
        return [option for _, option in ranked]

    def options_of_class(self, word: str) -> list[str]:
        """Return the options whose result has the class `word`."""
        return [option for option, own in self.classes.items() if own == word]


@dataclass(frozen=True)
class PairMap(JsonRecord):
    """Validity map: class and error of a model on a grid of values of two quantities, x in columns and y in rows."""

    model: str
    x: str
    y: str
    xs: list[Value]
    ys: list[Value]
    classes: list[list[str | None]]
    errors: list[list[float | None]]


@dataclass(frozen=True)
class RobustnessStudyRecord(JsonRecord):
    """Results of one robustness study: its solved configurations, validity edges and maps."""

    READ: ClassVar = {
        "models": tuple, "quantities": list_reader(WalkedQuantity.from_json),
        "points": list_reader(RobustnessPoint.from_json),
        "edges": list_reader(ValidityEdge.read), "maps": list_reader(PairMap.from_json),
    }  # fmt: skip

    name: str
    metric: str
    against: str
    within: float
    until: str
    models: tuple[str, ...]
    outlines: Mapping[str, str]
    quantities: tuple[WalkedQuantity, ...]
    points: tuple[RobustnessPoint, ...] = ()
    edges: tuple[ValidityEdge, ...] = ()
    maps: tuple[PairMap, ...] = ()

    def edges_of(self, model: str, quantity: str) -> list[ValidityEdge]:
        """Return the validity edges of a model along a quantity, one for each direction."""
        return list({e.direction: e for e in self.edges if (e.model, e.quantity) == (model, quantity)}.values())


@dataclass(frozen=True)
class RobustnessSummary(JsonRecord):
    """Numbers of solved configurations: all, in each class, and wrong without a warning."""

    points: int
    classes: Mapping[str, int] = field(default_factory=dict)
    silent: int = 0


@dataclass(frozen=True)
class Robustness(JsonRecord):
    """Results of the robustness studies of a scene."""

    READ: ClassVar = {"studies": list_reader(RobustnessStudyRecord.from_json), "summary": RobustnessSummary.from_json}

    created: str
    environment: Mapping[str, Any]
    command: str
    scene: Mapping[str, Any]
    studies: tuple[RobustnessStudyRecord, ...]
    summary: RobustnessSummary

    @classmethod
    def of(cls, created: str, environment: Mapping[str, Any], command: str, scene: Mapping[str, Any],
           studies: tuple[RobustnessStudyRecord, ...]) -> Self:  # fmt: skip
        """Return the record of some studies, with a summary of the numbers of their solved configurations."""
        counts = Counter(p.found.word for s in studies for p in s.points)
        summary = RobustnessSummary(counts.total(), {word: counts[word] for word in CLASSES}, counts["silent"])
        return cls(created, environment, command, scene, studies, summary)

    @property
    def points(self) -> list[RobustnessPoint]:
        """All solved configurations of all studies."""
        return [p for s in self.studies for p in s.points]

    @property
    def silent(self) -> list[RobustnessPoint]:
        """Configurations whose result is wrong without a warning; a good model has none."""
        return [p for p in self.points if p.found.word == "silent"]

    @property
    def exit_status(self) -> int:
        """Exit status: 1 if a result is wrong without a warning, else 0. A validity edge is no failure."""
        return 1 if self.silent else 0

    def entries(self) -> Mapping[str, object]:
        """Return the JSON entries of `softmark-stress/1`."""
        return {"schema": SCHEMA, **super().entries()}

    def dumps(self) -> str:
        """Return the record as JSON text."""
        return json.dumps(self.to_json(), indent=1, allow_nan=False, ensure_ascii=False) + "\n"
