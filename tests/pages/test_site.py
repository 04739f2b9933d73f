"""The site: built without a warning, every link leads somewhere, nothing is taken from a network."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest

from softmark.interpreter.cli.main import main
from softmark.interpreter.documentation import (
    foreign_word_pages,
    message_reference,
    scene_gallery,
    site_builder,
    word_reference,
)
from softmark.interpreter.documentation.docstring_markdown import docstring_to_markdown, escape_markup
from softmark.interpreter.documentation.site_inventory import anchors_by_name
from softmark.interpreter.help import word_pages
from softmark.interpreter.help.codes import pages as codes
from softmark.interpreter.language import foreign_aliases
from softmark.interpreter.language.scene_sources import standard_scenes

PICTURE, ALL_PICTURES = 60_000, 1_500_000  # bytes
EXTERNAL = Path(__file__).with_name("external_links.txt")


def test_every_word_and_every_message_has_a_place() -> None:
    made = "\n".join(word_reference.pages().values())
    assert [c.name for c in word_pages.constructors() if f"```{{word}} {word_reference.target(c)}\n" not in made] == []
    others = foreign_word_pages.page()
    assert [
        word
        for word in (*foreign_aliases.WORDS, *foreign_aliases.SYNONYMS, *foreign_aliases.CHOICES)
        if f"`{word}`" not in others
    ] == []
    made = "\n".join(message_reference.pages().values())
    assert [code for code in codes() if made.count(f"```{{message}} {code}\n") != 1] == []


@pytest.mark.parametrize("name", standard_scenes())
def test_the_gallery_has_every_scene_as_it_is(name: str) -> None:
    mend = f"python tests/benchmarks/gallery.py {name}"
    record = scene_gallery.load_results().get(name)
    assert record is not None, mend
    assert record["sha256"] == scene_gallery.text_hash(name), mend
    assert record["picture"] is None or (scene_gallery.PICTURES / f"{name}.png").stat().st_size < PICTURE, mend


def test_pictures_are_small_and_of_scenes() -> None:
    files = list(scene_gallery.PICTURES.iterdir())
    assert {f.stem for f in files} <= standard_scenes().keys()
    assert sum(f.stat().st_size for f in files) < ALL_PICTURES


def test_a_scene_that_has_changed_says_so() -> None:
    name = next(iter(scene_gallery.load_results()))
    record = scene_gallery.load_results()[name]
    assert scene_gallery.STALE not in scene_gallery.section(name, record)
    assert scene_gallery.STALE in scene_gallery.section(name, {**record, "sha256": "0"})
    assert "results of this scene are not available" in scene_gallery.section(name, None)


def test_docstrings_become_paragraphs_and_formulas() -> None:
    doc = "One.\n\npsi = a * b\n    + c\nProse of `code_` and a_b\nSource: somebody."
    assert docstring_to_markdown(doc) == (
        "One.\n\n```text\npsi = a * b\n    + c\n```\n\nProse of `code_` and a\\_b\n\nSource: somebody."
    )
    assert escape_markup("a < `b_c`", {"b_c": "{word}`b_c`"}.get) == "a \\< {word}`b_c`"


@dataclass
class Page(HTMLParser):
    """Links and places of a page."""

    text: str
    links: list[str] = field(default_factory=list)
    taken: list[str] = field(default_factory=list)  # what a browser loads with it
    ids: set[str] = field(default_factory=set)

    def __post_init__(self) -> None:
        super().__init__()
        self.feed(self.text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        own = dict(attrs)
        self.ids |= {own["id"] or ""} if "id" in own else set()
        if tag == "a" and own.get("href"):
            self.links.append(str(own["href"]))
        elif found := own.get("src") or (own.get("href") if tag == "link" else None):
            self.taken.append(found)


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, tuple[str, ...]]:
    """The whole of it, built once, and what Sphinx warned of."""
    for name in site_builder.NEEDED:
        pytest.importorskip(name)
    folder = tmp_path_factory.mktemp("site")
    return folder, site_builder.build(folder, site_builder.sources())


@pytest.fixture(scope="module")
def known(site: tuple[Path, tuple[str, ...]]) -> dict[Path, Page]:
    """Its pages by their files."""
    return {f: Page(f.read_text(encoding="utf-8")) for f in sorted(site[0].rglob("*.html"))}


@pytest.mark.slow
def test_it_is_built_without_a_warning(site: tuple[Path, tuple[str, ...]]) -> None:
    assert site[1] == ()


@pytest.mark.slow
def test_links_lead_to_places_that_are_there(known: dict[Path, Page]) -> None:
    broken = []
    for file, page in known.items():
        for link in {*page.links, *page.taken}:
            to = urlsplit(link)
            if to.scheme:
                continue
            target = (file.parent / unquote(to.path)).resolve() if to.path else file
            there = target in known and (not to.fragment or unquote(to.fragment) in known[target].ids)
            if not (there or (target.is_file() and target.suffix != ".html")):
                broken.append(f"{file.name}: {link}")
    assert broken == []


@pytest.mark.slow
def test_nothing_is_taken_from_a_network(site: tuple[Path, tuple[str, ...]], known: dict[Path, Page]) -> None:
    assert [link for page in known.values() for link in page.taken if urlsplit(link).scheme not in ("", "data")] == []
    styles = "".join(f.read_text(encoding="utf-8") for f in site[0].rglob("*.css"))
    assert re.findall(r"(?:url\(|@import)\s*['\"]?(?:https?:)?//[^)]*", styles) == []


@pytest.mark.slow
def test_links_to_the_outside_are_those_that_are_listed(known: dict[Path, Page]) -> None:
    found = {link for page in known.values() for link in page.links if urlsplit(link).scheme}
    assert sorted(found) == EXTERNAL.read_text(encoding="utf-8").split()


@pytest.mark.slow
def test_a_name_leads_to_its_place(
    site: tuple[Path, tuple[str, ...]], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    folder, opened = site[0], []
    kept = site_builder.BuiltSite(folder, True)
    monkeypatch.setattr(site_builder, "site", lambda before: kept)
    monkeypatch.setattr("webbrowser.open", opened.append)
    for name in ("fem", "e204", "surface", "silicone-beam", "gallery"):
        assert main(["docs", name]) == 0
    ends = [address.rpartition("/")[2] for address in opened]
    assert ends == [
        "model.html#std-word-fem", "names.html#std-message-E204", "probe.html#std-word-surface-probe",
        "beams.html#std-scene-silicone-beam", "index.html",
    ]  # fmt: skip
    assert main(["docs", "--no-open"]) == 0
    assert len(opened) == 5
    assert capsys.readouterr().out.splitlines()[-1] == str((folder / "index.html").resolve())
    assert main(["docs", "galery"]) == 2
    assert "did you mean `gallery`?" in capsys.readouterr().err
    assert anchors_by_name(folder)["beam6dof"].startswith("reference/model.html#")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("tex", "braced"),
    [
        (r"\tfrac12 (a)", r"\tfrac{1}{2} (a)"), (r"\frac1{2 b}", r"\frac{1}{2 b}"), (r"\frac{a}{2}", r"\frac{a}{2}"),
        (r"\frac \mu 2", r"\frac{\mu}{2}"), (r"\bar\lambda_a^2", r"{\bar{\lambda}{}}_a^2"),
        (r"\hat u_i", r"{\hat{u}{}}_i"), (r"\dot{S}_0", r"{\dot{S}{}}_0"), (r"\det F", r"\det\, F"),
        (r"\ln(J)", r"\ln(J)"), (r"\dots", r"\dots"),
    ],
)  # fmt: skip
def test_formulas_are_spelt_out(tex: str, braced: str) -> None:
    pytest.importorskip("sphinx")
    from softmark.interpreter.documentation.mathml import add_braces

    assert add_braces(tex) == braced


@pytest.mark.slow
def test_formulas_are_mathml_and_what_leads_nowhere_is_a_warning(tmp_path: Path) -> None:
    for name in site_builder.NEEDED:
        pytest.importorskip(name)
    style = {"_static/softmark.css": b""}
    text = "# A\n\n$\\psi = \\frac{a}{2}$\n\n$$\n\\begin{aligned} a &= b \\\\ c &= \\sqrt{d} \\end{aligned}\n$$\n"
    assert site_builder.build(tmp_path / "a", {"index.md": text.encode(), **style}) == ()
    page = (tmp_path / "a" / "index.html").read_text(encoding="utf-8")
    assert "<mfrac>" in page and "<mtable" in page and "<msqrt>" in page  # noqa: PT018
    assert "mathjax" not in page.lower()
    wrong = "# A\n\n$\\nosuch{a}$ {word}`nothing` [there](nowhere.md)\n"
    assert len(site_builder.build(tmp_path / "b", {"index.md": wrong.encode(), **style})) == 3


@pytest.mark.slow
def test_a_page_that_cannot_be_written_is_an_error(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Sphinx only warns of it: a site with empty pages would be kept for good where the disk was full."""
    for name in site_builder.NEEDED:
        pytest.importorskip(name)
    (tmp_path / "index.html").mkdir()
    with pytest.raises(OSError, match=r"index\.html"):
        site_builder.build(tmp_path, {"index.md": b"# A\n", "_static/softmark.css": b""})


def test_without_the_extra_it_says_how_to_get_it(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setattr(site_builder, "find_spec", lambda name: None)
    monkeypatch.setattr(site_builder, "sources", dict)
    assert main(["docs"]) == 2
    assert 'pip install "softmark[docs]"' in capsys.readouterr().err
