"""Every shipped scene run, and run again from what was kept: the same report, and how little CPU that takes.

    python tests/benchmarks/kept.py [SCENE...]

Reports must be byte-identical but for the moment of the run and what says that results were kept. CPU seconds are those
of whole processes, user and system.
"""

from __future__ import annotations

import re
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

from softmark.interpreter.language.scene_sources import standard_scenes

SAID = (
    r'"started": "[^"]*"', r',\s*"kept": "[^"]*"', r'<p class="kept[^>]*>.*?</p>', r"<time[^>]*>[^<]*</time>",
    r"\d{4}-\d\d-\d\dT[0-9:+]*",
)  # fmt: skip


def cpu(command: list[str], folder: str) -> tuple[float, int, str]:
    """User and system seconds of a finished child, its status, and what it printed."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    spent = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return spent, done.returncode, done.stdout


def plain(file: Path) -> str:
    """A report without what may differ."""
    text = file.read_text(encoding="utf-8")
    for pattern in SAID:
        text = re.sub(pattern, "", text)
    return text


def main() -> None:
    names, worst = sys.argv[1:] or sorted(standard_scenes()), 0.0
    for name in names:
        with tempfile.TemporaryDirectory() as folder:
            command = [sys.executable, "-m", "softmark.interpreter", "run", name, "--out", "report"]
            first, status, _ = cpu(command, folder)
            files = [Path(folder) / "report" / f for f in ("report.json", "report.html")]
            if not all(f.exists() for f in files):
                print(f"{name:40} status {status}: no report")
                continue
            before = [plain(f) for f in files]
            again, status_again, printed = cpu(command, folder)
            whole = "reused from the run of" in printed and '"kept"' in files[0].read_text(encoding="utf-8")
            same = before == [plain(f) for f in files] and status == status_again
            size = sum(f.stat().st_size for f in (Path(folder) / "report").glob("kept/*")) / 1e6
            worst = max(worst, again if whole else 0.0)
            verdict = ("same" if same else "DIFFERS") if whole else "computed again"
            print(f"{name:40} {first:8.2f} s, again {again:6.2f} s, {size:7.2f} MB  {verdict}", flush=True)
    print(f"most CPU of a run from what was kept: {worst:.2f} s")


if __name__ == "__main__":
    main()
