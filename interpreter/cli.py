"""The command `dsl`: arguments, exit statuses, and nothing imported before it is needed.

Exit statuses: 0 all well, 1 an expectation not met, 2 the command line or a scene in error, 3 a model or reference
failed or did not converge, 70 a defect of softmark itself, 130 interrupted.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence

COMMANDS: dict[str, tuple[str, str]] = {  # name: (module below softmark.interpreter.commands, summary)
    "check": ("check", "parse, resolve, check dimensions and applicability; run nothing"),
    "plan": ("plan", "show what would be built, and which line asks for it"),
    "run": ("run", "run a scene and write its report"),
    "compare": ("compare", "compare models and settings: error, time, the Pareto front, a recommendation"),
    "explain": ("explain", "explain a word of the language or a diagnostic code"),
    "list": ("listing", "list models, materials, references, metrics, shapes, scenes, codes, ..."),
    "new": ("new", "print a commented starter scene"),
    "fmt": ("fmt", "rewrite scenes in canonical form"),
    "completion": ("completion", "print the completion script of a shell"),
}


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command; the value is the exit status."""
    arguments = list(sys.argv[1:] if argv is None else argv)
    try:
        status = _dispatch(arguments)
        sys.stdout.flush()
        return _forgetting_signals(status)
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        return _forgetting_signals(130)
    except BrokenPipeError:  # the reader of a pipe has gone, as in `dsl list | head`
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except Exception as error:
        if os.environ.get("SOFTMARK_DEBUG"):
            raise
        print(
            f"error: softmark itself failed ({type(error).__name__}: {error})"
            "\nThis is a defect: please report it with the scene. SOFTMARK_DEBUG=1 shows where it happened.",
            file=sys.stderr,
        )
        return 70


def _forgetting_signals(status: int) -> int:
    """The status, after making Python forget an interrupt that a library's `exec` let through.

    CPython remembers it and would end this process by a signal instead of by our status, although it was handled; it
    forgets at the next `exec` of a text.
    """
    if status == 130:
        exec("")
    return status


def _dispatch(arguments: list[str]) -> int:
    if arguments[:1] in (["--version"], ["-V"]):
        from softmark import __version__

        print(f"softmark {__version__}")
        return 0
    name = next((a for a in arguments if not a.startswith("-")), None)
    if name not in COMMANDS or arguments[0] in ("-h", "--help"):
        return _help(arguments, name)
    import argparse
    import importlib

    module = importlib.import_module(f"softmark.interpreter.commands.{COMMANDS[name][0]}")
    parser = argparse.ArgumentParser(prog=f"dsl {name}", description=COMMANDS[name][1], allow_abbrev=False)
    module.arguments(parser)
    parsed = parser.parse_intermixed_args(arguments[arguments.index(name) + 1 :])
    status: int = module.run(parsed)
    return status


def _help(arguments: list[str], name: str | None) -> int:
    """The overview; for an unknown command an error with the nearest one."""
    wanted = not arguments or arguments[0] in ("-h", "--help", "help")
    if name is not None and not wanted:
        from softmark.grammar.suggest import nearest

        close = nearest(name, COMMANDS)
        hint = f"did you mean `dsl {close}`?" if close else "`dsl --help` lists the commands"
        print(f"error: `{name}` is not a command of dsl; {hint}", file=sys.stderr)
        return 2
    if not wanted:
        print(
            f"error: `{arguments[0]}` is not an option of dsl; `dsl --help` lists the commands",
            file=sys.stderr,
        )
        return 2
    from softmark import __version__

    lines = "\n".join(f"  dsl {name:<11}{summary}" for name, (_, summary) in COMMANDS.items())
    print(
        f"softmark {__version__}: a scene language for assessing deformable models\n\n{lines}\n\n"
        "Start with `dsl run silicone-beam`, `dsl new > my.scene`, or `dsl COMMAND --help`."
    )
    return 0
