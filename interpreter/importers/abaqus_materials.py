"""Materials of CalculiX and Abaqus that correspond exactly to a law of the language.

Sources: Abaqus Analysis User's Guide, "Hyperelastic behavior of rubberlike materials"; Dhondt, "CalculiX CrunchiX
User's Manual", version 2.20, *HYPERELASTIC.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from softmark.interpreter.importers.imported_deck import ImportedLaw, MaterialPart, NotImported
from softmark.solvers.mesh.files.abaqus.keyword_lines import Card, read_number

NEUTRAL = frozenset({  # irrelevant for a static analysis
    "EXPANSION", "CONDUCTIVITY", "SPECIFICHEAT", "DAMPING", "DEPVAR", "ELECTRICALCONDUCTIVITY", "LATENTHEAT",
    "INELASTICHEATFRACTION", "JOULEHEATFRACTION", "USEROUTPUTVARIABLES", "DIFFUSIVITY", "SOLUBILITY",
})  # fmt: skip
CARDS = NEUTRAL | {
    "ELASTIC", "HYPERELASTIC", "DENSITY", "PLASTIC", "HYPERFOAM", "VISCOELASTIC", "CREEP", "CYCLICHARDENING",
    "USERMATERIAL", "DEFORMATIONPLASTICITY", "MOHRCOULOMB", "ANISOTROPICHYPERELASTIC", "MULLINSEFFECT",
    "CONCRETEDAMAGEDPLASTICITY", "CRUSHABLEFOAM", "PERMEABILITY", "UNIAXIALTESTDATA", "BIAXIALTESTDATA",
    "PLANARTESTDATA", "VOLUMETRICTESTDATA", "SIMPLESHEARTESTDATA", "DAMAGEINITIATION", "DAMAGEEVOLUTION",
    "HYPOELASTIC", "POROUSELASTIC", "CONCRETE", "DRUCKERPRAGER", "CAPPLASTICITY", "CLAYPLASTICITY", "SUPERELASTIC",
    "EOS", "TENSILEFAILURE", "SHEARFAILURE", "BRITTLECRACKING", "CASTIRONPLASTICITY", "POTENTIAL", "RATEDEPENDENT",
    "ANNEALTEMPERATURE", "SWELLING", "LOWDENSITYFOAM", "VISCOUS", "HYSTERESIS", "NOTENSION", "NOCOMPRESSION",
    "CRUSHABLEFOAMHARDENING", "DRUCKERPRAGERHARDENING", "MOHRCOULOMBHARDENING", "CONCRETECOMPRESSIONHARDENING",
    "CONCRETETENSIONSTIFFENING", "TENSIONSTIFFENING", "SHEARRETENTION", "FAILURERATIOS", "PIEZOELECTRIC",
}  # fmt: skip
WHY = {
    "VISCOELASTIC": (
        "whether a static step uses the instantaneous or the long-term stiffness is not read; remove the card, and "
        "give the stiffness as *ELASTIC or *HYPERELASTIC"
    ),
    "HYPERFOAM": "foam is not supported",
    "PLASTIC": "plasticity is not supported",
    "USERMATERIAL": "user material subroutines are not supported",
}  # fmt: skip
VOID = 1e20  # D2 and D3 above which their terms vanish
NO_D = "D1 is missing or 0, which means incompressible in Abaqus, and a default value in CalculiX"
MORE_D = "the volumetric terms of D2 and D3 are not supported (1e30 disables them)"
NO_MORE_D = (
    "D2 is missing or 0, which disables its term in Abaqus, and means a default value in CalculiX (1e30 disables it "
    "in both)"
)
NO_SHEAR = "its shear modulus is not positive"
FORMS = ("ARRUDA-BOYCE", "MARLOW", "MOONEY-RIVLIN", "NEOHOOKE", "OGDEN", "POLYNOMIAL", "REDUCEDPOLYNOMIAL", "USER",
         "VANDERWAALS", "YEOH")  # fmt: skip


@dataclass(frozen=True)
class MaterialCards:
    """Material card, and the cards that follow it and describe its behaviour."""

    card: Card
    cards: list[Card]

    @property
    def name(self) -> str:
        """Name of the material as written in the file."""
        return self.card.options.get("NAME", "")


def read_law(told: MaterialCards, left: list[NotImported]) -> ImportedLaw | None:
    """Return the law of a material, or None if the language lacks it. Raises DeckError.

    A missing law is added to `left`, the list of items that are not imported.
    """
    elastic, density = None, None
    for card in told.cards:
        found: ImportedLaw | str | None = None
        if card.keyword == "DENSITY" and (values := _numbers(card)):
            density = values[0]
            if len(card.lines) > 1:
                left.append(NotImported(f"*DENSITY of `{told.name}`", "only its first line is used", card.line))
        elif card.keyword == "ELASTIC":
            found = _elastic_law_or_reason(card)
        elif card.keyword == "HYPERELASTIC":
            found = _hyperelastic_law_or_reason(card)
        elif card.keyword in NEUTRAL:
            left.append(
                NotImported(
                    f"{card.title} of `{told.name}`", "it has no effect without temperature and time", card.line
                )
            )
        else:
            found = WHY.get(card.keyword, "not supported")
        if isinstance(found, str):
            left.append(NotImported(f"{card.title} of `{told.name}`", found, card.line))
            return None
        elastic = found or elastic
    if elastic is None:
        left.append(NotImported(f"the material `{told.name}`", "it has no *ELASTIC or *HYPERELASTIC", told.card.line))
        return None
    return replace(elastic, density=density)


def _numbers(card: Card) -> list[float]:
    return [read_number(w, card) for row in card.each_row() for w in row if w]


def _elastic_law_or_reason(card: Card) -> ImportedLaw | str:
    kind, values = card.options.get("TYPE", "ISOTROPIC").upper(), _numbers(card)
    if unknown := card.unknown_options(frozenset({"TYPE"})):
        return f"its option {unknown[0]} is not supported"
    if not kind.startswith("ISO"):
        return f"TYPE={kind} is not supported, only the isotropic law"
    if len(card.lines) != 1 or len(values) not in (2, 3):
        return "only one line of Young's modulus and Poisson's ratio is supported, without temperature dependence"
    return ImportedLaw("linear_elastic", {"young": values[0]}, {"poisson": values[1]})


def _hyperelastic_law_or_reason(card: Card) -> ImportedLaw | str:
    """Return the law of a strain energy, or the reason why it is not imported.

    The energy has an isochoric part, and the volumetric part sum (J - 1)^(2i) / D_i with K = 2 / D_1.
    """
    form = next((o for o in card.options if o in FORMS), "POLYNOMIAL")
    if unknown := card.unknown_options(frozenset({"N", form})):
        why = {
            "TESTDATAINPUT": "fitting constants to test data is not supported: write the constants",
            "MODULI": "instantaneous and long-term moduli of viscoelastic solids are not supported",
        }
        return why.get(unknown[0], f"its option {unknown[0]} is not supported")
    if form in ("MARLOW", "USER", "VANDERWAALS"):
        return f"the law {form} is not supported"
    degree = int(word) if (word := card.options.get("N", "1") or "1").isdigit() else 0
    if not 1 <= degree <= 6:
        return f"N={word[:20]} is not a whole number from 1 to 6"
    form = {"REDUCEDPOLYNOMIAL": {1: "NEOHOOKE", 3: "YEOH"}, "POLYNOMIAL": {1: "MOONEY-RIVLIN"}}.get(form, {}).get(
        degree, form)  # fmt: skip
    counts = {"NEOHOOKE": (1, 1), "MOONEY-RIVLIN": (2, 1), "YEOH": (3, 3), "OGDEN": (2 * degree, degree),
              "ARRUDA-BOYCE": (2, 1), "REDUCEDPOLYNOMIAL": (degree, degree),
              "POLYNOMIAL": (degree * (degree + 3) // 2, degree)}[form]  # fmt: skip
    values = _numbers(card)
    if len(values) > sum(counts) + 1 or len(values) < counts[0]:  # after the constants there may be a temperature
        return f"it has {len(values)} numbers; one set has {counts[0]} constants and {counts[1]} values of D"
    C, D = values[: counts[0]], values[counts[0] : sum(counts)]
    if form in ("POLYNOMIAL", "REDUCEDPOLYNOMIAL") and (form, degree) != ("REDUCEDPOLYNOMIAL", 2):
        return f"the law {form} with N={degree} is not supported"
    if not D or D[0] <= 0.0:
        return NO_D
    if any(d < VOID for d in [*D[1:], *[0.0] * (counts[1] - len(D))]):
        return MORE_D if any(0.0 < d < VOID for d in D[1:]) else NO_MORE_D
    if len(values) > sum(counts) and values[-1] < 0.0:
        return "its constants are not a single set of numbers"
    return _law_with_bulk_modulus(form, degree, C, 2.0 / D[0])


def _law_with_bulk_modulus(form: str, degree: int, C: list[float], bulk: float) -> ImportedLaw | str:
    if form == "NEOHOOKE":
        mu = 2.0 * C[0]
        if mu <= 0.0:
            return NO_SHEAR
        young = 9.0 * bulk * mu / (3.0 * bulk + mu)
        poisson = (3.0 * bulk - 2.0 * mu) / (2.0 * (3.0 * bulk + mu))
        return ImportedLaw("neo_hookean_isochoric", {"young": young}, {"poisson": poisson})
    if form == "MOONEY-RIVLIN" and C[0] > 0.0 and C[1] >= 0.0:
        return ImportedLaw("mooney_rivlin", {"c1": C[0], "c2": C[1], "bulk": bulk})
    if form == "MOONEY-RIVLIN":  # t1^2 + ... - 3 is the first invariant, and t1^-2 + ... - 3 the second
        if C[0] + C[1] <= 0.0:
            return NO_SHEAR
        return ImportedLaw(
            "ogden", {"bulk": bulk}, stress_lists={"mu": (2.0 * C[0], -2.0 * C[1])}, lists={"alpha": (2.0, -2.0)}
        )
    if form in ("YEOH", "REDUCEDPOLYNOMIAL"):
        if C[0] <= 0.0:
            return NO_SHEAR
        return ImportedLaw("yeoh", {**{f"c{i + 1}": c for i, c in enumerate(C)}, "bulk": bulk})
    if form == "OGDEN":  # 2 mu_i / alpha_i^2 there is mu_i / alpha_i of the language
        moduli, exponents = C[::2], C[1::2]
        if 0.0 in exponents:
            return "an exponent alpha is 0"
        if sum(moduli) <= 0.0:
            return NO_SHEAR
        terms = [(2.0 * m / a, a) for m, a in zip(moduli, exponents, strict=True) if m != 0.0]
        return ImportedLaw("ogden", {"bulk": bulk}, stress_lists={"mu": tuple(m for m, _ in terms)},
                   lists={"alpha": tuple(a for _, a in terms)})  # fmt: skip
    return "its volumetric energy ((J^2 - 1)/2 - ln J)/D is not supported"


def with_finite_strain_law(part: MaterialPart) -> MaterialPart:
    """Return the part with the finite-strain law of *ELASTIC.

    That law relates Green strain and second Piola-Kirchhoff stress.
    """
    if part.law is None or part.law.word != "linear_elastic":
        return part
    return replace(part, law=replace(part.law, word="st_venant_kirchhoff"))
