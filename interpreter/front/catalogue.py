"""All that a scene can declare: the one place that knows every table of constructors.

To add a kind of declaration: its table, and a line here.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from softmark.grammar.diagnostic import Diagnostic, Source
from softmark.interpreter.language.compile import compile_scene
from softmark.interpreter.language.scene import Scene
from softmark.interpreter.language.schema import Vocabulary

CATALOGUE = Vocabulary(
    {  # kind of declaration: its module and the table there
        "shape": ("solvers.mesh.shapes", "SHAPES"),
        "material": ("solvers.materials", "WORDS"),
        "body": ("interpreter.vocabulary", "BODIES"),
        "region": ("interpreter.vocabulary", "REGIONS"),
        "support": ("interpreter.vocabulary", "SUPPORTS"),
        "contact": ("interpreter.vocabulary", "CONTACTS"),
        "load": ("interpreter.vocabulary", "LOADS"),
        "analysis": ("interpreter.vocabulary", "ANALYSES"),
        "model": ("interpreter.models", "MODELS"),
        "reference": ("references", "REFERENCES"),
        "probe": ("interpreter.vocabulary", "PROBES"),
        "metric": ("interpreter.metrics", "METRICS"),
        "published": ("interpreter.vocabulary", "PUBLISHED"),
        "course": ("interpreter.vocabulary", "COURSES"),
        "fibres": ("interpreter.vocabulary.fibres", "FIBRES"),
        "field": ("interpreter.vocabulary.fields", "FIELDS"),
        "stiffness": ("interpreter.models.springs.words", "STIFFNESSES"),
        "study": ("interpreter.vocabulary", "STUDIES"),
    },
    elements=("solvers.elements", "WORDS"),
)


def compiled(
    source: Source, folder: Path, file: Path | None = None, overrides: Sequence[str] = ()
) -> tuple[Scene, list[Diagnostic]]:
    """The scene of a text, and all diagnostics; it is complete only if none of them is an error."""
    return compile_scene(source, folder, file, overrides, CATALOGUE)
