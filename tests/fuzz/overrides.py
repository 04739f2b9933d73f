"""Overrides: whatever stands after `-p` and `--vary` on the command line, it is taken or refused in words.

python tests/fuzz/overrides.py -max_total_time=600     guided by coverage; needs atheris
python tests/fuzz/overrides.py FILE...                 each file once: one override a line, `--vary` ones after a `!`
"""

from __future__ import annotations

import os
import random
import sys
import tempfile
from contextlib import nullcontext
from pathlib import Path
from typing import Any

if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).parent))

import guard
import mutate

GUIDED = __name__ == "__main__" and not any(os.path.isfile(a) for a in sys.argv[1:])
with guard.instrumented() if GUIDED else nullcontext():
    import scene

    from softmark.grammar.diagnostic import Source
    from softmark.interpreter.api.python_api import loads
    from softmark.interpreter.language.compiled_scene import SceneError
    from softmark.interpreter.study.comparison_study import CommandLineAdditions
    from softmark.interpreter.study.configurations.configuration_expansion import (
        TooManyConfigurations,
        expand,
        read_vary,
        subject_of,
    )
    from softmark.interpreter.validation.scene_loader import load_scene
    from softmark.scenes import ROOT

BEAM = ROOT / "beams" / "stiff-cantilever.scene"
SEEDS = (
    "L=120mm",
    "L = 120 mm",
    "silicone.young=30 kPa",
    "L=(1, 2, 3) mm",
    "L=L",
    "L=2*R",
    "L=sqrt(2) mm",
    "L=1/0 mm",
    "L=1e400 m",
    "=",
    "L",
    "L=",
    "=3",
    "L==3",
    "a.b.c=3",
    "L=120mm L=3",
    "pressure.magnitude=1 kPa",
    "model.size=[10, 5] mm",
    "L=\u202e1",
    "L=\0",
    "L=" + "(" * 200,
    "L=-0 m",
    "L=yes",
    'L="x"',
    "L=120mm\nR=3mm\nsilicone.poisson=0.3",
    "!L=10mm,20mm",
    "!model=a,b",
    "!fem.size=[10, 5]mm",
    "!h=10mm,,5mm",
    '!L=","',
    "!=",
    "!L=,",
    "!model=",
    "!L=1m,(2m",
    "!R=1mm\n!L=2m",
    "!L=[]",
    "!L=[[1]]m",
    "!silicone.young=1kPa,2kPa,1e9kPa",
    "!L=1mm,x,0mm",
    "!nothing=1",
)


def examine(text: str, base: Source, folder: Path) -> str:
    """Whether overrides are taken; everything said of them can be shown. Raises scene.Broken."""
    lines = text.split("\n")[:6]
    given = tuple(line for line in lines if not line.startswith("!"))
    compiled, found = load_scene(base, folder, None, given)
    scene.promise((compiled is None) == any(d.severity == "error" for d in found), "no scene if and only if an error")
    scene.shown(found)
    word = "refused" if compiled is None else "accepted"
    vary = [line[1:] for line in lines if line.startswith("!")]
    return _varied(vary, base) if vary else word


def _varied(vary: list[str], base: Source) -> str:
    try:
        read, models = read_vary(vary)
        if sum(len(v.values) for v in read) <= 6:  # each value compiles the scene
            expand([subject_of(loads(base.text).scene)], CommandLineAdditions(read, models))
    except SceneError as refused:
        said = refused.diagnostics
        scene.promise(said, "an error says what is wrong")
        for diagnostic in said:
            scene.promise(diagnostic.message, "a message")
            if diagnostic.span is not None:
                scene.inside(diagnostic)
        str(refused).encode()
        return "refused"
    except TooManyConfigurations:
        return "too many"
    return "varied"


def target(folder: Path) -> Any:
    """The promises as a function of bytes."""
    base = Source("beam.scene", BEAM.read_text(encoding="utf-8"))

    def one(data: bytes) -> str:
        return examine(data.decode("utf-8", errors="surrogateescape"), base, folder)  # as sys.argv is decoded

    return one


def seeds() -> list[bytes]:
    """Overrides that are right and wrong, of names that the scene has."""
    scene_text = BEAM.read_text(encoding="utf-8")
    from softmark.grammar.lexer import lex

    names = sorted({t.text for t in lex(scene_text).tokens if t.kind == "NAME"})
    return [
        s.encode() for s in (*SEEDS, *(f"{name}=1 m" for name in names), *(f"!{name}.size=1mm,2mm" for name in names))
    ]


def main() -> None:
    """Guided by coverage, or over files that are named."""
    folder = scene.stage(Path(tempfile.mkdtemp(prefix="softmark-fuzz-")))
    if not GUIDED:
        for name in sys.argv[1:]:
            print(name, target(folder)(Path(name).read_bytes()))
        return
    others = scene.texts(seeds())
    watch = guard.Watch("overrides", guard.out("overrides"), guard.Fence(folder, ROOT))

    def change(data: bytes, seed: int) -> bytes:
        return mutate.changed(data.decode("utf-8", errors="replace"), random.Random(seed), others).encode(
            "utf-8", "replace"
        )

    guard.guided(watch, target(folder), seeds(), change)


if __name__ == "__main__":
    main()
