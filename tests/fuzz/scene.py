"""Scenes: whatever the text, checking ends in a scene or in errors that can be shown, and reading does nothing else.

    python tests/fuzz/scene.py -max_total_time=3600     guided by coverage; needs atheris
    python tests/fuzz/scene.py FILE...                  each file once, without it

Findings go to $SOFTMARK_FUZZ/scene, or to /tmp/softmark-fuzz/scene.
"""

from __future__ import annotations

import json
import os
import random
import re
import sys
import tempfile
import unicodedata
import zlib
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any

if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).parent))

import guard
import mutate
import trimesh  # noqa: F401 - readers of surfaces import it on first use: before the fence is closed

if TYPE_CHECKING:
    from softmark.grammar.diagnostic import Diagnostic

GUIDED = __name__ == "__main__" and not any(os.path.isfile(a) for a in sys.argv[1:])
with guard.instrumented() if GUIDED else nullcontext():
    from softmark.grammar.diagnostic import Source, render, summary, to_json
    from softmark.grammar.parser import parse
    from softmark.grammar.printer import format_source
    from softmark.interpreter.help.codes import pages
    from softmark.interpreter.language.scene_sources import UnreadableScene, _decode_text
    from softmark.interpreter.planning.run_plan import plan_of
    from softmark.interpreter.validation.scene_loader import load_scene
    from softmark.scenes import ROOT

ERRORS = guard.REPOSITORY / "tests" / "errors"


class Broken(Exception):
    """A promise is not kept."""


def promise(kept: object, words: str) -> None:
    """Raise Broken unless it is kept."""
    if not kept:
        raise Broken(words)


# ------------------------------------------------------------------ the promises


def examine(text: str, folder: Path, overrides: tuple[str, ...] = ()) -> str:
    """Whether a text is a scene, after all that must hold whether it is or not. Raises Broken."""
    scene, found = load_scene(Source("fuzz.scene", text), folder, folder / "fuzz.scene", overrides)
    wrong = [d for d in found if d.severity == "error"]
    promise((scene is None) == bool(wrong), "a scene is there if and only if there is no error")
    shown(found)
    if scene is not None and zlib.crc32(text.encode("utf-8", "replace")) % 4 == 0:
        plan_of(scene)
    formatted(text)
    return "accepted" if scene is not None else "refused"


def shown(found: list[Diagnostic]) -> None:
    """Every diagnostic can be shown: a known code, a message, a place in its text, nothing that steers a terminal."""
    for diagnostic in found:
        promise(diagnostic.code in pages() and diagnostic.message, f"{diagnostic.code} has a page and a message")
        inside(diagnostic)
        json.dumps(to_json(diagnostic), ensure_ascii=False, allow_nan=False).encode()
    page = render(found)
    page.encode()
    promise(
        not any(unicodedata.category(c) in ("Cc", "Cf", "Cs") for c in page if c != "\n"),
        "nothing steers a terminal",
    )
    promise(len(page) < 4000 * len(found) + 1, f"messages are short, {len(page)} letters for {len(found)}")
    render(found, colour=True)
    summary(found)


def inside(diagnostic: Diagnostic) -> None:
    """The span lies in the text, and its line and column say the same as its offsets."""
    source, span = diagnostic.source, diagnostic.span
    if source is None or span is None:
        raise Broken(f"{diagnostic.code} has no place")
    promise(0 <= span.start <= span.end <= len(source.text), f"{diagnostic.code}: {span} outside")
    starts = [0, *(m.end() for m in re.finditer(r"\r\n|\n|\r", source.text))]
    for offset, line, column in (
        (span.start, span.line, span.column),
        (span.end, span.end_line, span.end_column),
    ):
        promise(1 <= line <= len(starts) and starts[line - 1] + column - 1 == offset, f"{diagnostic.code}: {span}")


def formatted(text: str) -> None:
    """What is parsed without error has one canonical form, which means the same and is its own."""
    tree, found = parse(Source("fuzz.scene", text))
    if found:
        return
    once = format_source(Source("fuzz.scene", text))
    again, found = parse(Source("fuzz.scene", once))
    promise(not found, "the canonical form has no syntax errors")
    promise(again == tree, "the canonical form means the same")
    promise([c.text for c in again.comments] == [c.text.rstrip() for c in tree.comments], "comments are kept")
    promise(format_source(Source("fuzz.scene", once)) == once, "the canonical form is its own")


# ------------------------------------------------------------------ inputs


def target(folder: Path) -> Any:
    """The promises as a function of bytes, as of a file in `folder`."""

    def one(data: bytes) -> str:
        try:
            text = _decode_text(data, "fuzz.scene")
        except UnreadableScene as missing:
            promise(str(missing) and missing.remedy, "a file that is no text is refused with a remedy")
            return "unreadable"
        return examine(text, folder)

    return one


def stage(folder: Path) -> Path:
    """A folder with files that scenes may name, good ones and bad ones."""
    import shutil

    if not (folder / "parts").exists():
        shutil.copytree(ERRORS / "parts", folder / "parts")
        (folder / "fuzz.scene").write_text("param q = 1\n", encoding="utf-8")
        (folder / "loop.scene").symlink_to("fuzz.scene")
        (folder / "zero.scene").symlink_to("/dev/zero")
        (folder / "folder.scene").mkdir()
        os.mkfifo(folder / "pipe.scene")
    return folder


def seeds() -> list[bytes]:
    """Standard scenes, the goldens' scenes, and the scenes in the pages of codes and in the guides."""
    found = [p.read_bytes() for p in (*sorted(ROOT.rglob("*.scene")), *sorted(ERRORS.glob("*.scene")))]
    corpus = Path(__file__).parent / "corpus"
    found += [p.read_bytes() for p in sorted(corpus.glob("*.scene"))]
    for page in (
        *pages_of_codes(),
        guard.REPOSITORY / "README.md",
        guard.REPOSITORY / "grammar" / "README.md",
    ):
        blocks = re.findall(r"```[a-z ]*\n(.*?)```", page.read_text(encoding="utf-8"), flags=re.DOTALL)
        found += [block.encode() for block in blocks]
    return list(dict.fromkeys(found))


def pages_of_codes() -> list[Path]:
    """The pages that `dsl explain` shows."""
    return sorted((guard.REPOSITORY / "interpreter" / "help" / "codes").glob("*.md"))


def texts(found: list[bytes]) -> list[str]:
    """Those that are texts, short enough to take parts from."""
    return [t for data in found if len(t := data.decode("utf-8", errors="replace")) < 20_000]


def main() -> None:
    """Guided by coverage, or over files that are named."""
    folder = stage(Path(tempfile.mkdtemp(prefix="softmark-fuzz-")))
    if not GUIDED:
        for name in sys.argv[1:]:
            print(name, target(folder)(Path(name).read_bytes()))
        return
    others, own = texts(seeds()), target(folder)
    watch = guard.Watch("scene", guard.out("scene"), guard.Fence(folder, ROOT))

    def change(data: bytes, seed: int) -> bytes:
        text = data.decode("utf-8", errors="replace")
        return mutate.changed(text, random.Random(seed), others).encode("utf-8", errors="replace")

    guard.guided(watch, own, seeds(), change)


if __name__ == "__main__":
    main()
