"""What all tests share: one thread each, where measured data lie, and reports of scenes that take long.

Tests of measured data take them from $SOFTMARK_DATA, by default ../shared/data beside the repository, or from the
cache of downloads; they are skipped where a data set is in none of these places. Nothing is downloaded.

With pytest-xdist, tests of one group (`xdist_group`) run in one process, so that a scene that several of them look
at is run once.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterator
from pathlib import Path

for _threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS"):  # before numpy comes in
    os.environ.setdefault(_threads, "1")

import pytest  # noqa: E402

import softmark  # noqa: E402

DATA = Path(__file__).parents[2] / "shared" / "data"


def pytest_configure(config: pytest.Config) -> None:
    """Tests are handed out by their groups wherever they are handed out at all."""
    config.addinivalue_line("markers", "xdist_group(name): tests that share a report, in one process")
    if getattr(config.option, "dist", "no") == "load":
        config.option.dist = "loadgroup"


@pytest.fixture(scope="session", autouse=True)
def _measured_data() -> Iterator[None]:
    """$SOFTMARK_DATA names the folder beside the repository, unless it is set."""
    if "SOFTMARK_DATA" in os.environ or not DATA.is_dir():
        yield
        return
    os.environ["SOFTMARK_DATA"] = str(DATA)
    yield
    del os.environ["SOFTMARK_DATA"]


@pytest.fixture(scope="session")
def needs_data(_measured_data: None) -> Callable[[str], None]:
    """Skip the test unless every data set that a scene's text names is on this machine."""
    from softmark.references.data import here

    def needs(text: str) -> None:
        for name in sorted(set(re.findall(r'"data:([^"]+)"', text))):
            if here(name) is None:
                pytest.skip(f"the data set {name} is not on this machine (name its folder by SOFTMARK_DATA)")

    return needs


@pytest.fixture(scope="session")
def report_of(needs_data: Callable[[str], None]) -> Callable[[str], softmark.Report]:
    """The report of a scene of the library, which is run once in a process."""
    known: dict[str, softmark.Report] = {}

    def run(name: str) -> softmark.Report:
        if name not in known:
            scene = softmark.load(name)
            needs_data(scene.scene.source.text)
            known[name] = scene.run()
        return known[name]

    return run
