"""Results of other programs as models, and `dsl judge`: held against fields that are known in closed form."""

from __future__ import annotations

import io
import json
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest

from softmark import SceneError, loads
from softmark.interpreter.cli.main import main
from softmark.interpreter.verification.unit_mismatch import other_units

SCENE = """softmark 1
scene "Block"
material gel   = neo_hookean(young = 10 kPa, poisson = 0.3, density = 1000 kg/m^3)
body     block = solid(box(size = (40, 20, 20) mm), gel)
load     weight = gravity(9.81 m/s^2)
support  floor = fixed(block, where = z <= 0 mm)
probe    end   = point(block, at = (37, 11, 17) mm)
probe    axis  = line(block, from = (0, 10, 10) mm, to = (40, 10, 10) mm, points = 9)
metric   out   = displacement(end, along = +x)
metric   down  = displacement(end, along = -z)
"""
A = np.array([[0.02, 0.01, -0.03], [0.004, -0.01, 0.02], [-0.05, 0.03, 0.01]])
B = np.array([1.0, -2.0, 0.5])  # mm
END = A @ [37.0, 11.0, 17.0] + B  # mm: linear fields are those of every mesh


def block(n: int = 2) -> tuple[np.ndarray, np.ndarray]:
    """Points, mm, and hexahedra of the body."""
    x, y, z = np.meshgrid(np.linspace(0, 40, 2 * n + 1), *[np.linspace(0, 20, n + 1)] * 2, indexing="ij")
    points = np.column_stack([x.ravel(), y.ravel(), z.ravel()])
    ids = np.arange(len(points)).reshape(x.shape)
    corners = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
    cells = [ids[i : i + x.shape[0] - 1, j : j + n, k : k + n].ravel() for i, j, k in corners]
    return points, np.column_stack(cells)


def written(file: Path, factor: float = 1.0, unit: float = 1.0, deformed: bool = False, **fields: np.ndarray) -> Path:
    """A mesh with `factor` times the linear field, in units of so many mm."""
    points, cells = block()
    u = factor * (points @ A.T + B)
    own = {} if deformed else {"displacement": u / unit}
    meshio.write(
        file, meshio.Mesh((points + deformed * u) / unit, [("hexahedron", cells)], point_data={**own, **fields})
    )
    return file


def series(folder: Path, times: list[float]) -> Path:
    """A series whose displacements are their time times the field."""
    lines = []
    for number, time in enumerate(times):
        written(folder / f"s{number}.vtu", time)
        lines.append(f'<DataSet timestep="{time}" part="0" file="s{number}.vtu"/>')
    text = f'<VTKFile type="Collection" version="0.1"><Collection>{"".join(lines)}</Collection></VTKFile>'
    (folder / "s.pvd").write_text(text, encoding="utf-8")
    return folder / "s.pvd"


def judged(words: str, more: str = "") -> Any:
    """The report's entry of a model."""
    return loads(f"{SCENE}{more}model theirs = {words}\n").run().models["theirs"]


def measured(model: Any) -> np.ndarray:
    """What the metrics are, mm."""
    return 1e3 * np.array([model.metrics["out"].value, model.metrics["down"].value])


@pytest.mark.parametrize(("unit", "word"), [(1e3, "1 m"), pytest.param(1.0, "1 mm", marks=pytest.mark.slow)])
def test_a_linear_field_is_read_at_every_point(tmp_path: Path, unit: float, word: str) -> None:
    """Meshio writes 17 digits; a linear field is that of trilinear cells to rounding."""
    model = judged(f'results("{written(tmp_path / "a.vtu", unit=unit)}", unit = {word})')
    assert model.status == "read"
    np.testing.assert_allclose(measured(model), [END[0], -END[2]], rtol=1e-12)
    own = model.probes["axis"]
    np.testing.assert_allclose(own.displacement * 1e3, own.points * 1e3 @ A.T + B, rtol=1e-10, atol=1e-12)
    assert model.solve["match"]["volume"] == pytest.approx(1.0, rel=1e-12)
    assert model.to_json()["time"]["solve_s"]["reason"] == "nothing was solved here"


