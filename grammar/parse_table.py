"""LALR(1) parse table of `scene.lark`: computed once by lark and cached as JSON in the user's cache folder.

With a cached table a process neither imports lark nor computes anything. The file is named after a digest of the
grammar, of lark and of this module, so it is never stale; it is written under another name and renamed, so it is never
incomplete. A read-only folder or an unreadable file costs only time.
"""

from __future__ import annotations

import json
import os
import tempfile
from contextlib import suppress
from dataclasses import asdict, dataclass
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any
from zlib import crc32

GRAMMAR = Path(__file__).with_name("scene.lark")
STARTS = ("declaration", "expression")


@dataclass(frozen=True, slots=True)
class Rule:
    """Production `origin: symbols` of the grammar: the number of its symbols, and how their values are combined.

    `method` is the name of the builder's method. It is empty for a list (`inline`), which its parent inserts in place
    of the symbol, and for a rule that `hands_on` its only symbol.
    """

    origin: str
    size: int
    method: str
    inline: bool
    hands_on: bool
    kept: list[int]  # the symbols a list keeps: all but commas and other fixed words
    spliced: list[int]  # the symbols whose values are lists


@dataclass(frozen=True, slots=True)
class Terminal:
    """Kind of token: a fixed text, or a regular expression."""

    name: str
    pattern: str
    literal: str  # the text itself; empty for a regular expression
    priority: int


@dataclass(frozen=True, slots=True)
class ParseTable:
    """LALR table: `states[s][symbol]` is the next state (>= 0), or `-1 - r` to reduce by `rules[r]`."""

    states: list[dict[str, int]]
    rules: list[Rule]
    starts: dict[str, int]
    ends: dict[str, int]
    terminals: list[Terminal]


@cache
def load() -> ParseTable:
    """Return the parse table of the language, from the cache or newly computed."""
    path = _cache_path()
    found = _read(path) if path else None
    if found is None:
        found = make()
        if path:
            _write(path, found)
    return found


@cache
def reserved_words() -> dict[str, str]:
    """Return the token kind of each reserved word."""
    return {terminal.literal: terminal.name for terminal in load().terminals if terminal.literal.isalpha()}


def make() -> ParseTable:
    """Compute the parse table with lark."""
    from lark import Lark

    parser = Lark(GRAMMAR.read_text("utf-8"), parser="lalr", lexer="basic", start=list(STARTS))
    raw: Any = parser.parse_interactive("", start=STARTS[0]).parser_state.parse_conf.parse_table
    rules = {rule: number for number, rule in enumerate(parser.rules)}
    states = [_actions(raw.states[state], rules) for state in range(len(raw.states))]
    return ParseTable(states, [_rule(rule) for rule in rules], raw.start_states, raw.end_states, _terminals(parser))


def _actions(row: dict[str, Any], rules: dict[Any, int]) -> dict[str, int]:
    return {symbol: target if isinstance(target, int) else -1 - rules[target] for symbol, (_, target) in row.items()}


def _rule(rule: Any) -> Rule:
    origin = str(rule.origin.name)  # a plain str: lark's tokens compare slowly
    symbols = rule.expansion
    inline = origin.startswith("_")
    hands_on = bool(rule.options.expand1 and len(symbols) == 1 and not rule.alias and not inline)
    method = "" if inline or hands_on else str(rule.alias or origin)
    kept = [i for i, symbol in enumerate(symbols) if not (symbol.is_term and symbol.filter_out)]
    spliced = [i for i, symbol in enumerate(symbols) if not symbol.is_term and symbol.name.startswith("_")]
    return Rule(origin, len(symbols), method, inline, hands_on, kept, spliced)


def _terminals(parser: Any) -> list[Terminal]:
    return [
        Terminal(t.name, t.pattern.to_regexp(), t.pattern.value if t.pattern.type == "str" else "", t.priority)
        for t in parser.terminals
    ]


def _cache_path() -> Path | None:
    """Return the cache file of this grammar, lark and module; None without a home folder."""
    lark = find_spec("lark")
    try:
        root = Path(os.environ.get("XDG_CACHE_HOME", ""))
        root = root if root.is_absolute() else Path.home() / ".cache"
        parts = [GRAMMAR, Path(__file__), *([Path(lark.origin)] if lark and lark.origin else [])]
        digest = "-".join(f"{crc32(part.read_bytes()):08x}" for part in parts)
    except (OSError, RuntimeError):
        return None
    return root / "softmark" / f"grammar-{digest}.json"


def _checksum(text: bytes) -> bytes:
    """Return the CRC-32 of a table's text, which is stored before it because a damaged file may still be valid JSON."""
    return f"{crc32(text):08x}".encode()


def _read(path: Path) -> ParseTable | None:
    try:
        checksum, _, text = path.read_bytes().partition(b"\n")
        if checksum != _checksum(text):
            return None
        raw = json.loads(text)
        rules = [Rule(**rule) for rule in raw["rules"]]
        terminals = [Terminal(**terminal) for terminal in raw["terminals"]]
        return ParseTable(raw["states"], rules, raw["starts"], raw["ends"], terminals)
    except (OSError, ValueError, KeyError, TypeError):
        return None


def _write(path: Path, table: ParseTable) -> None:
    """Write the cache file under another name and rename it, so that other processes see the whole file or none."""
    with suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, draft = tempfile.mkstemp(dir=path.parent, prefix=path.name)
        try:
            text = json.dumps(asdict(table)).encode()
            with open(handle, "wb") as file:
                file.write(_checksum(text) + b"\n" + text)
            os.replace(draft, path)
        except OSError:
            os.unlink(draft)
