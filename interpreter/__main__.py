"""`python -m softmark.interpreter` is `dsl`."""

import sys

from softmark.interpreter.cli import main

sys.exit(main())
