"""Gmsh's format 2.2: a cell in several physical groups is written once for each of them, and is one cell."""

from __future__ import annotations

from typing import Any

import numpy as np

PHYSICAL = "gmsh:physical"


def merged(data: Any) -> Any:
    """The same mesh with each such cell once; further groups of a cell are arrays `gmsh:physical 2` and so on.

    A cell that is given twice in the same group stays twice: that is a flaw of the mesh.
    """
    groups = data.cell_data.get(PHYSICAL)
    if groups is None:
        return data
    kept = [np.ones(len(block.data), dtype=np.bool_) for block in data.cells]
    extra: list[list[tuple[int, int, int]]] = []  # by layer: block, row and group
    for kind in {block.type for block in data.cells}:
        blocks = [i for i, block in enumerate(data.cells) if block.type == kind]
        rows = np.concatenate([data.cells[i].data for i in blocks])
        tags = np.concatenate([np.asarray(groups[i]) for i in blocks])
        if not len(rows):
            continue
        _, first, same, counts = np.unique(rows, axis=0, return_index=True, return_inverse=True, return_counts=True)
        same = same.reshape(-1)
        if (counts == 1).all():
            continue
        at = np.array([(i, j) for i in blocks for j in range(len(data.cells[i].data))], dtype=np.int64)
        known: dict[int, list[int]] = {}
        for i in np.flatnonzero(counts[same] > 1).tolist():
            own, tag = known.setdefault(int(same[i]), []), int(tags[i])
            if tag in own:
                continue
            if own:
                while len(extra) < len(own):
                    extra.append([])
                block, row = at[first[same[i]]].tolist()
                extra[len(own) - 1].append((block, row, tag))
                kept[at[i, 0]][at[i, 1]] = False
            own.append(tag)
    if not extra:
        return data
    for n, layer in enumerate(extra, start=2):
        arrays = [np.zeros(len(block.data), dtype=np.int64) for block in data.cells]
        for block, row, tag in layer:
            arrays[block][row] = tag
        data.cell_data[f"{PHYSICAL} {n}"] = arrays
    data.cell_data = {
        w: [np.asarray(a)[k] for a, k in zip(own, kept, strict=True)] for w, own in data.cell_data.items()
    }
    data.cell_sets = {}
    for block, keep in zip(data.cells, kept, strict=True):
        block.data = block.data[keep]
    return data
