"""Centrifugal load: closed forms, density that varies, regions, symmetry, and its independent check."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import softmark
from softmark.interpreter.models.shared import load_setup
from softmark.interpreter.vocabulary.loads.centrifugal import CentrifugalForce
from softmark.solvers.energies.external_loads import AffineMassForces

BAR = """softmark 1
scene "bar"
material gum = {law}
body bar = solid(box(size = (100, 4, 4) mm, origin = (0, -2, -2) mm), gum)
support hub = fixed(bar, where = x <= 0 mm, components = x)
support side = symmetric(bar, where = y <= -2 mm)
support below = symmetric(bar, where = z <= -2 mm)
load spin = centrifugal(bar, axis = +z, through = (0, -2, 0) mm, speed = {speed} rad/s)
model one = fem({model})
probe tip = point(bar, at = (100, 0, 0) mm)
metric u = displacement(tip, along = +x)
metric pull = force(hub, along = -x)
"""


def solved(text: str) -> dict[str, Any]:
    """Metrics of the model of a scene, which must be solved and verified."""
    model = softmark.loads(text).run().models["one"]
    assert model.status == "converged"
    assert model.solve["checks"]["residual"] < 1e-8
    return {name: metric.value for name, metric in model.metrics.items()}


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize("element", ["hex8", "hex20", "tet10"])
def test_a_bar_whose_density_grows_along_it(element: str) -> None:
    """With rho = r (1 + x/L), E u' = w^2 r int_x^L (t + t^2/L) dt, so that E u(L) = w^2 r L^3 (1/3 + 1/4).

    Poisson's ratio is 0, so the bar is in uniaxial stress along x. The hub carries w^2 r A L^2 (1/2 + 1/3). Quadratic
    cells of 10 mm are within 1e-4 of the quartic displacement at the end, which is a node; linear ones within 1e-2.
    """
    law = "linear_elastic(young = 1 MPa, poisson = 0, density = 1000 kg/m^3 * (1 + x / 100 mm))"
    found = solved(BAR.format(law=law, speed=10, model=f"{element}, strain = small, size = 4 mm"))
    w, r, L, E, A = 10.0, 1000.0, 0.1, 1e6, 16e-6
    assert found["u"] == pytest.approx(w**2 * r * L**3 / E * (1 / 3 + 1 / 4), rel=1e-2 if element == "hex8" else 1e-4)
    assert found["pull"] == pytest.approx(w**2 * r * A * L**2 * (1 / 2 + 1 / 3), rel=1e-6)


def test_regions_of_two_densities() -> None:
    """The hub carries w^2 A (r1 (L/2)^2 + r2 (L^2 - (L/2)^2)) / 2, whatever the stiffness."""
    text = BAR.format(law="linear_elastic(young = 1 MPa, poisson = 0.3, density = 1000 kg/m^3)", speed=10,
                      model="hex8, strain = small, size = 4 mm")  # fmt: skip
    text += """material lead = linear_elastic(young = 2 MPa, poisson = 0.3, density = 5000 kg/m^3)
region end = part(bar, where = x >= 50 mm, material = lead)
"""
    w, L, A = 10.0, 0.1, 16e-6
    expected = 0.5 * w**2 * A * (1000 * (L / 2) ** 2 + 5000 * (L**2 - (L / 2) ** 2))
    assert solved(text)["pull"] == pytest.approx(expected, rel=1e-6)


def test_a_bar_that_lengthens_is_pulled_more() -> None:
    """One-dimensional St Venant-Kirchhoff bar, P = E l (l^2 - 1) / 2, P' = -rho w^2 x(X), by shooting from the hub.

    Poisson's ratio is 0; the lateral load widens a section of 2 mm by about rho w^2 b^2 / E = 4e-6, so 1e-4 holds it.
    """
    E, rho, w, L = 1e6, 1000.0, 100.0, 0.1

    def stretch(P: float) -> float:
        return float(brentq(lambda s: 0.5 * E * s * (s * s - 1) - P, 1 / math.sqrt(3), 5.0, xtol=1e-14))

    def end(P0: float) -> Any:
        return solve_ivp(lambda X, y: [stretch(y[1]), -rho * w**2 * y[0]], (0, L), [0.0, P0], rtol=1e-10, atol=1e-9)

    P0 = brentq(lambda P: end(P).y[1, -1], 0.3 * rho * w**2 * L**2, 1.5 * rho * w**2 * L**2)
    law = "st_venant_kirchhoff(young = 1 MPa, poisson = 0, density = 1000 kg/m^3)"
    found = solved(BAR.format(law=law, speed=100, model="hex20, strain = finite, size = 4 mm"))
    assert found["u"] == pytest.approx(end(P0).y[0, -1] - L, rel=1e-4)
    assert found["pull"] == pytest.approx(P0 * 16e-6, rel=1e-4)


@pytest.mark.parametrize("element", ["tri3", "tri6", "quad4", "quad8", "quad9"])
def test_forces_on_rings_are_found_again(element: str) -> None:
    """A rubber ring about its axis: the independent check agrees for every element of bodies of revolution.

    The radial growth is that of the closed form in plane strain (Timoshenko and Goodier 1970, article 32) within 1 %.
    """
    text = f"""softmark 1
