"""Random scenes of boxes that are held and loaded on parts of their surface, and moved by courses.

A case knows its geometry as numbers, so that a truth can be computed without the language: selections are boxes
(`Region`) or a disc on one face; courses are named with their numbers. To add a kind of selection: a line in `support`
or `load`.
"""

from __future__ import annotations

import math
import random
from dataclasses import dataclass, field

Point = tuple[float, float, float]
AXES = "xyz"


@dataclass(frozen=True)
class Region:
    """All points between two corners, mm; a disc of a radius around the middle of them in the plane of its face."""

    low: Point = (-math.inf,) * 3
    high: Point = (math.inf,) * 3
    disc: tuple[int, float, float, float] | None = None  # axis normal to it, its centre in the plane, radius, mm

    @property
    def text(self) -> str:
        """The condition of the language."""
        parts = [f"{AXES[i]} >= {v:.9g} mm" for i, v in enumerate(self.low) if math.isfinite(v)]
        parts += [f"{AXES[i]} <= {v:.9g} mm" for i, v in enumerate(self.high) if math.isfinite(v)]
        if self.disc is not None:
            axis, p, q, r = self.disc
            u, v = (AXES[i] for i in range(3) if i != axis)
            parts.append(f"({u} - {p:.9g} mm)^2 + ({v} - {q:.9g} mm)^2 <= {r * r:.12g} mm^2")
        return " and ".join(parts)

    def cuts(self, axis: int) -> list[float]:
        """Planes normal to an axis that bound it, mm."""
        found = [v for v in (self.low[axis], self.high[axis]) if math.isfinite(v)]
        if self.disc is not None and axis != self.disc[0]:
            centre = self.disc[1 + [i for i in range(3) if i != self.disc[0]].index(axis)]
            found += [centre - self.disc[3], centre + self.disc[3]]
        return found


@dataclass(frozen=True)
class Course:
    """A course by name and numbers (s or Hz)."""

    name: str
    numbers: tuple[float, ...]

    @property
    def text(self) -> str:
        """The call of the language."""
        match self.name:
            case "sine":
                return f"sine({self.numbers[0]:.9g} Hz)"
            case "pulse":
                return f"pulse(start = {self.numbers[0]:.9g} s, until = {self.numbers[1]:.9g} s)"
            case _:
                return f"{self.name}(over = {self.numbers[1]:.9g} s, start = {self.numbers[0]:.9g} s)"

    def at(self, t: float) -> float:
        """Its value, from its definition in the language's reference."""
        first, *rest = self.numbers
        match self.name:
            case "sine":
                return math.sin(2 * math.pi * first * t)
            case "pulse":
                return 1.0 if first <= t < rest[0] else 0.0
        share = min(1.0, max(0.0, (t - first) / rest[0]))
        return share if self.name == "ramp" else 0.5 - 0.5 * math.cos(math.pi * share)

    @property
    def breaks(self) -> list[float]:
        """Times at which it has a kink or jumps, s."""
        if self.name == "sine":
            return []
        return [self.numbers[0], self.numbers[1] if self.name == "pulse" else sum(self.numbers)]


@dataclass(frozen=True)
class Load:
    """A traction (Pa, three components) or a pressure (Pa) on a part of the surface."""

    where: Region
    vector: Point | None
    pressure: float = 0.0


@dataclass(frozen=True)
class Case:
    """One body with what holds and loads it; sizes in mm."""

    seed: int
    size: Point
    poisson: float
    support: Region
    load: Load
    mesh: float  # size of the cells of the models
    course: Course | None = None
    step: float = 0.0  # s
    duration: float = 0.0  # s
    damping: float = 0.0  # 1/s, proportional to mass
    integrator: str = "newmark"
    young: float = 60e3
    density: float = 1000.0
    from_file: bool = False
    models: tuple[str, ...] = field(default=("hex8", "tet4", "tet10"))

    @property
    def probe(self) -> tuple[Point, Point]:
        """A line within the body, away from where it is held, mm."""
        a, b, c = self.size
        return (0.5 * a, 0.45 * b, 0.5 * c), (0.95 * a, 0.45 * b, 0.5 * c)

    def text(self, mesh_file: str | None = None) -> str:
        """The scene."""
        a, b, c = self.size
        (px, py, pz), (qx, qy, qz) = self.probe
        shape = f'mesh("{mesh_file}", unit = 1 mm)' if mesh_file else f"box(size = ({a:.9g}, {b:.9g}, {c:.9g}) mm)"
        course = f", amplitude = {self.course.text}" if self.course else ""
        if self.load.vector is not None:
            t = ", ".join(f"{v:.9g}" for v in self.load.vector)
            load = f"traction(b, where = {self.load.where.text}, vector = ({t}) Pa{course})"
        else:
            load = f"pressure(b, where = {self.load.where.text}, magnitude = {self.load.pressure:.9g} Pa{course})"
        analysis = "static()"
        if self.course:
            analysis = (
                f"dynamic(duration = {self.duration:.9g} s, step = {self.step:.9g} s, "
                f"integrator = {self.integrator}, damping_mass = {self.damping:.9g} Hz)"
            )
        size = "" if mesh_file else f", size = {self.mesh:.9g} mm"
        return (
            "\n".join(
                [
                    f'scene "random {self.seed}"',
                    f"material m = linear_elastic(young = {self.young:.9g} Pa, poisson = {self.poisson:.9g}, "
                    f"density = {self.density:.9g} kg/m^3)",
                    f"body b = solid({shape}, m)",
                    f"support w = fixed(b, where = {self.support.text})",
                    f"load l = {load}",
                    f"analysis a = {analysis}",
                    *(f"model {m}_ = fem({m}, strain = small{size})" for m in self.models),
                    f"probe axis = line(b, from = ({px:.9g}, {py:.9g}, {pz:.9g}) mm, "
                    f"to = ({qx:.9g}, {qy:.9g}, {qz:.9g}) mm, points = 5)",
                ]
            )
            + "\n"
        )


