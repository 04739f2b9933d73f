"""A rigid sphere on the middle of a cube, by a quarter of it and graded meshes in space: the force against the truth.

    .venv/bin/python tests/benchmarks/indentation_block.py [--cells hex20:3.3:6 tet10:3.5:6]

The cube of 40 mm of `tests/shared/indented_cylinder.py`: travels of 0.25, 0.5 and 1 mm. Cells are `refine_factor`
times as small below the sphere as their size, which they have in the corner across.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "shared"))
import indented_cylinder
from indentation_cost import solved

CELLS = [
    *("hex20:5:5", "hex20:4.5:6", "hex20:3.3:6"),
    *(
        "hex8, integration = selective:3.5:5",
        "hex8, integration = selective:2.5:5",
        "hex8, integration = selective:2.5:8",
    ),
    *("tet10:7:5", "tet10:5:5", "tet10:3.5:6"),
]


def main() -> None:
    """Print."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--cells", nargs="+", default=CELLS, help="ELEMENT:SIZE:FINER, mm and 1")
    print("| element | size, mm | finer | cells | 0.25 mm | 0.5 mm | 1 mm | CPU s |\n" + "| --- " * 8 + "|")
    for one in parser.parse_args().cells:
        element, size, finer = one.split(":")
        found = solved(indented_cylinder.QUARTER.format(element=element, size=size, finer=finer))
        off = [
            400 * force / right - 100
            for force, right in zip(found["forces"], indented_cylinder.CUBE_SMALL, strict=True)
        ]
        numbers = " | ".join(f"{part:+.2f} %" for part in off)
        print(f"| {element} | {size} | {finer} | {found['cells']} | {numbers} | {found['cpu']:.1f} |", flush=True)


if __name__ == "__main__":
    main()
