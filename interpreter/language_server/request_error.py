"""Refusal of a request with a reason, the only exception that the editor shows.

Other exceptions are reported on standard error.
"""

from __future__ import annotations

import logging
import sys
import traceback

from lsprotocol.types import LSPErrorCodes
from pygls.exceptions import JsonRpcException
from pygls.protocol import json_rpc

from softmark.interpreter.language.loaded_plugin import find_faulty_plugin


class RequestRefused(JsonRpcException):
    """A request is refused; the message gives the reason."""

    CODE = LSPErrorCodes.RequestFailed


def silence_refusals() -> None:
    """Filter refused requests from the log of pygls, where their tracebacks would look like program errors."""
    json_rpc.logger.addFilter(_is_unforeseen)


def _is_unforeseen(record: logging.LogRecord) -> bool:
    if str(record.msg).startswith("Unable to deserialize"):  # the client has the error as an answer
        return False
    return not (record.exc_info and isinstance(record.exc_info[1], JsonRpcException))


def report(error: BaseException) -> None:
    """Report why an answer failed: line and error for a plugin, the whole traceback for built-in code."""
    sys.stderr.write(f"{find_faulty_plugin(error) or ''.join(traceback.format_exception(error))}\n")
    sys.stderr.flush()
