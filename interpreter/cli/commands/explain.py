"""`dsl explain`."""

from __future__ import annotations

import argparse
import inspect
import re
import sys

from softmark.grammar.diagnostic import visible
from softmark.grammar.suggest import distance, nearest
from softmark.interpreter.cli import ranges
from softmark.interpreter.cli.commands.options import plugin_option
from softmark.interpreter.front.catalogue import CATALOGUE, vocabulary_with
from softmark.interpreter.language import aliases, units
from softmark.interpreter.language.schema import Constructor, Field, Vocabulary
from softmark.references.reference import Reference

CODE = re.compile(r"[EW]\d{3}$", re.IGNORECASE)


def arguments(parser: argparse.ArgumentParser) -> None:
    """NAME|CODE"""
    plugin_option(parser)
    parser.add_argument(
        "name", metavar="NAME|CODE", help="a word of the language, such as `cylinder`, or a code, such as E204"
    )


def run(parsed: argparse.Namespace) -> int:
    """Print the page of a constructor, a kind, a word, a unit or a code."""
    from softmark.interpreter.cli.commands.scenes import errors, show

    words, found = vocabulary_with(parsed.plugins)
    show(found)
    if errors(found):
        return 2
    text = _of_plugins(words, parsed.name) or page(parsed.name)
    if text is None:
        close = _slip(parsed.name)
        said = ABSENT.get(parsed.name.lower()) or (f"did you mean `{close}`?" if close else _meant_unit(parsed.name))
        hint = said or "`dsl list` shows what there is"
        print(visible(f"error: there is nothing called `{parsed.name}`; {hint}"), file=sys.stderr)
        return 2
    print(text)
    return 0


_SOLIDS = "bodies are elastic solids, computed as such, as springs or as beams"
_APART = "a `contact` keeps bodies apart: `between(RIGID, BODY)`, `itself(BODY)`"
ABSENT = {  # what people look for and is not here, under this name or any other
    "collision": _APART,
    "roller": "`fixed(body, where = ..., components = z)` lets a part slide",
    "viscosity": "`damping_mass` and `damping_stiffness` of `dynamic` damp a motion", "fluid": _SOLIDS,
    "shell": _SOLIDS, "plate": _SOLIDS, "membrane": _SOLIDS, "cable": _SOLIDS, "rope": _SOLIDS, "heat": _SOLIDS,
    "temperature": _SOLIDS, "diameter": "`radius` is half of it", "held": "`fixed` holds a part of a body",
    "totalmass": "`density` is mass divided by volume", "total_mass": "`density` is mass divided by volume",
}  # fmt: skip


def _slip(name: str) -> str | None:
    """The word that a slip of the finger made this of: of another word of the language, or of another, it may be far.

    Short words are all near one another, and words that begin otherwise are mostly other words.
    """
    close = nearest(name, _names())
    if close is None or len(name) < 4:
        return close if close is not None and close.lower() == name.lower() else None
    slips = distance(name.lower(), close.lower())
    alike = name[:1].lower() == close[:1].lower()
    return close if slips <= (1 if len(name) < 10 else 2) and (alike or len(name) > 6) else None


def _names() -> list[str]:
    kinds = CATALOGUE
    words = [*kinds, *(n for table in kinds.values() for n in table), *CATALOGUE.words(), *aliases.WORDS]
    return [*words, *RESERVED, *CALLS, *PLAIN]


# what is not a constructor: reserved words, functions, and names with a meaning of their own
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


def _word(name: str) -> str | None:
    """The lines of a reserved word, a function, or a name with a meaning of its own."""
    if name in RESERVED:
        return f"{name} (reserved word)\n\n{RESERVED[name]}"
    if name in CALLS:
        return f"{CALLS[name][0]} (function)\n\n{CALLS[name][1]}"
    return f"{name}\n\n{PLAIN[name]}" if name in PLAIN else None


def _meant_unit(name: str) -> str:
    """The unit that is written in another way here: `did you mean `MPa`?`."""
    try:
        units.parse(name)
    except units.UnitError as error:
        meant = re.search(r"write (`\S+`)", error.remedy)
        return f"did you mean {meant[1]}?" if meant else ""
    return ""


def _unit(name: str) -> str | None:
    """The lines of a unit or a product of units: what it measures, and its size in SI."""
    try:
        measure = units.parse(name)
    except units.UnitError:
        return None
    if name == "1":
        return None
    si = units.si(measure.dimension)
    size = f"; 1 {name} is {measure.factor:.12g} {si}".removesuffix(" 1") if name != si else ", and is a unit of SI"
    takes = units.UNITS.get(name, (1.0, units.NONE, False))[2]
    prefixes = f"\nIt takes the prefixes {' '.join(units.PREFIXES)}, as in `k{name}`." if takes else ""
    kind = units.named(measure.dimension)
    what = f"measures {kind}" if measure.dimension in units.NAMES else "measures what has no name of its own"
    what = "stands for a plain number" if measure.dimension == units.NONE else what
    return f"{name} (unit)\n\nIt {what}{size}.{prefixes}\nA unit stands right after its number, as in `5 {name}`."


