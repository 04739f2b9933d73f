"""What vouches for each kind of model: forces found again by other formulas, and the error that it states.

To add one: a module with a class derived from Voucher, or from Sized of models on meshes that aim at a size, and its
VOUCHER; a line in VOUCHERS. It is imported when such a model has an answer. A model without one is computed and
reported all the same: its forces are not found again, and it states no error.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

from softmark.interpreter.models.beam.beam_declaration import Beam6Dof
from softmark.interpreter.models.beam_frame.frame_declaration import Frame6Dof
from softmark.interpreter.models.external.external_declaration import Outside
from softmark.interpreter.models.fem.fem_declaration import Fem
from softmark.interpreter.models.material_point.material_point_declaration import Homogeneous
from softmark.interpreter.models.reduced.reduced_declaration import Reduced
from softmark.interpreter.models.spring_network.spring_declaration import MassSpring
from softmark.interpreter.verification.by_model.verifier import Voucher

VOUCHERS: dict[type[Any], str] = {
    Fem: "softmark.interpreter.verification.by_model.solid_verifier",
    Beam6Dof: "softmark.interpreter.verification.by_model.beam_verifier",
    Frame6Dof: "softmark.interpreter.verification.by_model.frame_verifier",
    Homogeneous: "softmark.interpreter.verification.by_model.material_point_verifier",
    Outside: "softmark.interpreter.verification.by_model.external_verifier",
    MassSpring: "softmark.interpreter.verification.by_model.spring_verifier",
    Reduced: "softmark.interpreter.verification.by_model.reduced_verifier",
}


def voucher_of(model: Any) -> Voucher:
    """What vouches for a model: that of its class, or of one that it derives from."""
    known = next((VOUCHERS[cls] for cls in type(model).__mro__ if cls in VOUCHERS), None)
    if known is None:
        return Voucher()
    found: Voucher = import_module(known).VOUCHER
    return found
