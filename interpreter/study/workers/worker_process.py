"""Worker process: reads tasks as lines of JSON and writes outcomes as lines of JSON, until the pipe ends.

    python -m softmark.interpreter.study.workers.worker_process [GIBIBYTES]

Output of libraries goes to standard error, so that it cannot mix with the outcomes. The worker ends with the process
that started it. On Linux the kernel kills it then; on other systems the worker notices the end of its pipe.
"""

from __future__ import annotations

import json
import os
import queue
import signal
import sys
import threading
from typing import Any, BinaryIO

from softmark.interpreter.study.workers.orphan_processes import die_with_parent


def main() -> None:
    """Perform tasks from standard input until it ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # an interrupt is handled by the parent, which ends this process
    die_with_parent()
    _limit_memory()
    out = os.fdopen(os.dup(1), "wb", buffering=0)
    os.dup2(2, 1)
    tasks: queue.Queue[bytes] = queue.Queue()
    threading.Thread(target=_queue_input_lines, args=(tasks,), daemon=True).start()
    _preload_modules()
    _write_message(out, {"ready": os.getpid()})
    from softmark.interpreter.study.configurations.configuration_task import perform
    from softmark.interpreter.study.configurations.task_outcome import PointTask

    while True:
        _write_message(out, perform(PointTask.from_json(json.loads(tasks.get()))).to_json())


def _queue_input_lines(tasks: queue.Queue[bytes]) -> None:
    """Put each line of standard input into a queue; exit the process when the input ends.

    Nobody would read an outcome after that.
    """
    for line in sys.stdin.buffer:
        tasks.put(line)
    os._exit(0)


def _write_message(out: BinaryIO | Any, value: dict[str, Any]) -> None:
    """Write a message as one line of JSON; exit the process if the parent has ended and no longer reads."""
    data = json.dumps(value, allow_nan=False, separators=(",", ":")).encode() + b"\n"
    try:
        while data:
            data = data[out.write(data) :]
    except BrokenPipeError:
        os._exit(0)


def _preload_modules() -> None:
    """Import the modules that every task needs, so that the time of a task does not include the imports."""
    import importlib

    for step in ("run_pipeline", "reference_runs", "model_runs", "report_assembly"):
        importlib.import_module(f"softmark.interpreter.pipeline.{step}")


def _limit_memory() -> None:
    """Limit the memory of this process to the number of GiB in its argument.

    An allocation beyond the limit then fails in this process, and does not exhaust the memory of the machine.
    """
    if len(sys.argv) > 1:
        import resource

        most = int(float(sys.argv[1]) * 2**30)
        _, hard = resource.getrlimit(resource.RLIMIT_AS)
        resource.setrlimit(resource.RLIMIT_AS, (most if hard == resource.RLIM_INFINITY else min(most, hard), hard))


if __name__ == "__main__":
    main()
