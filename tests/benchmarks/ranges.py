"""The measured ranges that `dsl explain` shows: `python tests/benchmarks/ranges.py DIR/stress.json SECONDS [WORD ...]`.

`dsl robustness beam-at-the-extremes --timeout SECONDS --out DIR` makes the file; this writes its part of
`interpreter/help/ranges.json` from it. With words the pages of these show it, as `between rigid hertz` of an
indentation, and not those of its models; `tied=one` is a word that the model `one` alone is about.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import softmark
from softmark.interpreter.help import validity_ranges


def main(file: str, seconds: str, *words: str) -> None:
    """Read a stability study, and write where each of its models was right."""
    stress = json.loads(Path(file).read_text(encoding="utf-8"))
    scene = softmark.load(stress["scene"]["file"])
    constructors = {name: declared.constructor.name for name, declared in scene.scene.of_kind("model").items()}
    found = validity_ranges.ranges_of(stress, constructors, float(seconds))
    said = [(word, model) for word, _, model in (each.partition("=") for each in words)]
    found |= {"words": [word for word, _ in said]} if words else {}
    if any(model for _, model in said):
        for own in found["models"]:
            own["words"] = [word for word, model in said if model in ("", own["model"])]
    path = Path(validity_ranges.__file__).with_name(validity_ranges.FILE)
    others = [study for study in json.loads(path.read_text(encoding="utf-8")) if study["scene"] != found["scene"]]
    path.write_text(json.dumps([*others, found], indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    print(f"{path}: {len(found['models'])} models from {found['points']} points")


if __name__ == "__main__":
    main(*sys.argv[1:])
