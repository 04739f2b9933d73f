"""A variation of a scene takes what it does not touch from the scene: it is what compiling all of it anew makes."""

from __future__ import annotations

from dataclasses import replace

import pytest

from softmark.grammar.diagnostic import Source
from softmark.interpreter.language.compiled_scene import Scene
from softmark.interpreter.language.compiler import recompile
from softmark.interpreter.language.parameter_overrides import Override, read_overrides
from softmark.interpreter.validation.constructor_registry import CATALOGUE
from softmark.interpreter.validation.scene_loader import load_scene
from softmark.scenes import ROOT

SCENE = """
param L = 80 mm in 10 mm .. 1 m
param half = L / 2
param nu = 0.4
material silicone = neo_hookean(young = 60 kPa, poisson = nu, density = 1070 kg/m^3)
material other    = silicone
body     beam     = solid(box(size = (L, 20, 20) mm), silicone)
region   middle   = part(beam, where = x <= half)
support  wall     = fixed(beam, where = x <= 0 mm)
load     weight   = gravity(9.81 m/s^2, direction = -z)
model    solid    = fem(hex8, strain = corotational, size = 20 mm)
model    rod      = beam6dof(segments = 8)
probe    axis     = line(beam, from = (0, 0, 0) mm, to = (L, 0, 0) mm)
metric   far      = displacement(axis, along = -z)
expect rod.far > 0 mm
"""


def both(scene: Scene, text: str) -> tuple[Scene, Scene]:
    """The variation, and the one of a scene of which nothing is known; what is said of both is the same."""
    more: list[Override] = read_overrides([text], [])
    varied, found = recompile(scene, more)
    anew, said = recompile(replace(scene, made=None), more)
    assert [(d.code, d.message, d.span) for d in found] == [(d.code, d.message, d.span) for d in said]
    assert list(varied.declared) == list(anew.declared)
    assert {n: p.value for n, p in varied.parameters.items()} == {n: p.value for n, p in anew.parameters.items()}
    assert {n: repr(d) for n, d in varied.declared.items()} == {n: repr(d) for n, d in anew.declared.items()}
    assert (varied.unused, varied.expectations) == (anew.unused, anew.expectations)
    return varied, anew


@pytest.mark.parametrize(
    ("text", "touched"),
    [
        ("L=120mm", {"beam", "middle", "wall", "axis", "far"}),
        ("nu=0.3", {"silicone", "other", "beam", "middle", "wall", "axis", "far"}),
        ("rod.segments=4", {"rod"}),
        ("silicone.young=1 Pa", {"silicone", "other", "beam", "middle", "wall", "axis", "far"}),
        ("L=2 m", None),
        ("nothing=2 m", None),
        ("rod.segments=4.5", None),
    ],
)
def test_only_what_follows_from_it_is_made_again(text: str, touched: set[str] | None) -> None:
    scene = _scene()
    varied, _ = both(scene, text)
    if touched is not None:
        assert {n for n, d in varied.declared.items() if d is not scene.declared[n]} == touched


def test_a_variation_of_a_variation_is_known_too() -> None:
    varied, _ = both(_scene(), "L=120mm")
    twice, _ = both(varied, "nu=0.3")
    assert twice.declared["rod"] is varied.declared["rod"]
    assert twice.parameters["half"].value.value == pytest.approx(0.06)  # type: ignore[union-attr]


@pytest.mark.slow
def test_every_parameter_of_shipped_scenes() -> None:
    for file in sorted(ROOT.rglob("*.scene"))[::4]:
        source = Source(str(file), file.read_text(encoding="utf-8"))
        scene, _ = load_scene(source, file.parent, file)
        for name in list(scene.parameters)[:2] if scene else ():
            both(scene, f"{name}=(1.01 * ({scene.parameters[name].text}))")


def _scene() -> Scene:
    from pathlib import Path

    from softmark.interpreter.language.compiler import compile_scene

    scene, found = compile_scene(Source("<text>", SCENE), Path(), None, (), CATALOGUE)
    assert found == []
    return scene
