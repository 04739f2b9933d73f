"""Analyses: what is to be found."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

Vector3 = tuple[float, float, float]

Integrator = Literal[
    "implicit_euler", "newmark", "trapezoidal", "generalized_alpha", "bdf2", "midpoint", "central_differences"
]


@dataclass(frozen=True)
class Static:
    """The state of rest under the loads: static equilibrium, by Newton's method.

    Converged means that the out-of-balance force is below `tolerance` times the larger of load and reactions.
    Anything else is reported as not converged, with its history.
    """

    tolerance: Annotated[float, "1 in [1e-12, 1e-2]", "largest relative out-of-balance force"] = 1e-8
    max_iterations: Annotated[int, "1 in [1, 1000]", "Newton iterations for each load step"] = 50


@dataclass(frozen=True)
class Dynamic:
    """The motion from the undeformed state under the loads, step by step in time.

    Every implicit step is solved to `tolerance`; one that is not is halved, and the report says so. Damping is
    Rayleigh's, C = a M + b K with the tangent K at the start of the step: a mode of circular frequency w has the
    damping ratio a / 2w + b w / 2. Central differences are explicit: their step must stay below the critical one, which
    is computed.
    """

    duration: Annotated[float, "s in (0, inf)", "how long the motion is followed"]
    step: Annotated[float, "s in (0, inf)", "the time step"]
    integrator: Annotated[Integrator, "how time is stepped"] = "implicit_euler"
    damping_mass: Annotated[float, "1/s in [0, inf)", "a of Rayleigh's damping"] = 0.0
    damping_stiffness: Annotated[float, "s in [0, inf)", "b of Rayleigh's damping"] = 0.0
    spectral_radius: Annotated[
        float, "1 in [0, 1]", "of generalized_alpha: what is left of the fastest modes"
    ] = 0.8
    tolerance: Annotated[float, "1 in [1e-12, 1e-2]", "largest relative out-of-balance force of a step"] = (
        1e-6
    )
    max_iterations: Annotated[int, "1 in [1, 1000]", "Newton iterations of a step before it is halved"] = 25
    velocity: Annotated[Vector3, "m/s", "velocity of the whole body at the start"] = (0.0, 0.0, 0.0)
    spin: Annotated[Vector3, "rad/s", "angular velocity at the start, about the centre of mass"] = (
        0.0,
        0.0,
        0.0,
    )
