"""Completion candidates for the last word of a `dsl` command line, from the argument parsers of the commands.

To complete an option or operand of a new command, add a line in WAYS. Its key is the name in argparse (`model`), or the
command and the name (`import file`). Options with argparse choices need no line. Arguments shown as `FILE` or `DIR` in
the help are completed as files or folders. Other arguments are not completed.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from importlib import import_module

from softmark.interpreter.cli.completion import file_candidates, scene_candidates, vocabulary_candidates

Answers = dict[str, str]  # candidates with their meanings


@dataclass(frozen=True)
class PartialCommandLine:
    """Command line up to the word to complete: command, current word, operands and options before it."""

    command: str
    current: str  # incomplete last word
    operands: list[str] = field(default_factory=list)  # operands before the last word
    options: dict[str, list[str]] = field(
        default_factory=dict
    )  # option values before the last word, by name in argparse


Way = Callable[[PartialCommandLine], Answers]


def _scenes(asked: PartialCommandLine) -> Answers:
    return {**scene_candidates.standard_scene_names(), **file_candidates.files(asked.current, scene_candidates.SUFFIX)}


def _file_completer(*endings: str) -> Way:
    return lambda asked: file_candidates.files(asked.current, *endings)


WAYS: dict[str, Way] = {
    "file": _scenes,
    "files": _scenes,
    "compare files": lambda asked: {**_scenes(asked), **file_candidates.files(asked.current, ".json")},
    "board files": lambda asked: {
        **scene_candidates.suites(),
        **_scenes(asked),
        **file_candidates.files(asked.current, ".suite"),
    },
    "fmt files": _file_completer(scene_candidates.SUFFIX),
    "import file": lambda asked: file_candidates.files(asked.current, *vocabulary_candidates.deck_file_endings()),
    "import out": _file_completer(scene_candidates.SUFFIX),
    "conformance file": lambda asked: file_candidates.plugins(asked.current),
    "judge results": lambda asked: file_candidates.files(asked.current, *vocabulary_candidates.result_file_endings()),
    "rest": lambda asked: file_candidates.files(asked.current, *vocabulary_candidates.result_file_endings()),
    "model": lambda asked: scene_candidates.declared_names(asked.operands, "model", asked.options.get("model", [])),
    "study": lambda asked: scene_candidates.declared_names(asked.operands, "study"),
    "overrides": lambda asked: scene_candidates.overridable_names(asked.operands, asked.current),
    "vary": lambda asked: {
        **scene_candidates.overridable_names(asked.operands, asked.current),
        "model=": "some of the models",
    },
    "plugins": lambda asked: file_candidates.plugins(asked.current),
    "out": lambda asked: file_candidates.folders(asked.current),
    "json": _file_completer(".json"),
    "against": _file_completer(".json"),
    "junit": _file_completer(".xml"),
    "also": lambda asked: vocabulary_candidates.programs(),
    "units": lambda asked: vocabulary_candidates.unit_systems(),
    "name": lambda asked: vocabulary_candidates.documented_words(asked.current),
    "what": lambda asked: vocabulary_candidates.topics(),
    "template": lambda asked: scene_candidates.templates(),
    # arguments without an entry, by the name in their help
    "FILE": _file_completer(""),
    "DIR": lambda asked: file_candidates.folders(asked.current),
}


def find_candidates(words: Sequence[str]) -> Answers:
    """Return candidates with their descriptions for the last of `words`, the words of the line after `dsl`."""
    from softmark.interpreter.cli.main import COMMANDS

    *before, current = _split_equals_signs(words) or [""]
    if not before:
        found = {name: summary for name, (_, summary) in COMMANDS.items()}
        return _filter_by_prefix({**found, "--help": "what there is", "--version": "which this is"}, current)
    if before[0] not in COMMANDS:
        return {}
    found = _filter_by_prefix(
        _candidates_of_command(_command_parser(COMMANDS[before[0]][0]), before[0], before[1:], current), current
    )
    whole = words[-1].removesuffix(current)  # for `--model=r` in one word, `--model=`
    return {whole + word: meaning for word, meaning in found.items()} if whole.startswith("--") else found


def _split_equals_signs(words: Sequence[str]) -> list[str]:
    """Return the words with options such as `--model=rod` split into option and value.

    Bash passes `=` as a separate word, which is removed.
    """
    found: list[str] = []
    for word in words:
        option, sign, value = word.partition("=")
        found += [option, value] if sign and option.startswith("--") else [word]
    last = "" if found[-1:] == ["="] else None
    kept = [word for word in found if word != "="]
    return kept if last is None else [*kept, last]


def _command_parser(module: str) -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(allow_abbrev=False)
    import_module(f"softmark.interpreter.cli.commands.{module}").arguments(parser)
    return parser


def _candidates_of_command(parser: argparse.ArgumentParser, command: str, before: list[str], current: str) -> Answers:
    """Return candidates for the word `current` among the arguments of one command; `before` are the words before it."""
    known = {option: action for action in parser._actions for option in action.option_strings}
    operands, options, pending = _parse_words(before, known)
    if pending is None and current.startswith("-") and current != "-":
        return {option: _option_description(action) for option, action in known.items()}
    asked = PartialCommandLine(command, current, operands, options)
    return _values(pending or _positional_argument(parser, len(operands)), asked)


def _parse_words(
    before: list[str], known: dict[str, argparse.Action]
) -> tuple[list[str], dict[str, list[str]], argparse.Action | None]:
    """Return operands, values by option, and the option whose value is still missing (None if none is)."""
    operands: list[str] = []
    options: dict[str, list[str]] = {}
    pending: argparse.Action | None = None
    for word in before:
        if pending is not None:
            options.setdefault(pending.dest, []).append(word)
            pending = None
        elif word in known:
            pending = known[word] if known[word].nargs != 0 else None
        elif not word.startswith("-") or word == "-":
            operands.append(word)
    return operands, options, pending


def _positional_argument(parser: argparse.ArgumentParser, place: int) -> argparse.Action | None:
    """Return the positional argument with the index `place`, or None.

    If the last positional argument takes several values, it covers all later indices.
    """
    own = [action for action in parser._actions if not action.option_strings]
    if place < len(own):
        return own[place]
    return own[-1] if own and own[-1].nargs in ("+", "*") else None


def _values(action: argparse.Action | None, asked: PartialCommandLine) -> Answers:
    if action is None:
        return {}
    if action.choices is not None:
        return {str(choice): "" for choice in action.choices}
    names = (f"{asked.command} {action.dest}", action.dest, str(action.metavar))
    way = next((WAYS[name] for name in names if name in WAYS), None)
    return way(asked) if way else {}


def _option_description(action: argparse.Action) -> str:
    return "what it takes" if action.dest == "help" else (action.help or "").replace("%%", "%").partition(";")[0]


def _filter_by_prefix(found: Answers, current: str) -> Answers:
    return {word: meaning for word, meaning in found.items() if word.startswith(current)}
