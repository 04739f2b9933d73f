"""A plugin that cannot be used."""

from somewhere_else import Metric  # which is not there

SOFTMARK = {"metrics": {"sway": "Sway"}}


class Sway(Metric):
    """How far the farthest point of a probe goes sideways."""
