"""Models, that is methods to compute the deformation of a body. Each is a folder with a declaration and a builder.

No code asks for the class of a model. A declaration is a class derived from `shared/model_declaration.py:
Model`, with the fields that a scene can set. It states which loads, supports and analyses the model supports,
so that validation refuses all others. It also has the errors and warnings about the model (`diagnostics`), its
description (`outline`, `kind`), its resolution and convergence order, and the model that it reduces, if any. It
does not import numpy. A builder is a module with `load(model)`, which imports its libraries, and
`prepare(model, declared, case, workshop)`, which creates arrays and returns an object with the interface
`shared/prepared_model.py: Prepared`. `Meshless` has defaults for a model without a mesh.

To add a model:
    declaration   a class, and a line in MODELS here
    builder       a module, and a line in BUILDERS (model_builders.py)
    verification  a module that recomputes forces by other formulas and estimates the error, and a line in VERIFIERS
                  (verification/by_model). Without it the model runs with a warning and states no error.
"""

from __future__ import annotations

from typing import Any

from softmark.interpreter.models.beam.beam_declaration import Beam6Dof
from softmark.interpreter.models.beam_frame.frame_declaration import Frame6Dof
from softmark.interpreter.models.external.external_declaration import ExternalSolver
from softmark.interpreter.models.external.rods.external_rod_declaration import ExternalRod
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
    "external_solver": ExternalSolver,
    "external_rod": ExternalRod,
    "modal": Modal,
    "pod": Pod,
    "results": Results,
}
