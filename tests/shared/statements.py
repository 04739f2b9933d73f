"""The statements of a source file, without what stands within their expressions: a tenth of `ast.walk`."""

from __future__ import annotations

import ast
from collections.abc import Iterator

BLOCKS = ("body", "orelse", "finalbody", "handlers", "cases")  # where statements hold statements


def statements(node: ast.AST) -> Iterator[ast.AST]:
    """Of a module, a function or any other block, wherever they stand."""
    for name in BLOCKS:
        inner = getattr(node, name, ())
        for each in inner if isinstance(inner, list) else ():  # a lambda's body is an expression
            yield each
            yield from statements(each)
