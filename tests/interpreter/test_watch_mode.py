"""`dsl run --watch` and `dsl serve-report`: what a save has run again, and whom the page is shown to."""

from __future__ import annotations

import http.client
import json
import os
import queue
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from softmark.interpreter.cli.commands.serve_report import Server, folder_of
from softmark.interpreter.cli.commands.watch_mode import WatchedScene
from softmark.interpreter.cli.main import main

DSL = [sys.executable, "-m", "softmark.interpreter"]
SCENE = """use "gels.scene" as gels
body beam = solid(cylinder(length = 100 mm, radius = 10 mm), gels.gel)
support wall = fixed(beam, where = x <= 0 mm)
load weight = gravity(9.81 m/s^2)
model rod = beam6dof(segments = 10)
model fine = beam6dof(segments = 12)
probe tip = point(beam, at = (100, 0, 0) mm)
metric drop = displacement(tip, along = -z)
"""
GELS = "material gel = neo_hookean(young = 60 kPa, poisson = 0.3, density = 1000 kg/m^3)\n"


def folder_with(tmp_path: Path) -> Path:
    (tmp_path / "my.scene").write_text(SCENE, encoding="utf-8")
    (tmp_path / "gels.scene").write_text(GELS, encoding="utf-8")
    return tmp_path / "my.scene"


# ------------------------------------------------------------------ watching


def test_every_file_that_a_text_names_is_watched(tmp_path: Path) -> None:
    file = folder_with(tmp_path)
    (tmp_path / "gels.scene").write_text(GELS + 'use "deep.scene" as deep # "data.csv"\n', encoding="utf-8")
    (tmp_path / "deep.scene").write_text("", encoding="utf-8")
    (tmp_path / "data.csv").write_text("", encoding="utf-8")
    known = WatchedScene(file).state()
    assert {p.name for p, digest in known.items() if digest} == {"my.scene", "gels.scene", "deep.scene", "data.csv"}
    (tmp_path / "data.csv").write_text("1", encoding="utf-8")
    assert WatchedScene(file).state() != known
    file.write_text("model = = ", encoding="utf-8")
    assert set(WatchedScene(file).state()) == {file}, "a text in error is watched as any other"


def test_a_folder_of_ours_is_not_watched(tmp_path: Path) -> None:
    file = tmp_path / "my.scene"
    file.write_text('scene "."\n# "my-report" ".." "data"\n', encoding="utf-8")
    for name in ("my-report", "data"):
        (tmp_path / name).mkdir()
        (tmp_path / name / ("report.json" if name == "my-report" else "1.dcm")).write_text("", encoding="utf-8")
    assert {p.name for p, digest in WatchedScene(file).state().items() if digest} == {"my.scene", "data"}


def test_pipes_and_devices_are_not_waited_for(tmp_path: Path) -> None:
    file = tmp_path / "my.scene"
    file.write_text('use "pipe.scene" as a\n# "pipe" "zero.msh"\n', encoding="utf-8")
    for name in ("pipe", "pipe.scene"):
        os.mkfifo(tmp_path / name)
    (tmp_path / "zero.msh").symlink_to("/dev/zero")
    assert {p.name for p, digest in WatchedScene(file).state().items() if digest} == {"my.scene"}


def test_what_comes_once_cannot_be_watched(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", "-", "--watch"]) == 2
    assert main(["run", "nothing.scene", "--watch"]) == 2
    assert "E401" in capsys.readouterr().err


class Session:
    """A `dsl run --watch` under way, and what it says."""

    def __init__(self, folder: Path, *options: str) -> None:
        self.process = subprocess.Popen(
            [*DSL, "run", "my.scene", "--watch", *options], cwd=folder, text=True, stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT, start_new_session=True,
        )  # fmt: skip
        assert self.process.stdout is not None
        self.out = self.process.stdout
        self.lines: queue.Queue[str] = queue.Queue()
        self.reader = threading.Thread(target=self._read, daemon=True)
        self.reader.start()

    def _read(self) -> None:
        for line in self.out:
            self.lines.put(line)

    def until(self, words: str, seconds: float = 60.0) -> str:
        """Everything it says until a line has these words."""
        said, deadline = "", time.monotonic() + seconds
        while True:
            line = self.lines.get(timeout=max(0.01, deadline - time.monotonic()))
            said += line
            if words in line:
                return said


@contextmanager
def watching(folder: Path, *options: str) -> Iterator[Session]:
    session = Session(folder, *options)
    try:
        yield session
    finally:
        if session.process.poll() is None:
            os.killpg(session.process.pid, signal.SIGKILL)
        session.process.wait()
        session.reader.join(10)
        session.out.close()


def computed(folder: Path) -> set[str]:
    report = json.loads((folder / "my-report" / "report.json").read_text(encoding="utf-8"))
    return {n for n, m in report["models"].items() if "kept" not in m}


@pytest.mark.long
@pytest.mark.slow
def test_a_save_runs_again_what_it_touched(tmp_path: Path) -> None:
    file = folder_with(tmp_path)
    with watching(tmp_path) as session:
        session.until("watching 2 files")
        assert computed(tmp_path) == {"rod", "fine"}
        # an error, by an editor that writes beside and renames
        (tmp_path / "my.scene~").write_text(SCENE.replace("12)", "12"), encoding="utf-8")
        os.replace(tmp_path / "my.scene~", file)
        said = session.until("watching 2 files")
        assert "error[E" in said
        # several saves in a moment, one of them by pieces, are one run
        for count in (13, 14, 15):
            file.write_text("", encoding="utf-8")
            file.write_text(SCENE[:40], encoding="utf-8")
            file.write_text(SCENE.replace("12", f"{count}"), encoding="utf-8")
        said = session.until("watching 2 files")
        assert "saved: my.scene" in said
        assert "error[E" not in said
        assert computed(tmp_path) == {"fine"}
        (tmp_path / "gels.scene").write_text(GELS.replace("60", "61"), encoding="utf-8")
        assert "saved: gels.scene" in session.until("watching 2 files")
        assert computed(tmp_path) == {"rod", "fine"}
        os.killpg(session.process.pid, signal.SIGINT)
        session.until("interrupted")
        assert session.process.wait(10) == 130


@pytest.mark.slow
def test_an_interrupt_ends_the_run_that_is_under_way(tmp_path: Path) -> None:
    file = folder_with(tmp_path)
    slow = "model slow = fem(hex8, strain = finite, size = 1 mm)\n"
    file.write_text(SCENE + slow, encoding="utf-8")
    with watching(tmp_path) as session:
        session.until("running my.scene")
        time.sleep(1.0)
        session.process.send_signal(signal.SIGINT)  # to the watcher alone
        session.until("interrupted")
        assert session.process.wait(20) == 130
    with pytest.raises(ProcessLookupError):
        os.killpg(session.process.pid, 0)  # nobody of it is left


# ------------------------------------------------------------------ serving


@pytest.fixture
def served(tmp_path: Path) -> Iterator[Server]:
    folder = tmp_path / "my-report"
    folder.mkdir()
    (folder / "report.html").write_text("<!DOCTYPE html><html><body>the one</body></html>\n", encoding="utf-8")
    (folder / "report.json").write_text("{}", encoding="utf-8")
    (tmp_path / "secret").write_text("secret", encoding="utf-8")
    with Server(folder, 0) as server:
        threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.02}, daemon=True).start()
        yield server
        server.shutdown()


