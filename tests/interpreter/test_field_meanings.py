"""A word of elsewhere is no slip of the finger: what is said of it is what is nearest in meaning, and never letters."""

from __future__ import annotations

import re
from collections import Counter

import pytest

import softmark
from softmark.interpreter.cli.main import COMMANDS, main
from softmark.interpreter.help.unknown_words import hint
from softmark.interpreter.help.word_pages import constructors, page
from softmark.interpreter.language.foreign_aliases import WORDS
from softmark.interpreter.language.foreign_words import TABLE, explain_foreign_word, load_foreign_words, normalize_word
from softmark.interpreter.validation.constructor_registry import CATALOGUE

# what people of the field type, by what each answer must speak of; judged one by one
TYPED = {
    "force(SUPPORT": "reaction reaction_force rf resultant",
    "tendon": "cable rope string suture actuator pneunet continuum_robot",
    "tetrahedralized": "stl obj ply off gltf stl_file surface_mesh",
    "mesh(...)": "msh vtk vtu inp exodus iges nurbs torus cad_file mesh_file",
    "viscoelastic": "viscosity creep relaxation maxwell zener plasticity yield hardening foam",
    "biphasic": "poroelastic darcy seepage fluid cfd fsi",
    "fibres": "fibre fiber anisotropic collagen muscle_fibre",
    "active": "muscle activation contraction hill_muscle",
    "only mechanics": "voltage magnetic piezo acoustic diffusion temperature heat thermal expansion",
    "`rigid_contact": "collision impact penetration master slave penalty lagrange mortar nitsche ipc",
    "self_contact": "self_collision",
    "friction": "coulomb stick frictionless rough",
    "tied": "adhesion tie weld glue mpc",
    "rigid": "rigid_body indenter tool joint hinge_joint revolute motor gripper robot arm grasp indentation",
    "half_space": "plane ground floor wall",
    "beam6dof": "truss pole catheter needle guidewire lattice",
    "hex20": "shell plate membrane cloth",
    "elastic_foundation": "damper dashpot winkler foundation spring robin",
    "symmetric": "symmetry symmetry_plane periodic rve",
    "components = z": "roller pin simply_supported",
    "torque": "couple twist bend",
    "pressure": "follower pneumatic suction wind",
    "centrifugal": "centrif coriolis",
    "gravity": "g_load inertial",
    "`traction": "point_load nodal_load cload dload push",
    "metric `stress": "mises piola principal tresca",
    "`strain(": "almansi deformation_gradient invariant jacobian",
    "radius": "diameter disc",
    "density": "totalmass inertia",
    "poisson": "lambda compliance incompressible K0",
    "extruded": "extrude revolve lathe",
    "difference": "boolean csg subtract",
    "rounded_box": "capsule",
    "tetrahedra": "wedge prism pyramid",
    "convergence": "remesh refine adaptive amr",
    "mesh_nodes": "node nset vertex",
    "group": "set subset",
    "formulation": "locking hourglass enhanced_strain",
    "`modal`": "mpm meshfree xfem peridynamics isogeometric pinn",
    "fem(...)": "fea finite_element",
    "torn": "fracture crack cutting tearing",
    "`linear`": "gmres petsc line_search newton",
    "realtime_factor": "xpbd pbd projective_dynamics vbd haptic gpu cuda mpi",
    "states": "increment load_step nlgeom_step substep",
    "strain = finite": "hyperelastic large_deformation geometric_nonlinearity",
    "integrator": "rk4 runge_kutta houbolt",
    "frequency": "eigenvalue vibration resonance harmonic",
    "Rayleigh": "rayleigh damping_ratio",
    "arc_length": "buckling riks snap_through",
    "tolerance": "residual rtol",
    "sweep": "calibration inverse optimise monte_carlo doe",
    "hausdorff": "dice iou chamfer_distance",
    "relative_l2_error": "h1 relative_error",
    "mean_error": "mse rmse",
    "ct_volume": "mri ultrasound segmentation nifti dicom",
    "icp": "registration alignment",
    "--json": "csv json yaml xml",
    "dsl export": "abaqus ansys febio_file gmsh moose fenics",
    "declare bodies one by one": "urdf mjcf sdf",
    "--library": "tissue kidney skin bone fat cartilage silicone rubber brain heart",
    "region": "layer multi_material",
    "`dsl run` computes": "if for while function print",
    "report": "plot output render animation camera export_vtk png",
    "ramp": "step_function interpolation waveform",
    "pictures": "texture shader lighting hair fur",
    "`where": "top left bottom",
    "`size`": "coarse meshsize",
    "reference": "analytic benchmark validation mocap strain_gauge",
    "linear_elastic": "steel metal wood",
    "fung": "exponential",
    "st_venant_kirchhoff": "kirchhoff",
}  # fmt: skip
OF_TWO = {"hinge_joint", "nlgeom_step", "K0", "febio_file"}  # words that nobody wrote down: lists are pointed at


