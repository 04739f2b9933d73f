"""Bodies whose answers theory knows: closed forms, ordinary differential equations and published numbers.

Nothing of it comes from the solver. `cases()` has them all, for `stated_truths.py`. Half of them (`tune`) were looked
at while estimates were made, the other half (`held`) to measure; that loads counted twice was seen in its `ball`,
though, and that frequencies had lost their number in its `tones`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

from scipy.integrate import quad, solve_ivp
from scipy.optimize import brentq

Truth = tuple[str, float, float]  # metric as the scene has it, its value, and the scale of errors of it, in SI units


@dataclass(frozen=True)
class Case:
    """A scene without models, the models, and the truth of every metric."""

    name: str
    half: str
    text: str
    models: tuple[str, ...]
    truths: dict[str, Truth] = field(default_factory=dict)
    error: float = 0.0  # relative: what is not known of the truth

    def scene(self) -> str:
        """The whole scene."""
        lines = ["softmark 1", f'scene "{self.name}"', self.text.strip()]
        lines += [f"model m{i} = fem({made})" for i, made in enumerate(self.models)]
        lines += [f"metric q_{name} = {made}" for name, (made, _, _) in self.truths.items()]
        return "\n".join(lines) + "\n"


# ------------------------------------------------------------------ closed forms, lengths in m, stresses in Pa


def lame(p: float, a: float, b: float, E: float, nu: float, power: int, r: float) -> tuple[float, float, float]:
    """Radial displacement, radial and hoop stress of a sphere (3) or a cylinder of plane strain (2), pressed inside.

    Source: Timoshenko and Goodier (1970), sections 28 and 136.
    """
    A = p * a**power / (b**power - a**power)
    falling = A * (b / r) ** power
    radial, hoop = A - falling, A + falling / (power - 1)
    if power == 3:
        return r / E * ((1 - nu) * hoop - nu * radial), radial, hoop
    return (1 + nu) / E * r * ((1 - nu) * hoop - nu * radial), radial, hoop


def inflated(p: float, a: float, b: float, E: float, nu: float, power: int) -> Any:
    """Radii r(R) of a neo-Hookean sphere (3) or cylinder of plane strain (2), pressed inside, by shooting.

    psi = mu/2 (I1 - 3) - mu ln J + lam/2 (ln J)^2; d/dR (R^(n-1) P_R) = (n-1) R^(n-2) P_t, P_R = -p (r/R)^(n-1) inside.
    """
    mu, lam, n = E / (2 * (1 + nu)), E * nu / ((1 + nu) * (1 - 2 * nu)), power

    def along(R: float, r: float, P: float) -> float:
        t = r / R

        def left(s: float) -> float:
            return mu * (s - 1 / s) + lam * math.log(s * t ** (n - 1)) / s - P

        return float(brentq(left, 0.05, 20.0, xtol=1e-15))

    def slope(R: float, y: Any) -> list[float]:
        r, P = y
        s, t = along(R, r, P), r / R
        hoop = mu * (t - 1 / t) + lam * math.log(s * t ** (n - 1)) / t
        return [s, (n - 1) / R * (hoop - P)]

    def shot(r: float) -> Any:
        return solve_ivp(slope, (a, b), [r, -p * (r / a) ** (n - 1)], rtol=1e-11, atol=1e-14, dense_output=True)

    inner = brentq(lambda r: shot(r).y[1, -1], a * 1.0001, a * 1.5, xtol=1e-14)
    return shot(inner).sol


SYMMETRIC = "\n".join(f"support s{c} = symmetric(b, where = {c} <= 0 mm)" for c in "xyz")
PLANE = "\n".join(f"support s{c} = symmetric(b, where = {c} <= 0 mm)" for c in "xy")


def sphere(name: str, half: str, nu: float, models: tuple[str, ...]) -> Case:
    """Lame's sphere of 10 and 20 mm, an octant."""
    E, p, a, b = 1e5, 0.1, 0.01, 0.02
    text = f"""
material m = linear_elastic(young = 100 kPa, poisson = {nu}, density = 1000 kg/m^3)
body b = solid(spherical_shell(radius = 20 mm, inner = 10 mm, part = octant), m)
{SYMMETRIC}
load p = pressure(b, where = x^2 + y^2 + z^2 <= (14 mm)^2, magnitude = 0.1 Pa)
probe ia = point(b, at = (10, 0, 0) mm)
probe oa = point(b, at = (0, 20, 0) mm)
probe ma = point(b, at = (0, 0, 15) mm)
"""
    inner, outer, middle = (lame(p, a, b, E, nu, 3, r) for r in (a, b, 0.015))
    work = 0.5 * p * inner[0] * 4 * math.pi * a * a / 8
    return Case(name, half, text, models, {
        "ui": ("displacement(ia, along = +x)", inner[0], inner[0]),
        "uo": ("displacement(oa, along = +y)", outer[0], inner[0]),
        "hoop": ("stress(ia, component = yy)", inner[2], p),
        "rad": ("stress(ma, component = zz)", middle[1], p),
        "hout": ("stress(oa, component = xx)", outer[2], p),
        "W": ("strain_energy(b)", work, work),
    })  # fmt: skip


