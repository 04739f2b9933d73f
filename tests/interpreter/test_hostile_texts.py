"""Texts that scenes, files and arguments bring never steer a terminal, and never make JUnit, HTML or JSON unsound."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest

from softmark.grammar.diagnostic import make_all_visible, make_visible
from softmark.interpreter.cli.main import main

HOSTILE = "\x1b[2J\x1b]0;owned\x07\x9b31m\x08\x00bad\u202etxt"
SCENE = """
scene "A {hostile} beam"
material gel    = neo_hookean(young = 60 kPa, poisson = 0.3, density = 1000 kg/m^3)
body     beam   = solid(cylinder(length = 200 mm, radius = 20 mm), gel)
support  wall   = fixed(beam, where = x <= 0 mm)
load     weight = gravity(9.81 m/s^2)
model    rod    = beam6dof(segments = 4)
reference theory = simo_reissner(beam)
reference beads = markers("beads.csv", unit = 1 mm, uncertainty = 1 mm, citation = "{hostile}")
probe    axis   = line(beam, from = (0, 0, 0) mm, to = (200, 0, 0) mm, points = 5)
metric   eta    = relative_l2_error(axis, against = theory)
expect   rod.eta < 0.0001 %
"""
BEADS = "x0,y0,z0,x1,y1,z1\n0,0,0,0,0,{hostile}\n"


def clean(text: str) -> bool:
    """No character but those that print, and line feeds."""
    return all(c.isprintable() or c in "\n\u00a0\u202f" for c in text)


@pytest.fixture(autouse=True)
def _folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A NUL in a scene is refused by the parser, so that its title has all but that."""
    monkeypatch.chdir(tmp_path)
    inside = HOSTILE.replace("\x00", "")
    Path("my.scene").write_text(SCENE.replace("{hostile}", inside), encoding="utf-8")
    Path("beads.csv").write_text(BEADS.replace("{hostile}", inside), encoding="utf-8")


@pytest.mark.parametrize("command", [
    ("run", "my.scene", "--junit", "out.xml"), ("plan", "my.scene"), ("check", "my.scene"),
    ("compare", "my.scene", "--repeats", "0"), ("explain", HOSTILE), (HOSTILE,), ("list", HOSTILE), ("new", HOSTILE),
    ("run", f"{HOSTILE}.scene"), ("run", "my.scene", "--out", "\x1b[2J/a/b\0"),
    ("run", "my.scene", "--model", HOSTILE),
    ("run", "my.scene", "--json", "no\x1b[2J/where/x.json"), ("compare", "a\x1b.json", "b.json"),
    ("compare", "my.scene", "--study", HOSTILE), ("stress", "my.scene", "--study", HOSTILE),
    ("fmt", f"{HOSTILE}.scene"),
])  # fmt: skip
def test_no_text_steers_the_terminal(command: tuple[str, ...], capsys: pytest.CaptureFixture[str]) -> None:
    try:
        status = main(list(command))
    except SystemExit as stop:  # argparse
        status = int(stop.code or 0)
    said = capsys.readouterr()
    assert clean(said.out), repr(said.out)
    assert clean(said.err), repr(said.err)
    assert status != 70


def test_a_junit_file_is_xml_whatever_a_title_holds() -> None:
    main(["run", "my.scene", "--junit", "out.xml", "--json", "out.json"])
    suite = ElementTree.fromstring(Path("out.xml").read_text(encoding="utf-8"))
    assert suite.attrib["name"].startswith("A \u241b[2J")
    assert all(clean(value) for e in suite.iter() for value in e.attrib.values())
    title = json.loads(Path("out.json").read_text(encoding="utf-8"))["scene"]["title"]
    assert title.startswith("A \x1b[2J"), "JSON has it as it is"


def test_the_page_shows_a_title_as_it_is_written(parsed: Callable[[str], Any]) -> None:
    main(["run", "my.scene", "--model", "rod", "--out", "out"])
    page = Path("out/report.html").read_text(encoding="utf-8")
    assert all(c.isprintable() or c.isspace() or c in "\u200b\u00ad\u2011" for c in page), "no control character"
    assert "\u202e" not in page
    assert "\u241b[2J" in parsed(page).text


def test_a_file_whose_name_is_no_text_is_run_and_told(capsys: pytest.CaptureFixture[str]) -> None:
    """A name of bytes that are no UTF-8, as archives of other systems have them."""
    name = b"b\xffam.scene".decode(errors="surrogateescape")
    try:
        Path(name).write_text(Path("my.scene").read_text(encoding="utf-8"), encoding="utf-8")
    except OSError:
        pytest.skip("this file system takes no such name")
    assert main(["run", name, "--model", "rod", "--json", "-"]) in (1, 3)
    found = capsys.readouterr().out
    json.loads(found.encode("utf-8"))


@pytest.mark.parametrize(("text", "shown"), [
    ("plain", "plain"), ("a\x1bb", "a\u241bb"), ("a\x9bb", "a\ufffdb"), ("Größe µm 试验", "Größe µm 试验"),
])  # fmt: skip
def test_what_cannot_be_seen_is_a_picture(text: str, shown: str) -> None:
    assert make_visible(text) == shown
    assert make_all_visible({"a": [text, (text, 1.0)], "b": None}) == {"a": [shown, (shown, 1.0)], "b": None}
