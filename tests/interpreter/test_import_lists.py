"""What a deck names and nothing asks for becomes a region or is listed; what goes out comes in again."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import softmark
from softmark.interpreter.cli.main import main
from softmark.interpreter.importers import deck_units, import_formats, scene_writer
from softmark.interpreter.importers.imported_deck import Deck, NotImportable
from softmark.references.measured_data import Unreadable

PARTS = Path(__file__).parents[1] / "errors" / "parts"
OWN = Path(__file__).parents[1] / "imported"
Changed = Callable[..., Path]


@pytest.fixture
def changed(tmp_path: Path) -> Changed:
    """A deck with more words before some of its own."""

    def made(source: Path, *changes: tuple[str, str]) -> Path:
        text = source.read_text()
        for before, more in changes:
            assert before in text
            text = text.replace(before, more + before, 1)
        (tmp_path / source.name).write_text(text)
        return tmp_path / source.name

    return made


def listed(found: Deck) -> dict[str, str]:
    """What was left, and why."""
    return {own.what: own.why for own in found.left}


def named(found: Deck) -> dict[str, list[object]]:
    """Parts that have a name."""
    return {own.name: own.members.tolist() for own in found.named}


def test_sets_of_a_deck_are_regions_or_listed(changed: Changed) -> None:
    found = import_formats.read(changed(PARTS / "deck.inp", (
        "*MATERIAL, NAME=STEEL",
        "*ELSET, ELSET=SECOND\n2\n*NSET, NSET=END\n9, 10, 11, 12\n*NSET, NSET=CORNER\n12\n"
        "*SURFACE, NAME=BETWEEN, TYPE=ELEMENT\n1, S4\n*MATERIAL, NAME=OTHER\n*ELASTIC\n1., 0.1\n",
    )))  # fmt: skip
    assert named(found) == {"SECOND": [1], "END": [[1, 3]], "CORNER": [11], "TOP": [[0, 1], [1, 1]]}
    assert listed(found) == {
        "the surface `BETWEEN`": "1 of its 1 faces are not on the surface of the body",
        "the material `OTHER`": "no cells have this material",
    }
    text = scene_writer.write_scene(
        found, deck_units.read_unit_options("mm-t-s", None, None, None), scene_writer.SuppliedValues(), "x.inp"
    )
    assert 'group_second = group(body, "group_second")' in " ".join(text.scene.split())
    assert "*ELSET, ELSET=group_second\n2\n" in (text.mesh or "")


def test_densities_of_several_temperatures_are_listed(changed: Changed) -> None:
    found = import_formats.read(changed(PARTS / "deck.inp", ("*SOLID SECTION", "7.5E-9, 100.\n")))
    assert listed(found) == {"*DENSITY of `STEEL`": "only its first line is used"}


def test_two_nodes_of_one_number_are_refused(changed: Changed) -> None:
    with pytest.raises(Unreadable, match="two nodes with different positions have the number 5"):
        import_formats.read(changed(PARTS / "deck.inp", ("6, 10.", "5, 1., 0., 10.\n")))
    with pytest.raises(Unreadable, match="node number 5 occurs twice, at different positions"):
        import_formats.read(changed(OWN / "cube.feb", ("		</Nodes>", '<node id="5">1,0,10</node>')))


def test_what_febio_names_is_a_region_or_listed(changed: Changed) -> None:
    found = import_formats.read(changed(
        OWN / "cube.feb",
        ("	</Mesh>\n", '<ElementSet name="all">1</ElementSet><NodeSet name="side">1,4,5,8</NodeSet>'
                        '<NodeSet name="edge">1,5</NodeSet><SurfacePair name="both"/>'),
        ("	</MeshData>", '<ElementData name="axes" type="mat_axis" elem_set="all"/>'),
    ))  # fmt: skip
    assert named(found) == {"side": [[0, 5]], "edge": [0, 4]}
    own = listed(found)
    del own["`Contact`"]
    assert own == {
        "`SurfacePair` `both` of the mesh": "not supported",
        "`ElementData` `axes`": "only nodal values are supported",
    }


def test_domains_of_febio_that_compute_otherwise_are_listed(changed: Changed) -> None:
    path = changed(OWN / "cube.feb", ("</febio_spec>", ""))
    path.write_text(
        path.read_text().replace('mat="gel"/>', 'mat="gel" elem_type="HEX8G1"><alpha>0.05</alpha></SolidDomain>')
    )
    assert {"`elem_type` of the domain `Part1`", "`alpha` of the domain `Part1`"} <= listed(
        import_formats.read(path)
    ).keys()


def test_all_blocks_of_one_domain_are_its_cells(changed: Changed) -> None:
    """A second block of the same name does not leave the cells of the first without a material."""
    nodes = "".join(
        f'<node id="{i}">{x},{y},30</node>' for i, x, y in ((9, 0, 0), (10, 10, 0), (11, 10, 10), (12, 0, 10))
    )
    block = '<Elements type="hex8" name="Part1"><elem id="2">5,6,7,8,9,10,11,12</elem></Elements>'
    found = import_formats.read(
        changed(OWN / "cube.feb", ("		</Nodes>", nodes), ('		<NodeSet name="base"', block))
    )
    assert [part.cells.tolist() for part in found.parts] == [[0, 1]]


BAR = """softmark 1
scene "A bar of parts"
material soft = linear_elastic(young = 10 kPa, poisson = 0.3, density = 1000 kg/m^3)
material hard = linear_elastic(young = 30 kPa, poisson = 0.2, density = 1200 kg/m^3)
body bar = solid(box(size = (30, 10, 10) mm), soft)
region half = part(bar, where = x >= 15 mm, material = hard)
support wall = fixed(bar, where = x <= 0 mm)
support end = displaced(bar, where = x >= 30 mm, by = (1, 0, 0) mm, components = x)
load twist = torque(bar, where = x >= 30 mm, moment = (1e-6, 0, 0) N*m)
load weight = gravity(9.81 m/s^2, direction = -z)
analysis rest = static(tolerance = 1e-12)
model m = fem(hex8, strain = small, size = 5 mm)
probe p = point(bar, at = (25, 4, 6) mm)
"""


@pytest.mark.slow
@pytest.mark.long
def test_what_goes_out_to_calculix_comes_in_again(tmp_path: Path) -> None:
    """1e-10: numbers go out with 14 digits. Forces of a torque have rounding in them that no scene can say."""
    first, again = tmp_path / "a.scene", tmp_path / "b.scene"
    first.write_text(BAR)
    assert main(["export", str(first), "--to", "calculix", "--out", str(tmp_path / "out")]) == 0
    deck = str(tmp_path / "out" / "m" / "job.inp")
    assert main(["import", deck, "--units", "mm-g-s", "--out", str(again)]) == 0
    text = again.read_text().replace("static()", "static(tolerance = 1e-12)")
    again.write_text(text + "probe p = point(body, at = (25, 4, 6) mm)\n")
    assert "density = 1200.0 kg/m^3" in text
    assert all(f"group_{name} " in text for name in ("p1_bar", "p2_half", "s1_wall", "s2_end"))
    there, here = (softmark.load(own).run().models[name] for own, name in ((first, "m"), (again, "fe")))
    there_u, here_u = there.probes["p"].displacement, here.probes["p"].displacement
    np.testing.assert_allclose(here_u, there_u, rtol=0.0, atol=1e-10 * np.abs(there_u).max())


SLIT = """*NODE
1, 0, 0, 0\n2, 0, 10, 0\n3, 10, 0, 0\n4, 10, 10, 0\n5, 20, 0, 0\n6, 20, 10, 0
7, 0, 0, 10\n8, 0, 10, 10\n9, 10, 0, 10\n10, 10, 10, 10\n11, 20, 0, 10\n12, 20, 10, 10
13, 0, 0, 20\n14, 0, 10, 20\n15, 10, 0, 20\n16, 10, 10, 20\n17, 20, 0, 20\n18, 20, 10, 20
19, 10, 0, 0\n20, 10, 10, 0
*ELEMENT, TYPE=C3D8, ELSET=E
1, 1, 3, 4, 2, 7, 9, 10, 8
2, 19, 5, 6, 20, 9, 11, 12, 10
3, 7, 9, 10, 8, 13, 15, 16, 14
4, 9, 11, 12, 10, 15, 17, 18, 16
*MATERIAL, NAME=M
*ELASTIC
1., 0.3
*DENSITY
1e-9
*SOLID SECTION, ELSET=E, MATERIAL=M
*BOUNDARY
13, 1, 3\n14, 1, 3\n15, 1, 3\n16, 1, 3\n17, 1, 3\n18, 1, 3
*STEP
*STATIC
*CLOAD
5, 1, 0.1
19, 1, 0.2
*END STEP
"""


def test_nodes_of_a_slit_are_nodes_of_their_own(tmp_path: Path) -> None:
    """Places are those of two nodes each: the cells stay apart, and a force on one of them is listed."""
    (tmp_path / "slit.inp").write_text(SLIT)
    assert main(["import", str(tmp_path / "slit.inp"), "--units", "mm-t-s", "--out", str(tmp_path / "s.scene")]) == 0
    text = (tmp_path / "s.scene").read_text()
    assert "not imported: forces on 1 nodes, (0.2, 0.0, 0.0) N in all" in text
    ends = "".join(f"probe p{x} = point(body, at = ({x}, 5, 0) mm)\n" for x in (5, 15))
    (tmp_path / "s.scene").write_text(text + ends)
    model = softmark.load(tmp_path / "s.scene").run().models["fe"]
    left, right = (model.probes[name].displacement[0, 0] for name in ("p5", "p15"))
    assert right > 5 * abs(left) > 0  # what is pulled is not what lies beside it


def two_cubes(second: float) -> str:
    """A deck of a cube of 10 mm on supports, and one that begins at another height with supports of its own.

    A force of 0.25 N pulls at each of the four upper nodes of both.
    """
    cube = "{0}1, 0, 0, {z}\n{0}2, 10, 0, {z}\n{0}3, 10, 10, {z}\n{0}4, 0, 10, {z}\n" \
           "{0}5, 0, 0, {t}\n{0}6, 10, 0, {t}\n{0}7, 10, 10, {t}\n{0}8, 0, 10, {t}\n"  # fmt: skip
    nodes = cube.format(1, z=0.0, t=10.0) + cube.format(2, z=second, t=second + 10.0)
    return (f"*NODE\n{nodes}*ELEMENT, TYPE=C3D8, ELSET=E\n1, 11, 12, 13, 14, 15, 16, 17, 18\n"
            "2, 21, 22, 23, 24, 25, 26, 27, 28\n*MATERIAL, NAME=M\n*ELASTIC\n1., 0.\n"
            "*SOLID SECTION, ELSET=E, MATERIAL=M\n*NSET, NSET=LOW\n11, 12, 13, 14, 21, 22, 23, 24\n"
            "*NSET, NSET=HIGH\n15, 16, 17, 18, 25, 26, 27, 28\n"
            "*BOUNDARY\nLOW, 1, 3\n*STEP\n*STATIC\n*CLOAD\nHIGH, 3, 0.25\n*END STEP\n")  # fmt: skip


def test_a_deck_of_two_pieces_is_one_body_of_two(tmp_path: Path) -> None:
    """u = F L / (E A) = 1 N * 10 mm / (1 MPa * 100 mm^2) of both; there is no density, and nothing depends on it."""
    (tmp_path / "two.inp").write_text(two_cubes(15.0))
    mm = deck_units.read_unit_options("mm-t-s", None, None, None)
    found = scene_writer.write_scene(
        import_formats.read(tmp_path / "two.inp"), mm, scene_writer.SuppliedValues(), "m.inp"
    )
    assert "pieces = keep" in found.scene
    assert any("2 pieces that share no nodes" in how for how in found.taken)
    assert any("no density" in how for how in found.taken)
    (tmp_path / "m.inp").write_text(found.mesh or "")
    ends = "".join(f"probe p{z} = point(body, at = (5, 5, {z}) mm)\n" for z in (10, 25))
    (tmp_path / "two.scene").write_text(found.scene + ends)
    model = softmark.load(tmp_path / "two.scene").run().models["fe"]
    for name in ("p10", "p25"):
        assert model.probes[name].displacement[0, 2] == pytest.approx(0.1e-3, rel=1e-9)


def test_pieces_that_overlap_are_refused(tmp_path: Path) -> None:
    (tmp_path / "two.inp").write_text(two_cubes(5.0))
    with pytest.raises(NotImportable, match="2 pieces that overlap"):
        scene_writer.write_scene(
            import_formats.read(tmp_path / "two.inp"),
            deck_units.read_unit_options("mm-t-s", None, None, None),
            scene_writer.SuppliedValues(),
            "x",
        )


def test_cells_that_are_inside_out_are_counted_and_mean_the_same(tmp_path: Path) -> None:
    """1e-12: the same problem, whose matrix has its rows in another order."""
    mm, sag = deck_units.read_unit_options("mm-t-s", None, None, None), []
    for name in ("deck.inp", "deck-inside-out.inp"):
        made = scene_writer.write_scene(
            import_formats.read(PARTS / name), mm, scene_writer.SuppliedValues(), f"{name}.mesh.inp"
        )
        (tmp_path / f"{name}.mesh.inp").write_text(made.mesh or "")
        probed = (
            made.scene + "probe end = point(body, at = (20, 5, 5) mm)\nmetric sag = displacement(end, along = -z)\n"
        )
        (tmp_path / "made.scene").write_text(probed)
        sag.append(softmark.load(tmp_path / "made.scene").run().models["fe"].metrics["sag"].value)
        assert (made.turned or "").startswith("1 of its 2 cells are inverted") == (name != "deck.inp")
    assert sag[0] == pytest.approx(sag[1], rel=1e-12)


def test_cells_of_gmsh_are_counted_as_its_file_has_them(changed: Changed) -> None:
    path = changed(PARTS / "named.msh")
    path.write_text(path.read_text().replace("5 9 10 6 8 12 11 7", "5 6 10 9 8 7 11 12"))
    assert import_formats.read(path).inverted_cells.tolist() == [1]
    assert not len(import_formats.read(PARTS / "named.msh").inverted_cells)
