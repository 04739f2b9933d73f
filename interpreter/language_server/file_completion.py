"""Completion of file names in quotes: scenes after `use`, files of fields, and data sets."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

from lsprotocol.types import CompletionItemKind as Kind

from softmark.interpreter.language.scene_sources import SUFFIX
from softmark.interpreter.language_server.completion_items import CompletionOffer
from softmark.interpreter.language_server.cursor_context import CursorContext
from softmark.scenes import ROOT

MOST = 500  # maximum number of names of a folder


def complete_file_names(here: CursorContext) -> Iterator[CompletionOffer]:
    """Yield completions of an incomplete file name, each as a whole name.

    Editors treat `/` as the end of a word.
    """
    frame = here.call
    if here.kind == "use" and len(here.before) == 1:
        yield from _scenes(here)
    elif frame is not None and frame.field is not None and frame.field.form in ("file", "files"):
        yield from _matching_files(here.document.folder, here.text or "", "")
        yield from _data_sets()


def _scenes(here: CursorContext) -> Iterator[CompletionOffer]:
    for file in sorted(ROOT.rglob(f"*{SUFFIX}")):
        name = file.relative_to(ROOT)
        if name.parts[0] != "templates":
            yield CompletionOffer(f"std/{name.as_posix()}", Kind.File, "standard library")
    yield from _matching_files(here.document.folder, here.text or "", SUFFIX)


def _matching_files(folder: Path, begun: str, suffix: str) -> Iterator[CompletionOffer]:
    """Yield files and folders in a folder whose names start like `begun` and end in `suffix`."""
    inner = begun.rpartition("/")[0]
    try:
        with os.scandir(folder / inner) as found:
            entries = sorted((e for _, e in zip(range(MOST), found, strict=False)), key=lambda e: e.name)
            for entry in entries:
                name = f"{inner}/{entry.name}" if inner else entry.name
                if entry.is_dir():
                    yield CompletionOffer(f"{name}/", Kind.Folder)
                elif entry.name.endswith(suffix):
                    yield CompletionOffer(name, Kind.File)
    except (OSError, ValueError):
        return


def _data_sets() -> Iterator[CompletionOffer]:
    from softmark.references.data_download import TABLE

    for name in TABLE:
        yield CompletionOffer(f"data:{name}", Kind.File, "public data set")
