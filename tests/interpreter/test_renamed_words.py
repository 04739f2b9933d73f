"""Earlier words of the language: an error names the present word, and `dsl fmt --upgrade` writes it."""

from __future__ import annotations

import io
from pathlib import Path

import pytest

from softmark.grammar.diagnostic import Source
from softmark.grammar.parser import parse
from softmark.interpreter.cli.main import main
from softmark.interpreter.language import renamed_words
from softmark.interpreter.validation.constructor_registry import CATALOGUE

EARLIER = """\
softmark 1
# viscous(
material gel = viscous(neo_hookean(young = 60 kPa, poisson = 0.4, density = 1 g/cm^3), g = [0.5], tau = [1] s)
body bar = solid(apart(box(size = (10, 10, 10) mm), box(size = (10, 10, 10) mm, origin = (20, 0, 0) mm)), gel)
course up = ramp(over = 1 s)
support far = turned(bar, where = x >= 30 mm, axis = +x, angle = 5 deg, course = up)
load press = tension(bar, where = z >= 10 mm, magnitude = 10 Pa, direction = +x, course = state)
contact  c  =  itself( bar )
model m = fem(tet4, strain = finite, size = 5 mm, cap = 3, finer = 2, towards = x <= 0 mm)
model n = fem(tet4, strain = finite, size = 5 mm, start = m)
probe tip = point(bar, at = (30, 5, 5) mm)
metric eta = energy_norm(tip, against = m)
metric course = realtime(rate = 25 Hz)
study s = stability(over = [m.cap, press.course], models = [m])
study t = sweep(m.finer, over = [2, 4])
expect m.course < 2
"""
PRESENT = """\
softmark 1
# viscous(
material gel = viscoelastic(neo_hookean(young = 60 kPa, poisson = 0.4, density = 1 g/cm^3), g = [0.5], tau = [1] s)
body bar = solid(disjoint(box(size = (10, 10, 10) mm), box(size = (10, 10, 10) mm, origin = (20, 0, 0) mm)), gel)
amplitude up = ramp(over = 1 s)
support far = rotated(bar, where = x >= 30 mm, axis = +x, angle = 5 deg, amplitude = up)
load press = remote_stress(bar, where = z >= 10 mm, magnitude = 10 Pa, direction = +x, amplitude = per_state)
contact  c  =  self_contact( bar )
model m = fem(tet4, strain = finite, size = 5 mm, max_iterations = 3, refine_factor = 2, refine_at = x <= 0 mm)
model n = fem(tet4, strain = finite, size = 5 mm, initial_guess = m)
probe tip = point(bar, at = (30, 5, 5) mm)
metric eta = energy_norm(tip, against = m)
metric course = realtime_factor(rate = 25 Hz)
study s = robustness(over = [m.max_iterations, press.course], models = [m])
study t = sweep(m.refine_factor, over = [2, 4])
expect m.course < 2
"""  # a metric is called `course`, so that `press.course` is left alone; without it it is a field of `press`


def upgraded(text: str) -> str:
    """Return a scene in today's words."""
    return renamed_words.upgrade(text, parse(Source("s.scene", text))[0])


def test_only_earlier_words_change() -> None:
    assert upgraded(EARLIER) == PRESENT
    assert upgraded(PRESENT) == PRESENT
    plain = EARLIER.replace("metric course", "metric speed").replace("m.course <", "m.speed <")
    assert "over = [m.max_iterations, press.amplitude]" in upgraded(plain)


def test_a_name_of_the_scene_is_no_earlier_word() -> None:
    text = "amplitude state = ramp(over = 1 s)\nload g = gravity(9.81 m/s^2, course = state)\n"
    assert upgraded(text) == text.replace("course =", "amplitude =")


def test_every_present_word_exists_and_no_earlier_one_does() -> None:
    for old, new in renamed_words.CONSTRUCTORS.items():
        assert len(CATALOGUE.find(new)) == 1, new
        assert not CATALOGUE.find(old), old
    for old, new in renamed_words.KINDS.items():
        assert old not in CATALOGUE
        assert new in CATALOGUE
    for owner, fields in renamed_words.FIELDS_OF.items():
        constructor = CATALOGUE.find(owner)[0]
        for old, new in fields.items():
            assert constructor.field(old) is None
            assert constructor.field(new) is not None
    made = [CATALOGUE.constructor(kind, n) for kind in CATALOGUE for n in CATALOGUE[kind]]
    assert not [c.name for c in made if c and any(c.field(old) for old in renamed_words.FIELDS)]
    for old, new in renamed_words.ALIASES.items():
        assert [c.name for c in CATALOGUE.find(old)] == [new]


@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_files_are_upgraded_in_place(end: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "a.scene"
    file.write_bytes(EARLIER.replace("\n", end).encode())
    assert main(["fmt", "--upgrade", str(file)]) == 0
    assert file.read_bytes() == PRESENT.replace("\n", end).encode()
    assert capsys.readouterr().out == f"upgraded {file}\n"
    assert main(["fmt", "--upgrade", str(file)]) == 0
    assert capsys.readouterr() == ("", "")


def test_what_cannot_be_parsed_stays(tmp_path: Path) -> None:
    """The errors of a scene are for `dsl check`: the rest of it is upgraded."""
    file = tmp_path / "a.scene"
    file.write_text("contact c = itself(bar)\nbody bar = solid(box(size = \ncourse up = ramp(over = 1 s)\n")
    assert main(["fmt", "--upgrade", str(file)]) == 0
    assert file.read_text().startswith("contact c = self_contact(bar)\nbody bar = solid(box(size = \n")


def test_standard_input_and_links(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(EARLIER.encode())))
    assert main(["fmt", "--upgrade", "-"]) == 0
    assert capsys.readouterr().out == PRESENT
    (tmp_path / "a.scene").write_text(EARLIER)
    (tmp_path / "link.scene").symlink_to(tmp_path / "a.scene")
    assert main(["fmt", "--upgrade", str(tmp_path / "link.scene")]) == 2
    assert (tmp_path / "a.scene").read_text() == EARLIER


def test_an_override_of_an_earlier_field_is_told_the_present_one(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = """material gel = linear_elastic(young = 60 kPa, poisson = 0.4, density = 1000 kg/m^3)
body bar = solid(box(size = (10, 10, 10) mm), gel)
support wall = fixed(bar, where = x <= 0 mm)
model m = fem(tet4, strain = small, size = 5 mm)
"""
    (tmp_path / "a.scene").write_text(text)
    assert main(["check", str(tmp_path / "a.scene"), "-p", "m.cap=3"]) == 2
    assert "it is called `max_iterations` now" in capsys.readouterr().err
    assert main(["explain", "itself"]) == 0
    assert capsys.readouterr().out.startswith("`itself` is an earlier name of `self_contact`.")
