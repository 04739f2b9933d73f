"""Stress that relaxes: one cell, against closed forms of linear viscoelasticity worked out here.

Numbers of two terms (g = 0.3, 0.2; tau = 1 s, 10 s) stand to six digits in every table of the standard linear solid's
kin; the formulas beside them are the Laplace transforms of which they are.
"""

from __future__ import annotations

import numpy as np
import pytest

from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.dynamics import INTEGRATORS
from softmark.solvers.dynamics.dynamic_problem import Dynamics
from softmark.solvers.dynamics.time_integration import march
from softmark.solvers.dynamics.viscoelastic_step import ViscoelasticStep
from softmark.solvers.energies.elastic_energy import Elastic
from softmark.solvers.energies.external_loads import DeadForces
from softmark.solvers.energies.viscoelastic_memory import BodyHistory, ViscoelasticHistory, decay_factors
from softmark.solvers.independent_forces.hereditary_integral import DisplacementHistory, remaining_fractions
from softmark.solvers.materials.corotational import Corotational
from softmark.solvers.materials.maxwell_branch_energy import first_invariant_branch
from softmark.solvers.materials.neo_hookean import NeoHookean
from softmark.solvers.materials.neo_hookean_isochoric import NeoHookeanIsochoric
from softmark.solvers.materials.small_strain import SmallStrain
from softmark.solvers.materials.strain_measures import (
    BiotStrain,
    GreenStrain,
    IsochoricStrain,
    SmallStrainMeasure,
    StrainMeasure,
)
from softmark.solvers.materials.viscoelastic_increment import PronySeries, ViscoelasticStepLaw
from softmark.solvers.mesh.element_interpolation import integrate_cells
from softmark.solvers.mesh.mesh import Mesh

G, TAU = np.array([0.3, 0.2]), np.array([1.0, 10.0])
LEFT = 1.0 - G.sum()
SMALL = SmallStrainMeasure()
BAR = SmallStrain(0.5, 0.0)  # E = 1 without lateral contraction


def cell(law=BAR):
    """The energy of a cube of one cell, and the displacements (24,) that stretch it by one along x."""
    points = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]], float)
    mesh = Mesh(points, np.arange(8)[None], "hex8")
    parts = integrate_cells(mesh)
    x = np.zeros((8, 3))
    x[:, 0] = points[:, 0]
    return Elastic(mesh.cells, parts.dNdX, parts.w, law), x.ravel(), mesh


def series(law=BAR, mu=0.5, measure=SMALL, g=G, tau=TAU, bulk=1.0 / 3.0, springs=None):
    return PronySeries(law, g, tau, mu, bulk, measure, springs)


def pull(memory: ViscoelasticHistory) -> float:
    """The stress along x at the end of the last step, which is the force on the unit face: of the first point."""
    return float((1.0 - memory.series.g.sum()) * memory.S[0, 0, 0] + memory.H[:, 0, 0, 0].sum())


def followed(course, times, law=BAR, **more):
    """Memory and force at each time of a cell stretched by a course of time."""
    energy, along, _ = cell(law)
    memory, last, forces = ViscoelasticHistory.at_rest(energy, series(law, **more)), 0.0, []
    for t in times:
        memory, last = memory.history_after_step(course(t) * along, t - last), t
        forces.append(pull(memory) * (1.0 if memory.series.measure is SMALL else 1.0 + course(t)))
    return memory, np.array(forces)


def modulus(t):
    return LEFT + sum(g * np.exp(-t / tau) for g, tau in zip(G, TAU, strict=True))


# ------------------------------------------------------------------ small strain


def test_relaxation_is_the_series_itself_whatever_the_steps() -> None:
    times = np.array([0.0, 0.1, 1.0, 5.0, 10.0, 50.0])
    _, forces = followed(lambda t: 0.01, times)
    np.testing.assert_allclose(forces / 0.01, [1.0, 0.969461, 0.791331, 0.623328, 0.573590, 0.501348], atol=1e-6)
    np.testing.assert_allclose(forces / 0.01, modulus(times), rtol=1e-14)


