"""Decks as text: well formed, whole, and in the units that they name. Those of FEBio, SOFA and PolyFEM have not run."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import meshio
import numpy as np
import pytest

from softmark.interpreter.models.external.exporters import (
    febio_exporter,
    mujoco_exporter,
    polyfem_exporter,
    sofa_exporter,
)
from softmark.interpreter.models.external.exporters.named_parts import NamedParts
from softmark.interpreter.models.external.external_problem import ExternalMaterial, Motion, Problem

POINTS = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
TET = Problem(
    points=1e-3 * POINTS,
    cells=np.array([[0, 1, 2, 3]]),
    element="tet4",
    strain="finite",
    stuff=(ExternalMaterial("neo_hookean", {"young": 1e4, "poisson": 0.25}, 1000.0, np.array([0])),),
    held=np.array([[0, 0], [0, 1], [0, 2], [1, 1], [1, 2], [2, 2]]),
    values=np.array([0.0, 0, 0, 0, 0, 1e-5]),
    forces=np.array([[0.0, 0, 0], [0, 0, 0], [0, 0, 0], [0, 0, 1e-6]]),
    shares=(0.5, 1.0),
)
NAMED = NamedParts({"bar": np.array([0])}, {"the wall": np.array([0, 1, 2])}, {}, {})


def row(element: ElementTree.Element | None) -> list[float]:
    """The numbers of an element, which have commas between them."""
    assert element is not None
    return [float(v) for v in (element.text or "").split(",")]


def test_a_deck_has_all_of_the_problem_in_its_units() -> None:
    """1 m is 1e3 of its own and 1 N is 1e6; nodes and elements count from 1; state k is at time k."""
    root = ElementTree.fromstring("\n".join(febio_exporter.deck(TET, NAMED)))
    assert [row(own) for own in root.iter("node") if "id" in own.attrib] == POINTS.tolist()
    assert [row(own) for own in root.iter("elem")] == [[1, 2, 3, 4]]
    sets = {own.attrib["name"]: row(own) for own in root.iter("NodeSet")}
    assert sets == {
        "held_x": [1], "held_y": [1, 2], "held_z": [1, 2], "moved_z": [3], "loaded": [4], "S1_the_wall": [1, 2, 3],
    }  # fmt: skip
    tables = {own.attrib["name"]: [row(node) for node in own] for own in root.iter("NodeData")}
    assert tables == {"moved_z": [[1e3 * 1e-5]], "forces": [[0.0, 0.0, 1e6 * 1e-6]]}
    assert [row(own) for own in root.iter("pt")] == [[0, 0], [1, 0.5], [2, 1]]
    (material,) = root.iter("material")
    assert material.attrib["type"] == "neo-Hookean"
    assert [row(own) for own in material] == [[1e-3], [1e4], [0.25]]
    named = {own.attrib[key] for own in root.iter() for key in ("node_set",) if key in own.attrib}
    assert named <= sets.keys()
    fixed = {
        own.attrib["name"]: [row(dof)[0] for dof in own] for own in root.iter("bc") if "zero" in own.attrib["type"]
    }
    assert fixed == {"held_x": [1, 0, 0], "held_y": [0, 1, 0], "held_z": [0, 0, 1]}
    (record,) = root.iter("node_data")  # what its adapter reads
    assert record.attrib == {"data": "ux;uy;uz", "delim": ",", "file": "u.csv"}


def test_what_it_does_not_have_is_refused() -> None:
    assert febio_exporter.refuses(TET) == []
    assert "finite strain" in febio_exporter.refuses(replace(TET, strain="small"))[0][1]
    assert "quadrature" in febio_exporter.refuses(replace(TET, element="hex20"))[0][1]
    other = replace(TET.stuff[0], law="neo_hookean_isochoric")
    assert "three-field" in febio_exporter.refuses(replace(TET, stuff=(other,)))[0][1]


def test_a_scene_of_sofa_has_all_of_the_problem() -> None:
    """In SI, nodes from 0; mu = E / (2 (1 + nu)) = 4 kPa, lambda = E nu / ((1 + nu) (1 - 2 nu)) = 4 kPa."""
    problem = replace(TET, values=np.zeros(6), shares=(1.0,))
    root = ElementTree.fromstring("\n".join(sofa_exporter.deck(problem)))
    found = {own.attrib.get("name", own.tag): own.attrib for own in root.iter()}
    numbers = {name: [float(v) for v in own.split()] for name, own in found["mesh"].items() if name != "name"}
    assert numbers == {"position": TET.points.ravel().tolist(), "tetrahedra": [0, 1, 2, 3]}
    assert found["law"]["materialName"] == "NeoHookean"
    assert [float(v) for v in found["law"]["ParameterSet"].split()] == [4000.0, 4000.0]
    held = {name: (own["indices"], own["fixedDirections"]) for name, own in found.items() if name.startswith("held")}
    assert held == {"held_x": ("0", "1 0 0"), "held_y": ("0 1", "0 1 0"), "held_z": ("0 1 2", "0 0 1")}
    assert (found["load"]["indices"], found["load"]["forces"]) == ("3", "0.0 0.0 1e-06")
    at_rest, u = found["VTKExporter"]["position"], found["VTKExporter"]["pointsDataFields"]
    assert (at_rest, u) == ("@state.rest_position", "u=moved.output")
    assert found["moved"]["substractor"] == at_rest
    small = sofa_exporter.refuses(
        replace(problem, strain="small", stuff=(replace(TET.stuff[0], law="linear_elastic"),))
    )
    assert sofa_exporter.refuses(problem) == small == []
    assert [what for what, _ in sofa_exporter.refuses(TET)] == ["a support that moves", "several states"]
    assert [what for what, _ in sofa_exporter.refuses(replace(problem, element="hex8"))] == ["hex8"]


PUSHED = {"push": np.array([[0.0, 0, 0], [0, 2, 0], [0, 2, 0], [0, 2, 0]]) * 1e-6}  # on the oblique facet
CLAMPED = replace(TET, held=np.array([[i, k] for i in (0, 1, 2) for k in range(3)] + [[3, 0]]), values=np.zeros(10))
WEIGHT = 1000.0 * 1e-9 / 6.0 * 9.81 / 4.0  # N of each node of the tetrahedron
WEIGHED = {"weight": np.tile([0.0, 0.0, -WEIGHT], (4, 1))}
FACETS = {"push": np.array([[1, 2, 3]])}
# of json-specs: each key that may be where the deck has one, of what is required first
SPECIFIED = {
    "": (["geometry", "materials"], ["units", "space", "boundary_conditions", "output"]),
    "/units": ([], ["length", "mass", "time"]),
    "/geometry/*": (["mesh"], ["volume_selection", "surface_selection"]),
    "/geometry/*/volume_selection": ([], ["id_offset"]),
    "/geometry/*/surface_selection/*": (["id", "radius", "center"], ["relative"]),
    "/materials/*": (["type", "E", "nu"], ["id", "rho"]),
    "/space": ([], ["discr_order"]),
    "/boundary_conditions": ([], ["rhs", "dirichlet_boundary", "neumann_boundary"]),
    "/boundary_conditions/dirichlet_boundary/*": (["id", "value"], ["dimension"]),
    "/boundary_conditions/neumann_boundary/*": (["id", "value"], []),
    "/output": ([], ["json", "paraview"]),
    "/output/paraview": ([], ["file_name"]),
}


def unspecified(value: Any, at: str = "") -> list[str]:
    """What of a deck of PolyFEM its specification does not have, or misses."""
    if isinstance(value, list):
        return [own for each in value for own in unspecified(each, f"{at}/*")]
    if not isinstance(value, dict):
        return []
    required, optional = SPECIFIED.get(at, ([], []))
    wrong = [f"{at}/{key}" for key in {*value} - {*required, *optional} | ({*required} - {*value})]
    return wrong + [own for key, each in value.items() for own in unspecified(each, f"{at}/{key}")]


def test_a_deck_of_polyfem_has_all_of_the_problem(tmp_path: Path) -> None:
    """Gravity by what `rhs` is taken from; a force of 6e-6 N over 3^0.5/2 mm^2 is a traction; node 3 is free."""
    problem = replace(TET, held=CLAMPED.held[:9], values=np.zeros(9), shares=(1.0,),
                      forces=PUSHED["push"] + WEIGHED["weight"])  # fmt: skip
    named = NamedParts(
        {"bar": np.array([0])}, {"wall": np.arange(3)}, PUSHED | WEIGHED, {**FACETS, "wall": np.array([[0, 1, 2]])}
    )
    assert polyfem_exporter.refuses(problem) == polyfem_exporter.unsupported_loads(problem, named) == []
    deck = polyfem_exporter.deck(problem, named)
    assert unspecified(deck) == []
    assert deck["output"] == {"json": "statistics.json", "paraview": {"file_name": "answer.vtu"}}
    selected = {own["id"]: own["center"] for own in deck["geometry"][0]["surface_selection"]}
    conditions = deck["boundary_conditions"]
    assert conditions["rhs"] == pytest.approx([0.0, 0.0, 9.81])
    (wall,), (pushed,) = conditions["dirichlet_boundary"], conditions["neumann_boundary"]
    assert (wall["value"], wall["dimension"]) == ([0.0, 0.0, 0.0], [True, True, True])
    assert selected[wall["id"]] == pytest.approx([1e-3 / 3.0, 1e-3 / 3.0, 0.0])
    assert pushed["value"] == pytest.approx([0.0, 6e-6 / (0.5 * 3.0**0.5 * 1e-6), 0.0])
    assert selected[pushed["id"]] == pytest.approx([1e-3 / 3.0] * 3)
    assert deck["materials"] == [{"id": 1, "type": "NeoHookean", "E": 1e4, "nu": 0.25, "rho": 1000.0}]
    assert polyfem_exporter.export(problem, named, tmp_path) == ["model.json", "mesh.msh"]
    mesh = meshio.read(tmp_path / "mesh.msh")
    assert mesh.cells_dict["tetra"].tolist() == [[0, 1, 2, 3]]
    assert mesh.cell_data_dict["gmsh:physical"]["tetra"].tolist() == [1]  # the number of its material


def test_what_polyfem_cannot_be_told_is_refused() -> None:
    """Nodes that are held beside whole facets, loads that are no traction, states, other elements."""
    point = replace(TET, held=TET.held[:3], values=np.zeros(3))
    assert [what for what, _ in polyfem_exporter.refuses(point)] == ["several states", "the supports"]
    assert [what for what, _ in polyfem_exporter.refuses(replace(TET, element="hex8"))] == ["hex8"]
    one = {"pull": np.array([[0.0, 0, 0], [0, 0, 0], [0, 0, 0], [1e-6, 0, 0]])}
    named = NamedParts({"bar": np.array([0])}, {}, one, {})
    assert [what for what, _ in polyfem_exporter.unsupported_loads(replace(TET, forces=one["pull"]), named)] == [
        "load `pull`"
    ]


MOVING = replace(
    CLAMPED,
    stuff=(replace(TET.stuff[0], law="st_venant_kirchhoff"),),
    forces=WEIGHED["weight"] + [[0.0, 0, 0], [0, 0, 0], [0, 0, 0], [0, 2e-6, 0]],
    shares=(1.0,),
    motion=Motion(1e-3, 5, np.array([0, 5]), np.full(4, WEIGHT / 9.81), 3.0, 1e-4),
)


def test_a_model_of_mujoco_has_all_of_the_problem() -> None:
    """What is held has no slide; beside its weight a node is pushed, and slowed by 3 / s of its mass."""
    assert MOVING.motion is not None
    root = ElementTree.fromstring(mujoco_exporter.deck(MOVING, MOVING.motion))
    option, flex, elastic = (next(root.iter(tag)) for tag in ("option", "flex", "elasticity"))
    assert [float(v) for v in option.attrib["gravity"].split()] == pytest.approx([0.0, 0.0, -9.81])
    assert (option.attrib["timestep"], option.attrib["integrator"]) == ("0.001", "discrete")
    assert (flex.attrib["body"], flex.attrib["element"]) == ("n0 n1 n2 n3", "0 1 2 3")
    assert [float(elastic.attrib[n]) for n in ("young", "poisson", "damping")] == [1e4, 0.25, 1e-4]
    assert [own.attrib["name"] for own in root.iter("joint")] == ["n3y", "n3z"]
    bias = {own.attrib["joint"]: [float(v) for v in own.attrib["biasprm"].split()] for own in root.iter("general")}
    drag = -3.0 * WEIGHT / 9.81
    assert bias.keys() == {"n3y", "n3z"}
    assert bias["n3y"] == pytest.approx([2e-6, 0.0, drag], rel=1e-9)
    assert bias["n3z"] == pytest.approx([0.0, 0.0, drag], rel=1e-9)
    assert mujoco_exporter.refuses(MOVING) == []
    assert [what for what, _ in mujoco_exporter.refuses(replace(TET, element="hex8"))] == ["hex8", "neo_hookean"]
