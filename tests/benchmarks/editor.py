"""What a writer waits for: a dialogue with `dsl lsp` about a scene of 300 lines, and answers in unfinished scenes.

    python tests/benchmarks/editor.py dialogue [--scene laws-at-the-extremes] [--edits 60]
    python tests/benchmarks/editor.py prefixes [--step 1 | --tokens] [--part 0/8]

`dialogue`: the time from opening to the first diagnostics, of each change to its diagnostics, and of every request that
the server offers, over pipes: median, 95th percentile and largest on the wall, median and 95th percentile of the
server's CPU, which others on the machine change less; and its memory. The scene is typed at: a declaration is added
letter by letter in the middle and taken away again.

`prefixes`: every scene that comes with softmark, cut off after each character (or word), in this process: CPU time of
the diagnostics and of every request at its end; what is over 200 ms or raises is printed. The first text of a mesh or a
surface in a file loads what reads it, which is said of its diagnostics.
"""

from __future__ import annotations

import argparse
import json
import statistics
import subprocess
import sys
import time
import traceback
from collections import defaultdict
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from queue import Empty, Queue
from threading import Thread
from typing import Any

from softmark.scenes import ROOT

DSL = "import sys; from softmark.interpreter.cli.main import main; sys.exit(main())"
TYPED = "material typed = neo_hookean(young = 60 kPa, poisson = 0.4, density = 1000 kg/m^3)\n"
BAR = 0.2  # s, of each request
REFUSED = -32803  # the code of what is not done for a reason, such as formatting what cannot be read
CAPABILITIES = {
    "textDocument": {
        "completion": {"completionItem": {"snippetSupport": True}},
        "publishDiagnostics": {"relatedInformation": True, "versionSupport": True},
    }
}


class Client:
    """Talks to a server of its own over pipes; notifications wait in a queue."""

    def __init__(self) -> None:
        self.process = subprocess.Popen(
            [sys.executable, "-c", DSL, "lsp"], stdin=subprocess.PIPE, stdout=subprocess.PIPE
        )
        self.number = 0
        self.arrived: Queue[tuple[float, dict[str, Any]]] = Queue()
        Thread(target=self._read, daemon=True).start()

    def _read(self) -> None:
        stream = self.process.stdout
        assert stream is not None
        while head := stream.readline():
            length = int(head.split(b":")[1])
            while stream.readline().strip():
                pass
            body = stream.read(length)
            self.arrived.put((time.perf_counter(), json.loads(body)))

    def notify(self, method: str, params: Any) -> float:
        """Send; when that was."""
        return self._send({"jsonrpc": "2.0", "method": method, "params": params})

    def _send(self, message: dict[str, Any]) -> float:
        data = json.dumps(message).encode()
        now = time.perf_counter()
        assert self.process.stdin is not None
        self.process.stdin.write(b"Content-Length: %d\r\n\r\n" % len(data) + data)
        self.process.stdin.flush()
        return now

    def ask(self, method: str, params: Any) -> tuple[float, Any]:
        """The seconds that an answer took, and the answer; diagnostics that come between are put back."""
        self.number += 1
        sent = self._send({"jsonrpc": "2.0", "id": self.number, "method": method, "params": params})
        others = []
        while True:
            at, message = self.arrived.get(timeout=60)
            if message.get("id") == self.number:
                for other in others:
                    self.arrived.put(other)
                if message.get("error", {}).get("code", REFUSED) != REFUSED:
                    raise RuntimeError(message["error"])
                return at - sent, message.get("result")
            others.append((at, message))

    def published(self, version: int) -> tuple[float, list[Any]]:
        """When the last diagnostics of a state arrived, and these: nothing more is said for a while."""
        last: tuple[float, list[Any]] | None = None
        while True:
            try:
                at, message = self.arrived.get(timeout=60 if last is None else 0.15)
            except Empty:
                assert last is not None
                return last
            params = message.get("params", {})
            if message.get("method") == "textDocument/publishDiagnostics" and params.get("version") == version:
                last = at, params["diagnostics"]

    def cpu(self) -> float:
        """Seconds of CPU that the server has taken, all threads."""
        tasks = Path(f"/proc/{self.process.pid}/task").iterdir()
        return sum(int((task / "schedstat").read_text().split()[0]) for task in tasks) / 1e9

    def memory(self) -> float:
        """Of the server, MB."""
        status = Path(f"/proc/{self.process.pid}/status").read_text()
        return float(next(line.split()[1] for line in status.splitlines() if line.startswith("VmRSS"))) / 1024


