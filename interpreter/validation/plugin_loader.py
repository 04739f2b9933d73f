"""Loader of plugins: Python files with classes for new words. A plugin is only loaded when it is named.

A plugin is one Python file with a literal at its top level, which is read before any of its code runs:

    SOFTMARK = {"metrics": {"sway": "Sway"}, "models": {"guess": ("Guess", "prepare")}}

The tables are those of TABLES, the values are names of classes in the file. For a model the value is a pair with the
function that builds it, `prepare(model, declared, case, workshop)`. For an adapter it is the name of a `Program`, whose
file has all parts of an adapter (`models/external/adapters`). A plugin is named by its path, or by the name of an entry
point of the group `softmark.plugins`, whose value is the module.

An unusable word is reported at its place in the plugin, and the other words stay; no plugin raises an error here. To
let plugins add one more kind of thing: a line in TABLES, and in NEEDED what its classes must have.
"""

from __future__ import annotations

import ast
import copyreg
import dataclasses
import hashlib
import os
import re
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import redirect_stdout
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

from softmark.grammar.diagnostic import Diagnostic, Source
from softmark.grammar.name_suggestions import nearest
from softmark.grammar.tree import Span
from softmark.interpreter.language.expression_evaluation import PREDEFINED
from softmark.interpreter.language.field_schema import Vocabulary, _fields_of_class, article
from softmark.interpreter.language.loaded_plugin import FILES, Plugin, format_exception
from softmark.records import dataclass
from softmark.resource_limits import process_lock
from softmark.safe_files import open_regular

EXAMPLES = "examples"  # table of example calls for `dsl conformance`
GROUP = "softmark.plugins"  # entry point group
NAME = "SOFTMARK"  # name of the literal
OWN = "softmark_plugin_"  # prefix of module names
LARGEST = 1_000_000  # bytes of a plugin file, at most
TABLES = {  # tables of a plugin: kind of the words, and base class
    "materials": ("material", "solvers.materials.isotropic_material", "Isotropic"),
    "models": ("model", "interpreter.models.shared.model_declaration", "Model"),
    "metrics": ("metric", "interpreter.metrics.metric_base", "Metric"),
    "references": ("reference", "references.reference_base", "Reference"),
    "probes": ("probe", "interpreter.vocabulary.probe_words", "Probe"),
    "loads": ("load", "interpreter.vocabulary.loads.load", "Load"),
    "shapes": ("shape", "solvers.mesh.shape", "Shape"),
    "adapters": ("adapter", "interpreter.models.external.adapters", "Program"),
}
NEEDED = {  # attributes that a derived class must define itself
    ("solvers.materials.isotropic_material", "Isotropic"): ("finite_law",),
    ("interpreter.models.shared.model_declaration", "Model"): ("outline",),
    ("interpreter.metrics.metric_base", "Metric"): ("unit", "measure"),
    ("interpreter.metrics.metric_base", "DisplacementMetric"): ("value",),
    ("interpreter.metrics.metric_base", "ForceMetric"): ("amount", "natural"),
    ("references.reference_base", "Reference"): ("source", "error_meaning"),
    ("interpreter.vocabulary.probe_words", "Probe"): ("stations",),
    ("interpreter.vocabulary.loads.load", "Load"): ("action", "strength"),
    ("solvers.mesh.shape", "Shape"): ("mesh", "surface"),
}
ADAPTER = ("install", "version", "refuses", "write", "command", "read")  # functions of an adapter file
START = Span(0, 0, 1, 1, 1, 1)


def vocabulary_of(ours: Vocabulary, asked: Sequence[str]) -> tuple[Vocabulary, list[Diagnostic]]:
    """Return the vocabulary with the words of plugins, given by file or name, and the plugins' errors."""
    found: list[Diagnostic] = []
    for one in dict.fromkeys(asked):
        try:
            plugin = load_plugin(one)
        except NoPlugin as absent:
            found.append(absent.diagnostic)
            continue
        plugin = _remove_existing_words(plugin, ours)
        ours = ours.plus(plugin)
        found += plugin.doubts
    return ours, found


class NoPlugin(Exception):
    """Exception for a plugin that does not exist; it carries the diagnostic."""

    def __init__(self, message: str, help: str) -> None:
        super().__init__(message)
        self.diagnostic = Diagnostic("E731", message, None, None, help=help)


def installed_plugins() -> dict[str, str]:
    """Return the names of installed plugins and the module of each, without loading them."""
    from importlib.metadata import entry_points

    return {point.name: point.module for point in entry_points(group=GROUP)}


# ------------------------------------------------------------------ finding and reading


