"""What the cache of kernels takes from numba's private classes is there, and numba's version is bounded.

To allow a newer numba: install it, run this file and test_kernel_cache.py, and raise the bound in pyproject.toml.
"""

from __future__ import annotations

import ast
import inspect
import re
import tomllib
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numba
import numpy as np
import pytest

from softmark.solvers.runtime import kernel_cache

ROOT = Path(__file__).parents[2]
TREE = ast.parse(Path(kernel_cache.__file__).read_text(encoding="utf-8"))
SAID = f"numba {numba.__version__} is not what solvers/runtime/kernel_cache.py was written for"


def private() -> list[tuple[str, str]]:
    """Return the attributes of numba.core modules that the text of kernel_cache.py uses, as (module, attribute)."""
    imported = {
        (alias.asname or alias.name).lstrip("_")
        for node in ast.walk(TREE)
        if isinstance(node, ast.ImportFrom) and node.module == "numba.core"
        for alias in node.names
    }
    return sorted(
        {
            (node.value.id, node.attr)
            for node in ast.walk(TREE)
            if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id in imported
        }
    )


def overridden() -> list[tuple[type, type, str]]:
    """Methods of our classes that numba calls: (ours, numba's, name)."""
    ours = [c for c in vars(kernel_cache).values() if inspect.isclass(c) and c.__module__ == kernel_cache.__name__]
    return [
        (cls, base, name)
        for cls in ours
        for base in cls.__mro__[1:]
        if base.__module__.startswith("numba.")
        for name, value in vars(cls).items()
        if name in vars(base) and inspect.isroutine(inspect.unwrap(getattr(value, "__func__", value)))
    ]


def test_something_is_looked_at() -> None:
    assert {("caching", "FunctionCache"), ("runtime", "rtsys"), ("serialize", "dumps")} <= set(private())
    assert {"load_overload", "_index_key", "from_function"} <= {name for _, _, name in overridden()}


@pytest.mark.parametrize(("module", "name"), private())
def test_numba_has_what_the_cache_is_made_of(module: str, name: str) -> None:
    assert hasattr(getattr(kernel_cache, module), name), f"{SAID}: numba.core.{module}.{name} is gone"


@pytest.mark.parametrize(("ours", "theirs", "name"), overridden())
def test_numba_calls_our_methods_as_it_did(ours: Any, theirs: Any, name: str) -> None:
    mine, known = (len(inspect.signature(inspect.unwrap(getattr(c, name))).parameters) for c in (ours, theirs))
    assert mine == known, f"{SAID}: {theirs.__qualname__}.{name} takes {known} arguments, ours {mine}"


def test_a_cache_has_the_parts_that_ours_reaches_for() -> None:
    """Beside classes: the members of one that is made."""
    made = kernel_cache._KernelCache(kernel_cache.kernel_digest)
    lacking = [n for n in ("_cache_path", "_cache_file", "_impl", "_py_func") if not hasattr(made, n)]
    lacking += [n for n in ("_guard_against_spurious_io_errors", "_load_overload") if not hasattr(made, n)]
    assert lacking == [], SAID
    assert hasattr(made._impl, "filename_base"), SAID
    assert hasattr(kernel_cache.runtime.rtsys, "initialize"), SAID
    assert callable(kernel_cache._CacheLocator.get_suitable_cache_subpath), SAID


def test_the_cache_is_the_one_that_numba_asks() -> None:
    """A kernel that is compiled is kept through ours: numba has asked it, for a key with ours at its end."""
    asked = []

    class Listening(kernel_cache._KernelCache):
        def load_overload(self, sig: Any, target_context: Any) -> Any:
            asked.append("load")

        def save_overload(self, sig: Any, data: Any) -> None:
            asked.append("save")

    kernel = numba.njit(lambda x: x + 1.0)
    kernel._cache = Listening(kernel.py_func)
    assert kernel(np.float64(1.0)) == 2.0
    assert asked == ["load", "save"], SAID


def test_numba_is_bounded_to_versions_that_were_tried() -> None:
    config = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    (asked,) = (d for d in config["project"]["dependencies"] if d.startswith("numba"))
    bounds = re.fullmatch(r"numba>=0\.(\d+),<0\.(\d+)", asked)
    assert bounds is not None, "private classes are used: a minor version that nobody tried may have others"
    major, minor = (int(n) for n in version("numba").split(".")[:2])
    assert major == 0
    assert int(bounds[1]) <= minor < int(bounds[2])
