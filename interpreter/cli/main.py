"""Entry point of the command `dsl`: reads the arguments, runs a command, and returns the exit status.

Modules are imported only when they are needed. Exit statuses: 0 success; 1 an expectation not met or inverted cells in
a solution; 2 an error in the command line or a scene; 3 a model or reference failed or did not converge, or the machine
ran out of disk space, memory or files; 70 a defect of softmark itself; 130 interrupted; 143 terminated.
"""

from __future__ import annotations

import _signal  # type: ignore[import-not-found]  # built in: `signal` takes milliseconds to import
import os
import sys

_OURS = os.path.basename(sys.argv[0]) in ("dsl", "dsl.exe")
if _OURS and _signal.getsignal(_signal.SIGINT) is _signal.default_int_handler:
    _signal.signal(_signal.SIGINT, _signal.SIG_DFL)  # an interrupt during imports ends the process without a traceback

from collections.abc import Sequence  # noqa: E402
from contextlib import suppress  # noqa: E402

from softmark import pausing  # noqa: E402
from softmark.interpreter.cli import exit_signals  # noqa: E402

COMMANDS: dict[str, tuple[str, str]] = {  # name: (module below softmark.interpreter.cli.commands, summary)
    "check": (
        "check",
        "report the errors and warnings of a scene: syntax, names, units, limits of models; run nothing",
    ),
    "plan": ("plan", "list the meshes, solutions and results that `dsl run` would compute; run nothing"),
    "run": ("run", "run a scene and write its report"),
    "serve-report": (
        "serve_report",
        "show a report in a browser of this machine; the page reloads when the report changes",
    ),
    "compare": ("compare", "compare models and settings by error and time, and recommend one"),
    "judge": ("judge", "assess result files of other programs as if they were models of a scene"),
    "import": (
        "import_deck",
        "convert a mesh or an input deck of another program to a scene; list what is not converted",
    ),
    "robustness": ("robustness", "vary parameters to find where each model becomes wrong, and whether it warns there"),
    "stress": ("robustness", "an earlier name of `dsl robustness`"),
    "export": ("export", "write models as input files of another program, with a sheet of the requested results"),
    "conformance": ("conformance", "check that the models, metrics and other words of a plugin meet the requirements"),
    "board": (
        "board",
        "run every model on every case of a benchmark suite, and write a leaderboard as web pages",
    ),
    "explain": ("explain", "explain a word of the language or a diagnostic code"),
    "list": ("list_words", "list models, materials, references, metrics, shapes, scenes, codes, ..."),
    "new": ("new", "print a commented starter scene"),
    "docs": ("docs", "open the documentation in a browser, without network: tutorial, reference, gallery"),
    "fmt": ("fmt", "format scene files"),
    "editor": ("editor", "write the files that set up an editor for scenes: highlighting, language server"),
    "lsp": ("lsp", "start the language server, which editors call"),
    "completion": ("completion", "print the completion script of a shell"),
}
COMPUTING = frozenset(
    {"run", "judge", "compare", "robustness", "stress", "export", "conformance", "board", "import"}
)  # commands that load numpy, scipy and numba


def main(argv: Sequence[str] | None = None) -> int:
    """Run one `dsl` command and return its exit status."""
    if argv is None:  # a process of our own, and not a call from Python
        exit_signals.install_handlers()
        pausing.pause_collection()
        os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # see solvers/runtime/thread_limits.py
    arguments = list(sys.argv[1:] if argv is None else argv)
    status = _run_guarded(arguments)
    exit_signals.restore_handlers()
    return status


def _run_guarded(arguments: list[str]) -> int:
    """Run a command and return its exit status; every exception is reported and becomes an exit status."""
    try:
        status = _run_command(arguments)
        sys.stdout.flush()
        return _clear_pending_interrupt(status)
    except KeyboardInterrupt:
        _print_error("interrupted")
        return _clear_pending_interrupt(130)
    except BrokenPipeError:  # the reader of a pipe has gone, as in `dsl list | head`
        _redirect_to_null(1, 2)
        return 0
    except Exception as error:
        if os.environ.get("SOFTMARK_DEBUG"):
            raise
        if said := exit_signals.exhausted_resource(error):
            _redirect_to_null(1)
            _print_error(f"error: {said}")
            return 3
        if said := _plugin_error_message(error):
            _print_error(f"error: {said}")
            return 3
        _print_error(
            f"error: softmark itself failed ({type(error).__name__}: {error})"
            "\nThis is a defect: please report it with the scene. SOFTMARK_DEBUG=1 shows where it happened."
        )
        return 70


