"""Rotations and principal axes, against matrices built from known ones and against LAPACK."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from softmark.solvers.materials.polar_decomposition import rotation, spectrum, stretch
from softmark.solvers.materials.tensor_components import components

Array = NDArray[np.float64]
M = 500


def rotations(seed: int, m: int = M) -> Array:
    """Uniform rotations (m, 3, 3)."""
    Q = np.linalg.qr(np.random.default_rng(seed).standard_normal((m, 3, 3)))[0]
    return np.asarray(Q * np.sign(np.linalg.det(Q))[:, None, None])


def nearest_rotation(F: Array) -> Array:
    """R (m, 3, 3) of F (m, 3, 3) by the function under test, which leaves divisions by zero to its caller."""
    with np.errstate(all="ignore"):
        return rotation(components(F)).transpose(2, 0, 1)


def signed_svd(F: Array) -> tuple[Array, Array]:
    """The judge: R = U V^T with the last axis turned where it would be a reflection, and signed stretches."""
    U, s, Vt = np.linalg.svd(F)
    sign = np.sign(np.linalg.det(U @ Vt))
    U[:, :, 2] *= sign[:, None]
    s[:, 2] *= sign
    return U @ Vt, s


def assert_rotations(R: Array) -> None:
    """R^T R = I and det R = +1, to a few units of round-off."""
    np.testing.assert_allclose(R.transpose(0, 2, 1) @ R, np.broadcast_to(np.eye(3), R.shape), atol=1e-14)
    np.testing.assert_allclose(np.linalg.det(R), 1.0, rtol=1e-14)


REGULAR = {
    "rest": (1.0, 1.0, 1.0),
    "tiny strain": (1.0 + 1e-9, 1.0, 1.0 - 1e-9),
    "strained": (1.3, 1.0, 0.8),
    "repeated": (1.5, 0.7, 0.7),
    "strongly stretched": (4.0, 1.0, 0.3),
    "flat": (1.2, 0.9, 0.0),
    "nearly flat": (1.2, 0.9, -1e-12),
    "inside out": (1.2, 0.9, -0.4),
    "small": (1.1e-8, 1e-8, 0.5e-8),
    "large": (1.1e12, 1e12, 0.5e12),
}


@pytest.mark.parametrize("s", REGULAR.values(), ids=REGULAR.keys())
def test_rotation_of_a_well_conditioned_gradient(s: tuple[float, float, float]) -> None:
    """F = U diag(s) V^T has R = U V^T exactly; measured error 1.4e-15, where LAPACK's is up to 1.6e-14."""
    U, V = rotations(1), rotations(2)
    R = nearest_rotation((U * np.array(s)) @ V.transpose(0, 2, 1))
    assert_rotations(R)
    np.testing.assert_allclose(R, U @ V.transpose(0, 2, 1), rtol=0.0, atol=1e-14)


@pytest.mark.parametrize("gap", [1e-1, 1e-2, 1e-4, 1e-6, 1e-9])
@pytest.mark.parametrize("kind", ["inside out", "needle"])
def test_rotation_close_to_the_singular_set(kind: str, gap: float) -> None:
    """Round-off of F, 1e-16, turns R by 1e-16 s1/(s2 + s3); measured 1e-14/gap at most, LAPACK's the same."""
    s = (1.2, 0.9, -0.9 + gap) if kind == "inside out" else (1.0, 0.5 * gap, 0.5 * gap)
    U, V = rotations(3), rotations(4)
    R = nearest_rotation((U * np.array(s)) @ V.transpose(0, 2, 1))
    assert_rotations(R)
    np.testing.assert_allclose(R, U @ V.transpose(0, 2, 1), rtol=0.0, atol=2e-14 / gap)


def test_rotation_of_random_matrices() -> None:
    """Half of them inside out: the signed singular value decomposition, within its error over s2 + s3."""
    F = np.random.default_rng(5).standard_normal((4000, 3, 3))
    R = nearest_rotation(F)
    expected, s = signed_svd(F)
    assert_rotations(R)
    assert (np.linalg.det(F) < 0.0).mean() == pytest.approx(0.5, abs=0.05)
    error = np.abs(R - expected).max((1, 2))
    assert (error <= 2e-14 * s[:, 0] / (s[:, 1] + s[:, 2])).all()


