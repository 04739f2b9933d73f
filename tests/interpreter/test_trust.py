"""The page on files from strangers: every sentence of its lists is held by a test, here or where the table says."""

from __future__ import annotations

import io
import json
import os
import re
import resource
import shutil
import stat
import subprocess
import sys
import threading
import time
from contextlib import chdir, redirect_stderr, redirect_stdout
from pathlib import Path

import numpy as np
import pytest

from softmark.grammar.diagnostic import Source
from softmark.interpreter.cli.main import main
from softmark.interpreter.results import result_authentication
from softmark.interpreter.study.run_cache import cache_folder
from softmark.interpreter.study.workers.task_journal import Journal, JournalRefused
from softmark.interpreter.validation.scene_loader import load_scene
from softmark.resource_limits import FACTOR, FLOOR, SHARE, available_memory, limited_resources

TESTS = Path(__file__).parents[1]
PAGE = TESTS.parent / "interpreter" / "documentation" / "howto-trust.md"
HELD = {  # by the beginning of a sentence
    "Checking a scene and opening": "interpreter/test_sandbox.py:test_checking_and_planning_open_nothing",
    "They write nothing": "interpreter/test_sandbox.py:test_checking_and_planning_open_nothing",
    "They open the files": "interpreter/test_hostile_readers.py:test_only_regular_files_are_opened",
    "A text of more than 1 MB": "interpreter/test_trust.py:test_a_text_over_1_mb_is_refused",
    "The memory that a check needs": "interpreter/test_trust.py:test_memory_grows_with_the_text",
    "The editor shows": "interpreter/test_trust.py:test_an_editor_shows_a_report_that_came_along",
    "A file that names other": "interpreter/test_trust.py:test_files_lead_nowhere_but_into_their_folder",
    "Pipes and devices": "interpreter/test_hostile_readers.py:test_only_regular_files_are_opened",
    "A reader takes at most": "interpreter/test_trust.py:test_the_memory_of_a_reader",
    "A reader is stopped": "interpreter/test_hostile_readers.py:test_a_reader_that_does_not_end_is_stopped",
    "Whatever a file contains": "interpreter/test_hostile_readers.py:test_hostile_files_end_in_a_message",
    "`dsl run` reuses": "interpreter/test_trust.py:test_results_of_somebody_else_are_computed_again",
    "Entries in the journals": "interpreter/test_trust.py:test_journals_of_somebody_else_count_for_nothing",
    "The key lies": "interpreter/test_trust.py:test_the_key_is_the_users_alone",
    "Results that you did not": "interpreter/test_trust.py:test_results_of_somebody_else_are_computed_again",
    "An output replaces": "interpreter/test_trust.py:test_no_output_is_written_through_a_link",
    "An output folder": "interpreter/test_trust.py:test_a_folder_that_nobody_named_is_no_link",
    "Results of earlier runs": "interpreter/test_trust.py:test_the_last_of_the_disk_is_left_to_reports",
    "A scene cannot name a command": "interpreter/test_trust.py:test_a_scene_names_no_command",
    "A public data set": "references/test_data.py:test_the_next_address_is_tried",
    "A plugin is code": "interpreter/test_plugins.py:test_what_a_plugin_raises_while_it_runs_is_its_own_reason",
    "A scene cannot load": "interpreter/test_trust.py:test_a_scene_loads_no_plugin",
}
SCENE = """scene "Small"
material gel = neo_hookean(young = 60 kPa, poisson = 0.3, density = 1000 kg/m^3)
body beam = solid(cylinder(length = 100 mm, radius = 10 mm), gel)
support wall = fixed(beam, where = x <= 0 mm)
load weight = gravity(9.81 m/s^2)
model rod = beam6dof(segments = 8)
model fine = beam6dof(segments = 12)
reference theory = simo_reissner(beam)
probe axis = line(beam, from = (0, 0, 0) mm, to = (100, 0, 0) mm, points = 5)
metric sag = displacement(axis, along = -z)
metric eta = relative_l2_error(axis, against = theory)
expect rod.sag < 1 mm
"""


