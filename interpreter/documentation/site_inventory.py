"""Locations of pages, words, messages and shipped scenes on a built site, read from Sphinx's inventory file."""

from __future__ import annotations

import zlib
from pathlib import Path

INVENTORY = "objects.inv"
HEAD = 4  # number of lines before the compressed part


def anchors_by_name(folder: Path) -> dict[str, str]:
    """Return the file and anchor of every name on the site in `folder`.

    If pages, words, messages and scenes share a name, the first of these kinds gets it. If a word has several kinds,
    such as `surface (probe)`, the bare name leads to the first one.
    """
    data = (folder / INVENTORY).read_bytes().split(b"\n", HEAD)[HEAD]
    found: dict[str, str] = {}
    rest: dict[str, str] = {}
    for line in zlib.decompress(data).decode("utf-8").splitlines():
        name, _, tail = line.partition(" std:")
        role, _, place, _ = tail.split(" ", 3)
        where = place[:-1] + name if place.endswith("$") else place
        if role == "doc":
            found[name.removesuffix("/index")] = where
        elif role in ("word", "message", "scene"):
            rest[name] = where
            rest.setdefault(name.partition(" (")[0], where)
    return {**rest, **found}