def _of_plugins(words: Vocabulary, name: str) -> str | None:
    """The pages of a word that a plugin has, and of ours of that name; None of one that is ours alone."""
    found = [(c, words.owner(c.kind, c.name)) for c in words.find(name)] if words.plugins else []
    chosen = {(kind, word) for p in words.plugins for kind, word, _ in p.choices}
    if not any(owner or (c.kind, c.name) in chosen for c, owner in found):
        return None
    pages = (_constructor(c) + (f"\n\nFrom the plugin {p.name}: class {c.cls.__name__}" if p else "") for c, p in found)
    return "\n\n".join(pages)


def page(name: str) -> str | None:
    """The explanation of a name, or None."""
    if CODE.match(name):
        from softmark.interpreter.cli.codes import pages

        known = pages().get(name.upper())
        return known.text if known else None
    if found := CATALOGUE.find(name):
        return "\n\n".join(_constructor(c) for c in found)
    if name in CATALOGUE:
        rows = [CATALOGUE.constructor(name, n) for n in CATALOGUE[name]]
        lines = "\n".join(f"  {c.name:<24}{c.summary}" for c in rows if c)
        fields = _field_page(name)
        return f"{name}: declared as `{name} NAME = CONSTRUCTOR(...)`\n\n{lines}" + (f"\n\n{fields}" if fields else "")
    if word := _word(name):
        return word
    if name in CATALOGUE.words():
        return f"{name} (element)\n\n{inspect.getdoc(CATALOGUE.words()[name])}"
    if used := _field_page(name) or _choice_page(name):
        return used
    meant = aliases.WORDS.get(name) or aliases.SYNONYMS.get(name) or aliases.CHOICES.get(name)
    if name.lower() not in ABSENT and meant and not _unit(name):
        said = f"`{name}` is not a word of this language; what is meant is called `{meant}` here."
        return f"{said}\n\n{page(meant) or _field_page(meant)}"
    return _unit(name) or _of_library(name)


def _of_library(name: str) -> str | None:
    """The page of a material of the library."""
    from softmark.interpreter.cli import library

    return library.page(name)


def _field_page(name: str) -> str:
    """Where a field of this name occurs."""
    owners = [(c, f) for c in _constructors() if (f := c.field(name))]
    return "\n".join(f"field of `{c.name}`: {f.doc}{_facts(f)}" for c, f in owners)


def _choice_page(name: str) -> str:
    """Which fields have this choice."""
    owners = [(c, f) for c in _constructors() for f in c.fields if name in f.options]
    return "\n".join(f"choice for `{f.name}` of `{c.name}`: {f.doc}{_facts(f)}" for c, f in owners)


def _constructors() -> list[Constructor]:
    made = (CATALOGUE.constructor(kind, n) for kind, table in CATALOGUE.items() for n in table)
    return [c for c in made if c is not None]


def _constructor(c: Constructor) -> str:
    lines = [f"{c.name} ({c.kind})", "", inspect.getdoc(c.cls) or "", "", "Fields, in this order:"]
    width = max((len(f.name) for f in c.fields), default=0)
    lines += [f"  {f.name:<{width}}  {f.doc}{_facts(f)}" for f in c.fields]
    if not c.fields:
        lines.append("  none")
    lines += ["", f"Example: {c.kind} NAME = {_example(c)}"]
    if issubclass(c.cls, Reference):
        about = f"{c.cls.usually()}, {c.cls.means}" if c.cls.means else c.cls.usually()
        lines += ["", f"Kind: {about}", f"Source: {c.cls.source}"]
    if measured := ranges.lines(c.name):
        lines += ["", *measured]
    return "\n".join(lines)


def _facts(f: Field) -> str:
    """Dimension, range and default of a field."""
    facts = [f.expected if f.form != "quantity" or f.dimension is None else _dimension(f)]
    if f.interval is not None and f.form in ("quantity", "vector", "integer", "each"):
        facts.append(f.interval.words(f.dimension or units.NONE))
    facts += ["may vary in space"] if f.varies else []
    facts.append("required" if f.required else f"default {_default(f)}")
    return f" [{'; '.join(facts)}]"


def _dimension(f: Field) -> str:
    named = units.named(f.dimension or units.NONE)
    return f"{named}, in {units.usual(f.dimension or units.NONE)}" if f.dimension != units.NONE else named