def dsl(*words: str) -> tuple[int, str]:
    """The exit status of a command and all that it says."""
    out = io.StringIO()
    with redirect_stdout(out), redirect_stderr(out):
        status = main(list(words))
    return status, out.getvalue()


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The working folder, with a scene; the user's cache, with the key, lies elsewhere."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    (tmp_path / "work").mkdir()
    monkeypatch.chdir(tmp_path / "work")
    Path("small.scene").write_text(SCENE, encoding="utf-8")
    return tmp_path / "work"


def test_every_sentence_is_held() -> None:
    sentences = re.findall(r"^- (.+)$", PAGE.read_text(encoding="utf-8"), re.MULTILINE)
    unheld = [s for s in sentences if sum(s.startswith(begin) for begin in HELD) != 1]
    assert unheld == []
    assert len(sentences) == len(HELD)
    for place in HELD.values():
        file, name = place.split(":")
        assert f"def {name}" in (TESTS / file).read_text(encoding="utf-8"), place


# ------------------------------------------------------------------ checking


def test_a_text_over_1_mb_is_refused(here: Path) -> None:
    Path("large.scene").write_text(SCENE + "#" * 1_000_000, encoding="utf-8")
    status, said = dsl("check", "large.scene")
    assert status == 2
    assert "larger than 1 MB" in said
    pytest.importorskip("lsprotocol")
    from softmark.interpreter.language_server.document_formatting import format_document
    from softmark.interpreter.language_server.request_error import RequestRefused
    from softmark.interpreter.language_server.text_document import Document

    document = Document(SCENE + "#" * 1_000_000, here)
    assert document.tokens == document.comments == []
    assert "larger than 1 MB" in document.compiled[1][0].message
    with pytest.raises(RequestRefused, match="larger than 1 MB"):
        format_document(document, None)  # type: ignore[arg-type]


CHAINS = {
    "a chain": lambda i: f"p{i - 1} + 1 nm",
    "a chain to later ones": lambda i: f"p{i - 1} / 1.001",
    "a tree": lambda i: f"p{(i - 1) // 2} + p{i - 1} / 2",
    "a fan": lambda i: "p0 + 1 nm",
    "many at once": lambda i: " + ".join(f"p{j}" for j in range(max(0, i - 12), i)) + f" - p{i // 2}",
}
MEASURE = """
import resource, sys
from pathlib import Path
from softmark.grammar.diagnostic import Source
from softmark.interpreter.validation.scene_loader import load_scene
text = Path(sys.argv[1]).read_text()
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
load_scene(Source("a.scene", text), Path("."), None)
print((resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / len(text) * 1024)
"""


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize("kind", CHAINS)
def test_memory_grows_with_the_text(kind: str, tmp_path: Path) -> None:
    """At most 400 bytes for each of the text: trees of syntax take 160 (measured), closures took 15 000."""
    lines = ["param p0 = 1 mm", *(f"param p{i} = {CHAINS[kind](i)}" for i in range(1, 4000))]
    if kind == "a chain to later ones":
        lines.reverse()
    file = tmp_path / "a.scene"
    file.write_text("\n".join([*lines, SCENE.partition("\n")[2]]), encoding="utf-8")
    done = subprocess.run([sys.executable, "-c", MEASURE, str(file)], capture_output=True, text=True, check=True)
    assert float(done.stdout) < 400


def test_dependencies_are_those_that_a_text_mentions() -> None:
    """A change is followed through them; test_varied_configurations.py compares with scenes read again."""
    chain = ["param p0 = 1 mm", *(f"param p{i} = p{(i - 1) // 2} + p{i - 1}" for i in range(1, 40))]
    text = "\n".join([*chain, SCENE.partition("\n")[2].replace("length = 100 mm", "length = 100 mm + p39 / 1e12")])
    scene, found = load_scene(Source("a.scene", text), Path(), None)
    assert scene is not None, found
    assert scene.made is not None
    assert scene.made.needs["p39"] == {"p19", "p38"}
    assert scene.made.needs["beam"] == {"p39", "gel"}


