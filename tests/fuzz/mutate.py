"""Changes that know the shape of a scene: tokens, declarations, numbers, brackets, letters that look like others."""

from __future__ import annotations

import random
import re
from collections.abc import Callable
from functools import cache

TOKEN = re.compile(
    r'"(?:[^"\\\r\n]|\\.)*"|#[^\r\n]*|[0-9]+(?:\.(?!\.)[0-9]*)?(?:[eE][+-]?[0-9]+)?|\.[0-9]+|[^\W\d][\w.]*'
    r"|[<>=!]=|\.\.|[ \t]+|\r\n|[\r\n]|[\s\S]"
)
DIGITS = "0123456789"
NUMBERS = [
    "0",
    "1",
    "-1",
    "2",
    "3",
    "1e400",
    "1e-400",
    "1e308",
    "1.8e308",
    "5e-324",
    "1e-320",
    "-0",
    "0.5",
    "0.49999999999999994",
    "1e16",
    "9007199254740993",
    "2^1024",
    "2^99",
    "10^-400",
    "1e5",
    "1e9",
    "0.1e-3",
    "99999999999999999999999999",
    "1e",
    "1.",
    ".5",
    "007",
    "0x10",
    "1_000",
    "3.5e+7",
]
ODD = [
    "\u202e",
    "\u200b",
    "\u2066",
    "\ufeff",
    "\0",
    "\x1b[31m",
    "é",
    "ｘ",
    "µ",
    "μ",
    "°",
    "·",
    "²",
    "\u2028",
    "\x85",
    "\x0c",
    "\x0b",
    "\u0301",
    "😀",
    "\ud7ff",
    "\U0010ffff",
    "¼",
    "٣",
    "“",
    "’",
    "−",
    "–",
    "\t",
    "\r",
    "\\",
]
FILES = [
    "std/materials/silicones.scene",
    "parts/tissues.scene",
    "parts/circle-a.scene",
    "parts/broken.scene",
    "parts/binary.scene",
    "fuzz.scene",
    "loop.scene",
    "pipe.scene",
    "zero.scene",
    "folder.scene",
    "/dev/zero",
    "../../../etc/passwd",
    "std/../x.scene",
    "parts/tetrahedron.msh",
    "parts/bar.obj",
    "data:silicone",
    "x.nrrd",
]
UNITS = [
    "mm",
    "m",
    "kPa",
    "Pa",
    "kg/m^3",
    "m/s^2",
    "%",
    "s",
    "ms",
    "N",
    "rad",
    "deg",
    "°C",
    "1/s",
    "N/m",
    "J/(kg*K)",
    "mm^99",
    "m^-1",
    "m^9999999999",
    "m^0.5",
    "km",
    "Ym",
    "ym^90",
    "Gs^99",
]


@cache
def vocabulary() -> tuple[str, ...]:
    """Kinds, constructors, fields, choices, functions and signs."""
    from softmark.interpreter.language import expression_evaluation
    from softmark.interpreter.validation.constructor_registry import CATALOGUE

    words: dict[str, None] = dict.fromkeys(
        ("param", "use", "as", "expect", "scene", "softmark", "in", "and", "or", "not")
    )
    for kind, constructors in CATALOGUE.items():
        words[kind] = None
        for name in constructors:
            words[name] = None
            known = CATALOGUE.constructor(kind, name)
            words |= dict.fromkeys(w for f in (known.fields if known else ()) for w in (f.name, *f.options))
    words |= dict.fromkeys(expression_evaluation.PREDEFINED)
    words |= dict.fromkeys(
        [
            "(",
            ")",
            "[",
            "]",
            "{",
            "}",
            ",",
            ";",
            "=",
            "==",
            "!=",
            "<",
            "<=",
            ">",
            ">=",
            "+",
            "-",
            "*",
            "/",
            "^",
            "..",
            ".",
            ":",
            "#",
            '"',
            "'",
            "\n",
            "yes",
            "no",
            "none",
            "true",
        ]
    )
    return tuple(words)


def dictionary() -> list[str]:
    """Everything that may be put in place of a token."""
    return [*vocabulary(), *NUMBERS, *UNITS, *(f'"{name}"' for name in FILES)]


Tokens = list[str]
Change = Callable[[Tokens, random.Random, list[str]], Tokens]


def _solid(tokens: Tokens, chance: random.Random) -> int:
    """A token that is not a blank, if there is one."""
    places = [i for i, t in enumerate(tokens) if t.strip()]
    return chance.choice(places) if places else 0


