"""Binding of the arguments of a call to the fields of a constructor, each checked by the form of its field."""

from __future__ import annotations

import math
import os
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from softmark.grammar import tree
from softmark.grammar.diagnostic import Fix, Remedy, SecondaryPlace, did_you_mean, suggest_text
from softmark.grammar.name_suggestions import nearest
from softmark.interpreter.language import expression_evaluation as evaluation
from softmark.interpreter.language import (
    field_parsers,
    field_schema,
    foreign_aliases,
    quotient_warnings,
    renamed_words,
    units,
)
from softmark.interpreter.language.bare_constructors import find_bare_constructor
from softmark.interpreter.language.compiled_scene import Location
from softmark.interpreter.language.condition_syntax import format_condition, read_condition
from softmark.interpreter.language.expression_evaluation import EvaluationError, Quantity, SourceErrors, VectorValue
from softmark.interpreter.language.field_schema import Constructor, Field, Vocabulary
from softmark.interpreter.language.foreign_words import explain_foreign_word, find_misspelling
from softmark.interpreter.language.region_references import KIND, make_region_lookup
from softmark.interpreter.language.scene_sources import Module
from softmark.records import dataclass

if TYPE_CHECKING:
    from softmark.interpreter.language.compiler import Compiler
    from softmark.interpreter.language.parameter_overrides import Override

ORIGINS = 3  # maximum number of parameters shown in a message
FARTHEST = 1e30  # its sixth power (volume times stiffness) does not overflow
HOME = "paths are relative to the scene's own folder"
Bound = tuple[tree.Expression, SourceErrors]  # expression and its text


