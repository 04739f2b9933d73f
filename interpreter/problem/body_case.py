"""Case: one body with its supports, loads and contacts, as models and references use it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any

from softmark.grammar.diagnostic import Diagnostic, Remedy
from softmark.interpreter.language import units
from softmark.interpreter.language.compiled_scene import Declared, Location, Scene, is_rigid
from softmark.interpreter.language.coordinate_conditions import EVERYWHERE, RELATIVE_TOLERANCE, Condition, Term
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.vocabulary.analysis_words import Dynamic, Quasistatic, Static
from softmark.interpreter.vocabulary.loads.body_force import BodyForce
from softmark.interpreter.vocabulary.loads.point_force import PointForce
from softmark.interpreter.vocabulary.self_contact_words import SelfContact, Tied
from softmark.interpreter.vocabulary.supports.plane_constraint import PlaneConstraint
from softmark.records import dataclass
from softmark.solvers.mesh.shape import Shape, Swept


class Fault(Exception):
    """Exception for a part of the scene that cannot be represented or built; it carries a diagnostic."""

    def __init__(self, diagnostic: Diagnostic) -> None:
        super().__init__(diagnostic.message)
        self.diagnostic = diagnostic


def fault(code: str, at: Location, message: str, label: str = "", help: str | Remedy = "") -> Fault:
    """Return a Fault whose diagnostic points at a location of the scene."""
    return Fault(diagnostic(code, at, message, label, help))


@dataclass(frozen=True)
class RigidBodyContact:
    """Contact of a body with a rigid body, and the supports and loads of the rigid body, in scene order.

    `along` is the direction, 0 to 2, in which loads may press the rigid body in statics, or None. `force_travel`, m, is
    how far they have pressed it.
    """

    declared: Declared
    rigid: Declared
    moved: tuple[Declared, ...]
    loads: tuple[Declared, ...] = ()  # loads on a rigid body that is free to move
    along: int | None = None  # direction (0 to 2) in which loads may press it in statics
    force_travel: float = 0.0  # m, travel that the loads cause

    @property
    def name(self) -> str:
        """Name of the contact."""
        return self.declared.name

    @property
    def thing(self) -> Any:
        """Contact object that the scene declares."""
        return self.declared.thing

    @property
    def driven(self) -> bool:
        """True if a support moves the rigid body, or a force applied to it presses it."""
        own = (load.value("body") == self.rigid.name for load in self.loads)
        return any(support.thing.moves for support in self.moved) or any(own)

    def at(self, name: str = "") -> Location:
        """Return the location of the named field of the contact, or of the contact's name if it has no such field."""
        return self.declared.at(name)


