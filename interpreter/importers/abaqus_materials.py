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
    "VISCOELASTIC": "a step at rest has its stiffness at once or in the long run, and which one is not read; "
                    "leave the card out, and write that stiffness as *ELASTIC or *HYPERELASTIC",
    "HYPERFOAM": "no law here has the energy of foam",
    "PLASTIC": "no law here has plasticity",
    "USERMATERIAL": "its law is a subroutine",
}  # fmt: skip
VOID = 1e20  # D2 and D3 above which their terms vanish
NO_D = "D1 is missing or 0, by which Abaqus means no change of volume, and CalculiX a value of its own"
MORE_D = "D2 and D3 add to the energy of the volume, which no law here has (1e30 leaves them out)"
NO_MORE_D = ("a D2 that is missing or 0 leaves its term out in Abaqus, and CalculiX takes a value of its own (1e30 "
             "leaves it out in both)")  # fmt: skip
NO_SHEAR = "its shear modulus is not positive"
FORMS = ("ARRUDA-BOYCE", "MARLOW", "MOONEY-RIVLIN", "NEOHOOKE", "OGDEN", "POLYNOMIAL", "REDUCEDPOLYNOMIAL", "USER",
         "VANDERWAALS", "YEOH")  # fmt: skip


@dataclass(frozen=True)
class MaterialCards:
    """Material card and the cards below it."""

    card: Card
    cards: list[Card]

    @property
    def name(self) -> str:
        """Name as written in the file."""
        return self.card.options.get("NAME", "")


def read_law(told: MaterialCards, left: list[NotImported]) -> ImportedLaw | None:
    """Return the law, or None if the language lacks it, which is added to `left`. Raises DeckError."""
    elastic, density = None, None
    for card in told.cards:
        found: ImportedLaw | str | None = None
        if card.keyword == "DENSITY" and (values := _numbers(card)):
            density = values[0]
            if len(card.lines) > 1:
                left.append(NotImported(f"*DENSITY of `{told.name}`", "its first line alone is taken", card.line))
        elif card.keyword == "ELASTIC":
            found = _elastic(card)
        elif card.keyword == "HYPERELASTIC":
            found = _hyperelastic(card)
        elif card.keyword in NEUTRAL:
            left.append(
                NotImported(f"{card.title} of `{told.name}`", "it does nothing without heat and time", card.line)
            )
        else:
            found = WHY.get(card.keyword, "no law here has it")
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


def _elastic(card: Card) -> ImportedLaw | str:
    kind, values = card.options.get("TYPE", "ISOTROPIC").upper(), _numbers(card)
    if unknown := card.unknown_options(frozenset({"TYPE"})):
        return f"its option {unknown[0]} is not read"
    if not kind.startswith("ISO"):
        return f"TYPE={kind} is not read, only the isotropic law"
    if len(card.lines) != 1 or len(values) not in (2, 3):
        return "only one line of Young's modulus and Poisson's ratio is read, not what depends on temperature"
    return ImportedLaw("linear_elastic", {"young": values[0]}, {"poisson": values[1]})


def _hyperelastic(card: Card) -> ImportedLaw | str:
    """Return the law of a strain energy: an isochoric part, and the volumetric part sum (J - 1)^(2i) / D_i (K = 2 /
    D_1).
    """
    form = next((o for o in card.options if o in FORMS), "POLYNOMIAL")
    if unknown := card.unknown_options(frozenset({"N", form})):
        why = {
            "TESTDATAINPUT": "its constants are to be fitted to test data: write the constants",
            "MODULI": "moduli at once and in the long run are of viscoelastic solids, which are not read",
        }
        return why.get(unknown[0], f"its option {unknown[0]} is not read")
    if form in ("MARLOW", "USER", "VANDERWAALS"):
        return f"no law here has the energy {form}"
    degree = int(word) if (word := card.options.get("N", "1") or "1").isdigit() else 0
    if not 1 <= degree <= 6:
        return f"N={word[:20]} is not a number of terms from 1 to 6"
    form = {"REDUCEDPOLYNOMIAL": {1: "NEOHOOKE", 3: "YEOH"}, "POLYNOMIAL": {1: "MOONEY-RIVLIN"}}.get(form, {}).get(
        degree, form)  # fmt: skip
    counts = {"NEOHOOKE": (1, 1), "MOONEY-RIVLIN": (2, 1), "YEOH": (3, 3), "OGDEN": (2 * degree, degree),
              "ARRUDA-BOYCE": (2, 1), "REDUCEDPOLYNOMIAL": (degree, degree),
              "POLYNOMIAL": (degree * (degree + 3) // 2, degree)}[form]  # fmt: skip
    values = _numbers(card)
    if len(values) > sum(counts) + 1 or len(values) < counts[0]:  # after the constants there may be a temperature
        return f"it has {len(values)} numbers, and one set of constants is {counts[0]} with {counts[1]} of D"
    C, D = values[: counts[0]], values[counts[0] : sum(counts)]
    if form in ("POLYNOMIAL", "REDUCEDPOLYNOMIAL") and (form, degree) != ("REDUCEDPOLYNOMIAL", 2):
        return f"no law here has the energy {form} with N={degree}"
    if not D or D[0] <= 0.0:
        return NO_D
    if any(d < VOID for d in [*D[1:], *[0.0] * (counts[1] - len(D))]):
        return MORE_D if any(0.0 < d < VOID for d in D[1:]) else NO_MORE_D
    if len(values) > sum(counts) and values[-1] < 0.0:
        return "its constants are not one set of numbers"
    return _with_bulk(form, degree, C, 2.0 / D[0])


def _with_bulk(form: str, degree: int, C: list[float], bulk: float) -> ImportedLaw | str:
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
    return "its energy of the volume is ((J^2 - 1)/2 - ln J)/D, which no law here has"


def in_finite_strain(part: MaterialPart) -> MaterialPart:
    """Return the part with the finite-strain law of *ELASTIC, which relates Green strain and second Piola-Kirchhoff
    stress.
    """
    if part.law is None or part.law.word != "linear_elastic":
        return part
    return replace(part, law=replace(part.law, word="st_venant_kirchhoff"))
