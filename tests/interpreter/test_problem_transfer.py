"""What a scene says beyond a body, clamps and dead loads is told to no program: each says so, and none drops it."""

from __future__ import annotations

from pathlib import Path

import pytest

import softmark
from softmark.interpreter.models.external.adapters import PROGRAMS
from softmark.interpreter.models.external.exporters import FORMATS
from softmark.interpreter.pipeline.run_options import RunOptions
from softmark.interpreter.report.exam_export.exam_input_files import export

LAW = "neo_hookean_isochoric(young = 60 kPa, poisson = 0.3, density = 1000 kg/m^3)"
SCENE = """softmark 1
scene "told"
material base = {law}
body block = solid(box(size = (20, 10, 10) mm), {of})
support wall = fixed(block, where = x <= 0 mm)
load weight = gravity(9.81 m/s^2, direction = -z)
probe end = point(block, at = (20, 5, 5) mm)
metric drop = displacement(end, along = -z)
"""
FLOOR = (
    "body floor = rigid(box(size = (90, 90, 5) mm, origin = (-40, -40, -6) mm))\n"
    "contact touch = rigid_contact(floor, block)"
)
FACE = "where = x >= 20 mm"
MOVES = "analysis fall = dynamic(duration = 10 ms, step = 0.5 ms"
SAID = {  # what a scene says, and what of it is named by every program that could compute the rest
    FLOOR: "contact `touch`",
    "contact touch = self_contact(block)": "contact `touch`",
    "contact touch = tied(block)": "contact `touch`",
    "support bed = elastic_foundation(block, where = z <= 0 mm, stiffness = 10 kPa/mm)": "support `bed`",
    "support plate = rigid_plate(block, where = x >= 20 mm)": "support `plate`",
    f"support twist = rotated(block, {FACE}, axis = +x, angle = 20 deg)": "support `twist`",
    "load press = pressure(block, where = z >= 10 mm, magnitude = 100 Pa)": "load `press`",
    f"load twist = torque(block, {FACE}, moment = (1, 0, 0) mN*mm)": "load `twist`",
    "analysis rest = static(path = arc_length)": "path = arc_length",
    "analysis wait = quasistatic(duration = 1 s, step = 0.5 s)": "the quasistatic analysis",
    "material own = active(base, own = +x, tension = 1 kPa)": "the muscle Active",
    "material own = active_strain(base, own = +x, shortening = 10 %)": "the directed ActiveStrain",
    f"material own = {LAW.replace('60 kPa', '60 kPa * (1 + x / 20 mm)')}": "the graded NeoHookeanIsochoric",
    "material own = viscoelastic(base, g = [0.5], tau = [1 s])\n"
    "analysis wait = quasistatic(duration = 1 s, step = 0.5 s)": "viscoelastic material",
}
MOVING = {
    FLOOR: "contact `touch`",
    "support bed = elastic_foundation(block, where = z <= 0 mm, stiffness = 10 kPa/mm)": "support `bed`",
    f"support pull = displaced(block, {FACE}, by = (1, 0, 0) mm)": "support `pull`",
    "load press = pressure(block, where = z >= 10 mm, magnitude = 100 Pa)": "load `press`",
    f"load late = traction(block, {FACE}, vector = (9, 0, 0) Pa, amplitude = ramp(over = 5 ms))": "load `late`",
}


def said(more: str, moving: bool) -> dict[str, str]:
    """Warnings of all programs that solve such analyses."""
    able = [name for name, own in PROGRAMS.items() if bool(own.moves) == moving and "finite" in own.laws]
    lines = [more, *(f"model {name} = external_solver({name}, tet4, strain = finite, size = 5 mm)" for name in able)]
    text = SCENE.format(law=LAW, of="own" if "material own" in more else "base") + "\n".join(lines)
    warnings = softmark.loads(text + (f"\n{MOVES})" if moving else "") + "\n").warnings
    found = dict.fromkeys(able, "")
    return found | {w.message.split("`")[1]: w.message for w in warnings if w.code == "W710"}


@pytest.mark.parametrize("moving", [False, True])
def test_what_has_no_words_for_others_is_never_dropped(moving: bool) -> None:
    for more, what in (MOVING if moving else SAID).items():
        assert {name for name, message in said(more, moving).items() if what not in message} == set(), more


@pytest.mark.parametrize("to", sorted(FORMATS))
def test_no_file_is_written_without_its_contact(to: str, tmp_path: Path) -> None:
    text = SCENE.format(law=LAW, of="base") + f"{FLOOR}\nmodel ours = fem(tet4, strain = finite, size = 5 mm)\n"
    with pytest.raises(softmark.SceneError, match="contact `touch`"):
        export(softmark.loads(text).scene, to, (), tmp_path, RunOptions(draw=False))