@dataclass(frozen=True)
class Binder:
    """Binder of the calls of one declaration, whose name with prefix is `full`: `tissue.liver`."""

    compiler: Compiler
    module: Module
    full: str

    @property
    def place(self) -> SourceErrors:
        """Text of the module, and the list that collects its diagnostics."""
        return self.module.place

    @property
    def vocabulary(self) -> Vocabulary:
        """All constructors that the scene can use."""
        return self.compiler.table.vocabulary

    def call(self, kind: str, node: tree.Call, outermost: bool = True) -> tuple[Constructor, Any, dict[str, Location]]:
        """Return the constructor of a call, the created object, and the location of each field. Raises EvaluationError.

        Overrides apply only to the `outermost` call of a declaration.
        """
        constructor = self._find_constructor(kind, node)
        self._refuse_decimal_comma(constructor, node)
        bound, broken = self._match(constructor, node, outermost)
        values: dict[str, Any] = dict(whole := field_parsers.default_selection(self, constructor, bound))
        for field in constructor.fields:
            if field.name not in bound:
                continue
            try:
                values[field.attribute] = self.value(field, *bound[field.name])
            except EvaluationError:
                broken = True
        broken |= self._report_missing_fields(constructor, {**bound, **dict.fromkeys(whole, (node, self.place))}, node)
        broken |= field_parsers.check_alternatives(self, constructor, bound, node)
        if broken:
            raise EvaluationError
        places = {name: Location(place.source, value.span) for name, (value, place) in bound.items()}
        return constructor, field_parsers.create_object(self, constructor, values, bound, node), places

    def _find_constructor(self, kind: str, node: tree.Call) -> Constructor:
        name = node.function.text
        found = self.vocabulary.constructor(kind, name)
        if found is not None:
            return found
        known = list(self.vocabulary[kind])
        others = self.vocabulary.find(name)
        if not others and (present := renamed_words.CONSTRUCTORS.get(name)) in known:
            message = f"there is no {kind} `{name}`"
            raise self.place.error(
                "E203", node.function.span, message, "an earlier name", renamed_words.remedy(present)
            )
        if not others and (lost := self.vocabulary.broken_plugin_message(kind, name)) is not None:
            raise self.place.error("E730", node.function.span, *lost)
        meant = foreign_aliases.WORDS.get(name)
        close = meant if meant in known else find_misspelling(name, known)
        if others:
            other = others[0].kind
            message = f"`{name}` is {field_schema.article(other)} {other}, not {field_schema.article(kind)} {kind}"
            hint: str | Remedy = f"declare it as `{other} NAME = {name}(...)`; {kind} constructors: {', '.join(known)}"
        else:
            message = f"there is no {kind} `{name}`"
            other_word = did_you_mean(close) if close else explain_foreign_word(name)
            hint = other_word or f"{kind} constructors: {', '.join(known)}"
            if close and close == meant and not nearest(name, [close]):
                hint = Remedy(f"it is called `{close}` here", Fix(close))
        raise self.place.error("E203", node.function.span, message, f"not {field_schema.article(kind)} {kind}", hint)

    # ------------------------------------------------------------------ arguments to fields

    def _match(self, constructor: Constructor, node: tree.Call, outermost: bool) -> tuple[dict[str, Bound], bool]:
        bound: dict[str, Bound] = {}
        broken = False
        for position, argument in enumerate(node.arguments):
            field = self._find_field(constructor, argument, position)
            if field is None:
                broken = True
            elif field.name in bound:
                self.place.error(
                    "E211", argument.span, f"`{field.name}` is given twice", "the second value", "keep one of them"
                )
                broken = True
            else:
                bound[field.name] = (argument.value, self.place)
        if outermost:
            broken |= self._apply_overrides(constructor, bound)
        return bound, broken

    def _refuse_decimal_comma(self, constructor: Constructor, node: tree.Call) -> None:
        """Refuse a decimal comma as in `gravity(9,81 m/s^2)`, which reads as two arguments."""
        arguments = [a.value for a in node.arguments if a.name is None]
        for field, a, b in zip(constructor.fields, arguments[:-1], arguments[1:], strict=False):
            if not isinstance(a, tree.Number) or not isinstance(b, tree.Number) or a.unit is not None:
                continue
            adjacent = b.span.start == a.span.end + 1 and b.text.isdigit()
            if adjacent and field.dimension not in (None, units.NONE):
                raise self.place.error("E113", tree.span_between(a.span, b.span), "the decimal sign is a point",
                                      "a comma separates arguments",
                                suggest_text(f"{a.text}.{self._text_of(b)}"))  # fmt: skip

    def _text_of(self, node: tree.Expression) -> str:
        return self.place.source.text[node.span.start : node.span.end]

    def _apply_overrides(self, constructor: Constructor, bound: dict[str, Bound]) -> bool:
        broken = False
        for name, override in self.compiler.replaced.items():
            owner, _, attribute = name.rpartition(".")
            if owner != self.full:
                continue
            if constructor.field(attribute) is None:
                self._report_unknown_override(constructor, attribute, override)
                broken = True
            else:
                bound[attribute] = (override.node, override.place)
        return broken

    def _report_unknown_override(self, constructor: Constructor, attribute: str, override: Override) -> None:
        hint = self._field_hint(constructor, attribute)
        message = f"`{constructor.name}` has no field `{attribute}`"
        override.place.error("E205", override.name_span, message, "not a field", hint)

    def _refuse_comparison(self, constructor: Constructor, value: tree.Expression) -> None:
        """Refuse a comparison such as `strain == small` in place of the assignment of a field."""
        if not isinstance(value, tree.Compare) or value.operators[0] != "==":
            return
        name, given = (self._text_of(operand) for operand in value.operands[:2])
        if constructor.field(name) is not None:
            problem, help = f"expected `=` after `{name}`, found `==`", suggest_text(f"{name} = {given}")
            raise self.place.error("E106", value.span, problem, "a comparison", help)

    def _find_field(self, constructor: Constructor, argument: tree.Argument, position: int) -> Field | None:
        if argument.name is None:
            self._refuse_comparison(constructor, argument.value)
            if position < len(constructor.fields):
                return constructor.fields[position]
            count = len(constructor.fields)
            fields = f"{count} field" + ("s" if count != 1 else "")
            self.place.error("E211", argument.span, f"`{constructor.name}` has {fields}; this value is one too many",
                             "too many", self._list_fields(constructor))  # fmt: skip
            return None
        field = constructor.field(argument.name)
        if field is None:
            span = argument.name_span or argument.span
            self.place.error("E205", span, f"`{constructor.name}` has no field `{argument.name}`",
                            "not a field",
                            self._field_hint(constructor, argument.name))  # fmt: skip
        return field

    def _field_hint(self, constructor: Constructor, name: str) -> str | Remedy:
        if name in foreign_aliases.MODULI and constructor.field("young"):
            return f"`{constructor.name}` takes `young` and `poisson`: {foreign_aliases.MODULI[name]}"
        meant = self._guess_field(constructor, name)
        field = constructor.field(meant or "")
        if field is None:
            return self._list_fields(constructor)
        if field.name == renamed_words.find_renamed_field(constructor.name, name):
            return renamed_words.remedy(field.name)
        if nearest(name, [field.name]):
            return did_you_mean(field.name)
        if name in foreign_aliases.CONVERTED:
            return f"use `{field.name}`, which is {foreign_aliases.CONVERTED[name]}: {field.doc}"
        return Remedy(f"the field is called `{field.name}`: {field.doc}", Fix(field.name))

    @staticmethod
    def _list_fields(constructor: Constructor) -> str:
        if not constructor.fields:
            return f"`{constructor.name}` has no fields"
        return f"fields of `{constructor.name}`: " + ", ".join(f.name for f in constructor.fields)

    def _report_missing_fields(self, constructor: Constructor, bound: dict[str, Bound], node: tree.Call) -> bool:
        """Report missing required fields and return whether there are any; a misspelt field counts as given."""
        unknown = [a.name for a in node.arguments if a.name and constructor.field(a.name) is None]
        meant = [self._guess_field(constructor, name) for name in unknown]
        missing = [f for f in constructor.fields if f.required and f.name not in bound]
        unexplained = [f for f in missing if f.name not in meant]
        if len(unexplained) <= meant.count(None):
            return bool(missing)
        names = " and ".join(f"`{f.name}`" for f in unexplained)
        meanings = "; ".join(f.meaning + self.unit_hint(f) for f in unexplained)
        self.place.error("E206", node.function.span, f"`{constructor.name}` needs {names}", "incomplete", meanings)
        return True

    @staticmethod
    def _guess_field(constructor: Constructor, name: str) -> str | None:
        """Return the field that a wrong name probably means: an alias from another program, or a similar spelling."""
        names = [f.name for f in constructor.fields]
        if (renamed := renamed_words.find_renamed_field(constructor.name, name)) in names:
            return renamed
        meant = foreign_aliases.SYNONYMS.get(name) or foreign_aliases.SYNONYMS.get(name.lower())
        return meant if meant in names else find_misspelling(name, names)

    @staticmethod
    def unit_hint(field: Field) -> str:
        """Return the help text about the unit that a field expects."""
        if field.form in ("quantity", "vector") and field.dimension not in (None, units.NONE):
            return f", in {units.usual_units(field.dimension or units.NONE)}"
        return ""

    # ------------------------------------------------------------------ values by form

    def value(self, field: Field, node: tree.Expression, place: SourceErrors) -> Any:
        """Return the value of an expression for a field. Raises EvaluationError."""
        if field.varies and (varying := field_parsers.parse_profile(self, field, node, place)) is not None:
            return varying
        if field.form in field_parsers.FORMS:
            return field_parsers.FORMS[field.form](self, field, node, place)
        form = "value_object" if field.form == "value" else field.form
        return getattr(self, f"_{form}")(field, node, place)

    def report_wrong_form(self, field: Field, node: tree.Expression, place: SourceErrors) -> EvaluationError:
        """Record an error about a value that is not of the form that its field expects, and return the error."""
        found = evaluation.describe_expression(node)
        return place.error("E207", node.span, f"expected {field.expected}, found {found}", found, field.meaning)

    def _quantity(self, field: Field, node: tree.Expression, place: SourceErrors) -> float:
        if isinstance(node, tree.String | tree.List | tree.Compare):
            raise self.report_wrong_form(field, node, place)
        if isinstance(node, tree.Call) and self.vocabulary.find(node.function.text):
            raise self.report_wrong_form(field, node, place)
        value = self.compiler.scope.evaluator(self.module, place).value(node)
        if isinstance(value, VectorValue):
            raise self.report_wrong_form(field, node, place)
        self.dimension(field, node, place, value)
        self.within(field, node, place, value.value)
        return value.value

    def dimension(self, field: Field, at: tree.Expression, place: SourceErrors, value: Quantity | VectorValue) -> None:
        """Refuse a value whose dimension differs from that of its field. Raises EvaluationError."""
        due = field.dimension or units.NONE
        if value.dimension == due:
            return
        found = units.dimension_name(value.dimension)
        shown = f", {units.format_value(value.value, value.dimension)}" if isinstance(value, Quantity) else ""
        hint = f"{field.meaning}; give it in {units.usual_units(due)}"
        if due == units.NONE:
            hint = f"{field.meaning}, without a unit"
        label = f"{found}{shown}" if value.dimension != units.NONE else "no unit"
        problem = f"expected {units.dimension_name(due)}, found {found}"
        named = self.compiler.scope.parameters.get(self.module.prefix + getattr(at, "text", ""))
        help = quotient_warnings.suggest_quotient(at, place.source.text, value.dimension, due, named) or hint
        raise place.error("E204", at.span, problem, label, help, self._parameter_origins(at))

    def _parameter_origins(self, node: tree.Expression) -> tuple[SecondaryPlace, ...]:
        """Return the places where the parameters in an expression get their values, for messages."""
        found: dict[str, SecondaryPlace] = {}
        for part, _ in tree.walk(node):
            name = part.text if isinstance(part, tree.Name) else ""
            parameter = self.compiler.scope.parameters.get(self.module.prefix + name)
            if parameter is not None and len(found) < ORIGINS:
                at = parameter.location
                found.setdefault(name, SecondaryPlace(at.source, at.span, f"`{name}` gets its value here"))
        return tuple(found.values())

    def within(self, field: Field, node: tree.Expression, place: SourceErrors, value: float) -> None:
        """Refuse a number, in SI units, outside the range of its field. Raises EvaluationError."""
        if value != 0.0 and not 1.0 / FARTHEST <= abs(value) <= FARTHEST:
            raise place.error(
                "E301",
                node.span,
                f"`{field.name}` is too large or too small to compute with",
                f"this is {value:.3g} in SI units",
                f"use zero, or {1.0 / FARTHEST:g} to {FARTHEST:g} in SI units",
            )
        if field.interval is None or value in field.interval:
            return
        limits = field.interval.words(field.dimension or units.NONE)
        shown = units.format_value(value, field.dimension or units.NONE)
        help = foreign_aliases.ADVICE.get((field.name, value >= field.interval.high)) or field.meaning
        literal = isinstance(node.operand if isinstance(node, tree.Unary) else node, tree.Number)
        raise place.error(
            "E301",
            node.span,
            f"`{field.name}` must be {limits}",
            "out of range" if literal else f"this is {shown}",
            help,
            self._parameter_origins(node),
        )

    def _vector(self, field: Field, node: tree.Expression, place: SourceErrors) -> tuple[float, ...]:
        unit = units.vector_unit(field.dimension or units.NONE)
        if isinstance(node, tree.List):
            help = f"write a vector in round brackets: `(0, 0, 1) {unit}`"
            raise place.error("E207", node.span, f"expected {field.expected}, found a list", "a list", help)
        if isinstance(node, tree.String | tree.Compare):
            raise self.report_wrong_form(field, node, place)
        value = self.compiler.scope.evaluator(self.module, place).value(node)
        if isinstance(value, Quantity) or len(value.values) != 3:
            found = evaluation.describe_expression(node) if isinstance(value, Quantity) else str(len(value.values))
            raise place.error("E207", node.span, f"expected three components, found {found}",
                             "not a vector of three",
                             f"{field.meaning}; write it as `(0, 0, 1) {unit}`")  # fmt: skip
        self.dimension(field, node, place, value)
        for component in value.values:
            self.within(field, node, place, component)
        return value.values

    def _integer(self, field: Field, node: tree.Expression, place: SourceErrors) -> int:
        if isinstance(node, tree.String | tree.List | tree.Compare | tree.Vector):
            raise self.report_wrong_form(field, node, place)
        q = self.compiler.scope.evaluator(self.module, place).quantity(node)
        if q.dimension != units.NONE or q.value != int(q.value):
            raise place.error("E204", node.span,
                             f"expected a whole number, found {units.format_value(q.value, q.dimension)}",
                             "not a whole number", field.meaning)  # fmt: skip
        self.within(field, node, place, q.value)
        return int(q.value)

    def _flag(self, field: Field, node: tree.Expression, place: SourceErrors) -> bool:
        if isinstance(node, tree.Name) and node.text in ("yes", "no"):
            return node.text == "yes"
        if isinstance(node, tree.Name) and node.text.lower() in ("true", "false", "on", "off"):
            word = "yes" if node.text.lower() in ("true", "on") else "no"
            raise place.error("E212", node.span, f"`{node.text}` is not yes or no", "unknown word", suggest_text(word))
        raise self.report_wrong_form(field, node, place)

    def _choice(self, field: Field, node: tree.Expression, place: SourceErrors) -> str:
        if not isinstance(node, tree.Name | tree.String):
            raise self.report_wrong_form(field, node, place)
        word = node.text if isinstance(node, tree.Name) else node.value
        if word in field.options and isinstance(node, tree.Name):
            return word
        if word in field.options:
            raise place.error(
                "E212", node.span, f"a choice for `{field.name}` must not be in quotes", "a text", suggest_text(word)
            )
        meant = foreign_aliases.CHOICES.get(word)
        close = meant if meant in field.options else find_misspelling(word, field.options)
        due = f"`{field.name}` is {field.expected}"
        hint = did_you_mean(close, more=f" {due}") if close else due
        raise place.error("E212", node.span, f"`{word}` is not a choice for `{field.name}`", "unknown choice", hint)

    def _text(self, field: Field, node: tree.Expression, place: SourceErrors) -> str:
        if not isinstance(node, tree.String):
            raise self.report_wrong_form(field, node, place)
        return node.value

    def _file(self, field: Field, node: tree.Expression, place: SourceErrors) -> str:
        name = self._text(field, node, place)
        if name.startswith("data:"):
            return self._data_set_name(name, node, place)
        if not name.strip():
            raise place.error("E401", node.span, "the name of the file is empty", "no name", HOME)
        path = self.module.folder / name
        if "\0" not in name and (os.path.isfile(path) or (field.folder and os.path.isdir(path))):
            return str(path)
        folder = path.parent
        close = nearest(path.name, os.listdir(folder)) if os.path.isdir(folder) else None
        if os.path.isdir(path):
            raise place.error("E401", node.span, f"`{name}` is a folder", "not a file", "name a file in it")
        meant = Path(name).with_name(close).as_posix() if close else ""
        hint = did_you_mean(meant, f'"{meant}"') if close else HOME
        raise place.error("E401", node.span, f"there is no file `{name}`", "not found", hint)

    def _data_set_name(self, name: str, node: tree.Expression, place: SourceErrors) -> str:
        """Return the name of a public data set, which is downloaded when the scene runs. Raises EvaluationError."""
        from softmark.references.data_download import TABLE

        known = [f"data:{own}" for own in TABLE]
        if name in known:
            return name
        close = nearest(name, known)
        hint = did_you_mean(close, f'"{close}"') if close else "`dsl list data` lists the data sets"
        raise place.error("E401", node.span, f"there is no data set `{name}`", "not found", hint)

    def _direction(self, field: Field, node: tree.Expression, place: SourceErrors) -> tuple[float, ...]:
        match node:
            case tree.Name(parts=(("x" | "y" | "z") as axis,)):
                return _axis_unit_vector(axis, 1.0)
            case tree.Unary(operator="+" | "-" as sign, operand=tree.Name(parts=(("x" | "y" | "z") as axis,))):
                return _axis_unit_vector(axis, -1.0 if sign == "-" else 1.0)
            case tree.Name() if node.text in foreign_aliases.DIRECTIONS:
                low, usual = node.text.lower(), foreign_aliases.DIRECTIONS[node.text]
                hint = Remedy(f"name a direction by coordinates: {usual}", Fix(low) if low in "xyz" else None)
                found = f"the name `{node.text}`"
                raise place.error("E207", node.span, f"expected {field.expected}, found {found}", found, hint)
            case tree.Vector() | tree.Name() | tree.Unary() | tree.Binary():
                return self._normalised(field, node, place)
        raise self.report_wrong_form(field, node, place)

    def _normalised(self, field: Field, node: tree.Expression, place: SourceErrors) -> tuple[float, ...]:
        value = self.compiler.scope.evaluator(self.module, place).value(node)
        if not isinstance(value, VectorValue) or len(value.values) != 3:
            found = evaluation.describe_value(value)
            if not isinstance(value, Quantity):
                found = f"{len(value.values)} components"
            raise place.error("E207", node.span, f"expected {field.expected}, found {found}", found,
                             field.meaning)  # fmt: skip
        if value.dimension != units.NONE:
            found = evaluation.describe_value(value)
            help = "write a direction without a unit: `(0, 0, -1)`"
            raise place.error("E204", node.span, f"expected a direction, found {found}", found, help)
        norm = math.hypot(*value.values)
        if norm == 0.0:
            raise place.error("E301", node.span, "a direction must not be zero", "no direction", field.meaning)
        return tuple(v / norm for v in value.values)

    def _condition(self, field: Field, node: tree.Expression, place: SourceErrors) -> Any:
        evaluator = self.compiler.scope.evaluator(self.module, place)
        find = self.compiler.resolve_declaration
        named = make_region_lookup(self.module, self.compiler.table, lambda name: find(name, KIND, self.module, place))
        return replace(read_condition(node, evaluator, named), said=format_condition(node, evaluator, named))

    def _name(self, field: Field, node: tree.Expression, place: SourceErrors) -> str:
        if isinstance(node, tree.String) and self.module.prefix + node.value in self.compiler.table.symbols:
            raise place.error("E207", node.span, f"expected {field.expected}, found a text", "a text",
                             suggest_text(node.value, ", without quotes"))  # fmt: skip
        if isinstance(node, tree.String):
            known = ", ".join(self.compiler.scope.names(self.module, [field.kind])) or "none"
            hint = f"write names without quotes; declared {field_schema.plural(field.kind)}: {known}"
            raise place.error("E207", node.span, f"expected {field.expected}, found a text", "a text", hint)
        if not isinstance(node, tree.Name):
            raise self.report_wrong_form(field, node, place)
        self.compiler.resolve_declaration(node, field.kind, self.module, place, field.also)
        return self.module.prefix + node.text

    def _names(self, field: Field, node: tree.Expression, place: SourceErrors) -> tuple[str, ...]:
        if not isinstance(node, tree.List) or node.unit is not None:
            raise self.report_wrong_form(field, node, place)
        return tuple(self._name(field, item, place) for item in node.items)

    def _list(self, field: Field, node: tree.Expression, place: SourceErrors) -> VectorValue:
        if not isinstance(node, tree.List):
            raise self.report_wrong_form(field, node, place)
        value = self.compiler.scope.evaluator(self.module, place).values(node)
        if field.dimension is not None and value.values:
            self.dimension(field, node, place, value)
        for number, item in zip(value.values, node.items, strict=True):
            self.within(field, item, place, number)
        return value

    def _value_object(self, field: Field, node: tree.Expression, place: SourceErrors) -> Any:
        if field.kind == "element":
            return self._element(field, node, place)
        if isinstance(node, tree.Call):
            return self.call(field.kind, node, outermost=False)[1]
        if isinstance(node, tree.Name):
            word = find_bare_constructor(self.compiler.scope, self.module, field, node, place)
            return word.cls() if word else self.compiler.resolve_declaration(node, field.kind, self.module, place).thing
        raise self.report_wrong_form(field, node, place)

    def _element(self, field: Field, node: tree.Expression, place: SourceErrors) -> Any:
        elements = self.vocabulary.words()
        if isinstance(node, tree.String) and node.value in elements:
            raise place.error("E207", node.span, "expected an element, found a text", "a text",
                             suggest_text(node.value, ", without quotes"))  # fmt: skip
        if not isinstance(node, tree.Name):
            raise self.report_wrong_form(field, node, place)
        if node.text in elements:
            return node.text
        meant = foreign_aliases.CELLS.get(node.text)
        close = meant if meant in elements else find_misspelling(node.text, elements)
        hint = did_you_mean(close) if close else "elements: " + ", ".join(elements)
        raise place.error("E203", node.span, f"there is no element `{node.text}`", "unknown element", hint)


def _axis_unit_vector(axis: str, sign: float) -> tuple[float, ...]:
    return tuple(sign if name == axis else 0.0 for name in "xyz")
