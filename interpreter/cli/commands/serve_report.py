"""Command `dsl serve-report`: shows a report in a local browser and reloads the page when it changes.

The server delivers only the page and its numbers, under fixed names. It answers only requests whose host name is that
of this machine. No path leads to other files, and pages of other sites get no answer.
"""

from __future__ import annotations

import argparse
import sys
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from socketserver import TCPServer

from softmark.grammar.diagnostic import make_visible

HOST, PORT = "127.0.0.1", 8127
PAGE, NUMBERS, STATE = "report.html", "report.json", "/state"
TYPES = {PAGE: "text/html; charset=utf-8", NUMBERS: "application/json"}
HEADERS = {
    "Cache-Control": "no-store",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
}
WAITING = "<!DOCTYPE html><html lang=en><meta charset=utf-8><title>softmark</title><p>There is no report yet.</html>"
RELOAD = """<script>
(function () {
  var seen = "STATE";
  setInterval(function () {
    fetch("/state", {cache: "no-store"}).then(function (r) { return r.text(); }).then(function (now) {
      if (now && now !== seen) { location.reload(); }
    }).catch(function () {});
  }, 700);
})();
</script>
"""


def arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `dsl serve-report`: `[DIR|FILE.scene] [--port N]`."""
    parser.add_argument(
        "place", nargs="?", default=".", metavar="DIR|FILE", help="the folder of a report, or its scene"
    )
    meaning = f"port on this machine (default: {PORT}; 0: any free port)"
    parser.add_argument("--port", type=_port, default=PORT, metavar="N", help=meaning)


def _port(text: str) -> int:
    if not text.isdigit() or int(text) > 65535:
        raise argparse.ArgumentTypeError(f"`{text}` is not a number from 0 to 65535")
    return int(text)


def run(parsed: argparse.Namespace) -> int:
    """Serve the report until a signal ends it."""
    try:
        folder = folder_of(parsed.place)
        server = Server(folder, parsed.port)
    except LookupError as problem:
        print(make_visible(f"error: {problem.args[0]}"), file=sys.stderr)
        return 2
    except OSError as error:
        why = f"{error.strerror or error}; choose another with `--port`; 0 uses any free port"
        print(make_visible(f"error: port {parsed.port} cannot be used: {why}"), file=sys.stderr)
        return 2
    with server:
        where = f"http://{HOST}:{server.server_port}/"
        print(make_visible(f"{folder / PAGE} is at {where}, for this machine only; Ctrl-C stops"))
        sys.stdout.flush()
        server.serve_forever(poll_interval=0.2)
    return 0


def folder_of(place: str) -> Path:
    """Return the folder of the report that `place` names. Raises LookupError.

    `place` is that folder, a scene, or a folder that contains exactly one report.
    """
    path = Path(place)
    if path.is_dir():
        if (path / PAGE).is_file() or path.name.endswith("-report"):
            return path
        below = sorted(p.parent for p in path.glob(f"*-report/{PAGE}"))
        if len(below) == 1:
            return below[0]
        found = f"several reports: {', '.join(p.name for p in below)}" if below else "no report"
        raise LookupError(f"there is {found} in {path}; name the folder of one, or its scene")
    from softmark.interpreter.language.scene_sources import UnreadableScene, locate_scene

    try:
        return Path(f"{locate_scene(place).stem}-report")
    except UnreadableScene as missing:
        raise LookupError(f"{missing.reason}; {missing.remedy}") from missing


class Server(ThreadingHTTPServer):
    """HTTP server on the loopback address. Raises OSError if the port is not available."""

    daemon_threads = True
    allow_reuse_address = sys.platform != "win32"  # on Windows it would share the port with another program

    def __init__(self, folder: Path, port: int) -> None:
        self.folder = folder
        super().__init__((HOST, port), RequestHandler)

    def server_bind(self) -> None:
        """Bind the socket without asking the network for the host name."""
        TCPServer.server_bind(self)
        self.server_name, self.server_port = HOST, int(self.server_address[1])

    def handle_error(self, request: object, client_address: object) -> None:
        """Ignore disconnected browsers; print one line for other errors and keep serving."""
        error = sys.exc_info()[1]
        if not isinstance(error, OSError):
            print(make_visible(f"a request was not answered: {type(error).__name__}: {error}"), file=sys.stderr)

    def file(self, name: str) -> Path | None:
        """Return the path of a file in the report folder; None if it does not exist or lies outside."""
        path = self.folder / name
        return path if path.is_file() and path.resolve().parent == self.folder.resolve() else None

    @property
    def state(self) -> str:
        """Text that changes whenever the page is written again; empty if there is no page."""
        try:
            found = (self.folder / PAGE).stat()
        except OSError:
            return ""
        return f"{found.st_mtime_ns}-{found.st_size}-{found.st_ino}"


class RequestHandler(BaseHTTPRequestHandler):
    """Handler of one HTTP request; it knows three paths and never writes a file."""

    server: Server
    server_version, sys_version = "softmark", ""
    timeout = 30  # s to wait for a request

    def do_GET(self) -> None:
        """Send the page, its numbers, or the current state."""
        self._send_response(body=True)

    def do_HEAD(self) -> None:
        """Send the headers of the response to GET."""
        self._send_response(body=False)

    def _send_response(self, body: bool) -> None:
        status, kind, data = self._find_response()
        self.send_response(status)
        for name, value in {**HEADERS, "Content-Type": kind, "Content-Length": str(len(data))}.items():
            self.send_header(name, value)
        self.end_headers()
        if body:
            self.wfile.write(data)

    def _find_response(self) -> tuple[HTTPStatus, str, bytes]:
        plain = "text/plain; charset=utf-8"
        if not self._is_local_host():
            return HTTPStatus.MISDIRECTED_REQUEST, plain, b"this is served to this machine alone, by its own name\n"
        asked = self.path.partition("?")[0]
        if asked == STATE:
            return HTTPStatus.OK, plain, self.server.state.encode()
        name = PAGE if asked == "/" else asked[1:]
        if name not in TYPES:
            return HTTPStatus.NOT_FOUND, plain, b"there is the report at / and its numbers at /report.json\n"
        state, file = (
            self.server.state,
            self.server.file(name),
        )  # state first: if the page changes now, the browser reloads it
        try:
            data = b"" if file is None else file.read_bytes()
        except OSError:
            file = None
        if name == PAGE:
            return HTTPStatus.OK, TYPES[PAGE], with_reload_script(WAITING.encode() if file is None else data, state)
        if file is None:
            return HTTPStatus.NOT_FOUND, plain, b"there are no numbers yet\n"
        return HTTPStatus.OK, TYPES[name], data

    def _is_local_host(self) -> bool:
        """Return whether the `Host` header of the request is a name of this machine.

        A host name of another site may resolve to this machine too; such requests are refused.
        """
        port = self.server.server_port
        known = {f"{name}{end}" for name in (HOST, "localhost") for end in (f":{port}", *([""] if port == 80 else []))}
        return self.headers.get_all("Host", []) in [[name] for name in known]

    def log_message(self, format: str, *args: object) -> None:
        """Do nothing, so that the terminal shows only messages about the report."""


def with_reload_script(page: bytes, state: str) -> bytes:
    """Return the page with a script that reloads it when a newer version exists.

    The script may connect only to this server.
    """
    from softmark.interpreter.report.page.html_document import POLICY
    from softmark.interpreter.report.page.html_markup import text

    own = text(POLICY).encode()
    page = page.replace(own, own + text("; connect-src 'self'").encode(), 1)
    head, end, rest = page.rpartition(b"</html>")
    return head + RELOAD.replace("STATE", state).encode() + end + rest
