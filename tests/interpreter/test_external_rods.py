"""Rods that other programs move."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import softmark
from softmark.interpreter.models.external.adapters import package_process, pyelastica
from softmark.interpreter.models.external.external_problem import ExternalMaterial, Motion, Problem, Section
from softmark.interpreter.pipeline import run_pipeline

# a rod that swings through a third of a period of its first mode
SWING = """softmark 1
scene "moved by others"
material silicone = linear_elastic(young = 600 kPa, poisson = 0.49, density = 1070 kg/m^3)
body beam = solid({shape}, silicone)
support wall = fixed(beam, where = x <= 0 mm)
load weight = gravity(9.81 m/s^2, direction = (0, -1, -2))
analysis swing = dynamic(duration = 60 ms, step = 0.5 ms, integrator = bdf2{damping})
probe tip = point(beam, at = (178, 0, 0) mm)
metric drop = displacement(tip, along = -z)
metric strayed = trajectory_error(tip, against = ours)
model ours = beam6dof(segments = 40)
"""
ROUND = "cylinder(length = 178 mm, radius = 10 mm, axis = +x)"
FLAT = "box(size = (178, 24, 12) mm, origin = (0, -12, -6) mm)"


def run(text: str) -> Any:
    loaded = softmark.loads(text)
    return run_pipeline.run_scene(loaded.scene, list(loaded.warnings), run_pipeline.RunOptions(draw=False))


def rods(*models: tuple[int, str]) -> str:
    """Of so many segments each, with steps of their own."""
    each = "model n{} = external_rod(pyelastica, segments = {}, step = {}, time = 500 s)\n"
    return "".join(each.format(n, n, step) for n, step in models)


@pytest.mark.long
@pytest.mark.slow
def test_pyelastica_moves_the_same_rod_to_first_order_in_its_segments() -> None:
    """Its clamp holds half a segment: the rod is shorter by that, and what it strays by halves with the segments.

    1.6 to 2.4: halved, and the rest is of the next order and of our own 40 segments. A flat section tells which
    bending is which, and a load that is askew moves it both ways.
    """
    pytest.importorskip("elastica")
    report = run(SWING.format(shape=FLAT, damping=", damping_mass = 20 Hz") + rods((20, "0.05 ms"), (40, "0.02 ms")))
    assert {m.status for m in report.models.values()} == {"converged"}
    coarse, fine = (report.models[n].metrics["strayed"].value for n in ("n20", "n40"))
    assert fine < 0.06
    assert 1.6 < coarse / fine < 2.4
    assert report.models["n40"].solve["means"].startswith("Cosserat rod")
    assert report.models["n40"].probes["tip"].displacement[0, 1] < 0.0


@pytest.mark.long
@pytest.mark.slow
def test_steps_that_waves_cross_a_segment_in_are_said_to_be_too_long() -> None:
    """After 12 steps all is finite yet, and nothing of it is true: energy comes from nowhere."""
    pytest.importorskip("elastica")
    theirs = run(SWING.format(shape=ROUND, damping="") + rods((40, "5 ms"))).models["n40"]
    assert theirs.status == "diverged"
    assert "times the work of its loads" in theirs.message


@pytest.mark.long
@pytest.mark.slow
def test_a_rod_that_is_pulled_far_is_no_unstable_one() -> None:
    """To 1.3 of its length: strain energy by its own law, of sections that grow thin, is what was worked for."""
    pytest.importorskip("elastica")
    pulled = SWING.format(shape=ROUND, damping="").replace("600 kPa", "60 kPa")
    weight, pull = "gravity(9.81 m/s^2, direction = (0, -1, -2))", "point_force(beam, (178, 0, 0) mm, (3, 0, 0) N)"
    theirs = run(pulled.replace(weight, pull) + rods((10, "0.1 ms"))).models["n10"]
    assert theirs.status == "converged"
    assert theirs.probes["tip"].course[:, 0, 0].max() > 0.04


def test_a_rod_that_remembers_or_knows_directions_is_none_of_others() -> None:
    """`beam6dof` remembers: what another program would move in its place is elastic. Fibres are an error."""
    own = SWING.format(shape=ROUND, damping="") + rods((4, "0.5 ms"))
    law = "linear_elastic(young = 600 kPa, poisson = 0.49, density = 1070 kg/m^3)"
    relaxing = own.replace(law, f"viscoelastic({law}, g = [0.5], tau = [1 s])")
    (warning,) = [w for w in softmark.loads(relaxing).warnings if w.code == "W710"]
    assert "viscoelastic material" in warning.message
    fibres = "transversely_isotropic(shear = 9 kPa, k1 = 1 kPa, k2 = 1, fibres = +x, density = 1070 kg/m^3)"
    with pytest.raises(softmark.SceneError, match="supports isotropic materials only"):
        softmark.loads(own.replace(law, fibres))


def test_what_a_rod_of_others_cannot_do_is_said() -> None:
    """Nothing is approximated: stiffness that damps, a load that follows, a clamp within, and a state of rest."""
    own = SWING.format(shape=ROUND, damping=", damping_stiffness = 1 ms") + rods((4, "0.5 ms"))
    own += "support middle = fixed(beam, where = abs(x - 89 mm) <= 1 mm)\n"
    (warning,) = [w for w in softmark.loads(own).warnings if w.code == "W710"]
    assert all(what in warning.message for what in ("damping_stiffness", "the supports"))
    rest = "\n".join(line for line in own.splitlines() if not line.startswith(("analysis", "metric strayed")))
    (warning,) = [w for w in softmark.loads(rest).warnings if w.code == "W710"]
    assert "it steps through time and solves no static equilibrium" in warning.message


def test_damping_that_hides_steps_that_are_too_long_is_not_asked_for() -> None:
    """At 2000 Hz and 3 ms PyElastica is 98 % slow and says nothing; at 200 Hz and 0.3 ms, by 3 %, as is computed."""
    shares = {"20 Hz": ("0.5 ms", ""), "200 Hz": ("0.3 ms", ""), "2000 Hz": ("3 ms", "5e-05 s or less")}
    for damping, (step, said) in shares.items():
        text = SWING.format(shape=ROUND, damping=f", damping_mass = {damping}") + rods((20, step))
        found = [w.message for w in softmark.loads(text).warnings if w.code == "W710"]
        assert bool(found) == bool(said)
        assert all(said in message for message in found)


def test_a_rod_goes_to_another_process_and_back(tmp_path: Path) -> None:
    """With its section; axes of nodes between two segments are halfway: rotations about e3 by 0 and 0.2, at .1."""
    section = Section(1.0, np.arange(1.0, 7.0), np.arange(1.0, 4.0), np.eye(3))
    stuff = ExternalMaterial("linear_elastic", {"young": 1.0, "poisson": 0.3}, 1.0, np.arange(2))
    motion = Motion(1e-3, 1, np.arange(2), np.ones(3))
    told = Problem(np.eye(3), np.array([[0, 1], [1, 2]]), "rod", "finite", (stuff,), np.array([[0, 5]]), np.zeros(1),
                   np.zeros((3, 3)), motion=motion, section=section)  # fmt: skip
    pyelastica.write(told, tmp_path)
    found = package_process.read_problem(tmp_path).section
    assert found is not None
    assert all(np.array_equal(getattr(found, n), getattr(section, n)) for n in package_process.SECTION)

    def turned(angle: float) -> Any:
        c, s = np.cos(angle), np.sin(angle)
        return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])

    directors = np.stack([turned(a)[:, [1, 2, 0]].T for a in (0.0, 0.2)], axis=2)  # rows e2, e3, e1 of each
    expected = np.array([turned(a) for a in (0.0, 0.1, 0.2)])
    np.testing.assert_allclose(pyelastica.sections(directors), expected, atol=1e-12)


SLENDER = "box(size = (178, 8, 4) mm, origin = (0, -4, -2) mm)"


@pytest.mark.long
@pytest.mark.slow
def test_mujoco_moves_the_same_slender_rod() -> None:
    """A flat section and loads both ways tell which bending is which, a point off the axis how sections turn.

    0.6 %: 0.4 of it is left with more segments and shorter steps, for nothing of it shears and sections have no inertia
    across it; what would be the bending about the wrong axis is 50 %. The free one turns and bends.
    """
    pytest.importorskip("mujoco")
    text = SWING.format(shape=SLENDER, damping=", damping_mass = 5 Hz").replace("600 kPa", "6 MPa")
    text += "load pull = point_force(beam, (178, 0, 0) mm, (0, 0.02, 0) N)\n"
    text += "probe off = point(beam, at = (178, 4, 2) mm)\nmetric astray = trajectory_error(off, against = ours)\n"
    text += "model theirs = external_rod(mujoco, segments = 20, step = 0.1 ms)\n"
    for own in (text, "\n".join(line for line in text.splitlines() if "support" not in line)):
        report = run(own)
        theirs = report.models["theirs"]
        assert theirs.status == "converged", theirs.message
        assert max(theirs.metrics[n].value for n in ("strayed", "astray")) < 0.006


def test_what_keeps_its_length_is_not_held_at_both_ends() -> None:
    text = SWING.format(shape=SLENDER, damping="").replace("x <= 0 mm", "x <= 0 mm or x >= 178 mm")
    (warning,) = [w for w in softmark.loads(text + "model n = external_rod(mujoco, segments = 4)\n").warnings
                  if w.code == "W710"]  # fmt: skip
    assert "its length is fixed" in warning.message
