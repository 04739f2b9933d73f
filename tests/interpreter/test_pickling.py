"""Reports of every kind of probe and of stress can be pickled, and the copy says the same."""

from __future__ import annotations

import pickle
from pathlib import Path

import numpy as np
import pytest

import softmark
from softmark.interpreter.vocabulary import PROBES

HEAD = """
material gel   = neo_hookean(young = 60 kPa, poisson = 0.3, density = 1000 kg/m^3)
body     bar   = solid(box(size = (40, 10, 10) mm), gel)
support  wall  = fixed(bar, where = x <= 0 mm)
load     pull  = traction(bar, where = x >= 40 mm, vector = (1, 0, 0) kPa)
model    cubes = fem(hex8, strain = finite, size = 10 mm)
analysis twice = static(states = [50, 100] %)
reference dots = markers("marks.csv", unit = 1 mm, uncertainty = 0.1 mm, states = [1, 2])
"""
SEEN = {
    "point": "point(bar, at = (20, 5, 5) mm)",
    "line": "line(bar, from = (0, 5, 5) mm, to = (40, 5, 5) mm)",
    "surface": "surface(bar)",
    "volume": "volume(bar)",
    "mesh_nodes": 'mesh_nodes(bar, mesh = mesh("sound.mesh", unit = 1 mm))',
    "markers": "markers(bar, of = dots)",
}


@pytest.mark.long
@pytest.mark.slow
def test_a_report_with_stress_at_probes_of_every_kind_can_be_pickled(tmp_path: Path) -> None:
    assert SEEN.keys() == PROBES.keys()
    text = HEAD
    for kind, probe in SEEN.items():
        text += f"probe seen_{kind} = {probe}\n"
        text += f"metric worst_{kind} = stress(seen_{kind}, component = von_mises)\n"
        text += f"metric apart_{kind} = stress(seen_{kind}, component = xx, against = cubes)\n"
    (tmp_path / "marks.csv").write_text("x0,y0,z0,x1,y1,z1,x2,y2,z2\n20,5,5,20,5,5,20,5,5\n")
    (tmp_path / "sound.mesh").write_text((Path(__file__).parents[1] / "errors/parts/sound.mesh").read_text())
    (tmp_path / "a.scene").write_text(text)
    report = softmark.load(tmp_path / "a.scene").run()
    assert not [m.message for m in report.models.values() if m.status != "converged"]
    copy = pickle.loads(pickle.dumps(report))
    assert copy.to_json() == report.to_json()
    own, other = report.models["cubes"].stress, copy.models["cubes"].stress
    np.testing.assert_array_equal(own().von_mises(), other().von_mises())
