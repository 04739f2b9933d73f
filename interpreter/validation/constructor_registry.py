"""Registry of all constructors that a scene can use.

To add a kind of declaration: write its table, and add a line here.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from softmark.grammar.diagnostic import Diagnostic, Source
from softmark.interpreter.language.compiled_scene import Scene
from softmark.interpreter.language.compiler import compile_scene
from softmark.interpreter.language.field_schema import Vocabulary

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
        "amplitude": ("interpreter.vocabulary", "AMPLITUDES"),
        "fibres": ("interpreter.vocabulary.fiber_words", "FIBRES"),
        "field": ("interpreter.vocabulary.field_words", "FIELDS"),
        "stiffness": ("interpreter.models.spring_network.spring_declaration", "STIFFNESSES"),
        "study": ("interpreter.vocabulary", "STUDIES"),
    },
    elements=("solvers.elements", "WORDS"),
)


def compile_source(
    source: Source, folder: Path, file: Path | None = None, overrides: Sequence[str] = (), plugins: Sequence[str] = ()
) -> tuple[Scene, list[Diagnostic]]:
    """Compile a text, and return its scene and all diagnostics; the scene is complete only without errors.

    `plugins` are files or names of plugins whose words the text may use; their errors are included.
    """
    vocabulary, found = vocabulary_with(plugins)
    scene, diagnostics = compile_scene(source, folder, file, overrides, vocabulary)
    return scene, [*found, *diagnostics]


def vocabulary_with(plugins: Sequence[str]) -> tuple[Vocabulary, list[Diagnostic]]:
    """Return the vocabulary extended by plugins, and the plugins' errors; without plugins nothing is loaded."""
    if not plugins:
        return CATALOGUE, []
    from softmark.interpreter.validation.plugin_loader import vocabulary_of

    return vocabulary_of(CATALOGUE, plugins)