@pytest.mark.parametrize(("said", "words"), TYPED.items(), ids=TYPED)
def test_what_is_nearest_in_meaning_is_said(said: str, words: str) -> None:
    for word in set(words.split()) - OF_TWO:
        assert page(word) is None, word
        assert said in hint(word), (word, hint(word))
        assert "did you mean" not in hint(word), word


def test_many_words_were_judged() -> None:
    assert len({word for words in TYPED.values() for word in words.split()} - OF_TWO) >= 150
    assert len(load_foreign_words()) > 1000


def test_no_word_of_ours_is_said_to_be_absent_and_none_twice() -> None:
    fields = [f for c in constructors() for f in c.fields]
    own = [*CATALOGUE, *(c.name for c in constructors()), *CATALOGUE.words(), *(f.name for f in fields)]
    own += [option for f in fields for option in f.options]
    assert [word for word in own if normalize_word(word) in load_foreign_words()] == []
    lines = TABLE.read_text(encoding="utf-8").splitlines()
    words = Counter(normalize_word(word) for line in lines if line.startswith(" ") for word in line.split())
    assert [word for word, times in words.items() if times > 1] == []


def test_what_is_said_speaks_of_words_that_there_are() -> None:
    for said in set(load_foreign_words().values()):
        for code in re.findall(r"`([^`]+)`", said):
            word = code.split()[1] if code.startswith("dsl ") else re.split(r"\W", code.lstrip("-"))[0]
            assert word in COMMANDS or code.startswith("--") or page(word), (said, code)


@pytest.mark.parametrize("word", ["hyperelastic", "mri", "spring", "rmse", "chamfer", "tie"])
def test_what_means_something_else_is_called_no_synonym(word: str) -> None:
    assert WORDS.get(word) is None or explain_foreign_word(word)


@pytest.mark.parametrize(("word", "answer"), [
    ("radians", "`rad`"), ("metres", "`m`"), ("percent", "`%`"), ("possion", "`poisson`"), ("densty", "`density`"),
    ("hz", "Hz"), ("tri", "`dsl list`"), ("elphant", "`dsl list`"), ("sqr", "`dsl list`"),
    ("C", "`dsl list`"), ("forceps", "rigid("), ("G", "young = 2 * G"),
])  # fmt: skip
def test_units_fields_and_what_nobody_knows(word: str, answer: str) -> None:
    assert answer in (page(word) or hint(word))


def test_the_terminal_says_that_it_is_not_here(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["explain", "reaction"]) == 2
    assert "there is nothing called `reaction`; use the metric `force(" in capsys.readouterr().err


@pytest.mark.parametrize(("line", "said", "never"), [
    ("load f = reaction(bar)", "that a support carries", "traction"),
    ("load f = wind(bar)", "there is no flow around bodies", "did you mean"),
    ("shape s = plane()", "half_space", "did you mean"),
    ("support s = spring(bar)", "elastic_foundation", "did you mean"),
    ("material m = lung()", "--library", "fung"),
    ("material m = plastic()", "elastic, viscoelastic, porous", "elastica"),
    ("contact c = glue(bar)", "tied", "did you mean"),
    ("probe p = joint(bar)", "no machines with joints", "`point`"),
    ("model m = bem(bar)", "`fem`", "did you mean"),
    ("analysis a = buckling()", "arc_length", "did you mean"),
    ("amplitude c = spline()", "another program", "sine"),
    ("metric m = reaction(bar)", "that a support carries", "did you mean"),
    ("robot r = fem(tet4)", "no machines with joints", "did you mean"),
    ("cable c = fem(tet4)", "tendon", "table"),
    ("model m = fem(pyramid, size = 1 mm)", "elements:", "did you mean"),
    ("model m = fem(tet4, wall = 3)", "fields of `fem`", "did you mean"),
    ("load f = gravty(9.81 m/s^2)", "did you mean `gravity`?", "constructors"),
    ("material m = neohokean()", "did you mean `neo_hookean`?", "constructors"),
])  # fmt: skip
def test_messages_of_a_scene_propose_no_word_of_another_meaning(line: str, said: str, never: str) -> None:
    with pytest.raises(softmark.SceneError) as refused:
        softmark.loads(line + "\n")
    first = refused.value.diagnostics[0]
    assert said in first.help
    assert never not in first.help
