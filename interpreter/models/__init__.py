"""Models: ways to compute the deformation of a body, each a file with its class.

A model has fields for the scene, `doubts(declared, case)` for what speaks against it before anything is built (no
numpy there), `outline(case)` for the plan, `load()` for its imports, and `prepare(declared, case, workshop)`, which
builds arrays and returns what `prepared.py` describes. To add a model: one file, one line in MODELS.
"""

from __future__ import annotations

from typing import Any

from softmark.interpreter.models.beam.words import Beam6Dof
from softmark.interpreter.models.fem.words import Fem
from softmark.interpreter.models.reduced.words import Modal, Pod
from softmark.interpreter.models.springs.words import MassSpring

MODELS: dict[str, type[Any]] = {
    "fem": Fem,
    "beam6dof": Beam6Dof,
    "mass_spring": MassSpring,
    "modal": Modal,
    "pod": Pod,
}
