"""Each law, element, energy, load and support is broken in turn by 5 %, and the force check must see each break.

What is broken is what solves, by patches of its classes in this process; the check, which has an assembly, loads and
selections of its own, and differences of the energy density, is left as it is. A break is caught where the model fails
or does not converge, or where W353 says that its forces were not found again. Tables below have a scene for every entry
of the registries: one that is added and has none fails with its name. What they were worth before: with a wrong stress
of neo-Hooke's law, its energy untouched, the model converged with a residual of 6e-9 and a tip that was 2.7 % off.
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable
from contextlib import suppress
from typing import Any, get_args, get_type_hints

import numpy as np
import pytest
from broken_solver_scenes import HEAD, must_be_right, said_of
from equal_moduli import CONSTANTS

import softmark
import softmark.solvers
from softmark.interpreter.models.beam import beam_builder as beam_build
from softmark.interpreter.models.postprocessing import reaction_and_work
from softmark.interpreter.models.shared import load_setup, support_constraints
from softmark.interpreter.vocabulary import LOADS, SUPPORTS
from softmark.solvers.elements import CELLS
from softmark.solvers.materials import DIRECTED, MATERIALS, law_for, mixed_for, shear_and_volume_laws
from softmark.solvers.materials.active_strain import ActiveStrain
from softmark.solvers.materials.active_stress import ActiveTension
from softmark.solvers.materials.tensor_components import cofactor
from softmark.solvers.materials.two_invariant_law import TwoInvariantLaw

BREAK = 1.05
QUICK = 2  # cases of each kind in the quick suite: the rest is slow


def some_quick(names: Any, quick: int = QUICK) -> list[Any]:
    """All names, those after the first marked as slow."""
    slow = pytest.mark.slow
    rows = [name if isinstance(name, tuple) else (name,) for name in names]
    return [pytest.param(*row, marks=() if i < quick else slow) for i, row in enumerate(rows)]


# ------------------------------------------------------------------ laws

BAR = """material stuff = {law}
body bar = solid(box(size = (20, 10, 10) mm), stuff)
support wall = fixed(bar, where = x <= 0 mm)
load pull = traction(bar, where = x >= 20 mm, vector = ({pull}, 0, {shear}) Pa)
model one = fem({model}, size = 10 mm)
probe tip = point(bar, at = (20, 5, 5) mm)
metric down = displacement(tip, along = +z)
"""
MODELS = {
    "full": "hex8, strain = finite",
    "selective": "hex8, strain = finite, integration = selective",
    "mixed": "hex8, strain = finite, formulation = mixed",
    "mean": "hex8, strain = finite, formulation = mean_dilatation",
    "small": "hex8, strain = small",
    "corotational": "hex8, strain = corotational",
    "tetrahedra": "tet10, strain = corotational",
}
DENSE = "density = 1000 kg/m^3"
FIBRES = f"fibres = (2, 1, -0.5), {DENSE}, bulk = 30 kPa"
DIRECTED_TEXTS = {
    "transversely_isotropic": f"transversely_isotropic(shear = 3 kPa, k1 = 6 kPa, k2 = 2, {FIBRES})",
    "holzapfel_gasser_ogden": "holzapfel_gasser_ogden(c = 3 kPa, k1 = 6 kPa, k2 = 2, angle = 40 deg,"
                              f" sheets = (0.3, 1, 0.2), {FIBRES})",
    "holzapfel_ogden": "holzapfel_ogden(a = 3 kPa, b = 2, a_f = 6 kPa, b_f = 2, a_s = 2 kPa, b_s = 2, a_fs = 1 kPa,"
                       f" b_fs = 2, sheets = (0.3, 1, 0.2), {FIBRES})",
    "guccione": f"guccione(stiffness = 2 kPa, bf = 8, bt = 2, bfs = 4, {FIBRES})",
    "fung_orthotropic": "fung_orthotropic(stiffness = 2 kPa, bff = 8, bss = 5, bnn = 2, bfs = 4, bfn = 3, bsn = 2,"
                        f" sheets = (0.3, 1, 0.2), {FIBRES})",
    "active": f"neo_hookean(young = 10 kPa, poisson = 0.3, {DENSE})\n"
              "material muscle = active(stuff, tension = 1 kPa, own = +x)",
    "active_strain": f"neo_hookean(young = 10 kPa, poisson = 0.3, {DENSE})\n"
                     "material muscle = active_strain(stuff, shortening = 10 %, own = +x)",
}  # fmt: skip


def law_text(name: str) -> str:
    """The words of a material of about 10 kPa."""
    if name in DIRECTED:
        assert name in DIRECTED_TEXTS, f"no scene here breaks the law `{name}`: add its words to DIRECTED_TEXTS"
        return DIRECTED_TEXTS[name]
    if name not in CONSTANTS:
        return f"{name}(young = 10 kPa, poisson = 0.3, {DENSE})"
    own, hints = CONSTANTS[name](3800.0), get_type_hints(MATERIALS[name], include_extras=True)

    def shown(field: str, value: Any) -> str:
        unit = get_args(hints[field])[1].split(" in ")[0].removeprefix("values of ").removesuffix(" each")
        unit = "Pa" if "Pa" in unit else ""
        number = f"[{', '.join(map(repr, value))}]" if isinstance(value, tuple) else repr(value)
        return f"{field} = {number} {unit}".rstrip()

    return f"{name}({', '.join(shown(f, v) for f, v in own.items())}, poisson = 0.3, {DENSE})"


def bar(name: str, model: str) -> str:
    pull, shear = (600, 300) if name in DIRECTED else (1000, 400)
    text = BAR.format(law=law_text(name), model=MODELS[model], pull=pull, shear=shear)
    return text.replace("mm), stuff)", "mm), muscle)") if "material muscle" in text else text


def made_of(text: str) -> Any:
    """The material of the body of a scene."""
    scene = softmark.loads(HEAD + text).scene
    return scene.declared["bar"].thing.material


def laws_of(material: Any, model: str) -> list[Any]:
    """The laws, or for what presses the constraint, that a model asks."""
    strain = "finite" if "finite" in MODELS[model] else "small" if model == "small" else "corotational"
    if model == "selective":
        return [*(shear_and_volume_laws(material, strain) or ())]
    if model in ("mixed", "mean"):
        mixed = mixed_for(material, strain)
        assert mixed is not None
        return [mixed.shape, mixed.constraint]
    return [law_for(material, strain)]


def break_law(monkeypatch: pytest.MonkeyPatch, law: Any, part: str) -> None:
    """The stress of a law, or dg/dF of a constraint, in what changes the shape, or in what changes the volume."""
    cls = type(law)
    if hasattr(law, "_gradient"):
        if part == "volume":
            right = cls._gradient
            monkeypatch.setattr(cls, "_gradient", lambda self, f: BREAK * right(self, f))
    elif isinstance(law, TwoInvariantLaw):
        slopes = cls.slopes

        def wrong(self: Any, stretch: Any, j: Any) -> Any:
            a, s = slopes(self, stretch, j)
            return (BREAK * a, s) if part == "shape" else (a, BREAK * s)

        monkeypatch.setattr(cls, "slopes", wrong)
    else:
        stress = cls._P

        def off(self: Any, f: Any) -> Any:
            P, C = stress(self, f), cofactor(f)
            mean = np.einsum("iJm,iJm->m", P, f) / np.einsum("iJm,iJm->m", C, f) * C  # pressure times cof F
            return P + (BREAK - 1.0) * (mean if part == "volume" else P - mean)

        monkeypatch.setattr(cls, "_P", off)


FINITE = [name for name in MATERIALS if MATERIALS[name].finite_law is not MATERIALS["linear_elastic"].finite_law]
LAW_CASES = [(n, "full", part) for n in [*FINITE, *DIRECTED] for part in ("shape", "volume")]
LAW_CASES += [(n, m, part) for n in FINITE for m in ("selective", "mixed", "mean") for part in ("shape", "volume")]
LAW_CASES += [
    ("linear_elastic", m, part) for m in ("small", "corotational", "tetrahedra") for part in ("shape", "volume")
]


LAW_CASES.sort(key=lambda case: case[0] not in ("neo_hookean", "guccione") or case[1] != "full")


@pytest.mark.parametrize(("name", "model", "part"), some_quick(LAW_CASES, 4))
def test_a_wrong_stress_is_seen(name: str, model: str, part: str, monkeypatch: pytest.MonkeyPatch) -> None:
    text = bar(name, model)
    must_be_right(text)
    for law in laws_of(made_of(text), model):
        break_law(monkeypatch, getattr(law, "within", law), part)
    assert said_of(text), f"{part} stress of {name} 5 % wrong in {MODELS[model]}, and nothing is said"


@pytest.mark.parametrize("name", some_quick(["active", "active_strain"], 1))
def test_wrong_muscle_is_seen(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The tension that is added to a law, and the shortening around which it is at rest."""
    text = bar(name, "full")
    must_be_right(text)
    if name == "active":
        right = ActiveTension._shape_P
        monkeypatch.setattr(ActiveTension, "_shape_P", lambda self, f, axes: BREAK * right(self, f, axes))
    else:
        stress = ActiveStrain._P
        monkeypatch.setattr(ActiveStrain, "_P", lambda self, f: BREAK * stress(self, f))
    assert said_of(text)


