"""Where a name is on a site: a page, a word, a message or a shipped scene, by the inventory that Sphinx leaves."""

from __future__ import annotations

import zlib
from pathlib import Path

INVENTORY = "objects.inv"
HEAD = 4  # lines before what is compressed


def places(folder: Path) -> dict[str, str]:
    """The file, and the place on it, of everything that has a name; pages, then words, messages and scenes.

    Of a name of several kinds, `surface (probe)`, the first stands for the name alone.
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