def test_points_that_moved_are_displacements(tmp_path: Path) -> None:
    there, rest = written(tmp_path / "a.vtu", deformed=True), written(tmp_path / "r.vtu", 0.0)
    model = judged(f'results("{there}", unit = 1 mm, at = "position", rest = "{rest}", within = 5 mm)')
    np.testing.assert_allclose(measured(model), [END[0], -END[2]], rtol=1e-12)


def test_points_that_moved_already_are_told_from_undeformed_ones(tmp_path: Path) -> None:
    """Some programs write both; taken for undeformed, they would be looked at in other places."""
    points, _ = block()
    file = written(tmp_path / "a.vtu", deformed=True, displacement=points @ A.T + B)
    with pytest.raises(SceneError, match="already include"):
        judged(f'results("{file}", unit = 1 mm, within = 5 mm)')


def test_points_alone_are_read_between_them(tmp_path: Path) -> None:
    """A linear field is that of every simplex, to the digits that are written."""
    points, _ = block()
    rows = np.column_stack([points, points @ A.T + B])
    file = tmp_path / "a.csv"
    np.savetxt(file, rows, delimiter=",", header="x,y,z,ux,uy,uz", comments="", fmt="%.17g")
    model = judged(f'results("{file}", unit = 1 mm)')
    np.testing.assert_allclose(measured(model), [END[0], -END[2]], rtol=1e-9)


def test_a_table_at_the_points_of_a_probe_is_enough_and_tells_nothing_beside_them(tmp_path: Path) -> None:
    points = np.array([[37.0, 11.0, 17.0], *([5.0 * i, 10.0, 10.0] for i in range(9))])[[3, 1, 0, 2, 4, 5, 6, 7, 8, 9]]
    for name, rows in (("all", points), ("end", points[2:3])):
        told = np.column_stack([rows, rows @ A.T + B])
        np.savetxt(tmp_path / name, told, delimiter=",", header="x,y,z,ux,uy,uz", comments="", fmt="%.17g")
        (tmp_path / name).rename(tmp_path / f"{name}.csv")
    model = judged(f'results("{tmp_path / "all.csv"}", unit = 1 mm)')
    np.testing.assert_allclose(measured(model), [END[0], -END[2]], rtol=1e-12)
    with pytest.raises(SceneError, match=r"E701.*its points span no volume, and a probe is .* mm away from them"):
        judged(f'results("{tmp_path / "end.csv"}", unit = 1 mm)')


@pytest.mark.slow
def test_a_motion_is_that_of_the_series(tmp_path: Path) -> None:
    more = "analysis fall = dynamic(duration = 250 ms, step = 10 ms, integrator = newmark)\n"
    model = judged(f'results("{series(tmp_path, [0.0, 100.0, 200.0, 300.0])}", unit = 1 mm, time = 1 ms)', more)
    assert measured(model)[0] == pytest.approx(250.0 * END[0], rel=1e-12)
    seen = model.probes["end"]
    np.testing.assert_allclose(seen.times, [0.0, 0.1, 0.2, 0.25], rtol=1e-12)  # what comes later is of no motion here
    np.testing.assert_allclose(1e3 * seen.course[:, 0, 0], seen.times * 1e3 * END[0], rtol=1e-12)
    with pytest.raises(SceneError, match="E703"):
        judged(f'results("{tmp_path / "s.pvd"}", unit = 1 mm)', more.replace("250 ms", "400 s"))


def test_states_are_matched_by_their_value(tmp_path: Path) -> None:
    more = "analysis both = static(states = [50, 100] %)\n"
    more += "support lid = displaced(block, where = z >= 20 mm, by = (0, 0, -1) mm, amplitude = per_state)\n"
    model = judged(f'results("{series(tmp_path, [0.0, 0.5, 1.0])}", unit = 1 mm)', more)
    np.testing.assert_allclose(model.metrics["out"].states, [0.5e-3 * END[0], 1e-3 * END[0]], rtol=1e-12)


