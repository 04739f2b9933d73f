"""Binding the arguments of a call to the fields of a constructor, each checked by its form."""

from __future__ import annotations

import math
import os
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from softmark.grammar import tree
from softmark.grammar.suggest import nearest
from softmark.interpreter import schema, units
from softmark.interpreter.expressions import Bad, Place, Quantity, VectorValue, describe
from softmark.interpreter.modules import Module
from softmark.interpreter.scene import Location
from softmark.interpreter.schema import Constructor, Field

if TYPE_CHECKING:
    from softmark.interpreter.compile import Override, _Compiler

Bound = tuple[tree.Expression, Place]  # an expression, and the text that it stands in


@dataclass(frozen=True)
class Binder:
    """Binds calls of one declaration; `full` is its name, by which overrides find its fields."""

    compiler: _Compiler
    module: Module
    full: str

    @property
    def place(self) -> Place:
        """The module's text."""
        return self.module.place

    def call(self, kind: str, node: tree.Call, outermost: bool = True) -> tuple[Constructor, Any, dict[str, Location]]:
        """The constructor, the object that the call makes, and where its fields stand. Raises Bad."""
        constructor = self._constructor(kind, node)
        bound, broken = self._match(constructor, node, outermost)
        values: dict[str, Any] = {}
        for field in constructor.fields:
            if field.name not in bound:
                continue
            try:
                values[field.attribute] = self._value(field, *bound[field.name])
            except Bad:
                broken = True
        broken |= self._missing(constructor, bound, node)
        if broken:
            raise Bad
        places = {name: Location(place.source, value.span) for name, (value, place) in bound.items()}
        return constructor, constructor.cls(**values), places

    def _constructor(self, kind: str, node: tree.Call) -> Constructor:
        name = node.function.text
        found = schema.constructor(kind, name)
        if found is not None:
            return found
        known = list(schema.tables()[kind])
        others = schema.find(name)
        meant = schema.WORDS.get(name)
        close = meant if meant in known else nearest(name, known)
        if others:
            other = others[0].kind
            message = f"`{name}` is {schema.article(other)} {other}, not {schema.article(kind)} {kind}"
            hint = f"declare it as `{other} NAME = {name}(...)`; {kind} constructors: {', '.join(known)}"
        else:
            message = f"there is no {kind} `{name}`"
            hint = f"did you mean `{close}`?" if close else f"{kind} constructors: {', '.join(known)}"
        raise self.place.fail("E203", node.function.span, message, f"not {schema.article(kind)} {kind}", hint)

    # ------------------------------------------------------------------ arguments to fields

    def _match(self, constructor: Constructor, node: tree.Call, outermost: bool) -> tuple[dict[str, Bound], bool]:
        bound: dict[str, Bound] = {}
        broken = False
        for position, argument in enumerate(node.arguments):
            field = self._field(constructor, argument, position)
            if field is None:
                broken = True
            elif field.name in bound:
                self.place.fail("E211", argument.span, f"`{field.name}` is given twice", "the second value", "keep one of them")
                broken = True
            else:
                bound[field.name] = (argument.value, self.place)
        if outermost:
            broken |= self._override(constructor, bound)
        return bound, broken

    def _override(self, constructor: Constructor, bound: dict[str, Bound]) -> bool:
        broken = False
        for override in self.compiler.overrides:
            owner, _, attribute = override.name.rpartition(".")
            if owner != self.full or self.compiler.override(override.name) is not override:
                continue
            if constructor.field(attribute) is None:
                self._unknown_field(constructor, attribute, override)
                broken = True
            else:
                bound[attribute] = (override.node, override.place)
        return broken

    def _unknown_field(self, constructor: Constructor, attribute: str, override: Override) -> None:
        hint = self._field_hint(constructor, attribute)
        message = f"`{constructor.name}` has no field `{attribute}`"
        override.place.fail("E205", override.name_span, message, "not a field", hint)

    def _field(self, constructor: Constructor, argument: tree.Argument, position: int) -> Field | None:
        if argument.name is None:
            if position < len(constructor.fields):
                return constructor.fields[position]
            count = len(constructor.fields)
            fields = f"{count} field" + ("s" if count != 1 else "")
            self.place.fail("E211", argument.span, f"`{constructor.name}` has {fields}, this is one more", "too many",
                            self._listing(constructor))  # fmt: skip
            return None
        field = constructor.field(argument.name)
        if field is None:
            span = argument.name_span or argument.span
            self.place.fail("E205", span, f"`{constructor.name}` has no field `{argument.name}`", "not a field",
                            self._field_hint(constructor, argument.name))  # fmt: skip
        return field

    def _field_hint(self, constructor: Constructor, name: str) -> str:
        names = [f.name for f in constructor.fields]
        meant = schema.SYNONYMS.get(name) or schema.SYNONYMS.get(name.lower())
        if meant in names:
            field = constructor.field(meant or "")
            return f"the field is called `{meant}`: {field.doc if field else ''}"
        close = nearest(name, names)
        return f"did you mean `{close}`?" if close else self._listing(constructor)

    @staticmethod
    def _listing(constructor: Constructor) -> str:
        if not constructor.fields:
            return f"`{constructor.name}` has no fields"
        return f"fields of `{constructor.name}`: " + ", ".join(f.name for f in constructor.fields)

    def _missing(self, constructor: Constructor, bound: dict[str, Bound], node: tree.Call) -> bool:
        given_wrong = {schema.SYNONYMS.get(a.name or "") for a in node.arguments if constructor.field(a.name or "") is None}
        missing = [f for f in constructor.fields if f.required and f.name not in bound and f.name not in given_wrong]
        # a misspelt field is reported already; it would be reported again here as missing
        misspelt = [a for a in node.arguments if a.name and constructor.field(a.name) is None]
        if not missing or len(misspelt) >= len(missing):
            return bool(missing)
        names = " and ".join(f"`{f.name}`" for f in missing)
        meanings = "; ".join(f"`{f.name}`: {f.doc}" + self._unit_hint(f) for f in missing)
        self.place.fail("E206", node.function.span, f"`{constructor.name}` needs {names}", "incomplete", meanings)
        return True

    @staticmethod
    def _unit_hint(field: Field) -> str:
        if field.form in ("quantity", "vector") and field.dimension not in (None, units.NONE):
            return f", in {units.usual(field.dimension)}"  # type: ignore[arg-type]
        return ""

    # ------------------------------------------------------------------ values by form

    def _value(self, field: Field, node: tree.Expression, place: Place) -> Any:
        form = "value_object" if field.form == "value" else field.form
        return getattr(self, f"_{form}")(field, node, place)

    def _wrong(self, field: Field, node: tree.Expression, place: Place) -> Bad:
        return place.fail(
            "E207", node.span, f"expected {field.expected}, found {describe(node)}", describe(node),
            f"`{field.name}` is {field.doc}",
        )  # fmt: skip

    def _quantity(self, field: Field, node: tree.Expression, place: Place) -> float:
        if isinstance(node, tree.String | tree.List | tree.Compare):
            raise self._wrong(field, node, place)
        if isinstance(node, tree.Call) and schema.find(node.function.text):
            raise self._wrong(field, node, place)
        value = self.compiler.evaluator(self.module, place).value(node)
        if isinstance(value, VectorValue):
            raise self._wrong(field, node, place)
        self._dimension(field, node, place, value)
        self._range(field, node, place, value.value)
        return value.value

    def _dimension(self, field: Field, node: tree.Expression, place: Place, value: Quantity | VectorValue) -> None:
        due = field.dimension or units.NONE
        if value.dimension == due:
            return
        found = units.named(value.dimension)
        shown = f", {units.show(value.value, value.dimension)}" if isinstance(value, Quantity) else ""
        hint = f"`{field.name}` is {field.doc}; give it in {units.usual(due)}"
        if due == units.NONE:
            hint = f"`{field.name}` is {field.doc}, without a unit"
        label = f"{found}{shown}" if value.dimension != units.NONE else "no unit"
        raise place.fail("E204", node.span, f"expected {units.named(due)}, found {found}", label, hint)

    def _range(self, field: Field, node: tree.Expression, place: Place, value: float) -> None:
        if field.interval is None or value in field.interval:
            return
        words = field.interval.words(field.dimension or units.NONE)
        shown = units.show(value, field.dimension or units.NONE)
        raise place.fail("E301", node.span, f"`{field.name}` must be {words}", shown, f"`{field.name}` is {field.doc}")

    def _vector(self, field: Field, node: tree.Expression, place: Place) -> tuple[float, ...]:
        if isinstance(node, tree.String | tree.List | tree.Compare):
            raise self._wrong(field, node, place)
        value = self.compiler.evaluator(self.module, place).value(node)
        if isinstance(value, Quantity) or len(value.values) != 3:
            raise place.fail(
                "E207", node.span, "expected three components, found " + (describe(node) if isinstance(value, Quantity) else f"{len(value.values)}"),
                "not a vector of three", f"`{field.name}` is {field.doc}: write `(0, 0, 1) {units.si(field.dimension or units.NONE)}`",
            )  # fmt: skip
        self._dimension(field, node, place, value)
        for component in value.values:
            self._range(field, node, place, component)
        return value.values

    def _integer(self, field: Field, node: tree.Expression, place: Place) -> int:
        if isinstance(node, tree.String | tree.List | tree.Compare | tree.Vector):
            raise self._wrong(field, node, place)
        q = self.compiler.evaluator(self.module, place).quantity(node)
        if q.dimension != units.NONE or q.value != int(q.value):
            raise place.fail("E204", node.span, f"expected a whole number, found {units.show(q.value, q.dimension)}",
                             "not a whole number", f"`{field.name}` is {field.doc}")  # fmt: skip
        self._range(field, node, place, q.value)
        return int(q.value)

    def _flag(self, field: Field, node: tree.Expression, place: Place) -> bool:
        if isinstance(node, tree.Name) and node.text in ("yes", "no"):
            return node.text == "yes"
        if isinstance(node, tree.Name) and node.text.lower() in ("true", "false", "on", "off"):
            word = "yes" if node.text.lower() in ("true", "on") else "no"
            raise place.fail("E212", node.span, f"`{node.text}` is not yes or no", "unknown word", f"write `{word}`")
        raise self._wrong(field, node, place)

    def _choice(self, field: Field, node: tree.Expression, place: Place) -> str:
        word = node.text if isinstance(node, tree.Name) else node.value if isinstance(node, tree.String) else None
        if word is None:
            raise self._wrong(field, node, place)
        if word in field.options and isinstance(node, tree.Name):
            return word
        close = nearest(word, field.options)
        listed = ", ".join(field.options)
        hint = f"did you mean `{close}`? `{field.name}` is one of {listed}" if close else f"`{field.name}` is one of {listed}"
        raise place.fail("E212", node.span, f"`{word}` is not a choice for `{field.name}`", "unknown choice", hint)

    def _text(self, field: Field, node: tree.Expression, place: Place) -> str:
        if not isinstance(node, tree.String):
            raise self._wrong(field, node, place)
        return node.value

    def _file(self, field: Field, node: tree.Expression, place: Place) -> str:
        name = self._text(field, node, place)
        path = self.module.folder / name
        if "\0" in name or not os.path.isfile(path):
            raise place.fail("E401", node.span, f"there is no file `{name}`", "not found",
                             f"paths are relative to the scene's own folder, {self.module.folder}")  # fmt: skip
        return str(path)

    def _direction(self, field: Field, node: tree.Expression, place: Place) -> tuple[float, ...]:
        match node:
            case tree.Name(parts=(("x" | "y" | "z") as axis,)):
                return _unit(axis, 1.0)
            case tree.Unary(operator="+" | "-" as sign, operand=tree.Name(parts=(("x" | "y" | "z") as axis,))):
                return _unit(axis, -1.0 if sign == "-" else 1.0)
            case tree.Vector():
                return self._normalised(field, node, place)
        raise self._wrong(field, node, place)

    def _normalised(self, field: Field, node: tree.Vector, place: Place) -> tuple[float, ...]:
        value = self.compiler.evaluator(self.module, place).value(node)
        if not isinstance(value, VectorValue) or len(value.values) != 3 or value.dimension != units.NONE:
            raise self._wrong(field, node, place)
        norm = math.hypot(*value.values)
        if norm == 0.0:
            raise place.fail("E301", node.span, "a direction cannot be zero", "no direction", f"`{field.name}` is {field.doc}")
        return tuple(v / norm for v in value.values)

    def _condition(self, field: Field, node: tree.Expression, place: Place) -> Any:
        return self.compiler.evaluator(self.module, place).condition(node)

    def _components(self, field: Field, node: tree.Expression, place: Place) -> tuple[int, ...]:
        items = node.items if isinstance(node, tree.Vector | tree.List) else (node,)
        found = []
        for item in items:
            if not isinstance(item, tree.Name) or item.text not in ("x", "y", "z"):
                raise place.fail("E212", item.span, f"expected x, y or z, found {describe(item)}", "not a component",
                                 "write `components = z` or `components = (x, y)`")  # fmt: skip
            found.append("xyz".index(item.text))
        return tuple(sorted(set(found)))

    def _name(self, field: Field, node: tree.Expression, place: Place) -> str:
        if not isinstance(node, tree.Name):
            raise self._wrong(field, node, place)
        self.compiler.named(node, field.kind, self.module, place)
        return self.module.prefix + node.text

    def _value_object(self, field: Field, node: tree.Expression, place: Place) -> Any:
        if field.kind == "element":
            return self._element(field, node, place)
        if isinstance(node, tree.Call):
            return self.call(field.kind, node, outermost=False)[1]
        if isinstance(node, tree.Name):
            return self.compiler.named(node, field.kind, self.module, place).thing
        raise self._wrong(field, node, place)

    def _element(self, field: Field, node: tree.Expression, place: Place) -> Any:
        elements = schema.words()
        if not isinstance(node, tree.Name):
            raise self._wrong(field, node, place)
        if node.text in elements:
            return node.text
        meant = schema.WORDS.get(node.text)
        close = meant if meant in elements else nearest(node.text, list(elements))
        hint = f"did you mean `{close}`?" if close else "elements: " + ", ".join(elements)
        raise place.fail("E203", node.span, f"there is no element `{node.text}`", "unknown element", hint)


def _unit(axis: str, sign: float) -> tuple[float, ...]:
    return tuple(sign if name == axis else 0.0 for name in "xyz")