def _plugin_error_message(error: Exception) -> str | None:
    """Return a message if the exception comes from the code of a plugin, else None."""
    plugins = sys.modules.get("softmark.interpreter.language.loaded_plugin")
    said = plugins.find_faulty_plugin(error) if plugins else None
    return f"{said}\n`dsl conformance` checks all of a plugin." if said else None


def _print_error(text: str) -> None:
    """Print an error message on standard error; do nothing if that fails."""
    try:
        print(text, file=sys.stderr, flush=True)
    except OSError:  # the disk is full, or no process reads the pipe
        _redirect_to_null(2)


def _redirect_to_null(*descriptors: int) -> None:
    """Redirect standard streams to the null device.

    Otherwise buffers that cannot be written would be flushed again, and fail again, at exit.
    """
    for descriptor in descriptors:
        with suppress(OSError, ValueError):
            stream = sys.stdout if descriptor == 1 else sys.stderr
            if stream.fileno() == descriptor:  # the language server prints on standard error alone
                os.dup2(os.open(os.devnull, os.O_WRONLY), descriptor)


def _clear_pending_interrupt(status: int) -> int:
    """Clear an interrupt that CPython still remembers, and return the exit status unchanged.

    CPython remembers an interrupt that a library's `exec` let through, and would end this process by a signal instead
    of our exit status, although the interrupt was handled. It forgets the interrupt at the next `exec` of a text.
    """
    if status == 130:
        exec("")
    return status


def _run_command(arguments: list[str]) -> int:
    if arguments[:1] in (["--version"], ["-V"]):
        from softmark import __version__

        print(f"softmark {__version__}")
        return 0
    name = next((a for a in arguments if not a.startswith("-")), None)
    if name not in COMMANDS or arguments[0] in ("-h", "--help"):
        return _help(arguments, name)
    if name in COMPUTING and (said := exit_signals.memory_shortage()):
        print(f"error: {said}", file=sys.stderr)
        return 3
    import argparse
    import importlib

    module = importlib.import_module(f"softmark.interpreter.cli.commands.{COMMANDS[name][0]}")
    parser = argparse.ArgumentParser(prog=f"dsl {name}", description=COMMANDS[name][1], allow_abbrev=False)
    if name in COMPUTING - {"run"}:  # `run` reports itself when it has loaded its modules
        pausing.resume_collection()
    module.arguments(parser)
    parsed = parser.parse_intermixed_args(arguments[arguments.index(name) + 1 :])
    status: int = module.run(parsed)
    return status


def _help(arguments: list[str], name: str | None) -> int:
    """Print the overview of commands, or an error message that suggests the closest command for an unknown one."""
    wanted = not arguments or arguments[0] in ("-h", "--help", "help")
    if name is not None and not wanted:
        from softmark.grammar.diagnostic import make_visible
        from softmark.grammar.name_suggestions import nearest

        close = nearest(name, COMMANDS)
        hint = f"did you mean `dsl {close}`?" if close else "`dsl --help` lists the commands"
        print(make_visible(f"error: `{name}` is not a command of dsl; {hint}"), file=sys.stderr)
        return 2
    if not wanted:
        print(
            f"error: `{arguments[0]}` is not an option of dsl; `dsl --help` lists the commands",
            file=sys.stderr,
        )
        return 2
    from softmark import __version__

    lines = "\n".join(f"  dsl {name:<13}{summary}" for name, (_, summary) in COMMANDS.items())
    print(
        f"softmark {__version__}: a scene language for assessing deformable models\n\n{lines}\n\n"
        "Start with `dsl run silicone-beam`, `dsl new > my.scene`, or `dsl COMMAND --help`."
    )
    return 0
