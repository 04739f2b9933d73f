"""Rooms in an order: each imports only those before it, wherever the import stands, and no modules import in a ring."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest
from statements import statements

ROOT = Path(__file__).parents[1]
ROOMS = {
    "interpreter": [
        "results", "language", "vocabulary", "problem", "metrics", "planning",
        "models",
        "validation", "verification", "pipeline", "study", "report", "importers", "help", "language_server",
        "documentation", "api", "cli",
    ],
    "solvers": [
        "runtime", "materials", "elements", "mesh", "energies", "sparse",
        "assembly", "contact", "stress_recovery", "linear", "statics", "dynamics", "model_reduction",
        "independent_forces", "api",
    ],
}  # fmt: skip
ENTRANCE = {"softmark.interpreter", "softmark.interpreter.__main__", "softmark.solvers"}
# What reads a scene, and what a model of finite elements says, are classes that know each other: types alone.
KNOWN_BY_TYPE = [
    {
        f"softmark.interpreter.language.{m}"
        for m in ("call_binding", "compiler", "expectation_conditions", "field_parsers", "sweep_values")
    },
    {f"softmark.interpreter.models.fem.{m}" for m in ("element_formulations", "solver_options", "fem_declaration")},
    {f"softmark.solvers.statics.{m}" for m in ("friction_iteration", "barrier_stiffness_ramp", "static_newton")},
    {
        f"softmark.solvers.dynamics.{m}"
        for m in [
            "critical_time_step",
            "damping",
            "dynamic_contact",
            "dynamic_forces",
            "dynamic_problem",
            "implicit_newton",
            "dynamic_system",
            "integrator",
            "lagged_tangent",
            "trapezoidal_rule",
        ]
    }
    | {"softmark.solvers.dynamics.rotational_inertia"},
]
LONGEST = 500  # lines of a file
MOST = 15  # modules of a folder that has no folders within
MANY = {  # and why
    "interpreter/language": "a step of reading is a file",
    "interpreter/validation": "what cannot be, of one kind of thing, is a file",
    "interpreter/metrics": "a metric is a file",
    "interpreter/models/external/adapters": "a program is a file",
    "interpreter/models/shared": "what models of all kinds do with one thing, a load or a support, is a file",
    "interpreter/cli/commands": "a command is a file, and what they share is beside them",
    "interpreter/report/run/tables": "a section of numbers is a file, and what they share is beside them",
    "solvers/materials": "a law is a file, and what they share is beside them",
    "solvers/dynamics": "an integrator is a file, and what they share is beside them",
    "solvers/statics": "a way to an equilibrium is a file, and what asks of one",
    "solvers/independent_forces": "the second formula for the forces of one kind of thing is a file",
    "references": "a reference is a file",
}


def modules() -> dict[str, Path]:
    """Every module of the rooms by its name."""
    found = {}
    for part in ROOMS:
        for file in sorted((ROOT / part).rglob("*.py")):
            inner = file.relative_to(ROOT / part).with_suffix("").parts
            if inner[0] != "softmark":
                name = ".".join(("softmark", part, *inner)).removesuffix(".__init__")
                found[name] = file
    return found


MODULES = modules()


def targets(node: ast.Import | ast.ImportFrom) -> Iterator[str]:
    """Modules of the rooms that a statement imports."""
    if isinstance(node, ast.Import):
        yield from (alias.name for alias in node.names if alias.name in MODULES)
    elif node.module:
        for alias in node.names:
            inner = f"{node.module}.{alias.name}"
            if inner in MODULES:
                yield inner
            elif node.module in MODULES:
                yield node.module


def imports(name: str) -> Iterator[tuple[str, bool]]:
    """What a module imports, at its top, in a function or for types alone; and whether for types alone."""
    found = list(statements(ast.parse(MODULES[name].read_text(encoding="utf-8"))))
    typing = {
        inner
        for node in found
        if isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING"
        for inner in node.body
    }
    for node in found:
        if isinstance(node, ast.Import | ast.ImportFrom):
            for target in targets(node):
                if target != name:
                    yield target, node in typing


@cache
def all_imports() -> dict[str, list[tuple[str, bool]]]:
    """What every module imports: found when a test asks, not when tests are collected."""
    return {name: list(imports(name)) for name in MODULES}


def room(name: str) -> tuple[str, int]:
    """The part of a module and the number of its room."""
    _, part, own, *_ = name.split(".")
    return part, ROOMS[part].index(own)


@pytest.mark.parametrize("part", ROOMS)
def test_every_module_is_in_a_room(part: str) -> None:
    folders = {f.name for f in (ROOT / part).iterdir() if f.is_dir() and any(f.glob("*.py"))} - {"softmark"}
    assert folders == set(ROOMS[part])
    loose = {f.name for f in (ROOT / part).glob("*.py")} - {"__init__.py", "__main__.py"}
    assert not loose, "put it into a room"


def test_a_room_imports_only_those_before_it() -> None:
    wrong = []
    for name in MODULES.keys() - ENTRANCE:
        part, own = room(name)
        for target, _ in all_imports()[name]:
            if target not in ENTRANCE:
                other, theirs = room(target)
                if other == part and theirs > own:
                    wrong.append(f"{name} -> {target}")
    assert wrong == []


def rings(typing: bool) -> list[set[str]]:
    """Groups of modules that import one another, by Tarjan's algorithm (1972)."""
    edges = {n: [t for t, typed in found if typing or not typed] for n, found in all_imports().items()}
    index: dict[str, int] = {}
    low: dict[str, int] = {}
    stack: list[str] = []
    found = []

    def visit(name: str) -> None:
        index[name] = low[name] = len(index)
        stack.append(name)
        for target in edges[name]:
            if target not in index:
                visit(target)
                low[name] = min(low[name], low[target])
            elif target in stack:
                low[name] = min(low[name], index[target])
        if low[name] == index[name]:
            ring = set()
            while name not in ring:
                ring.add(stack.pop())
            found.append(ring)

    for name in edges:
        if name not in index:
            visit(name)
    return [ring for ring in found if len(ring) > 1]


