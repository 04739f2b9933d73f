"""What the watchdog says where it has no formula of its own."""

from __future__ import annotations


class Unchecked(Exception):
    """There is no independent formula for what was solved."""
