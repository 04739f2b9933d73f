"""Definition and uses of names: `textDocument/definition`, `references`, `documentHighlight`."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

from lsprotocol import types

from softmark.grammar import tree
from softmark.interpreter.language.scene_sources import SUFFIX, UnreadableScene, read_scene_file
from softmark.interpreter.language_server.name_index import Target, document_of, name_at, uses
from softmark.interpreter.language_server.open_documents import OpenDocuments
from softmark.interpreter.language_server.text_document import Document

AROUND = 200  # maximum number of scenes in a folder searched for uses
START = types.Range(types.Position(0, 0), types.Position(0, 0))


def definition(document: Document, params: types.DefinitionParams) -> types.Location | None:
    """Return the place where the name at a position is declared; for a file name, the file."""
    offset = document.offset(params.position)
    if (found := name_at(document, offset)) is not None:
        target = found.target
        own = document_of(document, target.module)
        return types.Location(uri_of(own, params.text_document.uri, document), own.range(target.span))
    file = _file_at(document, offset)
    return None if file is None else types.Location(file.resolve().as_uri(), START)


def references(opened: OpenDocuments, params: types.ReferenceParams) -> list[types.Location]:
    """Return all uses of the name at a position, in this scene, its used scenes, and scenes that use its file."""
    document = opened.documents[params.text_document.uri]
    found = name_at(document, document.offset(params.position))
    if found is None:
        return []
    places = find_all_uses(opened, params.text_document.uri, found.target, params.context.include_declaration)
    return [types.Location(uri, at) for uri, at in places]


def highlights(document: Document, params: types.DocumentHighlightParams) -> list[types.DocumentHighlight]:
    """Return the uses of a name in the text itself."""
    found = name_at(document, document.offset(params.position))
    if found is None:
        return []
    main, kinds = document.table.modules[0], types.DocumentHighlightKind
    return [
        types.DocumentHighlight(document.range(one.span), kinds.Write if one.declares else kinds.Read)
        for one in uses(document, found.target) if one.module is main
    ]  # fmt: skip


def find_all_uses(
    opened: OpenDocuments, uri: str, target: Target, declared: bool = True
) -> Iterator[tuple[str, types.Range]]:
    """Yield the URI and range of each use of a name, each once; for open files, the uses in the open texts.

    The declaration itself is included if `declared` is true.
    """
    document, seen = opened.documents[uri], set()
    known = {d.file.resolve() for d in opened.documents.values() if d.file}
    for own, its in ((uri, document), *_find_using_scenes(opened, uri, target)):
        for one in uses(its, target):
            text = document_of(its, one.module)
            stale = text is not its and text.file is not None and text.file.resolve() in known
            if stale or (one.declares and not declared):  # open files are read from the editor
                continue
            place = uri_of(text, own, its), text.range(one.span)
            if (key := (place[0], one.span.start)) not in seen:
                seen.add(key)
                yield place


def uri_of(text: Document, uri: str, document: Document) -> str:
    """Return the URI of one of the texts of a scene; `uri` is that of the scene itself."""
    return uri if text is document or text.file is None else text.file.resolve().as_uri()


def _find_using_scenes(opened: OpenDocuments, uri: str, target: Target) -> Iterator[tuple[str, Document]]:
    """Yield other scenes that may use a name: open scenes, and scenes in the folder of the declaring file."""
    home = target.module.file
    if home is None:
        return
    for own, document in list(opened.documents.items()):
        itself = document.file is not None and document.file.resolve() == home.resolve()
        if own != uri and (itself or _may_use(document.text, home, target.name)):
            yield own, document
    known = {d.file.resolve() for d in opened.documents.values() if d.file}
    for file in sorted(home.resolve().parent.glob(f"*{SUFFIX}"))[:AROUND]:
        if file.resolve() in known:
            continue
        try:
            text = read_scene_file(file).text
        except UnreadableScene:
            continue
        if file.resolve() == home.resolve() or _may_use(text, home, target.name):
            yield file.as_uri(), Document(text, file.parent, file, vocabulary=opened.documents[uri].vocabulary)


def _may_use(text: str, home: Path, name: str) -> bool:
    """Return whether a text may use a file and one of its names; this quick filter avoids parsing most texts."""
    return name in text and re.search(rf'\buse[^"\n]*"[^"\n]*{re.escape(home.name)}"', text) is not None


def _file_at(document: Document, offset: int) -> Path | None:
    """Return the file that a quoted text at a position names, such as a used scene, a mesh or a measurement."""
    for node in document.tree.declarations:
        if not node.span.start <= offset <= node.span.end:
            continue
        if isinstance(node, tree.Use) and node.path_span.start <= offset <= node.path_span.end:
            return _used_file(document, node)
        for expression in tree.expressions(node):
            for part, _ in tree.walk(expression):
                if isinstance(part, tree.String) and part.span.start <= offset <= part.span.end:
                    return _existing_file(document.folder, part.value)
    return None


def _used_file(document: Document, node: tree.Use) -> Path | None:
    """Return the file of a used scene, if it could be read."""
    return next((m.file for m in document.table.modules if m.prefix == f"{node.alias}."), None)


def _existing_file(folder: Path, name: str) -> Path | None:
    try:
        return folder / name if name and (folder / name).is_file() else None
    except (OSError, ValueError):  # not a valid file name: too long, or with a NUL
        return None