@pytest.mark.parametrize("steps", [1, 7, 40])
def test_a_ramp_is_exact_for_stress_in_proportion_to_time(steps: int) -> None:
    times = np.concatenate([np.linspace(0.0, 1.0, steps + 1)[1:], [2.0, 5.0, 20.0]])
    _, forces = followed(lambda t: 0.1 * min(t, 1.0), times)
    np.testing.assert_allclose(forces[-4:], [0.087996, 0.074198, 0.063105, 0.052847], atol=1e-6)


@pytest.mark.parametrize("rate", 10.0 ** np.arange(-6.0, 7.0, 2.0))
def test_no_rate_is_wrong(rate: float) -> None:
    """From a millionth of a time of relaxation to a million: five steps of a ramp of T, g tau/T (1 - e^(-T/tau))."""
    T = 1.0 / rate
    _, forces = followed(lambda t: 0.01 * t / T, np.linspace(0.0, T, 6)[1:])
    exact = LEFT + sum(g * tau / T * -np.expm1(-T / tau) for g, tau in zip(G, TAU, strict=True))
    assert forces[-1] / 0.01 == pytest.approx(exact, rel=1e-12)


LOSSES = [
    (0.01, 0.502010, 0.045421),
    (0.1, 0.602970, 0.215107),
    (1.0, 0.848020, 0.200234),
    (10.0, 0.997010, 0.031798),
]


@pytest.mark.parametrize(("w", "storage", "tangent"), LOSSES[1:3])
def test_the_loss_tangent_is_that_of_the_series_to_second_order(w: float, storage: float, tangent: float) -> None:
    """The part of the force in phase with the strain, and the part before it, over a cycle after all else has gone."""

    def off(steps: int) -> tuple[float, float]:
        period = 2.0 * np.pi / w
        cycles = int(np.ceil(100.0 / period)) + 1
        times = np.linspace(0.0, cycles * period, cycles * steps + 1)[1:]
        _, forces = followed(lambda t: 0.01 * np.sin(w * t), times)
        last, t = forces[-steps:] / 0.01, times[-steps:]
        inside, before = 2.0 * np.mean(last * np.sin(w * t)), 2.0 * np.mean(last * np.cos(w * t))
        return inside - storage, before / inside - tangent

    (_, first), (_, second) = off(24), off(96)
    assert abs(second) < 0.07 * abs(first) + 1e-6  # a sixteenth, and the last digit of the table
    assert abs(second) < 5e-4


def test_the_loss_tangent_to_five_digits() -> None:
    """Of the steps themselves, whose sums are geometric: ginf + sum g f (e - 1) / (e - exp(-h/tau)), e = exp(i w h)."""
    for w, storage, tangent in LOSSES:
        h = 2.0 * np.pi / w / 1000.0
        decay, mean, _ = decay_factors(h, series().tau)
        e = np.exp(1j * w * h)
        modulus_of = LEFT + (G * mean * (e - 1.0) / (e - decay)).sum()
        assert modulus_of.real == pytest.approx(storage, abs=1e-5)
        assert modulus_of.imag / modulus_of.real == pytest.approx(tangent, abs=1e-5)


def test_what_is_dissipated_is_the_work_less_what_is_stored_and_never_falls() -> None:
    rng = np.random.default_rng(3)
    energy, along, _ = cell()
    memory, x, work, before = ViscoelasticHistory.at_rest(energy, series()), 0.0 * along, 0.0, 0.0
    for _ in range(30):
        h, way = rng.exponential(1.0), rng.normal(0.0, 0.01)
        fine = 32
        for _ in range(fine):
            force = pull(memory)
            x = x + way / fine * along
            memory = memory.history_after_step(x, h / fine)
            work += 0.5 * (force + pull(memory)) * way / fine
            assert memory.dissipated >= before
            before = memory.dissipated
    stored = energy.value(x) + memory.stored
    assert work == pytest.approx(stored + memory.dissipated, rel=1e-3)  # the rule of the work, by steps of h / 32


