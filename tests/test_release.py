"""What is released: its number in one place, its changes, and the licences of all that it asks for."""

from __future__ import annotations

import re
import subprocess
import tomllib
from importlib import metadata
from pathlib import Path

import pytest

import softmark

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
WORDS = {"Apache Software License": "Apache", "Mozilla Public License": "MPL", "Python Software Foundation": "PSF"}


def test_the_version_is_that_of_the_citation_and_of_the_changelog() -> None:
    assert PROJECT["tool"]["setuptools"]["dynamic"]["version"] == {"attr": "softmark.__version__"}
    assert f"version = {{{softmark.__version__}}}" in README
    changes = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    released = re.search(r"^## (\d+\.\d+\.\d+)", changes, re.MULTILINE)
    assert released is not None
    assert released[1] == softmark.__version__


def test_a_tag_says_the_version_that_is_built() -> None:
    command = ["git", "tag", "--points-at", "HEAD", "--list", "v[0-9]*"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    if done.returncode:
        pytest.skip("not a git checkout")
    assert done.stdout.split() in ([], [f"v{softmark.__version__}"])


def asked_for() -> set[str]:
    """Packages of all extras and of none, without ourselves."""
    extras = PROJECT["project"]["optional-dependencies"].values()
    lines = [*PROJECT["project"]["dependencies"], *(line for extra in extras for line in extra)]
    return {found[0].lower() for line in lines if (found := re.match(r"[\w.-]+", line))} - {"softmark"}


def listed() -> dict[str, str]:
    """Licence of each package, as the README has them."""
    section = README.partition("## Licence")[2].partition("```")[0]
    rows = re.findall(r"^\| ([^|]+) \| ([^|]+) \|$", section, re.MULTILINE)[2:]
    found = {}
    for licence, packages in rows:
        plain = re.sub(r"to develop:|\(.*?\)|, in a process.*", "", packages)
        found |= {name.strip(): licence for name in re.split("[,;]", plain)}
    return found


def declared(name: str) -> str:
    """What the metadata of an installed package say of its licence, in the words of the table."""
    known = metadata.metadata(name)
    classes = [c.rpartition(" :: ")[2] for c in known.get_all("Classifier") or () if c.startswith("License ::")]
    texts = (f.read_text(encoding="utf-8") for f in metadata.files(name) or () if f.name.startswith("LICENSE"))
    said = known.get("License-Expression") or "".join(classes) or known.get("License") or next(texts)
    return next((short for words, short in WORDS.items() if words in said), said)


def test_every_package_that_is_asked_for_has_its_licence_in_the_readme() -> None:
    table = listed()
    assert set(table) == asked_for()
    for name, licence in table.items():
        try:
            said = declared(name)
        except metadata.PackageNotFoundError:
            continue
        assert said.startswith(licence.split("-")[0]), f"{name} is under {said}"