def _swap(tokens: Tokens, chance: random.Random, others: list[str]) -> Tokens:
    i, j = _solid(tokens, chance), _solid(tokens, chance)
    tokens[i], tokens[j] = tokens[j], tokens[i]
    return tokens


def _delete(tokens: Tokens, chance: random.Random, others: list[str]) -> Tokens:
    del tokens[_solid(tokens, chance)]
    return tokens


def _repeat(tokens: Tokens, chance: random.Random, others: list[str]) -> Tokens:
    i = _solid(tokens, chance)
    j = min(len(tokens), i + chance.choice([1, 1, 2, 3, 5, 8]))
    return tokens[:i] + tokens[i:j] * chance.choice([2, 2, 2, 3, 10, 300]) + tokens[j:]


def _word(tokens: Tokens, chance: random.Random, others: list[str]) -> Tokens:
    tokens[_solid(tokens, chance)] = chance.choice(dictionary())
    return tokens


def _insert(tokens: Tokens, chance: random.Random, others: list[str]) -> Tokens:
    tokens.insert(
        _solid(tokens, chance),
        chance.choice(["", " "]) + chance.choice(dictionary()) + chance.choice(["", " "]),
    )
    return tokens


def _number(tokens: Tokens, chance: random.Random, others: list[str]) -> Tokens:
    places = [i for i, t in enumerate(tokens) if t[0] in DIGITS or t[0] == "."]
    if places:
        i = chance.choice(places)
        kinds = [
            chance.choice(NUMBERS),
            tokens[i] + "0" * chance.choice([1, 3, 9, 400]),
            tokens[i] + "e" + str(chance.randint(-330, 330)),
            str(-chance.randint(0, 9)),
            f"({tokens[i]}" + "^2" * chance.choice([1, 5, 50]) + ")",
            "1/0",
        ]
        tokens[i] = chance.choice(kinds)
    return tokens


def _unit(tokens: Tokens, chance: random.Random, others: list[str]) -> Tokens:
    places = [i for i, t in enumerate(tokens) if t[0] in DIGITS]
    if places:
        tokens.insert(
            chance.choice(places) + 1,
            " " + chance.choice(UNITS) + chance.choice(["", "", "^2", "/s", "*m", "^-99"]),
        )
    return tokens


def _odd(tokens: Tokens, chance: random.Random, others: list[str]) -> Tokens:
    i = _solid(tokens, chance)
    at = chance.randint(0, len(tokens[i]))
    tokens[i] = tokens[i][:at] + chance.choice(ODD) + tokens[i][at:]
    return tokens


def _name(tokens: Tokens, chance: random.Random, others: list[str]) -> Tokens:
    """One name for another of the text: circles, wrong kinds, twice the same."""
    places = [i for i, t in enumerate(tokens) if t[0].isalpha()]
    if len(places) > 1:
        i, j = chance.sample(places, 2)
        tokens[i] = tokens[j]
    return tokens


def _nest(tokens: Tokens, chance: random.Random, others: list[str]) -> Tokens:
    i = _solid(tokens, chance)
    left, right = chance.choice(
        [
            ("(", ")"),
            ("[", "]"),
            ("-", ""),
            ("sqrt(", ")"),
            ("not ", ""),
            ("(1, ", ")"),
            ("", "^2"),
            ("2^", ""),
        ]
    )
    depth = chance.choice([1, 1, 2, 5, 60, 99, 150, 1000])
    tokens[i] = left * depth + tokens[i] + right * depth
    return tokens


def _lines(text: str) -> list[str]:
    """Declarations, roughly: a line, and the lines after it that are indented or close a bracket."""
    return re.split(r"(?m)^(?=[A-Za-z#])", text)


def _splice(tokens: Tokens, chance: random.Random, others: list[str]) -> Tokens:
    own, other = _lines("".join(tokens)), _lines(chance.choice(others))
    for _ in range(chance.choice([1, 1, 2, 4])):
        own.insert(chance.randint(0, len(own)), _renamed(chance.choice(other), chance))
    return ["".join(own)]


def _renamed(declaration: str, chance: random.Random) -> str:
    """A declaration, mostly under a name that is not taken."""
    new = f"n{chance.randrange(1000)}"
    return (
        re.sub(r"\A([a-z]+) +[A-Za-z_]\w*(?= *=)", rf"\1 {new}", declaration) if chance.random() < 0.8 else declaration
    )