def support(chance: random.Random, size: Point) -> Region:
    """What is held: a part of the end face x = 0, a layer at that end, a band on the underside, or a disc."""
    a, b, c = size
    inf = math.inf
    match chance.choice(("face", "half", "corner", "strip", "layer", "under", "disc")):
        case "face":
            return Region(high=(0.0, inf, inf))
        case "half":
            return Region(high=(0.0, inf, chance.uniform(0.3, 0.97) * c))
        case "corner":
            return Region(high=(0.0, chance.uniform(0.4, 0.95) * b, chance.uniform(0.4, 0.95) * c))
        case "strip":
            low = chance.uniform(0.05, 0.35)
            return Region(low=(-inf, low * b, -inf), high=(0.0, chance.uniform(low + 0.3, 0.95) * b, inf))
        case "layer":
            return Region(high=(chance.uniform(0.02, 0.2) * a, inf, inf))
        case "under":
            return Region(high=(chance.uniform(0.15, 0.4) * a, inf, 0.0))
    r = chance.uniform(0.25, 0.45) * min(b, c)
    return Region(high=(0.0, inf, inf), disc=(0, 0.5 * b, 0.5 * c, r))


def load(chance: random.Random, size: Point) -> Load:
    """What is loaded: a part of the far end, of the upper side, a band around the end, or a disc on the upper side."""
    a, b, c = size
    inf = math.inf
    where = Region(low=(a, -inf, -inf))
    match chance.choice(("end", "half", "band", "around", "disc")):
        case "half":
            where = Region(low=(a, -inf, chance.uniform(0.05, 0.8) * c))
        case "band":
            low = chance.uniform(0.5, 0.8)
            where = Region(low=(low * a, -inf, c), high=(chance.uniform(low + 0.05, 1.0) * a, inf, inf))
        case "around":
            where = Region(low=(chance.uniform(0.8, 0.995) * a, -inf, -inf))
        case "disc":
            r = chance.uniform(0.15, 0.45) * b
            where = Region(low=(-inf, -inf, c), disc=(2, 0.75 * a, 0.5 * b, min(r, 0.2 * a)))
    if chance.random() < 0.3:
        return Load(where, None, chance.uniform(1.0, 3.0))
    return Load(where, (chance.uniform(-2, 2), chance.uniform(-2, 2), chance.uniform(-3, -1)))


def course(chance: random.Random, period: float) -> Course:
    """A course whose times are from a hundredth of the body's longest period to all of it."""
    name = chance.choice(("sine", "pulse", "ramp", "smooth"))
    time = period * 10 ** chance.uniform(-2, 0.3)
    if name == "sine":
        return Course(name, (1.0 / time,))
    start = chance.uniform(0.0, 0.3) * period
    return Course(name, (start, start + time if name == "pulse" else time))


def first_period(size: Point, young: float, density: float) -> float:
    """That of a clamped bar in bending about its thinner side, s (Rayleigh 1877): scales times of courses only."""
    a, thin = 1e-3 * size[0], 1e-3 * min(size[1:])
    return 2 * math.pi / (3.516 / a**2 * math.sqrt(young * thin**2 / 12 / density))


def random_case(seed: int) -> Case:
    """The case of a number: a third each of bodies at rest, at rest from a mesh file, and in motion."""
    chance = random.Random(seed)
    b = chance.uniform(10, 20)
    size = (b * chance.uniform(1.5, 4.0), b, b * chance.uniform(0.6, 1.4))
    poisson = chance.choice((0.0, 0.2, 0.3, 0.4))
    mesh = min(size) / chance.uniform(1.6, 4.0)
    held, loaded = support(chance, size), load(chance, size)
    kind = seed % 3
    if kind == 2:
        period = first_period(size, 60e3, 1000.0)
        step = period / chance.choice((10, 20, 40, 80))
        return Case(
            seed, size, poisson, held, loaded, max(mesh, min(size) / 2.5), course(chance, period), step,
            step * math.ceil(1.5 * period / step), chance.choice((0.0, 1.0 / period)),
            chance.choice(("newmark", "bdf2", "generalized_alpha")), models=("hex8", "tet10"),
        )  # fmt: skip
    return Case(seed, size, poisson, held, loaded, mesh, from_file=kind == 1)
