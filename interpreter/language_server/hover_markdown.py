"""What the dictionary says, as Markdown: formulas stay as they are written."""

from __future__ import annotations

import inspect
import re

from softmark.interpreter.help.word_pages import facts
from softmark.interpreter.language.field_schema import Constructor


def prose(text: str) -> str:
    """Plain text: stars, lines and brackets mean nothing, but for words in backquotes; lines of formulas are kept."""
    parts = re.split(r"(`[^`\n]+`)", text)
    return "".join(part if i % 2 else re.sub(r"([\\*_<>\[\]#|])", r"\\\1", part) for i, part in enumerate(parts))


def constructor(c: Constructor) -> str:
    """What it is, and its fields."""
    said = prose(inspect.getdoc(c.cls) or "")
    fields = "\n".join(f"- `{f.name}`: {prose(f.doc + facts(f))}" for f in c.fields)
    return f"`{c.name}` ({c.kind})\n\n{said}" + (f"\n\n{fields}" if fields else "")
