"""Check of material stability in every solution of a solid at finite strain.

At every integration point it tests strong ellipticity (`solvers/materials/ellipticity.py`) and Drucker's stability
(`drucker_stability.py`). Laws whose constants guarantee stability are skipped; laws with fibre directions are tested
only for ellipticity. Where cells preserve their mean volume, a law is tested with the pressure of that constraint.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language import units
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.verification.cell_materials_check import split_by_material

if TYPE_CHECKING:
    from softmark.interpreter.language.compiled_scene import Declared
    from softmark.interpreter.models.shared.prepared_model import DeformedMesh
    from softmark.interpreter.verification.by_model.verifier import VerifiedSolution
    from softmark.solvers.materials.batched_stability import VolumePressure
    from softmark.solvers.materials.volumetric_constraints import MixedSplit
    from softmark.solvers.mesh.mesh import Floats, Mesh

ALIKE = 1e-6  # relative: closer strains count as equal; the first is reported
TINY = float(np.finfo(np.float64).tiny)


def stability_facts(found: VerifiedSolution) -> dict[str, Any]:
    """Return the volume fraction without strong ellipticity or Drucker stability, and its most strained point."""
    mesh, of = found.solution.mesh, found.declared.thing.reduces
    thing = found.declared.thing if of is None else found.scene.declared[of].thing
    how = thing.stress_law
    if mesh is None or isinstance(how, str) or how[0] != "finite":
        return {}
    looks = {name: look for name, look in LOOKS.items() if not all(look.sound(m) for m in found.case.materials)}
    if not looks:
        return {}
    lost: dict[str, UnstableVolume] = {name: UnstableVolume() for name in looks}
    volume = 0.0
    for case, which in split_by_material(found.case, mesh):
        part = mesh.mesh if isinstance(which, slice) else replace(mesh.mesh, cells=mesh.mesh.cells[which])
        volume += float(np.abs(part.volumes).sum())
        own = {name: look for name, look in looks.items() if not look.sound(case.material)}
        if not own:
            continue
        F, w = _deformation_gradients(case, mesh, which)
        own = {name: look for name, look in own.items() if look.may_be_unstable(case.material, F)}
        if not own:
            continue
        law, held = _law_and_constraint(case, mesh, part, which, how[1], F, w)
        for name, look in own.items():
            gone = look.gone(law, F, held)
            if gone is not None and gone.any():
                lost[name].add(part, F, w, gone)
    return {name: known for name, one in lost.items() if (known := one.report_facts(volume))}


@dataclass
class UnstableVolume:
    """Volume, m^3, in which a law is unstable, and its most strained point.

    The point is given by its strain, position (3,), m, and stretches (3,).
    """

    volume: float = 0.0
    worst: tuple[float, Any, Any] = (-1.0, None, None)

    def add(self, part: Mesh, F: Floats, w: Floats, gone: Any) -> None:
        """Add the integration points of some cells at which the law is unstable, by the mask `gone` (k,).

        F (k, 3, 3) are the deformation gradients at all points and w (k,) the volumes of the points, m^3.
        """
        self.volume += float(w[gone].sum())
        s = np.linalg.svd(F[gone], compute_uv=False)
        far = np.abs(np.log(np.maximum(s, TINY))).max(axis=1)
        place = int((far >= (1.0 - ALIKE) * far.max()).argmax())
        if far[place] > self.worst[0]:
            from softmark.interpreter.models.shared.heterogeneous_material import rule_positions

            X = rule_positions(part, part.element.quadrature()).reshape(-1, 3)
            self.worst = float(far[place]), X[gone][place], s[place]

    def report_facts(self, volume: float) -> dict[str, Any]:
        """Return facts with the unstable fraction of the `volume`, m^3; empty if nothing is unstable."""
        _, X, s = self.worst
        return {} if X is None else {"share": self.volume / volume, "at_m": X.tolist(), "stretches": s.tolist()}


class EllipticityTest:
    """Test whether a constitutive law is strongly elliptic in a state, so that the material is stable."""

    def sound(self, material: Any) -> bool:
        """Return whether a material needs no test, because it is viscoelastic, or elliptic by its constants."""
        return bool(getattr(material, "polyconvex", False)) or bool(getattr(material, "branches", ()))

    def may_be_unstable(self, material: Any, F: Floats) -> bool:
        """Return whether ellipticity may be lost in one of the states F (k, 3, 3); always true."""
        return True

    def gone(self, law: Any, F: Floats, held: VolumePressure | None) -> Any:
        """Return a mask of the states F (k, 3, 3) in which the law has lost ellipticity; None if that is not known."""
        from softmark.solvers.materials.ellipticity import find_ellipticity_loss

        return find_ellipticity_loss(law, F, held)


class DruckerStabilityTest:
    """Test of Drucker's stability of a constitutive law, in terms of Hencky strain."""

    def sound(self, material: Any) -> bool:
        """Return whether a material needs no test: it is stable by its constants, viscoelastic, or has fibres."""
        if getattr(material, "directed", False) or getattr(material, "branches", ()):
            return True
        return bool(getattr(material, "convex_above", math.inf) <= 0.0)

    def may_be_unstable(self, material: Any, F: Floats) -> bool:
        """Return whether stability may be lost in a state of F (k, 3, 3), by the law's limit of volume ratios."""
        from softmark.solvers.materials.tensor_components import components, displacement_gradient, volume_change

        j = volume_change(displacement_gradient(components(F)))
        return bool(np.any(j <= getattr(material, "convex_above", math.inf) - 1.0))

    def gone(self, law: Any, F: Floats, held: VolumePressure | None) -> Any:
        """Return a mask of the states F (k, 3, 3) in which the law has lost Drucker's stability; None if not known."""
        from softmark.solvers.materials.drucker_stability import find_instability

        return find_instability(law, F, held)


