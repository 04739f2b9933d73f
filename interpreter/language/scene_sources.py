"""Reader of scene files: `use`, the standard library, and the table of all names."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import field, replace
from pathlib import Path
from typing import Any, BinaryIO

from softmark.grammar import tree
from softmark.grammar.diagnostic import Diagnostic, Remedy, Source, did_you_mean
from softmark.grammar.name_suggestions import nearest
from softmark.grammar.parser import parse
from softmark.grammar.tree import Span
from softmark.interpreter.language.expression_evaluation import PREDEFINED, SourceErrors
from softmark.interpreter.language.field_schema import Vocabulary
from softmark.records import dataclass
from softmark.safe_files import open_regular
from softmark.scenes import ROOT

LARGEST = 1_000_000  # maximum bytes of a scene, and of all scenes that it uses together
SUFFIX = ".scene"
QUOTED = re.compile(r'"([^"\n]+)"')
DEEPEST, MOST = 50, 500  # maximum depth of `use`, and maximum number of scenes


@dataclass
class Module:
    """Text of a scene with its declarations, and the prefix of its names in the scene that uses it."""

    source: Source
    tree: tree.Tree
    folder: Path
    prefix: str  # "" or "tissue."
    place: SourceErrors
    file: Path | None = None


@dataclass(frozen=True)
class Symbol:
    """Declaration or parameter as parsed, with the module (file) in which it stands."""

    node: tree.Param | tree.Declare
    module: Module


@dataclass
class ModuleTable:
    """Table of all modules of a scene and all their names with prefixes, in the order of the text."""

    vocabulary: Vocabulary
    modules: list[Module] = field(default_factory=list)
    symbols: dict[str, Symbol] = field(default_factory=dict)
    aliases: dict[str, tree.Use] = field(default_factory=dict)  # with prefix
    broken: set[str] = field(default_factory=set)  # with prefix: names whose declaration has an error
    size: int = 0  # characters of all texts
    listed: dict[int, tuple[tree.Expression, Any]] = field(default_factory=dict)  # lists with the values read from them

    def is_broken(self, full: str) -> bool:
        """Return whether an error was already reported at the declaration of a name.

        For a dotted name this includes the declaration of the alias with which it starts.
        """
        parts = full.split(".")
        return any(".".join(parts[:i]) in self.broken for i in range(1, len(parts) + 1))

    def with_diagnostics(self, diagnostics: list[Diagnostic]) -> ModuleTable:
        """Return the parsed texts with a new list of diagnostics, to be compiled again."""
        modules = {id(m): replace(m, place=SourceErrors(m.source, diagnostics)) for m in self.modules}
        symbols = {n: Symbol(s.node, modules[id(s.module)]) for n, s in self.symbols.items()}
        aliases, broken = dict(self.aliases), set(self.broken)
        return ModuleTable(self.vocabulary, list(modules.values()), symbols, aliases, broken, self.size, self.listed)


class UnreadableScene(Exception):
    """Exception for a scene that cannot be read; its text gives the reason, and `remedy` the remedy."""

    def __init__(self, reason: str, remedy: str = "") -> None:
        super().__init__(reason)
        self.reason, self.remedy = reason, remedy


# ------------------------------------------------------------------ files


def standard_scenes() -> dict[str, Path]:
    """Return the scene files of the standard library by name, but no material or template libraries."""
    files = sorted(ROOT.rglob(f"*{SUFFIX}"))
    return {f.stem: f for f in files if f.relative_to(ROOT).parts[0] not in ("materials", "templates")}


def standard_name(path: str | Path | None) -> str | None:
    """Return the name of a scene of the standard library from its file; None for any other file."""
    if path is None or not Path(path).resolve().is_relative_to(ROOT.resolve()):
        return None
    own = Path(path).resolve()
    return next((name for name, file in standard_scenes().items() if file.resolve() == own), None)


def locate_scene(name: str) -> Path:
    """Return the file of a scene given on the command line: a path, or a name of the standard library."""
    if not name.strip():
        raise UnreadableScene("the name of the scene is empty", "name a file, or a scene of `dsl list scenes`")
    if os.path.isfile(name):
        return Path(name)
    standard = standard_scenes()
    if name in standard:
        return standard[name]
    if os.path.isdir(name):
        raise UnreadableScene(f"{name} is a folder", _advise_on_folder(Path(name)))
    if os.path.exists(name):
        raise UnreadableScene(f"{name} is not a regular file", "use `-` to read from standard input")
    close = nearest(Path(name).stem, list(standard))
    hint = f"did you mean `{close}`?" if close else "`dsl list scenes` shows those that come with softmark"
    raise UnreadableScene(f"there is no file {name}, and no standard scene of that name", hint)


def _advise_on_folder(folder: Path) -> str:
    """Return advice for a folder given in place of a scene, which names one of the folder's scenes if it has any."""
    try:
        found = sorted(p.name for p in folder.iterdir() if p.suffix == SUFFIX)
    except OSError:
        found = []
    return f"name a file in it, such as {folder / found[0]}" if found else f"name a file; none there ends in {SUFFIX}"