# ------------------------------------------------------------------ elements


def _gradient(right: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """One component of one node's slope."""

    def wrong(xi: Any) -> Any:
        dN = np.array(right(xi))
        dN[:, 1, 0] *= BREAK
        return dN

    return wrong


def _order(right: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """Two nodes that change places."""

    def wrong(xi: Any) -> Any:
        dN = np.array(right(xi))
        dN[:, [0, 1]] = dN[:, [1, 0]]
        return dN

    return wrong


def _weights(right: Callable[[], Any]) -> Callable[[], Any]:
    """The first weight of a rule of quadrature."""

    def wrong() -> Any:
        xi, w = right()
        w = np.array(w, dtype=float)
        w[0] *= BREAK
        return xi, w

    return wrong


def _points(right: Callable[[], Any]) -> Callable[[], Any]:
    """All points of a rule of quadrature, moved along the first axis."""

    def wrong() -> Any:
        xi, w = right()
        return np.asarray(xi) + (BREAK - 1.0) * np.eye(3)[0], w

    return wrong


ELEMENT_BREAKS: dict[str, tuple[str, Callable[[Any], Any]]] = {
    "slope of a node": ("gradient", _gradient),
    "order of nodes": ("gradient", _order),
    "weight of a point": ("quadrature", _weights),
    "points": ("quadrature", _points),
}
PLANE_BAR = """material stuff = neo_hookean(young = 10 kPa, poisson = 0.3, density = 1000 kg/m^3)
shape flat = quadrilateral((0, 0, 0) mm, (20, 0, 0) mm, (20, 10, 0) mm, (0, 10, 0) mm)
body bar = plane_strain(flat, stuff, thickness = 10 mm)
support wall = fixed(bar, where = x <= 0 mm)
load pull = traction(bar, where = x >= 20 mm, vector = (1000, 400, 0) Pa)
model one = fem({word}, strain = finite, size = 5 mm)
probe tip = point(bar, at = (20, 5, 0) mm)
metric down = displacement(tip, along = +y)
"""
SLICES = {"wedge6": "tri3", "wedge15": "tri6"}  # elements that only slices have, by the words of those in the plane


def element_text(kind: str) -> str:
    if kind in SLICES:
        return PLANE_BAR.format(word=SLICES[kind])
    return bar("neo_hookean", "full").replace("hex8", kind).replace("size = 10 mm", "size = 7 mm")


@pytest.mark.parametrize(("kind", "broken"), some_quick([(k, b) for k in CELLS for b in ELEMENT_BREAKS]))
def test_a_wrong_element_is_seen(kind: str, broken: str, monkeypatch: pytest.MonkeyPatch) -> None:
    if kind in ("tet4", "wedge6") and broken == "points":
        pytest.skip("its strain is the same at every point of a plane across the third axis")
    text, (name, break_) = element_text(kind), ELEMENT_BREAKS[broken]
    must_be_right(text)
    monkeypatch.setattr(CELLS[kind], name, staticmethod(break_(getattr(CELLS[kind], name))))
    with suppress(softmark.SceneError, np.linalg.LinAlgError, ArithmeticError):  # it does not come as far as an answer
        assert said_of(text), f"{broken} of {kind} is wrong, and nothing is said"


# ------------------------------------------------------------------ loads

BEAM = """material stuff = linear_elastic(young = 1 MPa, poisson = 0.3, density = 1000 kg/m^3)
body bar = solid(cylinder(length = 100 mm, radius = 5 mm, axis = +x), stuff)
support wall = fixed(bar, where = x <= 0 mm)
{load}
model one = {model}
probe tip = point(bar, at = (100, 0, 0) mm)
metric down = displacement(tip, along = -z)
"""
SOLID = "fem(hex8, strain = finite, size = 6 mm)"
ROD = "beam6dof(segments = 6)"
LOAD_TEXTS: dict[str, dict[str, str]] = {
    "gravity": {"solid": "gravity(9.81 m/s^2, direction = -z)", "rod": "gravity(9.81 m/s^2, direction = -z)"},
    "traction": {"solid": "traction(bar, where = x >= 20 mm, vector = (1000, 400, 200) Pa)",
                 "rod": "traction(bar, where = x >= 100 mm, vector = (1000, 100, 200) Pa)"},
    "remote_stress": {"solid": "remote_stress(bar, where = x >= 20 mm, magnitude = 1 kPa, direction = +x)"},
    "pressure": {"solid": "pressure(bar, where = z >= 10 mm, magnitude = 500 Pa)"},
    "point_force": {"solid": "point_force(bar, at = (20, 6, 4) mm, vector = (0.05, 0.02, -0.05) N)",
                    "rod": "point_force(bar, at = (70, 0, 0) mm, vector = (0, 0.001, -0.002) N)"},
    "torque": {"solid": "torque(bar, where = x >= 20 mm, moment = (5e-4, 1e-4, 0) N*m)",
               "rod": "torque(bar, where = x >= 100 mm, moment = (1e-4, 1e-4, 0) N*m)"},
    "line_load": {"solid": "line_load(bar, from = (2, 5, 10) mm, to = (19, 6, 10) mm, vector = (0, 1, -2) N/m)",
                  "rod": "line_load(bar, from = (20, 0, 0) mm, to = (70, 0, 0) mm, vector = (0, 0.01, -0.02) N/m)"},
    "centrifugal": {"solid": "centrifugal(bar, axis = (0, 1, 2), through = (0, 2, 1) mm, speed = 20 rad/s)"},
    "tendon": {"rod": "tendon(bar, from = (0, 0, 3) mm, to = (80, 0, 3) mm, tension = 0.05 N)"},
}  # fmt: skip
MAKERS = {"solid": (load_setup, "_load"), "rod": (beam_build, "_load")}


def load_text(name: str, kind: str) -> str:
    assert name in LOAD_TEXTS, f"no scene here breaks the load `{name}`: add its words to LOAD_TEXTS"
    load = f"load press = {LOAD_TEXTS[name][kind]}"
    if kind == "rod":
        return BEAM.format(load=load, model=ROD)
    lines = bar("neo_hookean", "full").splitlines()
    return "\n".join(load if line.startswith("load") else line for line in lines).replace("size = 10 mm", "size = 5 mm")


def _turned(vector: Any) -> Any:
    """The same size in another direction."""
    v = np.array(vector, dtype=float)
    turned = np.roll(v, 1)
    return tuple(turned if not np.allclose(turned, v) else v * (1.0, -1.0, 1.0))


VECTORS = ("acceleration", "traction", "direction", "force", "moment", "axis")
SIZES = (*VECTORS[:2], "stress", "pressure", *VECTORS[3:5], "tension", "speed")
PLACES = {"at": -1e-3, "begin": 1e-3, "through": 1e-3}  # m, by which a place along x is wrong


def wrong_action(action: Any, how: str) -> Any:
    """The action of a load of another magnitude, direction or place; None where it has no such thing."""
    new: dict[str, Any] = {}
    for field in (f.name for f in dataclasses.fields(action)):
        value = getattr(action, field)
        if how == "magnitude" and field in SIZES:
            new[field] = tuple(BREAK * v for v in value) if isinstance(value, tuple) else BREAK * value
        if how == "direction" and field in VECTORS:
            new[field] = _turned(value)
        if how == "place" and field in PLACES:
            new[field] = (value[0] + PLACES[field], *value[1:])
        if how == "place" and field == "where":
            new[field] = elsewhere()
    return dataclasses.replace(action, **new) if new else None


@functools.cache
def elsewhere() -> Any:
    """Another part of the surface than loads of these scenes have."""
    text = BAR.format(law=law_text("neo_hookean"), model=MODELS["full"], pull=1, shear=0)
    scene = softmark.loads(HEAD + text.replace("where = x >= 20 mm", "where = y >= 10 mm and x >= 10 mm")).scene
    return scene.declared["pull"].thing.action.where


@dataclasses.dataclass(frozen=True)
class Acting:
    """What stands for a load of a scene, and acts in another way."""

    action: Any


LOAD_CASES = [
    (n, k, how) for n in LOADS for k in LOAD_TEXTS.get(n, {"solid": ""}) for how in ("magnitude", "direction", "place")
]


@pytest.mark.parametrize(("name", "kind", "how"), some_quick(LOAD_CASES, 3))
def test_a_wrong_load_is_seen(name: str, kind: str, how: str, monkeypatch: pytest.MonkeyPatch) -> None:
    text = load_text(name, kind)
    must_be_right(text)
    room, function = MAKERS[kind]
    right, asked = getattr(room, function), []

    def wrong(case: Any, load: Any, *rest: Any) -> Any:
        action = wrong_action(load.thing.action, how)
        asked.append(action)
        return right(case, load if action is None else dataclasses.replace(load, thing=Acting(action)), *rest)

    monkeypatch.setattr(room, function, wrong)
    found = said_of(text)
    assert asked
    if asked[0] is None or (how == "place" and kind == "rod" and "where" in vars(asked[0])):
        pytest.skip("it has no such thing")
    assert found, f"{how} of {name} is wrong in {kind}, and nothing is said"


# ------------------------------------------------------------------ supports

HELD = """material stuff = neo_hookean(young = 10 kPa, poisson = 0.3, density = 1000 kg/m^3)
body bar = solid(box(size = (20, 10, 10) mm), stuff)
{support}
load pull = traction(bar, where = x >= 20 mm, vector = ({pull}, 0, {shear}) Pa)
model one = fem(hex8, strain = finite, size = 5 mm)
probe tip = point(bar, at = (20, 5, 5) mm)
metric down = displacement(tip, along = +z)
"""
WALL = "support wall = fixed(bar, where = x <= 0 mm)\n"
SUPPORT_TEXTS: dict[str, str] = {
    "fixed": WALL.replace("wall", "held"),
    "displaced": WALL + "support held = displaced(bar, where = x >= 20 mm, by = (2, 1, 0) mm)",
    "rotated": WALL + "support held = rotated(bar, where = x >= 20 mm, axis = +x, angle = 20 deg,"
    " through = (0, 5, 5) mm)",
    "symmetric": "support held = symmetric(bar, where = x <= 0 mm)\nsupport side = symmetric(bar, where = y <= 0 mm)\n"
    "support below = symmetric(bar, where = z <= 0 mm)",
    "elastic_foundation": "support held = elastic_foundation(bar, where = x <= 0 mm, stiffness = 1 kPa/mm)",
    "rigid_plate": WALL.replace("x <= 0 mm", "x <= 0 mm and y <= 5 mm")
    + "support held = rigid_plate(bar, where = x >= 20 mm)",
}
NO_REACTION = {
    "drained": "it holds the pressure of a fluid: test_broken_energies.py",
    "pore_pressure": "it holds the pressure of a fluid: test_broken_energies.py",
    "pinned": "networks of beams only: `tests/interpreter/test_networks.py` breaks their reactions",
    "measured_motion": "it needs a file of tracked points; its reaction is found as that of `displaced`",
}


def _more(vector: Any) -> tuple[float, ...]:
    return tuple(BREAK * v for v in vector)


def support_text(name: str) -> str:
    known = name in SUPPORT_TEXTS or name in NO_REACTION
    assert known, f"no scene here breaks the support `{name}`: add its words to SUPPORT_TEXTS"
    pull, shear = {"symmetric": (1000, 0), "rigid_plate": (300, 0)}.get(name, (300, 100))
    return HELD.format(support=SUPPORT_TEXTS[name], pull=pull, shear=shear)


@pytest.mark.parametrize("name", some_quick(SUPPORTS))
def test_a_wrong_reaction_is_seen(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    if name in NO_REACTION:
        pytest.skip(NO_REACTION[name])
    text = support_text(name)
    must_be_right(text)
    right = reaction_and_work.reactions

    def wrong(*arguments: Any) -> Any:
        found = dict(right(*arguments))
        own = found["held"]
        found["held"] = dataclasses.replace(own, force=_more(own.force), moment=_more(own.moment))
        return found

    monkeypatch.setattr(reaction_and_work, "reactions", wrong)
    assert said_of(text), f"the reaction of {name} is 5 % wrong, and nothing is said"


@pytest.mark.parametrize("name", some_quick([n for n in SUPPORTS if n in ("fixed", "displaced", "rotated")]))
def test_a_wrong_motion_is_seen(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """What supports impose, of another size or, of what is held, not nothing."""
    text = support_text(name)
    must_be_right(text)
    right = support_constraints.displacements
    monkeypatch.setattr(
        support_constraints, "displacements", lambda *a, **k: BREAK * right(*a, **k) + (BREAK - 1.0) * 1e-4
    )
    assert "does not hold the body where it should" in said_of(text)
