"""The library of materials: what each is, where its constants come from, and what it does when it is pulled.

A material of `stdlib-scenes/materials/` has a comment above it: a line that says what it is, then `Source:`, `Test:`
(temperature and rate), `Valid:` (`stretches 0.7 to 1`) and `Uncertain:`, of every constant. Lines go on indented.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import TYPE_CHECKING

from softmark.records import dataclass

if TYPE_CHECKING:
    from pathlib import Path

KEYS = ("Source", "Test", "Valid", "Uncertain")
SAID = re.compile(rf"(?:# (?:{'|'.join(KEYS)}): |#   |# )(.*)")
STRETCHES = re.compile(r"stretches ([0-9.]+) to ([0-9.]+)")
POINTS = 6  # of a curve, between its ends


@dataclass(frozen=True)
class Kept:
    """A material of the library: the file that has it, how it is declared, and what its comment says by key."""

    name: str
    file: str  # as `use` takes it
    text: str
    what: str
    said: dict[str, str]

    @property
    def directed(self) -> bool:
        """Whether it has fibres."""
        return "fibres =" in self.text

    @property
    def stretches(self) -> tuple[float, float] | None:
        """The range it is valid in, by stretches of a pull."""
        found = STRETCHES.search(self.said.get("Valid", ""))
        return None if found is None else (float(found[1]), float(found[2]))

    @property
    def range_words(self) -> str:
        """The same in words."""
        return " to ".join(f"{s:g}" for s in self.stretches or ()) or "not given"


def materials() -> dict[str, Kept]:
    """Every material of the library by its name; nothing is imported that a check does not need."""
    from softmark.scenes import ROOT

    files = sorted((ROOT / "materials").glob("*.scene"))
    return {own.name: own for file in files for own in _of(file)}


def _of(file: Path) -> Iterator[Kept]:
    from softmark.grammar.diagnostic import Source
    from softmark.grammar.parser import parse
    from softmark.grammar.tree import Declare

    source = Source(file.name, file.read_text(encoding="utf-8"))
    lines = source.text.split("\n")
    for found in parse(source)[0].declarations:
        if isinstance(found, Declare) and found.kind == "material":
            first = found.span.line - 1
            start = first
            while start > 0 and lines[start - 1].startswith("#"):
                start -= 1
            what, said = _read(lines[start:first])
            text = " ".join(source.text[found.span.start : found.span.end].split())
            yield Kept(found.name, f"std/materials/{file.name}", text, what, said)


def _read(comment: list[str]) -> tuple[str, dict[str, str]]:
    """What a comment says first, and by its keys."""
    found: dict[str, list[str]] = {"": []}
    key = ""
    for line in comment:
        key = next((k for k in KEYS if line.startswith(f"# {k}: ")), key)
        said = SAID.fullmatch(line)
        found.setdefault(key, []).append(said[1].strip() if said else "")
    joined = {k: " ".join(words) for k, words in found.items()}
    return joined.pop(""), joined


def curve(own: Kept) -> list[tuple[float, float]]:
    """Stretches of a pull in the range that it is valid in, and the nominal stress of each, Pa.

    Of one material point; of what has fibres, which that does not know, of one cell, along x.
    """
    import softmark

    if own.stretches is None:
        return []
    low, high = own.stretches
    steps = [low + (high - low) * i / (POINTS - 1) for i in range(POINTS)]
    shares = ", ".join(f"{100.0 * (l - 1.0):.12g}" for l in steps)
    model = "fem(hex20, strain = finite, formulation = mixed, size = 3 cm)" if own.directed else "homogeneous(uniaxial)"
    scene = softmark.loads(f"""softmark 1
use "{own.file}" as kept
body     bar   = solid(box(size = (1, 1, 1) cm), kept.{own.name})
support  still = fixed(bar, where = x <= 0 cm, components = x)
support  grip  = displaced(bar, where = x >= 1 cm, by = (1, 0, 0) cm, components = x, course = state)
analysis pull  = static(states = [{shares}] %)
support  front = fixed(bar, where = y <= 0 cm, components = y)
support  under = fixed(bar, where = z <= 0 cm, components = z)
model    dot   = {model}
probe    amid  = point(bar, at = (5, 5, 5) mm)
metric   sigma = stress(amid, component = xx, measure = nominal)
""")
    found = scene.run().models["dot"].metrics.get("sigma")
    values = () if found is None else found.states
    return [(l, float(v)) for l, v in zip(steps, values, strict=False) if v is not None]


def page(name: str) -> str | None:
    """The page of a material of the library, None of a name that it has not."""
    own = materials().get(name.rpartition(".")[2])
    if own is None:
        return None
    from softmark.interpreter.language import units

    rows = [f"  {l:<9.4g}{units.format_value(stress, units.PRESSURE)}" for l, stress in curve(own)]
    said = [f"{key}: {text}" for key, text in own.said.items()]
    use = f'use "{own.file}" as lib      # and then lib.{own.name}'
    table = ["", "Pulled along one axis, nominal stress by stretch:", *rows] if rows else []
    return "\n".join([f"{own.name} (material of the library)", "", own.what, "", own.text, use, "", *said, *table])
