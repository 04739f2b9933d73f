"""Checks of arguments passed to `softmark` from Python: type, sign and range, with a single clear error message."""

from __future__ import annotations

import math
import os
from collections.abc import Iterable, Mapping
from numbers import Integral, Real
from pathlib import Path
from typing import Any, NoReturn

from softmark.interpreter.language.compiled_scene import SceneError

MOST = 1000  # largest count, as on the command line


class BadArgument(SceneError, ValueError):
    """Error for an invalid argument of `load`, `run`, `compare` or `robustness`."""

    def __init__(self, message: str) -> None:
        Exception.__init__(self, message)
        self.diagnostics = []

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), self.args


def raise_bad_argument(name: str, value: object, expected: str) -> NoReturn:
    """Raise BadArgument with the name, the given value and a description of the expected one."""
    shown = repr(value)
    shown = shown if len(shown) <= 60 else f"{shown[:57]}..."
    raise BadArgument(f"`{name}` must be {expected}, not {shown} ({type(value).__name__})")


def check_count(name: str, value: object, least: int = 1) -> int:
    """Return `value`, the value of the argument `name`, if it is a whole number from `least` to 1000. Raises
    BadArgument.
    """
    if isinstance(value, bool) or not isinstance(value, Integral) or not least <= int(value) <= MOST:
        raise_bad_argument(name, value, f"a whole number from {least} to {MOST}")
    return int(value)


def check_positive(name: str, value: object, unit: str, or_none: bool = False) -> float:
    """Return `value`, the value of the argument `name`, if it is a positive finite number. Raises BadArgument.

    None is accepted if `or_none`; `unit` is the unit that the error message gives.
    """
    if isinstance(value, bool) or not isinstance(value, Real) or not 0 < float(value) < math.inf:
        raise_bad_argument(name, value, f"a positive number of {unit}" + (" or None" if or_none else ""))
    return float(value)


def check_flag(name: str, value: object) -> bool:
    """Return `value`, the value of the argument `name`, if it is True or False. Raises BadArgument."""
    if not isinstance(value, bool):
        raise_bad_argument(name, value, "True or False")
    return value


def check_text(name: str, value: object, what: str) -> str:
    """Return `value`, the value of the argument `name`, if it is a string.

    Raises BadArgument, with `what` as the expected value.
    """
    if not isinstance(value, str):
        raise_bad_argument(name, value, what)
    return value


def check_path(name: str, value: object, what: str) -> Path:
    """Return `value`, the value of the argument `name`, as a path if it is a non-empty one.

    Raises BadArgument, with `what` as the expected value.
    """
    if not isinstance(value, str | os.PathLike) or not isinstance(os.fspath(value), str) or "\0" in os.fspath(value):
        raise_bad_argument(name, value, f"{what}, as a string or a path")
    if not os.fspath(value):
        raise_bad_argument(name, value, f"{what}, and not empty")
    return Path(os.fspath(value))


def check_paths(name: str, value: object) -> tuple[str, ...]:
    """Return `value`, the value of the argument `name`, as a tuple of files or names of installed plugins.

    `value` may be one or several of them. Raises BadArgument.
    """
    wanted = "a file or the name of an installed plugin, or a list of them"
    if isinstance(value, str | os.PathLike):
        value = (value,)
    if isinstance(value, Mapping | bytes) or not isinstance(value, Iterable):
        raise_bad_argument(name, value, wanted)
    return tuple(os.fspath(check_path(name, one, wanted)) for one in value)


def check_models(value: object) -> tuple[str, ...]:
    """Return `value`, the value of the argument `models`, as a tuple of names. Raises BadArgument.

    `value` may be one or several names.
    """
    wanted = "the name of a model, or a list of names"
    if isinstance(value, str):
        return (value,)
    if isinstance(value, Mapping | bytes) or not isinstance(value, Iterable):
        raise_bad_argument("models", value, wanted)
    names = tuple(value)
    for name in names:
        check_text("models", name, wanted)
    return names


def format_override(name: str, value: object) -> str:
    """Return the override `L=120 mm` for the parameter `name`.

    The value is a text as on the command line, a number or a pint quantity. Raises BadArgument.
    """
    from softmark.interpreter.api import pint_quantities

    written = value if isinstance(value, str) else None
    if pint_quantities.is_quantity(value):
        written = pint_quantities.quantity_text(value)
    elif isinstance(value, Real) and not isinstance(value, bool) and math.isfinite(float(value)):
        written = repr(int(value)) if isinstance(value, Integral) else repr(float(value))
    if written is None:
        raise_bad_argument(
            name, value, 'a parameter value: a string such as "120 mm", a quantity, or a number if it has no unit'
        )
    return f"{name}={written}"


def format_variations(value: object) -> tuple[str, ...]:
    """Return the text `h=10 mm,5 mm` for each entry of a mapping from names to values. Raises BadArgument."""
    from softmark.interpreter.api.pint_quantities import is_quantity

    wanted = 'a dict of names to values, such as {"h": ["10 mm", "5 mm"]}'
    if value is None:
        return ()
    if not isinstance(value, Mapping):
        raise_bad_argument("vary", value, wanted)
    found = []
    for name, values in value.items():
        check_text("vary", name, wanted)
        several = [values] if isinstance(values, str | Real) or is_quantity(values) else values
        if not isinstance(several, Iterable) or isinstance(several, Mapping | bytes):
            raise_bad_argument("vary", value, wanted)
        given = [format_override(name, v).partition("=")[2] for v in several]
        if not given:
            raise_bad_argument("vary", value, f"{wanted}, without empty lists")
        found.append(f"{name}={','.join(given)}")
    return tuple(found)


def check_resume_and_fresh(resume: object, fresh: object) -> tuple[bool, bool]:
    """Return the arguments `resume` and `fresh`, of which at most one may be True. Raises BadArgument."""
    if check_flag("resume", resume) and check_flag("fresh", fresh):
        raise BadArgument("`resume` continues earlier results and `fresh` discards them: give only one")
    return bool(resume), check_flag("fresh", fresh)