def cylinder(name: str, half: str, nu: float, models: tuple[str, ...]) -> Case:
    """Lame's cylinder of plane strain, a quarter."""
    E, p, a, b, t = 1e5, 0.1, 0.01, 0.02, 0.001
    text = f"""
material m = linear_elastic(young = 100 kPa, poisson = {nu}, density = 1000 kg/m^3)
body b = plane_strain(quarter_ring(inner = 10 mm, outer = 20 mm), m, thickness = 1 mm)
{PLANE}
load p = pressure(b, where = x^2 + y^2 <= (10 mm)^2, magnitude = 0.1 Pa)
probe ia = point(b, at = (10, 0, 0) mm)
probe oa = point(b, at = (0, 20, 0) mm)
probe ma = point(b, at = (15, 0, 0) mm)
"""
    inner, outer, middle = (lame(p, a, b, E, nu, 2, r) for r in (a, b, 0.015))
    work = 0.5 * p * inner[0] * 2 * math.pi * a / 4 * t
    return Case(name, half, text, models, {
        "ui": ("displacement(ia, along = +x)", inner[0], inner[0]),
        "uo": ("displacement(oa, along = +y)", outer[0], inner[0]),
        "hoop": ("stress(ia, component = yy)", inner[2], p),
        "rad": ("stress(ma, component = xx)", middle[1], p),
        "W": ("strain_energy(b)", work, work),
        "F": ("force(sy, along = -y)", p * a * t, p * a * t),
    })  # fmt: skip


def ring(name: str, half: str, nu: float, models: tuple[str, ...]) -> Case:
    """Lame's cylinder as a body of revolution."""
    E, p, a, b, h = 1e5, 0.1, 0.01, 0.02, 0.005
    text = f"""
material m = linear_elastic(young = 100 kPa, poisson = {nu}, density = 1000 kg/m^3)
body b = axisymmetric(quadrilateral((10, 0, 0) mm, (20, 0, 0) mm, (20, 5, 0) mm, (10, 5, 0) mm), m)
support low = symmetric(b, where = y <= 0 mm)
support top = fixed(b, where = y >= 5 mm, components = y)
load p = pressure(b, where = x <= 10 mm, magnitude = 0.1 Pa)
probe ia = point(b, at = (10, 2.5, 0) mm)
probe oa = point(b, at = (20, 0, 0) mm)
"""
    inner, outer = (lame(p, a, b, E, nu, 2, r) for r in (a, b))
    work = 0.5 * p * inner[0] * 2 * math.pi * a * h
    push = 2 * math.pi * nu * p * a * a / (b * b - a * a) * (b * b - a * a)  # integral of sigma_y = nu 2 A, 2 pi r dr
    return Case(name, half, text, models, {
        "ui": ("displacement(ia, along = +x)", inner[0], inner[0]),
        "uo": ("displacement(oa, along = +x)", outer[0], inner[0]),
        "hoop": ("stress(ia, component = zz)", inner[2], p),
        "W": ("strain_energy(b)", work, work),
        "F": ("force(top, along = +y)", push, push),
    })  # fmt: skip


