"""Descriptions of constructors and fields as Markdown; formulas keep their layout."""

from __future__ import annotations

import inspect
import re

from softmark.interpreter.help.word_pages import field_facts
from softmark.interpreter.language.field_schema import Constructor


def prose(text: str) -> str:
    """Escape plain text for Markdown, except words in backquotes; lines of formulas are kept."""
    parts = re.split(r"(`[^`\n]+`)", text)
    return "".join(part if i % 2 else re.sub(r"([\\*_<>\[\]#|])", r"\\\1", part) for i, part in enumerate(parts))


def constructor(c: Constructor) -> str:
    """Return the description of a constructor and its fields."""
    said = prose(inspect.getdoc(c.cls) or "")
    fields = "\n".join(f"- `{f.name}`: {prose(f.doc + field_facts(f))}" for f in c.fields)
    return f"`{c.name}` ({c.kind})\n\n{said}" + (f"\n\n{fields}" if fields else "")
