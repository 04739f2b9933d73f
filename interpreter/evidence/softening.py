"""Where a solid of finite strain was taken to states in which its law gives way: looked at after every answer.

At every point of integration, by `solvers/materials/ellipticity.py`; of what is made of a law whose energy is
polyconvex nothing is computed. Where cells keep their volume as a whole, a law is asked with the pressure that does so.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.evidence.materials import alone
from softmark.interpreter.language import units
from softmark.interpreter.language.messages import diagnostic

if TYPE_CHECKING:
    from softmark.interpreter.evidence.kinds.voucher import Found
    from softmark.interpreter.language.scene import Declared
    from softmark.interpreter.models.shared.prepared import Moved
    from softmark.solvers.materials.constraints import Mixed
    from softmark.solvers.mesh.mesh import Floats, Mesh

ALIKE = 1e-6  # relative: strains that are nearer are one, and the first of them is told
TINY = float(np.finfo(np.float64).tiny)
LITTLE = 1e-4  # of the volume: less is not shown as a share


def facts(found: Found) -> dict[str, Any]:
    """Which share of the volume is not strongly elliptic, where it is strained most, and by what; or nothing."""
    mesh, of = found.solution.mesh, found.declared.thing.reduces
    thing = found.declared.thing if of is None else found.scene.declared[of].thing
    how = thing.stress_law
    if mesh is None or isinstance(how, str) or how[0] != "finite" or all(map(_sound, found.case.materials)):
        return {}
    worst: tuple[float, Floats, Floats] | None = None
    volume = left = 0.0
    for case, which in alone(found.case, mesh):
        part = mesh.mesh if isinstance(which, slice) else replace(mesh.mesh, cells=mesh.mesh.cells[which])
        volume += float(np.abs(part.volumes).sum())
        if _sound(case.material):
            continue
        F, w = _strained(case, mesh, which)
        gone = _lost(case, mesh, part, which, how[1], F, w)
        if gone is None or not gone.any():
            continue
        left += float(w[gone].sum())
        s = np.linalg.svd(F[gone], compute_uv=False)
        far = np.abs(np.log(np.maximum(s, TINY))).max(axis=1)
        place = int((far >= (1.0 - ALIKE) * far.max()).argmax())
        if worst is None or far[place] > worst[0]:
            from softmark.interpreter.models.shared.graded import places

            X = places(part, part.element.quadrature()).reshape(-1, 3)
            worst = float(far[place]), X[gone][place], s[place]
    if worst is None:
        return {}
    return {"gives_way": {"share": left / volume, "at_m": worst[1].tolist(), "stretches": worst[2].tolist()}}


def _lost(case: Any, mesh: Moved, part: Mesh, which: Any, way: str, F: Floats, w: Floats) -> Any:
    """At which points of some cells (k,) the law is not strongly elliptic; None of one that is not isotropic."""
    from softmark.solvers.materials import law_for, mixed_for
    from softmark.solvers.materials.ellipticity import Held, lost

    material = case.material
    if not case.uniform:
        from softmark.interpreter.models.shared.graded import material_at

        material = material_at(material, part, part.element.quadrature())
    split = None if way == "full" or material.thin else mixed_for(material, "finite")
    if split is None:
        return lost(law_for(material, "finite"), F)
    modulus = np.ravel(split.modulus) if np.ndim(split.modulus) else split.modulus
    return lost(split.shape, F, Held(split.constraint, modulus, _pressure(split, mesh, part, which, way, F, w)))


def _pressure(split: Mixed, mesh: Moved, part: Mesh, which: Any, way: str, F: Floats, w: Floats) -> Floats:
    """What keeps the volume of cells, at their points (k,), Pa: an unknown, or M times the mean of the constraint."""
    if way == "mixed" and mesh.pressures is not None:
        from softmark.solvers.mesh.pressures import pressures

        found: Floats = mesh.pressures[which] @ pressures(part, part.element.quadrature()).N.T
        return found.ravel()
    size = w.reshape(len(part.cells), -1)
    g = split.constraint.value(F).reshape(size.shape)
    mean = (size * g).sum(axis=1, keepdims=True) / (size * split.compliance).sum(axis=1, keepdims=True)
    return np.broadcast_to(mean, size.shape).ravel()


def _strained(case: Any, mesh: Moved, which: Any) -> tuple[Floats, Floats]:
    """F at the points of integration of some cells (k, 3, 3), and their volumes (k,), m^3; of a plate in its plane."""
    from softmark.solvers.mesh.interpolation import integration

    own, cells = integration(mesh.mesh), mesh.mesh.cells[which]
    u = np.asarray(mesh.displacement, dtype=np.float64)[cells]
    F = np.eye(3) + np.matmul(u.transpose(0, 2, 1)[:, None], own.dNdX[which])
    w = own.w[which]
    if case.depth > 0.0:  # rings grow as they move out, and those farther out are longer
        r = mesh.points[cells, 0] @ own.N.T
        F[..., 2, 2] = 1.0 + (u[..., 0] @ own.N.T) / r
        w = w * r / r.mean(axis=1, keepdims=True)
    return F.reshape(-1, 3, 3), w.ravel()


def _sound(material: Any) -> bool:
    """Whether no state of a material gives way, known of its constants alone; or it remembers, and nothing is known."""
    return bool(getattr(material, "polyconvex", False)) or bool(getattr(material, "branches", ()))


def said(declared: Declared, found: Mapping[str, Any]) -> Iterator[Diagnostic]:
    """A warning where a law gives way."""
    if (known := found.get("gives_way")) is None:
        return
    share = "less than 0.01 %" if known["share"] < LITTLE else f"{100.0 * known['share']:.3g} %"
    stretches = ", ".join(f"{s:.3g}" for s in known["stretches"])
    yield diagnostic(
        "W366",
        declared.at(),
        f"the law of `{declared.name}` gives way in {share} of the volume, most at "
        f"{units.show_all(known['at_m'], units.LENGTH)}, where its principal stretches are {stretches}",
        "not strongly elliptic there",
        "strain gathers in bands as thin as its cells, and what is found depends on them: use a law that holds there",
    )