def _default(f: Field) -> str:
    if f.form == "condition" and f.default is not None:
        return "everywhere"
    if f.default is None:
        return "the only one" if f.form == "name" and f.kind == "body" else "none"
    if f.form == "flag":
        return "yes" if f.default else "no"
    if f.form == "quantity" and f.dimension is not None:
        return units.show(f.default, f.dimension)
    if f.form == "components":
        return "(" + ", ".join("xyz"[i] for i in f.default) + ")"
    if f.form == "direction":
        axes = {"+": 1.0, "-": -1.0}.items()
        named = (sign + "xyz"[i] for sign, one in axes for i in range(3) if f.default[i] == one)
        return next(named, str(f.default))
    if f.form == "vector":
        return "(" + ", ".join(f"{v:g}" for v in f.default) + f") {units.si(f.dimension or units.NONE)}"
    return str(f.default) or "none"


_QUANTITIES = {
    units.PRESSURE: "60 kPa", units.LENGTH: "20 mm", (-3, 1, 0, 0, 0): "1070 kg/m^3", units.NONE: "0.3",
    (1, 0, -2, 0, 0): "9.81 m/s^2",
}  # fmt: skip
_VALUES = {
    "element": "tet4", "shape": "cylinder(length = 178 mm, radius = 19 mm)", "stiffness": "from_material()",
}  # fmt: skip
_FITTING = {  # of fields whose value must go with that of another, or that take some shapes alone
    "one": "box(size = (20, 20, 5) mm)", "other": "sphere(radius = 8 mm)",
    "inner": "10 mm", "first": "(0, 0, 0) mm", "second": "(48, 44, 0) mm", "third": "(48, 60, 0) mm",
    "limit": "30", "alpha": "[1.3, 5]",
    "fourth": "(0, 44, 0) mm", "region": "quarter_ring(inner = 10 mm, outer = 20 mm)", "thickness": "1 mm",
    "outer_along": "30 mm", "rim": "5 mm", "rounding": "2 mm", "uncertainty": "0.05 mm", "sheets": "+y",
}  # fmt: skip
_FILES = {"filled": '"file.stl"', "markers": '"file.csv"', "table": '"file.csv"', "ct_volume": '"file.nrrd"'}
_CHOSEN = {  # fields that may be left out, but mostly are needed, one or another of them
    "arc": ("side",), "curve_error": ("over",), "network": ("radius",),
    "fung_orthotropic": ("sheets",), "holzapfel_gasser_ogden": ("sheets",), "holzapfel_ogden": ("sheets",),
}  # fmt: skip
_SAMPLES = {
    "integer": "20", "flag": "yes", "text": '"text"', "file": '"file.vtu"', "files": '"file.csv"',
    "texts": '"force"', "amount": "1 mm", "amounts": "53.4 mm", "direction": "-z", "condition": "x <= 0 mm",
    "components": "(x, y)", "names": "[NAME_OF_MODEL, NAME_OF_MODEL]", "list": "[10, 5, 2.5] mm",
    "points": "[(5, 0), (20, 0), (20, 10)] mm", "target": "NAME_OF_PARAMETER", "targets": "[NAME_OF_PARAMETER]",
    "variants": "[10, 5, 2.5] mm", "vectors": "[(0, 0, 0), (0, 0, 1), (1, 0, 1)] m", "pairs": "[(1, 2), (2, 3)]",
    "each": "20 mm", "fibres": "+x",
}  # fmt: skip
_LISTS = {units.NONE: "[0.3, 0.2]", units.LENGTH: _SAMPLES["list"]}  # of what has a dimension


def _example(c: Constructor) -> str:
    chosen = (*_CHOSEN.get(c.name, ()), *(names[0] for names in getattr(c.cls, "either", ())))
    given = [f for f in c.fields if f.required or f.name in chosen]
    files = {f.name: _FILES[c.name] for f in given if f.form == "file" and c.name in _FILES}
    arguments = [f"{f.name} = {files.get(f.name) or _sample(f)}" for f in given]
    return f"{c.name}({', '.join(arguments)})"


def _sample(f: Field) -> str:
    if f.name in _FITTING:
        return _FITTING[f.name]
    if f.name == "over" and f.kind == "metric":
        return "NAME_OF_ANOTHER_METRIC"
    if f.form == "quantity":
        dimension = f.dimension or units.NONE
        return _QUANTITIES.get(dimension, f"1 {units.si(dimension)}")
    if f.form == "each" and f.dimension == units.PRESSURE:
        return "[60, 2] kPa"
    if f.form == "list" and f.dimension is not None:
        return _LISTS.get(f.dimension, f"[1, 10] {units.si(f.dimension)}")
    if f.form == "vector":
        return f"(1, 1, 1) {units.of_vector(f.dimension or units.NONE)}"
    if f.form == "choice":
        return f.options[0]
    if f.form == "value":
        return _VALUES.get(f.kind, f"NAME_OF_{f.kind.upper()}")
    return _SAMPLES.get(f.form, f"NAME_OF_{f.kind.upper()}")
