"""Where names lead, where they are used, and other names for them."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

pytest.importorskip("lsprotocol")

from lsprotocol import types
from marked_texts import Marked, after, marked

from softmark.interpreter.language_server import go_to_definition, rename_symbol
from softmark.interpreter.language_server.request_error import RequestRefused

pytestmark = pytest.mark.slow

BEAM = """param L = 178 mm
material gel = neo_hookean(young = 60 kPa, poisson = 0.49, density = 1070 kg/m^3)
body beam = solid(cylinder(length = L, radius = 19 mm, axis = +x), gel)
support wall = fixed(beam, where = x <= 0 mm)
load weight = gravity(9.81 m/s^2, direction = -z)
model small = fem(tet4, strain = small, size = 20 mm)
model rod = beam6dof(segments = 10)
reference theory = simo_reissner(beam)
probe axis = line(beam, from = (0, 0, 0) mm, to = (L, 0 mm, 0 mm))
metric eta = relative_l2_error(axis, against = theory)
expect rod.eta < 5 % and small.eta > 1 %
study finer = sweep(rod.segments, over = [4, 8])
"""


def lead(text: Marked) -> types.Location | None:
    """Where the name at the cursor is declared."""
    return go_to_definition.definition(text.document, text.asked(types.DefinitionParams))


@pytest.mark.parametrize(
    ("name", "declared"),
    [
        ("length = L<|>,", "param <[L]> ="), ("solid(cyl", ""), (", g<|>el)", "material <[gel]> ="),
        ("expect ro<|>d.eta", "model <[rod]> ="), ("rod.et<|>a <", "metric <[eta]> ="),
        ("strain = sma<|>ll,", ""), ("and smal<|>l.eta", "model <[small]> ="), ("sweep(ro<|>d.seg", "model <[rod]> ="),
        ("against = theor<|>y)", "reference <[theory]> ="), ("mo<|>del small", ""), ("fem(te<|>t4", ""),
        ("where = x<|> <=", ""),
    ],
)  # fmt: skip
def test_a_name_leads_to_its_declaration_and_a_word_of_the_language_nowhere(
    name: str, declared: str, tmp_path: Path
) -> None:
    text = BEAM.replace(name.replace("<|>", ""), name)
    text = text.replace(declared.replace("<[", "").replace("]>", ""), declared) if declared else text
    own = marked(text, tmp_path)
    found = lead(own)
    assert [found.range] == own.ranges if found else not own.ranges


def test_a_name_leads_across_use_into_files_and_the_standard_library(tmp_path: Path) -> None:
    (tmp_path / "soft.scene").write_text(
        "param nu = 0.49\nmaterial gel = neo_hookean(young = 6 kPa, poisson = nu, density = 1000 kg/m^3)\n"
    )
    uses = 'use "soft.scene" as soft\nuse "std/materials/tissues.scene" as tissue\n'
    for line, name, start in (
        ("body b = solid(box(size = (1, 1, 1) mm), soft.ge<|>l)", "soft.scene", types.Position(1, 9)),
        ("param p = soft.n<|>u", "soft.scene", types.Position(0, 6)),
        ("param p = so<|>ft.nu", "some.scene", types.Position(0, 20)),
        ("body b = solid(box(size = (1, 1, 1) mm), tissue.live<|>r)", "tissues.scene", None),
    ):
        found = lead(marked(uses + line, tmp_path))
        assert found is not None
        assert found.uri.endswith(f"/{name}")
        assert start is None or found.range.start == start
    found = lead(marked(uses.replace("soft.sc", "so<|>ft.sc"), tmp_path))
    assert found is not None
    assert found.uri == (tmp_path / "soft.scene").as_uri()


def test_all_places_of_a_name_are_found_once_and_no_word_that_is_spelt_alike(tmp_path: Path) -> None:
    text = BEAM.replace("model small", "model <[sma<|>ll]>").replace("and small", "and <[small]>")
    own = marked(text, tmp_path)
    context = types.ReferenceContext(include_declaration=True)
    found = go_to_definition.references(own.opened, own.asked(types.ReferenceParams, context=context))
    assert [f.range for f in found] == own.ranges
    lights = go_to_definition.highlights(own.document, own.asked(types.DocumentHighlightParams))
    assert [h.range for h in lights] == own.ranges
    assert [h.kind for h in lights] == [types.DocumentHighlightKind.Write, types.DocumentHighlightKind.Read]


def renamed(own: Marked, new: str) -> dict[str, list[types.TextEdit]]:
    """The changes by which the name at the cursor is called otherwise."""
    edit = rename_symbol.rename(own.opened, own.asked(types.RenameParams, new_name=new))
    return {uri: list(edits) for uri, edits in (edit.changes or {}).items()}


@pytest.mark.parametrize(
    ("name", "new"), [("rod", "line1"), ("small", "plain"), ("eta", "off"), ("L", "length"), ("gel", "soft")]
)
def test_a_scene_with_another_name_for_something_means_the_same(name: str, new: str, tmp_path: Path) -> None:
    at = BEAM.index(f" {name} =") + 1
    own = marked(BEAM[:at] + "<|>" + BEAM[at:], tmp_path)
    text = after(own.document, renamed(own, new)[own.uri])
    other = marked(text, tmp_path).document
    assert [(d.code, d.message.replace(new, name)) for d in other.check_result[1]] == [
        (d.code, d.message) for d in own.document.check_result[1]
    ]
    assert other.check_result[0] is not None
    assert new in {*other.check_result[0].declared, *other.check_result[0].parameters}
    assert name not in {*other.check_result[0].declared, *other.check_result[0].parameters}


def test_a_name_of_another_file_changes_there_and_in_all_scenes_that_use_it(tmp_path: Path) -> None:
    (tmp_path / "soft.scene").write_text("param nu = 0.49\nparam two = 2 * nu\n")
    (tmp_path / "other.scene").write_text('use "soft.scene" as it\nparam q = it.nu\n')
    (tmp_path / "alike.scene").write_text("param nu = 0.3\n# soft.scene\n")
    own = marked('use "soft.scene" as soft\nparam p = soft.<|>nu + 1\n', tmp_path)
    changes = renamed(own, "ratio")
    assert {uri.rsplit("/", 1)[1]: len(edits) for uri, edits in changes.items()} == {
        "some.scene": 1, "soft.scene": 2, "other.scene": 1
    }  # fmt: skip
    assert after(own.document, changes[own.uri]).endswith("param p = soft.ratio + 1\n")
    alias = marked('use "soft.scene" as so<|>ft\nparam p = soft.nu\n', tmp_path)
    assert after(alias.document, renamed(alias, "it")[alias.uri]) == 'use "soft.scene" as it\nparam p = it.nu\n'


def test_what_is_no_scene_beside_it_is_not_looked_through(tmp_path: Path) -> None:
    """A pipe would wait for a writer; a terabyte of holes takes more memory than there is."""
    os.mkfifo(tmp_path / "pipe.scene")
    (tmp_path / "zero.scene").symlink_to("/dev/zero")
    with (tmp_path / "holes.scene").open("wb") as file:
        file.truncate(10**12)
    (tmp_path / "some.scene").write_text("param nu = 0.49\n")
    (tmp_path / "other.scene").write_text('use "some.scene" as it\nparam q = it.nu\n')
    changes = renamed(marked("param nu<|> = 0.49\n", tmp_path), "ratio")
    assert {uri.rsplit("/", 1)[1] for uri in changes} == {"some.scene", "other.scene"}


@pytest.mark.parametrize(
    ("text", "new", "reason"),
    [
        ("param L<|> = 1 m\nparam R = 2 m", "R", "`R` is already a param"),
        ("param L<|> = 1 m", "in", "reserved word"),
        ("param L<|> = 1 m", "x", "predefined name"),
        ("param L<|> = 1 m", "2L", "is not a name"),
        ("param L<|> = 1 m", "rod.L", "is not a name"),
        ("par<|>am L = 1 m", "M", "only names of the scene"),
        ("param L<|> = 1 m\nparam R = (2 m", "M", "syntax errors"),
        ('use "std/materials/tissues.scene" as tissue\nparam r = tissue.live<|>r.young', "lung", "standard library"),
    ],
)  # fmt: skip
def test_a_name_that_cannot_be_is_refused_with_the_reason(text: str, new: str, reason: str, tmp_path: Path) -> None:
    with pytest.raises(RequestRefused, match=reason):
        renamed(marked(text, tmp_path), new)
