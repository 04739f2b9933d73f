"""Verifiers: one for each kind of model, with independent force formulas and the error estimate.

To add a verifier, write a module with a class derived from Verifier (or from SizedMeshVerifier, for models on
meshes with a cell size) and a constant VERIFIER, and add a line to VERIFIERS. The module is imported when
such a model has been solved. A model without a verifier is still solved and reported, but its forces are not
verified and it states no error.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

from softmark.interpreter.models.beam.beam_declaration import Beam6Dof
from softmark.interpreter.models.beam_frame.frame_declaration import Frame6Dof
from softmark.interpreter.models.external.external_declaration import ExternalSolver
from softmark.interpreter.models.fem.fem_declaration import Fem
from softmark.interpreter.models.material_point.material_point_declaration import Homogeneous
from softmark.interpreter.models.reduced.reduced_declaration import Reduced
from softmark.interpreter.models.spring_network.spring_declaration import MassSpring
from softmark.interpreter.verification.by_model.verifier import Verifier

VERIFIERS: dict[type[Any], str] = {
    Fem: "softmark.interpreter.verification.by_model.solid_verifier",
    Beam6Dof: "softmark.interpreter.verification.by_model.beam_verifier",
    Frame6Dof: "softmark.interpreter.verification.by_model.frame_verifier",
    Homogeneous: "softmark.interpreter.verification.by_model.material_point_verifier",
    ExternalSolver: "softmark.interpreter.verification.by_model.external_verifier",
    MassSpring: "softmark.interpreter.verification.by_model.spring_verifier",
    Reduced: "softmark.interpreter.verification.by_model.reduced_verifier",
}


def verifier_of(model: Any) -> Verifier:
    """Return the verifier of a model: the one registered for its class or for a base class."""
    known = next((VERIFIERS[cls] for cls in type(model).__mro__ if cls in VERIFIERS), None)
    if known is None:
        return Verifier()
    found: Verifier = import_module(known).VERIFIER
    return found
