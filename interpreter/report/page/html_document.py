"""Self-contained HTML document, shared by the pages of runs and comparisons."""

from __future__ import annotations

import re
from collections.abc import Sequence
from datetime import datetime
from functools import lru_cache
from importlib.resources import files

from softmark.interpreter.report.page.figure_frame import toggles
from softmark.interpreter.report.page.html_markup import tag, text

POLICY = "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src data:"
_HEADING = re.compile(r"<h2[^>]*>(.*?)</h2>", re.DOTALL)
_WITH = re.compile(r"// with (\S+)$", re.MULTILINE)
FOOTER = "Made by softmark. Colours after Okabe and Ito (2008). All numbers in full, in SI, are in {}."


def document(
    title: str,
    description: str,
    header: str,
    sections: Sequence[tuple[str, str]],
    numbers: str,
    curves: int,
    styles: Sequence[str],
    scripts: Sequence[str],
) -> str:
    """Return a complete HTML5 document of `sections` (id, markup), with links to the headings of non-empty ones.

    `numbers` is the file with all numbers, `curves` the largest number of curves that a figure can show and hide;
    `styles` and `scripts` are files of this package to include.
    """
    items = [tag("li", tag("a", _heading(markup), href=f"#{key}")) for key, markup in sections if markup]
    body = tag(
        "body",
        tag("a", "Skip to the results", href="#content", class_="skip"),
        header,
        tag("nav", tag("ul", *items), aria_label="Sections"),
        tag("main", *(f"\n{markup}\n" for _, markup in sections), id="content"),
        tag("footer", tag("p", text(FOOTER.format(numbers)))),
        _scripts(scripts),
    )
    return _whole(_head(title, description, curves, styles), body)


def excerpt(title: str, curves: int, content: str, styles: Sequence[str], scripts: Sequence[str]) -> str:
    """Return a complete document with only `content`, for a frame in another page: no header, links or footer."""
    return _whole(_head(title, title, curves, styles), tag("body", tag("main", content), _scripts(scripts)))


def _whole(head: str, body: str) -> str:
    return "<!DOCTYPE html>\n" + tag("html", head, body, lang="en") + "\n"


def _head(title: str, description: str, curves: int, styles: Sequence[str]) -> str:
    return tag(
        "head",
        tag("meta", charset="utf-8"),
        tag("meta", http_equiv="Content-Security-Policy", content=POLICY),
        tag("meta", name="viewport", content="width=device-width, initial-scale=1"),
        tag("meta", name="color-scheme", content="light dark"),
        tag("meta", name="description", content=description),
        tag("title", text(title)),
        tag("style", *(part(name) for name in styles), toggles(curves)),
    )


def _scripts(names: Sequence[str]) -> str:
    return tag("script", *(part(name, tuple(names)) for name in names))


def _heading(markup: str) -> str:
    """Return the heading of a section as markup."""
    found = _HEADING.search(markup)
    return found[1] if found else ""


@lru_cache(maxsize=8)
def part(name: str, beside: tuple[str, ...] = ()) -> str:
    """Return a file of this package, without lines ending in `// with OTHER` if OTHER is not included."""
    lines = files(__package__ or "").joinpath(name).read_text(encoding="utf-8").splitlines(keepends=True)
    return "".join(line for line in lines if (other := _WITH.search(line)) is None or other[1] in beside)


def moment(written: str) -> str:
    """Return a time element in words; the text itself if it is not a date."""
    words = in_words(written)
    return text(written) if words == written else tag("time", words, datetime=written)


def in_words(written: str) -> str:
    """Return `23 November 2026, 17:54 UTC`; the text itself if it is not a date."""
    try:
        found = datetime.fromisoformat(written)
    except ValueError:
        return written
    zone = " UTC" if not found.utcoffset() else found.strftime(" UTC%z")
    return f"{found.day} {found.strftime('%B %Y, %H:%M')}{zone}"
