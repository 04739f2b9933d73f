"""A request that is not granted, with the reason, which an editor shows: the one exception that reaches it.

Any other is said on standard error.
"""

from __future__ import annotations

import logging
import sys
import traceback

from lsprotocol.types import LSPErrorCodes
from pygls.exceptions import JsonRpcException
from pygls.protocol import json_rpc

from softmark.interpreter.language.plugin_words import blamed


class Refused(JsonRpcException):
    """What was asked for is not done; the message says why."""

    CODE = LSPErrorCodes.RequestFailed


def quietly() -> None:
    """Leave errors that are answers out of what pygls logs: a traceback beside the answer looks like a fault."""
    json_rpc.logger.addFilter(_unforeseen)


def _unforeseen(record: logging.LogRecord) -> bool:
    if str(record.msg).startswith("Unable to deserialize"):  # the client has the error as an answer
        return False
    return not (record.exc_info and isinstance(record.exc_info[1], JsonRpcException))


def report(error: BaseException) -> None:
    """Say why an answer failed: of a plugin its line and what it did, of ourselves the whole trace."""
    sys.stderr.write(f"{blamed(error) or ''.join(traceback.format_exception(error))}\n")
    sys.stderr.flush()
