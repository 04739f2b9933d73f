"""Models: ways to compute the deformation of a body, each a file with its class.

A model has words and a builder. The words are a class with fields for the scene, `doubts(declared, case)` for what
speaks against it before anything is built (no numpy there), and `outline(case)` for the plan. The builder is a module
with `load(model)` for its imports and `prepare(model, declared, case, workshop)`, which makes arrays and returns what
`shared/prepared.py` describes. To add a model: its words and a line in MODELS, its builder and a line in BUILDERS.
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
