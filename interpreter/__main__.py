"""`python -m softmark.interpreter` is `dsl`."""

import _signal  # type: ignore[import-not-found]  # built in: `signal` takes milliseconds to import
import sys

if _signal.getsignal(_signal.SIGINT) is _signal.default_int_handler:  # until `main` says more
    _signal.signal(_signal.SIGINT, _signal.SIG_DFL)

from softmark.interpreter.cli.main import main

sys.exit(main())
