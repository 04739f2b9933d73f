"""Builder of the documentation site: collects the pages and converts them with Sphinx. Needs the extra `docs`.

`site()` caches the result under a digest of all pages, so each version is built only once.
"""

from __future__ import annotations

import hashlib
import io
import os
import re
import shutil
import tempfile
from collections.abc import Callable, Iterator
from importlib.util import find_spec
from pathlib import Path

from softmark.records import dataclass

ROOM = Path(__file__).parent
OTHERS = "reference/others.md"
NEEDED = ("sphinx", "myst_parser", "furo")
COLOUR = re.compile(r"\x1b\[[0-9;]*m")  # colour codes in the output of Sphinx
UNWRITTEN = "error writing file "  # start of Sphinx's warning about a page that could not be written completely
INSTALL = 'pip install "softmark[docs]"'


class Unavailable(Exception):
    """Error when the site cannot be built here; the text gives the reason and the remedy."""


@dataclass(frozen=True)
class BuiltSite:
    """A built site: its folder, whether it came from the cache, and the warnings of Sphinx."""

    folder: Path
    kept: bool
    warnings: tuple[str, ...] = ()


def sources() -> dict[str, bytes]:
    """Return the content of every file that Sphinx reads, by path: written and generated pages."""
    from softmark.interpreter.documentation import foreign_word_pages, message_reference, scene_gallery, word_reference

    written = {f.relative_to(ROOM).as_posix(): f.read_bytes() for f in _written_pages()}
    made = {
        **word_reference.pages(),
        OTHERS: foreign_word_pages.page(),
        **message_reference.pages(),
        **scene_gallery.pages(),
    }
    return written | {path: text.encode() for path, text in made.items()}


def _written_pages() -> Iterator[Path]:
    yield from sorted(f for f in ROOM.glob("*.md") if f.name != "README.md")
    yield from sorted(f for f in (ROOM / "pictures").rglob("*.*"))
    yield from sorted((ROOM / "_static").glob("*.css"))


def build(folder: Path, found: dict[str, bytes]) -> tuple[str, ...]:
    """Build the site from the files `found` (content by path) into a folder and return the warnings of Sphinx.

    Raises Unavailable if the extra `docs` is missing, and OSError if a page cannot be written, about which Sphinx only
    warns.
    """
    require_sphinx()
    from sphinx.application import Sphinx
    from sphinx.util.docutils import docutils_namespace

    from softmark.interpreter.documentation.sphinx_settings import SETTINGS

    warned = io.StringIO()
    with tempfile.TemporaryDirectory() as scratch, docutils_namespace():
        source = Path(scratch) / "source"
        for path, data in found.items():
            (source / path).parent.mkdir(parents=True, exist_ok=True)
            (source / path).write_bytes(data)
        app = Sphinx(
            source,
            None,
            folder,
            Path(scratch) / "doctrees",
            "html",
            confoverrides=SETTINGS,
            status=None,
            warning=warned,
        )
        app.build()
    said = COLOUR.sub("", warned.getvalue()).replace(str(source) + os.sep, "")
    lines = tuple(line for line in said.splitlines() if line.strip())
    if failed := next((line for line in lines if UNWRITTEN in line), None):
        raise OSError(None, failed.partition(UNWRITTEN)[2])
    return lines


def require_sphinx() -> None:
    """Check that the extra `docs` is installed. Raises Unavailable with the install command."""
    if missing := [name for name in NEEDED if find_spec(name) is None]:
        raise Unavailable(f"the pages are built by Sphinx, and {' and '.join(missing)} is not installed: {INSTALL}")


def digest(found: dict[str, bytes]) -> str:
    """Return the identifier of a site: a digest of its files and the versions of the build tools."""
    from importlib.metadata import PackageNotFoundError, version

    told = hashlib.sha256()
    for name in NEEDED:
        try:
            told.update(f"{name} {version(name.replace('_', '-'))}\n".encode())
        except PackageNotFoundError:
            continue
    for code in (ROOM / name for name in ("sphinx_settings.py", "sphinx_extension.py", "mathml.py")):
        told.update(code.read_bytes())
    for path in sorted(found):
        told.update(path.encode() + b"\0" + found[path] + b"\0")
    return told.hexdigest()[:16]


def cache_folder() -> Path:
    """Return the folder of cached sites, $XDG_CACHE_HOME/softmark/docs.

    Raises Unavailable without a cache or home folder.
    """
    try:
        return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "softmark" / "docs"
    except RuntimeError as error:
        raise Unavailable("there is no home folder for the pages; give a folder with `--out DIR`") from error


def site(before: Callable[[], None] = lambda: None) -> BuiltSite:
    """Return the site of this version, from the cache or newly built.

    Before a build `before` is called; after it cached sites of other versions are removed. Raises Unavailable if the
    extra `docs` is missing, and OSError if files cannot be written.
    """
    found = sources()
    home = cache_folder()
    folder = home / digest(found)
    if (folder / "index.html").is_file():
        return BuiltSite(folder, True)
    require_sphinx()
    before()
    home.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=home) as scratch:
        warnings = build(Path(scratch) / "site", found)
        shutil.rmtree(folder, ignore_errors=True)
        (Path(scratch) / "site").rename(folder)
    for other in home.iterdir():
        if other != folder and other.is_dir():
            shutil.rmtree(other, ignore_errors=True)
    return BuiltSite(folder, False, warnings)
