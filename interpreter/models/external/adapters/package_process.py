"""Adapter base for Python packages: each package solves in a separate process, from a folder with the problem.

    python -P -m softmark.interpreter.models.external.adapters.NAME FOLDER
No package is imported in this process. Arrays are stored as .npz without pickles, everything else as JSON.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import fields, replace
from importlib.metadata import PackageNotFoundError
from importlib.metadata import version as version_of
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from softmark.interpreter.models.external.external_problem import (
    Answer,
    ExternalMaterial,
    ExternalNotConverged,
    Motion,
    NoAnswer,
    Problem,
    Section,
)
from softmark.records import dataclass

ASKED, TOLD = "problem", "answer"  # two files of each name
ARRAYS = ("points", "cells", "held", "values", "forces")
MOVING = ("after", "masses")  # arrays of a motion
SECTION = ("area", "stiffness", "inertia", "axes")  # of a rod


@dataclass(frozen=True)
class Package:
    """Python package that solves problems in a separate process.

    It has the module name of its adapter, its import and distribution names, and our extra that installs it.
    """

    module: str
    imported: str
    distributed: str
    extra: str

    @property
    def install(self) -> str:
        """Text on how to install the package."""
        return f"pip install 'softmark[{self.extra}]'"

    def version(self) -> str | None:
        """Return the version of the package, without importing it; None if it is not installed."""
        if find_spec(self.imported) is None:
            return None
        try:
            return version_of(self.distributed)
        except PackageNotFoundError:  # a folder on the path
            return "of a folder"

    def places(self) -> tuple[Path, ...]:
        """Return the folders, or the file, that the package is imported from; empty if it is not installed."""
        if (spec := find_spec(self.imported)) is None:
            return ()
        return tuple(map(Path, spec.submodule_search_locations or [spec.origin or ""]))

    def refuses(self, problem: Problem) -> list[tuple[str, str]]:
        """Return no further unsupported features, because the table of programs already lists all of them."""
        return []

    def write(self, problem: Problem, folder: Path) -> None:
        """Write the problem to a folder for the separate process."""
        arrays = {name: getattr(problem, name) for name in ARRAYS}
        arrays |= {f"stuff{i}": stuff.cells for i, stuff in enumerate(problem.stuff)}
        if (motion := problem.motion) is not None:
            arrays |= {name: getattr(motion, name) for name in MOVING}
        if (section := problem.section) is not None:
            arrays |= {name: getattr(section, name) for name in SECTION}
        np.savez(folder / f"{ASKED}.npz", **arrays)
        stuff = [{"law": s.law, "constants": dict(s.constants), "density": s.density, "choices": dict(s.choices)}
                 for s in problem.stuff]  # fmt: skip
        words = {"element": problem.element, "strain": problem.strain, "shares": problem.shares,
                 "tolerance": problem.tolerance, "stuff": stuff}  # fmt: skip
        if motion is not None:
            words["motion"] = {f.name: getattr(motion, f.name) for f in fields(motion) if f.name not in MOVING}
        (folder / f"{ASKED}.json").write_text(json.dumps(words))

    def command(self, folder: Path) -> Sequence[str]:
        """Return the command that runs the adapter's module in this Python."""
        return [sys.executable, "-P", "-m", self.module, str(folder)]

    def read(self, folder: Path) -> Answer:
        """Return the results that the separate process has written. Raises NoAnswer."""
        try:
            said = json.loads((folder / f"{TOLD}.json").read_text())
            if (why := said.get("why")) is not None:
                raise (ExternalNotConverged if said.get("unsettled") else NoAnswer)(str(why))
            with np.load(folder / f"{TOLD}.npz", allow_pickle=False) as found:
                u = np.asarray(found["u"], dtype=np.float64)
                arrays = [n for n in ("steps_s", "turned") if n in found]
                more: dict[str, Any] = {n: np.asarray(found[n], dtype=np.float64) for n in arrays}
            clocks = {str(name): float(spent) for name, spent in said["clocks"].items()}
            return Answer(u, said["settled"], said["iterations"], clocks, str(said["said"]), **more,
                          unsolved=int(said.get("unsolved", 0)))  # fmt: skip
        except FileNotFoundError as none:
            raise NoAnswer("it wrote no result") from none
        except (OSError, ValueError, KeyError, TypeError, AttributeError) as broken:
            raise NoAnswer(f"its result cannot be read ({type(broken).__name__})") from broken


def read_problem(folder: Path) -> Problem:
    """Return the problem that `Package.write` has written to a folder."""
    words = json.loads((folder / f"{ASKED}.json").read_text())
    with np.load(folder / f"{ASKED}.npz", allow_pickle=False) as arrays:
        stuff = tuple(ExternalMaterial(cells=arrays[f"stuff{i}"], **own) for i, own in enumerate(words["stuff"]))
        known = {name: arrays[name] for name in ARRAYS}
        moving = {name: arrays[name] for name in MOVING if name in arrays}
        section = Section(**{name: arrays[name] for name in SECTION}) if "area" in arrays else None
    alike = {name: words[name] for name in ("element", "strain", "tolerance")}
    motion = Motion(**words["motion"], **moving) if "motion" in words else None
    return Problem(**known, **alike, stuff=stuff, shares=tuple(words["shares"]), motion=motion, section=section)


def moduli(problem: Problem) -> tuple[Any, Any]:
    """Return Lame's constants lam and mu of each cell, (m,) each, Pa."""
    lam, mu = np.empty(len(problem.cells)), np.empty(len(problem.cells))
    for stuff in problem.stuff:
        lam[stuff.cells], mu[stuff.cells] = stuff.lame
    return lam, mu


def main(solved: Callable[[Problem], Answer]) -> int:
    """Read the problem, solve it and write the results, in the separate process. Return the exit status.

    `io_s` in the results is the time of reading and writing files, s.
    """
    folder = Path(sys.argv[1])
    begin = time.perf_counter()
    problem = read_problem(folder)
    read = time.perf_counter() - begin
    try:
        answer = solved(problem)
    except NoAnswer as why:
        (folder / f"{TOLD}.json").write_text(
            json.dumps({"why": str(why), "unsettled": isinstance(why, ExternalNotConverged)})
        )
        return 0
    begin = time.perf_counter()
    more: dict[str, Any] = {"steps_s": answer.steps_s, "turned": answer.turned}
    np.savez(folder / f"{TOLD}.npz", u=answer.u, **{name: one for name, one in more.items() if one is not None})
    clocks = dict(answer.clocks) | {"io_s": read + time.perf_counter() - begin}
    answer = replace(answer, clocks=clocks)
    words = {name: getattr(answer, name) for name in ("settled", "iterations", "clocks", "said", "unsolved")}
    (folder / f"{TOLD}.json").write_text(json.dumps(words))
    return 0
