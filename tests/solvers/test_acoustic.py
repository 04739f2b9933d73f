"""Strong ellipticity of laws with directions: what is found against acoustic tensors in a thousand directions."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from anisotropic_laws import LAWS
from deformations import rotations
from numpy.typing import NDArray

from softmark.solvers.materials import DIRECTED, law_for, mixed_for
from softmark.solvers.materials.acoustic_tensor import DIRECTIONS
from softmark.solvers.materials.batched_stability import VolumePressure
from softmark.solvers.materials.ellipticity import find_ellipticity_loss
from softmark.solvers.materials.material_axes import MaterialFrame
from softmark.solvers.materials.tensor_components import components

Floats = NDArray[np.float64]
RNG = np.random.default_rng(7)
N = np.vstack([np.eye(3), (n := RNG.normal(size=(1000, 3))) / np.linalg.norm(n, axis=1)[:, None]])


def turned(s: Floats) -> Floats:
    """Deformation gradients of principal stretches s (m, 3), in any direction."""
    R, Q = rotations(RNG, len(s)), rotations(RNG, len(s))
    return np.asarray(np.einsum("mij,mj,mkj->mik", R, s, Q))


def least(law: Any, F: Floats) -> Floats:
    """The least eigenvalue of acoustic tensors (m,), Pa."""
    Q = (np.einsum("iJkL,nJ,nL->nik", A, N, N) for A in law.dPdF(F))
    return np.array([np.linalg.eigvalsh(q)[:, 0].min() for q in Q])


STATES = turned(np.exp(RNG.uniform(-0.5, 0.35, (60, 3))))
SHORT = np.diag([0.6, 1.2, 1.25])[None]  # along fibres


@pytest.mark.parametrize("name", LAWS)
def test_what_is_found_is_what_some_direction_loses(name: str) -> None:
    """Nothing is found where a thousand directions leave 1 % of the stiffness; what one of them tells is found."""
    law = LAWS[name]
    seen, found = least(law, STATES) / law.shear_modulus, find_ellipticity_loss(law, STATES)
    assert found is not None
    assert not found[seen > 1e-2].any()
    assert found[seen < -1e-6].all()
    assert not (getattr(law, "polyconvex", False) and (found.any() or (seen < 0.0).any()))


@pytest.mark.parametrize("name", ["guccione", "fung", "linear fibres", "muscle"])
def test_some_of_the_states_are_lost_and_some_not(name: str) -> None:
    found = find_ellipticity_loss(LAWS[name], STATES)
    assert found is not None
    assert 0 < found.sum() < len(found)


@pytest.mark.parametrize("name", ["guccione", "fung"])
def test_what_a_bound_says_is_elliptic_is(name: str) -> None:
    """The bound spares the stiffness of most states that are strained a little, and of none that is lost."""
    law = LAWS[name]
    sure = law.elliptic(components(STATES))
    assert not (sure & (least(law, STATES) <= 0.0)).any()
    assert law.elliptic(components(turned(np.exp(RNG.uniform(-0.02, 0.02, (60, 3)))))).all()


def test_fibres_that_resist_compression_give_way_in_it_and_slack_ones_do_not() -> None:
    """k1/2 (I4 - 1)^2: along f, 2 k1 (3 l^2 - 1) + mu (1 + 1/l^2) < 0 is at l = 0.5 for 40 k1 = mu, not for 0.1."""
    made = DIRECTED["transversely_isotropic"]
    F = np.diag([0.5, 1.0, 1.0])[None]
    stiff, weak = (made(1.0, k1, 0.0, 1.0, (1.0, 0.0, 0.0), "both", 1.0) for k1 in (40.0, 0.1))
    assert np.asarray(find_ellipticity_loss(stiff, F)).all()
    assert not np.asarray(find_ellipticity_loss(weak, F)).any()
    assert not np.asarray(find_ellipticity_loss(replace(stiff, resists="tension"), F)).any()


def test_directions_of_each_point_and_a_pressure_go_with_it() -> None:
    """Turned fibres in a turned state are lost where they were; with a pressure that of the pressed law without."""
    law: Any = DIRECTED["guccione"](1.0, 30.0, 2.0, 4.0, 1.0, (1.0, 0.0, 0.0), None)
    R = turned(np.ones((8, 3)))
    F = np.concatenate([np.einsum("mij,jk,mlk->mil", R, SHORT[0], R), np.tile(np.eye(3), (8, 1, 1))])
    f = np.concatenate([R[:, :, 0], R[:, :, 0]])
    split = mixed_for(replace(law, fibres=MaterialFrame.at(f, None, (16, 1))), "finite")
    assert split is not None
    held = VolumePressure(split.constraint, np.inf, np.zeros(16))
    assert np.asarray(find_ellipticity_loss(split.shape, F, held)).tolist() == [True] * 8 + [False] * 8
    assert find_ellipticity_loss(law_for(replace(law, bulk=1.0), "finite"), SHORT) is not None


@pytest.mark.parametrize("name", ["guccione", "fung", "muscle"])
def test_waves_written_by_the_law_are_those_of_its_stiffness(name: str) -> None:
    """Turned back into space they are A n n, to rounding; with a pressure's modulus as well."""
    law = LAWS[name]
    passive, tension = getattr(law, "passive", law), getattr(law, "tension", 0.0)
    F, A = STATES, law.dPdF(STATES) + 5.0 * np.einsum("miJ,mkL->miJkL", C := cof(STATES), C)
    axes = law.frame.axes(F.dtype)[:, :, 0]
    Q = passive.waves(components(F), DIRECTIONS, 5.0, tension)
    e = np.log(2.0 * passive._shape_psi(components(F), law.frame.axes(F.dtype)) / passive.stiffness + 1.0)
    B = np.einsum("miJ,aJ->mia", F, axes)
    back = np.einsum("mia,dabm,mkb,m->mdik", B, Q, B, passive.stiffness * np.exp(e))
    n = DIRECTIONS @ axes
    known = np.einsum("miJkL,dJ,dL->mdik", A, n, n)
    np.testing.assert_allclose(back, known, rtol=0.0, atol=1e-11 * np.abs(known).max())


def cof(F: Floats) -> Floats:
    """J F^-T (m, 3, 3)."""
    return np.asarray(np.linalg.det(F)[:, None, None] * np.linalg.inv(F).transpose(0, 2, 1))