@dataclass(frozen=True)
class Case:
    """One deformable body with its materials, supports, loads and contacts."""

    body: Declared
    supports: tuple[Declared, ...]
    loads: tuple[Declared, ...]
    analysis: Static | Dynamic | Quasistatic
    other_material: Any = None  # material of a model that replaces the body's
    parts: tuple[Declared, ...] = ()  # regions with a material of their own
    groups: tuple[Declared, ...] = ()  # regions defined by named groups of a mesh file
    beds: tuple[Declared, ...] = ()  # elastic foundations and rigid plates: supports that fix no point
    contacts: tuple[RigidBodyContact, ...] = ()  # contacts with rigid bodies
    pairs: tuple[Declared, ...] = ()  # self-contacts and ties
    drains: tuple[Declared, ...] = ()  # supports that prescribe a pore pressure; they fix no point
    wide: bool = False  # True: supports hold all partly selected cells and facets (error estimate)
    leaning: tuple[int, int] = (
        0,
        0,
    )  # number of a region and 1 or -1: it gets all cells at its border, or none (error estimate)

    @property
    def shape(self) -> Shape:
        """Geometry of the body."""
        found: Shape = self.body.thing.shape
        return found

    @property
    def shape_location(self) -> Location:
        """Location in the scene at which the body's geometry is declared."""
        return self.body.at("region" if self.planar else "shape")

    @property
    def prism(self) -> Swept:
        """Geometry of a body that is swept along an axis. Raises TypeError for other bodies."""
        if (found := self.shape.swept) is None:
            raise TypeError(f"`{self.body.name}` has no section along an axis")
        return found

    @property
    def material(self) -> Any:
        """Material of the body."""
        return self.body.thing.as_it_is(self.other_material or self.body.thing.material)

    @property
    def materials(self) -> tuple[Any, ...]:
        """Materials of the body and of its regions, in scene order."""
        return (self.material, *(self.body.thing.as_it_is(part.thing.material) for part in self.parts))

    @property
    def muscles(self) -> tuple[Declared, ...]:
        """The declaration of the body, once for each material with active tension, as if it had only this material."""
        return tuple(replace(self.body, thing=m) for m in self.materials if getattr(m, "pulls", False))

    @property
    def has_friction(self) -> bool:
        """True if friction makes a state depend on earlier states."""
        each = (*(touch.declared for touch in self.contacts), *self.pairs)
        return any(getattr(own.thing, "friction", 0.0) for own in each)

    @property
    def has_history(self) -> bool:
        """True if a state depends on earlier ones, through friction, stress relaxation or pore fluid."""
        return self.has_friction or self.has_material_history

    @property
    def named_supports(self) -> tuple[Declared, ...]:
        """Supports of the scene, without the implied constraint that keeps a plane body in its plane."""
        return tuple(s for s in self.supports if not s.thing.implied)

    @property
    def planar(self) -> str:
        """`plane_strain`, `plane_stress` or `axisymmetric` for a plane body; "" for a solid."""
        kind: str = self.body.thing.planar
        return kind

    @property
    def depth(self) -> float:
        """Thickness, m, of the slice that represents a body of revolution; 0 for any other body."""
        return float(self.body.thing.thickness) if self.planar == "axisymmetric" else 0.0

    @property
    def largest_poisson(self) -> float:
        """Largest Poisson's ratio of the materials; estimated by samples if it varies."""
        return float(max(material.poisson for material in self.typical))

    @property
    def largest_young(self) -> float:
        """Largest Young's modulus of the materials, Pa; estimated by samples if it varies."""
        return float(max(2.0 * material.shear_modulus * (1.0 + material.poisson) for material in self.typical))

    @property
    def least_young(self) -> float:
        """Least Young's modulus of the materials, Pa; estimated by samples if it varies."""
        return float(min(2.0 * material.shear_modulus * (1.0 + material.poisson) for material in self.typical))

    @property
    def uniform(self) -> bool:
        """True if the constants of each material of the body are uniform."""
        return all(getattr(material, "uniform", True) for material in self.materials)

    @property
    def has_material_history(self) -> bool:
        """True if one of the materials is viscoelastic or porous, so that the history of loading matters."""
        return self.porous or any(material.branches for material in self.materials)

    @property
    def has_force_driven_body(self) -> bool:
        """True if loads press a rigid body in statics, so that its position is part of the solution."""
        return any(touch.along is not None for touch in self.contacts)

    @property
    def porous(self) -> bool:
        """True if a material of the case is porous."""
        return any(porous(material) for material in self.materials)

    @cached_property
    def typical(self) -> tuple[Any, ...]:
        """Materials with one representative number for each varying constant, to estimate orders of magnitude."""
        if self.uniform:
            return self.materials
        from softmark.interpreter.problem.representative_constants import representative_material

        return tuple(representative_material(material, self.shape) for material in self.materials)

    @property
    def plain(self) -> Case:
        """Case with a single uniform material; constants that vary have a representative value."""
        return self if getattr(self.material, "uniform", True) else replace(self, other_material=self.typical[0])

    @property
    def gravity(self) -> tuple[float, float, float]:
        """Sum of all accelerations of gravity, m/s^2."""
        pulls = [d.thing.action for d in self.loads if isinstance(d.thing.action, BodyForce)]
        x, y, z = (sum(p.acceleration[i] for p in pulls) for i in range(3))
        return x, y, z


def porous(material: Any) -> bool:
    """Return whether a material is porous: for muscle its passive material, for a plate the material of its solid."""
    if getattr(material, "thin", False):
        return porous(material.of)
    if getattr(material, "permeability", None) is not None:
        return True
    return hasattr(material, "passive") and porous(material.passive)


def case_of(scene: Scene, body: str) -> Case:
    """Return the case of a body; it is built once per scene."""
    key = Case, body
    if key not in scene.known:
        scene.known[key] = _build_case(scene, body)
    case: Case = scene.known[key]
    return case


def _build_case(scene: Scene, body: str) -> Case:
    analyses = list(scene.of_kind("analysis").values())
    regions = [r for r in scene.of_kind("region").values() if r.thing.body == body and r.thing.material]
    if all(r.thing.material == scene.declared[body].thing.material for r in regions):
        regions = []  # regions of the body's own material only name a selection
    acting, touching = scene.acting("support", body), scene.acting("contact", body)
    return Case(
        body=scene.declared[body],
        supports=(
            *(s for s in acting if s.thing.role == "constraint"),
            *plane_constraints(scene.declared[body]),
        ),
        loads=scene.acting("load", body),
        analysis=analyses[0].thing if analyses else Static(),
        parts=tuple(regions),
        beds=tuple(s for s in acting if s.thing.role == "springs"),
        drains=tuple(s for s in acting if s.thing.role == "drain"),
        contacts=tuple(
            _build_contact(scene, contact) for contact in touching if not isinstance(contact.thing, SelfContact | Tied)
        ),
        pairs=tuple(contact for contact in touching if isinstance(contact.thing, SelfContact | Tied)),
        groups=tuple(r for r in scene.of_kind("region").values() if r.thing.body == body and r.thing.group is not None),
    )