@dataclass(frozen=True)
class PluginSource:
    """Text of a plugin, with the file or the module from which it is loaded."""

    asked: str
    source: Source
    file: str
    module: str

    @property
    def sha256(self) -> str:
        """SHA-256 checksum of the text of the plugin."""
        return hashlib.sha256(self.source.text.encode()).hexdigest()

    def doubt(self, code: str, message: str, line: int | ast.AST = 0, label: str = "", help: str = "") -> Diagnostic:
        """Return a diagnostic at a line or a node of the plugin."""
        span = self._span(line) if isinstance(line, ast.AST) else self._span_of_line(line)
        return Diagnostic(code, f"the plugin `{self.source.name}` {message}", self.source, span, label, help)

    def _span_of_line(self, number: int) -> Span:
        lines = self.source.text.split("\n")
        if not 1 <= number <= len(lines):
            return START
        own = lines[number - 1]
        indent = len(own) - len(own.lstrip())
        start = sum(len(line) + 1 for line in lines[: number - 1])
        return Span(start + indent, start + len(own), number, indent + 1, number, len(own) + 1)

    def _span(self, node: Any) -> Span:
        """Return the span of a node, whose columns `ast` counts in bytes."""
        lines = self.source.text.split("\n")
        first, last = (
            len(lines[row - 1].encode()[:column].decode(errors="ignore"))
            for row, column in ((node.lineno, node.col_offset), (node.end_lineno, node.end_col_offset))
        )
        begin, end = (
            sum(len(line) + 1 for line in lines[: row - 1]) + column
            for row, column in ((node.lineno, first), (node.end_lineno, last))
        )
        return Span(begin, end, node.lineno, first + 1, node.end_lineno, last + 1)


_LOADED: dict[tuple[str, str], Plugin] = {}  # by requested name and text


def load_plugin(asked: str) -> Plugin:
    """Load a plugin by file or name, once per process while its text is unchanged. Raises NoPlugin."""
    read = _read(asked)
    key = read.asked, read.sha256
    if key not in _LOADED:
        _LOADED[key] = _build_plugin(read)
    return _LOADED[key]


copyreg.pickle(
    Plugin, lambda plugin: (load_plugin, (plugin.asked,))
)  # pickled by name, since its classes belong to its file


def _read(asked: str) -> PluginSource:
    """Read the text of a plugin. Raises NoPlugin."""
    by_path = os.path.isfile(asked) or asked.endswith(".py") or os.sep in asked
    file, module = (Path(asked), "") if by_path else _locate_installed(asked)
    try:
        with open_regular(file) as opened:
            data = opened.read(LARGEST + 1)
    except OSError as error:
        said = (error.strerror or str(error)).lower()
        raise NoPlugin(
            f"the plugin {asked} cannot be read: {said}",
            "give `--plugin` a Python file or the name of an installed plugin: `dsl list plugins`",
        ) from error
    text = data.decode("utf-8", errors="replace")
    if len(data) > LARGEST:
        raise NoPlugin(f"the plugin {asked} is larger than 1 MB", "a plugin is a hand-written Python file")
    stem = re.sub(r"\W", "_", file.stem)
    own = module or f"{OWN}{stem}_{hashlib.sha256(data).hexdigest()[:12]}"
    return PluginSource(asked if module else str(file.resolve()), Source(asked, text), str(file.resolve()), own)


def _locate_installed(name: str) -> tuple[Path, str]:
    """Return file and module of an installed plugin; only its parent packages run. Raises NoPlugin."""
    from importlib.util import find_spec

    known = installed_plugins()
    if name not in known:
        close = nearest(name, list(known))
        hint = f"did you mean `{close}`?" if close else "`dsl list plugins` lists the installed ones"
        if not name.strip():
            raise NoPlugin("the name of the plugin is empty", hint)
        raise NoPlugin(f"there is no file {name}, and no installed plugin of that name", hint)
    try:
        with process_lock, redirect_stdout(sys.stderr):
            spec = find_spec(known[name])
    except Exception as error:
        raise NoPlugin(f"the plugin {name} cannot be found: {format_exception(error)}", "install it again") from error
    if spec is None or not spec.origin:
        raise NoPlugin(f"the plugin {name} has no file: {known[name]}", "let its entry point name a module")
    return Path(spec.origin), known[name]


# ------------------------------------------------------------------ its table


class BadPlugin(Exception):
    """Exception for an unusable plugin; it carries the diagnostic."""

    def __init__(self, diagnostic: Diagnostic, why: str) -> None:
        super().__init__(why)
        self.diagnostic, self.why = diagnostic, why