def dialogue(scene: str, edits: int) -> None:
    """Type at a scene, and print how long everything took."""
    file = next(ROOT.rglob(f"{scene}.scene"))
    text = file.read_text(encoding="utf-8")
    took: dict[str, list[float]] = defaultdict(list)
    worked: dict[str, list[float]] = defaultdict(list)
    started = time.perf_counter()
    client = Client()
    root = {"processId": None, "rootUri": ROOT.as_uri(), "capabilities": CAPABILITIES}
    _, result = client.ask("initialize", root)
    print(f"ready after {time.perf_counter() - started:.3f} s (the process started, `initialize` answered)")
    client.notify("initialized", {})
    uri = file.as_uri()
    item = {"uri": uri, "languageId": "softmark", "version": 0, "text": text}
    sent = client.notify("textDocument/didOpen", {"textDocument": item})
    at, found = client.published(0)
    print(f"CPU so far {client.cpu():.3f} s")
    print(f"{file.name}: {text.count(chr(10))} lines; first diagnostics ({len(found)}) after {at - sent:.3f} s")
    line = text.count("\n") // 2
    while text.splitlines()[line - 1]:
        line += 1
    version = 0
    for place in [*range(len(TYPED)), *range(len(TYPED) - 1, -1, -1)][: edits or None]:
        adding = version < len(TYPED)
        start = {"line": line, "character": place}
        end = start if adding else {"line": line, "character": place + 1}
        if TYPED[place] == "\n" and not adding:
            end = {"line": line + 1, "character": 0}
        version += 1
        change = {"range": {"start": start, "end": end}, "text": TYPED[place] if adding else ""}
        identified = {"uri": uri, "version": version}
        sent = client.notify("textDocument/didChange", {"textDocument": identified, "contentChanges": [change]})
        for method, params in requests(result["capabilities"], uri, line, place + 1):
            before = client.cpu()
            seconds, _ = client.ask(method, params)
            took[method].append(seconds)
            worked[method].append(client.cpu() - before)
        at, _ = client.published(version)
        took["change to diagnostics, requests between"].append(at - sent)
        version += 1
        alone = {"range": {"start": {"line": 0, "character": 0}, "end": {"line": 0, "character": 0}}, "text": ""}
        identified = {"uri": uri, "version": version}
        before = client.cpu()
        sent = client.notify("textDocument/didChange", {"textDocument": identified, "contentChanges": [alone]})
        at, _ = client.published(version)
        took["change to diagnostics"].append(at - sent)
        worked["change to diagnostics"].append(client.cpu() - before)
    print("\n| request | times | median ms | 95 % ms | largest ms | CPU median | CPU 95 % |"
          "\n| --- | --- | --- | --- | --- | --- | --- |")  # fmt: skip
    for method, seconds in sorted(took.items()):
        values = [1e3 * s for s in sorted(seconds)]
        own = [1e3 * s for s in sorted(worked[method] or [0.0])]
        print(f"| {method} | {len(values)} | {statistics.median(values):.1f} | {values[int(0.95 * len(values))]:.1f} "
              f"| {values[-1]:.1f} | {statistics.median(own):.1f} | {own[int(0.95 * len(own))]:.1f} |")  # fmt: skip
    print(f"\nmemory {client.memory():.0f} MB")
    client.ask("shutdown", None)
    client.notify("exit", None)
    print(f"exit status {client.process.wait(timeout=10)}")


def requests(offered: dict[str, Any] | None, uri: str, line: int, character: int) -> Iterator[tuple[str, Any]]:
    """Those that a server offers, or all, at a place."""
    document, at = {"textDocument": {"uri": uri}}, {"line": line, "character": character}
    here = document | {"position": at}
    whole = {"start": {"line": 0, "character": 0}, "end": {"line": 100_000, "character": 0}}
    known = {
        "completionProvider": ("completion", here),
        "hoverProvider": ("hover", here),
        "signatureHelpProvider": ("signatureHelp", here),
        "definitionProvider": ("definition", here),
        "referencesProvider": ("references", here | {"context": {"includeDeclaration": True}}),
        "documentHighlightProvider": ("documentHighlight", here),
        "documentSymbolProvider": ("documentSymbol", document),
        "foldingRangeProvider": ("foldingRange", document),
        "semanticTokensProvider": ("semanticTokens/full", document),
        "documentFormattingProvider": ("formatting", document | {"options": {"tabSize": 4, "insertSpaces": True}}),
        "inlayHintProvider": ("inlayHint", document | {"range": whole}),
        "codeLensProvider": ("codeLens", document),
        "codeActionProvider": ("codeAction", document | {"range": whole, "context": {"diagnostics": []}}),
    }
    for offer, (method, params) in known.items():
        if offered is None or offered.get(offer):
            yield f"textDocument/{method}", params


