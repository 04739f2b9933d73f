"""Command `dsl import`: converts an input file of another program to a scene."""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from softmark.grammar.diagnostic import Diagnostic, make_visible
from softmark.interpreter.cli.commands.common_options import parse_file_name
from softmark.interpreter.cli.commands.scene_arguments import errors, load, show

if TYPE_CHECKING:
    from softmark.interpreter.importers.imported_deck import NotImported
    from softmark.interpreter.importers.scene_writer import WrittenScene


def arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `dsl import`.

    `FILE [--out FILE.scene] [--units SYSTEM | --unit 1mm --stress 1MPa --time 1s] [--material M] [--density D]`.
    """
    from softmark.interpreter.importers.deck_units import SYSTEMS
    from softmark.interpreter.importers.import_formats import TITLES

    parser.add_argument("file", type=parse_file_name, metavar="FILE", help=f"a mesh or a deck: {TITLES}")
    parser.add_argument(
        "--out", metavar="FILE.scene", help="the scene file; its mesh is written next to it (default: FILE's name)"
    )
    parser.add_argument("--units", metavar="SYSTEM", help=f"a consistent system of units: {', '.join(SYSTEMS)}")
    parser.add_argument("--unit", metavar="LENGTH", help="unit of length of the file, such as 1mm")
    parser.add_argument("--stress", metavar="STRESS", help="unit of stress of the file, such as 1MPa")
    parser.add_argument("--time", metavar="TIME", help="unit of time of the file, such as 1s")
    parser.add_argument("--material", metavar="LAW", help="material of cells without a law in the deck, as written "
                                                          "in scenes: 'neo_hookean(young = 1 MPa, poisson = 0.3, "
                                                          "density = 1000 kg/m^3)'")  # fmt: skip
    parser.add_argument("--at", metavar="TIME", type=float, help="for a deck with load curves: the time whose loads "
                                                                 "are imported, in the file's unit of time "
                                                                 "(default: its end)")  # fmt: skip
    parser.add_argument(
        "--density", metavar="DENSITY", help="density of materials without one in the deck, such as 1000kg/m^3"
    )


def run(parsed: argparse.Namespace) -> int:
    """Convert an input file to a scene file, and report the parts that could not be converted."""
    from softmark.interpreter.results.atomic_files import replace
    from softmark.safe_files import read_regular

    path = Path(parsed.file)
    target = Path(parsed.out or f"{path.stem}.scene")
    mesh = target.parent / (f"{target.stem}-mesh.inp" if path.suffix.lower() != ".msh" else path.name)
    try:
        found = _convert(parsed, path, mesh.name)
    except _ImportRefused as refused:
        show([refused.diagnostic])
        return 2
    try:
        own = mesh.is_file() and not mesh.is_symlink() and mesh.resolve() == path.resolve()
        if taken := [f for f in (target, mesh) if os.path.lexists(f) and not (f == mesh and own)]:
            print(make_visible(f"error: {taken[0]} exists already; choose another scene with --out"), file=sys.stderr)
            return 2
        if not own:
            data = read_regular(path) if found.mesh is None else found.mesh.encode("ascii")
            replace(mesh, data)
        replace(target, found.scene)
    except OSError as failure:
        print(make_visible(f"error: {target} cannot be written: {failure.strerror}"), file=sys.stderr)
        return 2
    for file in (target, mesh):
        print(make_visible(str(file)))
    problems = errors(load(str(target))[1])
    show(
        [
            *_ended_load_warnings(path, found),
            *(_left_out_warning(path, what) for what in found.left),
            *(_assumption_warning(path, how) for how in found.taken),
            *_inverted_cell_warnings(path, found),
            *problems,
        ]
    )
    return 2 if problems else 0


class _ImportRefused(Exception):
    def __init__(self, code: str, reason: str, remedy: str) -> None:
        super().__init__(reason)
        self.diagnostic = Diagnostic(code, make_visible(reason), None, None, help=make_visible(remedy))


def _convert(parsed: argparse.Namespace, path: Path, mesh: str) -> WrittenScene:
    """Return the scene converted from an input file. Raises _ImportRefused."""
    from softmark.interpreter.importers import deck_units, import_formats, scene_writer
    from softmark.interpreter.importers.imported_deck import NotImportable
    from softmark.references.measured_data import Unreadable

    try:
        given = any(text is not None for text in (parsed.units, parsed.unit, parsed.stress, parsed.time))
        told = deck_units.read_unit_options(parsed.units, parsed.unit, parsed.stress, parsed.time) if given else None
        density = (
            deck_units.parse_file_unit("--density", parsed.density, deck_units.DENSITY).text if parsed.density else None
        )
        deck = import_formats.read(path, parsed.at)
        return scene_writer.write_scene(
            deck,
            deck_units.agree_on_units(told, deck.units),
            scene_writer.SuppliedValues(parsed.material, density),
            mesh,
        )
    except Unreadable as error:
        raise _ImportRefused("E750", f"{error.name}: {error.reason}", error.remedy) from None
    except deck_units.MissingUnit as error:
        raise _ImportRefused("E751", error.reason, error.remedy) from None
    except deck_units.ContradictoryUnits as error:
        raise _ImportRefused("E757", f"{path.name}: {error.reason}", error.remedy) from None
    except scene_writer.MissingValue as error:
        raise _ImportRefused("E752", error.reason, error.remedy) from None
    except NotImportable as error:
        raise _ImportRefused(error.code, error.reason, error.remedy) from None


def _ended_load_warnings(path: Path, found: WrittenScene) -> list[Diagnostic]:
    """Return warnings about loads that are zero at the imported time but not before."""
    return [
        Diagnostic("W757", make_visible(f"{path.name}: {own.described}"), None, None,
                   help=f"the scene has 0 for it; `--at {own.when:g}` imports the time at which it is largest")
        for own in found.ended
    ]  # fmt: skip


def _inverted_cell_warnings(path: Path, found: WrittenScene) -> list[Diagnostic]:
    if found.turned is None:
        return []
    remedy = (
        "renumber their nodes if other programs refuse such cells; the scene reorders the nodes, which does "
        "not change the shape"
    )
    return [Diagnostic("W751", make_visible(f"{path.name}: {found.turned}"), None, None, help=remedy)]


def _assumption_warning(path: Path, how: str) -> Diagnostic:
    remedy = "the scene has this as a comment too; change the scene if the file means something else"
    return Diagnostic("W752", make_visible(f"assumed ({path.name}): {how}"), None, None, help=remedy)


def _left_out_warning(path: Path, left: NotImported) -> Diagnostic:
    place = path.name if left.line is None else f"{path.name}:{left.line}"
    return Diagnostic(
        "W750", make_visible(f"not carried over: {left.what} ({place})"), None, None, help=make_visible(left.why)
    )
