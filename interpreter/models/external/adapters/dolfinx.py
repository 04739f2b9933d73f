"""DOLFINx: UFL forms, compiled, with PETSc's Newton iteration (SNES), in any Python that has the package.

DOLFINx is not on the package index that pip uses. If SOFTMARK_DOLFINX_PYTHON is set, only the Python that it names is
searched for the package. Otherwise our own Python is searched first, then each `python3` on the PATH and that of the
system, in a process that does not import the package. The found Python runs `dolfinx_driver.py`, which imports nothing
of softmark.
Source: Baratta, Dean, Dokken, Habera, Hale, Richardson, Rognes, Scroggs, Sime, Wells (2023), DOLFINx: the next
generation FEniCS problem solving environment, doi:10.5281/zenodo.10447666.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator, Sequence
from functools import cache
from pathlib import Path

import numpy as np

from softmark.interpreter.models.external.adapters import package_process
from softmark.interpreter.models.external.external_problem import NoAnswer, Problem
from softmark.records import dataclass

VARIABLE = "SOFTMARK_DOLFINX_PYTHON"
SYSTEM = "/usr/bin/python3"  # Python of Debian's package, which need not be on the PATH
install = (
    "run `apt-get install python3-dolfinx-real` (Debian, Ubuntu) or `conda install -c conda-forge "
    f"fenics-dolfinx`; every `python3` on the PATH is searched, or only the Python that {VARIABLE} "
    "names"
)

PACKAGE = package_process.Package(__name__, "dolfinx", "fenics-dolfinx", "")
refuses, read = PACKAGE.refuses, PACKAGE.read

DRIVER, CELL = "dolfinx_driver.py", "cell.npz"
PATIENCE = 20.0  # s that a Python may take to report whether it has DOLFINx
PROBE = """import json
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec
spec, number = find_spec("dolfinx"), "of a folder"
try:
    number = version("fenics-dolfinx")
except PackageNotFoundError:
    pass
print(json.dumps(None if spec is None else [number, list(spec.submodule_search_locations or ())]))
"""


@dataclass(frozen=True)
class DolfinxInstallation:
    """Python that has DOLFINx: its executable, the version of DOLFINx, and the folders that it is imported from."""

    python: str
    version: str
    folders: tuple[str, ...]


def version() -> str | None:
    """Return the version of DOLFINx in the Python that has it; None if no Python has it."""
    found = _find_installation()
    return None if found is None else found.version


def places() -> tuple[Path, ...]:
    """Return the path of the Python that has DOLFINx, and the folders of DOLFINx; empty if it is not installed."""
    found = _find_installation()
    return () if found is None else tuple(map(Path, (found.python, *found.folders)))


def write(problem: Problem, folder: Path) -> None:
    """Write the problem, our nodes and quadrature points in the reference cell, and the script that solves it."""
    from softmark.solvers.elements import element_of

    PACKAGE.write(problem, folder)
    element = element_of(problem.element)
    nodes, (xi, w) = element.places(), element.quadrature()
    if problem.element.startswith("hex"):  # from [-1, 1]^3 to [0, 1]^3
        nodes, xi, w = 0.5 * (nodes + 1.0), 0.5 * (xi + 1.0), w / 8.0
    np.savez(folder / CELL, nodes=nodes, xi=xi, w=w)
    shutil.copyfile(Path(__file__).with_name(DRIVER), folder / DRIVER)


def command(folder: Path) -> Sequence[str]:
    """Return the command: the Python that has DOLFINx, with a copy of the script in the folder.

    The script is copied because a module in its own folder has the name of DOLFINx.
    """
    found = _find_installation()
    if found is None:
        raise NoAnswer(f"no Python has it: {install}")
    return [found.python, str(folder / DRIVER), str(folder)]


def _find_installation() -> DolfinxInstallation | None:
    """Return the first Python that has DOLFINx; None if no Python has it."""
    return _first_with_dolfinx(tuple(candidates()))


def candidates() -> Iterator[str]:
    """Yield the Python executables in which DOLFINx is searched, in order, each once."""
    if named := os.environ.get(VARIABLE):
        yield shutil.which(named) or named
        return
    folders = [Path(folder) for folder in os.get_exec_path() if Path(folder).is_absolute()]
    yield from dict.fromkeys((sys.executable, *(str(f / "python3") for f in folders), SYSTEM))


@cache
def _first_with_dolfinx(pythons: tuple[str, ...]) -> DolfinxInstallation | None:
    """Return the first of these Python executables that has DOLFINx; None if none has it."""
    return next((found for python in pythons if (found := find_dolfinx(python)) is not None), None)


def find_dolfinx(python: str) -> DolfinxInstallation | None:
    """Return the DOLFINx of a Python; None if it has none or is not a Python.

    Our own Python is inspected without starting a process.
    """
    if python == sys.executable:
        number = PACKAGE.version()
        return None if number is None else DolfinxInstallation(python, number, tuple(map(str, PACKAGE.places())))
    if not os.access(python, os.X_OK):
        return None
    try:
        said = subprocess.run(
            [python, "-c", PROBE], cwd="/", capture_output=True, text=True, timeout=PATIENCE, check=True
        ).stdout
        found = json.loads(said)
        return None if found is None else DolfinxInstallation(python, str(found[0]), tuple(map(str, found[1])))
    except (OSError, ValueError, TypeError, LookupError, subprocess.SubprocessError):
        return None