def read_scene_file(path: Path, shown: str | None = None) -> Source:
    """Read a scene file. Raises UnreadableScene."""
    name = shown or str(path)
    try:
        if not os.path.isfile(path):
            raise _missing_file_error(path, name)
        with open_regular(path) as file:
            data = read_limited(file, name)
    except (OSError, ValueError) as error:
        reason = (error.strerror if isinstance(error, OSError) else None) or str(error)
        raise UnreadableScene(f"cannot read {name}: {reason[:1].lower()}{reason[1:]}") from error
    return Source(name, _decode_text(data, name))


def find_quoted_paths(text: str, folder: Path) -> Iterator[Path]:
    """Yield the paths of files and folders quoted in a text, whether or not they exist or the text has errors."""
    for name in dict.fromkeys(QUOTED.findall(text)):
        path = folder / name
        with suppress(OSError, ValueError):  # not a valid file name
            if path.exists() or (path.suffix and path.parent.is_dir()):
                yield path


def _missing_file_error(path: Path, name: str) -> UnreadableScene:
    if os.path.isdir(path):
        return UnreadableScene(f"{name} is a folder")
    if os.path.exists(path):
        return UnreadableScene(
            f"{name} is not a regular file", "devices and pipes are not read: save the scene in a file"
        )
    return UnreadableScene(f"there is no file {name}")


def read_limited(file: BinaryIO, name: str) -> bytes:
    """Read a file or stream up to the maximum size of a scene. Raises UnreadableScene if it is larger."""
    data = file.read(LARGEST + 1)
    if len(data) > LARGEST:
        raise UnreadableScene(
            f"{name} is larger than {LARGEST // 1_000_000} MB",
            "keep meshes in files of their own: scenes are small texts",
        )
    return data


def _decode_text(data: bytes, name: str) -> str:
    """Return UTF-8 data as text; the parser later refuses a NUL character at its place."""
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        raise UnreadableScene(f"{name} is in UTF-16, not in UTF-8", "save it as UTF-8")
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError as error:
        if b"\0" in data:
            return data.decode("utf-8", errors="replace")
        line = data.count(b"\n", 0, error.start) + 1
        raise UnreadableScene(
            f"{name} is not a text in UTF-8: byte 0x{data[error.start]:02x} in line {line}", "save it as UTF-8"
        ) from error


# ------------------------------------------------------------------ the table of names


def load_modules(
    table: ModuleTable, source: Source, folder: Path, file: Path | None, diagnostics: list[Diagnostic]
) -> None:
    """Fill in the table with all names of a scene and of the scenes that it uses."""
    if len(source.text) > LARGEST:
        table.modules.append(Module(source, tree.Tree(()), folder, "", SourceErrors(source, diagnostics), file))
        problem = f"the text is larger than {LARGEST // 1_000_000} MB"
        table.modules[0].place.error(
            "E401", Span(0, 0, 1, 1, 1, 1), problem, help="keep meshes in files of their own: scenes are small texts"
        )
        return
    _load_module(table, source, folder, file, "", (), diagnostics)
    main = table.modules[0]
    if all(isinstance(d, tree.Version | tree.Title) for d in main.tree.declarations) and not diagnostics:
        start = Span(0, 0, 1, 1, 1, 1)
        main.place.error("E223", start, "the scene declares nothing", help="`dsl new` prints a scene to start from")


def _load_module(
    table: ModuleTable, source: Source, folder: Path, file: Path | None, prefix: str,
    chain: tuple[Path, ...], diagnostics: list[Diagnostic],
) -> None:  # fmt: skip
    syntax, problems = parse(source)
    module = Module(source, syntax, folder, prefix, SourceErrors(source, diagnostics), file)
    table.modules.append(module)
    table.size += len(source.text)
    diagnostics.extend(problems)
    table.broken.update(prefix + name for name in syntax.broken)
    chain = (*chain, file.resolve()) if file else chain
    for node in syntax.declarations:
        if isinstance(node, tree.Use):
            _load_used_scene(table, module, node, chain)
        elif isinstance(node, tree.Param | tree.Declare):
            _declare_symbol(table, module, node)


