"""What others published about the same experiment, to stand beside our own numbers."""

from __future__ import annotations

from typing import Annotated, Any

from softmark.records import dataclass


@dataclass(frozen=True)
class Column:
    """One column of a published table: values of a metric for some models, in their order.

    They are shown in the report beside ours with the difference, and judge nothing: an `expect` does that.
    """

    metric: Annotated[str, "metric", "the metric of this scene that measures the same"]
    of: Annotated[tuple[str, ...], "models", "the models, as many as values"]
    values: Annotated[Any, "values", "what was published, in the unit in which it was"]
    source: Annotated[str, "where it was published"]
