"""Small vibrations of a model about its equilibrium, computed only when a metric needs them."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import TYPE_CHECKING, Any

from softmark.interpreter.metrics.undefined_metric import Undefined
from softmark.solvers.energies.energy import Floats

if TYPE_CHECKING:
    from softmark.solvers.assembly.assembly import Assembly
    from softmark.solvers.linear.linear_solver import LinearSolverOptions

UNSTABLE = 1e-9  # of the largest eigenvalue: a more negative one means an unstable state


def undefined_frequencies(reason: str) -> Callable[[int], Floats]:
    """Return the frequency function of a solution that has none; it raises Undefined with the reason."""

    def refused(count: int) -> Floats:
        raise Undefined(reason)

    return refused


def frequencies_about(
    assembly: Assembly, x: Floats, mass: Callable[[], Any], linear: LinearSolverOptions
) -> Callable[[int], Floats]:
    """Return a function of `count` that returns the lowest frequencies (count,), Hz, about the state x at full load.

    `mass` returns the mass matrix, or its diagonal, of the first degrees of freedom; the others have no mass. The
    function raises Undefined with a reason. It computes each count once, because reports are made repeatedly.
    """
    return cache(lambda count: _frequencies(assembly, x, mass(), linear, count))


def free_mass_matrix(mass: Any, assembly: Assembly) -> Any:
    """Return the mass matrix of the free degrees of freedom (n, n), kg.

    `mass` is the matrix, or its diagonal, of the first degrees of freedom.
    """
    from scipy import sparse

    whole = sparse.csr_matrix(sparse.diags(mass) if mass.ndim == 1 else mass)
    whole.resize(assembly.dofs, assembly.dofs)
    return whole[assembly.free][:, assembly.free]


def _frequencies(assembly: Assembly, x: Floats, mass: Any, linear: LinearSolverOptions, count: int) -> Floats:
    """Return the lowest frequencies (count,), Hz, about the state x."""
    import numpy as np

    from softmark.solvers.dynamics.vibration_modes import CLOSE, ModesNotFound, lowest_modes, mode_residual
    from softmark.solvers.linear.factorisations import Singular
    from softmark.solvers.linear.linear_solver import LinearSolverOptions, LinearSystems

    if not assembly.conservative:
        raise Undefined(
            "a follower load has no potential energy, so the linearized motion may grow and has no real frequencies"
        )
    K, M = assembly.tangent(x.astype(np.float64), 1.0), free_mass_matrix(mass, assembly)
    try:
        plain = LinearSolverOptions(modes=linear.modes, spare=linear.spare)
        values, modes = lowest_modes(K, M, count, lambda: LinearSystems(plain).direct(K))
    except (ModesNotFound, Singular) as error:
        raise Undefined(str(error)) from error
    if (left := mode_residual(K, M, values, modes)) > CLOSE:
        what, remedy = (
            (f"{count} modes were", "use a smaller mode number")
            if count > 1
            else ("one mode was", "the other modes are too stiff")
        )
        raise Undefined(f"{what} not found accurately, with a residual of {left:.1g} of the forces: {remedy}")
    if values[0] < -UNSTABLE * np.abs(values).max():
        raise Undefined("the equilibrium is unstable, so it has no frequency of vibration")
    found: Floats = np.sqrt(np.maximum(values, 0.0)) / (2.0 * np.pi)
    return found