@pytest.mark.slow
def test_what_would_need_a_solution_says_so(tmp_path: Path) -> None:
    more = "metric held = force(floor, along = +z)\nmetric hard = stress(end, component = von_mises)\n"
    more += "model own = fem(hex8, size = 20 mm, strain = small)\n"
    model = judged(f'results("{written(tmp_path / "a.vtu")}", unit = 1 mm)', more)
    for name in ("held", "hard"):
        assert model.metrics[name].value is None
        assert "read from a file" in str(model.metrics[name].reason)


def test_a_file_is_judged_that_the_scene_does_not_mention(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    scene, file = tmp_path / "block.scene", written(tmp_path / "some file.vtu")
    scene.write_text(SCENE, encoding="utf-8")
    assert main(["judge", str(scene), str(file), "--unit", "1mm", "--as", "sofa", "--json", "-"]) == 0
    known = json.loads(capsys.readouterr().out)["models"]
    assert known["sofa"]["status"] == "read"
    assert known["sofa"]["metrics"]["out"]["value"] == pytest.approx(1e-3 * END[0], rel=1e-12)
    assert main(["judge", str(scene), str(file)]) == 2
    assert "`unit = 1 mm`" in capsys.readouterr().err
    assert main(["judge", str(scene), str(file), "--as", "a", "--as", "b"]) == 2
    capsys.readouterr()
    assert main(["judge", str(scene), str(file), "--unit", "1mm", "--as", "block"]) == 2
    assert "the scene already declares `block`" in (said := capsys.readouterr().err)
    assert "`--as block_2`" in said
    with monkeypatch.context() as piped:  # a scene of standard input, which can be read once
        piped.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(SCENE.encode())))
        assert main(["judge", "-", str(file), "--unit", "1mm", "--json", "-"]) == 0
    assert list(json.loads(capsys.readouterr().out)["models"]) == ["some_file"]
    called = file.rename(tmp_path / "block.vtu")  # of itself it gets a name that is free
    assert main(["judge", str(scene), str(called), "--unit", "1mm", "--json", "-"]) == 0
    assert list(json.loads(capsys.readouterr().out)["models"]) == ["block_2"]


