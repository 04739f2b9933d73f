"""A request that is not granted, with the reason, which an editor shows: the one exception that reaches it."""

from __future__ import annotations

from lsprotocol.types import LSPErrorCodes
from pygls.exceptions import JsonRpcException


class Refused(JsonRpcException):
    """What was asked for is not done; the message says why."""

    CODE = LSPErrorCodes.RequestFailed