@pytest.mark.parametrize(
    "s", [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 1.0, -1.0), (-1.0, -1.0, -1.0), (1.0, 0.5, -0.5)]
)
def test_where_the_rotation_is_not_unique_one_of_the_best_is_chosen(s: tuple[float, float, float]) -> None:
    """tr(R^T F) attains its maximum s1 + s2 - |s3| (for det F <= 0), whichever rotation it is."""
    F = (rotations(6) * np.array(s)) @ rotations(7)
    R = nearest_rotation(F)
    assert_rotations(R)
    a = np.sort(np.abs(s))[::-1]
    np.testing.assert_allclose((R * F).sum((1, 2)), a[0] + a[1] - a[2], rtol=0.0, atol=1e-14)


def test_rotation_is_continuous_through_inversion() -> None:
    """The last stretch goes from 0.3 to -0.3 and R does not move: a reflection would jump by 2."""
    s3 = np.linspace(0.3, -0.3, 61)
    U, V = rotations(8, 1), rotations(9, 1)
    s = np.stack((np.full(61, 1.3), np.full(61, 0.8), s3), axis=1)
    R = nearest_rotation((U * s[:, None, :]) @ V)
    np.testing.assert_allclose(R, np.broadcast_to(U @ V, R.shape), rtol=0.0, atol=1e-14)


@pytest.mark.parametrize("value", [np.nan, np.inf, 1e200])
def test_a_gradient_that_is_not_finite_has_no_rotation(value: float) -> None:
    """NaN for that row (1e200: its square overflows), without disturbing the others or raising."""
    F = np.broadcast_to(np.eye(3), (3, 3, 3)).copy()
    F[1, 0, 0] = value
    R = nearest_rotation(F)
    assert np.isnan(R[1]).all()
    np.testing.assert_allclose(R[[0, 2]], F[[0, 2]], rtol=0.0, atol=1e-15)


@pytest.mark.parametrize(
    "w",
    [
        (1.0, 1.0, 1.0),
        (1.0, 1.0 + 1e-9, 1.0),
        (3.0, 1e-8, -2.0),
        (1.0, 2.0, 3.0),
        (1.0, 0.0, 0.0),
        (0.0, 0.0, 0.0),
    ],
)
def test_spectrum_of_symmetric_matrices(w: tuple[float, float, float]) -> None:
    """Eigenvalues, orthonormal vectors and the matrix come back to round-off, repeated values included."""
    V = rotations(10)
    A = (V * np.array(w)) @ V.transpose(0, 2, 1)
    A = 0.5 * (A + A.transpose(0, 2, 1))
    values, v = spectrum(components(A))
    vectors = v.transpose(2, 0, 1)
    np.testing.assert_allclose(np.sort(values.T), np.broadcast_to(np.sort(w), (M, 3)), rtol=0.0, atol=1e-14)
    assert_rotations(vectors)
    back = (vectors * values.T[:, None, :]) @ vectors.transpose(0, 2, 1)
    np.testing.assert_allclose(back, A, rtol=0.0, atol=2e-14)


def test_spectrum_of_random_matrices_against_lapack() -> None:
    """Entries of order one: both are accurate to a few 1e-15."""
    A = np.random.default_rng(11).standard_normal((4000, 3, 3))
    A = A + A.transpose(0, 2, 1)
    values, _ = spectrum(components(A))
    np.testing.assert_allclose(np.sort(values.T), np.linalg.eigvalsh(A), rtol=0.0, atol=3e-14)


def test_principal_stretches() -> None:
    """Rotation, then the spectrum of R^T F: a signed singular value decomposition, one negative here."""
    F = (rotations(12) * np.array([1.2, 0.9, -0.4])) @ rotations(13)
    f = components(F)
    with np.errstate(all="ignore"):
        s, _ = spectrum(stretch(rotation(f), f))
    np.testing.assert_allclose(np.sort(s.T), np.broadcast_to([-0.4, 0.9, 1.2], (M, 3)), rtol=0.0, atol=1e-14)
