"""Reader of an editor's JSON-RPC messages, which answers malformed messages with an error and continues.

For a malformed message pygls logs a traceback and sends no answer, and it allocates all the memory that a header
announces. This reader parses each message once. For a malformed one it yields the notification MALFORMED, for which the
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
LENGTH = re.compile(
    rb"content-length:[ \t]*(\S*)\s*$", re.IGNORECASE
)  # searched for, since a header may follow a body of unannounced length
PIECE = 1 << 16  # bytes of a message that is passed over, at a time
PARSE_ERROR, INVALID_REQUEST = -32700, -32600  # JSON-RPC 2.0, section 5.1


Message = dict[str, Any]


def read_messages(incoming: BinaryIO) -> Iterator[Message]:
    """Yield the messages of a stream until the editor closes it, possibly in the middle of a message."""
    while (size := _read_message_length(incoming)) is not None:
        message = _read_message_body(incoming, size)
        if message is None:
            return
        yield message


def _read_message_length(incoming: BinaryIO) -> int | None:
    """Return the message length that the next header announces; None at the end of the stream.

    An invalid length is returned as 0.
    """
    size: int | None = None
    while line := incoming.readline(LINE):
        if found := LENGTH.search(line):
            digits = found[1]
            size = int(digits) if digits.isdigit() and len(digits) < 20 else 0  # more digits are no length of a message
        elif not line.strip() and size is not None:
            return size
    return None


def _read_message_body(incoming: BinaryIO, size: int) -> Message | None:
    """Return the message of `size` bytes after a header; None if the stream ends before its end."""
    if size == 0:
        return _malformed_notification(INVALID_REQUEST, "a header does not give the length of a message")
    if size > LARGEST:
        while size > 0 and (piece := incoming.read(min(size, PIECE))):
            size -= len(piece)
        return _malformed_notification(INVALID_REQUEST, f"a message is larger than {LARGEST >> 20} MiB")
    body = incoming.read(size)
    return _parse(body) if len(body) == size else None


def _parse(body: bytes) -> Message:
    """Return a well-formed message, or the notification that replaces a malformed one."""
    try:
        found: Any = json.loads(body)
    except (ValueError, RecursionError) as error:  # numbers of thousands of digits, and nests of brackets, too
        return _malformed_notification(PARSE_ERROR, f"a message is not valid JSON: {error}")
    if isinstance(found, dict) and found.get("jsonrpc") == "2.0":
        return found
    number = found.get("id") if isinstance(found, dict) else None
    return _malformed_notification(INVALID_REQUEST, "a message is not an object of JSON-RPC 2.0", number)


def _malformed_notification(code: int, reason: str, number: Any = None) -> Message:
    own = number if isinstance(number, int | str) else None
    params = {"code": code, "reason": reason[:200], "answers": own}
    return {"jsonrpc": "2.0", "method": MALFORMED, "params": params}
