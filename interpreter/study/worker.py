"""A worker process: tasks come as lines of JSON, outcomes go as lines of JSON, until the pipe ends.

    python -m softmark.interpreter.study.worker

What libraries print goes to standard error, so that it cannot get among the outcomes. The worker dies with the process
that started it: the kernel ends it where it can (Linux), else it notices that its pipe has ended.
"""

from __future__ import annotations

import json
import os
import queue
import signal
import sys
import threading
from typing import Any, BinaryIO


def main() -> None:
    """Serve until standard input ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # an interrupt is for the parent, which ends us
    _die_with_parent()
    out = os.fdopen(os.dup(1), "wb", buffering=0)
    os.dup2(2, 1)
    tasks: queue.Queue[bytes] = queue.Queue()
    threading.Thread(target=_listen, args=(tasks,), daemon=True).start()
    _prepare()
    _send(out, {"ready": os.getpid()})
    from softmark.interpreter.study.tasks import perform

    while True:
        _send(out, perform(json.loads(tasks.get())))


def _listen(tasks: queue.Queue[bytes]) -> None:
    """Pass lines on; leave at once when there will be no more, for nobody would read an outcome."""
    for line in sys.stdin.buffer:
        tasks.put(line)
    os._exit(0)


def _send(out: BinaryIO | Any, value: dict[str, Any]) -> None:
    data = json.dumps(value, allow_nan=False, separators=(",", ":")).encode() + b"\n"
    while data:
        data = data[out.write(data) :]


def _prepare() -> None:
    """Import what every task needs, so that no task's clock counts it."""
    import importlib

    importlib.import_module("softmark.interpreter.run")


def _die_with_parent() -> None:
    """Ask Linux to kill this process when its parent dies; elsewhere the end of the pipe does."""
    if sys.platform != "linux":
        return
    import ctypes

    set_signal = 1  # PR_SET_PDEATHSIG of <sys/prctl.h>
    ctypes.CDLL(None, use_errno=True).prctl(set_signal, signal.SIGKILL, 0, 0, 0)
    if os.getppid() == 1:  # it died before we asked
        os._exit(0)


if __name__ == "__main__":
    main()
