"""HTML generation: `text` escapes attributes and text, and the other functions return markup."""

from __future__ import annotations

import html
import re

VOID = frozenset({"meta", "input", "br", "img", "link", "wbr"})


def text(value: object) -> str:
    """Return any value as escaped HTML text, with control characters as visible symbols.

    Escaped are `<`, `>`, `&` and quotes.
    """
    return html.escape(legible(value), quote=True)


def legible(value: object) -> str:
    """Return any value as text that HTML and XML allow, with control characters made visible."""
    return _CONTROL.sub(lambda match: _visible_symbol(match[0]), str(value))


# forbidden in HTML or XML: control characters but tab and line feed, surrogates, noncharacters; also characters
# that change the direction of the following text
_CONTROL = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069\ud800-\udfff\ufdd0-\ufdef\ufffe\uffff]")


def _visible_symbol(character: str) -> str:
    code = ord(character)
    return chr(0x2400 + code) if code < 0x20 else "\ufffd"


def tag(name: str, /, *content: str, **attributes: object) -> str:
    """Return an HTML element; `content` is markup.

    Attributes are given as `class_`, or `data_x` for `data-x`. An attribute that is None is omitted.
    """
    opening = "".join(_attribute(key, value) for key, value in attributes.items())
    if name in VOID:
        return f"<{name}{opening}>"
    return f"<{name}{opening}>{''.join(content)}</{name}>"


def _attribute(key: str, value: object) -> str:
    if value is None or value is False:
        return ""
    name = key.rstrip("_").replace("_", "-")
    return f" {name}" if value is True else f' {name}="{text(value)}"'


def wrappable_name(name: str) -> str:
    """Return the HTML of a name that the browser may wrap after underscores."""
    return text(name).replace("_", "_<wbr>")


_CODE = re.compile(r"`([^`\n]+)`")


def prose(message: str) -> str:
    """Return a message as HTML; text between backticks becomes code."""
    pieces = _CODE.split(message)  # plain, code, plain, code, ...
    return "".join(tag("code", text(piece)) if i % 2 else text(piece) for i, piece in enumerate(pieces))


def strip_backticks(message: str) -> str:
    """Return a message without its backticks, for titles and descriptions in plain text."""
    return _CODE.sub(r"\1", message)


def section(name: str, heading: str, *content: str) -> str:
    """Return an HTML section of the page with its heading."""
    title = tag("h2", text(heading), id=f"{name}-heading")
    return tag("section", title, *content, id=name, aria_labelledby=f"{name}-heading")


def count(n: int, noun: str) -> str:
    """Return a number with its noun in singular or plural, such as `1 model`, `4 models`."""
    return f"{n} {noun}" + ("" if n == 1 else "s")


def join_names(items: list[str]) -> str:
    """Return names as a list in words: `a`, `a and b`, `a, b and c`."""
    return " and ".join([", ".join(items[:-1]), items[-1]]) if len(items) > 1 else "".join(items)


def join_few_names(items: list[str], most: int = 8) -> str:
    """Return names like `join_names`; if there are more than `most`, `a, b and 9 others`."""
    few = items if len(items) <= most else [*items[: most - 1], f"{len(items) - most + 1} others"]
    return join_names(few)
