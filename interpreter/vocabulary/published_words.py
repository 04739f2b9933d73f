"""Numbers that others published for the same experiment, shown next to the models' results."""

from __future__ import annotations

from typing import Annotated, Any

from softmark.records import dataclass


@dataclass(frozen=True)
class Column:
    """One column of a published table: values of a metric for several models, in order.

    The report shows them next to our values, with the difference. They do not decide pass or fail; use `expect` for
    that.
    """

    metric: Annotated[str, "metric", "metric of this scene for the same quantity"]
    of: Annotated[tuple[str, ...], "models", "models, one for each value"]
    values: Annotated[Any, "values", "published values, in their original unit"]
    source: Annotated[str, "publication"]
