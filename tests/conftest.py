"""What all tests share: one thread each, where measured data lie, and reports of scenes that take long.

Tests of measured data take them from $SOFTMARK_DATA, by default ../shared/data beside the repository, or from the
cache of downloads; they are skipped where a data set is in none of these places. Nothing is downloaded.

With pytest-xdist, tests of one file run in one process, and so do all that look at the report of one scene: it is run
once. A test belongs to a scene by its parameter, or by its file (OWNERS).
"""

from __future__ import annotations

import os
import re
import signal
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

for _threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS"):  # before numpy comes in
    os.environ.setdefault(_threads, "1")

# shells start background jobs with interrupts ignored, and who ignores them hands that on to the commands under test
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

import pytest  # noqa: E402

import softmark  # noqa: E402
from softmark.scenes import ROOT  # noqa: E402

DATA = Path(__file__).parents[2] / "shared" / "data"
SCENES = {file.stem for file in ROOT.rglob("*.scene")}
OWNERS = {
    "test_published": "silicone-beam-as-published",
    "test_truth_cube": "truth-cube",
    "test_api": "silicone-beam",
}


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """Hand tests out by what they share, unless the command line says otherwise."""
    if config.getoption("dist") != "load":
        return None
    from xdist.scheduler import LoadScopeScheduling

    class ByReport(LoadScopeScheduling):
        def _split_scope(self, nodeid: str) -> str:
            return shared_by(nodeid)

    return ByReport(config, log)


def shared_by(nodeid: str) -> str:
    """The scene whose report a test looks at, or the file that it is in."""
    file, _, test = nodeid.partition("::")
    parameter = test[test.find("[") + 1 :].removesuffix("]")
    return parameter if parameter in SCENES else OWNERS.get(Path(file).stem, file)


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
def report_of(needs_data: Callable[[str], None]) -> Callable[[str | Path], softmark.Report]:
    """The report of a scene of the library, by its name or file, which is run once in a process."""
    known: dict[str, softmark.Report] = {}

    def run(file: str | Path) -> softmark.Report:
        name = Path(file).stem
        if name not in known:
            scene = softmark.load(file)
            needs_data(scene.scene.source.text)
            known[name] = scene.run()
        return known[name]

    return run
