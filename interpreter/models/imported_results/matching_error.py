"""Exception for result files that cannot be matched to a body."""

from __future__ import annotations

SAME = 1e-6  # of the extent: nearer points count as coincident


class Unmatched(Exception):
    """Error that a result file cannot be matched to a body, with a reason and a remedy for users."""

    def __init__(self, reason: str, remedy: str) -> None:
        super().__init__(f"{reason}; {remedy}")
        self.reason, self.remedy = reason, remedy
