"""What is stated of a contact's force, area and greatest pressure, beside what they are off: a sphere on a cylinder.

    .venv/bin/python tests/benchmarks/indentation_stated.py [--cells quad4:1 quad8:0.5]

The cylinder of `tests/shared/indented_cylinder.py`, small strain, travels of 0.25, 0.5 and 1 mm, against its section
(`indentation_section.py`). Of each number what it is off, and in brackets what is stated, % of the truth; `-` where
nothing is stated. It fails if one is not contained.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "shared"))
import indented_cylinder

from softmark import loads
from softmark.interpreter.pipeline.run_options import CheckedScene, RunOptions
from softmark.interpreter.pipeline.run_pipeline import run_to_report

CELLS = [f"{element}:{size}" for element in ("quad4, integration = selective", "quad8") for size in (2, 1, 0.5)]


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--cells", nargs="+", default=CELLS, help="ELEMENT:SIZE, mm")
    print("| element | size, mm | travel, mm | force, % | area, % | pressure, % |\n" + "| --- " * 6 + "|")
    missed = 0
    for one in parser.parse_args().cells:
        element, size = one.split(":")
        for i, travel in enumerate(indented_cylinder.TRAVELS):
            text = indented_cylinder.CYLINDER.format(element=element, size=size, travel=1e5 * travel)
            scene = loads(text)
            found = run_to_report(CheckedScene(scene.scene, scene.warnings), RunOptions(draw=False, stated=())).models[
                "quads"
            ]
            cells = []
            for name, (table, known) in indented_cylinder.TOLD.items():
                off = found.metrics[name].value - table[i]
                stated = found.stated[name].value
                missed += stated is not None and abs(off) > stated + known * table[i]
                said = "-" if stated is None else f"{100 * stated / table[i]:.1f}"
                cells.append(f"{100 * off / table[i]:.1f} ({said})")
            print(f"| {element} | {size} | {1e3 * travel:g} | {' | '.join(cells)} |", flush=True)
    if missed:
        raise SystemExit(f"{missed} not contained")


if __name__ == "__main__":
    main()
