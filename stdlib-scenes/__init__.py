"""The standard library of scenes: every `.scene` file below this folder runs in the tests and judges itself."""

from pathlib import Path

ROOT = Path(__file__).parent