def torsion(name: str, half: str, models: tuple[str, ...]) -> Case:
    """A square bar that is twisted with its ends free to warp. Source: Timoshenko and Goodier (1970), section 109."""
    E, nu, a, L, angle = 1e5, 0.3, 0.01, 0.02, 1e-6
    G, odd = E / (2 * (1 + nu)), range(1, 200, 2)
    rate = angle / L
    stiff = 1 / 3 * (1 - 192 / math.pi**5 * sum(math.tanh(n * math.pi / 2) / n**5 for n in odd))
    torque = G * rate * stiff * a**4
    largest = G * rate * a * (1 - 8 / math.pi**2 * sum(1 / (n * n * math.cosh(n * math.pi / 2)) for n in odd))

    def warp(x: float, y: float) -> float:
        """w / rate = x y - 8 a^2 / pi^3 sum (-1)^k / n^3 sin(n pi x / a) sinh(n pi y / a) / cosh(n pi / 2)."""
        rest = sum((-1) ** ((n - 1) // 2) / n**3 * math.sin(n * math.pi * x / a) * math.sinh(n * math.pi * y / a)
                   / math.cosh(n * math.pi / 2) for n in odd[:60])  # fmt: skip
        return x * y - 8 * a * a / math.pi**3 * rest

    w = rate * warp(0.005, 0.0025)
    text = """
material m = linear_elastic(young = 100 kPa, poisson = 0.3, density = 1000 kg/m^3)
body b = solid(box(size = (10, 10, 20) mm, origin = (-5, -5, 0) mm), m)
support low = fixed(b, where = z <= 0 mm, components = (x, y))
support pin = fixed(b, where = x^2 + y^2 <= (0.01 mm)^2, components = z)
support top = rotated(b, where = z >= 20 mm, axis = +z, angle = 1e-6 rad, components = (x, y))
probe side = point(b, at = (5, 0, 10) mm)
probe rim = point(b, at = (5, 2.5, 10) mm)
"""
    return Case(name, half, text, models, {
        "T": ("moment(top, along = +z, about = (0, 0, 20) mm)", torque, torque),
        "tau": ("stress(side, component = yz)", largest, largest),
        "vm": ("stress(side)", math.sqrt(3) * largest, largest),
        "w": ("displacement(rim, along = +z)", w, rate * a * a / 40),
        "v": ("displacement(side, along = +y)", angle / 2 * 0.005, angle * 0.005),
        "W": ("strain_energy(b)", 0.5 * torque * angle, torque * angle),
    })  # fmt: skip


def bending(name: str, half: str, models: tuple[str, ...]) -> Case:
    """A quarter of a bar that is bent by turned ends, free to grow broader: u_x = -k x y, and so on."""
    E, nu, L, k = 1e5, 0.3, 0.02, 1e-6 / 0.02
    text = """
material m = linear_elastic(young = 100 kPa, poisson = 0.3, density = 1000 kg/m^3)
body b = solid(box(size = (20, 5, 5) mm), m)
support mid = symmetric(b, where = x <= 0 mm)
support half_ = symmetric(b, where = z <= 0 mm)
support axis = fixed(b, where = y <= 0 mm, components = (x, z))
support pin = fixed(b, where = x <= 0 mm and y <= 0 mm and z <= 0 mm, components = y)
support end = rotated(b, where = x >= 20 mm, axis = +z, angle = 1e-6 rad, through = (20, 0, 0) mm, components = x)
probe top = point(b, at = (10, 5, 0) mm)
probe tip = point(b, at = (20, 0, 0) mm)
probe side = point(b, at = (10, 5, 5) mm)
"""
    c, d = 0.005, 0.005
    moment = E * k * c * c**3 / 3  # of this quarter, about the z axis, without the sign
    return Case(name, half, text, models, {
        "v": ("displacement(tip, along = +y)", k / 2 * L * L, k / 2 * L * L),
        "s": ("stress(top, component = xx)", -E * k * c, E * k * c),
        "w": ("displacement(side, along = +z)", nu * k * c * d, nu * k * c * d),
        "M": ("moment(end, along = +z, about = (20, 0, 0) mm)", moment, moment),
        "W": ("strain_energy(b)", 0.5 * moment * k * L, moment * k * L),
    })  # fmt: skip


def column(name: str, half: str, models: tuple[str, ...]) -> Case:
    """A column under its weight that cannot grow broader: u = rho g (L z - z^2/2) / E, Poisson's ratio 0."""
    E, rho, g, L, area = 1e5, 1000.0, 1e-3, 0.04, 1e-4
    text = """
material m = linear_elastic(young = 100 kPa, poisson = 0, density = 1000 kg/m^3)
body b = solid(box(size = (10, 10, 40) mm), m)
support base = fixed(b, where = z <= 0 mm)
load w = gravity(0.001 m/s^2, direction = -z)
probe top = point(b, at = (5, 5, 40) mm)
probe low = point(b, at = (3, 4, 11) mm)
probe near = point(b, at = (5, 5, 15) mm)
"""
    f = rho * g
    return Case(name, half, text, models, {
        "top": ("displacement(top, along = -z)", f * L * L / 2 / E, f * L * L / 2 / E),
        "low": ("displacement(low, along = -z)", f * (L * 0.011 - 0.011**2 / 2) / E, f * L * L / 2 / E),
        "F": ("force(base, along = +z)", f * L * area, f * L * area),
        "s": ("stress(near, component = zz)", -f * (L - 0.015), f * L),
        "W": ("strain_energy(b)", f * f * area * L**3 / 6 / E, f * f * area * L**3 / 6 / E),
    })  # fmt: skip


def ball(name: str, half: str, models: tuple[str, ...]) -> Case:
    """A solid ball under pressure: u = -p (1 - 2 nu) r / E, the same pressure everywhere."""
    E, nu, p, R = 1e5, 0.3, 0.1, 0.01
    text = f"""
material m = linear_elastic(young = 100 kPa, poisson = 0.3, density = 1000 kg/m^3)
body b = solid(sphere(radius = 10 mm, part = octant), m)
{SYMMETRIC}
load p = pressure(b, where = x^2 + y^2 + z^2 >= (8 mm)^2, magnitude = 0.1 Pa)
probe rim = point(b, at = (10, 0, 0) mm)
probe in_ = point(b, at = (3, 3, 3) mm)
"""
    u = p * (1 - 2 * nu) * R / E
    energy = 0.5 * p * u * 4 * math.pi * R * R / 8
    return Case(name, half, text, models, {
        "u": ("displacement(rim, along = -x)", u, u),
        "s": ("stress(in_, component = pressure)", p, p),
        "W": ("strain_energy(b)", energy, energy),
        "F": ("force(sx, along = +x)", p * math.pi * 0.008**2 / 4, p * R * R),  # planes are pressed from 8 mm on
    })  # fmt: skip


def balloon(name: str, half: str, nu: float, models: tuple[str, ...], power: int) -> Case:
    """A neo-Hookean sphere, as a body of revolution, or cylinder of plane strain, inflated."""
    E, p, a, b = 1e5, 1e4, 0.01, 0.02
    shape = "quarter_ring(inner = 10 mm, outer = 20 mm)"
    made = f"axisymmetric({shape}, m)" if power == 3 else f"plane_strain({shape}, m, thickness = 1 mm)"
    held = "support sy = symmetric(b, where = y <= 0 mm)" if power == 3 else PLANE
    text = f"""
material m = neo_hookean(young = 100 kPa, poisson = {nu}, density = 1000 kg/m^3)
body b = {made}
{held}
load p = pressure(b, where = x^2 + y^2 <= (10 mm)^2, magnitude = {p} Pa)
probe ia = point(b, at = (10, 0, 0) mm)
probe oa = point(b, at = (20, 0, 0) mm)
probe ma = point(b, at = (15, 0, 0) mm)
"""
    r = inflated(p, a, b, E, nu, power)
    mu, lam, n = E / (2 * (1 + nu)), E * nu / ((1 + nu) * (1 - 2 * nu)), power
    ra, rb, (rm, Pm) = r(a)[0], r(b)[0], r(0.015)

    def stretches(R: float) -> tuple[float, float]:
        x, P = r(R)
        t = x / R
        s = brentq(lambda s: mu * (s - 1 / s) + lam * math.log(s * t ** (n - 1)) / s - P, 0.05, 20.0, xtol=1e-15)
        return float(s), t

    def density(R: float) -> float:
        s, t = stretches(R)
        J = math.log(s * t ** (n - 1))
        size = 2 * math.pi * R * R if n == 3 else math.pi / 2 * R * 1e-3
        return (mu / 2 * (s * s + (n - 1) * t * t - n) - mu * J + lam / 2 * J * J) * size

    s, t = stretches(a)
    J = s * t ** (n - 1)
    hoop = (mu * (t * t - 1) + lam * math.log(J)) / J
    energy = quad(density, a, b, epsabs=0, epsrel=1e-9)[0]
    return Case(name, half, text, models, {
        "ui": ("displacement(ia, along = +x)", ra - a, ra - a),
        "uo": ("displacement(oa, along = +x)", rb - b, ra - a),
        "rad": ("stress(ma, component = xx)", Pm / (rm / 0.015) ** (n - 1), p),
        "hoop": ("stress(ia, component = yy)", hoop, hoop),
        "W": ("strain_energy(b)", energy, energy),
    })  # fmt: skip


def tones(name: str, half: str, models: tuple[str, ...]) -> Case:
    """Longitudinal vibrations of a bar that cannot grow broader, clamped at one end: (2 k - 1) c / 4 L."""
    text = """
material m = linear_elastic(young = 100 kPa, poisson = 0.3, density = 1000 kg/m^3)
body b = solid(box(size = (40, 5, 5) mm), m)
support base = fixed(b, where = x <= 0 mm)
support sides = fixed(b, where = x >= 0 mm, components = (y, z))
"""
    c = math.sqrt(1e5 * 0.7 / (1.3 * 0.4) / 1000)
    return Case(name, half, text, models, {
        f"f{k}": (f"frequency(b, mode = {k})", (2 * k - 1) * c / 0.16, c / 0.16) for k in (1, 2, 3)
    })  # fmt: skip


def cook(name: str, half: str, models: tuple[str, ...]) -> Case:
    """Cook's membrane, plane stress, Poisson's ratio 1/3: 23.9642 F / (E t). Source: Bergan and Felippa (1985)."""
    text = """
material m = linear_elastic(young = 1 MPa, poisson = 0.33333333333, density = 1000 kg/m^3)
body b = plane_stress(quadrilateral((0, 0, 0) mm, (48, 44, 0) mm, (48, 60, 0) mm, (0, 44, 0) mm), m, thickness = 1 mm)
support wall = fixed(b, where = x <= 0 mm)
load f = traction(b, where = x >= 48 mm, vector = (0, 0.625, 0) Pa)
probe tip = point(b, at = (48, 52, 0) mm)
"""
    u = 23.9642e-3 * 1e-5
    return Case(name, half, text, models, {
        "v": ("displacement(tip, along = +y)", u, u),
        "F": ("force(wall, along = -y)", 0.625 * 16e-3 * 1e-3, 1e-5),
    }, error=4e-5)  # fmt: skip


def struck(name: str, half: str, models: tuple[str, ...]) -> Case:
    """A clamped bar that cannot grow broader, suddenly under its weight: a series of its modes."""
    E, rho, g, L, t = 1e5, 1000.0, 1e-3, 0.04, 0.012
    c = math.sqrt(E / rho)

    def at(x: float) -> float:
        found = 0.0
        for k in range(1, 400):
            q = (2 * k - 1) * math.pi / (2 * L)
            found += 2 * g / (L * q * (q * c) ** 2) * math.sin(q * x) * (1 - math.cos(q * c * t))
        return found

    text = """
material m = linear_elastic(young = 100 kPa, poisson = 0, density = 1000 kg/m^3)
body b = solid(box(size = (40, 5, 5) mm), m)
support base = fixed(b, where = x <= 0 mm)
load w = gravity(0.001 m/s^2, direction = +x)
analysis fall = dynamic(duration = 12 ms, step = 0.1 ms)
probe tip = point(b, at = (40, 0, 0) mm)
probe mid = point(b, at = (20, 0, 0) mm)
"""
    return Case(name, half, text, models, {
        "tip": ("displacement(tip, along = +x)", at(L), g * L * L / c**2),
        "mid": ("displacement(mid, along = +x)", at(L / 2), g * L * L / c**2),
    })  # fmt: skip


SMALL = ", strain = small, size = "
FINITE = ", strain = finite, size = "


def cases() -> Iterator[Case]:
    """All of them."""
    yield sphere("lame sphere", "tune", 0.3, tuple(e + SMALL + s for e, s in (
        ("hex8", "5 mm"), ("hex8", "2.5 mm"), ("hex8, integration = selective", "3 mm"), ("hex20", "5 mm"),
        ("tet4", "3 mm"), ("tet10", "5 mm"))))  # fmt: skip
    yield sphere("lame sphere, tight", "held", 0.49, tuple(e + SMALL + s for e, s in (
        ("hex8, formulation = mean_dilatation", "4 mm"), ("hex27", "5 mm"), ("tet10", "4 mm"),
        ("hex8, formulation = mixed", "4 mm"), ("tet10, formulation = mixed", "5 mm"))))  # fmt: skip
    yield cylinder("lame cylinder", "tune", 0.3, tuple(e + SMALL + s for e, s in (
        ("quad4", "3 mm"), ("quad4", "1 mm"), ("quad8", "3 mm"), ("quad9", "4 mm"), ("tri3", "1.5 mm"),
        ("tri6", "3 mm"))))  # fmt: skip
    yield cylinder(
        "lame cylinder, incompressible",
        "held",
        0.5,
        tuple(
            f"{e}, formulation = mixed{SMALL}{s}" for e, s in (("quad9", "3 mm"), ("quad8", "2 mm"), ("tri6", "3 mm"))
        ),
    )
    yield ring("lame ring", "held", 0.3, tuple(e + SMALL + s for e, s in (
        ("quad4", "2.5 mm"), ("quad4", "1.25 mm"), ("quad8", "2.5 mm"), ("tri3", "1.25 mm"), ("tri6", "2.5 mm"),
        ("quad9", "2.5 mm"))))  # fmt: skip
    yield torsion("torsion", "tune", tuple(e + SMALL + s for e, s in (
        ("hex8", "2.5 mm"), ("hex8", "1.25 mm"), ("tet4", "2.5 mm"), ("tet10", "2.5 mm"), ("hex20", "5 mm"),
        ("hex20", "2.5 mm"))))  # fmt: skip
    yield bending("bending", "held", tuple(e + SMALL + s for e, s in (
        ("hex8", "2.5 mm"), ("hex8, integration = selective", "2.5 mm"), ("hex8", "1.25 mm"), ("tet4", "1.25 mm"),
        ("tet10", "2.5 mm"))))  # fmt: skip
    yield column("column", "tune", tuple(e + SMALL + s for e, s in (
        ("hex8", "5 mm"), ("tet4", "5 mm"), ("tet10", "5 mm"), ("hex8", "2.5 mm"))))  # fmt: skip
    yield ball("ball", "held", tuple(e + SMALL + s for e, s in (
        ("hex8", "2.5 mm"), ("tet4", "2.5 mm"), ("tet10", "5 mm"), ("hex20", "5 mm"), ("hex8", "5 mm"))))  # fmt: skip
    yield balloon(
        "inflated sphere",
        "held",
        0.3,
        tuple(
            e + FINITE + s
            for e, s in (
                ("quad4", "3 mm"),
                ("quad4", "1.5 mm"),
                ("quad8", "4 mm"),
                ("tri3", "1.5 mm"),
                ("tri6", "3 mm"),
            )
        ),
        3,
    )
    yield balloon(
        "inflated cylinder",
        "tune",
        0.45,
        tuple(
            e + FINITE + s
            for e, s in (
                ("quad4", "3 mm"),
                ("quad4, formulation = mean_dilatation", "1.5 mm"),
                ("quad8", "4 mm"),
                ("tri6", "3 mm"),
            )
        ),
        2,
    )
    yield tones("tones", "held", tuple(e + SMALL + s for e, s in (
        ("hex8", "5 mm"), ("tet4", "5 mm"), ("hex20", "10 mm"), ("tet10", "10 mm"))))  # fmt: skip
    yield cook("cook", "tune", tuple(e + SMALL + s for e, s in (
        ("quad4", "8 mm"), ("quad4", "4 mm"), ("quad8", "8 mm"), ("tri3", "3 mm"), ("tri6", "6 mm"))))  # fmt: skip
    yield struck("struck", "held", tuple(e + SMALL + s for e, s in (("hex8", "2.5 mm"), ("hex20", "5 mm"))))
