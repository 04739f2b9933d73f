"""Viscoelastic material: the stress of an elastic law relaxes by a sum of exponentials (a Prony series)."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from softmark.records import dataclass


@dataclass(frozen=True)
class Viscoelastic:
    """Finite linear viscoelasticity: the stress of any elastic law relaxes by a Prony series.

    S(t) = S_rest + G(t) S0(0) + int_0^t G(t - s) dS0/ds ds,  G(t) = 1 - sum_i g_i (1 - exp(-t / tau_i))

    `law` is the instantaneous elastic law; the fraction 1 - sum(g) of its stress remains in the long run. S is the
    second Piola-Kirchhoff stress (in corotational strain Biot's), which rotations do not change; in small strain it is
    the stress itself. `of = shape` relaxes only the deviatoric stress and keeps the bulk modulus. This needs a law with
    an isochoric-volumetric split (every law with `volumetric`, and `neo_hookean_isochoric`), or any law in small or
    corotational strain; at finite strain S is then computed from J^(-1/3) F (Simo). `of = whole` relaxes the whole
    stress, at a constant Poisson's ratio. In beams, stretch and bending relax with Young's modulus, shear and torsion
    with the shear modulus, each with its own series.

    One term gives Zener's solid (the standard linear solid), and with g = 1 Maxwell's fluid. A term whose tau is much
    shorter than all times of interest gives the Kelvin-Voigt solid: with a law 1 / (1 - g) times as stiff, it creeps
    with the retardation time tau / (1 - g). With an exponential law it is Fung's quasi-linear theory.

    Every term of the series is a spring and a dashpot in series; the dissipated energy is what the dashpots absorb. The
    spring is at rest at the strain where the law has the stress that the term has lost. Dissipation is never negative
    if the law is a convex function of I1. Where a law is not convex (`of = whole` with growing volume), stress is
    defined but no free energy is reported (W368).
    Source: Simo (1987), "On a fully three-dimensional finite-strain viscoelastic damage model", Comput. Methods Appl.
    Mech. Eng. 60:153; Puso and Weiss (1998), J. Biomech. Eng. 120:62; Fung (1993), "Biomechanics", section 7.6.
    """

    law: Annotated[Any, "material", "instantaneous elastic law"]
    g: Annotated[Any, "values of 1 in [0, 1]", "fractions of the stress that relax; their sum is at most 1"]
    tau: Annotated[Any, "values of s in (0, inf)", "relaxation times, one for each fraction"]
    of: Annotated[Literal["shape", "whole"], "stress that relaxes: only the deviatoric part, or the whole stress"] = (
        "shape"
    )

    def __getattr__(self, name: str) -> Any:
        """Return any other material attribute from the elastic solid."""
        if name.startswith("__") or name == "law":
            raise AttributeError(name)
        return getattr(self.law, name)

    @property
    def branches(self) -> tuple[tuple[float, float], ...]:
        """Share and relaxation time, s, of every term with a nonzero share."""
        pairs = zip(self.g.values, self.tau.values, strict=False)
        return tuple((g, tau) for g, tau in pairs if g > 0.0)
