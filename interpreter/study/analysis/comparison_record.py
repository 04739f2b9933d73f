"""Record of a whole comparison with its analysis, used by the page and the terminal table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from softmark.interpreter.results.json_records import Json, mapping_reader
from softmark.interpreter.study.analysis.comparison_analysis import Analysis, ComparisonTerms, References, analyse
from softmark.interpreter.study.analysis.comparison_point import ComparedPoint
from softmark.interpreter.study.analysis.study_results import studies_from_json
from softmark.interpreter.study.configurations.task_outcome import SolvedReference
from softmark.records import dataclass


@dataclass(frozen=True)
class ComparisonRecord:
    """Comparison read from JSON: the results of its configurations, their references, and the analysis."""

    points: Sequence[ComparedPoint]
    references: Mapping[str, References]  # by parts
    analysis: Analysis
    scenes: Sequence[Json]  # title, name, file, sha256, text and environment, as in the report of a run
    environment: Json
    command: str
    created: str

    @classmethod
    def from_json(cls, saved: Json, terms: ComparisonTerms | None = None) -> ComparisonRecord:
        """Read a saved `softmark-compare/1` and analyse it again.

        By default the settings are those of the saved analysis.
        """
        points = [ComparedPoint.from_json(p) for p in saved.get("points") or ()]
        references = {
            part: mapping_reader(SolvedReference.from_json)(own)
            for part, own in (saved.get("references") or {}).items()
        }
        studies = {scene: studies_from_json(own) for scene, own in (saved.get("studies") or {}).items()}
        terms = terms or ComparisonTerms.from_json((saved.get("analysis") or {}).get("options"))
        command, environment = saved.get("command") or "", saved.get("environment") or {}
        return cls(
            points, references, analyse(points, references, studies, terms), list(saved.get("scenes") or ()),
            environment, " ".join(command) if isinstance(command, list) else str(command),
            str(saved.get("created") or environment.get("started") or ""),
        )  # fmt: skip