def _declare_symbol(table: ModuleTable, module: Module, node: tree.Param | tree.Declare) -> None:
    if _check_name_is_free(table, module, node.name, node.name_span):
        table.symbols[module.prefix + node.name] = Symbol(node, module)


def _check_name_is_free(table: ModuleTable, module: Module, name: str, span: Span) -> bool:
    """Return whether a name can be declared in a module, and report it otherwise."""
    if name in PREDEFINED:
        module.place.error(
            "E217", span, f"`{name}` is a predefined name and cannot be declared", "predefined",
            f"choose another name, such as `{name}_0`",
        )  # fmt: skip
        return False
    full = module.prefix + name
    if full not in table.symbols and full not in table.aliases:
        return True
    first = table.symbols[full].node.name_span if full in table.symbols else table.aliases[full].alias_span
    module.place.error(
        "E208", span, f"`{name}` is declared twice", "the second declaration",
        f"the first declaration is in line {first.line}; rename one of the two",
    )  # fmt: skip
    return False


def _load_used_scene(table: ModuleTable, module: Module, node: tree.Use, chain: tuple[Path, ...]) -> None:
    if not _check_name_is_free(table, module, node.alias, node.alias_span):
        return
    alias = module.prefix + node.alias
    table.aliases[alias] = node
    standard = node.path.startswith("std/")
    path = ROOT / node.path[4:] if standard else module.folder / node.path
    shown = node.path if standard else os.path.normpath(path)
    try:
        source = _read_used_scene(node, path, shown)
    except UnreadableScene as missing:
        module.place.error(
            "E401", node.path_span, missing.reason, "not usable", _missing_scene_remedy(node, path, missing)
        )
        table.broken.add(alias)
        return
    if (problem := _check_use_limits(table, path, chain, len(source.text))) is not None:
        message, label, help = problem
        module.place.error("E402", node.path_span, message, label, help)
        table.broken.add(alias)
        return
    _load_module(table, source, path.parent, path, alias + ".", chain, module.place.diagnostics)


def _read_used_scene(node: tree.Use, path: Path, shown: str) -> Source:
    """Read a scene that another scene uses; `shown` is its name in messages. Raises UnreadableScene."""
    if path.suffix != SUFFIX:
        raise UnreadableScene(
            f"`{node.path}` is not a scene: its name does not end in `{SUFFIX}`", "`use` reads scenes only"
        )
    if node.path.startswith("std/") and not path.resolve().is_relative_to(ROOT.resolve()):
        raise UnreadableScene(
            f"{node.path} is not in the standard library",
            "give a path from the scene's own folder; `std/` is the standard library only",
        )
    return read_scene_file(path, shown)


def _missing_scene_remedy(node: tree.Use, path: Path, missing: UnreadableScene) -> str | Remedy:
    if missing.remedy:
        return missing.remedy
    known = [f"std/{p.relative_to(ROOT).as_posix()}" for p in sorted(ROOT.rglob(f"*{SUFFIX}"))]
    if path.parent.is_dir() and not node.path.startswith("std/"):
        known += [str(Path(node.path).with_name(p.name)) for p in sorted(path.parent.glob(f"*{SUFFIX}"))]
    close = nearest(node.path, known)
    if close:
        return did_you_mean(close, f'"{close}"')
    return "give a path relative to the scene's own folder; `std/` is the standard library"


def _check_use_limits(
    table: ModuleTable, path: Path, chain: tuple[Path, ...], size: int
) -> tuple[str, str, str] | None:
    """Return a message if scenes use each other in a circle or exceed a limit, else None.

    The limits are those of depth, number and size of scenes.
    """
    here = path.resolve()
    if here in chain:
        cycle = " -> ".join(p.name for p in (*chain[chain.index(here) :], path))
        remedy = "move the shared declarations into a scene of their own"
        return f"scenes use each other in a circle: {cycle}", "closes the circle", remedy
    if len(chain) >= DEEPEST or len(table.modules) >= MOST:
        help = f"at most {DEEPEST} scenes may use one another in a row, and {MOST} in all"
        return "too many scenes use each other", "one scene too many", help
    if table.size + size > LARGEST:
        help = "use it once, under one name: a scene that is used several times counts as often"
        return f"the scenes used are together larger than {LARGEST // 1_000_000} MB", "exceeds the limit", help
    return None
