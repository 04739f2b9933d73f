"""Export formats of a model, one module each, with `refuses(problem)` and `export(problem, named, folder)`.

`refuses` returns features of a problem that the format cannot express, with reasons; `export` writes files and
returns their names. A format with separate entries for surface loads also has `unsupported_loads(problem,
named)`, which returns the loads that it cannot express. To add a format: a module, and a line in this one.
Adapters of programs write the same files.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

from softmark.records import dataclass


@dataclass(frozen=True)
class Format:
    """Export format: its module, description, unit of lengths, and system of units."""

    module: str
    what: str
    unit: str = "1m"
    mesh: bool = False  # the format contains only a mesh
    moves: bool = False  # the format contains only motions
    by_name: bool = False  # whether its module has `unsupported_loads`
    units: str = "m, kg, s, N and Pa"

    def unit_of(self, si: str) -> str:
        """Return the unit, in files of this format, of a quantity whose SI unit is `si`."""
        return OF_MM.get(si, si) if self.units == MM else si


MM = "mm, g and s: forces uN (micronewtons), stresses Pa, energies nJ, densities g/mm^3"
OF_MM = {"m": "mm", "m^2": "mm^2", "m^3": "mm^3", "N": "uN", "N*m": "nN*m", "J": "nJ"}  # uN = g*mm/s^2

FORMATS: dict[str, Format] = {
    "calculix": Format("adapters.calculix", "an input deck; run it with `ccx -i job`", "1mm", units=MM),
    "febio": Format(
        "exporters.febio_exporter",
        "a deck; run it with `febio4 -i model.feb`; tested only as text, without the program",
        "1mm",
        units=MM,
    ),
    "gmsh": Format(
        "exporters.gmsh_exporter",
        "the mesh as Gmsh 4.1, with materials, supports and loads as physical groups",
        mesh=True,
    ),
    "mujoco": Format("exporters.mujoco_exporter", "a model; `simulate model.xml` shows it in motion", moves=True),
    "polyfem": Format(
        "exporters.polyfem_exporter",
        "a deck; run it with `PolyFEM_bin --json model.json`; tested only as text, without the program",
        by_name=True,
    ),
    "sofa": Format(
        "exporters.sofa_exporter",
        "a scene; run it with `runSofa -g batch -n 1 model.scn`; tested only as text, without the program",
    ),
    "vtu": Format(
        "exporters.vtu_exporter",
        "the mesh as VTU, with nodal forces, supported nodes and imposed displacements",
        mesh=True,
    ),
}


def import_format(name: str) -> Any:
    """Return the module of a format by its name. Raises KeyError if it is unknown."""
    return import_module(f"softmark.interpreter.models.external.{FORMATS[name].module}")