@dataclass(frozen=True)
class Entry:
    """Word in the table of a plugin, with the name of its class."""

    table: str
    word: str
    value: Any  # name of a class; for a model also that of its builder
    node: ast.AST

    @property
    def kind(self) -> str:
        """Kind of declaration to which the word belongs."""
        return TABLES[self.table][0]


def _build_plugin(read: PluginSource) -> Plugin:
    """Load a plugin, and return it with all its errors."""
    doubts: list[Diagnostic] = []
    broken: dict[tuple[str, str], str] = {}
    words: dict[str, dict[str, Any]] = {}
    programs: list[str] = []
    entries: list[Entry] = []
    FILES[read.file] = read.source.name
    try:
        entries = list(_entries(read, _parse_source(read), doubts))
        module = _run(read)
    except BadPlugin as unread:
        broken = {(e.kind, e.word): unread.why for e in entries or _recover_entries(read)}
        return Plugin(read.asked, read.source.name, read.file, read.sha256, {}, broken,
                      "" if broken else unread.why, doubts=(*doubts, unread.diagnostic))  # fmt: skip
    for entry in entries:
        try:
            thing = _check_safely(entry, module)
        except BadClass as lacking:
            broken[entry.kind, entry.word] = str(lacking)
            doubts.append(_unusable_word_diagnostic(read, entry, lacking))
            continue
        if entry.table == "adapters":
            programs.append(entry.word)
        else:
            words.setdefault(entry.kind, {})[entry.word] = thing
    choices = {("model", "external_solver", "program"): tuple(programs)} if programs else {}
    table = getattr(module, NAME, None)
    given = table.get(EXAMPLES) if isinstance(table, dict) else None
    examples = {str(k): str(v) for k, v in given.items()} if isinstance(given, dict) else {}
    return Plugin(read.asked, read.source.name, read.file, read.sha256, words, broken, "", choices, examples,
                  tuple(doubts))  # fmt: skip


def _unusable_word_diagnostic(read: PluginSource, entry: Entry, why: BadClass) -> Diagnostic:
    """Return the diagnostic for a word of a plugin that cannot be used."""
    return read.doubt("W731", f"has a word that is ignored: {why}", entry.node, f"not a valid {entry.kind}", why.remedy)


def _parse_source(read: PluginSource) -> ast.Module:
    """Parse a plugin. Raises BadPlugin if it is not valid Python."""
    try:
        return ast.parse(read.source.text)
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        line = getattr(error, "lineno", 0) or 0
        why = f"it is not valid Python: {getattr(error, 'msg', None) or error}" + (f" (line {line})" if line else "")
        raise BadPlugin(
            read.doubt("W730", f"is broken: {why}", line, "here", "correct the plugin: none of its words can be used"),
            why,
        ) from error


def _entries(read: PluginSource, tree: ast.Module, doubts: list[Diagnostic]) -> Iterator[Entry]:
    """Yield the words in the table of a plugin. Raises BadPlugin if it has no table."""
    form = f'a literal at its top level, such as `{NAME} = {{"metrics": {{"sway": "Sway"}}}}`'
    node = next((n.value for n in tree.body if isinstance(n, ast.Assign | ast.AnnAssign) and _assigns_words(n)), None)
    if node is None:
        why = f"it has no table `{NAME}`"
        raise BadPlugin(read.doubt("W730", f"is broken: {why}", 1, "no table", f"write {form}"), why)
    if not isinstance(node, ast.Dict):
        why = f"its `{NAME}` is not a literal"
        raise BadPlugin(read.doubt("W730", f"is broken: {why}", node, "not a table", f"write {form}"), why)
    for key, value in zip(node.keys, node.values, strict=True):
        table = key.value if isinstance(key, ast.Constant) else None
        if table == EXAMPLES:
            continue
        if table not in TABLES or not isinstance(value, ast.Dict):
            known = ", ".join(f'"{name}"' for name in TABLES)
            doubts.append(read.doubt("W731", "has a table that is ignored", key or value, "not a table of words",
                                     f"use the tables {known}, each of words and names of classes"))  # fmt: skip
            continue
        yield from _entries_of_table(read, str(table), value, doubts)


def _assigns_words(node: ast.Assign | ast.AnnAssign) -> bool:
    targets = node.targets if isinstance(node, ast.Assign) else [node.target]
    return any(isinstance(t, ast.Name) and t.id == NAME for t in targets)


