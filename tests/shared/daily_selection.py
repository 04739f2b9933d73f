"""Choice of slow tests: a tenth of the cases of each slow sweep is run a day, all in ten days or by SOFTMARK_WHOLE=1.

A sweep is a test with three slow cases or more. Its cases look for exceptions to a law that the quick cases confirm
already. A sweep of more than `LARGE` cases takes twenty days. SOFTMARK_DAY=2026-11-23 runs the cases of that day again.
Each scene of the library is run every day, except those that take longest, each of which has a day of the week. Tests
that take more than about half a second are marked `long` and have one day in ten each.
"""

from __future__ import annotations

import os
from collections import defaultdict
from collections.abc import Callable
from datetime import date
from zlib import crc32

import pytest

PARTS = 10  # days in which all cases are run
MANY = 3  # cases of a sweep
LARGE = 60  # cases of a sweep that takes twice as many days
WHOLE = bool(os.environ.get("SOFTMARK_WHOLE"))
DAY = date.fromisoformat(os.environ.setdefault("SOFTMARK_DAY", date.today().isoformat()))  # workers get it, at midnight
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
    """Return those of all slow tests that are not run today."""
    today = DAY.toordinal()
    sweeps: dict[str, list[pytest.Item]] = defaultdict(list)
    later = set()
    for item in slow:
        if item.get_closest_marker("long"):
            sweeps["long"].append(item)
        elif "report_of" not in getattr(item, "fixturenames", ()):
            sweeps[item.nodeid.partition("[")[0]].append(item)
        elif any(scene_of(item.nodeid) in scenes for day, scenes in enumerate(LONGEST) if day != today % len(LONGEST)):
            later.add(item)
    for name, cases in sweeps.items():
        days = 2 * PARTS if len(cases) > LARGE and name != "long" else PARTS
        if len(cases) >= MANY:
            first = today + crc32(name.encode())  # sweeps begin on different days, so that days are alike
            later.update(case for i, case in enumerate(cases) if (i + first) % days)
    return later
