"""Explanations of words that are not constructors: reserved words, functions, predefined names and units."""

from __future__ import annotations

from softmark.interpreter.language import units

# words that are not constructors: reserved words, functions, and predefined names
RESERVED = {
    "softmark": "`softmark 1` as the first line gives the version of the language. It may be left out.",
    "scene": '`scene "silicone beam"` gives the scene a title, once. Without it the title is the name of the file.',
    "use": '`use "tissues.scene" as tissue` makes the names of another scene known as `tissue.NAME`. Paths are\n'
    "relative to the scene's own folder; `std/...` is the standard library.",
    "as": 'Part of `use "tissues.scene" as tissue`: the name under which the other scene is known.',
    "param": "`param L = 178 mm` names a quantity, and `param L = 178 mm in 10 mm .. 1 m` gives it a range too.\n"
    "A parameter can be replaced for one run: `dsl run FILE -p L=120mm`.",
    "in": "Part of `param L = 178 mm in 10 mm .. 1 m`: the range of a parameter, both ends included.",
    "expect": "`expect rod.eta < 5 %` is a condition on a metric (`eta`) of a model or reference (`rod`). Whether\n"
    "it is met is decided after the run; if it is not, `dsl run` exits with 1.",
    "and": "`x <= 0 mm and z > 0 mm`: both conditions hold. It binds more tightly than `or`.",
    "or": "`x <= 0 mm or x >= 200 mm`: at least one of the conditions holds. `and` binds more tightly.",
    "not": "`not x <= 0 mm`: the condition does not hold.",
}
CALLS = {
    "abs": ("abs(a)", "magnitude of a quantity, in its unit"),
    "sin": ("sin(a)", "sine of an angle: `sin(30 deg)` is 0.5"),
    "cos": ("cos(a)", "cosine of an angle"),
    "tan": ("tan(a)", "tangent of an angle"),
    "exp": ("exp(a)", "e to the power of a plain number"),
    "log": ("log(a)", "natural logarithm of a positive plain number"),
    "sqrt": ("sqrt(a)", "square root, of the unit too: `sqrt(4 mm^2)` is 2 mm"),
    "min": ("min(a, b)", "smallest of quantities of one dimension, two or more"),
    "max": ("max(a, b)", "largest of quantities of one dimension, two or more"),
}
PLAIN = {
    "pi": "constant, 3.14159...",
    "x": "coordinate, in conditions (`x <= 0 mm`) and directions (`-x`)",
    "y": "coordinate, in conditions (`y <= 0 mm`) and directions (`-y`)",
    "z": "coordinate, in conditions (`z <= 0 mm`) and directions (`-z`)",
    "yes": "value of a switch, such as `shear = yes`",
    "no": "value of a switch, such as `shear = no`",
}


def word_page(name: str) -> str | None:
    """Return the page of a reserved word, a function or a predefined name; None for other names."""
    if name in RESERVED:
        return f"{name} (reserved word)\n\n{RESERVED[name]}"
    if name in CALLS:
        return f"{CALLS[name][0]} (function)\n\n{CALLS[name][1]}"
    return f"{name}\n\n{PLAIN[name]}" if name in PLAIN else None


def unit_page(name: str) -> str | None:
    """Return the page of a unit or a product of units: the quantity that it measures, and its size in SI."""
    try:
        measure = units.parse_unit(name)
    except units.UnitError:
        return None
    if name == "1":
        return None
    si = units.si_unit(measure.dimension)
    size = f"; 1 {name} is {measure.factor:.12g} {si}".removesuffix(" 1") if name != si else ", and is a unit of SI"
    takes = units.UNITS.get(name, (1.0, units.NONE, False))[2]
    prefixes = f"\nIt takes the prefixes {' '.join(units.PREFIXES)}, as in `k{name}`." if takes else ""
    kind = units.dimension_name(measure.dimension)
    what = f"measures {kind}" if measure.dimension in units.NAMES else "measures a quantity without a name"
    what = "stands for a plain number" if measure.dimension == units.NONE else what
    return f"{name} (unit)\n\nIt {what}{size}.{prefixes}\nA unit stands right after its number, as in `5 {name}`."
