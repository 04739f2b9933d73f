"""Batches of 3x3 matrices stored component by component: a (3, 3, m), with a[i, J] over the whole batch.

numpy is fast on long rows, so the laws compute in this layout. Fourth-order tensors H (9, 9, m) hold their entry iJkL
at [3 i + J, 3 k + L]. They have major symmetry, and the functions here write only the entries on and above the diagonal
("upper triangle").
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import numpy as np

    from softmark.solvers.materials.constitutive_law import Array
else:
    from softmark.solvers.runtime.lazy_modules import np

CYCLES = ((0, 1, 2), (1, 2, 0), (2, 0, 1))


def components(A: Array) -> Array:
    """Return A (m, 3, 3) as a (3, 3, m), contiguous and of floating-point type."""
    return np.ascontiguousarray(A.transpose(1, 2, 0), dtype=result_dtype(A))


def result_dtype(A: Array) -> Any:
    """Return the floating-point type of results computed from A: its own, or double if A has none."""
    return np.result_type(A.dtype, np.float32)


def transposed(a: Array) -> Array:
    """Return the transposes A^T (3, 3, m), as a view."""
    swapped: Array = a.swapaxes(0, 1)
    return swapped


def trace(a: Array) -> Array:
    """Return tr A (m,)."""
    tr: Array = a[0, 0] + a[1, 1] + a[2, 2]
    return tr


def inner(a: Array, b: Array) -> Array:
    """Return A : B = A_iJ B_iJ (m,)."""
    total: Array = np.add.reduce((a * b).reshape(9, -1), axis=0)
    return total


def product(a: Array, b: Array) -> Array:
    """Return A B (3, 3, m)."""
    c: Array = a[:, 0, None] * b[0]
    c += a[:, 1, None] * b[1]
    c += a[:, 2, None] * b[2]
    return c


def cofactor(a: Array) -> Array:
    """Return cof A = det A A^-T (3, 3, m): each row is the cross product of the other two."""
    c = np.empty_like(a)
    for i, j, k in CYCLES:
        for p, q, r in CYCLES:
            np.multiply(a[j, q], a[k, r], out=c[i, p])
            c[i, p] -= a[j, r] * a[k, q]
    return c


def determinant(a: Array, cof: Array) -> Array:
    """Return det A (m,) from A and its cofactor."""
    det: Array = np.add.reduce(a[0] * cof[0], axis=0)
    return det


def add_diagonal(a: Array, value: Array | float) -> Array:
    """Add value I to A in place."""
    for i in range(3):
        a[i, i] += value
    return a


def displacement_gradient(f: Array) -> Array:
    """Return F - I (3, 3, m), which is exact in floating point for F near I.

    Computed from it, energies are accurate near rest.
    """
    return add_diagonal(f.copy(), -1.0)


def volume_change(h: Array) -> Array:
    """Return J - 1 = tr h + tr cof h + det h (m,) for F = I + h, without the cancellation of det F - 1."""
    cof = cofactor(h)
    return trace(h) + trace(cof) + determinant(h, cof)


def green_strain(h: Array) -> Array:
    """Return E = (h + h^T + h^T h)/2 (3, 3, m) for F = I + h, accurate near rest."""
    return 0.5 * (h + transposed(h) + product(transposed(h), h))


def set_outer(H: Array, a: Array, b: Array) -> None:
    """Set H = a (x) b, upper triangle; a, b (9, m)."""
    for r in range(9):
        np.multiply(a[r], b[r:], out=H[r, r:])


def add_outer(H: Array, a: Array, b: Array, skip: int | None = None) -> None:
    """Add H += a (x) b, upper triangle; a, b (9, m); `skip` is the index J of a zero column of a."""
    for r in range(9):
        if r % 3 != skip:
            H[r, r:] += a[r] * b[r:]


def _cross_entries() -> tuple[tuple[int, int, int, int, bool], ...]:
    """Return (row, column, m, n, positive) of the entries e_ikm e_JLn above the diagonal."""
    return tuple(
        (3 * i + J, 3 * k + L, 3 - i - k, 3 - J - L, ((k - i) % 3 == 1) == ((L - J) % 3 == 1))
        for i in range(3)
        for k in range(i + 1, 3)
        for J in range(3)
        for L in range(3)
        if J != L
    )


CROSS = _cross_entries()


def add_tensor_cross_product(H: Array, a: Array) -> None:
    """Add e_ikm e_JLn A_mn to H_iJkL, upper triangle; for A = F it is the derivative of cof F.

    Also A_iL A_kJ = A_iJ A_kL - e_ikm e_JLn (cof A)_mn. Source: Bonet, Gil, Ortigosa (2015), "A computational framework
    for polyconvex large strain elasticity", the tensor cross product.
    """
    for row, column, m, n, positive in CROSS:
        if positive:
            H[row, column] += a[m, n]
        else:
            H[row, column] -= a[m, n]


def add_identity(H: Array, value: Array | float) -> None:
    """Add H_iJkL += value delta_ik delta_JL."""
    for r in range(9):
        H[r, r] += value


def add_geometric_stiffness(H: Array, S: Array) -> None:
    """Add H_iJkL += delta_ik S_JL, upper triangle; S (3, 3, m or 1) symmetric."""
    for i in range(3):
        for J in range(3):
            for L in range(J, 3):
                H[3 * i + J, 3 * i + L] += S[J, L]


def add_carried(H: Array, b: Array) -> None:
    """Add b_ik delta_JL to H_iJkL, upper triangle; b (3, 3, m) is symmetric."""
    for J in range(3):
        for i in range(3):
            for k in range(i, 3):
                H[3 * i + J, 3 * k + J] += b[i, k]


def write_symmetric(H: Array, out: Array) -> None:
    """Write the upper triangle H (9, 9, m) into the full tensors out (m, 3, 3, 3, 3)."""
    full = out.reshape(-1, 9, 9).transpose(1, 2, 0)
    for r in range(9):
        full[r, r] = H[r, r]
        for s in range(r + 1, 9):
            full[r, s] = H[r, s]
            full[s, r] = H[r, s]
