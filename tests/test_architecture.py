"""The house: who imports whom, what lies at the root, what the package holds, and what starting up costs."""

from __future__ import annotations

import ast
import json
import os
import subprocess
import sys
import tomllib
from functools import cache
from pathlib import Path

import pytest
from statements import statements

ROOT = Path(__file__).parents[1]
FOLDERS = {
    "grammar": "grammar",
    "interpreter": "interpreter",
    "solvers": "solvers",
    "references": "references",
    "scenes": "stdlib-scenes",
}
MAY_IMPORT = {
    "grammar": {"grammar"},
    "solvers": {"solvers"},
    "references": {"references"},
    "scenes": {"scenes"},
    "interpreter": {"grammar", "interpreter", "solvers", "references", "scenes"},
}


def modules(folder: str) -> list[Path]:
    return sorted((ROOT / FOLDERS[folder]).rglob("*.py"))


@cache
def imported(file: Path) -> set[str]:
    """Every dotted name that a file imports, wherever in it, which several tests ask."""
    names = set()
    for node in statements(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            names.add("." * node.level + (node.module or ""))
            names.update(f"{node.module}.{alias.name}" for alias in node.names if node.module == "softmark")
    return names


@pytest.mark.parametrize("folder", FOLDERS)
def test_imports_follow_the_rule(folder: str) -> None:
    for file in modules(folder):
        for name in imported(file):
            assert not name.startswith("."), f"{file}: relative import {name}"
            assert name.split(".")[0] not in FOLDERS, f"{file}: {name} works only from the root"
            parts = name.split(".")
            if parts[0] == "softmark" and len(parts) > 1 and parts[1] in FOLDERS:
                assert parts[1] in MAY_IMPORT[folder], f"{file} imports {name}"


def test_a_material_sees_no_mesh_an_element_no_law_an_energy_no_time_step() -> None:
    forbidden = {
        "materials": ("mesh", "elements", "energies", "assembly", "statics", "dynamics", "sparse", "linear"),
        "elements": ("materials", "energies", "assembly", "statics", "dynamics", "sparse", "linear"),
        "energies": ("materials", "mesh", "assembly", "statics", "dynamics", "sparse", "linear"),
        "mesh": ("materials", "energies", "assembly", "statics", "dynamics", "sparse", "linear"),
        "sparse": ("materials", "elements", "mesh", "assembly", "statics", "dynamics"),
        # time knows forces and masses, and not what makes them
        "dynamics": (
            "materials",
            "elements",
            "mesh",
            "statics.static_equilibrium",
            "statics.static_newton",
            "statics.static_stability",
        ),
    }
    for folder, others in forbidden.items():
        for file in sorted((ROOT / "solvers" / folder).glob("*.py")):
            for name in imported(file):
                assert not any(name.startswith(f"softmark.solvers.{o}") for o in others), f"{file} imports {name}"


def test_the_root_holds_only_what_belongs_there() -> None:
    allowed = {*FOLDERS.values(), "tests", "pyproject.toml", "README.md", "LICENSE", "CHANGELOG.md"}
    tracked = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=False)
    if tracked.returncode:
        pytest.skip("not a git checkout")
    top = {line.split("/")[0] for line in tracked.stdout.splitlines()}
    assert {t for t in top if not t.startswith(".")} <= allowed


def test_every_subpackage_is_named_in_the_package_list() -> None:
    # setuptools does not recurse: what is not named is missing from the wheel without a word
    config = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["setuptools"]
    named = set(config["packages"])
    found = {"softmark"}
    for name, folder in FOLDERS.items():
        for init in sorted((ROOT / folder).rglob("__init__.py")):
            inner = init.parent.relative_to(ROOT / folder).parts
            if "softmark" not in inner:  # the public face lies inside interpreter/
                found.add(".".join(("softmark", name, *inner)))
    assert found == named


def test_every_data_file_is_in_the_wheel() -> None:
    config = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["setuptools"]
    covered = set()
    for package, patterns in config["package-data"].items():
        folder = ROOT / config["package-dir"].get(package, "")
        if package not in config["package-dir"]:
            parent = ".".join(package.split(".")[:2])
            folder = ROOT / config["package-dir"][parent] / Path(*package.split(".")[2:])
        for pattern in patterns:
            covered.update(folder.glob(pattern))
    for kind in ("*.lark", "*.scene", "*.css", "*.js"):
        for folder in FOLDERS.values():
            for file in (ROOT / folder).rglob(kind):
                assert file in covered, f"{file} is not package data"
    assert all(file in covered for file in (ROOT / "interpreter" / "help" / "codes").glob("*.md"))


def test_no_file_is_long() -> None:
    long = {
        f: n
        for d in (*FOLDERS.values(), "tests")
        for f in (ROOT / d).rglob("*.py")
        if (n := len(f.read_text().splitlines())) > 500
    }
    assert not long


# ------------------------------------------------------------------ start-up: what is not imported

HEAVY = ("numpy", "scipy", "numba", "meshio", "trimesh", "pygls", "lsprotocol")


