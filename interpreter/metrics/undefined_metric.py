"""What a metric raises where it has no value."""

from __future__ import annotations


class Undefined(Exception):
    """The metric has no value here; the text says why."""
