"""Completion candidates from scenes: names of shipped scenes, and names that a scene declares.

The scene is parsed but not checked.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from softmark.grammar.tree import Declaration

SUFFIX = ".scene"


def standard_scene_names() -> dict[str, str]:
    """Return the names of the scenes in the standard library."""
    from softmark.interpreter.language.scene_sources import standard_scenes

    return dict.fromkeys(standard_scenes(), "")


def suites() -> dict[str, str]:
    """Return the names of the shipped leaderboard suites."""
    from softmark.scenes import ROOT

    return {file.stem: "a suite" for file in sorted((ROOT / "suites").glob("*.suite"))}


def templates() -> dict[str, str]:
    """Return the templates of `dsl new` with their titles."""
    from softmark.interpreter.cli.commands.new import templates

    return {name: template.title for name, template in templates().items()}


def declared_names(files: Sequence[str], kind: str, taken: Sequence[str] = ()) -> dict[str, str]:
    """Return the names of one kind that scene files declare, with their constructors, except the names in `taken`."""
    from softmark.grammar.tree import Call, Declare

    found = {}
    for one in _declarations(files):
        if isinstance(one, Declare) and one.kind == kind and one.name not in taken:
            found[one.name] = one.value.function.text if isinstance(one.value, Call) else ""
    return found


def overridable_names(files: Sequence[str], current: str) -> dict[str, str]:
    """Return the names that `-p` can set in scene files: parameters, such as `L=`.

    If `current` contains a dot, fields of the declaration before the dot are included, such as `rod.segments=`.
    """
    from softmark.grammar.source_layout import format_on_one_line
    from softmark.grammar.tree import Param

    found = {f"{one.name}=": format_on_one_line(one.value) for one in _declarations(files) if isinstance(one, Param)}
    return {**found, **_overridable_fields(files, current.partition(".")[0])} if "." in current else found


def _overridable_fields(files: Sequence[str], name: str) -> dict[str, str]:
    from softmark.grammar.tree import Call, Declare
    from softmark.interpreter.validation.constructor_registry import CATALOGUE

    for one in _declarations(files):
        if isinstance(one, Declare) and one.name == name and isinstance(one.value, Call) and one.kind in CATALOGUE:
            made = CATALOGUE.constructor(one.kind, one.value.function.text)
            return {f"{name}.{f.name}=": f.doc for f in made.fields} if made else {}
    return {}


def _declarations(files: Sequence[str]) -> list[Declaration]:
    """Return the declarations in all scene files that can be read."""
    from softmark.grammar.parser import parse
    from softmark.interpreter.language.scene_sources import UnreadableScene, locate_scene, read_scene_file

    found: list[Declaration] = []
    for name in files:
        with suppress(UnreadableScene, OSError):
            found += parse(read_scene_file(locate_scene(name)))[0].declarations
    return found
