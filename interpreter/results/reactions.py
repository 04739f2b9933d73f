"""What a report says of a support: what it holds, and the force and the moment that it holds it with."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from typing import Any

from softmark.interpreter.results.loads import Vector
from softmark.records import dataclass


@dataclass(frozen=True)
class Reaction:
    """What a support does to a body at rest: force in N, and moment in N m about the origin.

    `own_moment` is that about `at`, the middle of what is held, m: deformed, or undeformed in a model of small strain.
    `shared` names the supports that hold some of it as well, and `shared_force` is what acts there; it counts as that
    of the support that comes first in the scene, so that the sum over all of them is that of the body.
    """

    force: Vector
    moment: Vector
    at: Vector
    own_moment: Vector
    shared: tuple[str, ...] = ()
    shared_force: Vector = (0.0, 0.0, 0.0)

    def to_json(self) -> dict[str, Any]:
        """The contract's entry, beside the share of the selection that is held."""
        own: dict[str, Any] = {
            "force": list(self.force), "moment": list(self.moment), "about": [0.0, 0.0, 0.0],
            "at": list(self.at), "own_moment": list(self.own_moment),
        }  # fmt: skip
        return own | ({"shared": [*self.shared], "shared_force": list(self.shared_force)} if self.shared else {})


@dataclass(frozen=True)
class AtRest:
    """What a state of rest says of forces: reactions and works of loads by name, and the strain energy, J.

    The work of a load at full size is None where it depends on the way. `reason` says why nothing is known.
    """

    reactions: Mapping[str, Reaction] = field(default_factory=dict)
    work: Mapping[str, float | None] = field(default_factory=dict)
    energy: float = 0.0
    reason: str | None = None