LOOKS: dict[str, EllipticityTest | DruckerStabilityTest] = {
    "gives_way": EllipticityTest(),
    "drucker": DruckerStabilityTest(),
}


def _law_and_constraint(
    case: Any, mesh: DeformedMesh, part: Mesh, which: Any, way: str, F: Floats, w: Floats
) -> tuple[Any, VolumePressure | None]:
    """Return the law of some cells in states F (k, 3, 3), and the pressure of their volume constraint or None."""
    from softmark.solvers.materials import law_for, mixed_for
    from softmark.solvers.materials.batched_stability import VolumePressure

    material = case.material
    if not case.uniform:
        from softmark.interpreter.models.shared.heterogeneous_material import material_at

        material = material_at(material, part, part.element.quadrature())
    split = None if way == "full" or material.thin else mixed_for(material, "finite")
    if split is None:
        return law_for(material, "finite"), None
    modulus = np.ravel(split.modulus) if np.ndim(split.modulus) else split.modulus
    return split.shape, VolumePressure(split.constraint, modulus, _pressure(split, mesh, part, which, way, F, w))


def _pressure(split: MixedSplit, mesh: DeformedMesh, part: Mesh, which: Any, way: str, F: Floats, w: Floats) -> Floats:
    """Return the pressure of the volume constraint at integration points (k,), Pa.

    In mixed formulations it is an unknown of the solution; otherwise it is the bulk modulus times the mean constraint.
    """
    if way == "mixed" and mesh.pressures is not None:
        from softmark.solvers.mesh.pressure_interpolation import build_pressure_space

        found: Floats = mesh.pressures[which] @ build_pressure_space(part, part.element.quadrature()).N.T
        return found.ravel()
    size = w.reshape(len(part.cells), -1)
    g = split.constraint.value(F).reshape(size.shape)
    mean = (size * g).sum(axis=1, keepdims=True) / (size * split.compliance).sum(axis=1, keepdims=True)
    return np.broadcast_to(mean, size.shape).ravel()


def _deformation_gradients(case: Any, mesh: DeformedMesh, which: Any) -> tuple[Floats, Floats]:
    """Return F at integration points of some cells (k, 3, 3), and the volumes of the points (k,), m^3.

    For a plate, F has only components in its plane.
    """
    from softmark.solvers.mesh.element_interpolation import integrate_cells

    own, cells = integrate_cells(mesh.mesh), mesh.mesh.cells[which]
    u = np.asarray(mesh.displacement, dtype=np.float64)[cells]
    F = np.eye(3) + np.matmul(u.transpose(0, 2, 1)[:, None], own.dNdX[which])
    w = own.w[which]
    if case.depth > 0.0:  # circumference grows with the deformed radius
        r = mesh.points[cells, 0] @ own.N.T
        F[..., 2, 2] = 1.0 + (u[..., 0] @ own.N.T) / r
        w = w * r / r.mean(axis=1, keepdims=True)
    return F.reshape(-1, 3, 3), w.ravel()


def stability_warnings(declared: Declared, found: Mapping[str, Any]) -> Iterator[Diagnostic]:
    """Yield a warning if a law loses ellipticity, or else stability."""
    if (known := found.get("gives_way")) is not None:
        less = found.get("drucker")
        more = (
            f"; Drucker's stability (Hencky strain) is violated in {_format_unstable_fraction(less)}"
            if less is not None
            else ""
        )
        yield diagnostic(
            "W366",
            declared.at(),
            f"the law of `{declared.name}` loses ellipticity in "
            f"{_format_unstable_fraction(known)}, most at {_format_unstable_point(known)}",
            f"not strongly elliptic{more}",
            "strain localizes in bands one cell wide, so the result depends on the mesh: use a law that "
            "is elliptic at these strains",
        )
    elif (known := found.get("drucker")) is not None:
        yield diagnostic(
            "W385",
            declared.at(),
            f"the law of `{declared.name}` violates Drucker's stability in "
            f"{_format_unstable_fraction(known)}, most at {_format_unstable_point(known)}",
            "stress decreases as strain increases",
            "this compares Kirchhoff stress with Hencky strain; the body may have several equilibria: "
            "use constants fitted at such strains, or another law",
        )


def _format_unstable_fraction(known: Mapping[str, Any]) -> str:
    return f"{units.format_volume_fraction(known['share'])} of the volume"


def _format_unstable_point(known: Mapping[str, Any]) -> str:
    stretches = ", ".join(f"{s:.3g}" for s in known["stretches"])
    return f"{units.format_vector(known['at_m'], units.LENGTH)}, where its principal stretches are {stretches}"
