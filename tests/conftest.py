"""What all tests share: workers, one thread each, where measured data lie, and reports of scenes that take long.

Tests of measured data take them from $SOFTMARK_DATA, by default ../shared/data beside the repository, or from the
cache of downloads; they are skipped where a data set is in none of these places. Nothing is downloaded.

Where folders of tests are run, there is a worker for each processor; files that are named, or `-n 0`, run right here.
Tests of one file run in one worker, and so do all that look at the report of one scene: it is run once. A test belongs
to a scene by its parameter, or by its file (OWNERS).

Tests marked `slow` (kill and resume, sieges, the breadth of sweeps) are left to `-m slow`, which .ci/run adds; `-m ""`
runs all. So are those that look at the report of a scene that takes long (BROAD), and the further cases of broad
tests (tests/shared/quick_cases.py). Where folders are run, a tenth of the slow cases of each sweep is run a day,
and all of them with SOFTMARK_WHOLE=1 (tests/shared/daily_selection.py).
"""

from __future__ import annotations

import gc
import os
import re
import signal
import sys
from collections.abc import Callable, Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import Any

for _threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS"):  # before numpy comes in
    os.environ.setdefault(_threads, "1")

# commands under test start in a third of the time where what is compiled is kept, for workers too
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False

# shells start background jobs with interrupts ignored, and who ignores them hands that on to the commands under test
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

import pytest  # noqa: E402
from daily_selection import DAY, PARTS, WHOLE, tests_not_run_today  # noqa: E402
from hypothesis import HealthCheck, settings  # noqa: E402
from quick_cases import is_broad  # noqa: E402

import softmark  # noqa: E402
from softmark.scenes import ROOT  # noqa: E402

