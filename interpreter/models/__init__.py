"""Models: ways to compute the deformation of a body, each a folder with its words and its builder.

Nobody asks which model one is. The words are a class derived from `shared/model_declaration.py: Model`, with fields
for the scene: they say which loads, supports and analyses they take, so that a check refuses the others, what speaks
against
them (`doubts`), what they are (`outline`, `kind`), how finely they solve and with which order, and what they reduce;
no numpy there. The builder is a module with `load(model)` for its imports and `prepare(model, declared, case,
workshop)`, which makes arrays and returns what `shared/prepared_model.py: Prepared` describes; `Meshless` has the
parts of it that a model without a mesh need not write.

To add a model:
    words     a class, a line in MODELS here
    builder   a module, a line in BUILDERS (model_builders.py)
    evidence  forces found again by other formulas, and the error that it states: a module and a line in VOUCHERS
              (verification/by_model). Without them it runs, with a warning, and vouches for nothing.
"""

from __future__ import annotations

from typing import Any

from softmark.interpreter.models.beam.beam_declaration import Beam6Dof
from softmark.interpreter.models.beam_frame.frame_declaration import Frame6Dof
from softmark.interpreter.models.external.external_declaration import Outside
from softmark.interpreter.models.external.rods.external_rod_declaration import OutsideRod
from softmark.interpreter.models.fem.fem_declaration import Fem
from softmark.interpreter.models.imported_results.imported_results_declaration import Results
from softmark.interpreter.models.material_point.material_point_declaration import Homogeneous
from softmark.interpreter.models.reduced.reduced_declaration import Modal, Pod
from softmark.interpreter.models.spring_network.spring_declaration import MassSpring

MODELS: dict[str, type[Any]] = {
    "fem": Fem,
    "beam6dof": Beam6Dof,
    "frame6dof": Frame6Dof,
    "homogeneous": Homogeneous,
    "mass_spring": MassSpring,
    "outside": Outside,
    "outside_rod": OutsideRod,
    "modal": Modal,
    "pod": Pod,
    "results": Results,
}