def _move(tokens: Tokens, chance: random.Random, others: list[str]) -> Tokens:
    own = _lines("".join(tokens))
    moved = own.pop(chance.randrange(len(own)))
    if chance.random() < 0.6:
        own.insert(chance.randint(0, len(own)), moved)
    return ["".join(own)]


def _ends(tokens: Tokens, chance: random.Random, others: list[str]) -> Tokens:
    end = chance.choice(["\r\n", "\r", "\n\n", "", " "])
    few = chance.random() < 0.5
    return [end if t == "\n" and (not few or chance.random() < 0.2) else t for t in tokens]


def _argument(tokens: Tokens, chance: random.Random, others: list[str]) -> Tokens:
    """A field of another scene among the arguments of some call."""
    fields = re.findall(r"\b[a-z_]+ = [^,()\n]+", chance.choice(others))
    places = [i for i, t in enumerate(tokens) if t in "(,"]
    if fields and places:
        tokens.insert(chance.choice(places) + 1, chance.choice(fields) + ", ")
    return tokens


def _tweak(tokens: Tokens, chance: random.Random, others: list[str]) -> Tokens:
    """A number somewhat larger or smaller, which often leaves a scene sound."""
    places = [i for i, t in enumerate(tokens) if t[0] in DIGITS]
    for i in chance.sample(places, min(len(places), chance.choice([1, 1, 2, 5]))):
        factor = chance.choice([0.01, 0.5, 0.999, 1.001, 2, 10, 1000])
        tokens[i] = f"{float(tokens[i]) * factor:.12g}" if chance.random() < 0.8 else f"({tokens[i]} * {factor})"
    return tokens


def _option(tokens: Tokens, chance: random.Random, others: list[str]) -> Tokens:
    """Another choice of a field, another constructor of a kind."""
    groups = families()
    places = [i for i, t in enumerate(tokens) if t in groups]
    if places:
        i = chance.choice(places)
        tokens[i] = chance.choice(chance.choice(groups[tokens[i]]))
    return tokens


@cache
def families() -> dict[str, list[tuple[str, ...]]]:
    """Words that may stand in one another's place, by word."""

    from softmark.interpreter.validation.constructor_registry import CATALOGUE

    groups = [tuple(constructors) for constructors in CATALOGUE.values()] + [
        tuple(CATALOGUE.words()),
        ("yes", "no"),
    ]
    for kind, constructors in CATALOGUE.items():
        known = [c for name in constructors if (c := CATALOGUE.constructor(kind, name)) is not None]
        groups += [field.options for c in known for field in c.fields if field.options]
        groups += [tuple(field.name for field in c.fields) for c in known if c.fields]
    found: dict[str, list[tuple[str, ...]]] = {}
    for group in groups:
        for word in group:
            found.setdefault(word, []).append(group)
    return found


def _course(tokens: Tokens, chance: random.Random, others: list[str]) -> Tokens:
    text = chance.choice(
        [
            "param p{i} = p{j}\n",
            "param p{i} = 2*p{j} + 1\n",
            "material m{i} = m{j}\n",
            "param p{i} = p{j}^p{j}\n",
        ]
    )
    count = chance.choice([2, 3, 20, 200])
    rows = [text.format(i=i, j=i + 1) for i in range(count)]
    last = (
        text.partition(" ")[0] + f" p{count} = " + chance.choice(["1", "2 mm", "neo_hookean(1 kPa, 0.4)", "p0"]) + "\n"
    )
    return [*tokens, "\n", *(rows if chance.random() < 0.5 else rows[::-1]), last]


CHANGES: tuple[Change, ...] = (
    _swap,
    _delete,
    _repeat,
    _word,
    _word,
    _insert,
    _insert,
    _number,
    _number,
    _unit,
    _odd,
    _name,
    _name,
    _nest,
    _splice,
    _splice,
    _move,
    _ends,
    _argument,
    _argument,
    _course,
    _tweak,
    _tweak,
    _tweak,
    _option,
    _option,
    _option,
    _splice,
    _move,
)


def changed(text: str, chance: random.Random, others: list[str], times: int | None = None) -> str:
    """A text after one or a few changes; `others` are texts that parts may come from."""
    for _ in range(times or chance.choice([1, 1, 1, 1, 1, 2, 2, 3, 6])):
        tokens = TOKEN.findall(text) or ["\n"]
        text = "".join(chance.choice(CHANGES)(tokens, chance, others))
        if len(text) > 100_000:
            break
    return text