# workers share the processors: how long an example takes on the wall says nothing
settings.register_profile("shared", settings(), deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("shared")

DATA = Path(__file__).parents[2] / "shared" / "data"
SCENES = {file.stem for file in ROOT.rglob("*.scene")}
OWNERS = {
    "test_published": "silicone-beam-as-published",
    "test_truth_cube": "truth-cube",
    "test_api": "silicone-beam",
    "test_report_html": "silicone-beam",
}
# scenes of many models or of public data, whose reports take long: the tests of these reports are slow
BROAD = {
    "silicone-beam-as-published", "silicone-beam-refined", "silicone-beam-scanned", "silicone-beam-calibrated",
    "silicone-beam-trade", "silicone-beam-release", "pressure-vessels", "coated-rod", "beam-at-the-extremes",
    "truth-cube", "cantilevers", "cooks-membrane", "elliptic-membrane", "thick-ring", "force-and-travel", "thick-plate",
    "swinging-beam", "silicone-beam-filled", "ecoflex-pulled", "coated-sphere", "torsion", "end-moments", "actuator",
    "inclusion", "organ", "press", "bonded-disc", "pressure-sphere", "bend-45", "tendon-finger", "graded-bar",
    "tapered-shafts", "triangular-bar", "carved-bodies", "graded-wall", "given-back", "line-of-force",
    "rubber-vessels", "spherical-inclusion", "plate-with-a-hole", "rigid-frames", "ringing-cylinder",
    "heart-beam", "ventricle-inflated", "ventricle-contracting", "muscle-strip", "relaxing-bars", "relaxing-rubber",
    "zener-bar",
    "rubber-laws", "balloon", "twisted-rubbers", "stress-in-sections", "one-point",
    "elastic-foundation", "creeping-cantilevers",
    "ring-of-a-file", "indented-layer", "grasp",
    "sphere-on-gel", "half-spheres", "ironing", "pin-on-a-membrane", "pressed-blocks", "indentation", "bar-on-a-wall",
    "plate-on-a-column", "sliding-block", "joined-blocks", "pin", "sphere-by-force",
    "known-stress", "pull", "pinch", "consolidation", "mandels-slab", "unconfined-disc", "confined-compression",
    "laws-at-the-extremes", "rates-at-the-extremes", "tapered-cantilevers", "what-supports-carry",
    "hollow-cantilever", "spinning-rings", "silicone-beam-by-others", "beam-let-go-by-others",
}  # fmt: skip
COMBINING = ("manifold3d", "pytetwild")  # what shapes are combined and filled with
WORKERS = 8  # at most: each holds a few hundred MB
# files and scenes whose tests begin first, in this order: one that compiles most kernels, those that need none
# meanwhile, and those that would keep one worker busy at the end, all others having finished
FIRST = ("silicone-beam",)
PLAIN = (
    "test_environment", "test_mutation", "test_extremes", "test_print", "test_syntax_errors", "test_cli_check",
    "test_sandbox", "test_table", "test_check", "test_codes", "test_compile", "test_elastica", "test_architecture",
)  # fmt: skip
LONG = (
    "ironing", "silicone-beam-as-published", "half-spheres", "test_cattaneo_mindlin", "test_axisymmetric",
    "test_contact", "sphere-on-gel", "pin-on-a-membrane", "test_diagnostics", "truth-cube", "test_recovery",
    "test_orders_solids", "test_orders_time", "test_critical_step", "silicone-beam-scanned", "silicone-beam-refined",
    "cantilevers", "test_dynamics_balance", "test_compare_page", "test_stated", "silicone-beam-release",
)  # fmt: skip


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers(config: pytest.Config) -> int | None:
    """As many as there are processors, a few at most; none where files or tests are named."""
    if not of_folders(config):
        return 0
    if "PYTEST_XDIST_AUTO_NUM_WORKERS" in os.environ:
        return None  # it says how many
    mine = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return min(WORKERS, mine) if mine > 1 else 0


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """Hand tests out by what they share, in a good order, unless the command line says otherwise."""
    if config.getoption("dist") != "load":
        return None
    from xdist.scheduler import LoadScopeScheduling

    class ByReport(LoadScopeScheduling):
        def _split_scope(self, nodeid: str) -> str:
            return shared_by(nodeid)

    config.option.loadscopereorder = False  # not by the number of tests: by their turn
    return ByReport(config, log)


def of_folders(config: pytest.Config) -> bool:
    """Whether no file and no test is named."""
    return all(Path(argument).is_dir() for argument in config.args)


def pytest_report_header(config: pytest.Config) -> str:
    """Which part of the sweeps is walked."""
    return (
        "slow sweeps: all cases"
        if WHOLE
        else f"slow sweeps: one of {PARTS} cases, those of {DAY} (SOFTMARK_WHOLE=1: all)"
    )


@pytest.hookimpl(tryfirst=True)  # before those that are slow are left out
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Reports that take long make tests slow; in a worker, tests come in the order in which they are to begin."""
    for item in items:
        long = "report_of" in getattr(item, "fixturenames", ()) and shared_by(item.nodeid) in BROAD
        if long or is_broad(item):
            item.add_marker(pytest.mark.slow)
    if of_folders(config) and not config.getoption("keyword") and not WHOLE:
        later = tests_not_run_today([item for item in items if item.get_closest_marker("slow")], shared_by)
        config.hook.pytest_deselected(items=[item for item in items if item in later])
        items[:] = [item for item in items if item not in later]
    if hasattr(config, "workerinput"):
        items.sort(key=lambda item: turn(shared_by(item.nodeid)))


def pytest_collection_finish() -> None:
    """Leave what is collected out of the garbage collection, which would look at it again and again."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(50_000, 20, 20)


def shared_by(nodeid: str) -> str:
    """The scene whose report a test looks at, or the file that it is in."""
    file, _, test = nodeid.partition("::")
    parameter = test[test.find("[") + 1 :].removesuffix("]")
    return parameter if parameter in SCENES else OWNERS.get(Path(file).stem, file)


def turn(scope: str) -> int:
    """When the tests of a scope begin: one that compiles, what needs no kernels, what takes long, the others."""
    name = Path(scope).stem
    order = (*FIRST, *PLAIN, *LONG)
    return order.index(name) if name in order else len(order)


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
    """Skip the test unless every data set that a scene's text names is on this machine, and the mesher if it fills."""
    from softmark.references.data_download import find_local

    def needs(text: str) -> None:
        for name in sorted(set(re.findall(r'"data:([^"]+)"', text))):
            if find_local(name) is None:
                pytest.skip(f"the data set {name} is not on this machine (name its folder by SOFTMARK_DATA)")
        if " = solid(tetrahedralized(" in text and find_spec("pytetwild") is None:
            pytest.skip("needs the extra `meshing`")
        if re.search(r"\b(union|difference|intersection)\(", text) and not all(map(find_spec, COMBINING)):
            pytest.skip("needs the extras `solids` and `meshing`")

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