def loaded_by(code: str, *arguments: str, cwd: Path | None = None) -> set[str]:
    """The modules that a fresh interpreter holds after `code`."""
    script = "\n".join(
        (
            "import sys, json, io, contextlib",
            "with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):",
            f"    {code}",
            "print(json.dumps(sorted(sys.modules)))",
        )
    )
    done = subprocess.run(
        [sys.executable, "-c", script, *arguments], capture_output=True, text=True, check=True, cwd=cwd
    )
    return set(json.loads(done.stdout.splitlines()[-1]))


def after(*command: str, cwd: Path | None = None) -> set[str]:
    return loaded_by(f"from softmark.interpreter.cli.main import main; main({list(command)!r})", cwd=cwd)


def test_version_imports_next_to_nothing() -> None:
    found = after("--version")
    assert not found & {
        *HEAVY,
        "lark",
        "argparse",
        "softmark.grammar.parser",
        "softmark.interpreter.language.field_schema",
    }


@pytest.mark.parametrize(
    "command",
    [
        ("--help",),
        ("list",),
        ("list", "models"),
        ("list", "scenes"),
        ("list", "codes"),
        ("explain", "fem"),
        ("explain", "E204"),
        ("check", "silicone-beam"),
        ("plan", "silicone-beam"),
        ("fmt", "--check", "silicone-beam"),
        ("new",),
        ("completion", "bash"),
    ],
)
def test_commands_that_compute_nothing_import_no_numerics(command: tuple[str, ...]) -> None:
    assert not after(*command) & set(HEAVY)


def test_help_of_what_computes_imports_no_numerics() -> None:
    for command in ("run", "compare", "board", "judge", "import"):
        code = "from softmark.interpreter.cli.main import main\n"
        code += f"try: main([{command!r}, '--help'])\nexcept SystemExit: pass"
        assert not loaded_by(f"exec({code!r})") & {*HEAVY, "distributed", "softmark.interpreter.study.comparison_study"}


def test_a_request_that_cannot_be_meant_is_refused_without_numerics(tmp_path: Path) -> None:
    assert not after("compare", "silicone-beam", "--vary", "nothing=3", cwd=tmp_path) & {*HEAVY, "distributed"}


def test_a_scene_with_a_beam_alone_makes_no_mesh_and_imports_no_kernel(tmp_path: Path) -> None:
    found = after("run", "silicone-beam", "--model", "rod", cwd=tmp_path)
    assert "softmark.solvers.energies.geometrically_exact_rod" in found
    meshes = {
        m
        for m in found
        if m.startswith("softmark.solvers.mesh")
        and m.removeprefix("softmark.solvers.mesh")
        not in (
            "",
            ".disjoint_shapes",
            ".arc_shapes",
            ".ellipsoidal_shells",
            ".boolean_shapes",
            ".conforming_planes",
            ".cell_counts",
            ".extruded_shapes",
            ".surface_bodies",
            ".plane_regions",
            ".rigid_shapes",
            ".polygons",
            ".revolved_bodies",
            ".cross_sections",
            ".shape",
            ".shapes",
            ".curved_boundary",
            ".shape_surfaces",
            ".spheres",
            ".tubes",
        )
    }
    assert not meshes
    assert not found & {
        "numba",
        "meshio",
        "trimesh",
        "softmark.solvers.runtime.kernel_cache",
        "softmark.solvers.energies.element_kernels",
        "softmark.solvers.energies.elastic_energy",
        "softmark.interpreter.models.fem.fem_builder",
        "softmark.interpreter.models.shared.rotating_supports",
        "softmark.interpreter.problem.theories.torsion_theory_setup",
        "softmark.interpreter.problem.theories.inclusion_theory_setup",
        "softmark.references.inclusion",
        "softmark.solvers.energies.rod_loads",
        "softmark.interpreter.models.beam.beam_dynamics",  # nor what moves
        "softmark.solvers.energies.incremental_rotation.moving_rods",
        "softmark.solvers.dynamics.rotational_inertia",
    }


@pytest.mark.parametrize(
    ("scene", "own"),
    [
        ("beams/silicone-beam", {"beam"}),
        ("round/torsion", {"torsion"}),
        ("blocks/relaxing-bars", {"bar", "relaxation"}),
    ],
)
def test_a_scene_imports_only_the_theories_of_its_references(scene: str, own: set[str], tmp_path: Path) -> None:
    found = after("check", str(ROOT / FOLDERS["scenes"] / f"{scene}.scene"), cwd=tmp_path)
    setups = {m.rpartition(".")[2] for m in found if m.endswith("_theory_setup")}
    assert setups == {f"{name}_theory_setup" for name in own}


def test_no_name_of_the_root_is_loaded_when_running_from_it() -> None:
    found = after("check", "silicone-beam", cwd=ROOT)
    assert not found & set(FOLDERS)


