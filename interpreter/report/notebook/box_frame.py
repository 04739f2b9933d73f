"""Frame of a notebook display: isolated styles, and an inner frame for content that scripts draw."""

from __future__ import annotations

from collections.abc import Sequence

from softmark.interpreter.report.page.html_document import frame_document, load_asset
from softmark.interpreter.report.page.html_markup import prose, tag, text

LARGEST = 1_000_000  # characters of one output; more is left out with a note
ROWS = 40  # largest number of rows of a table
SIGNS = {"good": "✓", "bad": "✗", "warn": "…", "quiet": "–"}


def render_box(title: str, *content: str) -> str:
    """Return the display with its title and content as HTML; `content` is markup."""
    heading = tag("p", text(title), class_="title")
    return tag("div", tag("style", load_asset("inline.css")), heading, *content, class_="softmark")


def verdict(mood: str, words: str) -> str:
    """Return a line of HTML with a symbol for `mood` and the outcome in words."""
    return tag("p", tag("span", SIGNS[mood], aria_hidden="true"), " ", prose(words), class_=f"verdict {mood}")


def isolated_frame(label: str, markup: str, styles: Sequence[str], scripts: Sequence[str], curves: int = 0) -> str:
    """Return markup with its scripts as a document in an HTML frame, which is as high as its content."""
    own = frame_document(label, curves, markup, [*styles, "frame.css"], [*scripts, "frame.js"])
    return tag("iframe", srcdoc=own, title=label, loading="lazy", width="100%", height="640")


def drawing_or_note(drawn: str, rest: str, where: str) -> str:
    """Return the HTML `drawn` if it has, together with the HTML `rest`, at most LARGEST characters.

    Otherwise return a sentence that the drawing is too large, and that the program or file `where` shows it.
    """
    if len(drawn) + len(rest) <= LARGEST:
        return drawn
    size = f"{len(drawn) / 1e6:.1f} of at most {LARGEST / 1e6:.0f} million characters"
    return tag("p", prose(f"The drawing is too large to show here: {size}. {where} shows it."), class_="quiet")


def table(label: str, head: Sequence[str], rows: Sequence[str]) -> str:
    """Return a scrolling HTML table; `head` is plain text, `rows` are markup."""
    top = tag("thead", tag("tr", *(tag("th", prose(word), scope="col") for word in head)))
    own = tag("table", top, tag("tbody", *rows))
    return tag("div", own, class_="scroll", tabindex=0, role="region", aria_label=label)
