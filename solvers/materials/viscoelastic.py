"""Viscoelastic material: the stress of an elastic law relaxes by a sum of exponentials (a Prony series)."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from softmark.records import dataclass


@dataclass(frozen=True)
class Viscous:
    """Finite linear viscoelasticity: any elastic law, whose stress relaxes by a Prony series.

    S(t) = S_rest + G(t) S0(0) + int_0^t G(t - s) dS0/ds ds,  G(t) = 1 - sum_i g_i (1 - exp(-t / tau_i))

    `law` is what the solid is when nothing has had time to relax; after a long time 1 - sum(g) of it is left. S is the
    second Piola-Kirchhoff stress, in corotational strain Biot's, so that rotations change nothing; where strains are
    small it is the stress itself. `of = shape` relaxes the stress of the change of shape alone, and the bulk modulus
    stays: of laws that have shape and volume apart, as all with `volumetric` and `neo_hookean_isochoric`, and of any
    law in small and corotational strain; at finite strain S is then that of J^(-1/3) F (Simo). `of = whole` relaxes all
    of it, at a constant Poisson's ratio. Beams relax by sections: what stretches and bends with Young's modulus, what
    shears and twists with the shear modulus, each by the series that it has.

    One term is Zener's solid (the standard linear solid) and, with g = 1, Maxwell's fluid; Kelvin and Voigt's is what a
    term comes to whose tau is far below all times that matter: with a law 1 / (1 - g) times as stiff it creeps with the
    retardation time tau / (1 - g). With a law whose stress grows exponentially it is Fung's quasi-linear theory.

    Dissipated energy is what the springs of the series lose: every term is a spring and a dashpot, at rest in the
    strain under which the law has the stress that the term has lost. So there is a free energy in every motion where
    each state is at rest under its own stress, as of all rubber of the first invariant, and no heat comes back. A law
    that is not convex (`of = whole` where the volume grows) has stress there and no energy, which is said (W368).
    Source: Simo (1987), "On a fully three-dimensional finite-strain viscoelastic damage model", Comput. Methods Appl.
    Mech. Eng. 60:153; Puso and Weiss (1998), J. Biomech. Eng. 120:62; Fung (1993), "Biomechanics", section 7.6.
    """

    law: Annotated[Any, "material", "elastic law of the instantaneous response"]
    g: Annotated[Any, "values of 1 in [0, 1]", "relative moduli of the Maxwell branches; their sum is at most 1"]
    tau: Annotated[Any, "values of s in (0, inf)", "relaxation times, one for each relative modulus"]
    of: Annotated[Literal["shape", "whole"], "what relaxes: only the deviatoric stress, or all stress"] = "shape"

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
