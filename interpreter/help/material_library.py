"""Library of materials: description, source of the constants, validity range and tensile curve of each one.

Each material in `stdlib-scenes/materials/` has a comment above its declaration. The comment begins with one line that
describes the material, then `Source:`, `Test:` (temperature and rate), `Valid:` (`stretches 0.7 to 1`) and `Uncertain:`
for every constant. Continuation lines are indented.
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
POINTS = 6  # points of a curve between its ends


@dataclass(frozen=True)
class LibraryMaterial:
    """Material of the library: its file, its declaration, and the entries of its comment by key."""

    name: str
    file: str  # path as `use` accepts it
    text: str
    what: str
    said: dict[str, str]

    @property
    def directed(self) -> bool:
        """True if the material has fibres."""
        return "fibres =" in self.text

    @property
    def valid_stretch_range(self) -> tuple[float, float] | None:
        """Range of uniaxial stretch in which the material is valid, None if it is not given."""
        found = STRETCHES.search(self.said.get("Valid", ""))
        return None if found is None else (float(found[1]), float(found[2]))

    @property
    def range_words(self) -> str:
        """Range of validity as text."""
        return " to ".join(f"{s:g}" for s in self.valid_stretch_range or ()) or "not given"


def materials() -> dict[str, LibraryMaterial]:
    """Return every material of the library, by name; imports only the modules that `dsl check` needs."""
    from softmark.scenes import ROOT

    files = sorted((ROOT / "materials").glob("*.scene"))
    return {own.name: own for file in files for own in _materials_of_file(file)}


def _materials_of_file(file: Path) -> Iterator[LibraryMaterial]:
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
            what, said = _parse_comment(lines[start:first])
            text = " ".join(source.text[found.span.start : found.span.end].split())
            yield LibraryMaterial(found.name, f"std/materials/{file.name}", text, what, said)


def _parse_comment(comment: list[str]) -> tuple[str, dict[str, str]]:
    """Return the first line of a comment, and its other entries by key."""
    found: dict[str, list[str]] = {"": []}
    key = ""
    for line in comment:
        key = next((k for k in KEYS if line.startswith(f"# {k}: ")), key)
        said = SAID.fullmatch(line)
        found.setdefault(key, []).append(said[1].strip() if said else "")
    joined = {k: " ".join(words) for k, words in found.items()}
    return joined.pop(""), joined


def tensile_curve(own: LibraryMaterial) -> list[tuple[float, float]]:
    """Return pairs of uniaxial stretch and nominal stress, Pa, over the range of validity of a material.

    The stress is computed at one material point or, for a material with fibres, in one finite element stretched along
    x.
    """
    import softmark

    if own.valid_stretch_range is None:
        return []
    low, high = own.valid_stretch_range
    steps = [low + (high - low) * i / (POINTS - 1) for i in range(POINTS)]
    shares = ", ".join(f"{100.0 * (l - 1.0):.12g}" for l in steps)
    model = "fem(hex20, strain = finite, formulation = mixed, size = 3 cm)" if own.directed else "homogeneous(uniaxial)"
    scene = softmark.loads(f"""softmark 1
use "{own.file}" as kept
body     bar   = solid(box(size = (1, 1, 1) cm), kept.{own.name})
support  still = fixed(bar, where = x <= 0 cm, components = x)
support  grip  = displaced(bar, where = x >= 1 cm, by = (1, 0, 0) cm, components = x, amplitude = per_state)
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
    """Return the explanation page of a library material, None for an unknown name."""
    own = materials().get(name.rpartition(".")[2])
    if own is None:
        return None
    from softmark.interpreter.language import units

    rows = [f"  {l:<9.4g}{units.format_value(stress, units.PRESSURE)}" for l, stress in tensile_curve(own)]
    said = [f"{key}: {text}" for key, text in own.said.items()]
    use = f'use "{own.file}" as lib      # and then lib.{own.name}'
    table = ["", "Uniaxial tension, nominal stress by stretch:", *rows] if rows else []
    return "\n".join([f"{own.name} (material of the library)", "", own.what, "", own.text, use, "", *said, *table])
