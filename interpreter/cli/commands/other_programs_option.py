"""Option `--also PROGRAM`: adds models of other programs that match the finite element models of a scene.

For every `fem(...)` with a plain displacement formulation, an `external_solver(PROGRAM, ...)` with the same element,
size, body and mesh is added. Corotational strain, which other programs do not have, becomes finite strain. If several
models are identical, only one is added. A model that causes an error in the scene is left out. A model that the program
cannot solve gets the status `unsupported`, with the reason.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from softmark.grammar import tree
from softmark.grammar.diagnostic import Source

if TYPE_CHECKING:
    from softmark.grammar.diagnostic import Diagnostic
    from softmark.interpreter.language.compiled_scene import Scene

CARRIED = ("size", "body", "mesh")  # fields of `fem(...)` that are copied
OF_OTHERS = (
    "mass",
    "linear",
    "max_iterations",
    "initial_guess",
    "factorisation",
    "precision",
)  # fields that other programs ignore


def load_with_programs(name: str, programs: Sequence[str]) -> tuple[Scene | None, list[Diagnostic]]:
    """Return a scene with models of other programs added, and its diagnostics; the scene is None if it has errors.

    The names in `programs` are not checked here.
    """
    from softmark.interpreter.cli.commands.scene_arguments import SceneReadError, load, read_scene
    from softmark.interpreter.validation.scene_loader import load_scene

    scene, diagnostics = load(name)
    if scene is None or not programs:
        return scene, diagnostics
    try:
        source, folder, file = read_scene(name)
    except SceneReadError as unread:
        return None, [unread.diagnostic]
    lines = added_declarations(source, scene, programs)
    while lines:
        text = source.text.rstrip() + "\n\n# also\n" + "\n".join(lines) + "\n"
        found, said = load_scene(Source(source.name, text), folder, file)
        if found is not None:
            return found, diagnostics
        first = text.count("\n") - len(lines) + 1
        wrong = {d.span.line - first for d in said if d.severity == "error" and d.span is not None}
        kept = [line for i, line in enumerate(lines) if i not in wrong]
        if len(kept) == len(lines):
            return scene, diagnostics
        lines = kept
    return scene, diagnostics


def added_declarations(source: Source, scene: Scene, programs: Sequence[str]) -> list[str]:
    """Return the model declarations to add, one for each program and each distinct finite element mesh."""
    from softmark.grammar.parser import parse

    own = [n for n in parse(source)[0].declarations if isinstance(n, tree.Declare) and n.kind == "model"]
    words = {node.name: said for node in own if (said := _equivalent_arguments(source, node)) is not None}
    once = {said: name for name, said in reversed(words.items())}  # the first name of each
    return [
        f"model {name}_by_{program} = external_solver({program}, {said})"
        for said, name in reversed(once.items())
        for program in programs
        if f"{name}_by_{program}" not in scene.declared
    ]


def _equivalent_arguments(source: Source, node: tree.Declare) -> str | None:
    """Return the arguments of a model of another program that matches a `fem(...)` model: `hex8, strain = ...`.

    Return None if the formulation of the model is not a plain displacement formulation.
    """
    call = node.value
    if not isinstance(call, tree.Call) or call.function.text != "fem":
        return None
    given = {a.name or ("element" if i == 0 else ""): a for i, a in enumerate(call.arguments)}
    said = {n: source.text[a.value.span.start : a.value.span.end] for n, a in given.items()}
    if not {"element", "strain"} <= set(said) or not set(said) <= {"element", "strain", *CARRIED, *OF_OTHERS}:
        return None
    strain = "finite" if said["strain"] == "corotational" else said["strain"]
    rest = [f"{n} = {said[n]}" for n in CARRIED if n in said]
    return ", ".join([said["element"], f"strain = {strain}", *rest])
