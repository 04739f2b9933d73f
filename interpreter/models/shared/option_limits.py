"""Limits that a feature of the scene sets to the options of a model, and the error about an excluded value."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language.message_builder import diagnostic
from softmark.records import dataclass

if TYPE_CHECKING:
    from softmark.interpreter.language.compiled_scene import Declared
    from softmark.interpreter.problem.body_case import Case


@dataclass(frozen=True, eq=False)
class OptionLimits:
    """Allowed values of model options in scenes with a certain feature, and the error about any other value.

    `allowed` maps the name of an option to its allowed values, of which the first is the default. The texts of the
    error
    are templates with the fields model, body, option, value, and name (see `excluded_value_errors`).
    """

    allowed: Mapping[str, tuple[Any, ...]]
    code: str
    message: str
    label: str
    help: str = "leave it out"

    def excluded_value_errors(self, declared: Declared, case: Case, name: str = "") -> Iterator[Diagnostic]:
        """Yield an error for each option of a declared model whose value is not allowed.

        `name` is the declaration that limits the options, such as a contact; it is inserted into the text of the error.
        It is
        empty if the text does not mention such a declaration.
        """
        for option, allowed in self.allowed.items():
            value = getattr(declared.thing, option, allowed[0])
            if value not in allowed:
                words = {"model": declared.name, "body": case.body.name, "name": name, "option": option, "value": value}
                message, label, help = (text.format(**words) for text in (self.message, self.label, self.help))
                yield diagnostic(self.code, declared.at(option), message, label, help)


CONTACT_OPTIONS = OptionLimits(
    {
        "precision": ("double",),
        "max_linear_iterations": (None,),
        "max_iterations": (None,),
        "initial_guess": (None,),
    },
    code="E651",
    message="`{model}` must solve states with contact to the tolerance, from rest, in double precision",
    label="not with the contact `{name}`",
    help="remove `{option}`",
)
SELF_CONTACT_OPTIONS = replace(CONTACT_OPTIONS, allowed={"max_iterations": (None,)})
POROELASTIC_OPTIONS = OptionLimits(
    {
        "formulation": ("displacement",),
        "integration": ("full",),
        "rotation": ("point",),
        "precision": ("double",),
        "initial_guess": (None,),
        "max_iterations": (None,),
        "max_linear_iterations": (None,),
        "factorisation": ("fresh",),
        "linear": ("auto", "cholesky", "superlu", "pardiso"),
    },
    code="E374",
    message="`{option} = {value}` cannot be used with the poroelastic body `{body}`",
    label="not with fluid",
)
VISCOELASTIC_OPTIONS = OptionLimits(
    {
        "integration": ("full",),
        "rotation": ("point",),
        "precision": ("double",),
        "initial_guess": (None,),
        "max_iterations": (None,),
        "shear": (True,),
        "axial": (True,),
    },
    code="E362",
    message="`{model}` is viscoelastic, which cannot be combined with `{option} = {value}`",
    label="not with viscoelasticity",
)
