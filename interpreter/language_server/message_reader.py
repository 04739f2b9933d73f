"""Reader of an editor's JSON-RPC messages that answers malformed ones with an error and continues.

pygls logs a traceback for such a message, sends no answer, and allocates all the memory that a header announces. This
reader passes only whole messages to pygls. For a malformed one it passes the notification MALFORMED, for which the
protocol sends the error.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from typing import Any, BinaryIO

MALFORMED = "$/malformed"
LARGEST = 64 << 20  # bytes of a message: a scene has 1 MB at most, and JSON may take six letters for one
LINE = 8192  # bytes of a line of a header
LENGTH = re.compile(rb"content-length:[ \t]*(\S*)\s*$", re.IGNORECASE)  # also behind a body of no announced length
PIECE = 1 << 16  # bytes of a message that is passed over, at a time
PARSE_ERROR, INVALID_REQUEST = -32700, -32600  # JSON-RPC 2.0, section 5.1


class MessageReader:
    """Input stream with `readline` and `read`, from which pygls reads headers and bodies."""

    def __init__(self, incoming: BinaryIO) -> None:
        self._incoming = incoming
        self._lines = self._framed()
        self._body = b""

    def readline(self) -> bytes:
        """Return the next line of a header, empty where the editor has closed the stream."""
        return next(self._lines, b"")

    def read(self, size: int) -> bytes:
        """Return the body that the last header announced."""
        return self._body[:size]

    def _framed(self) -> Iterator[bytes]:
        while (size := self._announced()) is not None:
            body = self._whole(size)
            if body is None:  # the editor has gone in the middle of a message
                return
            self._body = body
            yield b"Content-Length: %d\r\n" % len(body)
            yield b"\r\n"

    def _announced(self) -> int | None:
        """Return the length that the next header announces, 0 where it announces none; None at the end."""
        size: int | None = None
        while line := self._incoming.readline(LINE):
            if found := LENGTH.search(line):
                digits = found[1]
                size = int(digits) if digits.isdigit() and len(digits) < 20 else 0  # more is a length of no message
            elif not line.strip() and size is not None:
                return size
        return None

    def _whole(self, size: int) -> bytes | None:
        if size == 0:
            return _malformed(INVALID_REQUEST, "a header does not give the length of a message")
        if size > LARGEST:
            while size > 0 and (piece := self._incoming.read(min(size, PIECE))):
                size -= len(piece)
            return _malformed(INVALID_REQUEST, f"a message is larger than {LARGEST >> 20} MiB")
        body = self._incoming.read(size)
        return _checked(body) if len(body) == size else None


def _checked(body: bytes) -> bytes:
    """Return a well-formed message unchanged, or the notification that replaces a malformed one."""
    try:
        found: Any = json.loads(body)
    except (ValueError, RecursionError) as error:  # numbers of thousands of digits, and nests of brackets, too
        return _malformed(PARSE_ERROR, f"a message is not valid JSON: {error}")
    if isinstance(found, dict) and found.get("jsonrpc") == "2.0":
        return body
    number = found.get("id") if isinstance(found, dict) else None
    return _malformed(INVALID_REQUEST, "a message is not an object of JSON-RPC 2.0", number)


def _malformed(code: int, reason: str, number: Any = None) -> bytes:
    own = number if isinstance(number, int | str) else None
    params = {"code": code, "reason": reason[:200], "answers": own}
    return json.dumps({"jsonrpc": "2.0", "method": MALFORMED, "params": params}).encode()
