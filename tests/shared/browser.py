"""Pages in a browser: where Chromium is not on the PATH such tests are skipped, with that reason."""

from __future__ import annotations

import html
import json
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

CHROMIUM = shutil.which("chromium")
needs_chromium = pytest.mark.skipif(CHROMIUM is None, reason="chromium is not on the PATH")
FLAGS = (
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
    "--disable-background-networking", "--disable-component-update", "--disable-sync", "--hide-scrollbars",
    "--enable-logging=stderr", "--v=0", "--virtual-time-budget=2000",
)  # fmt: skip
# a loaded computer gives pictures later than the browser's virtual time ends: let them come by that time
TIMED = """<body><script>
window.requestAnimationFrame = (draw) => setTimeout(() => draw(performance.now()), 16);
</script>"""


def browse(page: Path, profile: Path, *flags: str) -> subprocess.CompletedProcess[str]:
    """Chromium on a page, with nothing on its console."""
    command_line = [str(CHROMIUM), *FLAGS, f"--user-data-dir={profile}", *flags, page.as_uri()]
    done = subprocess.run(command_line, capture_output=True, text=True, timeout=120, check=True)
    assert "CONSOLE" not in done.stderr, done.stderr
    return done


def noted(dom: str) -> Any:
    """What the probe of the page noted."""
    found = re.search(r'data-said="([^"]*)"', dom)
    assert found is not None, "the script of the page did not run"
    return json.loads(html.unescape(found[1]))
