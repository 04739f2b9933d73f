"""A request that is not granted, with the reason, which an editor shows: the one exception that reaches it."""

from __future__ import annotations

import logging

from lsprotocol.types import LSPErrorCodes
from pygls.exceptions import JsonRpcException
from pygls.protocol import json_rpc


class Refused(JsonRpcException):
    """What was asked for is not done; the message says why."""

    CODE = LSPErrorCodes.RequestFailed


def quietly() -> None:
    """Leave refusals out of what pygls logs: the editor has the reason, a traceback beside it looks like a fault."""
    json_rpc.logger.addFilter(_unforeseen)


def _unforeseen(record: logging.LogRecord) -> bool:
    return not (record.exc_info and isinstance(record.exc_info[1], Refused))