def _entries_of_table(read: PluginSource, table: str, node: ast.Dict, doubts: list[Diagnostic]) -> Iterator[Entry]:
    for key, value in zip(node.keys, node.values, strict=True):
        try:
            word, names = ast.literal_eval(key) if key else None, ast.literal_eval(value)
        except (ValueError, TypeError, SyntaxError, RecursionError, MemoryError):
            word, names = None, None
        pair = isinstance(names, tuple) and len(names) == 2 and all(isinstance(n, str) for n in names)
        if not isinstance(word, str) or not (isinstance(names, str) or (pair and table == "models")):
            help = 'write `"word": "Class"`, or for a model `"word": ("Class", "prepare")`'
            doubts.append(read.doubt("W731", "has a line that is ignored", key or value, "not word and class", help))
            continue
        yield Entry(table, word, names, key or value)


def _recover_entries(read: PluginSource) -> Iterator[Entry]:
    """Yield the words in the table of a plugin with a syntax error elsewhere."""
    found = re.search(rf"^{NAME}\s*(?::[^=\n]*)?=\s*(\{{.*?^\}}|\{{[^\n]*\}})", read.source.text, re.M | re.S)
    try:
        tree = ast.parse(f"{NAME} = {found[1]}") if found else ast.Module([], [])
        yield from _entries(read, tree, [])
    except (SyntaxError, ValueError, RecursionError, MemoryError, BadPlugin):
        return


# ------------------------------------------------------------------ its classes


def _run(read: PluginSource) -> ModuleType:
    """Run a plugin, with its output on standard error, and return its module. Raises BadPlugin."""
    named = not read.module.startswith(OWN)
    module = ModuleType(read.module)
    module.__file__ = read.file
    try:
        with process_lock, redirect_stdout(sys.stderr):
            if named:
                return import_module(read.module)
            sys.modules[read.module] = module
            exec(compile(read.source.text, read.file, "exec", dont_inherit=True), vars(module))
    except (Exception, SystemExit) as error:
        sys.modules.pop(read.module, None)
        line, why = _line_of(error, read.file), format_exception(error)
        help = (
            "install the missing module: no word of the plugin can be used"
            if isinstance(error, ImportError)
            else "correct it"
        )
        doubt = read.doubt("W730", f"is broken: {why}", line, "raised here", help)
        raise BadPlugin(doubt, f"{why} (line {line})") from None
    return module


def _line_of(error: BaseException, file: str) -> int:
    """Return the line of a file in which an exception was raised."""
    line, trace = 1, error.__traceback__
    while trace is not None:
        line = trace.tb_lineno if trace.tb_frame.f_code.co_filename == file else line
        trace = trace.tb_next
    return line


class BadClass(Exception):
    """Exception for a class that cannot define a word; `remedy` names what the class needs."""

    def __init__(self, why: str, remedy: str) -> None:
        super().__init__(why)
        self.remedy = remedy


def _check_safely(entry: Entry, module: ModuleType) -> Any:
    """Return the checked class of a word. Raises BadClass, also in place of any exception that the plugin raises."""
    try:
        return _check_entry(entry, module)
    except BadClass:
        raise
    except Exception as error:
        raise BadClass(f"inspecting it raises {format_exception(error)}", "use plain values as attributes") from error


def _check_entry(entry: Entry, module: ModuleType) -> Any:
    """Return the checked class of a word. Raises BadClass."""
    if not re.fullmatch(r"[a-z][a-z0-9_]*", entry.word) or entry.word in PREDEFINED:
        raise BadClass(f"`{entry.word}` is not a valid word", "use small letters, digits and `_`, as in `tip_sway`")
    name, builder = entry.value if isinstance(entry.value, tuple) else (entry.value, "prepare")
    thing = getattr(module, name, None)
    _, place, base = TABLES[entry.table]
    root = getattr(import_module(f"softmark.{place}"), base)
    if entry.table == "adapters":
        return _register_adapter(entry.word, name, thing, root, module)
    if not isinstance(thing, type):
        raise BadClass(f"it has no class `{name}`", "write a word and the name of a class in this file")
    if not issubclass(thing, root):
        raise BadClass(f"`{name}` is not a {base}", f"derive it from `{base}` of `softmark.{place}`")
    check_class(thing, entry.kind)
    if entry.table == "models":
        _register_builder(thing, builder, module)
    return thing


