"""Exception of a metric that has no value."""

from __future__ import annotations


class Undefined(Exception):
    """The metric has no value here; the text gives the reason."""
