"""Rigid bodies in pictures: their surfaces, their places in states and in time, the page, and files for ParaView."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest
from browser import TIMED, browse, needs_chromium, noted

import softmark
from softmark.interpreter.pipeline.rigid_body_shapes import drawn_rigid_bodies
from softmark.interpreter.problem.body_case import case_of
from softmark.interpreter.problem.rigid_surfaces import THICK, WIDER
from softmark.interpreter.report.run.report_page import render
from softmark.interpreter.report.view3d.rigid_bodies_view import AROUND, picture_box
from softmark.interpreter.results.run_report import DrawnSurface, Report
from softmark.interpreter.results.vtk_writer import write_vtu
from softmark.solvers.contact.signed_distance import gap_of
from softmark.solvers.mesh.rigid_shapes import Punch, RoundedBox, RoundedCone

AXIS = (0.6, 0.0, 0.8)
ROUNDED = [Punch(0.8, 0.2, 1.5, AXIS, (0.0, -0.5, -0.6)), Punch(1.0, 0.95, 20.0), RoundedCone(1.0, 0.3, 3.0, AXIS),
           RoundedBox((2.0, 1.0, 1.5), 0.2, (-1.0, -0.5, -0.75))]  # fmt: skip
SCENE = """softmark 1
material gel   = linear_elastic(young = 10 kPa, poisson = 0.3, density = 1000 kg/m^3)
body     block = {body}
body     tool  = rigid({shape})
support  floor = fixed(block, where = {floor})
support  hand  = {hand}
contact  touch = rigid_contact(tool, block)
analysis press = static(states = [50, 100] %)
model    hexes = fem({cells}, strain = small, size = 10 mm)
metric   area  = contact_area(touch)
"""
SPACE = {"body": "solid(box(size = (20, 20, 20) mm), gel)", "floor": "z <= 0 mm", "cells": "hex8"}
PLANE = {"floor": "y <= 0 mm", "cells": "quad4"}
SQUARE = "quadrilateral((0, 0, 0) mm, (20, 0, 0) mm, (20, 20, 0) mm, (0, 20, 0) mm)"


def pressed(shape: str, hand: str, **more: str) -> str:
    return SCENE.format(shape=shape, hand=hand, **(SPACE | more))


BALL = pressed(
    "sphere(radius = 10 mm, origin = (10, 10, 30) mm)", "displaced(tool, by = (0, 0, -1) mm, amplitude = per_state)"
)


@pytest.fixture(scope="module")
def ball() -> Report:
    return softmark.loads(BALL).run()


def seen(text: str) -> Any:
    """The rigid body beside the undeformed body, in full."""
    case = case_of(softmark.loads(text).scene, "block")
    assert case.shape.bounds is not None
    low, high = map(np.array, case.shape.bounds)
    corners = np.array([np.where([i & 1, i & 2, i & 4], high, low) for i in range(8)])
    (own,) = drawn_rigid_bodies(case, DrawnSurface(corners, np.zeros((1, 3), dtype=np.int64)))
    return own


def volume(X: Any, triangles: Any) -> float:
    """Of a closed surface that looks outward, m^3 (Gauss)."""
    a, b, c = X[triangles].transpose(1, 0, 2)
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0)


@pytest.mark.parametrize("shape", ROUNDED, ids=lambda s: type(s).__name__)
def test_surfaces_of_rounded_bodies_are_theirs(shape: Any) -> None:
    """Points have no distance to the exact surface, edges are shared by two facets, and little volume is lost."""
    X, triangles = shape.surface(0.0)
    gap = gap_of(shape)
    assert gap is not None
    np.testing.assert_allclose(gap.gap(X), 0.0, atol=1e-14)
    edges = np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1)
    assert set(np.unique(edges, axis=0, return_counts=True)[1]) == {2}
    assert 0.99 * shape.volume < volume(X, triangles) < shape.volume  # inscribed: 32 sides of a circle hold 99.4 %


@pytest.mark.slow
def test_a_rigid_body_is_where_its_support_takes_it_in_every_state(ball: Report) -> None:
    shape = ball.models["hexes"].shape
    assert shape is not None
    (own,) = shape.instruments
    assert own.name == "tool"
    for i, depth in enumerate((0.5e-3, 1e-3)):
        centre = np.array([0.01, 0.01, 0.03 - depth])
        np.testing.assert_allclose(np.linalg.norm(own.at(i) - centre, axis=1), 0.01, rtol=1e-9)


def test_what_turns_is_drawn_turned() -> None:
    """A quarter turn about a line along y through (10, 10, 30) mm, and 2 mm downwards."""
    own = seen(pressed(
        "box(size = (4, 6, 8) mm, origin = (10, 10, 30) mm)",
        "rotated(tool, angle = 90 deg, axis = (0, 1, 0), through = (10, 10, 30) mm)\n"
        "support down = displaced(tool, by = (0, 0, -2) mm)",
    ))  # fmt: skip
    np.testing.assert_allclose(own.at(-1).min(axis=0), [0.010, 0.010, 0.024], atol=1e-9)
    np.testing.assert_allclose(own.at(-1).max(axis=0), [0.018, 0.016, 0.028], atol=1e-9)


def test_a_half_space_is_a_plate_beneath_the_body() -> None:
    own = seen(pressed("half_space(normal = (0, 0, 1), origin = (50, 50, -3) mm)", "fixed(tool)"))
    size = 0.02 * np.sqrt(3.0)
    low, high = own.at(-1).min(axis=0), own.at(-1).max(axis=0)
    np.testing.assert_allclose(0.5 * (low + high)[:2], 0.01)
    np.testing.assert_allclose((high - low)[:2], 0.02 + WIDER * size)
    np.testing.assert_allclose([low[2], high[2]], [-0.003 - THICK * size, -0.003])


@pytest.mark.parametrize(
    ("shape", "area"),
    [
        ("cylinder(radius = 5 mm, length = 40 mm, axis = +z, origin = (10, 25, -20) mm)", np.pi * 25e-6),
        ("tube(radius = 5 mm, inner = 3 mm, length = 40 mm, axis = +z, origin = (10, 25, -20) mm)", np.pi * 16e-6),
        ("box(size = (4, 6, 8) mm, origin = (8, 20, -4) mm)", 24e-6),
    ],
)
def test_a_plane_body_sees_the_section(shape: str, area: float) -> None:
    """As thick as the body, 10 mm; a circle of 64 sides has 0.16 % less."""
    body = f"plane_strain({SQUARE}, gel, thickness = 10 mm)"
    own = seen(pressed(shape, "fixed(tool)", **PLANE, body=body))
    assert volume(own.X, own.triangles) == pytest.approx(area * 0.01, rel=3e-3)


@pytest.mark.slow
def test_beside_a_body_of_revolution_half_of_it_is_seen() -> None:
    own = seen(pressed("sphere(radius = 10 mm, origin = (0, 30, 0) mm)", "fixed(tool)", **PLANE,
                       body=f"axisymmetric({SQUARE}, gel)"))  # fmt: skip
    assert own.X[:, 0].min() == 0.0
    thick = float(np.ptp(own.X[:, 2]))
    assert volume(own.X, own.triangles) == pytest.approx(0.5 * np.pi * 1e-4 * thick, rel=5e-3)


# ------------------------------------------------------------------ the page and the files


def test_only_pages_with_rigid_bodies_have_what_draws_them(ball: Report) -> None:
    shape = ball.models["hexes"].shape
    assert shape is not None
    without = replace(ball, models={"hexes": replace(ball.models["hexes"], shape=replace(shape, instruments=()))})
    assert "instruments" not in render(without)
    page = render(ball)
    assert "pressure of touch" in page  # which a metric asks for
    assert "<code>tool</code> is rigid, and drawn translucent, where it is in each state." in page
    found = re.search(r'<script type="application/json">(.*?)</script>', page, re.S)
    assert found is not None
    data = json.loads(found[1])
    assert data["shapes"][0]["instruments"][0]["shifts"] == [[0.0, 0.0, -0.0005], [0.0, 0.0, -0.001]]
    room = picture_box([shape])
    np.testing.assert_allclose(data["room"], [room.low, room.high])


def test_what_supports_carry_is_told_with_rigid_bodies(ball: Report) -> None:
    """The floor carries what the ball presses, and there is no load."""
    assert "Supports, contact forces of rigid bodies and loads are in balance." in render(ball)


def test_pictures_leave_room_for_a_part_of_what_is_large(ball: Report) -> None:
    shape = ball.models["hexes"].shape
    assert shape is not None
    assert shape.frames is not None
    (own,) = shape.instruments
    large = replace(shape, instruments=(replace(own, X=1e3 * own.X),))
    room, size = picture_box([large]), np.linalg.norm(np.ptp(shape.frames.reshape(-1, 3), axis=0))
    points = np.concatenate(room.positions(large))
    assert float(np.ptp(points, axis=0).max()) < 1.1 * (0.02 + 2.0 * AROUND * size)


LOOK = """<script>
const wait = () => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));
const figure = document.querySelector("figure.shapes"), canvas = figure.querySelector(".panel canvas");
const alphas = () => {
  const { pixels, owner } = canvas.frame, glass = canvas.glass.owner;
  let body = 0, veiled = 0, beside = 0;
  for (let i = 0; i < pixels.length; i++)
    if (glass[i]) owner[i] ? veiled++ : beside++;
    else if (owner[i]) body++;
  return [body, veiled, beside];
};
(async () => {
  await wait();
  const said = [alphas()], slider = figure.querySelector("input[type=range]");
  slider.value = 0;
  slider.dispatchEvent(new Event("input"));
  await wait();
  said.push(alphas());
  document.documentElement.dataset.said = JSON.stringify(said);
})();
</script></body>"""


@pytest.mark.long
@pytest.mark.slow
@needs_chromium
def test_the_rigid_body_is_drawn_over_the_other_and_moves(ball: Report, tmp_path: Path) -> None:
    page = tmp_path / "report.html"
    page.write_text(render(ball).replace("<body>", TIMED).replace("</body>", LOOK), encoding="utf-8")
    last, first = noted(browse(page, tmp_path / "profile", "--window-size=1280,1000", "--dump-dom").stdout)
    assert min(last) > 500  # pixels of the body alone, of it behind the ball, and of the ball alone
    assert first[1] < last[1]  # in the first state it hides less of the body


def test_rigid_bodies_are_files_of_their_own(ball: Report, tmp_path: Path) -> None:
    write_vtu(ball, tmp_path)
    for i, depth in enumerate((0.5e-3, 1e-3)):
        mesh = meshio.read(tmp_path / "vtu" / f"hexes-tool-{i:04d}.vtu")
        np.testing.assert_allclose(np.linalg.norm(mesh.points - [0.01, 0.01, 0.03 - depth], axis=1), 0.01)
    assert (tmp_path / "vtu" / "hexes-tool.pvd").exists()


def test_a_rigid_body_named_as_a_file_of_the_model_takes_none_of_its(ball: Report, tmp_path: Path) -> None:
    model = ball.models["hexes"]
    assert model.shape is not None
    named = replace(model.shape, instruments=(replace(model.shape.instruments[0], name="surface"),))
    written = write_vtu(replace(ball, models={"hexes": replace(model, shape=named)}), tmp_path)
    assert len(set(written)) == len(written)
    assert (tmp_path / "vtu" / "hexes-surface-2.pvd").exists()