def check_class(cls: type[Any], kind: str) -> None:
    """Check that a class has every attribute that a word of its kind needs. Raises BadClass."""
    name = cls.__name__
    own: Any = vars(cls).get("__dataclass_params__")  # not inherited from its base
    if own is None or not own.frozen:
        raise BadClass(f"`{name}` is not a frozen dataclass", "write `@dataclass(frozen=True)` above it")
    if not (cls.__doc__ or "").strip() or cls.__doc__.startswith(f"{name}("):  # type: ignore[union-attr]
        raise BadClass(f"`{name}` has no docstring", "add one: `dsl list` and `dsl explain` show it")
    try:
        _fields_of_class(cls)
    except Exception as error:
        form = '`Annotated[float, "m in (0, inf)", "what it means"]`'
        raise BadClass(
            f"a field of `{name}` cannot be read: {format_exception(error)}", f"write a field as {form}"
        ) from None
    for (place, base), needed in NEEDED.items():
        root = getattr(sys.modules.get(f"softmark.{place}"), base, None)
        missing = (
            () if root is None or not issubclass(cls, root) else [n for n in needed if _is_only_inherited(cls, root, n)]
        )
        if missing:
            raise BadClass(f"`{name}` has no `{missing[0]}`", f"define it, as {article(kind)} {kind} must; see "
                                                              f"`{base}` of `softmark.{place}`")  # fmt: skip
    if kind == "reference":
        _check_reference(cls)


def _is_only_inherited(cls: type[Any], root: type[Any], name: str) -> bool:
    """Return whether a class only inherits an attribute that it must define itself."""
    nothing = object()
    return getattr(cls, name, nothing) is getattr(root, name, nothing)


def _check_reference(cls: type[Any]) -> None:
    """Check that a reference class defines how its results are computed. Raises BadClass."""
    known: Mapping[str, str] = {"solved": "solve", "measured": "load", "scanned": "load"}
    if cls.how not in known:
        raise BadClass(f"`{cls.__name__}` is `{cls.how}`", 'write `how = "solved"` or `"measured"` in a reference')
    if not callable(getattr(cls, known[cls.how], None)):
        raise BadClass(f"`{cls.__name__}` has no `{known[cls.how]}`", f"`{cls.how}` needs it: see `Reference`")


def _register_builder(cls: type[Any], builder: str, module: ModuleType) -> None:
    """Register the function or module that builds a model. Raises BadClass."""
    from softmark.interpreter.models.model_builders import BUILDERS, Builder

    if "." in builder:
        BUILDERS[cls] = builder
        return
    prepare = getattr(module, builder, None)
    if not callable(prepare):
        raise BadClass(f"no function builds `{cls.__name__}`", f"write a function `{builder}(model, declared, case, "
                      "workshop)` in this file")  # fmt: skip
    load = getattr(module, "load", None)
    BUILDERS[cls] = Builder(load if callable(load) else lambda model: None, prepare)


def _register_adapter(word: str, name: str, thing: Any, root: type[Any], module: ModuleType) -> Any:
    """Register an adapter. Raises BadClass."""
    from softmark.interpreter.models.external.adapters import PLUGGED, PROGRAMS

    if not isinstance(thing, root):
        raise BadClass(f"`{name}` is not a Program", "write `Program(title, elements, laws)`, what it supports")
    if missing := [n for n in ADAPTER if not hasattr(module, n)]:
        raise BadClass(f"its file has no `{missing[0]}`", f"define {', '.join(ADAPTER)} in an adapter")
    known = PLUGGED.get(word)
    if word in PROGRAMS or (known is not None and not _is_same_module(known[1], module)):
        raise BadClass(f"the program `{word}` exists already", "choose another word")
    PLUGGED[word] = thing, module
    return thing


def _is_same_module(one: ModuleType, other: ModuleType) -> bool:
    """Return whether two modules come from the same file or text."""
    return one.__file__ == other.__file__ or one.__name__ == other.__name__


def _remove_existing_words(plugin: Plugin, ours: Vocabulary) -> Plugin:
    """Return the plugin without words that the vocabulary already has."""
    taken = {(k, w): ours.owner(k, w) for k, own in plugin.words.items() for w in own if w in ours[k]}
    if not taken:
        return plugin
    doubts, broken, read = list(plugin.doubts), dict(plugin.broken), _read(plugin.asked)
    read = dataclasses.replace(read, source=Source(plugin.name, read.source.text))
    entries = {(e.kind, e.word): e for e in _entries(read, _parse_source(read), [])}
    for (kind, word), other in taken.items():
        whose = "softmark" if other is None else f"the plugin `{other.name}`"
        lacking = BadClass(f"`{word}` is already {article(kind)} {kind} of {whose}", "choose another word")
        broken[kind, word] = str(lacking)
        doubts.append(_unusable_word_diagnostic(read, entries[kind, word], lacking))
    words = {k: {w: c for w, c in own.items() if (k, w) not in taken} for k, own in plugin.words.items()}
    return dataclasses.replace(plugin, words=words, broken=broken, doubts=tuple(doubts))
