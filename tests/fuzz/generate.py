"""Scenes made from the vocabulary: declarations of every kind, whose fields hold what their forms ask for, or nearly.

`scene(pick)` asks `pick` for every choice: `random.Random(1).choice`, or what hypothesis draws and can make smaller.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

from softmark.interpreter.language import units
from softmark.interpreter.language.field_schema import Field
from softmark.interpreter.validation.constructor_registry import CATALOGUE

Pick = Callable[[Sequence[Any]], Any]
NUMBERS = (
    "1",
    "2",
    "0.3",
    "10",
    "0",
    "0.45",
    "-1",
    "1e-3",
    "1e6",
    "0.5",
    "1e300",
    "5e-324",
    "3.0",
    "100000",
    "99999999999",
)
CONDITIONS = (
    "x <= 0 mm",
    "x >= 100 mm",
    "not x > 0 mm",
    "z > 1 mm and y < 2 mm",
    "x^2 + y^2 <= (10 mm)^2",
    "abs(z) < p0 * 1 mm",
    "sqrt(x^2) == 0 mm",
    "0 mm < x < 50 mm",
    "x < 1",
    "x^9 < 1 m^9",
    "x/0 < 1",
    "y/x > 1 or z/(x - x) < 0",
)
DIRECTIONS = (
    "x",
    "-z",
    "+y",
    "(0, 0, -1)",
    "(1, 1, 0)",
    "(0, 0, 0)",
    "(1e200, 1e200, 0)",
    "down",
    "p0 * (1, 0, 0)",
)
FILES = (
    '"parts/tetrahedron.msh"',
    '"parts/bar.obj"',
    '"parts/beads.csv"',
    '"parts/bar.nrrd"',
    '"nowhere.msh"',
    '"data:truth-cube"',
    '""',
)
ORDER = (
    "shape",
    "material",
    "body",
    "region",
    "support",
    "load",
    "contact",
    "analysis",
    "amplitude",
    "stiffness",
    "model",
    "reference",
    "probe",
    "metric",
    "published",
    "study",
)
USUAL = {  # by name and form, in scenes with nothing amiss
    ("young", "quantity"): ("60 kPa", "1 MPa"),
    ("density", "quantity"): ("1000 kg/m^3", "1070 kg/m^3"),
    ("length", "quantity"): ("100 mm",),
    ("radius", "quantity"): ("10 mm",),
    ("radius", "each"): ("10 mm",),
    ("inner", "quantity"): ("5 mm",),
    ("inner", "each"): ("5 mm",),
    ("outer", "quantity"): ("100 mm",),
    ("thickness", "quantity"): ("10 mm",),
    ("size", "quantity"): ("10 mm",),
    ("points", "vectors"): ("[(0, 0, 0), (100, 0, 0)] mm",),
    ("from", "vector"): ("(0, 5, 0) mm",),
    ("to", "vector"): ("(100, 5, 0) mm",),
    ("first", "vector"): ("(0, 0, 0) mm",),
    ("second", "vector"): ("(100, 0, 0) mm",),
    ("third", "vector"): ("(100, 20, 0) mm",),
    ("fourth", "vector"): ("(0, 20, 0) mm",),
}
PLACES = ("(100, 0, 0) mm", "(50, 0, 0) mm", "(0, 0, 0) mm")  # on the axis of a cylinder
ALONE = (  # words that go with their own kind of body alone
    "network", "frame6dof", "pinned", "group", "tendon", "rucker_webster", "frame_theory", "kirsch", "plane_strain",
    "plane_stress", "axisymmetric", "quarter_ring", "quadrilateral", "quad4", "quad8", "quad9", "tri3", "tri6",
)  # fmt: skip
Words = dict[str, tuple[str, ...]]
FLAT: Words = {
    "shape": ("quarter_ring", "quadrilateral"), "element": ("quad8", "quad4", "quad9", "tri6", "tri3"),
    "model": ("fem",), "region": ("part",), "support": ("fixed", "displaced"),
    "load": ("gravity", "pressure", "traction"), "probe": ("point", "line"),
}  # fmt: skip
IN_PLANE: Words = {
    "direction": ("-y",), "components": ("y", "(x, y)"), "at": ("(50, 1, 0) mm",),
    "from": ("(20, 1, 0) mm",), "to": ("(50, 1, 0) mm",),
    "young": ("60 kPa", 'field("parts/stiffness.vtu", unit = 1 kPa, length = 1 mm)', "50 kPa + x * 1 kPa/mm"),
}  # fmt: skip
WORLDS: tuple[tuple[Words, Words], ...] = (  # words of kinds that go with one another, and values of names and forms
    ({}, {}),
    ({"shape": ("cylinder", "box", "tube"), "body": ("solid",), "model": ("beam6dof",), "support": ("fixed",),
      "load": ("tendon", "gravity"), "reference": ("rucker_webster",), "region": ()}, {}),
    ({"shape": (), "body": ("network",), "model": ("frame6dof",), "support": ("fixed", "pinned"), "region": (),
      "load": ("gravity", "point_force"), "reference": ("frame_theory",), "probe": ("point",)}, {}),
    (FLAT | {"body": ("plane_strain", "plane_stress"), "reference": ("kirsch",)}, IN_PLANE),
    (FLAT | {"body": ("axisymmetric",), "reference": ()}, IN_PLANE | {"condition": ("y <= 0 mm",)}),
)  # fmt: skip
FUSSY = (
    "region",
    "contact",
    "reference",
    "published",
    "study",
    "metric",
    "amplitude",
)  # that seldom fit what else there is
WANTED = ("density", "size", "segments", "radius", "direction")  # fields that are not required, and mostly needed
LIKELY = {
    "shape": "cylinder",
    "body": "solid",
    "region": "part",
    "analysis": "static",
    "support": "fixed",
    "load": "gravity",
    "probe": "point",
    "model": "beam6dof",
    "metric": "displacement",
}


@dataclass
class Maker:
    """Makes one scene; `names` are those declared so far, by kind."""

    pick: Pick
    names: dict[str, list[str]] = field(default_factory=dict)
    world: Words = field(default_factory=dict)
    values: Words = field(default_factory=dict)
    wrong: bool = False  # whether something may be amiss: in half of the scenes, in one value of twelve

    def scene(self) -> str:
        """Parameters, declarations of most kinds, and expectations."""
        self.wrong = self.pick((False, True))
        self.world, self.values = self.pick((*[WORLDS[0]] * 4, *WORLDS[1:]))
        rows = ["param p0 = 2", f"param p1 = {self.number()} * 1 {self.pick(('mm', 'kPa', 's', 'kg/m^3'))}"]
        for kind in ORDER:
            few = 1 if kind in ("body", "material", "analysis") else self.pick((1, 1, 1, 2, 0))
            few = self.pick((0, 1)) if kind in FUSSY and not self.wrong else few
            if not self.known(kind):
                continue
            for i in range(few if kind != "analysis" or self.wrong else self.pick((0, 0, 0, 1))):
                rows.append(self.declaration(kind, f"{kind}{i}"))
        rows += [self.expectation() for _ in range(self.pick((0, 1, 2)))]
        if self.wrong and self.pick((True, False)):
            i, j = self.pick(range(len(rows))), self.pick(range(len(rows)))
            rows[i], rows[j] = rows[j], rows[i]
        return "\n".join(rows) + "\n"

    def odd(self) -> bool:
        """Whether the next value is amiss."""
        return self.wrong and self.pick((False,) * 11 + (True,))

    def declaration(self, kind: str, name: str) -> str:
        """`kind name = constructor(...)`, or another name for one that is there."""
        there = self.names.setdefault(kind, [])
        value = self.pick(there) if there and self.pick((False,) * 5 + (True,)) else self.call(kind)
        there.append(name)
        return f"{kind} {name} = {value}"

    def call(self, kind: str, depth: int = 0) -> str:
        """A constructor of a kind with all fields that it needs, and some that it does not."""
        known = self.known(kind) or list(CATALOGUE[kind])
        likely = known[0] if kind in self.world else LIKELY.get(kind)
        name = self.pick((*[likely] * len(known), *known)) if likely else self.pick(known)
        constructor = CATALOGUE.constructor(kind, name)
        fields = constructor.fields if constructor else ()
        fields = tuple(f for f in fields if f.required or self.wrong or self.given(f))
        often = (False, False, True) if self.wrong else (False,) * 12 + (True,)
        given = [f for f in fields if (f.required and not self.odd()) or (not f.required and self.pick(often))]
        given += [f for f in fields if not f.required and f.name in WANTED and f not in given]
        return f"{name}({', '.join(f'{f.name} = {self.value(f, depth)}' for f in given)})"

    def known(self, kind: str) -> list[str]:
        """The words of a kind that may stand here: those that fit, where nothing is amiss."""
        known = list(self.world.get(kind, CATALOGUE[kind]))
        return known if self.wrong else [name for name in known if self.possible(kind, name)]

    def possible(self, kind: str, name: str) -> bool:
        """Whether it goes with the others, and everything that a constructor needs is declared."""
        if name in ALONE and kind not in self.world:
            return False
        constructor = CATALOGUE.constructor(kind, name)
        needed = [f for f in constructor.fields if f.required] if constructor else []
        return all(self.given(f) and f.form != "file" for f in needed)

    def given(self, asked: Field) -> bool:
        """Whether there is what a field names."""
        return asked.form not in ("name", "names") or bool(self._there(asked))

    def _there(self, asked: Field) -> list[str]:
        return [name for kind in (asked.kind, *asked.also) for name in self.names.get(kind, ())]

    def value(self, asked: Field, depth: int) -> str:
        """What a form asks for."""
        if self.odd():
            return str(
                self.pick(
                    (
                        "0",
                        "1/0",
                        '"a"',
                        "yes",
                        "[]",
                        "[1, 2] mm",
                        "(1, 2)",
                        "x <= 0 mm",
                        "-1 m^3",
                        "nothing",
                        "f(x)",
                        "p1",
                    )
                )
            )
        usual = self.values.get(asked.name) or self.values.get(asked.form) or USUAL.get((asked.name, asked.form))
        if usual and not self.wrong:
            return str(self.pick(usual))
        return str(getattr(self, f"_{asked.form}")(asked, depth))

    def number(self) -> str:
        """A number, perhaps of some arithmetic."""
        one = self.pick(NUMBERS if self.wrong else NUMBERS[:4])
        return str(
            self.pick((one, one, one, f"({one} + p0)", f"sqrt({one})", f"p0^{one}", f"{one} * p0", f"max({one}, 1)"))
        )

    def unit(self, asked: Field) -> str:
        """A unit of the dimension of a field."""
        text = units.si_unit(asked.dimension or units.NONE)
        return "" if text == "1" else f" {text}"

    def _quantity(self, asked: Field, depth: int) -> str:
        interval = asked.interval
        inside = [n for n in NUMBERS if interval is None or float(n) in interval] or ["1"]
        number = self.pick(inside if self.wrong else inside[:4])
        return f"{number}{self.unit(asked)}"

    def _vector(self, asked: Field, depth: int) -> str:
        if not self.wrong:
            if asked.dimension != units.LENGTH:
                return f"(0, -1, 0){self.unit(asked)}"
            return str(self.pick(PLACES)) if asked.interval is None else "(100, 20, 20) mm"
        parts = [self.pick(("0", "0", "1", "0.1", "0.05", "-1")) for _ in range(3)]
        return f"({', '.join(parts)}){self.unit(asked)}"

    def _integer(self, asked: Field, depth: int) -> str:
        inside = [
            n for n in ("2", "3", "10", "20", "100", "1", "0") if asked.interval is None or float(n) in asked.interval
        ]
        return str(self.pick((*inside, "0", "2.5", "1e9", "-1") if self.wrong else inside or ("1",)))

    def _flag(self, asked: Field, depth: int) -> str:
        return str(self.pick(("yes", "no")))

    def _choice(self, asked: Field, depth: int) -> str:
        return str(self.pick(asked.options))

    def _text(self, asked: Field, depth: int) -> str:
        return str(self.pick(('"text"', '""', '"ü\u202e"')))

    def _file(self, asked: Field, depth: int) -> str:
        return str(self.pick(FILES))

    def _files(self, asked: Field, depth: int) -> str:
        return self._several(self._file, asked, depth)

    def _texts(self, asked: Field, depth: int) -> str:
        return self._several(self._text, asked, depth)

    def _several(self, one: Callable[[Field, int], str], asked: Field, depth: int) -> str:
        if self.pick((True, False)):
            return one(asked, depth)
        return f"[{one(asked, depth)}, {one(asked, depth)}]"

    def _amount(self, asked: Field, depth: int) -> str:
        return self.number() + str(self.pick(("", " mm", " N", " %", " kPa", " s")))

    def _amounts(self, asked: Field, depth: int) -> str:
        return self._amount(asked, depth) if self.pick((True, False)) else f"[1, {self.number()}] mm"

    def _direction(self, asked: Field, depth: int) -> str:
        return str(self.pick(DIRECTIONS if self.wrong else DIRECTIONS[:5]))

    def _fibres(self, asked: Field, depth: int) -> str:
        if depth < 3 and self.pick((False, True)):
            return self.call("fibres", depth + 1)
        return str(self.pick(("+x", "(1, 1, 0)", "(-y, x, 0 mm)")))

    def _condition(self, asked: Field, depth: int) -> str:
        return str(self.pick(CONDITIONS if self.wrong else CONDITIONS[:1]))

    def _components(self, asked: Field, depth: int) -> str:
        return str(self.pick(("x", "(x, y)", "z", "(z, z)", "()", "[x]") if self.wrong else ("x", "(x, y)")))

    def _name(self, asked: Field, depth: int) -> str:
        there = self._there(asked)
        return str(self.pick(there)) if there else f"{asked.kind}0"

    def _names(self, asked: Field, depth: int) -> str:
        count = self.pick((1, 2, 0, 3)) if self.wrong else 1
        return f"[{', '.join(self._name(asked, depth) for _ in range(count))}]"

    def _list(self, asked: Field, depth: int) -> str:
        return f"[{', '.join(self.number() for _ in range(self.pick((1, 2, 0)) if self.wrong else 1))}]"

    def _value(self, asked: Field, depth: int) -> str:
        if asked.kind == "element":
            words = [word for word in CATALOGUE.words() if self.wrong or word not in ALONE]
            return str(self.pick(self.world.get("element", words)))
        there = self.names.get(asked.kind, [])
        if there and self.pick((True, True, False)):
            return str(self.pick(there))
        return self.call(asked.kind, depth + 1) if depth < 3 else f"{asked.kind}0"

    def _target(self, asked: Field, depth: int) -> str:
        if not self.wrong:
            return "material0.young" if asked.form == "target" else "material0.density"
        return str(
            self.pick(
                (
                    "p0",
                    "p1",
                    "material0.young",
                    "model0.size",
                    "model0.segments",
                    "load0.magnitude",
                    "body0",
                    "x",
                )
            )
        )

    def _targets(self, asked: Field, depth: int) -> str:
        return f"[{', '.join(self._target(asked, depth) for _ in range(self.pick((1, 2, 0)) if self.wrong else 1))}]"

    def _variants(self, asked: Field, depth: int) -> str:
        if not self.wrong:
            return "[60, 30, 20] kPa"
        items = ", ".join(self.number() for _ in range(self.pick((1, 2, 3, 0))))
        return f"[{items}]{self.pick(('', ' mm', ' kPa', ' s'))}"

    def _vectors(self, asked: Field, depth: int) -> str:
        count = self.pick((2, 3, 1, 0)) if self.wrong else 2
        return f"[{', '.join(self._vector(asked, depth) for _ in range(count))}]"

    def _points(self, asked: Field, depth: int) -> str:
        return str(self.pick(("[(5, 0), (20, 0), (20, 10)] mm", "[(5, 0)] mm", "[]", "(5, 0) mm")) if self.wrong
                   else "[(5, 0), (20, 0), (20, 10)] mm")  # fmt: skip

    def _pairs(self, asked: Field, depth: int) -> str:
        return str(
            self.pick(("[(1, 2)]", "[(2, 1)]", "[(1, 1)]", "[(0, 3)]", "[]", "[1]")) if self.wrong else "[(1, 2)]"
        )

    def _each(self, asked: Field, depth: int) -> str:
        one = self._quantity(asked, depth)
        return self.pick((one, f"[{one}]", f"[{one}, {one}]", "[]")) if self.wrong else one

    def expectation(self) -> str:
        """A condition on a metric, or on none."""
        owner = self.pick(("model0", "reference0", "model1", "body0", "p0"))
        if not self.wrong:
            owners = [*self.names.get("model", ()), *self.names.get("reference", ())]
            if not owners or not self.names.get("metric") or self.pick((True, False)):
                return "expect p0 > 1"
            owner = self.pick(self.names.get("model") or owners)
            return f"expect abs({owner}.metric0) >= 0 * abs({owner}.metric0)"
        left = self.pick((f"{owner}.metric0", f"{owner}.metric0", "p0", "p1", f"abs({owner}.metric0 - p0)"))
        right = self.pick(("5 %", "1 mm", "p1", "0", "1e308 * 10", f"{owner}.metric1"))
        return f"expect {self.pick(('', '', 'not '))}{left} {self.pick(('<', '>=', '==', '!='))} {right}"


def scene(pick: Pick) -> str:
    """A scene of choices that `pick` makes."""
    return Maker(pick).scene()
