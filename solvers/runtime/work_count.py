"""Count of numerical work in nominal CPU seconds, which is the same in every run of the same problem.

Limits on the cost of an estimate are compared with this count, not with a clock: what is computed must not depend on
how busy the machine is. Operations are divided by typical rates of one core, so counts and clocks agree within a
factor of a few.
"""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from typing import Any

    import numpy as np
    from numpy.typing import NDArray

    Stencils = NDArray[np.integer[Any]]  # (n, k) degrees of freedom of n blocks

FLOPS, ENTRIES = 1e10, 5e8  # per second: operations of a factorisation; matrix entries in a solve or a product
FORCE, STIFFNESS = 1e-7, 4e-8  # s, for each stencil: per degree of freedom; per entry of its block
SETUP = 5e-8  # s, for each entry of all stencils' blocks: integration over cells and the sparsity pattern
CALL, SOLVE = 1e-4, 1e-5  # s, for each call in Python: of an energy or a factorisation, and of a solve
CONTACT, RIGID = 1e-1, 4e-3  # s, for each evaluation of contact: between deformable surfaces, with a rigid body
SPECTRUM, STRETCH = 7e-4, 5e-7  # s, for principal stretches: for each call, and for each point
STEP = 3e-3  # s, for each time step of a quasistatic analysis, in Python


class _Count(threading.local):
    """Nominal nanoseconds of all work counted so far in a thread; integers, so that differences are exact."""

    nanoseconds = 0


_COUNT = _Count()


def counted() -> int:
    """Return the nominal CPU time, ns, of all work counted so far in this thread."""
    return _COUNT.nanoseconds


def seconds_since(start: int) -> float:
    """Return the nominal CPU time, s, of the work counted since `counted` returned `start`."""
    return (_COUNT.nanoseconds - start) * 1e-9


def count_seconds(seconds: float) -> None:
    """Count work that took a known CPU time, s, such as that of an external program."""
    _COUNT.nanoseconds += round(seconds * 1e9)


def count_factorization(operations: float) -> None:
    """Count a factorisation by its number of floating-point operations."""
    count_seconds(CALL + operations / FLOPS)


def count_product(entries: int) -> None:
    """Count a solve with a factor, or a product with a matrix, by the number of its entries."""
    count_seconds(SOLVE + entries / ENTRIES)


def count_time_step() -> None:
    """Count the work in a quasistatic time step that does not depend on the number of cells."""
    count_seconds(STEP)


def count_contact_search() -> None:
    """Count one search for contact between deformable surfaces, with the stiffness of the contacts found."""
    count_seconds(CONTACT)


def count_rigid_contacts(contacts: int) -> None:
    """Count one evaluation of contacts with rigid bodies."""
    count_seconds(RIGID * contacts)


def count_principal_stretches(points: int) -> None:
    """Count the principal stretches of deformation gradients at some points, with their directions."""
    count_seconds(SPECTRUM + STRETCH * points)


def count_forces(stencils: Stencils) -> None:
    """Count one evaluation of the forces of blocks with these degrees of freedom."""
    count_seconds(CALL + FORCE * stencils.size)


def count_stiffness(stencils: Stencils) -> None:
    """Count one evaluation of the stiffness of blocks with these degrees of freedom."""
    count_seconds(CALL + STIFFNESS * _block_entries(stencils))


def count_setup(stencils: Stencils) -> None:
    """Count the integration over cells with these degrees of freedom, and their part of a sparsity pattern."""
    count_seconds(CALL + SETUP * _block_entries(stencils))


def _block_entries(stencils: Stencils) -> int:
    """Return the number of entries in the Hessian blocks of all stencils."""
    return stencils.size * int(stencils.shape[1])