def ask(server: Server, path: str, method: str = "GET", **headers: str) -> tuple[int, str]:
    """The status and the text of an answer; `Host` as given, or that of the server."""
    line = http.client.HTTPConnection("127.0.0.1", server.server_port, timeout=10)
    line.putrequest(method, path, skip_host=True)
    for name, value in ({"Host": f"127.0.0.1:{server.server_port}"} | headers).items():
        if value:
            line.putheader(name, value)
    line.endheaders()
    answer = line.getresponse()
    text = answer.read().decode()
    line.close()
    return answer.status, text


def test_the_page_reloads_when_it_is_written_again(served: Server) -> None:
    status, page = ask(served, "/")
    assert (status, "the one" in page, "location.reload" in page) == (200, True, True)
    _, state = ask(served, "/state")
    assert f'seen = "{state}"' in page
    assert ask(served, "/state")[1] == state
    (served.folder / "report.html").write_text("<html>two</html>", encoding="utf-8")
    assert ask(served, "/state")[1] != state
    (served.folder / "report.html").unlink()
    assert "no report yet" in ask(served, "/")[1]
    assert ask(served, "/state") == (200, "")
    assert ask(served, "/report.json") == (200, "{}")


@pytest.mark.parametrize(
    "path",
    ["/../secret", "/%2e%2e/secret", "/..%2fsecret", "//etc/passwd", "/report.html/../../secret", "/kept", "/.",
     "/link", "/report.json%00", "http://127.0.0.1/../secret", "/\\..\\secret"],
)  # fmt: skip
def test_no_path_leads_out_of_the_folder(served: Server, path: str) -> None:
    (served.folder / "link").symlink_to(served.folder.parent / "secret")
    status, text = ask(served, path)
    assert status == 404
    assert "secret" not in text


def test_a_link_in_the_place_of_the_report_leads_nowhere(served: Server) -> None:
    (served.folder / "report.json").unlink()
    (served.folder / "report.json").symlink_to(served.folder.parent / "secret")
    assert ask(served, "/report.json")[0] == 404


def test_only_this_machine_by_its_own_name_is_answered(served: Server) -> None:
    assert served.server_address[0] == "127.0.0.1"
    port = served.server_port
    assert ask(served, "/", Host=f"localhost:{port}")[0] == 200
    for name in ("evil.example", f"evil.example:{port}", "127.0.0.1", f"127.0.0.1:{port + 1}", f"[::1]:{port}", ""):
        status, text = ask(served, "/", Host=name)
        assert (status, "the one" in text) == (421, False)
    assert ask(served, "/", method="POST")[0] == 501


def test_which_report_is_served(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(LookupError, match="no report"):
        folder_of(".")
    folder_with(tmp_path)
    for name in ("my-report", "other-report"):
        (tmp_path / name).mkdir()
    assert folder_of("my.scene") == folder_of("my-report") == Path("my-report")
    assert folder_of("silicone-beam") == Path("silicone-beam-report")
    (tmp_path / "my-report" / "report.html").write_text("", encoding="utf-8")
    assert folder_of(".") == Path("my-report")
    (tmp_path / "other-report" / "report.html").write_text("", encoding="utf-8")
    with pytest.raises(LookupError, match="several reports"):
        folder_of(".")
    with pytest.raises(LookupError, match="nowhere"):
        folder_of("nowhere.scene")


def test_a_port_that_is_taken(served: Server, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["serve-report", str(served.folder), "--port", str(served.server_port)]) == 2
    assert "--port" in capsys.readouterr().err
    with pytest.raises(SystemExit):
        main(["serve-report", "--port", "70000"])


@pytest.mark.slow
def test_the_command_ends_at_an_interrupt(tmp_path: Path) -> None:
    (tmp_path / "my-report").mkdir()
    command = [*DSL, "serve-report", "my-report", "--port", "0"]
    with subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        assert "http://127.0.0.1:" in process.stdout.readline()
        process.send_signal(signal.SIGINT)
        assert process.wait(10) == 130