def _build_contact(scene: Scene, contact: Declared) -> RigidBodyContact:
    name = contact.thing.rigid
    found = RigidBodyContact(contact, scene.declared[name], scene.acting("support", name), scene.acting("load", name))
    if not is_force_driven(scene, found.rigid):
        return found
    left = free_directions(scene, found.rigid, scene.declared[contact.thing.body])
    return replace(found, along=left[0] if len(left) == 1 else None)


def is_force_driven(scene: Scene, body: Declared) -> bool:
    """Return whether loads determine a rigid body's position in statics, because it has a mass or an applied force."""
    analysis = next(iter(scene.of_kind("analysis").values()), None)
    if not is_rigid(body) or (analysis is not None and not isinstance(analysis.thing, Static)):
        return False
    own = (load for load in scene.acting("load", body.name) if load.value("body") == body.name)
    return body.thing.free or any(isinstance(load.thing, PointForce) for load in own)


def free_directions(scene: Scene, instrument: Declared, body: Declared) -> list[int]:
    """Return the free directions (0 to 2) of a rigid body.

    The other directions are held by its supports, or by the plane or axis of the plane body that it touches.
    """
    held = {2} if body.thing.planar else set[int]()
    held |= {0} if body.thing.planar == "axisymmetric" else set()
    for support in scene.acting("support", instrument.name):
        held |= set(support.thing.components)
    return [i for i in range(3) if i not in held]


def plane_constraints(body: Declared) -> tuple[Declared, ...]:
    """Return the implied support that keeps a plane body in its plane; empty for a solid."""
    if not body.thing.planar:
        return ()
    held = PlaneConstraint(body.name, EVERYWHERE, (2,))
    plane = Declared("support", f"the plane of {body.name}", body.constructor, held, body.location)
    if body.thing.planar != "axisymmetric" or _is_off_axis(body.thing.shape):
        return (plane,)
    on_axis = Condition.comparison("<=", Term.coordinate(0), Term.constant(0.0), 1)
    axis = PlaneConstraint(body.name, on_axis, (0,))
    return plane, Declared("support", f"the axis of {body.name}", body.constructor, axis, body.location)


def _is_off_axis(shape: Shape) -> bool:
    """Return whether a plane region has no point on the y axis."""
    return shape.bounds is None or shape.bounds[0][0] > RELATIVE_TOLERANCE * shape.diagonal


def case_for(scene: Scene, worker: Declared) -> Case:
    """Return the case of a model or reference, with its own material if it declares one.

    Raises Fault if its body is ambiguous or rigid.
    """
    other = worker.thing.other_material if worker.kind == "model" else None
    body = scene.declared[body_of(scene, worker)]
    if is_rigid(body):
        raise Fault(rigid_body_error(worker, body, f"name a deformable body: a rigid body has no {worker.kind}s"))
    case = case_of(scene, body.name)
    if other is None:
        return case
    key = Case, case.body.name, id(other)  # the cached case keeps this object alive, so its id stays unique
    if key not in scene.known:
        scene.known[key] = replace(case, other_material=other)
    found: Case = scene.known[key]
    return found


def rigid_body_error(declared: Declared, body: Declared, help: str) -> Diagnostic:
    """Return the error of a declaration that refers to a rigid body but needs a deformable one."""
    problem = f"`{declared.name}` needs a deformable body, but `{body.name}` is rigid"
    return diagnostic("E655", declared.at("body"), problem, f"unsupported {declared.kind} of a rigid body", help)


def body_of(scene: Scene, declared: Declared) -> str:
    """Return the name of the body of a model, reference or probe: the given name, or the only body. Raises Fault."""
    named: str | None = declared.value("body")
    if named is not None:
        return named
    bodies = list(scene.of_kind("body"))
    if len(bodies) == 1:
        return bodies[0]
    if not bodies:
        raise fault(
            "E221",
            declared.at(),
            f"`{declared.name}` needs a body, but the scene has none",
            "no body is declared",
            "add one: `body beam = solid(cylinder(...), material)`",
        )
    raise fault("E221", declared.at(), f"`{declared.name}` could refer to any of {len(bodies)} bodies",
                "which body?",
                f"name one, `body = {bodies[0]}`; bodies: {', '.join(bodies)}")  # fmt: skip


def other_body(scene: Scene, declared: Declared, case: Case) -> str | None:
    """Return the body of a declaration if it differs from the body of the case, else None.

    A declaration with an ambiguous body counts as one of the same body; another check reports it.
    """
    try:
        body = body_of(scene, declared)
    except Fault:
        return None
    return None if body == case.body.name else body


def describe_extent(low: Sequence[float], high: Sequence[float]) -> str:
    """Return the extent of a body as text: `x from 0 to 178 mm, y from -19 to 19 mm, ...`."""
    return ", ".join(
        f"{n} from {units.format_range(a, b, units.LENGTH)}" for n, a, b in zip("xyz", low, high, strict=True)
    )
