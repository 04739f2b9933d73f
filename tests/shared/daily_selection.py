"""Choice of slow tests: a seventh of the cases of each slow sweep is run a day, all in a week or by SOFTMARK_WHOLE=1.

A sweep is one test with three slow cases or more, be they drawn or listed: they look for exceptions to one law, which
its first cases hold up already. SOFTMARK_DAY=2026-11-23 walks again what was walked on a day. Reports of scenes are no
sweep: each scene is judged every time, but for those that take longest, of which each has its day; and so have other
tests that take over five seconds of CPU, which are marked `long`.
"""

from __future__ import annotations

import os
from collections import defaultdict
from collections.abc import Callable
from datetime import date

import pytest

PARTS = 7  # days in which all cases are walked
MANY = 3  # cases of a sweep
WHOLE = bool(os.environ.get("SOFTMARK_WHOLE"))
DAY = date.fromisoformat(os.environ.setdefault("SOFTMARK_DAY", date.today().isoformat()))  # workers get it, at midnight
TODAY = DAY.toordinal() % PARTS
LONGEST = (  # scenes that run for some ten seconds of CPU or more, by their day of the week: at most 180 s a day
    {"ironing", "balloon", "bar-on-a-wall"},
    {"silicone-beam-as-published", "carved-bodies", "confined-compression", "mandels-slab", "actuator"},
    {"half-spheres", "sphere-on-gel", "sliding-block", "creeping-cantilevers", "ringing-cylinder"},
    {"silicone-beam-by-others", "beam-let-go-by-others", "pin-on-a-membrane", "pin", "consolidation"},
    {"silicone-beam-scanned", "silicone-beam-filled", "silicone-beam-refined", "plate-on-a-column", "pressure-vessels"},
    {"silicone-beam-release", "sphere-by-force", "heart-beam", "indentation", "unconfined-disc", "cooks-membrane"},
    {"ventricle-contracting", "ventricle-inflated", "spherical-inclusion", "torsion", "pressed-blocks"},
)


def waiting(slow: list[pytest.Item], scene_of: Callable[[str], str]) -> set[pytest.Item]:
    """Those of all slow tests that are not walked today."""
    sweeps: dict[str, list[pytest.Item]] = defaultdict(list)
    later = set()
    for item in slow:
        if item.get_closest_marker("long"):
            sweeps["long"].append(item)
        elif "report_of" not in getattr(item, "fixturenames", ()):
            sweeps[item.nodeid.partition("[")[0]].append(item)
        elif any(scene_of(item.nodeid) in scenes for day, scenes in enumerate(LONGEST) if day != TODAY):
            later.add(item)
    for cases in sweeps.values():
        if len(cases) >= MANY:
            later.update(case for i, case in enumerate(cases) if i % PARTS != TODAY)
    return later
