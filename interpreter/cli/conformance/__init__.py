"""What a class of somebody else, or of ours, must keep to be a word: contracts, each of which says what breaks it.

    words       documented, frozen, fields with ranges and meanings, a text that is the same in every process
    metrics     finite or a reason, an error of nothing is nothing, the same twice, JSON's types
    laws        stress and stiffness are the derivatives of the energy, nothing at rest, turns change nothing
    trials      a scene for each word, which is refused in words or computed: never an exception, never no number
    plugin      all of a file: `dsl conformance`

A contract is a generator of breaches: what is wrong and what to do. tests/contracts holds our own tables to them.
To add one: a generator here, a line in `plugin_contracts.py`.
"""

from __future__ import annotations

from softmark.records import dataclass


@dataclass(frozen=True)
class Breach:
    """What a class does not keep, and what to do; `untried` where it could not be found out."""

    what: str
    remedy: str
    untried: bool = False
