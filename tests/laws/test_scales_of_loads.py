"""A bar in tension over scales of load, stiffness and length: elongation, stress and reaction have a closed form.

Under a traction p that is small against Young's modulus E, u = p L / E, sigma = p and the reaction is p w^2. In finite
strain the answers differ from these by the strain, at most 2e-5 here, and by the rounding of laws, 1e-8 (its square is
where a law stops being linear, see solvers/energies/displacement_gradient_scaling.py).
"""

from __future__ import annotations

import itertools
import json
from pathlib import Path

import pytest

from softmark.interpreter.cli.main import main

SCENE = """softmark 1
scene "a bar in tension"
material own = {law}(young = {E!r} Pa, poisson = 0.3, density = 1000 kg/m^3)
body bar = solid(box(size = ({L!r}, {w!r}, {w!r}) m), own)
support wall = fixed(bar, where = x <= 0 m, components = x)
support front = fixed(bar, where = y <= 0 m, components = y)
support below = fixed(bar, where = z <= 0 m, components = z)
load w = traction(bar, where = x >= {L!r} m, vector = ({p!r}, 0, 0) Pa)
analysis rest = static()
model m = fem({model}, size = {size!r} m)
probe end = point(bar, at = ({L!r}, {h!r}, {h!r}) m)
probe mid = point(bar, at = ({m!r}, {h!r}, {h!r}) m)
metric far = displacement(end, along = +x)
metric pulled = stress(mid, component = xx)
metric pull = force(wall, along = -x)
"""
MODELS = {
    "hex8": ("linear_elastic", "hex8, strain = small"),
    "hex8 selective": ("linear_elastic", "hex8, strain = small, integration = selective"),
    "hex20 mixed": ("linear_elastic", "hex20, strain = small, formulation = mixed"),
    "tet4 corotational": ("linear_elastic", "tet4, strain = corotational"),
    "hex8 finite": ("neo_hookean", "hex8, strain = finite"),
    "hex20 finite": ("st_venant_kirchhoff", "hex20, strain = finite"),
    "hex8 mean dilatation": ("neo_hookean", "hex8, strain = finite, formulation = mean_dilatation"),
    "tet10 mixed": ("neo_hookean", "tet10, strain = finite, formulation = mixed"),
}
LENGTHS, MODULI, FORCES = (1e-9, 1e-3, 1.0, 1e3), (1.0, 1e6, 1e12), (1e-18, 1e-9, 1e-3, 1.0, 1e6, 1e12)
SCALES = [(L, E, F) for L, E, F in itertools.product(LENGTHS, MODULI, FORCES) if F < 1e-5 * (0.2 * L) ** 2 * E]
QUICK = {(1e-9, 1e12, 1e-18), (1.0, 1e12, 1e-9), (1e3, 1e12, 1e-18)}
CASES = [
    pytest.param(name, *scale, marks=[] if scale in QUICK else [pytest.mark.slow], id=f"{name} {scale}")
    for name in MODELS
    for scale in SCALES
]


@pytest.mark.parametrize(("name", "length", "young", "force"), CASES)
def test_a_bar_at_every_scale(name: str, length: float, young: float, force: float, tmp_path: Path) -> None:
    law, model = MODELS[name]
    w = 0.2 * length
    p = force / w**2
    (file := tmp_path / "bar.scene").write_text(
        SCENE.format(law=law, model=model, E=young, L=length, w=w, p=p, m=0.45 * length, h=0.5 * w, size=w)
    )
    assert main(["run", str(file), "--json", str(tmp_path / "bar.json"), "--out", str(tmp_path / "out")]) == 0
    found = json.loads((tmp_path / "bar.json").read_text())["models"]["m"]
    assert found["status"] == "converged"
    off = 1e-9 if "strain = small" in model else 3e-5 if p > 1e-9 * young else 2e-7
    for metric, right in (("far", p * length / young), ("pulled", p), ("pull", force)):
        assert found["metrics"][metric]["value"] == pytest.approx(right, rel=off, abs=0.0)