def prefixes(step: int, tokens: bool, part: str) -> int:
    """Cut every scene off, ask at its end, and print what is slow or raises; how many there were."""
    from softmark.grammar.lexer import lex

    number, parts = map(int, part.split("/"))
    took: dict[str, list[tuple[float, str]]] = defaultdict(list)
    bad = 0
    for file in sorted(ROOT.rglob("*.scene"))[number::parts]:
        text = file.read_text(encoding="utf-8")
        ends = [t.end for t in lex(text).tokens] if tokens else range(0, len(text) + 1, step)
        for end in ends:
            bad += answered(file, text[:end], took)
    for name, found in took.items():
        seconds = sorted(found)
        times = [1e3 * s for s, _ in seconds]
        most = times[int(0.95 * len(times))]
        print(f"{name}: {len(times)}, median {statistics.median(times):.1f} ms, 95 % {most:.1f}, largest"
              f" {times[-1]:.1f} at {seconds[-1][1]}")  # fmt: skip
    print(f"slow or raising: {bad}")
    return bad


def answered(file: Path, text: str, took: dict[str, list[tuple[float, str]]]) -> int:
    """Ask at the end of a text, and say what is slow or raises; how many that are."""
    from softmark.interpreter.language_server.published_diagnostics import diagnostics
    from softmark.interpreter.language_server.request_error import RequestRefused
    from softmark.interpreter.language_server.text_document import Document

    document = Document(text, file.parent, file, snippets=True)
    asked = {"diagnostics": lambda: diagnostics(document), **questions(document)}
    bad = 0
    for name, ask in asked.items():
        where, start = f"{file.stem}:{len(text)}", time.process_time()
        try:
            ask()
        except RequestRefused:
            pass
        except Exception:
            bad += 1
            print(f"{name} at {where}\n{traceback.format_exc()}", flush=True)
        seconds = time.process_time() - start
        took[name].append((seconds, where))
        if seconds > BAR:
            bad += 1
            print(f"{name} at {where}: {seconds:.3f} s", flush=True)
    return bad


def questions(document: Any) -> dict[str, Callable[[], object]]:
    """What an editor asks at the end of a text, by its method."""
    from importlib import import_module
    from types import SimpleNamespace

    from lsprotocol import types

    from softmark.interpreter.language_server.server import FEATURES

    at = document.position(len(document.text))
    found = {}
    for method, params in requests(None, document.uri, at.line, at.character):
        feature = FEATURES[method]
        module, function = feature.answer.split(":")
        answer = getattr(import_module(f"softmark.interpreter.language_server.{module}"), function)
        about = SimpleNamespace(documents={document.uri: document}) if feature.wide else document
        given = converter().structure(params, types.METHOD_TO_TYPES[method][2])
        found[method] = lambda answer=answer, about=about, given=given: answer(about, given)
    return found


@cache
def converter() -> Any:
    """From plain dictionaries to what requests are given."""
    from lsprotocol.converters import get_converter

    return get_converter()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    kinds = parser.add_subparsers(dest="kind", required=True)
    talk = kinds.add_parser("dialogue")
    talk.add_argument("--scene", default="laws-at-the-extremes")
    talk.add_argument("--edits", type=int, default=0, help="keystrokes (default: the whole line, there and back)")
    cut = kinds.add_parser("prefixes")
    cut.add_argument("--step", type=int, default=1, help="characters between prefixes")
    cut.add_argument("--tokens", action="store_true", help="cut after words alone")
    cut.add_argument("--part", default="0/1", help="NUMBER/PARTS of the scenes")
    parsed = parser.parse_args()
    if parsed.kind == "dialogue":
        dialogue(parsed.scene, parsed.edits)
    else:
        sys.exit(bool(prefixes(parsed.step, parsed.tokens, parsed.part)))


if __name__ == "__main__":
    main()
