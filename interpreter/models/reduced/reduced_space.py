"""Reduced spaces: stiffness, mass and linear responses of the full model at rest, and the basis made from them."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from scipy import sparse

from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.models.fem.fem_builder import PreparedSolid
from softmark.interpreter.models.reduced.reduced_declaration import Modal, Pod
from softmark.interpreter.models.reduced.training_states import Training
from softmark.interpreter.problem.body_case import fault
from softmark.records import dataclass
from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.energies.energy import Energy, Floats, Ints
from softmark.solvers.linear.factorisations import Factor, factor
from softmark.solvers.model_reduction.reduced_basis import (
    modal_derivatives,
    orthonormalize,
    principal_fields,
    vibration_modes,
)
from softmark.solvers.statics.static_equilibrium import NotConverged

SMALL = 1e-6  # of the body's size: displacement step of finite differences


# ------------------------------------------------------------------ the full model about rest


@dataclass(frozen=True)
class FullModelAtRest:
    """Finite element model linearized at rest, with stiffness, mass and linear responses of its free unknowns."""

    static: PreparedSolid
    mass: sparse.csr_matrix  # (dofs, dofs), kg

    @property
    def assembly(self) -> Assembly:
        """Energies and loads of the finite element model."""
        return self.static.problem.assembly

    @property
    def free(self) -> Ints:
        """Indices of the degrees of freedom that no support holds."""
        return self.assembly.free

    @property
    def size(self) -> float:
        """Size of the body, m."""
        return self.static.problem.extent

    @cached_property
    def M(self) -> sparse.csr_matrix:
        """Mass matrix of the free degrees of freedom, kg."""
        return self.mass[self.free][:, self.free].tocsr()

    @cached_property
    def K(self) -> sparse.csr_matrix:
        """Stiffness matrix of the free degrees of freedom at rest, N/m."""
        K = self.assembly.tangent(np.zeros(self.assembly.dofs), 0.0)
        return (0.5 * (K + K.T)).tocsr()

    @cached_property
    def factor(self) -> Factor:
        """Factorization of the stiffness matrix K."""
        return factor(self.K)

    def gradient(self, u: Floats) -> Floats:
        """Return the internal forces (free,), N, on free degrees of freedom with displacements u (free,), m."""
        return self.assembly.gradient(self.placed(u), 0.0)[self.free]

    def placed(self, fields: Floats) -> Floats:
        """Return fields that are given on free degrees of freedom, extended by zeros to all degrees of freedom."""
        whole = np.zeros((self.assembly.dofs, *fields.shape[1:]))
        whole[self.free] = fields
        return whole

    def lift(self, imposed: Floats) -> Floats:
        """Return the linear response (dofs,) to imposed displacements (c,), m."""
        x = np.zeros(self.assembly.dofs)
        x[self.static.problem.fixed] = imposed
        most = np.abs(imposed).max(initial=0.0)
        if most == 0.0:
            return x
        step = SMALL * self.size / most
        coupling = (self.assembly.gradient(step * x, 0.0) - self.assembly.gradient(-step * x, 0.0)) / (2 * step)
        x[self.free] = -self.factor.solve(coupling[self.free])
        return x

    @cached_property
    def load_responses(self) -> Floats:
        """Linear response (free, loads), m, to each load."""
        zero = np.zeros(self.assembly.dofs)
        forces = [gradient_of(load, zero)[self.free] for load in self.assembly.loads]
        found = [-self.factor.solve(f) for f in forces if np.any(f)]
        return np.column_stack(found) if found else np.zeros((len(self.free), 0))


def gradient_of(energy: Energy, x: Floats) -> Floats:
    """Return the gradient of an energy (dofs,), N."""
    g = np.zeros_like(x)
    energy.add_gradient(x, g)
    return g


# ------------------------------------------------------------------ the space


@dataclass(frozen=True)
class Basis:
    """Basis V (dofs, r) with V^T M V = I, the lift (dofs,) of imposed displacements, and a report of the basis.

    `states` (s, dofs) are the states that sampled cells are fitted to; None stands for the reduced model's own
    solutions.
    """

    V: Floats
    lift: Floats | None
    facts: dict[str, Any]
    states: Floats | None = None

    @property
    def fields(self) -> Floats:
        """Basis V, with the lift as an additional last column if displacements are imposed."""
        return self.V if self.lift is None else np.column_stack([self.V, self.lift])


def modal_space(model: Modal, declared: Declared, rest: FullModelAtRest) -> Basis:
    """Return the space of vibration modes, linear responses and modal derivatives. Raises Fault."""
    _check_mode_count(model.modes, declared, rest)
    omega, modes = vibration_modes(rest.K, rest.M, model.modes)
    lift = _lift(rest)
    loaded = [rest.load_responses, *(() if lift is None else (lift[rest.free][:, None],))]
    static = np.column_stack(loaded)
    V = orthonormalize(np.column_stack([static, modes]), rest.M)[0]
    if model.derivatives and rest.static.model.strain != "small":
        V = orthonormalize(np.column_stack([V, _modal_derivatives(model, rest, static, omega, modes)]), rest.M)[0]
    facts = {"frequencies_Hz": (omega / (2 * np.pi)).tolist()[:50]}
    return Basis(rest.placed(V), lift, facts)


def _modal_derivatives(model: Modal, rest: FullModelAtRest, static: Floats, omega: Floats, modes: Floats) -> Floats:
    """Return the principal modal derivatives, as many as modes.

    The modes are scaled to the linear response `static` to the loads.
    """
    reach = np.sqrt(np.max(np.sum(static * (rest.M @ static), axis=0), initial=0.0)) or 1.0
    sized = modes * reach * (omega[0] / omega) ** 2
    found = modal_derivatives(rest.gradient, rest.factor.solve, np.column_stack([static, sized]), rest.size)
    return principal_fields(found, rest.M, model.modes, 0.0).V


def pod_space(model: Pod, declared: Declared, rest: FullModelAtRest, training: Training) -> Basis:
    """Return the basis of the principal fields of the training states, without the lift of imposed displacements.

    Raises Fault, and NotConverged if training has failed.
    """
    _check_mode_count(model.modes or 1, declared, rest)
    if not len(training.states):
        reasons = "; ".join(training.failed[:3])
        raise NotConverged(f"`{model.of}` found no equilibrium in training: {reasons}")
    held = training.states[:, rest.static.problem.fixed]
    own = np.array([x - rest.lift(t) for x, t in zip(training.states, held, strict=True)])[:, rest.free].T
    if not np.any(own):
        raise NotConverged("training failed: no training state deforms the body")
    found = principal_fields(own, rest.M if model.norm == "mass" else rest.K, model.modes, model.tolerance)
    V = found.V if model.norm == "mass" else orthonormalize(found.V, rest.M)[0]
    facts = {"captured_energy": found.captured, "projection_error": found.error}
    W = rest.placed(V)
    shares = (rest.M @ own).T @ V  # (s, r)
    states = shares @ W.T + np.array([rest.lift(t) for t in held])
    return Basis(W, _lift(rest), facts, states)


def _lift(rest: FullModelAtRest) -> Floats | None:
    """Return the linear response (dofs,) to the imposed displacements, m; None if nothing is imposed."""
    target = rest.static.problem.target
    return rest.lift(target) if np.any(target) else None


def _check_mode_count(modes: int, declared: Declared, rest: FullModelAtRest) -> None:
    if modes <= len(rest.free):
        return
    raise fault(
        "E532",
        declared.at("modes"),
        f"`{declared.name}` asks for {modes} modes, but the model has {len(rest.free)} unknowns",
        "more modes than unknowns",
        "reduce `modes`, or refine the mesh",
    )
