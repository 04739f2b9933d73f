"""The elements that meshes are made of; others are refused by name."""

from __future__ import annotations

MESHABLE = ("tet4", "tet10", "hex8")


class UnknownElement(ValueError):
    """No mesh is known for an element; the message has its name."""


def meshable(kind: str) -> None:
    """Raises UnknownElement for an element that meshes are not made of."""
    if kind not in MESHABLE:
        raise UnknownElement(f"no mesh is made of `{kind}`: meshes are of {', '.join(MESHABLE)}")
