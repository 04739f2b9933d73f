"""Command-line options that several commands share."""

from __future__ import annotations

import argparse

from softmark.interpreter.help.diagnostic_formats import FORMATS


def scene_options(parser: argparse.ArgumentParser) -> None:
    """FILE [-p NAME=VALUE]... [--model NAME]..."""
    parser.add_argument("file", metavar="FILE", help="a scene file, a standard scene, or - for standard input")
    override_option(parser)
    plugin_option(parser)
    parser.add_argument("--model", action="append", default=[], metavar="NAME", help="only this model")


def plugin_option(parser: argparse.ArgumentParser) -> None:
    """[--plugin FILE|NAME]..."""
    meaning = "use the words of a plugin: a Python file, or the name of an installed plugin"
    parser.add_argument("--plugin", action="append", default=[], dest="plugins", metavar="FILE", help=meaning)


def folder(text: str) -> str:
    """Return a folder name from the command line; an empty one, which would mean the working folder, is an error."""
    if not text.strip():
        raise argparse.ArgumentTypeError("the name of the folder is empty; `.` is the current folder")
    return text


def file_name(text: str) -> str:
    """Return a file name from the command line; an empty one is an error, because it would mean the working folder."""
    if not text.strip():
        raise argparse.ArgumentTypeError("the name of the file is empty")
    return text


def override_option(parser: argparse.ArgumentParser) -> None:
    """[-p NAME=VALUE]..."""
    meaning = "replace a parameter or a field"
    parser.add_argument("-p", action="append", default=[], dest="overrides", metavar="NAME=VALUE", help=meaning)


def diagnostics_option(parser: argparse.ArgumentParser, *formats: str) -> None:
    """[--diagnostics text|...]"""
    means = "; ".join(f"{name}: {FORMATS[name]}" for name in formats)
    said = f"format of diagnostics; text: on standard error, for people (default); on standard output, {means}"
    parser.add_argument("--diagnostics", choices=("text", *formats), default="text", help=said)
