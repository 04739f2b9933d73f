"""Cell magic `%%scene` of `%load_ext softmark`, which runs a notebook cell as a scene and shows its report."""

from __future__ import annotations

import argparse
import shlex
import sys
from pathlib import Path
from typing import Any, NoReturn

from IPython.core.error import UsageError
from IPython.core.interactiveshell import InteractiveShell
from IPython.core.magic import Magics, cell_magic, magics_class
from IPython.display import display

from softmark.grammar.diagnostic import Source
from softmark.interpreter.api.python_api import load_source
from softmark.interpreter.api.shown_report import RunReport

LEFT = ("scene", "report")  # variables that a cell defines


class _LineParser(argparse.ArgumentParser):
    """Argument parser for the line of the magic; errors are UsageErrors, which IPython shows without a traceback."""

    def error(self, message: str) -> NoReturn:
        """Raise a UsageError with the message."""
        raise UsageError(f"%%scene: {message}\n{self.format_usage().strip()}")

    def exit(self, status: int = 0, message: str | None = None) -> NoReturn:
        """End the cell, after `--help` has been printed."""
        raise UsageError("%%scene: nothing was run")


def parser() -> argparse.ArgumentParser:
    """Return the argument parser for the line of the magic."""
    own = _LineParser(
        "%%scene", description="Run the cell as a scene, show its report, and define `scene` and `report`."
    )
    own.add_argument("name", nargs="?", help="also store the report under this name, which messages use for the cell")
    own.add_argument("-p", action="append", default=[], metavar="NAME=VALUE", help="replace a parameter or a field")
    own.add_argument("--model", action="append", default=[], metavar="NAME", help="only this model")
    own.add_argument("--stated", action="store_true", help="estimate the error of each model")
    own.add_argument("--plugin", action="append", default=[], metavar="FILE", help="load a plugin from a file")
    return own


@magics_class
class SceneMagics(Magics):
    """`%%scene [NAME] [-p NAME=VALUE]... [--model NAME]... [--stated] [--plugin FILE]...`"""

    @cell_magic
    def scene(self, line: str, cell: str) -> None:
        """Run the cell as a scene, show its report, and store it as `report` and the scene as `scene`.

            %%scene soft -p "L=120 mm" --model rod

        NAME is an additional variable for the report. `{}` inserts Python values: `-p L={length}mm`. After an error
        neither variable is set, and the cells that would run next are stopped.
        """
        try:
            given = parser().parse_args(shlex.split(line))
        except ValueError as error:  # a quotation mark that is not closed
            raise UsageError(f"%%scene: {error} in `{line}`") from None
        if given.name is not None and not given.name.isidentifier():
            raise UsageError(f"%%scene: `{given.name}` is not a valid Python name; options start with a dash")
        shell: Any = self.shell
        for name in (*LEFT, *([given.name] if given.name else [])):
            shell.user_ns.pop(name, None)  # variables defined by an earlier cell
        source = Source(given.name or "<cell>", cell)
        loaded = load_source(source, Path(), None, given.p, given.plugin, given.model)
        shell.user_ns["scene"] = loaded
        report = loaded.run(given.model or None, stated=given.stated)
        shell.user_ns |= {"report": report} | ({given.name: report} if given.name else {})
        _show(report, getattr(shell, "kernel", None) is not None)


def _show(report: RunReport, notebook: bool) -> None:
    """Show the report in a notebook, or its table in a terminal."""
    if notebook:
        display(report)  # type: ignore[no-untyped-call]
        return
    from softmark.interpreter.report.run import report_terminal

    sys.stdout.write(report_terminal.table(report, sys.stdout.isatty()) + "\n")


def register(shell: InteractiveShell) -> None:
    """Add the magic `%%scene` to an IPython shell."""
    shell.register_magics(SceneMagics)
