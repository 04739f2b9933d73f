"""Plugins: their files, and the attribution of exceptions to them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from typing import Any

from softmark.grammar.diagnostic import Diagnostic
from softmark.records import dataclass

Word = tuple[str, str]  # kind of declaration, and the word itself
FILES: dict[str, str] = {}  # of every plugin that was loaded: its file, and what it is called


@dataclass(frozen=True)
class Plugin:
    """Plugin file with classes for constructors; broken ones are listed, and the others can be used."""

    asked: str  # what it is loaded by, from any folder: its whole path, or the name that it is installed by
    name: str  # as messages call it
    file: str
    sha256: str  # of its text
    words: Mapping[str, Mapping[str, Any]]  # by kind
    broken: Mapping[Word, str]  # why a word of it cannot be used
    unread: str = ""  # why nothing is known of its words
    choices: Mapping[tuple[str, str, str], tuple[str, ...]] = field(default_factory=dict)  # of (kind, word, field)
    examples: Mapping[str, str] = field(default_factory=dict)  # of its words: a call that `dsl conformance` tries
    doubts: tuple[Diagnostic, ...] = ()  # all that is wrong with it, at its place


def find_faulty_plugin(error: BaseException) -> str | None:
    """Return the plugin that raised an exception, with its line; None if it came from our code or is a refusal."""
    if type(error).__module__.startswith("softmark."):  # by which it says why it has no answer
        return None
    found, trace = None, error.__traceback__
    while trace is not None:
        if (name := FILES.get(trace.tb_frame.f_code.co_filename)) is not None:
            found = f"the plugin `{name}` failed in line {trace.tb_lineno}: {format_exception(error)}"
        trace = trace.tb_next
    return found


def format_exception(error: BaseException) -> str:
    """Format an exception on one line: `ZeroDivisionError: division by zero`."""
    text = " ".join(str(error).split())
    return f"{type(error).__name__}: {text}" if text else type(error).__name__
