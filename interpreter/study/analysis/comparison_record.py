"""A whole comparison as values: what its page and its table are made from, and what it says."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from softmark.interpreter.results.json_records import Json, by_name
from softmark.interpreter.study.analysis.comparison_analysis import Analysis, References, Terms, analyse
from softmark.interpreter.study.analysis.comparison_point import ComparedPoint
from softmark.interpreter.study.analysis.study_results import studies_from_json
from softmark.interpreter.study.configurations.task_outcome import SolvedReference
from softmark.records import dataclass


@dataclass(frozen=True)
class Compared:
    """The points of a comparison with all that they are measured from, and what is found about them."""

    points: Sequence[ComparedPoint]
    references: Mapping[str, References]  # by parts
    analysis: Analysis
    scenes: Sequence[Json]  # title, name, file, sha256, text and what it was made with, as the report of a run has them
    environment: Json
    command: str
    created: str

    @classmethod
    def from_json(cls, saved: Json, terms: Terms | None = None) -> Compared:
        """From a `softmark-compare/1`, analysed anew; `terms` are those of its own analysis if they are not given."""
        points = [ComparedPoint.from_json(p) for p in saved.get("points") or ()]
        references = {
            part: by_name(SolvedReference.from_json)(own) for part, own in (saved.get("references") or {}).items()
        }
        studies = {scene: studies_from_json(own) for scene, own in (saved.get("studies") or {}).items()}
        terms = terms or Terms.from_json((saved.get("analysis") or {}).get("options"))
        command, environment = saved.get("command") or "", saved.get("environment") or {}
        return cls(
            points, references, analyse(points, references, studies, terms), list(saved.get("scenes") or ()),
            environment, " ".join(command) if isinstance(command, list) else str(command),
            str(saved.get("created") or environment.get("started") or ""),
        )  # fmt: skip