def test_an_editor_shows_a_report_that_came_along(here: Path) -> None:
    """It says so on the page: whoever made the report decides what stands there. It names the file over the line."""
    pytest.importorskip("lsprotocol")
    from softmark.interpreter.language_server.measured_values import find_last_report
    from softmark.interpreter.language_server.text_document import Document

    assert dsl("run", "small.scene")[0] in (0, 1)
    file = here / "small-report" / "report.json"
    file.write_text(file.read_text().replace('"not_met"', '"met"'))
    document = Document(SCENE, here, here / "small.scene")
    found = find_last_report(document)
    assert found is not None
    said = found.of(document, document.tree.declarations[-1])
    assert said is not None
    assert "small-report/report.json" in said.more


# ------------------------------------------------------------------ files that name others


def test_files_lead_nowhere_but_into_their_folder(tmp_path: Path) -> None:
    """Of XDMF as a mesh and as a result, PVD, PVTU, NRRD (test_hostile_readers.py), PML and TetGen."""
    from softmark.interpreter.importers import pml_import
    from softmark.interpreter.models.imported_results import readers
    from softmark.references.measured_data import Unreadable
    from softmark.solvers.mesh.files import mesh_reader

    home = tmp_path / "home"
    home.mkdir()
    np.zeros((4, 3)).tofile(tmp_path / "outside.bin")
    shutil.copy(tmp_path / "outside.bin", home / "inside.bin")
    item = (
        '<Xdmf Version="3.0"><Domain><Grid Name="g"><Geometry GeometryType="XYZ"><DataItem DataType="Float" '
        'Dimensions="4 3" {}="{}" Precision="8">{}</DataItem></Geometry><Topology TopologyType="Tetrahedron" '
        'NumberOfElements="1"><DataItem DataType="Int" Dimensions="1 4" Format="XML" Precision="8">0 1 2 3</DataItem>'
        "</Topology></Grid></Domain></Xdmf>"
    )
    for form, told in (("Binary", "../outside.bin"), ("Binary", str(tmp_path / "outside.bin")), ("&#66;inary", "x")):
        (home / "a.xdmf").write_text(item.format("Format", form, told))
        with pytest.raises(mesh_reader.UnreadableMesh, match="another file"):
            mesh_reader.read_cells(str(home / "a.xdmf"), 1.0)
        with pytest.raises(Unreadable):
            readers.read(home / "a.xdmf")
    series = '<VTKFile><Collection><DataSet file="{}"/></Collection></VTKFile>'
    parts = '<VTKFile><PUnstructuredGrid><Piece Source="{}"/></PUnstructuredGrid></VTKFile>'
    for name, text in (("a.pvd", series), ("a.pvtu", parts)):
        (tmp_path / "b.vtu").write_text("<VTKFile/>")
        (home / "link.vtu").unlink(missing_ok=True)
        (home / "link.vtu").symlink_to(tmp_path / "b.vtu")
        for told in ("../b.vtu", str(tmp_path / "b.vtu"), "link.vtu"):
            (home / name).write_text(text.format(told))
            with pytest.raises(Unreadable, match="outside the folder"):
                readers.read(home / name)
    (home / "a.pml").write_text(
        '<physicalModel><atoms><structuralComponent><atom><atomProperties index="0" x="0" y="0" z="0"/></atom>'
        "</structuralComponent></atoms></physicalModel>"
    )
    (tmp_path / "b.lml").write_text("<loads/>")
    (home / "a.lml").symlink_to(tmp_path / "b.lml")
    with pytest.raises(Exception, match=r"outside the folder|no FEM tetrahedra"):
        pml_import.read(home / "a.pml")
    (home / "a.node").write_text("4 3 0 0\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n")
    (tmp_path / "b.ele").write_text("1 4 0\n1 1 2 3 4\n")
    (home / "a.ele").symlink_to(tmp_path / "b.ele")
    with pytest.raises(mesh_reader.UnreadableMesh, match="outside the folder"):
        mesh_reader.read_cells(str(home / "a.node"), 1.0)
    (home / "a.ele").unlink()
    shutil.copy(tmp_path / "b.ele", home / "a.ele")
    assert len(mesh_reader.read_cells(str(home / "a.node"), 1.0).cells) == 1


