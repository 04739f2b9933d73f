"""Each energy that solves a state of rest is broken by 5 % in its forces, and the force check must see it.

Every class derived from `Energy` that writes forces of its own has a scene here, or a reason why none is needed; one
that is added fails with its name. Laws, elements, loads and supports by themselves: test_broken_solvers.py.
"""

from __future__ import annotations

import dataclasses
import pkgutil
from collections.abc import Iterator
from importlib import import_module
from typing import Any

import numpy as np
import pytest
from broken_solver_scenes import must_be_right, said_of

import softmark
import softmark.solvers
from softmark.interpreter.models.fem import poroelastic_analysis
from softmark.interpreter.vocabulary import CONTACTS
from softmark.interpreter.vocabulary.supports.pore_pressure_support import PorePressure
from softmark.solvers.contact import rigid_friction
from softmark.solvers.energies.energy import Energy
from softmark.solvers.materials.biphasic import Biphasic
from softmark.solvers.materials.viscoelastic_increment import ViscoelasticStepLaw
from softmark.solvers.mesh import element_interpolation

BREAK = 1.05
QUICK = ("Elastic", "RigidContact", "Springs")
GEL = "material gel = neo_hookean(young = 10 kPa, poisson = {nu}, density = 1000 kg/m^3)\n"
BAR = (
    GEL
    + """body bar = solid(box(size = (20, 10, 10) mm), gel)
support wall = fixed(bar, where = x <= 0 mm)
load pull = traction(bar, where = x >= 20 mm, vector = (1000, 400, 0) Pa)
model one = {model}
probe tip = point(bar, at = (20, 5, 5) mm)
metric down = displacement(tip, along = +y)
"""
)
ROD = """material stuff = linear_elastic(young = 1 MPa, poisson = 0.3, density = 1000 kg/m^3)
body bar = solid(cylinder(length = 100 mm, radius = 5 mm, axis = +x), stuff)
support wall = fixed(bar, where = x <= 0 mm)
load pull = {load}
model one = beam6dof(segments = 6)
probe tip = point(bar, at = (100, 0, 0) mm)
metric down = displacement(tip, along = -z)
"""
FRAME = """material stuff = linear_elastic(young = 1 MPa, poisson = 0.3, density = 1000 kg/m^3)
body bar = network(points = [(0, 0, 0), (1, 0, 0), (1, 1, 0)] m, members = [(1, 2), (2, 3)], material = stuff,
    side = 50 mm)
support wall = fixed(bar, where = x <= 0 m)
support pin = pinned(bar, where = y >= 1 m)
load weight = gravity(1 m/s^2, direction = -z)
model one = frame6dof(segments = 4)
probe tip = point(bar, at = (1, 0, 0) m)
metric down = displacement(tip, along = -z)
"""
ROUND = (
    GEL
    + """shape flat = quadrilateral((1, 0, 0) mm, (10, 0, 0) mm, (10, 10, 0) mm, (1, 10, 0) mm)
body bar = axisymmetric(flat, gel)
support wall = fixed(bar, where = y <= 0 mm)
load press = pressure(bar, where = y >= 10 mm, magnitude = 500 Pa)
model one = fem({element}, strain = finite, size = 5 mm)
probe tip = point(bar, at = (5, 10, 0) mm)
metric down = displacement(tip, along = -y)
"""
)
PRESSED = (
    GEL
    + """body bar = solid(box(size = (10, 10, 5) mm), gel)
body ball = rigid(sphere(radius = 6 mm, origin = (5, 5, 11.05) mm){more})
support wall = fixed(bar, where = z <= 0 mm)
{moved}
contact press = rigid_contact(ball, bar{friction})
model one = fem(hex8, strain = finite, size = 2.5 mm)
probe tip = point(bar, at = (5, 5, 5) mm)
metric down = displacement(tip, along = -z)
"""
)
DOWN = "support push = displaced(ball, by = (0.2, 0, -0.5) mm)"
PAIR = (
    GEL
    + """body bar = solid(disjoint(box(size = (10, 10, 5) mm), box(size = (10, 10, 5) mm, origin = (0, 0, {z}) mm),
    coarser = 0.7), gel)
support wall = fixed(bar, where = z <= 0 mm)
{load}
contact both = {contact}
model one = fem(hex8, strain = finite, size = 5 mm)
probe tip = point(bar, at = (5, 5, {top}) mm)
metric down = displacement(tip, along = -z)
"""
)
LID = "support lid = displaced(bar, where = z >= {top} mm, by = ({along}, 0, -0.3) mm)"
POROUS = """analysis wait = quasistatic(duration = 100 s, step = 50 s, times = [100] s)
material soft = biphasic(neo_hookean(young = 10 kPa, poisson = 0.2, density = 1000 kg/m^3),
    permeability = 1e-10 m^4/(N*s))
shape flat = quadrilateral((0, 0, 0) mm, (2, 0, 0) mm, (2, 5, 0) mm, (0, 5, 0) mm)
body bar = plane_strain(flat, soft, thickness = 1 mm)
support floor = fixed(bar, where = y <= 0 mm, components = y)
support sides = fixed(bar, where = x <= 0 mm or x >= 2 mm, components = x)
support open = {open}
load press = traction(bar, where = y >= 5 mm, vector = (0, -500, 0) Pa)
model one = fem(quad9, strain = finite, size = 1 mm)
probe tip = point(bar, at = (1, 5, 0) mm)
metric down = displacement(tip, along = -y)
"""
TEXTS: dict[str, str] = {
    "Elastic": BAR.format(nu=0.3, model="fem(hex8, strain = finite, size = 10 mm)"),
    "MixedSolid": BAR.format(nu=0.5, model="fem(hex8, strain = finite, formulation = mixed, size = 5 mm)"),
    "MeanDilatation": BAR.format(
        nu=0.45, model="fem(hex8, strain = finite, formulation = mean_dilatation, size = 5 mm)"
    ),
    "EnergySum": BAR.format(nu=0.45, model="fem(hex8, strain = finite, integration = selective, size = 5 mm)"),
    "CorotationalTets": BAR.format(nu=0.3, model="fem(tet4, strain = corotational, size = 7 mm)"),
    "ElementCorotational": BAR.format(
        nu=0.3, model="fem(hex8, strain = corotational, rotation = element, size = 5 mm)"
    ),
    "Springs": BAR.format(nu=0.25, model="mass_spring(size = 5 mm, stiffness = from_material())"),
    "DeadForces": BAR.format(nu=0.3, model="fem(tet10, strain = small, size = 7 mm)"),
    "AffineMassForces": BAR.format(nu=0.3, model="fem(hex8, strain = finite, size = 5 mm)").replace(
        "traction(bar, where = x >= 20 mm, vector = (1000, 400, 0) Pa)",
        "centrifugal(bar, axis = (0, 1, 2), speed = 20 rad/s)",
    ),
    "FollowerPressure": ROUND.format(nu=0.3, element="quad8").replace(
        "axisymmetric(flat, gel)", "plane_strain(flat, gel, thickness = 5 mm)"
    ),
    "FaceMoment": BAR.format(nu=0.3, model="fem(hex8, strain = finite, size = 5 mm)").replace(
        "traction(bar, where = x >= 20 mm, vector = (1000, 400, 0) Pa)",
        "torque(bar, where = x >= 20 mm, moment = (5e-4, 1e-4, 0) N*m)",
    ),
    "AxisymmetricElastic": ROUND.format(nu=0.3, element="quad8"),
    "ElasticFoundation": BAR.format(nu=0.3, model="fem(hex8, strain = finite, size = 5 mm)").replace(
        "fixed(bar, where = x <= 0 mm)", "elastic_foundation(bar, where = x <= 0 mm, stiffness = 1 kPa/mm)"
    ),
    "RodForces": ROD.format(load="gravity(1 m/s^2, direction = -z)"),
    "RodElementEnergy": ROD.format(load="traction(bar, where = x >= 100 mm, vector = (100, 0, -50) Pa)"),
    "RodMoments": ROD.format(load="torque(bar, where = x >= 100 mm, moment = (1e-4, 1e-4, 0) N*m)"),
    "EccentricRodForces": ROD.format(load="point_force(bar, at = (100, 0, 4) mm, vector = (0.01, 0, -0.002) N)"),
    "JointedRods": FRAME,
    "RigidContact": PRESSED.format(nu=0.3, more="", moved=DOWN.replace("0.2", "0"), friction=""),
    "IpcContact": PAIR.format(
        nu=0.3, z=5.02, top=10.02, contact="self_contact(bar)", load=LID.format(top=10.02, along=0)
    ),
    "DeformableFriction": PAIR.format(
        nu=0.3, z=5.02, top=10.02, contact="self_contact(bar, friction = 0.3)", load=LID.format(top=10.02, along=0.1)
    ),
    "TieConstraint": PAIR.format(nu=0.3, z=5, top=10, contact="tied(bar)", load=LID.format(top=10, along=0.5)),
    "PoroelasticSolid": POROUS.format(open="drained(bar, where = y >= 5 mm)"),
}
REASONS = {
    "FreeBodyContact": "free rigid bodies move in time only, and a motion is checked by its balance of energy",
    "RigidBodyLoad": "what pulls at free rigid bodies, which move in time only",
    "DisplacementEnergy": "hands on the forces of the energy within, which is broken by itself",
    "ScaledLoad": "hands on a part of the forces of a load, which is broken by itself",
    "EnergyWithoutPressure": "a part of a factor, which gives no forces in a state that has converged",
    "StabilizationSpring": "a spring that stabilises the way there, and is nothing where a state has converged",
    "ProjectedEnergy": "reduced models are held against the full one, whose forces are checked: `full_residual`",
    "QuadraticEnergy": "reduced models are held against the full one, whose forces are checked: `full_residual`",
    "MovingRod": "rods in motion, which are checked by their balance of energy",
    "MovingRodForces": "rods in motion",
    "MovingRodLoad": "rods in motion",
    "MovingRodMoments": "rods in motion",
    "MovingGuidedTendon": "rods in motion",
    "MovingRodTendons": "rods in motion",
}


