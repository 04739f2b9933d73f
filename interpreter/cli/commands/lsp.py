"""Command `dsl lsp`: the language server for editors."""

from __future__ import annotations

import argparse
import os
import sys
from importlib.util import find_spec

from softmark.interpreter.cli.commands.common_options import add_plugin_option


def arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `dsl lsp`: `[--stdio] [--plugin FILE|NAME]...`."""
    parser.add_argument("--stdio", action="store_true", help="use standard input and output (the default)")
    add_plugin_option(parser)


def run(parsed: argparse.Namespace) -> int:
    """Serve one editor until it disconnects, and return the exit status.

    The exit status is that of the protocol, or 2 if packages or the editor are missing.
    """
    if find_spec("pygls") is None or find_spec("lsprotocol") is None:
        print('error: `dsl lsp` needs pygls: pip install "softmark[lsp]"', file=sys.stderr)
        return 2
    if sys.stdin is not None and sys.stdin.isatty():
        print("error: `dsl lsp` is started by editors; `dsl editor` shows how", file=sys.stderr)
        return 2
    # standard output is the editor's alone: whatever a library prints, in Python or below it, goes to standard error
    outgoing = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    sys.stdout = sys.stderr
    incoming = os.fdopen(os.dup(0), "rb")
    os.dup2(
        os.open(os.devnull, os.O_RDONLY), 0
    )  # no library may read standard input, which has the messages of the editor
    from softmark import pausing
    from softmark.interpreter.language_server.server import serve

    pausing.resume_collection()
    return serve(incoming, outgoing, parsed.plugins)
