"""Safe reading of XML result files: trees without entities, and paths that stay within a folder."""

from __future__ import annotations

import warnings
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from softmark.interpreter.models.imported_results.readers.result_frames import AGAIN
from softmark.references.measured_data import Unreadable
from softmark.safe_files import path_within

DEEP = 50  # largest nesting depth of elements
ElementT = ElementTree.Element


def parse_xml(name: str, data: bytes, root: str) -> ElementT:
    """Return the XML tree of a file, whose root element must be `root`. Raises Unreadable.

    Only UTF-8 without a document type is accepted, because a document type can expand text or name other files.
    """
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise Unreadable(name, "it is not XML in UTF-8", AGAIN) from None
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise Unreadable(name, "it declares a document type or entities", "remove them: results do not need them")
    builder = _DepthLimitedBuilder(name)
    parser = ElementTree.XMLParser(target=builder)
    try:
        parser.feed(text)
        top = parser.close()
    except ElementTree.ParseError as error:
        raise Unreadable(name, f"it is not complete XML ({error})", AGAIN) from None
    if not isinstance(top, ElementT) or top.tag != root:
        raise Unreadable(name, f"it does not begin with `{root}`", AGAIN)
    return top


class _DepthLimitedBuilder(ElementTree.TreeBuilder):
    """Builder of XML trees with a limited nesting depth."""

    def __init__(self, name: str) -> None:
        super().__init__()
        self.name = name
        self.depth = 0

    def start(self, tag: str, attrs: dict[str, str], /) -> ElementT:
        """Open an element. Raises Unreadable if it is nested too deeply."""
        self.depth += 1
        if self.depth > DEEP:
            raise Unreadable(self.name, f"its elements are nested more than {DEEP} deep", AGAIN)
        return super().start(tag, attrs)

    def end(self, tag: str, /) -> ElementT:
        """Close the XML element that was opened last."""
        self.depth -= 1
        return super().end(tag)


def numbers(text: str, kind: str) -> NDArray[np.generic]:
    """Return numbers separated by blanks, as the type `kind`; floats are always in double precision.

    Raises ValueError and OverflowError.
    """
    if not text.strip():
        return np.empty(0, kind)
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # numpy only warns about text that is not a number
        try:
            found = np.fromstring(text, "f8" if kind[0] == "f" else "i8", sep=" ")
        except DeprecationWarning:
            raise ValueError("not all of its entries are numbers") from None
    if kind[0] == "f":
        return found
    if ((found < np.iinfo(kind).min) | (found.astype("f8") > np.iinfo(kind).max)).any():
        raise OverflowError("a number is out of range for its type")
    return found.astype(kind)


def resolve_within_folder(name: str, folder: Path, told: str) -> Path:
    """Return the file that a path names, which must lie in the folder or below. Raises Unreadable."""
    shown = told if len(told) < 80 else f"{told[:80]}..."
    remedy = "put all files into one folder, and write paths within it"
    try:
        return path_within(folder, told)
    except OSError as error:
        raise Unreadable(name, f"it refers to `{shown}`: {error.strerror}", remedy) from None
