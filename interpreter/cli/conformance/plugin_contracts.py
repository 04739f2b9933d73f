"""Conformance test of a whole plugin: all its words, and the errors found when it was loaded."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from contextlib import redirect_stdout
from dataclasses import replace
from pathlib import Path
from sys import stderr
from typing import Any

from softmark.grammar.diagnostic import Diagnostic, Source
from softmark.interpreter.cli.conformance import Breach
from softmark.interpreter.language.field_schema import Constructor, Vocabulary
from softmark.interpreter.language.loaded_plugin import Plugin, format_exception
from softmark.interpreter.validation.constructor_registry import vocabulary_with
from softmark.records import dataclass


@dataclass(frozen=True)
class Conformance:
    """Result of a conformance test: `diagnostics` for the broken contracts, and the tested `words`."""

    diagnostics: tuple[Diagnostic, ...]
    words: tuple[str, ...]

    @property
    def sound(self) -> bool:
        """True if no contract is broken; contracts that could not be tested do not count."""
        return not any(d.code != "W732" for d in self.diagnostics)


def check_plugin(file: str) -> Conformance:
    """Test the words of a plugin, given by file or name, against their contracts.

    Exceptions that the plugin raises are reported as breaches.
    """
    vocabulary, found = vocabulary_with((file,))
    if not vocabulary.plugins:
        return Conformance(tuple(found), ())
    plugin, tried = vocabulary.plugins[0], []
    found = [*plugin.doubts]
    source = _source(plugin)
    for one, breaches in _breaches_by_word(plugin, vocabulary):
        tried.append(one)
        found += dict.fromkeys(_diagnostic(source, plugin, one, b) for b in breaches)
    return Conformance(tuple(found), tuple(tried))


def _breaches_by_word(plugin: Plugin, vocabulary: Vocabulary) -> Iterator[tuple[str, list[Breach]]]:
    """Yield every word of a plugin, such as `metric sway`, with its breaches."""
    from softmark.interpreter.cli.conformance import trial_scenes
    from softmark.interpreter.models.external.adapters import PLUGGED

    folder = Path(plugin.file).parent
    for kind, table in plugin.words.items():
        for name in table:
            word = vocabulary.constructor(kind, name)
            assert word is not None
            yield f"{kind} {name}", _word_breaches(word, plugin, folder)
    for name in (n for all_ in plugin.choices.values() for n in all_):
        made = lambda name=name: trial_scenes.adapter_breaches(name, *PLUGGED[name], folder, (plugin.asked,))  # noqa: E731
        yield f"adapter {name}", _collect_breaches(made)


def _word_breaches(word: Constructor, plugin: Plugin, folder: Path) -> list[Breach]:
    from softmark.interpreter.cli.conformance import trial_scenes
    from softmark.interpreter.cli.conformance.word_contracts import word_breaches

    found = _collect_breaches(lambda: word_breaches(word.cls, word.kind, word.name))
    trial = trial_scenes.Trial(word, trial_scenes.example_call(word, plugin.examples), folder, (plugin.asked,))
    return [*found, *_collect_breaches(lambda: trial_scenes.trial_breaches(trial))]


def _collect_breaches(made: Any) -> list[Breach]:
    """Return the breaches that the generator function `made` yields.

    An exception becomes a breach too. Text that the plugin prints is sent to standard error.
    """
    try:
        with redirect_stdout(stderr):
            return list(made())
    except Exception as error:
        return [Breach(f"testing it fails: {format_exception(error)}", "refuse unsupported input with a message")]


def _source(plugin: Plugin) -> Source:
    return Source(plugin.name, Path(plugin.file).read_text(encoding="utf-8", errors="replace"))


def _diagnostic(source: Source, plugin: Plugin, one: str, breach: Breach) -> Diagnostic:
    """Return the diagnostic of a breach, located at the class of the word, or at line 1 if there is no class."""
    from softmark.interpreter.validation.plugin_loader import PluginSource

    kind, _, name = one.partition(" ")
    cls = plugin.words.get(kind, {}).get(name)
    classes = [n for n in ast.parse(source.text).body if isinstance(n, ast.ClassDef) and cls and n.name == cls.__name__]
    code, verb = ("W732", "was not tested") if breach.untried else ("E732", "breaks a contract")
    read = PluginSource(plugin.asked, source, plugin.file, "")
    line = classes[0].lineno if classes else 1
    return replace(read.doubt(code, "", line, one, breach.remedy), message=f"`{one}` {verb}: {breach.what}")
