"""Command-line options that several commands share."""

from __future__ import annotations

import argparse

from softmark.interpreter.help.diagnostic_formats import FORMATS


def add_scene_options(parser: argparse.ArgumentParser) -> None:
    """Add the arguments that name a scene: `FILE [-p NAME=VALUE]... [--model NAME]...`."""
    parser.add_argument("file", metavar="FILE", help="a scene file, a standard scene, or - for standard input")
    add_override_option(parser)
    add_plugin_option(parser)
    parser.add_argument(
        "--model", action="append", default=[], metavar="NAME", help="use only this model; may be repeated"
    )


def add_plugin_option(parser: argparse.ArgumentParser) -> None:
    """Add the option `--plugin FILE|NAME`, which may be repeated."""
    meaning = "add the models, metrics and other words of a plugin: a Python file, or the name of an installed plugin"
    parser.add_argument("--plugin", action="append", default=[], dest="plugins", metavar="FILE", help=meaning)


def parse_folder(text: str) -> str:
    """Return `text` as a folder name; an empty text is a command-line error.

    An empty name would mean the working folder.
    """
    if not text.strip():
        raise argparse.ArgumentTypeError("the name of the folder is empty; `.` is the current folder")
    return text


def parse_file_name(text: str) -> str:
    """Return `text` as a file name; an empty text is a command-line error.

    An empty name would mean the working folder.
    """
    if not text.strip():
        raise argparse.ArgumentTypeError("the name of the file is empty")
    return text


def add_override_option(parser: argparse.ArgumentParser) -> None:
    """Add the option `-p NAME=VALUE`, which overrides a parameter or field of the scene and may be repeated."""
    meaning = "replace a parameter or a field, as in `-p L=12mm` or `-p gel.young=60kPa`"
    parser.add_argument("-p", action="append", default=[], dest="overrides", metavar="NAME=VALUE", help=meaning)


def add_diagnostics_option(parser: argparse.ArgumentParser, *formats: str) -> None:
    """Add the option `--diagnostics FORMAT`, with `text` and the given `formats` as choices."""
    means = "; ".join(f"{name}: {FORMATS[name]}" for name in formats)
    said = f"format of diagnostics; text: on standard error, for people (default); on standard output, {means}"
    parser.add_argument("--diagnostics", choices=("text", *formats), default="text", help=said)