def test_a_model_that_it_is_held_against_is_computed_too(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Without being named, and once if it is named; a model that no metric names is not."""
    scene, file = tmp_path / "block.scene", written(tmp_path / "a.vtu")
    scene.write_text(f"""{SCENE}model own = fem(hex8, size = 20 mm, strain = small)
        model idle = fem(tet4, size = 20 mm, strain = small)
        metric apart = max_error(axis, against = own)
    """, encoding="utf-8")  # fmt: skip
    command = ["judge", str(scene), str(file), "--unit", "1mm", "--as", "sofa", "--json", "-"]
    for more in ([], ["--model", "sofa", "--model", "own"]):
        assert main([*command, *more]) == 0
        known = json.loads(capsys.readouterr().out)["models"]
        assert sorted(known) == ["own", "sofa"]
        assert known["sofa"]["metrics"]["apart"]["value"] > 0


def test_a_model_of_a_used_scene_is_computed_too_or_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A metric without a value would leave the exit status at 0."""
    scene, file = tmp_path / "block.scene", written(tmp_path / "a.vtu")
    text = SCENE + "model own = fem(hex8, size = 20 mm, strain = small)\n"
    (tmp_path / "used.scene").write_text(text, encoding="utf-8")
    use = 'use "used.scene" as used\n'
    body = use + "".join(line for line in text.splitlines(True) if "scene" not in line and "softmark" not in line)
    own = body.replace("fem(hex8, size = 20 mm, strain = small)", "used.own")
    scene.write_text(own + "metric apart = max_error(axis, against = own)\n", encoding="utf-8")
    command = ["judge", str(scene), str(file), "--unit", "1mm", "--as", "sofa", "--json", "-"]
    assert main(command) == 0
    known = json.loads(capsys.readouterr().out)["models"]
    assert sorted(known) == ["own", "sofa"]
    assert known["sofa"]["metrics"]["apart"]["value"] > 0
    scene.write_text(f"""{use}support floor = fixed(used.block, where = z <= 0 mm)
        load weight = gravity(9.81 m/s^2)
        probe axis = line(used.block, from = (0, 10, 10) mm, to = (40, 10, 10) mm, points = 9)
        metric apart = max_error(axis, against = used.own)
    """, encoding="utf-8")  # fmt: skip
    assert main([*command, "--body", "used.block"]) == 2
    assert "`apart` needs `used.own`" in capsys.readouterr().err


@pytest.mark.slow
def test_what_our_own_report_wrote_is_judged_the_same(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Displacements are written as doubles: every metric of displacements is the same to their last digits."""
    scene = tmp_path / "block.scene"
    scene.write_text(f"{SCENE}model own = fem(tet10, size = 10 mm, strain = finite)\n", encoding="utf-8")
    assert main(["run", str(scene), "--vtu", "--out", str(tmp_path / "own")]) == 0
    own = json.loads((tmp_path / "own" / "report.json").read_text(encoding="utf-8"))["models"]["own"]["metrics"]
    capsys.readouterr()
    assert main(["judge", str(scene), str(tmp_path / "own" / "vtu" / "own.vtu"), "--as", "again", "--json", "-"]) == 0
    again = json.loads(capsys.readouterr().out)["models"]["again"]["metrics"]
    for name in ("out", "down"):
        assert again[name]["value"] == pytest.approx(own[name]["value"], rel=1e-12)


DECK = """*NODE, NSET=ALL
{nodes}
*ELEMENT, TYPE=C3D8, ELSET=EALL
{cells}
*NSET, NSET=LEFT
{left}
*NSET, NSET=RIGHT
{right}
*MATERIAL, NAME=GEL
*ELASTIC
0.01, 0.3
*SOLID SECTION, ELSET=EALL, MATERIAL=GEL
*STEP
*STATIC
*BOUNDARY
LEFT, 1, 1
1, 2, 3
{corner}, 3, 3
RIGHT, 1, 1, 0.4
*NODE FILE
U
*END STEP
"""


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("ccx") is None, reason="CalculiX is not there")
def test_what_calculix_has_written_is_judged(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A bar drawn out by 1 % between smooth ends: u = 0.01 x, -0.003 y, -0.003 z. Its FRD has six digits."""
    points, cells = block()
    ids = np.arange(len(points)) + 1
    deck = DECK.format(
        nodes="\n".join(f"{i}, {x}, {y}, {z}" for i, (x, y, z) in zip(ids, points, strict=True)),
        cells="\n".join(f"{i + 1}, {', '.join(map(str, c + 1))}" for i, c in enumerate(cells)),
        left=",\n".join(map(str, ids[points[:, 0] == 0])),
        right=",\n".join(map(str, ids[points[:, 0] == 40])),
        corner=int(ids[(points == [0, 20, 0]).all(axis=1)][0]),
    )
    (tmp_path / "bar.inp").write_text(deck, encoding="utf-8")
    subprocess.run(["ccx", "bar"], cwd=tmp_path, check=True, capture_output=True, timeout=60)
    scene = tmp_path / "block.scene"
    scene.write_text(SCENE, encoding="utf-8")
    assert main(["judge", str(scene), str(tmp_path / "bar.frd"), "--unit", "1mm", "--json", "-"]) == 0
    found = json.loads(capsys.readouterr().out)["models"]["bar"]["metrics"]
    assert found["out"]["value"] == pytest.approx(0.37e-3, rel=1e-5)
    assert found["down"]["value"] == pytest.approx(0.003 * 17e-3, rel=1e-5)


SLICE = """softmark 1
scene "Slice"
material gel   = neo_hookean(young = 10 kPa, poisson = 0.3, density = 1000 kg/m^3)
body     plate = BODY
load     weight = gravity(9.81 m/s^2, direction = -y)
support  floor = fixed(plate, where = y <= 0 mm)
probe    end   = point(plate, at = (37, 11, 0) mm)
metric   out   = displacement(end, along = +x)
metric   down  = displacement(end, along = -y)
"""
REGION = "quadrilateral((0, 0, 0) mm, (40, 0, 0) mm, (40, 20, 0) mm, (0, 20, 0) mm), gel"
FLAT = A * np.array([[1.0], [1.0], [0.0]]) * [1.0, 1.0, 0.0]  # of x and y alone
FLAT_END = FLAT @ [37.0, 11.0, 0.0]  # mm


def of_a_slice(file: Path, kind: str, backwards: bool = False) -> Path:
    """A linear field on a plane mesh, mm: one quadrilateral, two triangles, or points alone."""
    x, y = np.meshgrid(np.linspace(0, 40, 5), np.linspace(0, 20, 5), indexing="ij")
    points = np.column_stack([x.ravel(), y.ravel(), 0.0 * x.ravel()])
    ids = np.arange(25).reshape(5, 5)
    a, b, c, d = (own.ravel() for own in (ids[:-1, :-1], ids[1:, :-1], ids[1:, 1:], ids[:-1, 1:]))
    two = ids[::2, ::2]
    e, f, g, h = (own.ravel() for own in (two[:-1, :-1], two[1:, :-1], two[1:, 1:], two[:-1, 1:]))
    between = [(e + f) // 2, (f + g) // 2, (g + h) // 2, (h + e) // 2]
    cells = {
        "quad": np.column_stack([a, b, c, d]),
        "triangle": np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])]),
        "quad8": np.column_stack([e, f, g, h, *between]),
        "quad9": np.column_stack([e, f, g, h, *between, (e + g) // 2]),
    }
    u = points @ FLAT.T
    if kind == "points":
        rows = np.column_stack([points, u])
        np.savetxt(file, rows, delimiter=",", header="x,y,z,ux,uy,uz", comments="", fmt="%.17g")
        return file
    own = cells[kind][:, ::-1] if backwards else cells[kind]
    meshio.write(file, meshio.Mesh(points, [(kind, own)], point_data={"displacement": u}))
    return file


@pytest.mark.parametrize(
    ("body", "kind", "backwards"),
    [
        (f"plane_strain({REGION}, thickness = 3 mm)", "quad", False),
        (f"plane_strain({REGION}, thickness = 3 mm)", "quad", True),
        (f"plane_strain({REGION}, thickness = 3 mm)", "quad8", False),
        (f"plane_strain({REGION}, thickness = 3 mm)", "quad9", False),
        (f"plane_stress({REGION}, thickness = 3 mm)", "triangle", False),
        (f"plane_stress({REGION}, thickness = 3 mm)", "points", False),
        (f"axisymmetric({REGION})", "quad", False),
    ],
)
def test_a_slice_is_read_of_plane_cells(tmp_path: Path, body: str, kind: str, backwards: bool) -> None:
    """A linear field is that of each of these cells, to rounding, wherever a probe looks."""
    file = of_a_slice(tmp_path / f"a.{'csv' if kind == 'points' else 'vtu'}", kind, backwards)
    found = loads(SLICE.replace("BODY", body) + f'model theirs = results("{file}", unit = 1 mm)\n').run()
    model = found.models["theirs"]
    np.testing.assert_allclose(measured(model), [FLAT_END[0], -FLAT_END[1]], rtol=1e-9)
    assert model.solve["match"]["volume"] == (None if kind == "points" else pytest.approx(1.0, rel=1e-9))
    assert model.solve["match"]["unused"] == []


def test_a_slice_is_one_layer_thick(tmp_path: Path) -> None:
    """A block has values above each other, of which none is that of the plane."""
    body = "plane_strain(quadrilateral((0, 0, 0) mm, (40, 0, 0) mm, (40, 20, 0) mm, (0, 20, 0) mm), gel, 20 mm)"
    text = SLICE.replace("BODY", body) + f'model theirs = results("{written(tmp_path / "a.vtu")}", unit = 1 mm)\n'
    with pytest.raises(SceneError, match=r"E701.*several layers"):
        loads(text).run()


def test_a_network_is_read_at_the_points_of_its_probes(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("X,Y,Z,ux,uy,uz\n0,0,0,0,0,0\n0,0,1,0.5,0,0\n1,0,1,0.25,0,-0.125\n")
    text = f"""softmark 1
scene "A frame"
material steel = linear_elastic(young = 200 GPa, poisson = 0.3, density = 7850 kg/m^3)
body frame = network(points = [(0, 0, 0), (0, 0, 1), (1, 0, 1)] m, members = [(1, 2), (2, 3)], material = steel,
                     radius = 1 cm)
support foot = fixed(frame, where = z <= 0 m)
load push = point_force(frame, at = (1, 0, 1) m, vector = (0, 0, -1) N)
probe tip = point(frame, at = (PLACE, 0, 1) m)
metric sunk = displacement(tip, along = -z)
model theirs = results("{tmp_path / "a.csv"}", unit = 1 m)
"""
    assert loads(text.replace("PLACE", "1")).run().models["theirs"].metrics["sunk"].value == 0.125
    with pytest.raises(SceneError, match=r"E701.*rods are not interpolated between points"):
        loads(text.replace("PLACE", "0.5")).run()


def test_a_file_is_judged_whatever_the_body_is_made_of(tmp_path: Path) -> None:
    """Fibres that pull, of which a model must know much: a file says what it says."""
    fibres = (
        "transversely_isotropic(shear = 4 kPa, bulk = 20 kPa, k1 = 5 kPa, k2 = 2, density = 1000 kg/m^3, fibres = +x)"
    )
    muscle = f"material gel = active({fibres}, tension = 2 kPa)"
    text = SCENE.replace(SCENE.splitlines()[2], muscle)
    model = loads(f'{text}model theirs = results("{written(tmp_path / "a.vtu", unit=1.0)}", unit = 1 mm)\n').run()
    np.testing.assert_allclose(measured(model.models["theirs"]), [END[0], -END[2]], rtol=1e-12)


@pytest.mark.parametrize(
    ("times", "start", "said"),
    [
        ([0, 1, 2, 3, 8, 9, 10], 0, "has no displacements between 3 ms and 8 ms, a gap of 5 times its usual step"),
        (range(11), 3, "by 3 mm at 0 s, but a motion starts undeformed"),
        ([0, 1, 2, 4, 6, 8, 10], 0, None),
    ],
)
def test_a_motion_that_lacks_moments_is_said(tmp_path: Path, times: list[int], start: int, said: str | None) -> None:
    """Places are those of the eight corners; all of the top moves by as many mm as its time in ms."""
    rows = [
        f"{t},{x},{y},{z},0,0,{-(t + start) * z / 20}" for t in times for x in (0, 40) for y in (0, 20) for z in (0, 20)
    ]
    (tmp_path / "a.csv").write_text("\n".join(["time,X,Y,Z,ux,uy,uz", *rows, ""]))
    text = SCENE.replace("(37, 11, 17)", "(40, 20, 20)").replace("probe    axis", "# probe axis")
    moving = (
        f'{text}analysis fall = dynamic(duration = 10 ms, step = 1 ms)\nmodel theirs = results("{tmp_path / "a.csv"}", '
    )
    report = loads(f"{moving}unit = 1 mm, time = 1 ms)\n").run()
    found = [w.message for w in report.warnings if w.code == "W701"]
    assert len(found) == (said is not None)
    assert said is None or said in found[0]


@pytest.mark.parametrize(("by", "said"), [(0.0, False), (1e-4, False), (0.3, True)])
def test_results_that_move_where_the_scene_holds_are_said(tmp_path: Path, by: float, said: bool) -> None:
    """The top moves by 1 mm, and what the scene holds by so many."""
    rows = [f"{x},{y},{z},{by},0,{-z / 20}" for x in (0, 40) for y in (0, 20) for z in (0, 20)]
    (tmp_path / "a.csv").write_text("\n".join(["X,Y,Z,ux,uy,uz", *rows, ""]))
    text = f'{SCENE}model theirs = results("{tmp_path / "a.csv"}", unit = 1 mm)\n'
    found = [w.message for w in loads(text).run().warnings if w.code == "W703"]
    assert len(found) == said
    assert not said or "by 300 um where" in found[0] or "by 300 µm where" in found[0]


@pytest.mark.parametrize(("top", "said"), [(1.0, 0), (1030.0, 1), (0.00097, 1), (200.0, 0)])
def test_displacements_in_another_unit_are_doubted(tmp_path: Path, top: float, said: int) -> None:
    """Beside a model that moves by 1 mm: right, a thousand times off within a tenth, both ways, or just wrong."""
    rows = [f"{x},{y},{z},0,0,{-top * z / 20}" for x in (0, 40) for y in (0, 20) for z in (0, 20)]
    (tmp_path / "a.csv").write_text("\n".join(["X,Y,Z,ux,uy,uz", *rows, ""]))
    text = f'{SCENE}model theirs = results("{tmp_path / "a.csv"}", unit = 1 mm)\n'
    report = loads(text).run()
    mine = report.models["theirs"]
    u = mine.probes["end"].displacement / top
    other = replace(mine, name="ours", status="converged", probes={"end": replace(mine.probes["end"], displacement=u)})
    found = other_units(loads(text).scene, {"theirs": mine, "ours": other}, {})
    assert [d.code for d in found] == ["W704"] * said


def test_results_of_one_name_are_told_apart(tmp_path: Path) -> None:
    """As in `one/job.frd two/job.frd`."""
    for folder, factor in (("one", 1.0), ("two", 2.0)):
        (tmp_path / folder).mkdir()
        written(tmp_path / folder / "job.vtu", factor)
    (tmp_path / "s.scene").write_text(SCENE)
    files = [str(tmp_path / folder / "job.vtu") for folder in ("one", "two")]
    told = tmp_path / "r.json"
    assert main(["judge", str(tmp_path / "s.scene"), *files, "--unit", "1mm", "--json", str(told)]) == 0
    found = json.loads(told.read_text())["models"]
    assert found["job_2"]["metrics"]["out"]["value"] == pytest.approx(2 * found["job"]["metrics"]["out"]["value"])


LID = "support lid = displaced(block, where = z >= 20 mm and x <= 17 mm, by = (0, 0, -3) mm, components = z)\n"


@pytest.mark.parametrize(
    ("lid", "said"), [(-3.0, ""), (-3e-3, "0.001 times"), (-30.0, "10 times"), (-1.5, "0.5 times")]
)
def test_results_that_do_not_move_as_the_scene_tells_are_said(tmp_path: Path, lid: float, said: str) -> None:
    """Cells end at 20 mm, beyond the part that is moved: what lies beside its border says nothing."""
    points, _ = block()
    rows = [f"{x},{y},{z},0,0,{lid * z / 20 * (x <= 17)}" for x, y, z in points.tolist()]
    (tmp_path / "a.csv").write_text("\n".join(["X,Y,Z,ux,uy,uz", *rows, ""]))
    report = loads(f'{SCENE}{LID}model theirs = results("{tmp_path / "a.csv"}", unit = 1 mm)\n').run()
    found = [w for w in report.warnings if w.code == "W703"]
    assert [said in str(w.help) for w in found] == [True] * bool(said)
    assert report.models["theirs"].solve["match"]["supports"] == pytest.approx(
        {"floor": 0.0, "lid": abs(lid + 3) / 1e3}
    )


def test_a_body_that_is_a_file_is_judged_as_one_that_is_a_shape(tmp_path: Path) -> None:
    """Held by a named part of its file, by a table that is 100 nm off: that was a failure, and a refusal."""
    mesh = Path(__file__).parents[1] / "errors" / "parts" / "named.msh"
    points = 10.0 * meshio.read(mesh).points
    rows = [f"{x + 1e-4},{y},{z},0,0,{-(x**2) / 1e3}" for x, y, z in points.tolist()]
    (tmp_path / "a.csv").write_text("\n".join(["X,Y,Z,ux,uy,uz", *rows, ""]))
    report = loads(f"""softmark 1
scene "Bar"
material gel = neo_hookean(young = 10 kPa, poisson = 0.3, density = 1000 kg/m^3)
body bar = solid(mesh("{mesh}", unit = 10 mm), gel)
region wall = group(bar, "wall")
support held = fixed(bar, where = wall)
probe tip = point(bar, at = (20, 5, 5) mm)
metric sunk = displacement(tip, along = -z)
model theirs = results("{tmp_path / "a.csv"}", unit = 1 mm)
""").run()
    assert report.models["theirs"].metrics["sunk"].value == pytest.approx(0.4e-3, rel=1e-4)
    match = report.models["theirs"].solve["match"]
    assert (match["lacks"], match["supports"]) == (0, {"held": 0.0})
    assert not [w for w in report.warnings if w.code.startswith("W70")]