def test_no_modules_import_in_a_ring() -> None:
    assert rings(typing=False) == []


def test_rings_of_types_are_those_that_are_known() -> None:
    found = rings(typing=True)
    assert sorted(map(sorted, found)) == sorted(map(sorted, KNOWN_BY_TYPE))


@pytest.mark.parametrize("part", ROOMS)
def test_a_room_says_what_lives_there(part: str) -> None:
    for own in ROOMS[part]:
        text = ast.get_docstring(ast.parse((ROOT / part / own / "__init__.py").read_text(encoding="utf-8")))
        assert len(text or "") > 40, f"{part}/{own}/__init__.py"


@pytest.mark.parametrize("part", ROOMS)
def test_the_map_for_contributors_names_every_room_in_its_order(part: str) -> None:
    text = (ROOT / ".github" / "CONTRIBUTING.md").read_text(encoding="utf-8")
    found = re.search(rf"^{part}/ .*\n((?:  .*\n)+)", text, re.MULTILINE)
    assert found is not None
    assert re.findall(r"\w+", re.sub(r"\([^)]*\)", "", found[1])) == ROOMS[part]


def test_files_are_short_and_folders_small() -> None:
    folders: dict[str, int] = {}
    for part in (*ROOMS, "references", "grammar"):
        for file in (ROOT / part).rglob("*.py"):
            length = len(file.read_text(encoding="utf-8").splitlines())
            assert length <= LONGEST, f"{file} has {length} lines"
            folders.setdefault(file.parent.relative_to(ROOT).as_posix(), 0)
            folders[file.parent.relative_to(ROOT).as_posix()] += file.name != "__init__.py"
    deep = {f for f in folders if any(other.startswith(f + "/") for other in folders)}
    assert {f for f, count in folders.items() if count > MOST and f not in deep} == set(MANY)
