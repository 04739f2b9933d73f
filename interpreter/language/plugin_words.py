"""Words that others add: what is known of their file, and whose fault an exception is."""

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
    """A file of somebody else's with classes for words; what of it cannot be used is broken, and the rest stands."""

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


def blamed(error: BaseException) -> str | None:
    """The plugin in which an exception was raised, with its line; None of one that is nobody else's, or a refusal."""
    if type(error).__module__.startswith("softmark."):  # by which it says why it has no answer
        return None
    found, trace = None, error.__traceback__
    while trace is not None:
        if (name := FILES.get(trace.tb_frame.f_code.co_filename)) is not None:
            found = f"the plugin `{name}` failed in line {trace.tb_lineno}: {told(error)}"
        trace = trace.tb_next
    return found


def told(error: BaseException) -> str:
    """`ZeroDivisionError: division by zero`, on one line."""
    text = " ".join(str(error).split())
    return f"{type(error).__name__}: {text}" if text else type(error).__name__
