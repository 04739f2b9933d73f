"""The language server: whatever the text and the place, each request ends in an answer or a refusal, and in time.

    python tests/fuzz/editor.py [COUNT] [SEED]     exit 1 if one does not; needs nothing but softmark

Texts are those of `mass.py`, as an editor holds them; of each, all requests are answered at three places of it after
its check, as `dsl lsp` does. Findings go to $SOFTMARK_FUZZ/editor.
"""

from __future__ import annotations

import json
import random
import sys
import tempfile
from collections.abc import Callable
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace

if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).parent))

import guard
import mass
import scene
from lsprotocol import converters, types

from softmark.interpreter.language_server import server
from softmark.interpreter.language_server.open_documents import apply_change
from softmark.interpreter.language_server.published_diagnostics import diagnostics
from softmark.interpreter.language_server.request_error import RequestRefused
from softmark.interpreter.language_server.text_document import Document

CONVERTER = converters.get_converter()
URI = "file:///fuzz.scene"
EXTRA = {  # what requests take besides the text, a position and a range
    types.TEXT_DOCUMENT_CODE_ACTION: {"context": types.CodeActionContext([])},
    types.TEXT_DOCUMENT_REFERENCES: {"context": types.ReferenceContext(True)},
    types.TEXT_DOCUMENT_RENAME: {"new_name": "wide"},
    types.TEXT_DOCUMENT_FORMATTING: {"options": types.FormattingOptions(4, True)},
}
METHODS = [  # those that answer of a text; others tell what has changed
    method
    for method in server.FEATURES
    if method.startswith("textDocument/") and method != types.TEXT_DOCUMENT_DID_SAVE
]


def ask(document: Document, method: str, position: types.Position, lines: types.Range) -> None:
    """Answer one request as the server does, and write the answer as it is sent."""
    params = types.METHOD_TO_TYPES[method][2]
    fields = params.__attrs_attrs__ if hasattr(params, "__attrs_attrs__") else ()
    known = {"text_document": types.TextDocumentIdentifier(URI), "position": position, "range": lines}
    given = {f.name: known[f.name] for f in fields if f.name in known} | EXTRA.get(method, {})
    feature = server.FEATURES[method]
    module, function = feature.answer.split(":")
    answer = getattr(import_module(f"softmark.interpreter.language_server.{module}"), function)
    opened = SimpleNamespace(documents={URI: document})
    with suppress(RequestRefused):
        found = answer(opened if feature.wide else document, params(**given))
        json.dumps(CONVERTER.unstructure(found), ensure_ascii=False, allow_nan=False).encode()


def target(folder: Path) -> Callable[[bytes], str]:
    """The promises as a function of bytes."""

    def one(data: bytes) -> str:
        chance = random.Random(data)
        text = data.decode("utf-8", errors="replace")
        document = Document(text, folder, folder / "fuzz.scene", snippets=chance.random() < 0.5, address=URI)
        if chance.random() < 0.7:  # else the check has not come so far
            diagnostics(document, document.check_result[1])
        for _ in range(3):
            first, last = sorted(chance.randint(0, len(text)) for _ in range(2))
            place = document.position(first)
            lines = types.Range(place, document.position(last))
            for method in METHODS:
                ask(document, method, place, lines)
            change = types.TextDocumentContentChangePartial(range=lines, text=chance.choice(("", "(", "𝐱", ' = "')))
            if chance.random() < 0.3:
                document = Document(apply_change(document, change), folder, address=URI, earlier=document.read)
                text = document.text
        return "answered"

    return one


def main() -> int:
    """All inputs, and the figures."""
    count, seed = (int(a) for a in (sys.argv[1:] + ["10000", "1"][len(sys.argv) - 1 :])[:2])
    folder = scene.stage(Path(tempfile.mkdtemp(prefix="softmark-fuzz-")))
    own, watch = target(folder), guard.Watch("editor", guard.out("editor"))
    for data in mass.inputs(count, seed):
        watch.judge(own, data)
    print(json.dumps(watch.report(), indent=1))
    return int(bool(watch.kept))


if __name__ == "__main__":
    sys.exit(main())
