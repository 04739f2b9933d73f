"""Termination of child processes when their parent process dies."""

from __future__ import annotations

import os
import signal
import sys


def die_with_parent() -> None:
    """Ask Linux to kill this process when its parent dies; on other systems do nothing."""
    if sys.platform != "linux":
        return
    import ctypes

    set_signal = 1  # PR_SET_PDEATHSIG of <sys/prctl.h>
    ctypes.CDLL(None, use_errno=True).prctl(set_signal, signal.SIGKILL, 0, 0, 0)
    if os.getppid() == 1:  # it died before we asked
        os._exit(0)