SCENES = sorted((ROOT / FOLDERS["scenes"]).rglob("*.scene"))
READ = {
    "carved-bodies",
    "organ",
    "silicone-beam-filled",
    "named-parts",
    "ring-of-a-file",
    "ironing",
    "thick-plate",
}  # of a surface or a mesh, which is looked at
CHECKED = """
import contextlib, io, os, sys
os.environ["SOFTMARK_DATA"] = "/nonexistent"
from softmark.interpreter.cli.main import main
command, never, scenes = sys.argv[1], sys.argv[2].split(","), sys.argv[3:]
for scene in scenes:
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
        assert main([command, scene]) == 0, scene
    if here := {n for n in never if n in sys.modules}:
        sys.exit(f"{command} {scene} loads {here}")
"""


@pytest.mark.parametrize("command", ["check", "plan"])
def test_checking_a_scene_imports_no_numerics_and_looks_for_no_data(command: str, tmp_path: Path) -> None:
    """Neither the network nor the folder of data sets is asked: a scene is text until it runs."""
    plain = [str(f) for f in SCENES if f.stem not in READ]
    never = [*HEAVY, "skimage", "urllib.request", "http.client"]
    done = subprocess.run(
        [sys.executable, "-c", CHECKED, command, ",".join(never), *plain], capture_output=True, text=True, cwd=tmp_path
    )
    assert done.returncode == 0, done.stderr
    assert list(tmp_path.iterdir()) == []


def test_listing_data_asks_no_network(tmp_path: Path) -> None:
    assert not after("list", "data", cwd=tmp_path) & {*HEAVY, "urllib.request", "http.client"}


@pytest.mark.slow
def test_a_scene_at_rest_imports_nothing_of_motion(tmp_path: Path) -> None:
    found = after("run", "uniaxial-stretch", cwd=tmp_path)
    assert not {m for m in found if m.startswith("softmark.solvers.dynamics")}
    assert "softmark.interpreter.models.procedures.dynamic_analysis" not in found
    assert not {m for m in found if m.startswith("softmark.solvers.stress_recovery")}  # it asks for no stress
    assert not found & {"trimesh", "skimage", "softmark.solvers.energies.spring_energy"}


def test_a_scene_without_contact_imports_nothing_of_contact(tmp_path: Path) -> None:
    """Neither what keeps surfaces clear, nor what looks at that again."""
    found = after("run", "uniaxial-stretch", cwd=tmp_path)
    shared = {
        f"softmark.interpreter.models.shared.{name}"
        for name in ("rigid_contact_setup", "self_contact_setup", "contact_limits")
    } | {"softmark.interpreter.models.postprocessing.rigid_friction_results"}
    checks = {
        f"softmark.interpreter.verification.{name}"
        for name in ("contact_forces_check", "contact_error", "self_contact_forces_check")
    }
    assert not found & (shared | checks)
    assert not {
        m
        for m in found
        if m.startswith(("softmark.solvers.contact", "softmark.solvers.independent_forces.rigid_contact_forces"))
    }


def test_the_names_of_the_lists_import_no_vocabulary() -> None:
    found = after("list")
    rooms = ("interpreter.vocabulary", "interpreter.models", "interpreter.metrics", "references", "solvers")
    assert not [m for m in found if m.startswith(tuple(f"softmark.{room}" for room in rooms))]


@pytest.mark.slow
def test_kernels_on_disk_are_loaded_without_the_compiler(tmp_path: Path) -> None:
    """And small work imports no library of scipy for one function: a tree of few points, a rule of three, SuperLU."""
    after("run", "silicone-beam", "--model", "corot_tet", cwd=tmp_path)  # compiles what is not there
    found = after("run", "silicone-beam", "--model", "corot_tet", cwd=tmp_path)
    assert not found & {
        "numba.np.linalg",
        "numba.np.arraymath",
        "numba.np.npyimpl",
        "numba.typed.typeddict",
        "scipy.linalg",
        "scipy.sparse.linalg",
        "scipy.spatial",
        "scipy.special",
    }


def test_a_folder_called_softmark_does_not_mix_in(tmp_path: Path) -> None:
    (tmp_path / "softmark").mkdir()
    (tmp_path / "softmark" / "grammar.py").write_text("raise SystemExit('wrong module')")
    environment = {k: v for k, v in os.environ.items() if k != "PYTHONPATH"}
    done = subprocess.run(
        [str(Path(sys.executable).parent / "dsl"), "check", "silicone-beam"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        env=environment,
        check=False,
    )
    assert done.returncode == 0, done.stderr


def test_messages_at_a_place_have_one_builder() -> None:
    """`Diagnostic(code, message, at.source, at.span, ...)` stood in 62 places, ten of them private functions for it."""
    built = []
    for file in sorted((ROOT / "interpreter").rglob("*.py")):
        text = file.read_text(encoding="utf-8")
        for node in ast.walk(ast.parse(text)) if "Diagnostic(" in text else ():
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "Diagnostic":
                source, span, *_ = [*node.args[2:4], None, None]
                if isinstance(source, ast.Attribute) and isinstance(span, ast.Attribute) and source.attr == "source":
                    built.append(file.relative_to(ROOT).as_posix())
    assert built == [
        "interpreter/language/message_builder.py",
        "interpreter/language/message_limit.py",
    ]  # where the last stood
