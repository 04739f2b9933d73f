"""Loaded plugins, and the search for the plugin that raised an exception."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from typing import Any

from softmark.grammar.diagnostic import Diagnostic
from softmark.records import dataclass

Word = tuple[str, str]  # kind of declaration, and the word itself
FILES: dict[str, str] = {}  # file and name of every loaded plugin


@dataclass(frozen=True)
class Plugin:
    """Loaded plugin file with its constructor classes; unusable classes are listed, and the others can be used."""

    asked: str  # its absolute path or installed name, valid in any folder
    name: str  # name in messages
    file: str
    sha256: str  # digest of its text
    words: Mapping[str, Mapping[str, Any]]  # by kind
    broken: Mapping[Word, str]  # reason why a word cannot be used
    unread: str = ""  # reason why the file could not be read
    choices: Mapping[tuple[str, str, str], tuple[str, ...]] = field(default_factory=dict)  # of (kind, word, field)
    examples: Mapping[str, str] = field(default_factory=dict)  # example calls of its words for `dsl conformance`
    doubts: tuple[Diagnostic, ...] = ()  # all errors in it, with their places


def find_faulty_plugin(error: BaseException) -> str | None:
    """Return the plugin that raised an exception, with the line; None for built-in code and for intended refusals."""
    if type(error).__module__.startswith("softmark."):  # refusals are exceptions of softmark
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
