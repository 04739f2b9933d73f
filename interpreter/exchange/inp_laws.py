"""Materials of CalculiX and Abaqus that are exactly a law of ours."""

from __future__ import annotations

from dataclasses import dataclass, replace

from softmark.interpreter.exchange.cards import Card, number
from softmark.interpreter.exchange.record import Law, Left, Part

NEUTRAL = frozenset({"EXPANSION", "CONDUCTIVITY", "SPECIFIC HEAT", "DAMPING", "DEPVAR"})  # nothing at rest
CARDS = NEUTRAL | {
    "ELASTIC", "HYPERELASTIC", "DENSITY", "PLASTIC", "HYPERFOAM", "VISCOELASTIC", "CREEP", "CYCLIC HARDENING",
    "USER MATERIAL", "DEFORMATION PLASTICITY", "MOHR COULOMB", "ANISOTROPIC HYPERELASTIC", "MULLINS EFFECT",
    "CONCRETE DAMAGED PLASTICITY", "CRUSHABLE FOAM", "PERMEABILITY", "UNIAXIAL TEST DATA", "BIAXIAL TEST DATA",
}  # fmt: skip
VOID = 1e20  # D2 and D3 from which on their terms are nothing
NO_D = "D1 is missing or 0, by which Abaqus means no change of volume, and CalculiX a value of its own"


@dataclass(frozen=True)
class Told:
    """A material and the cards below it."""

    card: Card
    cards: list[Card]

    @property
    def name(self) -> str:
        """As the file has it."""
        return self.card.options.get("NAME", "")


def law(told: Told, left: list[Left]) -> Law | None:
    """The law that it is; None where it is none of ours, which is listed. Raises Unreadable."""
    elastic, density = None, None
    for card in told.cards:
        found: Law | str | None = None
        if card.keyword == "DENSITY" and (values := _numbers(card)):
            density = values[0]
            if len(card.rows) > 1:
                left.append(Left(f"*DENSITY of `{told.name}`", "its first line alone is taken", card.line))
        elif card.keyword == "ELASTIC":
            found = _elastic(card)
        elif card.keyword == "HYPERELASTIC":
            found = _hyperelastic(card)
        elif card.keyword in NEUTRAL:
            left.append(Left(f"*{card.keyword} of `{told.name}`", "it does nothing without heat and time", card.line))
        else:
            found = "no law here has it"
        if isinstance(found, str):
            left.append(Left(f"*{card.keyword} of `{told.name}`", found, card.line))
            return None
        elastic = found or elastic
    if elastic is None:
        left.append(Left(f"the material `{told.name}`", "it has no *ELASTIC or *HYPERELASTIC", told.card.line))
        return None
    return replace(elastic, density=density)


def _numbers(card: Card) -> list[float]:
    return [number(w, card) for row in card.rows for w in row if w]


def _elastic(card: Card) -> Law | str:
    kind, values = card.options.get("TYPE", "ISOTROPIC").upper(), _numbers(card)
    if not kind.startswith("ISO") or len(card.rows) != 1 or len(values) not in (2, 3):
        return "only an isotropic pair of Young's modulus and Poisson's ratio is read"
    return Law("linear_elastic", {"young": values[0]}, {"poisson": values[1]})


def _hyperelastic(card: Card) -> Law | str:
    """W = sum of C_ij (I1' - 3)^i (I2' - 3)^j and of (J - 1)^(2i) / D_i."""
    degree = card.options.get("N", "1")
    word = next((w for w in ("NEO HOOKE", "MOONEY-RIVLIN", "YEOH", "REDUCED POLYNOMIAL", "POLYNOMIAL") if w in
                 card.options), "POLYNOMIAL")  # fmt: skip
    word = {("REDUCED POLYNOMIAL", "1"): "NEO HOOKE", ("POLYNOMIAL", "1"): "MOONEY-RIVLIN",
            ("REDUCED POLYNOMIAL", "3"): "YEOH"}.get((word, degree), word)  # fmt: skip
    own = [o for o in card.options if o not in ("N", "MODULI", word) and "POLYNOMIAL" not in o]
    many = {"NEO HOOKE": (1, 1), "MOONEY-RIVLIN": (2, 1), "YEOH": (3, 3)}.get(word)
    if many is None or own:
        return f"no law here is {', '.join(own) or word}"
    values = _numbers(card)
    C, D = values[: many[0]], values[many[0] :]
    if len(card.rows) > 1 or len(C) < many[0] or not D or D[0] <= 0.0 or len(D) > many[1] + 1:
        return NO_D if len(C) == many[0] and (not D or D[0] <= 0.0) else "its constants are not one line of numbers"
    if word == "YEOH" and not (len(D) >= 3 and min(D[1:3]) >= VOID):
        return "D2 and D3 add to the energy of the volume, which no law here has (1e30 leaves them out)"
    bulk = 2.0 / D[0]
    if word == "NEO HOOKE":
        mu = 2.0 * C[0]
        if mu <= 0.0:
            return "its shear modulus is not positive"
        young = 9.0 * bulk * mu / (3.0 * bulk + mu)
        poisson = (3.0 * bulk - 2.0 * mu) / (2.0 * (3.0 * bulk + mu))
        return Law("neo_hookean_isochoric", {"young": young}, {"poisson": poisson})
    if word == "MOONEY-RIVLIN":
        return Law("mooney_rivlin", {"c1": C[0], "c2": C[1], "bulk": bulk})
    return Law("yeoh", {"c1": C[0], "c2": C[1], "c3": C[2], "bulk": bulk})


def in_finite_strain(part: Part) -> Part:
    """*ELASTIC there is the law between Green's strain and the second Piola-Kirchhoff stress."""
    if part.law is None or part.law.word != "linear_elastic":
        return part
    return replace(part, law=replace(part.law, word="st_venant_kirchhoff"))
