"""Of sweeps with many slow cases a third is run each day: what is walked today, and by SOFTMARK_WHOLE=1 all.

A sweep is one test with three slow cases or more, be they drawn or listed: they look for exceptions to one law, which
its first cases hold up already. SOFTMARK_DAY=2026-11-23 walks again what was walked on a day. Reports of scenes are no
sweep: each scene is judged every time.
"""

from __future__ import annotations

import os
from collections import defaultdict
from datetime import date

import pytest

PARTS = 3  # days in which all cases are walked
WHOLE = "SOFTMARK_WHOLE" in os.environ
DAY = date.fromisoformat(
    os.environ.setdefault("SOFTMARK_DAY", date.today().isoformat())
)  # workers are told, at midnight too
TODAY = DAY.toordinal() % PARTS


def waiting(slow: list[pytest.Item]) -> set[pytest.Item]:
    """Those of all slow tests that are not walked today."""
    sweeps: dict[str, list[pytest.Item]] = defaultdict(list)
    for item in slow:
        if "report_of" not in getattr(item, "fixturenames", ()):
            sweeps[item.nodeid.partition("[")[0]].append(item)
    return {c for cases in sweeps.values() if len(cases) >= PARTS for i, c in enumerate(cases) if i % PARTS != TODAY}
