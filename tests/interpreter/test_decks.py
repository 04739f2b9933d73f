"""Decks of FEBio and SOFA as text: well formed, whole, and in the units that they name. None has been run."""

from __future__ import annotations

from dataclasses import replace
from xml.etree import ElementTree

import numpy as np

from softmark.interpreter.models.outside.decks import febio, sofa
from softmark.interpreter.models.outside.decks.named import Named
from softmark.interpreter.models.outside.problem import Problem, Stuff

POINTS = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
TET = Problem(
    points=1e-3 * POINTS,
    cells=np.array([[0, 1, 2, 3]]),
    element="tet4",
    strain="finite",
    stuff=(Stuff("neo_hookean", {"young": 1e4, "poisson": 0.25}, 1000.0, np.array([0])),),
    held=np.array([[0, 0], [0, 1], [0, 2], [1, 1], [1, 2], [2, 2]]),
    values=np.array([0.0, 0, 0, 0, 0, 1e-5]),
    forces=np.array([[0.0, 0, 0], [0, 0, 0], [0, 0, 0], [0, 0, 1e-6]]),
    shares=(0.5, 1.0),
)
NAMED = Named({"bar": np.array([0])}, {"the wall": np.array([0, 1, 2])}, {}, {})


def row(element: ElementTree.Element | None) -> list[float]:
    """The numbers of an element, which have commas between them."""
    assert element is not None
    return [float(v) for v in (element.text or "").split(",")]


def test_a_deck_has_all_of_the_problem_in_its_units() -> None:
    """1 m is 1e3 of its own and 1 N is 1e6; nodes and elements count from 1; state k is at time k."""
    root = ElementTree.fromstring("\n".join(febio.deck(TET, NAMED)))
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


def test_what_it_does_not_have_is_refused() -> None:
    assert febio.refuses(TET) == []
    assert "finite strain" in febio.refuses(replace(TET, strain="small"))[0][1]
    assert "quadrature" in febio.refuses(replace(TET, element="hex20"))[0][1]
    other = replace(TET.stuff[0], law="neo_hookean_isochoric")
    assert "three fields" in febio.refuses(replace(TET, stuff=(other,)))[0][1]


def test_a_scene_of_sofa_has_all_of_the_problem() -> None:
    """In SI, nodes from 0; mu = E / (2 (1 + nu)) = 4 kPa, lambda = E nu / ((1 + nu) (1 - 2 nu)) = 4 kPa."""
    problem = replace(TET, values=np.zeros(6), shares=(1.0,))
    root = ElementTree.fromstring("\n".join(sofa.deck(problem)))
    found = {own.attrib.get("name", own.tag): own.attrib for own in root.iter()}
    numbers = {name: [float(v) for v in own.split()] for name, own in found["mesh"].items() if name != "name"}
    assert numbers == {"position": TET.points.ravel().tolist(), "tetrahedra": [0, 1, 2, 3]}
    assert found["law"]["materialName"] == "NeoHookean"
    assert [float(v) for v in found["law"]["ParameterSet"].split()] == [4000.0, 4000.0]
    held = {name: (own["indices"], own["fixedDirections"]) for name, own in found.items() if name.startswith("held")}
    assert held == {"held_x": ("0", "1 0 0"), "held_y": ("0 1", "0 1 0"), "held_z": ("0 1 2", "0 0 1")}
    assert (found["load"]["indices"], found["load"]["forces"]) == ("3", "0.0 0.0 1e-06")
    small = sofa.refuses(replace(problem, strain="small", stuff=(replace(TET.stuff[0], law="linear_elastic"),)))
    assert sofa.refuses(problem) == small == []
    assert [what for what, _ in sofa.refuses(TET)] == ["a support that moves", "several states"]
    assert [what for what, _ in sofa.refuses(replace(problem, element="hex8"))] == ["hex8"]