scene "ring"
material gum = linear_elastic(young = 1 MPa, poisson = 0.3, density = 1000 kg/m^3)
body ring = axisymmetric(quadrilateral((50, 0, 0) mm, (100, 0, 0) mm, (100, 10, 0) mm, (50, 10, 0) mm), gum)
support low = fixed(ring, where = y <= 0 mm, components = y)
support high = fixed(ring, where = y >= 10 mm, components = y)
load spin = centrifugal(ring, axis = +y, speed = 10 rad/s)
model one = fem({element}, strain = small, size = 2 mm)
probe tip = point(ring, at = (50, 5, 0) mm)
metric u = displacement(tip, along = +x)
"""
    E, nu, q, a, b = 1e6 / (1 - 0.3**2), 0.3 / 0.7, 1000 * 10.0**2 / 8, 0.05, 0.1
    assert solved(text)["u"] == pytest.approx(a / E * 2 * q * ((3 + nu) * b**2 + (1 - nu) * a**2), rel=1e-2)


def test_a_wrong_mass_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    """The independent check does not share the masses of the solver."""
    right = load_setup._cell_mass_matrices
    monkeypatch.setattr(load_setup, "_cell_mass_matrices", lambda *args: 1.01 * right(*args))
    law = "neo_hookean(young = 1 MPa, poisson = 0.3, density = 1000 kg/m^3)"
    report = softmark.loads(BAR.format(law=law, speed=50, model="hex8, strain = finite, size = 4 mm")).run()
    assert report.models["one"].status != "converged"


def test_a_wrong_direction_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    """The check computes -w x (w x r), the solver w^2 (I - n n^T) r: here without the projection onto the plane."""
    monkeypatch.setattr(CentrifugalForce, "gradient", ((2500.0, 0, 0), (0, 2500.0, 0), (0, 0, 2500.0)))
    law = "neo_hookean(young = 1 MPa, poisson = 0.3, density = 1000 kg/m^3)"
    report = softmark.loads(BAR.format(law=law, speed=50, model="hex8, strain = finite, size = 4 mm")).run()
    assert report.models["one"].status != "converged"


def test_a_state_scales_the_force() -> None:
    """Displacements of a linear body are half as large in the state of half the load.

    Load steps and limit loads count fractions of the force in the same way.
    """
    law = "linear_elastic(young = 1 MPa, poisson = 0, density = 1000 kg/m^3)"
    text = BAR.format(law=law, speed=10, model="hex8, strain = small, size = 4 mm")
    text = text.replace("speed = 10 rad/s)", "speed = 10 rad/s, amplitude = per_state)")
    model = softmark.loads(text + "analysis go = static(states = [50, 100] %)\n").run().models["one"]
    half, full = model.metrics["u"].states
    assert half == pytest.approx(0.5 * full, rel=1e-9)


@pytest.mark.parametrize("strain", ["small", "finite"])
def test_an_amplitude_is_the_same_for_solver_and_check(strain: str) -> None:
    """A viscoelastic bar whose force grows with time: at each time the independent forces balance.

    Before, the solver scaled the force by the amplitude and the check by its square: a residual of 0.25 at one half.
    """
    rubber = "neo_hookean_isochoric(young = 1 MPa, poisson = 0.3, density = 1000 kg/m^3)"
    law = f"viscoelastic({rubber}, g = [0.5], tau = [2] s)"
    text = BAR.format(law=law, speed=10, model=f"hex8, strain = {strain}, size = 4 mm")
    text = text.replace("speed = 10 rad/s)", "speed = 10 rad/s, amplitude = ramp(over = 2 s))")
    found = solved(text + "analysis go = quasistatic(duration = 2 s, step = 0.5 s)\n")
    assert found["pull"] > 0.0


def test_derivatives() -> None:
    """Forces and tangent are derivatives of the energy: central differences of a quadratic are exact up to rounding."""
    rng = np.random.default_rng(3)
    points, cells = rng.random((5, 3)), np.array([[0, 1, 2, 3], [1, 2, 3, 4]])
    masses = rng.random((2, 4, 4))
    gradient = rng.random((3, 3))
    load = AffineMassForces(points, cells, masses + masses.swapaxes(1, 2), rng.random(3), gradient + gradient.T)
    x, h = rng.random(15), 1e-4

    def force(x: Any) -> Any:
        g = np.zeros(15)
        load.add_gradient(x, g)
        return g

    slopes = [(load.value(x + h * e) - load.value(x - h * e)) / (2 * h) for e in np.eye(15)]
    assert force(x) == pytest.approx(slopes, rel=1e-8)
    slots = load.stencils[:, :, None] * 15 + load.stencils[:, None, :]
    data = np.zeros(225)
    load.add_hessian(x, data, slots)
    columns = [(force(x + h * e) - force(x - h * e)) / (2 * h) for e in np.eye(15)]
    assert data.reshape(15, 15) == pytest.approx(np.array(columns), rel=1e-8, abs=1e-9)
    assert load.value(np.zeros(15)) == 0.0
