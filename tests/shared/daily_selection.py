"""Selection of the slow tests that run today; SOFTMARK_WHOLE=1 selects all of them.

A test with three slow cases or more runs one tenth of its cases each day, so that all cases run within ten days. If it
has more than `LARGE` cases, it runs one twentieth. Scenes of the library run every day, except the `LONGEST`, which
have one day of the week each. Tests marked `long` take more than about half a second; each of them runs on one day in
ten. SOFTMARK_DAY=2026-11-23 repeats the selection of that day.
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


def tests_not_run_today(slow: list[pytest.Item], scene_of: Callable[[str], str]) -> set[pytest.Item]:
    """Return the slow tests that do not run today. `scene_of` maps the id of a test to the name of its scene."""
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
