"""Strong ellipticity, decided by a cubic form, against acoustic tensors in thousands of directions."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from softmark.solvers.api.elastic_solid import material
from softmark.solvers.materials import law_for, mixed_for
from softmark.solvers.materials.batched_stability import VolumePressure
from softmark.solvers.materials.corotational import Corotational
from softmark.solvers.materials.ellipticity import find_ellipticity_loss
from softmark.solvers.materials.volumetric_constraints import VolumeRatio

Floats = NDArray[np.float64]
RNG = np.random.default_rng(7)
N = np.vstack([np.eye(3), (n := RNG.normal(size=(1000, 3))) / np.linalg.norm(n, axis=1)[:, None]])


def turned(s: Floats) -> Floats:
    """Deformation gradients of principal stretches s (m, 3), in any direction."""
    R, Q = (np.linalg.qr(RNG.normal(size=(len(s), 3, 3)))[0] for _ in range(2))
    R *= np.sign(np.linalg.det(R))[:, None, None]
    Q *= np.sign(np.linalg.det(Q))[:, None, None]
    found: Floats = np.einsum("mij,mj,mkj->mik", R, s, Q)
    return found


def least(law: Any, F: Floats, kept: bool = False) -> Floats:
    """The least eigenvalue of acoustic tensors (m,), Pa; `kept`: of what a volume that is kept leaves to waves."""
    found = []
    for A, C in zip(law.dPdF(F), np.linalg.inv(F).transpose(0, 2, 1), strict=True):
        Q = np.einsum("iJkL,nJ,nL->nik", A, N, N)
        if kept:  # across cof F n
            m = N @ C.T
            m /= np.linalg.norm(m, axis=1)[:, None]
            P = np.eye(3) - m[:, :, None] * m[:, None, :]
            Q = P @ Q @ P + 1e3 * np.abs(A).max() * m[:, :, None] * m[:, None, :]
        found.append(np.linalg.eigvalsh(Q)[:, 0].min())
    return np.array(found)


@pytest.mark.parametrize("nu", [0.0, 0.3, 0.45])
@pytest.mark.parametrize("name", ["neo_hookean", "st_venant_kirchhoff", "neo_hookean_isochoric", "stable_neo_hookean"])
def test_what_is_lost_is_what_some_direction_loses(name: str, nu: float) -> None:
    made = material(name, young=1.0, poisson=nu, density=1.0)
    law = law_for(made, "finite")
    F = turned(np.exp(RNG.uniform(-0.9, 1.5, (25, 3))))
    seen, found = least(law, F), find_ellipticity_loss(law, F)
    assert found is not None
    assert found[seen < -1e-9].all()  # a direction tells it for sure
    assert not found[seen > 1e-2].any()  # and 1 000 leave little between them
    assert not (made.polyconvex and found.any())


def test_a_solid_that_keeps_its_volume_is_asked_of_waves_that_do() -> None:
    split = mixed_for(material("st_venant_kirchhoff", young=1.0, poisson=0.5, density=1.0), "finite")
    assert split is not None
    F = turned(np.exp(RNG.uniform(-0.8, 0.8, (25, 3))))
    held = VolumePressure(VolumeRatio(), math.inf, np.zeros(len(F)))  # a pressure does no work in such waves
    seen, found = least(split.shape, F, kept=True), find_ellipticity_loss(split.shape, F, held)
    assert found is not None
    assert found.any()
    assert found[seen < -1e-3].all()
    assert not found[seen > 1e-2].any()


@pytest.mark.parametrize("nu", [0.0, 0.3])
def test_kirchhoff_squeezed_between_walls_gives_way_where_its_stress_peaks(nu: float) -> None:
    """P = (lam/2 + mu) l (l^2 - 1) has its extreme at 1/sqrt(3): the wave along the axis stands still there."""
    law, l = law_for(material("st_venant_kirchhoff", young=1.0, poisson=nu, density=1.0), "finite"), 1 / math.sqrt(3)
    F = np.array([np.diag([a, 1.0, 1.0]) for a in (l * (1 - 1e-6), l * (1 + 1e-6))])
    assert find_ellipticity_loss(law, F)[0]  # type: ignore[index]
    wave = law.dPdF(F)[:, 0, 0, 0, 0]
    assert wave[0] < 0.0 < wave[1]


def test_neo_hooke_gives_way_where_a_sheet_has_swollen_too_far() -> None:
    """mu + (mu + lam - lam ln J) (s1 s2 / J)^2 = 0 with the largest stretches s1, s2: in closed form."""
    made = material("neo_hookean", young=1.0, poisson=0.45, density=1.0)
    mu, lam, s = made.shear_modulus, made.lame_lambda, 0.5
    low, high = 2.0, 6.0
    for _ in range(60):
        l = 0.5 * (low + high)
        J = l * l * s
        low, high = (l, high) if mu + (mu + lam - lam * math.log(J)) / s**2 > 0 else (low, l)
    F = np.array([np.diag([l * (1 - e), l * (1 - e), s]) for e in (1e-9, -1e-9)])
    np.testing.assert_array_equal(find_ellipticity_loss(law_for(made, "finite"), F), [False, True])


def test_what_has_no_stress_or_is_not_isotropic_is_not_counted() -> None:
    law = law_for(material("neo_hookean", young=1.0, poisson=0.3, density=1.0), "finite")
    assert not find_ellipticity_loss(law, np.diag([1.0, 1.0, -1.0])[None]).any()  # type: ignore[union-attr]
    assert find_ellipticity_loss(Corotational(1.0, 1.0), np.eye(3)[None]) is None


SHEAR = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
SHEARED = np.eye(3) + np.geomspace(1e-1, 1e2, 100)[:, None, None] * SHEAR
PULLED = np.array([np.diag([t, t**-0.5, t**-0.5]) for t in np.geomspace(1e-2, 1e2, 200)])


@pytest.mark.parametrize(("name", "constants", "field"), [
    ("yeoh", {"c1": 10.0, "c2": -0.5, "c3": 0.0}, "c2"),
    ("yeoh", {"c1": 10.0, "c2": 0.5, "c3": -1e-3}, "c3"),
    ("yeoh", {"c1": 10.0, "c2": -0.5, "c3": 0.0145}, "c2"),  # 3 c2^2 = 5 c1 c3 at 0.015
    ("yeoh", {"c1": 10.0, "c2": -0.5, "c3": 0.05}, None),
    ("veronda_westmann", {"c": 10.0, "a": 0.35}, "a"),
    ("veronda_westmann", {"c": 10.0, "a": 0.5}, None),
    ("ogden", {"mu": (10.0, -0.1), "alpha": (2.0, 4.0)}, "mu"),
    ("ogden", {"mu": (10.0, 0.1), "alpha": (2.0, -4.0)}, "mu"),
    ("ogden", {"mu": (20.0, -8.0, 2.0), "alpha": (1.0, 2.0, 2.0)}, "mu"),
    ("ogden", {"mu": (20.0,), "alpha": (0.9,)}, "alpha"),
    ("ogden", {"mu": (630.0, 1.2, -10.0), "alpha": (1.3, 5.0, -2.0)}, None),
])  # fmt: skip
def test_constants_by_which_a_law_gives_way_have_a_state_in_which_it_does(
    name: str, constants: dict[str, Any], field: str | None
) -> None:
    """In simple shear or in a pull, at a kept volume: there the signs of the constants tell in closed form."""
    made: Any = material(name, poisson=0.45, density=1.0, **constants)
    law = law_for(made, "finite")
    found = [find_ellipticity_loss(law, states) for states in (SHEARED, PULLED)]
    assert any(one is not None and one.any() for one in found) == (field is not None)
    assert (made.polyconvexity_violation and made.polyconvexity_violation[0]) == field
    assert not made.polyconvex


@pytest.mark.parametrize(("name", "constants"), [
    ("mooney_rivlin", {"c1": 10.0, "c2": 0.0}),
    ("yeoh", {"c1": 10.0, "c2": 0.5, "c3": 0.01}),
    ("gent", {"mu": 20.0, "limit": 30.0}),
    ("arruda_boyce", {"m": 20.0, "limit": 3.0}),
    ("fung", {"mu": 20.0, "b": 1.0}),
    ("ogden", {"mu": (10.0, 1.0, -1.0), "alpha": (1.5, 5.0, -3.0)}),
])  # fmt: skip
@pytest.mark.parametrize("nu", [-0.9, 0.3, 0.499])
def test_what_is_called_polyconvex_gives_way_nowhere(name: str, constants: dict[str, Any], nu: float) -> None:
    made: Any = material(name, poisson=nu, density=1.0, **constants)
    assert made.polyconvex
    assert made.polyconvexity_violation is None
    law = law_for(made, "finite")
    assert not find_ellipticity_loss(law, turned(np.exp(RNG.uniform(-1.5, 1.5, (100, 3))))).any()  # type: ignore[union-attr]
    assert not material(name, poisson=nu, density=1.0, volumetric="logarithmic", **constants).polyconvex
