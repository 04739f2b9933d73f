"""The measured ranges that `dsl explain` shows: `python tests/benchmarks/ranges.py DIR/stress.json SECONDS`.

`dsl stress beam-at-the-extremes --timeout SECONDS --out DIR` makes the file; this writes
`interpreter/cli/ranges.json` from it.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import softmark
from softmark.interpreter.cli import ranges


def main(file: str, seconds: str) -> None:
    """Read a stability study, and write where each of its models was right."""
    stress = json.loads(Path(file).read_text(encoding="utf-8"))
    scene = softmark.load(stress["scene"]["file"])
    constructors = {name: declared.constructor.name for name, declared in scene.scene.of_kind("model").items()}
    found = ranges.ranges_of(stress, constructors, float(seconds))
    path = Path(ranges.__file__).with_name(ranges.FILE)
    path.write_text(json.dumps(found, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    print(f"{path}: {len(found['models'])} models from {found['points']} points")


if __name__ == "__main__":
    main(*sys.argv[1:])