def test_links_of_hdf5_lead_nowhere(tmp_path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    from softmark.mesh_file_hazards import find_hazard

    with h5py.File(tmp_path / "sound.h5m", "w") as file:
        file["a/b"] = np.zeros(3)
        file["c"] = file["a"]  # a circle of hard links ends as well
        file["a/up"] = file["/"]
    assert find_hazard(tmp_path / "sound.h5m") == ""
    with h5py.File(tmp_path / "link.h5m", "w") as file:
        file["a/b"] = h5py.ExternalLink("/etc/passwd", "/x")
    with h5py.File(tmp_path / "data.h5m", "w") as file:
        file.create_dataset("x", (3,), "f8", external=[("/etc/passwd", 0, 24)])
    for name in ("link.h5m", "data.h5m"):
        assert "another file" in find_hazard(tmp_path / name)


def test_the_memory_of_a_reader(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from softmark import resource_limits

    file = tmp_path / "a"
    file.write_bytes(bytes(1000))
    has = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    with limited_resources(file):
        limit = resource.getrlimit(resource.RLIMIT_AS)[0]
    assert 0 <= limit - has - FLOOR - FACTOR * 1000 < 1 << 27  # a thread that watches the time has its own stack
    assert (FLOOR, FACTOR, SHARE) == (1 << 30, 200, 0.5)
    assert available_memory() > 0
    monkeypatch.setattr(resource_limits, "available_memory", lambda: 3 << 30)
    with limited_resources(file, 1 << 40):
        assert resource.getrlimit(resource.RLIMIT_AS)[0] - has < (3 << 29) + (1 << 27)


def test_threads_that_read_at_once_leave_limits_and_streams_as_they_were(tmp_path: Path) -> None:
    """A second thread that begins before the first has ended would restore what the first one had set."""
    (tmp_path / "a").write_text("a")
    before, within = (resource.getrlimit(resource.RLIMIT_AS), sys.stdout), threading.Event()

    def read(seconds: float) -> None:
        with limited_resources(tmp_path / "a"), redirect_stdout(io.StringIO()):
            within.set()
            time.sleep(seconds)

    first, second = (threading.Thread(target=read, args=(seconds,)) for seconds in (0.1, 0.2))
    first.start()
    assert within.wait(10)
    second.start()
    first.join()
    second.join()
    assert (resource.getrlimit(resource.RLIMIT_AS), sys.stdout) == before


# ------------------------------------------------------------------ results of earlier runs


def forged(folder: Path) -> int:
    """Write results anew with other numbers, as whoever knows the program would without the user's key."""
    count = 0
    for file in folder.glob("*.kept"):
        head, _, body = file.read_bytes().partition(b"\n")
        with np.load(io.BytesIO(body), allow_pickle=False) as archive:
            arrays = {name: archive[name] for name in archive.files}
        text = arrays.pop("json").tobytes().decode()
        text, changed = re.subn(r"\b(\d\.\d{6,})", r"7\1", text)
        count += changed
        out = io.BytesIO()
        np.savez(out, json=np.frombuffer(text.encode(), np.uint8), **arrays)
        import hashlib

        digest = hashlib.sha256(out.getvalue()).hexdigest().encode()
        file.write_bytes(head.split(b" ")[0] + b" " + digest + b"\n" + out.getvalue())
    return count


def values(folder: Path) -> dict[str, float]:
    report = json.loads((folder / "report.json").read_text(encoding="utf-8"))
    return {name: model["metrics"]["sag"]["value"] for name, model in report["models"].items()}


@pytest.mark.slow
@pytest.mark.long
def test_results_of_somebody_else_are_computed_again(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Forged numbers, results of another user's key, and files that are none: none decides what is reported."""
    status = dsl("run", "small.scene")[0]
    true = values(here / "small-report")
    kept = here / "small-report" / "kept"
    assert forged(kept) > 0
    again, said = dsl("run", "small.scene")
    assert (again, values(here / "small-report")) == (status, true)
    assert "was not written by your own run" in said
    monkeypatch.setenv("XDG_CACHE_HOME", str(here.parent / "other"))  # another user
    again, said = dsl("run", "small.scene")
    assert (again, values(here / "small-report")) == (status, true)
    assert said.count("was not written by your own run") == 2  # both models; references are then not looked for
    assert "reused from the run" not in said
    assert "reused from the run" in dsl("run", "small.scene")[1], "one's own results are taken over"
    for file in kept.iterdir():
        file.unlink()
        os.mkfifo(file)
    assert dsl("run", "small.scene")[0] == status


@pytest.mark.slow
@pytest.mark.long
def test_journals_of_somebody_else_count_for_nothing(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A forged outcome, and the same journal of another user: computed again; one's own goes on."""
    asked = ("compare", "small.scene", "--repeats", "0", "--out", "found")
    assert dsl(*asked)[0] == 0
    journal = here / "found" / "journal.jsonl"
    before = journal.read_text()
    true = json.loads((here / "found" / "compare.json").read_text())["points"]
    assert dsl(*asked, "--resume")[0] == 0
    assert journal.read_text() == before, "nothing is computed again"
    journal.write_text(re.sub(r'"value":0\.\d+', '"value":0.5', before))
    status, said = dsl(*asked, "--resume")
    assert (status, "not written by your own runs" in said) == (0, True)
    assert json.loads((here / "found" / "compare.json").read_text())["points"] == true
    journal.write_text(before)
    monkeypatch.setenv("XDG_CACHE_HOME", str(here.parent / "other"))
    assert "2 entries of" in dsl(*asked, "--resume")[1]


def test_the_key_is_the_users_alone(here: Path) -> None:
    code = result_authentication.code_of("test", b"data")
    file = result_authentication.key_file()
    assert file is not None
    assert file.is_relative_to(here.parent / "cache")
    assert stat.S_IMODE(file.stat().st_mode) == 0o600
    assert result_authentication.is_authentic("test", b"data", code)
    for purpose, data, other in (("other", b"data", code), ("test", b"dato", code), ("test", b"data", code[:-1])):
        assert not result_authentication.is_authentic(purpose, data, other)
    file.chmod(0o644)
    assert not result_authentication.is_authentic("test", b"data", code), "others may have read it"
    assert not result_authentication.is_authentic("test", b"data", "\ud800é")
    new = result_authentication.code_of("test", b"data")
    assert (new != code, stat.S_IMODE(file.stat().st_mode)) == (True, 0o600)
    file.unlink()
    file.symlink_to(here / "elsewhere")
    (here / "elsewhere").write_bytes(bytes(32))
    (here / "elsewhere").chmod(0o600)
    result_authentication.code_of("test", b"data")
    assert not file.is_symlink()


def test_without_a_home_a_process_trusts_what_it_wrote(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(result_authentication, "key_file", lambda: None)
    assert result_authentication.is_authentic("a", b"b", result_authentication.code_of("a", b"b"))


def test_the_last_of_the_disk_is_left_to_reports(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    usage = shutil.disk_usage(here)
    monkeypatch.setattr(cache_folder.shutil, "disk_usage", lambda path: usage._replace(free=cache_folder.RESERVE))
    status, said = dsl("run", "small.scene")
    assert status in (0, 1)
    assert "less than 256 MiB of disk space" in said
    assert (here / "small-report" / "report.html").is_file()
    assert not list((here / "small-report").glob("kept/*.kept"))


# ------------------------------------------------------------------ outputs


@pytest.mark.slow
@pytest.mark.long
def test_no_output_is_written_through_a_link(here: Path) -> None:
    """Report, page, JSON, JUnit, meshes, kept results, a journal with --fresh, import, new and fmt."""
    victim = here.parent / "victim"
    victim.mkdir()
    report = here / "small-report"
    (report / "vtu").mkdir(parents=True)
    places = [report / "report.json", report / "report.html", report / "vtu" / "rod-surface.vtu", here / "j.json",
              here / "j.xml", here / "found" / "journal.jsonl", here / "found" / "compare.json"]  # fmt: skip
    (here / "found").mkdir()
    for place in places:
        (victim / place.name).write_text("precious")
        place.symlink_to(victim / place.name)
    os.link(victim / "j.json", here / "hard.json")
    dsl("run", "small.scene", "--vtu", "--junit", "j.xml", "--out", "small-report", "--json", "j.json")
    dsl("run", "small.scene", "--json", "hard.json", "--out", "small-report")
    dsl("compare", "small.scene", "--repeats", "0", "--out", "found", "--fresh")
    assert {file.read_text() for file in victim.iterdir()} == {"precious"}
    for name in ("report.json", "report.html", "vtu/rod-surface.vtu"):
        assert not (report / name).is_symlink()
        assert (report / name).stat().st_size > 100
    Path("linked.scene").symlink_to(victim / "target.scene")
    (victim / "target.scene").write_text("param   a=1\n")
    status, said = dsl("fmt", "linked.scene")
    assert (status, "symbolic link" in said) == (2, True)
    assert (victim / "target.scene").read_text() == "param   a=1\n"
    Path("new").mkdir()
    Path("new/beam.scene").symlink_to(victim / "made.scene")
    assert dsl("new", "--out", "new")[0] == 2
    assert not (victim / "made.scene").exists()


def test_folders_within_an_output_are_no_links(here: Path) -> None:
    victim = here.parent / "victim"
    victim.mkdir()
    (victim / "old.kept").write_text("precious")
    report = here / "small-report"
    report.mkdir()
    (report / "kept").symlink_to(victim)
    (report / "vtu").symlink_to(victim)
    status, said = dsl("run", "small.scene", "--vtu", "--out", "small-report")
    assert (status, "symbolic link" in said) == (3, True)
    status, said = dsl("run", "small.scene", "--out", "small-report")
    assert (status, "results cannot be cached" in said) == (1, True)
    assert [file.name for file in victim.iterdir()] == ["old.kept"]
    (here / "found").mkdir()
    (here / "found" / "journal.lock").symlink_to(victim / "lock")
    assert dsl("compare", "small.scene", "--repeats", "0", "--out", "found")[0] == 2
    assert not (victim / "lock").exists()


def test_a_journal_is_a_file(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "journal.jsonl")
    with pytest.raises(JournalRefused, match="not a regular file"):
        Journal.open(tmp_path)


def test_a_folder_that_nobody_named_is_no_link(here: Path) -> None:
    victim = here.parent / "victim"
    victim.mkdir()
    for name in ("small-report", "small-comparison", "small-stress", "small-judged", "small-vtu", "board"):
        Path(name).symlink_to(victim)
    for words in (("run", "small.scene"), ("export", "small.scene", "--to", "vtu")):
        status, said = dsl(*words)
        assert status == 2
        assert "symbolic link" in said or "left out" in said or "error" in said
    assert list(victim.iterdir()) == []
    Path("mine").symlink_to(victim)
    assert dsl("run", "small.scene", "--out", "mine")[0] == 1, "a link that the command line names is the user's"
    assert (victim / "report.json").is_file()


# ------------------------------------------------------------------ commands and plugins


def test_a_scene_names_no_command() -> None:
    text = SCENE + "model evil = external_solver(rm, hex8, size = 5 mm, strain = small)\n"
    found = load_scene(Source("a.scene", text), Path(), None)[1]
    assert any(d.severity == "error" and "rm" in d.message for d in found)


def test_a_scene_loads_no_plugin(tmp_path: Path) -> None:
    (tmp_path / "evil.py").write_text(f"open({str(tmp_path / 'ran')!r}, 'w')\nSOFTMARK = {{}}\n")
    for line in ('use "evil.py" as e', 'body evil = solid(mesh("evil.py", unit = 1 mm), gel)'):
        with chdir(tmp_path):
            found = load_scene(Source("a.scene", f"{line}\n{SCENE.partition(chr(10))[2]}"), tmp_path, None)[1]
        assert any(d.severity == "error" for d in found)
    assert not (tmp_path / "ran").exists()


def test_a_limit_that_was_not_reached_leaves_no_trace(tmp_path: Path) -> None:
    """A profiler runs after it: pending work that was never taken back hung functions under one (CPython 3.11)."""
    code = (
        "import sys\nfrom pathlib import Path\nfrom softmark.resource_limits import limited_resources\n"
        "with limited_resources(Path(__file__)):\n    pass\n"
        "calls = []\nsys.setprofile(lambda *a: calls.append(a[1]))\nstr.upper('a')\nsys.setprofile(None)\n"
        "def f():\n    return 1\n"
        "sys.setprofile(lambda *a: calls.append(a[1]))\nf()\nsys.setprofile(None)\nprint(calls.count('call'))\n"
    )
    (tmp_path / "a.py").write_text(code, encoding="utf-8")
    command = [sys.executable, "a.py"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=60, check=True)
    assert done.stdout == "1\n", done.stderr
