"""Scenes of bodies at random between rigid ones, each of a seed: in space, in plane strain and around an axis."""

from __future__ import annotations

import random
from typing import Any

LAWS = (
    "neo_hookean(young = {E:.3g} kPa, poisson = {nu}, density = 1000 kg/m^3)",
    "linear_elastic(young = {E:.3g} kPa, poisson = {nu}, density = 1000 kg/m^3)",
    "mooney_rivlin(c1 = {E:.3g} kPa, c2 = {F:.3g} kPa, poisson = 0.5, density = 1000 kg/m^3)",
    "yeoh(c1 = {E:.3g} kPa, c3 = {F:.3g} kPa, poisson = 0.5, density = 1000 kg/m^3)",
    "ogden(mu = [{E:.3g}] kPa, alpha = [3], poisson = {nu}, density = 1000 kg/m^3)",
)
ROUND = (  # what is a body of revolution about the way in which it presses, `up`
    "half_space(origin = {at}, normal = {down})",
    "sphere(radius = {r} mm, origin = {over})",
    "punch(radius = {r} mm, rounding = {round} mm, length = 20 mm, axis = {up}, origin = {at})",
    "rounded_cone(angle = 120 deg, rounding = {round} mm, length = 20 mm, axis = {up}, origin = {at})",
    "cylinder(radius = {r} mm, length = 10 mm, axis = {up}, origin = {at})",
    "cone(radius = {r} mm, length = {r} mm, axis = {way}, origin = {over})",
)
BLUNT = (
    "rounded_box(size = ({r}, {r}, 10) mm, rounding = {round} mm, origin = {at})",
    "box(size = ({r}, {r}, 10) mm, origin = {at})",
    "cylinder(radius = {r} mm, length = 40 mm, axis = +y, origin = ({x:.3g}, -10, {high:.3g}) mm)",
    "difference(box(size = ({r}, {r}, 10) mm, origin = {at}), sphere(radius = {round} mm, origin = {at}))",
)
LONG = (  # what is a cylinder along z
    "half_space(origin = {at}, normal = {down})",
    "cylinder(radius = {r} mm, length = 40 mm, axis = +z, origin = ({x:.3g}, {high:.3g}, -20) mm)",
    "box(size = ({r}, 10, 40) mm, origin = ({x:.3g}, {top:.3g}, -20) mm)",
    "rounded_box(size = ({r}, 10, 40) mm, rounding = {round} mm, origin = ({x:.3g}, {top:.3g}, -20) mm)",
    "extruded(corners = [({x:.3g}, {top:.3g}), (30, {high:.3g}), (-9, {high:.3g})] mm, height = 40 mm, base = -20 mm)",
)
SCENE = """softmark 1
scene "squeezed"
material gel   = {law}
body     block = {body}
body     floor = rigid(half_space(origin = {low}, normal = {up}))
body     tool  = rigid({tool})
support  held  = fixed(block, where = {held})
support  hand  = displaced(tool, by = {by}, amplitude = per_state)
contact  under = rigid_contact(floor, block{rough})
contact  over  = rigid_contact(tool, block{rubs})
analysis press = static(states = [25, 50, 100] %)
model    fe    = fem({element}, size = {size} mm, strain = {strain}{more})
metric   push  = force(over, along = -{along})
metric   base  = force(held, along = +{along})
metric   rest  = force(under, along = +{along})
"""
KINDS = {  # of a planar problem or of space: elements, tools, and the coordinate along which is pressed
    "solid": (("hex8", "tet4", "tet10", "hex20"), ROUND + BLUNT, "z"),
    "plane_strain": (("quad4", "quad8", "tri6", "tri3"), LONG, "y"),
    "axisymmetric": (("quad4", "quad8", "tri6", "tri3"), ROUND, "y"),
}
HELD = "{along} <= 0 mm", "{beside}"  # below, where nothing is left to the floor, or beside


def squeezed(seed: int) -> str:
    """A scene of a seed: of a block, its law, its elements, what presses on it from above and what it lies on."""
    one = random.Random(seed)
    law, kind = one.choice(LAWS), one.choice(("solid", "solid", "plane_strain", "axisymmetric"))
    full = "poisson = 0.5" in law
    elements, tools, along = KINDS[kind]
    element = one.choice([e for e in elements if e in ("tet10", "quad8", "tri6")] if full else elements)
    a, b, c = (one.choice((8, 12, 20)) for _ in range(3))
    r, top = one.choice((3, 6, 10)), c + one.choice((0.0, 0.1))
    x, y = (0.0, 0.0) if kind == "axisymmetric" else (one.uniform(0, a), one.uniform(0, b))

    def way(p: float, q: float, s: float) -> str:
        return f"({p:.3g}, {q:.3g}, {s:.4g})" if along == "z" else f"({p:.3g}, {s:.4g}, 0)"

    drag = one.choice((0.0, 0.0, 0.1 * a)) if kind != "axisymmetric" else 0.0
    low = -one.choice((0.0, 0.5))
    tool = one.choice(tools).format(
        at=f"{way(x, y, top)} mm", over=f"{way(x, y, top + r)} mm", down=way(0, 0, -1), r=r, round=0.3 * r, x=x,
        top=top, high=top + r, up=f"+{along}", way=f"-{along}",
    )  # fmt: skip
    held = one.choice(HELD).format(along=along, beside=f"x >= {a} mm" if kind == "axisymmetric" else "x <= 0 mm")
    depth, rubs = -one.uniform(0.02, 0.4) * c - (top - c), [one.choice((0.0, 0.0, one.uniform(0.0, 1.0))) for _ in "ab"]
    region = f"quadrilateral((0, 0, 0) mm, ({a}, 0, 0) mm, ({a}, {c}, 0) mm, (0, {c}, 0) mm), gel"
    return SCENE.format(
        law=law.format(E=10 ** one.uniform(-1, 4), F=10 ** one.uniform(-2, 1), nu=one.choice((0.0, 0.3, 0.45))),
        body={"solid": f"solid(box(size = ({a}, {b}, {c}) mm), gel)", "axisymmetric": f"axisymmetric({region})",
              "plane_strain": f"plane_strain({region}, thickness = {b} mm)"}[kind],
        low=f"{way(0, 0, low)} mm", up=way(0, 0, 1), tool=tool, held=held, along=along,
        by=f"{way(drag, 0, depth)} mm", rough=f", friction = {rubs[0]:.2g}" if rubs[0] else "",
        rubs=f", friction = {rubs[1]:.2g}" if rubs[1] else "", element=element,
        size=one.choice((4, 6)) if kind == "solid" else one.choice((1, 2)),
        strain="small" if law.startswith("linear") else "finite", more=", formulation = mixed" if full else "",
    )  # fmt: skip


def unlike(found: Any) -> str:
    """What is wrong with an answer of such a scene, if anything: nodes behind a surface, forces that are nowhere."""
    if found.status != "converged":
        return ""
    for name, seen in found.solve["checks"]["contact"].items():
        if seen["least_gap"] is not None and not seen["least_gap"] > 0.0:
            return f"{name}: a node is behind"
    push, base, rest = (found.metrics[name].value for name in ("push", "base", "rest"))
    if None in (push, base, rest):
        return "a force is missing"
    return (
        ""
        if abs(push - base - rest) <= 1e-6 * max(abs(push), abs(rest)) + 1e-12
        else f"{push} is pressed, {base} + {rest} carried"
    )
