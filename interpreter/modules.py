"""Reading scene files: `use`, the standard library, and the table of all names."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from softmark.grammar import tree
from softmark.grammar.diagnostic import Diagnostic, Source
from softmark.grammar.parse import parse
from softmark.grammar.suggest import nearest
from softmark.interpreter.expressions import PREDEFINED, Place
from softmark.scenes import ROOT

LARGEST = 20_000_000  # characters: a scene is text that people write


@dataclass
class Module:
    """One text, what it declares, and the prefix that its names have in the scene that uses it."""

    source: Source
    tree: tree.Tree
    folder: Path
    prefix: str  # "" or "tissue."
    place: Place
    file: Path | None = None


@dataclass(frozen=True)
class Symbol:
    """A name: its declaration and the module that it stands in."""

    node: tree.Param | tree.Declare
    module: Module


@dataclass
class Table:
    """All modules of a scene and all their names, with prefixes, in the order of the text."""

    modules: list[Module] = field(default_factory=list)
    symbols: dict[str, Symbol] = field(default_factory=dict)
    aliases: dict[str, tree.Use] = field(default_factory=dict)  # with prefix


class Missing(Exception):
    """A scene that cannot be read; the text says why, `remedy` what to do."""

    def __init__(self, reason: str, remedy: str = "") -> None:
        super().__init__(reason)
        self.reason, self.remedy = reason, remedy


def standard_scenes() -> dict[str, Path]:
    """Scenes of the standard library by name (`silicone-beam`), libraries of names (`std/...`) not among them."""
    files = sorted(ROOT.rglob("*.scene"))
    return {f.stem: f for f in files if "materials" not in f.relative_to(ROOT).parts}


def locate(name: str) -> Path:
    """The file of a scene given on the command line: a path, or a name of the standard library."""
    path = Path(name)
    if path.is_file():
        return path
    standard = standard_scenes()
    if name in standard:
        return standard[name]
    if path.is_dir():
        raise Missing(f"{name} is a folder", "name a file in it")
    close = nearest(path.stem, list(standard))
    hint = f"did you mean `{close}`?" if close else "`dsl list scenes` shows the scenes that come with softmark"
    raise Missing(f"there is no file {name}, and no standard scene of that name", hint)


def read(path: Path, shown: str | None = None) -> Source:
    """The text of a scene file. Raises Missing."""
    try:
        data = path.read_bytes() if path.stat().st_size <= LARGEST else None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise Missing(f"cannot read {shown or path}: {reason}") from error
    if data is None:
        raise Missing(f"{shown or path} is larger than {LARGEST // 1_000_000} MB", "is it a scene?")
    return Source(shown or str(path), data.decode("utf-8", errors="replace"))


def load(source: Source, folder: Path, file: Path | None, diagnostics: list[Diagnostic]) -> Table:
    """The table of all names of a scene and of what it uses."""
    table = Table()
    _enter(table, source, folder, file, "", (), diagnostics)
    return table


def _enter(
    table: Table, source: Source, folder: Path, file: Path | None, prefix: str,
    chain: tuple[Path, ...], diagnostics: list[Diagnostic],
) -> None:  # fmt: skip
    syntax, problems = parse(source)
    diagnostics.extend(problems)
    module = Module(source, syntax, folder, prefix, Place(source, diagnostics), file)
    table.modules.append(module)
    chain = (*chain, file.resolve()) if file else chain
    for node in syntax.declarations:
        if isinstance(node, tree.Use):
            _use(table, module, node, chain)
        elif isinstance(node, tree.Param | tree.Declare):
            _declare(table, module, node)


def _declare(table: Table, module: Module, node: tree.Param | tree.Declare) -> None:
    name = module.prefix + node.name
    if node.name in PREDEFINED:
        module.place.fail(
            "E217", node.name_span, f"`{node.name}` has a meaning of its own and cannot be declared",
            "predefined", f"choose another name, such as `{node.name}_0`",
        )  # fmt: skip
    elif name in table.symbols or name in table.aliases:
        first = table.symbols[name].node.name_span if name in table.symbols else table.aliases[name].alias_span
        module.place.fail(
            "E208", node.name_span, f"`{node.name}` is declared twice", "the second declaration",
            f"the first is in line {first.line}; give one of them another name",
        )  # fmt: skip
    else:
        table.symbols[name] = Symbol(node, module)


def _use(table: Table, module: Module, node: tree.Use, chain: tuple[Path, ...]) -> None:
    alias = module.prefix + node.alias
    if alias in table.symbols or alias in table.aliases or node.alias in PREDEFINED:
        module.place.fail("E208", node.alias_span, f"`{node.alias}` is declared twice", "the second declaration")
        return
    table.aliases[alias] = node
    path = ROOT / node.path[4:] if node.path.startswith("std/") else module.folder / node.path
    try:
        if node.path.startswith("std/") and not path.resolve().is_relative_to(ROOT.resolve()):
            raise Missing("it is not in the standard library")
        source = read(path, node.path)
    except Missing as missing:
        known = [f"std/{p.relative_to(ROOT).as_posix()}" for p in sorted(ROOT.rglob("*.scene"))]
        close = nearest(node.path, known)
        hint = f"did you mean `{close}`?" if close else missing.remedy or "paths are relative to the scene's own folder"
        module.place.fail("E401", node.path_span, f"cannot use `{node.path}`: {missing.reason}", "not readable", hint)
        return
    if path.resolve() in chain:
        cycle = " -> ".join(p.name for p in (*chain[chain.index(path.resolve()) :], path))
        module.place.fail("E402", node.path_span, f"scenes use each other in a circle: {cycle}", "closes the circle",
                          "move what both need into a scene of its own")  # fmt: skip
        return
    if len(chain) > 50:
        module.place.fail("E402", node.path_span, "`use` is nested more than 50 deep", "too deep")
        return
    _enter(table, source, path.parent, path, alias + ".", chain, module.place.diagnostics)
