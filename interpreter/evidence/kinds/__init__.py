"""What vouches for each kind of model: forces found again by other formulas, and the error that it states.

To add one: a module with a class derived from Voucher, or from Sized of models on meshes that aim at a size, and its
VOUCHER; a line in VOUCHERS. It is imported when such a model has an answer. A model without one is computed and
reported all the same: its forces are not found again, and it states no error.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

from softmark.interpreter.evidence.kinds.voucher import Voucher
from softmark.interpreter.models.beam.words import Beam6Dof
from softmark.interpreter.models.fem.words import Fem
from softmark.interpreter.models.homogeneous.words import Homogeneous
from softmark.interpreter.models.network.words import Frame6Dof
from softmark.interpreter.models.outside.words import Outside
from softmark.interpreter.models.reduced.words import Reduced
from softmark.interpreter.models.springs.words import MassSpring

VOUCHERS: dict[type[Any], str] = {
    Fem: "softmark.interpreter.evidence.kinds.solids",
    Beam6Dof: "softmark.interpreter.evidence.kinds.beams",
    Frame6Dof: "softmark.interpreter.evidence.kinds.networks",
    Homogeneous: "softmark.interpreter.evidence.kinds.points",
    Outside: "softmark.interpreter.evidence.kinds.outsiders",
    MassSpring: "softmark.interpreter.evidence.kinds.springs",
    Reduced: "softmark.interpreter.evidence.kinds.reductions",
}


def voucher_of(model: Any) -> Voucher:
    """What vouches for a model: that of its class, or of one that it derives from."""
    known = next((VOUCHERS[cls] for cls in type(model).__mro__ if cls in VOUCHERS), None)
    if known is None:
        return Voucher()
    found: Voucher = import_module(known).VOUCHER
    return found
