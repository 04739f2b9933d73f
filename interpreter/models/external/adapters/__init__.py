"""Adapters of external programs, one module each, and a table of the features that each program supports.

The table is in this module so that declarations import no adapter. An adapter is a module in this folder with the name
of its program, or a module of a plugin. It has
    install                    text on how to install the program
    version()                  version of the program, None if it is not installed
    places()                   files of the installed program on disk, from which changes of the program are detected
                               that its version number does not show (adapters in this folder only)
    refuses(problem)           unsupported features of a `Problem` beyond those of the table, with reasons
    write(problem, folder)     write the input; `problem.named` is set if the table entry has `by_name`
    command(folder)            command to run in the folder (external_process.py); output goes to `log.txt`
    read(folder)               return the `Answer`. Raises NoAnswer if there is none, ExternalNotConverged if the
    program reports that it did not converge
Adapters of Python packages get all of these from `package_process.py`, and add a function `solved(problem)` that runs
in a separate process. Adapters of programs on the PATH share `executables.py`. If `exporters` has a format for the
program, its adapter writes that format.
To add a program: an adapter, an entry in the table, and an extra in pyproject.toml if it is a Python package.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from importlib import import_module
from typing import Any

from softmark.records import dataclass


@dataclass(frozen=True)
class Program:
    """External program: its name, and the features of scenes that it can compute exactly."""

    title: str
    elements: tuple[str, ...]
    laws: Mapping[str, tuple[str, ...]]  # of each strain
    several: bool = True  # materials in one body
    stretches: bool = True  # of a rod: whether its length may change
    order: int = 1  # of a rod, in the length of its segments
    moves: str = ""  # description of what it computes, if it only integrates in time
    by_name: bool = False  # whether a problem must say what of it has a name
    # elements that it has of one strain alone, with the reason, by (element, strain) that it has not
    save: Mapping[tuple[str, str], str] = field(default_factory=dict)
    tried: bool = True  # whether its adapter was ever run with it; else with files that tests make


_SMALL = ("linear_elastic",)
_MODULI = ("st_venant_kirchhoff", "neo_hookean", "neo_hookean_isochoric", "mooney_rivlin", "yeoh")

PROGRAMS: Mapping[str, Program] = {
    "calculix": Program(
        "CalculiX",
        ("tet4", "tet10", "hex8", "hex20"),
        {"small": _SMALL, "finite": ("st_venant_kirchhoff", "neo_hookean_isochoric", "mooney_rivlin", "yeoh")},
    ),
    "dolfinx": Program(
        "DOLFINx",
        ("tet4", "tet10", "hex8", "hex27"),
        {"small": _SMALL, "finite": (*_MODULI, "stable_neo_hookean", "gent", "fung")},
    ),
    "febio": Program("FEBio", ("tet4", "hex8"), {"finite": ("st_venant_kirchhoff", "neo_hookean")}, tried=False),
    "felupe": Program(
        "FElupe",
        ("tet4", "tet10", "hex8", "hex20", "hex27"),
        {"small": _SMALL, "finite": ("neo_hookean", "neo_hookean_isochoric")},
        several=False,
    ),
    "mujoco": Program(
        "MuJoCo",
        ("tet4",),
        {"finite": _MODULI},
        several=False,
        moves="St Venant-Kirchhoff law with the initial moduli, lumped masses, one linear solve per step",
    ),
    "newton_vbd": Program(
        "Newton's VBD",
        ("tet4",),
        {"finite": _MODULI},
        several=False,
        moves="stable neo-Hookean law with the initial moduli, lumped masses, implicit Euler by block descent",
    ),
    "newton_xpbd": Program(
        "Newton's XPBD",
        ("tet4",),
        {"finite": _MODULI},
        several=False,
        moves="constraints tr C = 3 and J = 1 with compliances from the initial moduli, lumped masses, "
        "position-based dynamics",
    ),
    "ngsolve": Program("NGSolve", ("tet4", "tet10"), {"small": _SMALL}),
    "polyfem": Program(
        "PolyFEM",
        ("tet4", "tet10"),
        {"small": _SMALL, "finite": ("st_venant_kirchhoff", "neo_hookean")},
        by_name=True,
        save={("tet10", "finite"): "its quadrature may differ"},
        tried=False,
    ),
    "scikit_fem": Program("scikit-fem", ("tet4", "tet10", "hex8", "hex27"), {"small": _SMALL}),
    "sofa": Program(
        "SOFA",
        ("tet4",),
        {"small": _SMALL, "finite": ("st_venant_kirchhoff", "neo_hookean")},
        several=False,
        tried=False,
    ),
}


RODS: Mapping[str, Program] = {  # of `external_rod(...)`; a word of both is one module
    "mujoco": Program(
        "MuJoCo",
        (),
        {},
        several=False,
        stretches=False,
        order=2,
        moves="discrete elastic rod without stretch and shear, masses at nodes, one linear solve per step",
    ),
    "pyelastica": Program(
        "PyElastica",
        (),
        {},
        several=False,
        moves="Cosserat rod whose sections keep their volume, masses at nodes, rotations per segment, position Verlet",
    ),
}

PLUGGED: dict[str, tuple[Program, Any]] = {}  # programs of plugins by their words, each with its module


def program(name: str) -> Program:
    """Return the table entry of a program by its name in `external_solver(...)`. Raises KeyError if it is unknown."""
    return PROGRAMS.get(name) or PLUGGED[name][0]


def adapter(name: str) -> Any:
    """Return the adapter module of a program by its name. Raises KeyError if it is unknown."""
    return PLUGGED[name][1] if name in PLUGGED else import_module(f"{__name__}.{name}")