def energies() -> dict[str, type[Any]]:
    """All classes of energies that write forces of their own, by name."""
    for module in pkgutil.walk_packages(softmark.solvers.__path__, "softmark.solvers."):
        import_module(module.name)

    def below(cls: type[Any]) -> Iterator[type[Any]]:
        for sub in cls.__subclasses__():
            yield sub
            yield from below(sub)

    ours = (cls for cls in below(Energy) if cls.__module__.startswith("softmark.solvers."))  # other tests have some too
    return {cls.__name__: cls for cls in ours if "add_gradient" in vars(cls)}


def test_every_energy_has_a_scene_or_a_reason() -> None:
    known = TEXTS.keys() | REASONS.keys()
    assert not energies().keys() - known, "no scene breaks these energies: add them to TEXTS"
    assert not known - energies().keys(), "these energies are gone"
    assert not TEXTS.keys() & REASONS.keys()
    assert {"rigid_contact", "self_contact", "tied"} == CONTACTS.keys(), "a contact without a scene in TEXTS"


@pytest.mark.parametrize("name", [
    name if name in QUICK else pytest.param(name, marks=pytest.mark.slow) for name in TEXTS
])  # fmt: skip
def test_wrong_forces_are_seen(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    if name in ("IpcContact", "DeformableFriction"):
        pytest.importorskip("ipctk")
    text, cls = TEXTS[name], energies()[name]
    must_be_right(text)
    right, asked = cls.add_gradient, []

    def wrong(self: Any, x: Any, g: Any, scale: float = 1.0) -> None:
        own = np.zeros_like(g)
        right(self, x, own, scale)
        asked.append(name)
        g += BREAK * own

    monkeypatch.setattr(cls, "add_gradient", wrong)
    found = said_of(text)
    assert asked, f"this scene has no {name}"
    assert found, f"forces of {name} are 5 % wrong, and nothing is said"


RUBS = PRESSED.format(nu=0.3, more="", moved=DOWN, friction=", friction = 0.4")
HEXES = BAR.format(nu=0.3, model="fem(hex8, strain = finite, size = 10 mm)")
RELAXES = "analysis wait = quasistatic(duration = 2 s, step = 1 s, times = [2] s)\n" + HEXES.replace(
    "load pull", "material soft = viscoelastic(gel, g = [0.5], tau = [1] s, of = whole)\nload pull"
).replace("mm), gel)", "mm), soft)")
AT_A_POINT = HEXES.replace(
    "traction(bar, where = x >= 20 mm, vector = (1000, 400, 0) Pa)",
    "point_force(bar, at = (14, 6, 4) mm, vector = (0.05, 0.02, -0.05) N)",
)
DRAINED = {
    "drained": "drained(bar, where = y >= 5 mm)",
    "pore_pressure": "pore_pressure(bar, where = y >= 5 mm, value = 200 Pa)",
}


@pytest.mark.slow
def test_wrong_friction_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    """The traction along a surface that rubs on a rigid body."""
    must_be_right(RUBS)
    right = rigid_friction.RigidFriction._traction
    monkeypatch.setattr(
        rigid_friction.RigidFriction, "_traction", lambda self, x, n, most: BREAK * right(self, x, n, most)
    )
    assert said_of(RUBS)


@pytest.mark.slow
def test_wrong_memory_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    """The stress that the past of a viscoelastic solid has left."""
    must_be_right(RELAXES)
    right = ViscoelasticStepLaw.P

    def wrong(self: ViscoelasticStepLaw, F: Any) -> Any:
        return right(self, F) + (BREAK - 1.0) * self.measure.first_piola_stress(F, self._remaining_stress)

    monkeypatch.setattr(ViscoelasticStepLaw, "P", wrong)
    assert said_of(RELAXES)


@pytest.mark.slow
def test_wrong_flow_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    """The permeability of a porous solid."""
    text = POROUS.format(open=DRAINED["drained"])
    must_be_right(text)
    right = Biphasic.permeable
    monkeypatch.setattr(Biphasic, "permeable", lambda self, J: BREAK * right(self, J))
    assert said_of(text)


@pytest.mark.slow
@pytest.mark.parametrize("name", DRAINED)
def test_a_wrong_pore_pressure_is_seen(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The pressure that a support imposes on the fluid: 10 Pa more."""
    text = POROUS.format(open=DRAINED[name])
    must_be_right(text)
    right = poroelastic_analysis._pressure_supports

    def wrong(*arguments: Any) -> Any:
        found, facets = right(*arguments)
        more = {
            b: dataclasses.replace(d, thing=PorePressure("bar", d.thing.where, d.thing.pressure + 10.0))
            for b, d in found.items()
        }
        return more, facets

    monkeypatch.setattr(poroelastic_analysis, "_pressure_supports", wrong)
    assert said_of(text)


@pytest.mark.slow
def test_a_point_that_is_taken_for_another_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    """Shape functions at the point of a force, which still add up to one."""
    must_be_right(AT_A_POINT)
    right = element_interpolation._extrapolated_shape_functions

    def wrong(*arguments: Any) -> Any:
        N = np.array(right(*arguments))
        N[:, 0] += 0.05
        N[:, 1] -= 0.05
        return N

    monkeypatch.setattr(element_interpolation, "_extrapolated_shape_functions", wrong)
    assert said_of(AT_A_POINT)
