"""The blocks of a page of the documentation, run from top to bottom in a folder of its own.

What a fence may say is in `interpreter/documentation/README.md`.
"""

from __future__ import annotations

import contextlib
import io
import re
import shlex
import textwrap
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import softmark
from softmark.grammar.diagnostic import Source, render
from softmark.grammar.parser import parse
from softmark.interpreter.cli.main import main
from softmark.interpreter.validation.scene_loader import load_scene

FENCE = re.compile(
    r"^(?P<indent> *)(?P<fence>```+)(?P<info>[^`\n{][^`\n]*)\n(?P<body>.*?)^ *(?P=fence) *$", re.M | re.S
)
KNOWN = {  # what may stand behind the word of each language
    "scene": {"run", "file", "add", "fails", "part"}, "sh": {"status", "norun"}, "python": {"norun", "raises"},
    "text": {"output"},
}  # fmt: skip


@dataclass(frozen=True)
class Block:
    """A fence: its language, what stands behind that, its text, and the line of its page."""

    language: str
    given: dict[str, str]
    text: str
    line: int


def blocks(page: str) -> Iterator[Block]:
    """Those of a page, in order. Raises ValueError for what no fence may say."""
    for found in FENCE.finditer(page):
        language, *words = found["info"].split()
        given = {name: value for name, _, value in (word.partition("=") for word in words)}
        line = page.count("\n", 0, found.start()) + 1
        if unknown := given.keys() - KNOWN.get(language, {"file"}):
            raise ValueError(f"line {line}: a block of {language} has no {', '.join(unknown)}")
        yield Block(language, given, textwrap.dedent(found["body"]), line)


@dataclass
class Reader:
    """Somebody who does what a page says, in a folder that is the working directory."""

    folder: Path
    names: dict[str, Any] = field(default_factory=dict)  # of Python
    printed: str = ""  # by the last block that printed

    def do(self, block: Block) -> None:
        """What its language asks. Raises AssertionError where it is not as the page says."""
        own = getattr(self, f"_{block.language}", None)
        if own is not None:
            own(block)
        elif "file" in block.given:
            (self.folder / block.given["file"]).write_text(block.text, encoding="utf-8")

    def _scene(self, block: Block) -> None:
        given, text = block.given, block.text
        if "part" in given:
            assert parse(Source("part", text))[1] == []
            return
        name = given.get("add") or given.get("file")
        file = self.folder / (name or "block.scene")
        if "add" in given:
            text = file.read_text(encoding="utf-8") + text
        if name:
            file.write_text(text, encoding="utf-8")
        _, found = load_scene(Source(file.name, text), self.folder, file if name else None)
        wanted = given.get("fails")
        assert wanted is None or wanted in [d.code for d in found], f"no {wanted}: {render(found, colour=False)}"
        others = [d for d in found if d.code != wanted]
        assert others == [], render(others, colour=False)
        if "run" in given:
            scene = softmark.load(file) if name else softmark.loads(text)
            report = scene.run()
            assert report.exit_status == 0, [(e.text, e.value, e.reason) for e in report.expectations if not e.passed]

    def _sh(self, block: Block) -> None:
        if "norun" in block.given:
            return
        lines = [line for line in block.text.replace("\\\n", " ").splitlines() if line.strip() and line[0] != "#"]
        said = io.StringIO()
        for line in lines:
            wanted = int(block.given.get("status", 0)) if line is lines[-1] else 0
            command, _, target = line.partition(" > ")
            program, *arguments = shlex.split(command, comments=True)
            assert program == "dsl", f"{line}: only commands of `dsl` are run; the block says `norun` otherwise"
            out = io.StringIO()
            with contextlib.redirect_stdout(out), contextlib.redirect_stderr(out):
                status = main(arguments)
            assert status == wanted, f"{line}: exit status {status}\n{out.getvalue()}"
            if target:
                (self.folder / target.strip()).write_text(out.getvalue(), encoding="utf-8")
            else:
                said.write(out.getvalue())
        self.printed = said.getvalue()

    def _python(self, block: Block) -> None:
        code = compile(block.text, f"line {block.line}", "exec")
        if "norun" in block.given:
            return
        out, raised = io.StringIO(), None
        try:
            with contextlib.redirect_stdout(out):
                exec(code, self.names)
        except Exception as error:
            raised = error
        wanted = block.given.get("raises")
        assert (type(raised).__name__ if raised else None) == wanted, repr(raised)
        self.printed = out.getvalue()

    def _text(self, block: Block) -> None:
        if "output" not in block.given:
            return
        printed = " ".join(self.printed.split())
        for line in block.text.splitlines():
            wanted = ".*?".join(re.escape(" ".join(part.split())) for part in line.split("..."))
            assert re.search(wanted, printed), f"{line!r} was not printed:\n{self.printed}"