@pytest.mark.parametrize("z", [1e-12, 1e-9, 1e-6, 1e-4, 2e-3])
def test_what_a_short_step_dissipates_is_no_difference_of_nearly_equal_numbers(z: float) -> None:
    """A ramp to e in z tau: E g e^2 z / 3 (1 - 3 z / 4 + 7 z^2 / 20), the integral of (s - s^2/2 + s^3/6)^2."""
    energy, along, _ = cell()
    memory = ViscoelasticHistory.at_rest(energy, series(g=np.array([0.5]), tau=np.array([1.0]))).history_after_step(
        0.01 * along, z
    )
    exact = 0.5 * 0.01**2 * z / 3.0 * (1.0 - 0.75 * z + 0.35 * z * z)
    assert memory.dissipated == pytest.approx(exact, rel=2e-9)


def test_maxwells_fluid_forgets_all_and_a_short_time_is_kelvin_and_voigts_dashpot() -> None:
    _, forces = followed(lambda t: 0.01, [0.0, 1.0, 3.0], g=np.array([1.0]), tau=np.array([1.0]))
    np.testing.assert_allclose(forces / 0.01, [1.0, 0.367879, 0.049787], atol=1e-6)
    _, forces = followed(lambda t: 0.01 * t, np.linspace(0.1, 1.0, 10), g=np.array([0.999]), tau=np.array([1e-3]))
    np.testing.assert_allclose(forces / 0.01, 1e-3 * np.linspace(0.1, 1.0, 10) + 0.999e-3, rtol=1e-6)


# ------------------------------------------------------------------ finite strain


