"""Declarations of spring networks, and of the rules that set the stiffness of springs.

To add a rule: a class here, a line in STIFFNESSES, and a case in `springs.stiffness_of`.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Any, Literal

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.models.fem import solver_options
from softmark.interpreter.models.fem.fem_declaration import Fem
from softmark.interpreter.models.shared.capabilities import PERTURBED_STARTS, supported_features
from softmark.interpreter.models.shared.model_declaration import Model
from softmark.records import dataclass
from softmark.solvers.elements import element_of

if TYPE_CHECKING:
    from softmark.interpreter.language.compiled_scene import Declared, Scene
    from softmark.interpreter.problem.body_case import Case
    from softmark.interpreter.results.run_report import ModelKind
    from softmark.solvers.mesh.shape import Shape

CAUCHY = 0.25  # Poisson's ratio of every isotropic network of springs
FAR = 0.05  # difference from CAUCHY that causes a warning


@dataclass(frozen=True)
class Uniform:
    """Equal stiffness of all springs, independent of their length.

    The modulus of the body then depends on the mesh: in a lattice of cubes of edge a it is 5 k / 2a.
    """

    value: Annotated[float, "N/m in (0, inf)", "force per stretch of every spring"]


@dataclass(frozen=True)
class FromMaterial:
    """Spring stiffness from Young's modulus of the material, without a free factor.

    Tetrahedra: k = E V / l^2, with V the volume of the cells around an edge of length l (Van Gelder 1998, J.
    Graphics Tools 3(2):21); it is right on average if springs point equally in all directions. Hexahedra: the
    stiffness that makes each cell as isotropic as possible. For cubes of edge a that is k = 2 E a / 5 on edges and
    face diagonals. With body diagonals it is 3 E a / 5 on edges, E a / 5 on face diagonals and 3 E a / 20 on body
    diagonals. Poisson's ratio of the material is not used: a network has a Poisson's ratio of 1/4.
    """


@dataclass(frozen=True)
class Calibrated:
    """Spring stiffness from the material times one factor, which minimizes a metric at a fraction of the load.

    The fit uses the loads, the imposed displacements and the reference at the fraction `load` of their full size;
    the report assesses the model at full load, which the fit has not used. The reference must be one that can be
    solved at a smaller load, such as `simo_reissner`. A measurement is known only at full load: with `load = 100
    %`, fit and assessment share their data, and a warning reports this.
    """

    metric: Annotated[str, "metric", "error against a reference that the factor minimizes"]
    load: Annotated[float, "1 in (0, 1]", "fraction of the load at which it is fitted"] = 0.5


STIFFNESSES: dict[str, type[Any]] = {
    "uniform": Uniform,
    "from_material": FromMaterial,
    "calibrated": Calibrated,
}


@dataclass(frozen=True)
class MassSpring(Model):
    """Masses at the nodes of a mesh, connected by linear springs.

    Springs run along the edges of tetrahedra, or along the edges and diagonals of hexahedra; the energy of a spring is
    k/2 (l - l0)^2. The network uses the density of the material and, unless the stiffness is given, its Young's
    modulus. An isotropic network of springs always has a Poisson's ratio of 1/4 (the Cauchy relation), and does not
    resist inversion of cells. Between nodes displacements are interpolated in the cells.
    Source: Provot (1995); Van Gelder (1998); for the lattice Love (1906), note B.
    """

    capabilities = supported_features(PERTURBED_STARTS)
    resolution_fields = ("size",)

    stiffness: Annotated[
        Any, "stiffness", "stiffness of springs: `uniform(120 N/m)`, `from_material()` or `calibrated(...)`"
    ]
    size: Annotated[float | None, "m in (0, inf)", "target edge length of cells"] = None
    network: Annotated[Literal["tet4", "hex8"], "cells whose edges are springs"] = "tet4"
    diagonals: Annotated[
        Literal["faces", "all"], "for hexahedra: diagonal springs in faces only, or also through the cell"
    ] = "all"
    body: Annotated[str | None, "body", "body; needed if the scene has several"] = None
    mesh: Annotated[Any | None, "shape", "mesh from a file, used instead of a mesh of the body's shape"] = None

    @property
    def solid(self) -> Fem:
        """Finite element model on the same mesh, with the same supports and loads."""
        return Fem(self.network, "corotational", self.size, self.body, self.mesh)

    @property
    def own_mesh(self) -> Shape | None:
        """Mesh read from a file, which replaces a mesh generated from the body's shape; None if there is no file."""
        return self.mesh

    def mesh_words(self, case: Case) -> str:
        """Return a description of the mesh of the network."""
        return self.solid.mesh_words(case)

    def mesh_key(self) -> tuple[Any, ...]:
        """Return a key that is equal for models of a body that can share a mesh."""
        return self.solid.mesh_key()

    def diagnostics(self, declared: Declared, case: Case) -> list[Diagnostic]:
        """Return errors and warnings about this network in a case."""
        found = [
            *self.unsupported_feature_errors(declared, case),
            self.solid.one_mesh(declared, case),
            *solver_options.unused_size(self.solid, declared, case),
            self._poisson_ratio_warning(declared, case),
            self._finite_strain_law_warning(declared, case),
            self._calibration_data_warning(declared),
            self.solid.coarse(declared, case),
        ]
        return [d for d in found if d is not None]

    def scene_diagnostics(self, scene: Scene, declared: Declared, case: Case) -> list[Diagnostic]:
        """Return errors about calibrating this network in its scene."""
        if not isinstance(self.stiffness, Calibrated):
            return []
        from softmark.interpreter.models.spring_network.stiffness_calibration import check_calibration

        return check_calibration(scene, declared, case)

    def _poisson_ratio_warning(self, declared: Declared, case: Case) -> Diagnostic | None:
        """Return a warning if the Poisson's ratio of the material differs from 1/4, that of springs."""
        nu = case.largest_poisson
        if abs(nu - CAUCHY) <= FAR + 1e-12:
            return None
        return diagnostic(
            "W321",
            declared.at(),
            f"springs have a Poisson's ratio of 0.25, but the material of `{case.body.name}` has {nu:g}",
            "not representable by springs",
            "use `fem(...)`, which supports any Poisson's ratio: spring stiffness does not change the ratio of springs",
        )

    def _finite_strain_law_warning(self, declared: Declared, case: Case) -> Diagnostic | None:
        """Return a warning if the material has a finite-strain law, which springs do not use."""
        if case.material.finite_law() is None:
            return None
        return diagnostic(
            "W322",
            declared.at(),
            f"`{declared.name}` does not use the finite-strain law of `{case.body.name}`",
            "linear springs",
            "springs use only the initial Young's modulus, so results at large strain differ from the law",
        )

    def _calibration_data_warning(self, declared: Declared) -> Diagnostic | None:
        """Return a warning if the network is calibrated at full load, with the data that assess it."""
        if not isinstance(self.stiffness, Calibrated) or self.stiffness.load < 1.0:
            return None
        return diagnostic(
            "W323",
            declared.at("stiffness"),
            f"`{declared.name}` is calibrated with the same metric that assesses it",
            "at full load",
            f"calibrate at `load = 50 %`: otherwise `{self.stiffness.metric}` shows the quality of the "
            "fit, not of the prediction",
        )

    def outline(self, case: Case) -> str:
        """Return a one-line description of the model for `dsl plan`."""
        return f"{self.mesh_words(case)}, {self._description_without_size}"

    def kind(self, case: Case) -> ModelKind | None:
        """Return the kind of the model: its description without mesh size, the mesh size, and Poisson's ratio.

        The result is None if the mesh has no size, because it is read from a file.
        """
        solid = self.solid.kind(case)
        return None if solid is None else replace(solid, words=f"{self.network}, {self._description_without_size}")

    @property
    def _description_without_size(self) -> str:
        """Return a description of the network without its size."""
        across = f" with diagonals of {self._diagonal_kinds}" if element_of(self.network).diagonals[0] else ""
        return f"springs{across}: {self._stiffness_rule_text}"

    @property
    def _diagonal_kinds(self) -> str:
        """Return the kinds of diagonals of hexahedra that have springs, as text."""
        return "faces" if self.diagonals == "faces" else "faces and body"

    @property
    def _stiffness_rule_text(self) -> str:
        """Return a description of the rule of the stiffness."""
        match self.stiffness:
            case Uniform(value=k):
                return f"{k:g} N/m each"
            case Calibrated(metric=metric, load=load):
                return f"fitted to {metric} at {100 * load:g} % of the load"
        return "stiffness from the material"
