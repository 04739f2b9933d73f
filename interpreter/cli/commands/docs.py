"""Command `dsl docs`: builds the documentation and opens it in a browser."""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path

from softmark.grammar.diagnostic import make_visible


def arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `dsl docs`: `[PAGE] [--out DIR] [--no-open]`."""
    parser.add_argument(
        "page", nargs="?", default="index", metavar="PAGE",
        help="a page, such as `tutorial` or `gallery`, a word, a message or a shipped scene",
    )  # fmt: skip
    parser.add_argument("--out", metavar="DIR", help="build the pages in this folder instead of the default one")
    parser.add_argument("--no-open", action="store_true", help="print the location of the page and open no browser")


def run(parsed: argparse.Namespace) -> int:
    """Build the pages if needed, print the address of a page, and open it in a browser."""
    from softmark.interpreter.documentation.site_builder import Unavailable, build, site, sources
    from softmark.interpreter.documentation.site_inventory import anchors_by_name
    from softmark.interpreter.results.atomic_files import refuse_link

    try:
        if parsed.out:
            folder = Path(parsed.out)
            for above, folders, files in os.walk(folder):  # Sphinx would follow symbolic links
                for name in (*folders, *files):
                    refuse_link(Path(above, name))
            build(folder, sources())
        else:
            folder = site(lambda: print("building the pages, once for each version ...", file=sys.stderr)).folder
    except Unavailable as error:
        print(make_visible(f"error: {error}"), file=sys.stderr)
        return 2
    except OSError as error:
        what = parsed.out or "the pages"
        print(make_visible(f"error: {what} cannot be written: {error.strerror or error}"), file=sys.stderr)
        return 2
    known = anchors_by_name(folder)
    if (place := known.get(parsed.page) or known.get(parsed.page.upper())) is None:
        print(make_visible(f"error: {_unknown_page_error(parsed.page, list(known))}"), file=sys.stderr)
        return 2
    file, _, part = place.partition("#")
    address = (folder / file).resolve().as_uri() + (f"#{part}" if part else "")
    print((folder / file).resolve())
    if not parsed.no_open:
        import webbrowser

        webbrowser.open(address)
    return 0


def _unknown_page_error(name: str, known: list[str]) -> str:
    from softmark.grammar.name_suggestions import nearest

    close = nearest(name, known)
    meant = f"did you mean `{close}`?" if close else "`dsl docs` opens the first page, which links to all"
    return f"there is no page of `{name}`; {meant}"
