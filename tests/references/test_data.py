"""Public data sets: found where they were put, fetched once, and never a crash where they cannot be had."""

from __future__ import annotations

import hashlib
import http.server
import re
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from softmark.references import data_download
from softmark.references.data_download import DataSet, Unavailable, find_file, locate_data_set

CONTENT = b"v 0 0 0\n" * 20_000  # more than one block
NAME = "test/thing.obj"
SHARED = Path(__file__).parents[3] / "shared" / "data"


class Server(http.server.BaseHTTPRequestHandler):
    """Serves /right, /wrong, /short, /endless; is silent at /silent; knows nothing else."""

    asked: list[str]

    def do_GET(self) -> None:
        self.asked.append(self.path)
        if self.path == "/silent":
            time.sleep(1.5)
            return
        bodies = {"/right": CONTENT, "/wrong": b"a page that says no", "/short": CONTENT[:-1]}
        body = bodies.get(self.path, CONTENT * 50 if self.path == "/endless" else None)
        self.send_response(200 if body else 404)
        self.send_header("Content-Length", str(len(body or b"") + (self.path == "/short")))
        self.end_headers()
        try:
            self.wfile.write(body or b"")
        except OSError:
            return  # the client has had enough

    def log_message(self, *_: object) -> None:
        return


@pytest.fixture
def address() -> Iterator[str]:
    Server.asked = []
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Server)
    thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.02}, daemon=True)
    thread.start()
    yield f"http://127.0.0.1:{server.server_address[1]}"
    server.shutdown()
    server.server_close()
    thread.join()


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty cache and no folder of one's own; no test reaches beyond this machine."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setenv("no_proxy", "*")
    monkeypatch.delenv("SOFTMARK_DATA", raising=False)
    return tmp_path / "cache"


@pytest.fixture
def entry(cache: Path, monkeypatch: pytest.MonkeyPatch) -> DataSet:
    sha = hashlib.sha256(CONTENT).hexdigest()
    made = DataSet(NAME, "a thing", ("http://127.0.0.1:9/none",), sha, len(CONTENT), "CC0", "Nobody 1900", "")
    monkeypatch.setitem(data_download.TABLE, NAME, made)
    return made


def serve(monkeypatch: pytest.MonkeyPatch, entry: DataSet, *urls: str) -> None:
    monkeypatch.setitem(data_download.TABLE, NAME, replace(entry, urls=urls))


def left(cache: Path) -> list[Path]:
    return [p for p in cache.rglob("*") if p.is_file()]


def test_a_data_set_is_fetched_once(entry: DataSet, address: str, cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    serve(monkeypatch, entry, f"{address}/right")
    seen: list[tuple[int, int]] = []
    file = find_file(f"data:{NAME}", progress=lambda done, whole: seen.append((done, whole)))
    assert file.read_bytes() == CONTENT
    assert file == cache / "softmark" / "data" / entry.sha256 / "thing.obj"
    assert seen[-1] == (len(CONTENT), len(CONTENT))
    assert len(seen) > 1
    assert locate_data_set(NAME) == file
    assert Server.asked == ["/right"]
    assert left(cache) == [file]


def test_looking_downloads_nothing(entry: DataSet, address: str, monkeypatch: pytest.MonkeyPatch) -> None:
    serve(monkeypatch, entry, f"{address}/right")
    assert data_download.find_local(NAME) is None
    assert Server.asked == []
    assert locate_data_set(NAME) == data_download.find_local(NAME)


def test_the_next_address_is_tried(entry: DataSet, address: str, monkeypatch: pytest.MonkeyPatch) -> None:
    serve(monkeypatch, entry, f"{address}/gone", f"{address}/wrong", f"{address}/right")
    assert locate_data_set(NAME).read_bytes() == CONTENT


def test_a_spoilt_cache_is_filled_anew(entry: DataSet, address: str, monkeypatch: pytest.MonkeyPatch) -> None:
    serve(monkeypatch, entry, f"{address}/right")
    locate_data_set(NAME).write_bytes(b"half a fi")
    assert locate_data_set(NAME).read_bytes() == CONTENT


@pytest.mark.parametrize(
    ("page", "reason"),
    [
        ("wrong", "the server sent a different file (19 bytes, expected 160000; the SHA-256 differs)"),
        ("short", "the server sent a different file (159999 bytes"),
        ("endless", "the server sent a different file"),
        ("gone", "HTTP Error 404"),
        ("silent", "timed out"),
    ],
)
def test_what_cannot_be_fetched_leaves_nothing_and_says_what_to_do(
    entry: DataSet, address: str, cache: Path, monkeypatch: pytest.MonkeyPatch, page: str, reason: str
) -> None:
    monkeypatch.setattr(data_download, "PATIENCE", 0.3)
    serve(monkeypatch, entry, f"{address}/{page}")
    with pytest.raises(Unavailable, match=re.escape(reason)) as caught:
        locate_data_set(NAME)
    assert caught.value.name == f"data:{NAME}"
    assert "The data set is a thing; CC0" in caught.value.reason
    for part in (f"{address}/{page}", entry.sha256, f"FOLDER/{NAME}", "SOFTMARK_DATA=FOLDER"):
        assert part in caught.value.remedy
    assert left(cache) == []


def test_a_download_that_never_ends_is_given_up(entry: DataSet, address: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(data_download, "LIMIT", -1.0)
    serve(monkeypatch, entry, f"{address}/right")
    with pytest.raises(Unavailable, match="not finished after"):
        locate_data_set(NAME)


def test_nobody_at_the_address(entry: DataSet) -> None:
    with pytest.raises(Unavailable, match=r"could not be downloaded.*refused"):
        locate_data_set(NAME)


def test_a_cache_that_cannot_be_written(entry: DataSet, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "full").write_text("a file where a folder should be: nothing can be made in it")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "full"))
    with pytest.raises(Unavailable, match="the cache cannot be written"):
        locate_data_set(NAME)


