"""Code lenses, commands shown over lines of a scene: `textDocument/codeLens`.

The editor runs the commands in a terminal: `softmark.run` as `dsl run`, `softmark.compare` as `dsl compare`,
`softmark.stress` as `dsl robustness`, with the file and the options as arguments.
"""

from __future__ import annotations

from collections.abc import Iterator

from lsprotocol import types

from softmark.grammar import tree
from softmark.interpreter.language_server.text_document import Document

RUN, COMPARE, STRESS = "softmark.run", "softmark.compare", "softmark.stress"
STABILITY = "robustness"  # studies run by `dsl robustness`
MANY = 2  # models that can be compared


def lenses(document: Document, params: types.CodeLensParams) -> list[types.CodeLens]:
    """Return the lenses over the first declaration (run, compare), each model (run), and each study (compare)."""
    if document.file is None:
        return []
    return [_lens(document, span, *words) for span, *words in _lens_descriptions(document)]


def _lens_descriptions(document: Document) -> Iterator[tuple[tree.Span, str, str, *tuple[str, ...]]]:
    """Yield place, title, command and options of each lens."""
    declared = [node for node in document.tree.declarations if isinstance(node, tree.Declare)]
    models = [node for node in declared if node.kind == "model"]
    studies = [node for node in declared if node.kind == "study"]
    first = next((n for n in document.tree.declarations if not isinstance(n, tree.Version)), None)
    if first is not None:
        yield first.span, "run", RUN
        if studies or len(models) >= MANY:
            yield first.span, "compare", COMPARE
    for model in models:
        if len(models) >= MANY:
            yield model.span, f"run {model.name}", RUN, "--model", model.name
    for study in studies:
        walked = isinstance(study.value, tree.Call) and study.value.function.text == STABILITY
        yield study.span, *(("stress", STRESS) if walked else ("compare", COMPARE)), "--study", study.name


def _lens(document: Document, span: tree.Span, title: str, command: str, *options: str) -> types.CodeLens:
    at = document.position(span.start)
    named = (word for plugin in document.vocabulary.plugins for word in ("--plugin", plugin.asked))
    words = [str(document.file), *options, *named]
    return types.CodeLens(types.Range(at, at), types.Command(title, command, arguments=words))
