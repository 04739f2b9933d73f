"""Metrics of points, volumes, times and courses, against numbers that were worked out by hand."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from softmark.interpreter.language import units
from softmark.interpreter.metrics import METRICS
from softmark.interpreter.metrics.energy_norm_error import EnergyNormError
from softmark.interpreter.metrics.mean_error import MeanError
from softmark.interpreter.metrics.measurement import MetricInput, ReferenceData
from softmark.interpreter.metrics.metric_base import DisplacementMetric
from softmark.interpreter.metrics.period import Period
from softmark.interpreter.metrics.realtime_factor import RealTimeFactor
from softmark.interpreter.metrics.trajectory_error import TrajectoryError
from softmark.interpreter.metrics.undefined_metric import Undefined
from softmark.interpreter.metrics.volume_change import VolumeChange
from softmark.interpreter.results.motion_history import History
from softmark.interpreter.results.run_report import Timing
from softmark.interpreter.validation.constructor_registry import CATALOGUE
from softmark.solvers.materials.linear_elastic import LinearElastic

CASE: Any = SimpleNamespace(materials=(LinearElastic(7.875, 0.3125, 1.0),), parts=())  # mu = 3, lam = 5
NOTHING = np.zeros((0, 3))

# a cube of corners (0 or 1)^3, number 4 x + 2 y + z, its triangles counter-clockwise from outside
CORNERS = np.array([(x, y, z) for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)])
SIDES = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
CUBE = np.array([t for a, b, c, d in SIDES for t in ((a, b, c), (a, c, d))])


def seen(X: Any = NOTHING, u: Any = NOTHING, **others: Any) -> MetricInput:
    return MetricInput("model", CASE, np.asarray(X, dtype=float), np.asarray(u, dtype=float), **others)


# ------------------------------------------------------------------ all of them


@pytest.mark.parametrize("name", METRICS)
def test_every_metric_says_what_its_number_is(name: str) -> None:
    made = CATALOGUE.constructor("metric", name)
    assert made is not None
    samples = {"name": "x", "direction": (0.0, 0.0, 1.0), "vector": (0.0, 0.0, 0.0)}
    thing = METRICS[name](**{f.attribute: samples[f.form] for f in made.fields if f.required})
    assert units.parse_unit(thing.unit).factor == 1.0  # SI
    assert isinstance(thing.uncertain, bool)
    assert thing.unit == "m" or not thing.uncertain  # the uncertainty of a reference is in m
    of_displacements = isinstance(thing, DisplacementMetric)
    assert of_displacements == (METRICS[name].measure is DisplacementMetric.measure)
    assert of_displacements == ("value" in vars(METRICS[name]))


# ------------------------------------------------------------------ points


def points(statistic: Any) -> Any:
    # errors 0, 3, 6 m along y; the reference moves by 0, 2 and 4 m along x
    known = ReferenceData("theory", u=np.array([[0.0, 0, 0], [2, 0, 0], [4, 0, 0]]))
    u = [[0.0, 0, 0], [2, 3, 0], [4, 6, 0]]
    return MeanError("axis", "theory", statistic).measure(seen(np.zeros((3, 3)), u, known=known))


@pytest.mark.parametrize(
    ("statistic", "value"),
    [
        ("mean", 3.0),  # (0 + 3 + 6) / 3
        ("sd", math.sqrt(6.0)),  # of the population: sqrt((0 + 9 + 36) / 3 - 9); over n - 1 it would be 3
        ("max", 6.0),
        ("rms", math.sqrt(15.0)),  # (0 + 9 + 36) / 3
        ("relative_mean", 1.5),  # 3/2 and 6/4; the first point does not move
        ("relative_sd", 0.0),
    ],
)
def test_mean_error_by_statistic(statistic: str, value: float) -> None:
    assert points(statistic).value == pytest.approx(value, rel=1e-12, abs=1e-12)  # sums of a few small integers


def test_mean_error_keeps_the_others_as_details() -> None:
    found = points("rms")
    assert found.details["mean_m"] == pytest.approx(3.0)
    assert found.details["min_m"] == 0.0
    assert found.details["p95_m"] == pytest.approx(5.7)  # 3 + 0.9 * 3, between the second and the third
    assert found.details["relative_points"] == 2
    assert found.at_points.tolist() == [0.0, 3.0, 6.0]


def test_units_follow_the_statistic() -> None:
    assert (MeanError("a", "b").unit, MeanError("a", "b", "relative_sd").unit) == ("m", "1")
    assert MeanError("a", "b").uncertain
    assert not MeanError("a", "b", "sd").uncertain


def test_a_reference_that_stands_still_has_no_relative_error() -> None:
    still = ReferenceData("theory", u=np.zeros((2, 3)))
    metric = MeanError("axis", "theory", "relative_mean")
    with pytest.raises(Undefined, match="no point moves"):
        metric.measure(seen(np.zeros((2, 3)), np.ones((2, 3)), known=still))
    with pytest.raises(Undefined, match="no displacements"):
        metric.measure(seen(np.zeros((2, 3)), np.ones((2, 3)), known=ReferenceData("scan")))


# ------------------------------------------------------------------ volume


def volume(u: Any, triangles: Any = CUBE) -> Any:
    return VolumeChange("skin").measure(seen(CORNERS, u, triangles=triangles))


def test_volume_of_a_stretched_and_sheared_cube() -> None:
    # F = [[1.2, 0.3, 0], [0, 0.9, 0], [0, 0, 1]]: det F = 1.08, and shear keeps volume
    F = np.array([[1.2, 0.3, 0.0], [0.0, 0.9, 0.0], [0.0, 0.0, 1.0]])
    found = volume(CORNERS @ F.T + 7.0 - CORNERS)
    assert found.value == pytest.approx(0.08, rel=1e-12)
    assert found.details["rest_volume_m3"] == pytest.approx(1.0, rel=1e-14)
    assert found.details["volume_m3"] == pytest.approx(1.08, rel=1e-14)


def test_volume_is_kept_by_a_rotation() -> None:
    c, s = math.cos(0.7), math.sin(0.7)
    R = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    assert volume(CORNERS @ R.T - CORNERS).value == pytest.approx(0.0, abs=1e-14)  # rounding


def test_an_open_surface_encloses_nothing() -> None:
    with pytest.raises(Undefined, match="not closed"):
        volume(np.zeros((8, 3)), CUBE[1:])
    with pytest.raises(Undefined, match="not closed"):  # one triangle faces the wrong way
        volume(np.zeros((8, 3)), np.vstack([CUBE[1:], CUBE[:1, ::-1]]))
    with pytest.raises(Undefined, match="whole surface"):
        volume(np.zeros((8, 3)), None)


# ------------------------------------------------------------------ energy norm


def gauss(n: int = 3) -> tuple[np.ndarray, np.ndarray]:
    """Points and weights that integrate polynomials of degree 2 n - 1 over the unit cube."""
    x, w = np.polynomial.legendre.leggauss(n)
    x, w = 0.5 * (x + 1.0), 0.5 * w
    X = np.array([(a, b, c) for a in x for b in x for c in x])
    return X, np.array([a * b * c for a in w for b in w for c in w])


def energy_norm(u: Any, known: Any) -> Any:
    X, w = gauss()
    metric = EnergyNormError("inside", "exact")
    return metric.measure(
        seen(X, u(X), weights=w, displacement=u, known=ReferenceData("exact", u=known(X), displacement=known))
    )


def affine(F: Any) -> Any:
    return lambda X: X @ (np.array(F) - np.eye(3)).T


def test_energy_norm_of_affine_fields() -> None:
    # F = diag(1.2, 1, 1): E = diag(0.22, 0, 0), E:C:E = (5 + 2 * 3) 0.22^2; the model has F = diag(1.1, 1, 1) with
    # E = 0.105, so eta = (0.22 - 0.105) / 0.22. Differences of affine fields are exact but for rounding: 1e-16 / 1e-4
    found = energy_norm(affine(np.diag([1.1, 1.0, 1.0])), affine(np.diag([1.2, 1.0, 1.0])))
    assert found.value == pytest.approx(0.115 / 0.22, rel=1e-10)
    assert found.details["reference_energy_J"] == pytest.approx(0.5 * 11.0 * 0.22**2, rel=1e-10)
    assert found.details["error_energy_J"] == pytest.approx(0.5 * 11.0 * 0.115**2, rel=1e-10)
    assert found.details["strain_max"] == pytest.approx(0.22, rel=1e-10)
    assert found.details["volume_m3"] == pytest.approx(1.0, rel=1e-12)


def test_energy_norm_of_a_shear_weighs_with_mu() -> None:
    # F = I + 0.4 e_x e_y: E_xy = E_yx = 0.2, E_yy = 0.08, so lam 0.0064 + 2 mu (0.0064 + 2 * 0.04) = 0.5504;
    # the model does not move: all of it is error
    F = np.eye(3)
    F[0, 1] = 0.4
    found = energy_norm(lambda X: np.zeros_like(X), affine(F))
    assert found.value == pytest.approx(1.0, rel=1e-12)
    assert found.details["reference_energy_J"] == pytest.approx(0.5 * 0.5504, rel=1e-10)


def test_energy_norm_of_a_quadratic_field() -> None:
    # u = (a X^2, 0, 0): E_xx = 2 a X + 2 a^2 X^2, (lam + 2 mu) * integral of E_xx^2 over the unit cube
    # = 11 (4 a^2 / 3 + 8 a^3 / 4 + 4 a^4 / 5); the model has u = 0. Central differences are exact for quadratics,
    # three Gauss points for the fourth power.
    a = 0.1
    found = energy_norm(lambda X: 0.0 * X, lambda X: a * X**2 * [1.0, 0.0, 0.0])
    exact = 11.0 * (4 * a**2 / 3 + 2 * a**3 + 4 * a**4 / 5)
    assert found.details["reference_energy_J"] == pytest.approx(0.5 * exact, rel=1e-10)


def test_energy_norm_of_small_strains_is_the_classical_one() -> None:
    # u = e (X Y, 0, 0), model u = 0: eps_xx = e Y, eps_xy = e X / 2: integral of eps:C:eps
    # = e^2 (lam + 2 mu) / 3 + 2 mu * 2 * e^2 / 12 = e^2 (11 / 3 + 1); the quadratic terms of E are of order e = 1e-6
    e = 1e-6
    found = energy_norm(lambda X: 0.0 * X, lambda X: e * X[:, :1] * X[:, 1:2] * [1.0, 0.0, 0.0])
    assert found.details["reference_energy_J"] == pytest.approx(0.5 * e**2 * (11.0 / 3.0 + 1.0), rel=3e-6)


def test_energy_norm_sees_no_rotation() -> None:
    # both carry F = diag(1.2, 1, 1), the model turned by 60 degrees and shifted: its strain is right
    c, s = 0.5, math.sqrt(0.75)
    R = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    F = np.diag([1.2, 1.0, 1.0])
    turned = affine(R @ F)
    assert energy_norm(lambda X: turned(X) + 3.0, affine(F)).value < 1e-9  # rounding: 4 m * 1e-16 / 2e-4 m / 0.22


def test_energy_norm_says_what_is_missing() -> None:
    X, w = gauss()
    metric, field = EnergyNormError("inside", "exact"), affine(np.eye(3))
    known = ReferenceData("exact", u=field(X), displacement=field)
    with pytest.raises(Undefined, match="not strained"):
        metric.measure(seen(X, field(X), weights=w, displacement=field, known=known))
    with pytest.raises(Undefined, match="volume probe"):
        metric.measure(seen(X, field(X), displacement=field, known=known))
    with pytest.raises(Undefined, match="not a displacement field"):
        metric.measure(seen(X, field(X), weights=w, displacement=field, known=ReferenceData("scan")))
    with pytest.raises(Undefined, match="no displacement field"):
        metric.measure(seen(X, field(X), weights=w, known=known))


# ------------------------------------------------------------------ real time


def steps(wall: list[float], step: float, solved: tuple[bool, ...] = ()) -> MetricInput:
    times = step * np.arange(len(wall) + 1)
    still = lambda X: np.zeros((len(times), len(X), 3))  # noqa: E731
    history = History(times, still, tuple(wall), tuple(2.0 * t for t in wall), step, solved)
    return seen(history=history, clock={"solve_s": Timing((9.0,))})


def test_a_step_that_takes_less_than_it_lasts_is_real_time() -> None:
    # 200 steps of 10 ms: two take 9 ms, one takes 20 ms, the rest 4 ms. 99 % of 200 are 198: the 198th is 9 ms long
    wall = [4e-3] * 197 + [20e-3, 9e-3, 9e-3]
    found = RealTimeFactor(25.0).measure(steps(wall, 10e-3))
    assert found.value == pytest.approx(0.9)  # of dt, although a frame at 25 Hz lasts 40 ms
    assert found.details["verdict"] is True
    assert found.details["margin"] == pytest.approx(0.1)
    assert found.details["limit_s"] == 10e-3
    assert (found.details["worst_frame"], found.details["worst_s"]) == (198, 20e-3)
    assert (found.details["missed"], found.details["frames"]) == (1, 200)
    assert (found.details["median_s"], found.details["cpu_median_s"]) == (4e-3, 8e-3)
    assert found.details["p95_s"] == 4e-3
    assert found.samples.max() == pytest.approx(2.0)


def test_more_than_one_late_frame_in_a_hundred_is_not_real_time() -> None:
    found = RealTimeFactor(25.0).measure(steps([1e-3] * 98 + [11e-3] * 2, 10e-3))
    assert found.value == pytest.approx(1.1)
    assert found.details["verdict"] is False


def test_steps_longer_than_a_frame_are_never_real_time() -> None:
    found = RealTimeFactor(25.0).measure(steps([1e-3] * 10, 50e-3))
    assert found.value == pytest.approx(0.02)
    assert found.details["verdict"] is False
    assert "longer than a frame at 25 Hz" in found.details["verdict_reason"]
    # 40 ms is a frame of 25 Hz exactly, and 1 ms one of 1 kHz
    assert RealTimeFactor(25.0).measure(steps([1e-3], 0.04)).details["verdict"] is True
    assert RealTimeFactor(1000.0).measure(steps([1e-4], 1e-3)).details["verdict"] is True


def test_steps_that_were_not_solved_have_no_time() -> None:
    with pytest.raises(Undefined, match="2 of 4 time steps were not solved"):
        RealTimeFactor().measure(steps([1e-3] * 4, 10e-3, (True, False, True, False)))
    assert RealTimeFactor().measure(steps([1e-3] * 2, 10e-3, (True, True))).details["verdict"] is True


def test_a_static_solution_is_a_frame() -> None:
    clock = {"solve_s": Timing((0.02, 0.03, 0.01)), "solve_cpu_s": Timing((0.02, 0.04, 0.02)), "step_s": None}
    found = RealTimeFactor(25.0).measure(seen(clock=clock))
    assert found.value == pytest.approx(0.75)  # 30 ms of 40 ms: of three, the longest
    assert found.details["cpu_median_s"] == 0.02
    assert found.details["basis"].startswith("wall clock of 3 solutions")
    single = RealTimeFactor(50.0).measure(seen(clock={"solve_s": Timing((0.03,))}))
    assert single.details["verdict"] is False
    assert "one solution" in single.details["basis"]
    assert single.details["cpu_median_s"] is None


def test_references_and_what_was_not_solved_have_no_frames() -> None:
    with pytest.raises(Undefined, match="a reference has no computing time per frame"):
        RealTimeFactor().measure(seen())
    with pytest.raises(Undefined, match="no solution was computed"):
        RealTimeFactor().measure(seen(clock={"solve_s": None}))
    with pytest.raises(Undefined, match="no time step"):
        RealTimeFactor().measure(steps([], 1e-3))


# ------------------------------------------------------------------ oscillation


def course(q: Any, step: float) -> MetricInput:
    q = np.asarray(q)
    history = History(step * np.arange(len(q)), lambda X: q[:, None, None] * [0.0, 0.0, 1.0], (), (), step)
    return seen([[0.0, 0, 0], [1, 0, 0]], np.zeros((2, 3)), history=history)


UP = (0.0, 0.0, 1.0)


def test_period_and_damping_of_a_damped_oscillation() -> None:
    # q = 0.3 - exp(-zeta w t) cos(w_d t), w = 2 pi / 0.5 s, zeta = 0.05: T_d = 0.5 / sqrt(1 - zeta^2). Straight lines
    # between 200 samples a period place a crossing within 1e-6 of a period, parabolas an extreme within 1e-7
    zeta, w, step = 0.05, 2 * math.pi / 0.5, 0.0025
    t = step * np.arange(1600)
    q = 0.3 - np.exp(-zeta * w * t) * np.cos(w * math.sqrt(1 - zeta**2) * t)
    found = Period("tip", UP).measure(course(q, step))
    assert found.value == pytest.approx(0.5 / math.sqrt(1 - zeta**2), rel=1e-4)
    assert found.details["damping_ratio"] == pytest.approx(zeta, rel=1e-3)
    assert found.details["rest_m"] == pytest.approx(0.3, abs=1e-4)
    assert found.details["frequency_Hz"] == pytest.approx(1 / found.value)


def test_period_of_backward_euler() -> None:
    # one mode with w dt = 0.1: x_n = r^n cos(n theta), theta = atan(0.1), r = 1 / sqrt(1.01); so the period is longer
    # by 0.1 / theta = 1.003324, and the decrement is 2 pi ln(1 / r) / theta = 2 pi * 0.04992
    theta, r = math.atan(0.1), 1.01**-0.5
    n = np.arange(900)
    found = Period("tip", UP).measure(course(r**n * np.cos(n * theta), 0.1))
    assert found.value == pytest.approx(2 * math.pi * 1.003324, rel=2e-4)  # samples are 1/63 of a period apart
    assert found.details["log_decrement"] == pytest.approx(2 * math.pi * 0.04992, rel=2e-3)


def test_a_motion_is_judged_by_time_and_not_by_how_many_steps_were_halved() -> None:
    """Off by 1 in the first half of the time and right in the second, u_ref = 1: sqrt(1/2), however times fall.

    100 times in the first half and 10 in the second; counted one by one it would be sqrt(100/110) = 0.95.
    """
    t = np.concatenate([np.linspace(0.0, 1.0, 100, endpoint=False), np.linspace(1.0, 2.0, 11)])
    right = np.broadcast_to([1.0, 0.0, 0.0], (len(t), 1, 3))
    wrong = right + np.where(t < 1.0, 1.0, 0.0)[:, None, None] * [0.0, 1.0, 0.0]
    known = ReferenceData("truth", np.zeros((1, 3)), times=t, course=right)
    looked = seen([[0.0, 0, 0]], np.zeros((1, 3)), known=known, times=t, course=wrong)
    assert TrajectoryError("tip", "truth").measure(looked).value == pytest.approx(math.sqrt(0.5), rel=0.03)


@pytest.mark.parametrize("strengths", [(1.0, 1.0), (1.0, 0.8), (0.7, 1.0), (1.0, 0.6)])
@pytest.mark.parametrize("shift", [0.0, 0.4, 1.9])
@pytest.mark.parametrize("zeta", [0.0, 0.01])
def test_two_vibrations_of_like_strength_have_no_period(
    strengths: tuple[float, float], shift: float, zeta: float
) -> None:
    """0.62 and 1.24 s gave 1.120 s, a mean of what crossings came to."""
    t = 0.01 * np.arange(1500)
    slow, fast = (2 * math.pi / T for T in (1.24, 0.62))
    q = strengths[0] * np.exp(-zeta * slow * t) * np.cos(slow * t)
    q = q + strengths[1] * np.exp(-zeta * slow * t) * np.cos(fast * t + shift)
    with pytest.raises(Undefined, match=r"no dominant period|half-waves do not alternate|cross"):
        Period("tip", UP).measure(course(q, 0.01))


@pytest.mark.parametrize("share", [0.02, 0.05, 0.1])
def test_a_weak_second_vibration_is_said_beside_the_period(share: float) -> None:
    """Of 0.2 s beside 1.24 s: its share by a spectrum to 20 %, cycles apart by what it moves crossings by."""
    t = 0.005 * np.arange(4000)
    q = np.cos(2 * math.pi * t / 1.24) + share * np.cos(2 * math.pi * t / 0.2)
    found = Period("tip", UP).measure(course(q, 0.005))
    assert found.value == pytest.approx(1.24, rel=0.01)
    assert found.details["rival_share"] == pytest.approx(share, rel=0.2)
    assert found.details["rival_s"] == pytest.approx(0.2, rel=0.02)
    assert found.details["spread_s"] < 0.1 * 1.24
    assert found.details["cycles"] == pytest.approx(16.0, abs=1.0)


def test_what_does_not_oscillate_has_no_period() -> None:
    with pytest.raises(Undefined, match="needs a dynamic analysis"):
        Period("tip", UP).measure(seen([[0.0, 0, 0]], [[0.0, 0, 0]]))
    with pytest.raises(Undefined, match="four times"):
        Period("tip", UP).measure(course(1.0 - np.exp(-np.linspace(0, 5, 100)), 0.1))
    with pytest.raises(Undefined, match="four times"):
        Period("tip", UP).measure(course(np.zeros(50), 0.1))