def test_no_home_directory(entry: DataSet, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("XDG_CACHE_HOME")

    def homeless() -> Path:
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.setattr(Path, "home", homeless)
    with pytest.raises(Unavailable, match="no home directory and no \\$XDG_CACHE_HOME"):
        locate_data_set(NAME)


def test_a_folder_of_ones_own_comes_first_and_needs_no_network(
    entry: DataSet, cache: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    mine = tmp_path / "mine" / NAME
    mine.parent.mkdir(parents=True)
    mine.write_bytes(CONTENT)
    monkeypatch.setenv("SOFTMARK_DATA", str(tmp_path / "mine"))
    assert locate_data_set(NAME) == mine
    assert not cache.exists()
    mine.write_bytes(CONTENT + b" ")
    with pytest.raises(Unavailable, match="differs from the published file"):
        locate_data_set(NAME)


def test_a_name_that_is_almost_right(cache: Path) -> None:
    with pytest.raises(Unavailable, match=r"did you mean `data:silicone-beam/truthCylinder-Deformed\.obj`") as caught:
        locate_data_set("silicone-beam/truthCylinder-deformd.obj")
    assert "no data set with this name" in caught.value.reason
    with pytest.raises(Unavailable, match=r"data sets: `data:silicone-beam"):
        locate_data_set("../../etc/passwd")


def test_a_plain_path_is_a_file_beside_the_scene(tmp_path: Path) -> None:
    (tmp_path / "scan.stl").write_text("solid")
    assert find_file("scan.stl", tmp_path) == tmp_path / "scan.stl"
    with pytest.raises(Unavailable, match=r"there is no file .*scan\.obj"):
        find_file("scan.obj", tmp_path)


@pytest.mark.parametrize("name", data_download.TABLE)
def test_the_table_says_all_that_it_should(name: str) -> None:
    entry = data_download.TABLE[name]
    assert entry.name == name
    assert re.fullmatch("[0-9a-f]{64}", entry.sha256)
    assert re.search("/[0-9a-f]{40}/", entry.urls[0]), "the first address must not change"
    assert all(url.startswith("https://") for url in entry.urls)
    assert all((entry.what, entry.licence, entry.citation, entry.checked))
    assert data_download.authors_of(f"data:{name}") == entry.citation


@pytest.mark.parametrize("name", data_download.TABLE)
def test_the_table_agrees_with_the_files(name: str) -> None:
    # The files as they were found in the repositories that the table names.
    file = SHARED / name
    if not file.is_file():
        pytest.skip(f"no {file}")
    content = file.read_bytes()
    assert len(content) == data_download.TABLE[name].size
    assert hashlib.sha256(content).hexdigest() == data_download.TABLE[name].sha256


def test_naming_measurements_imports_nothing_that_computes_or_fetches() -> None:
    modules = ("data_download", "measured_surface", "tracked_points", "ct_volume", "virtual_scan")
    heavy = "{'numpy', 'scipy', 'trimesh', 'meshio', 'skimage', 'urllib.request', 'http.client'}"
    imports = ", ".join(f"softmark.references.{m}" for m in modules)
    code = f"import sys, {imports}; print({heavy} & set(sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "set()"