def test_fungs_exponential_law_by_a_law_of_one_number() -> None:
    """Quasi-linear: S0 = A (exp(B E) - 1) along x and nothing else, from a ramp of Green's strain; REFERENCES 3.8."""

    class Fung:
        def P(self, F):
            E = 0.5 * (F[:, 0, 0] ** 2 - 1.0)
            P = np.zeros_like(F)
            P[:, 0, 0] = F[:, 0, 0] * np.expm1(10.0 * E)
            return P

        def psi(self, F):
            E = 0.5 * (F[:, 0, 0] ** 2 - 1.0)
            return np.expm1(10.0 * E) / 10.0 - E

        def dPdF(self, F):
            return np.zeros((len(F), 3, 3, 3, 3))

    known = np.array([0.607506, 1.541418, 1.287181, 1.086614, 0.908456])

    def found(steps: int):
        times = np.concatenate([np.linspace(0.0, 1.0, steps + 1)[1:], [2.0, 5.0, 20.0]])
        _, forces = followed(lambda t: np.sqrt(1.0 + 0.2 * min(t, 1.0)) - 1.0, times, Fung(), measure=GreenStrain())
        stretch = np.sqrt(1.0 + 0.2 * np.minimum(times, 1.0))
        return (forces / stretch)[[steps // 2 - 1, *range(steps - 1, steps + 3)]] - known

    first, second = (np.abs(found(n)).max() for n in (10, 20))
    assert second < 0.3 * first  # of second order, where stress is no straight line in time
    assert np.abs(found(200)).max() < 1e-5


@pytest.mark.parametrize(
    "measure", [SMALL, GreenStrain(), IsochoricStrain(), BiotStrain()], ids=lambda m: type(m).__name__
)
def test_the_law_of_a_step_has_the_derivatives_that_it_says(measure: StrainMeasure) -> None:
    rng = np.random.default_rng(1)
    law = BAR if measure is SMALL else NeoHookean(1.0, 0.3, 1.0)
    part = BAR if measure is SMALL else NeoHookeanIsochoric(1.0, 0.3, 1.0).isochoric()
    held = rng.normal(0.0, 0.3, (2, 3, 3, 3))
    step = ViscoelasticStepLaw(law, part, 0.3, held + held.swapaxes(2, 3), measure)
    F = np.eye(3) + rng.normal(0.0, 0.1, (6, 3, 3))
    d, eps = rng.normal(0.0, 1.0, (6, 3, 3)), 1e-6
    slope = (step.psi(F + eps * d) - step.psi(F - eps * d)) / (2.0 * eps)
    np.testing.assert_allclose(np.einsum("nij,nij->n", step.P(F), d), slope, rtol=1e-7, atol=1e-9)
    rise = (step.P(F + eps * d) - step.P(F - eps * d)) / (2.0 * eps)
    np.testing.assert_allclose(np.einsum("nijkl,nkl->nij", step.dPdF(F), d), rise, rtol=1e-6, atol=1e-8)
    assert np.linalg.eigvalsh(step.dPdF_projected(F).reshape(-1, 9, 9)).min() > -1e-12


def test_a_turn_of_the_body_turns_its_stress_and_leaves_its_memory() -> None:
    """Objectivity: the same history, followed by a rotation at once."""
    law = NeoHookean(1.0, 0.3, 1.0)
    energy, along, mesh = cell(law)
    memory = ViscoelasticHistory.at_rest(energy, series(law, measure=GreenStrain())).history_after_step(
        0.5 * along, 0.7
    )
    a = 0.9
    R = np.array([[np.cos(a), -np.sin(a), 0.0], [np.sin(a), np.cos(a), 0.0], [0.0, 0.0, 1.0]])
    x = mesh.points + (0.5 * along).reshape(-1, 3)
    turned = memory.history_after_step((x @ R.T - mesh.points).ravel(), 0.0)
    before, after = np.zeros(24), np.zeros(24)
    memory.over(0.0).add_gradient(0.5 * along, before)
    turned.over(0.0).add_gradient((x @ R.T - mesh.points).ravel(), after)
    np.testing.assert_allclose(after.reshape(-1, 3), before.reshape(-1, 3) @ R.T, atol=1e-14)
    np.testing.assert_allclose(turned.H, memory.H, atol=1e-14)


def test_what_is_strained_at_once_stores_its_energy_and_loses_it_while_it_is_held() -> None:
    law = NeoHookeanIsochoric(1.0, 0.3, 1.0)
    energy, along, _ = cell(law)
    shape = law.isochoric()
    known = series(
        shape, mu=law.shear_modulus, measure=IsochoricStrain(), bulk=np.inf, springs=first_invariant_branch(law)
    )
    memory = ViscoelasticHistory.at_rest(energy, known)
    memory = memory.history_after_step(along, 0.0)  # twice as long
    assert memory.stored == pytest.approx(0.0, abs=1e-14)
    assert memory.dissipated == pytest.approx(0.0, abs=1e-14)
    for h in (0.1, 1.0, 10.0, 1000.0):
        before, memory = memory, memory.history_after_step(along, h)
        assert memory.dissipated > before.dissipated
    assert memory.dissipated == pytest.approx(G.sum() * float(memory.W @ energy.w.ravel()), rel=1e-9)


def test_the_integral_over_the_past_weighs_short_steps_as_exactly_as_long_ones() -> None:
    """g (1 - exp(-z)) / z = g (1 - z/2 + z^2/6) of the last step, whose z was a difference of exponentials."""
    for z in (1e-12, 2e-8, 1e-6):
        found = remaining_fractions([1.0, 1.0 + z], np.array([0.5]), np.array([1.0]))
        z = (1.0 + z) - 1.0
        assert found[-1] == pytest.approx(0.5 * (1.0 - z / 2.0 + z * z / 6.0), rel=1e-14)


@pytest.mark.parametrize(
    ("measure", "word"), [(GreenStrain(), "green"), (IsochoricStrain(), "shape"), (BiotStrain(), "turned")]
)
def test_the_integral_over_the_past_finds_the_same_stress_without_a_recursion(
    measure: StrainMeasure, word: str
) -> None:
    law = Corotational(0.4, 0.6) if word == "turned" else NeoHookean(1.0, 0.3, 1.0)
    energy, along, mesh = cell(law)
    rng = np.random.default_rng(5)
    memory, states, times, t = ViscoelasticHistory.at_rest(energy, series(law, measure=measure)), [], [], 0.0
    for h in (0.0, 0.3, 1e-9, 2.0, 50.0, 0.0, 0.01):
        t += h
        x = 0.2 * along + rng.normal(0.0, 0.05, 24)
        memory = memory.history_after_step(x, h)
        states.append(x.reshape(-1, 3))
        times.append(t)
    held = DisplacementHistory(times, states, law.P, G, TAU, word).remaining_stress(mesh.points, mesh.cells, "hex8")
    own = memory.H.sum(axis=0)
    order = np.argsort(np.linalg.norm(own, axis=(1, 2))), np.argsort(np.linalg.norm(held, axis=(1, 2)))
    np.testing.assert_allclose(own[order[0]], held[order[1]], rtol=1e-10, atol=1e-12)
    F, H = np.eye(3) + rng.normal(0.0, 0.2, (5, 3, 3)), rng.normal(0.0, 1.0, (5, 3, 3))
    H = H + H.swapaxes(1, 2)
    pulled = DisplacementHistory(times, states, law.P, G, TAU, word).first_piola_stress(F, H)
    np.testing.assert_allclose(measure.first_piola_stress(F, H), pulled, atol=1e-11)


# ------------------------------------------------------------------ in motion


def swing(integrator: str, h: float) -> tuple[float, dict]:
    """Where a mass on Zener's spring is after a second, pulled at once: one cell, a third of its mass on each end."""
    energy, _, mesh = cell(SmallStrain(0.5e5, 0.0))
    zener = series(energy.law, mu=0.5e5, g=np.array([0.5]), tau=np.array([0.02]), bulk=1e5 / 3.0)
    far = mesh.points[:, 0] > 0.5
    fixed = np.array([3 * n + c for n in range(8) for c in range(3) if c or not far[n]])
    force = np.zeros((8, 3))
    force[far, 0] = 250.0
    mass = np.full(24, 1000.0 / 12.0)  # 1000/3 on the four nodes that move
    problem = Dynamics(
        Assembly(24, fixed, [energy], [DeadForces(force.ravel())]),
        mass,
        np.zeros(24),
        np.zeros(24),
        fixed,
        np.zeros(len(fixed)),
        integrator=INTEGRATORS[integrator](),
        tolerance=1e-10,
        remembering=ViscoelasticStep(
            BodyHistory((ViscoelasticHistory.at_rest(energy, zener),)), integrator == "midpoint"
        ),
        lagged=False,
    )
    track = march(problem, 0.25, h)
    return float(track.observed[-1].x[3 * np.flatnonzero(far)[0]]), track.energies


def zener_mass(t: float) -> float:
    """By the roots of m s^2 + k (1 - g) + k g s / (s + 1/tau) = 0: residues of the response to a force at once."""
    m, k, g, tau, force = 1000.0 / 3.0, 1e5, 0.5, 0.02, 1000.0
    top, below = np.poly1d([1.0, 1.0 / tau]), np.poly1d([m, m / tau, k, k * (1.0 - g) / tau])
    return float((force * (top(0) / below(0) + sum(
        top(r) / (r * below.deriv()(r)) * np.exp(r * t) for r in below.roots))).real)  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_a_mass_on_zeners_spring_in_every_integrator(integrator: str) -> None:
    exact = zener_mass(0.25)
    steps = (2e-3, 1e-3)
    (first, _), (second, energies) = (swing(integrator, h) for h in steps)
    order = 1.0 if integrator == "implicit_euler" else 2.0
    assert abs(second - exact) < (0.06 if order == 1.0 else 1e-3) * exact
    assert np.log2(abs(first - exact) / abs(second - exact)) == pytest.approx(order, abs=0.25)
    assert np.all(np.diff(energies["damping"]) >= 0.0)
    left = energies["kinetic"] + energies["strain"] + energies["damping"] - energies["load_work"]
    if order == 2.0:
        assert np.abs(left).max() < 2e-3 * energies["load_work"].max()


def test_what_is_moved_at_once_in_a_motion_has_been_stretched_in_no_time() -> None:
    """The first step relaxes what the start has brought, and is no ramp to it."""
    energy, along, _ = cell()
    memory = ViscoelasticStep(BodyHistory((ViscoelasticHistory.at_rest(energy, series()),)))
    acting = type("StepForces", (), {"internal": (), "now": None})()
    memory.reset(acting, 0.01 * along)
    memory.begin(acting, 5.0)
    memory.compute_provisional_history(acting, 0.01 * along, 5.0)
    memory.accept_history()
    force = np.zeros(24)
    acting.internal[0].add_gradient(0.01 * along, force)
    assert np.abs(force).sum() / 2.0 == pytest.approx(0.01 * modulus(5.0), rel=1e-12)
    assert memory.losses[-1] > 0.0
