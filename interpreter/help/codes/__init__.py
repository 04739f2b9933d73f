"""Explanation pages of diagnostic codes, such as `E204.md`, with a wrong and a right example.

The tests execute the examples.

To add a code: one page. Its first line is `# E204: title`. It has one ```wrong and one ```right block, each with a
complete scene. An example that needs more than `dsl check` starts with its command: `# $ dsl run FILE -p L=120mm`.
"""

from __future__ import annotations

import re
from functools import lru_cache
from pathlib import Path

from softmark.records import dataclass

FENCE = re.compile(r"^```(wrong|right)[^\n]*\n(.*?)^```$", re.MULTILINE | re.DOTALL)


@dataclass(frozen=True)
class Page:
    """Explanation page of one diagnostic code."""

    code: str
    title: str
    text: str

    def example(self, which: str) -> str:
        """Return the scene of one example of the page; `which` is `wrong` or `right`."""
        return next(str(body) for kind, body in FENCE.findall(self.text) if kind == which)


@lru_cache(maxsize=1)
def pages() -> dict[str, Page]:
    """Return all explanation pages, by code."""
    found = {}
    for file in sorted(Path(__file__).parent.glob("[EW]*.md")):
        text = file.read_text(encoding="utf-8")
        found[file.stem] = Page(file.stem, text.split("\n", 1)[0].partition(": ")[2], text.rstrip())
    return found
