"""Laws with directions that tests of all of them look at: of each kind one, and muscle around some."""

from __future__ import annotations

from typing import Any

from softmark.solvers.materials import DIRECTED, MATERIALS

F0, S0 = (2.0, 1.0, -0.5), (0.3, 1.0, 0.2)
GUCCIONE = DIRECTED["guccione"](1.0, 8.0, 2.0, 4.0, 1.0, F0, 3.0)
LAWS: dict[str, Any] = {
    "guccione": GUCCIONE,
    "fung": DIRECTED["fung_orthotropic"](1.0, 8.0, 5.0, 2.0, 4.0, 3.0, 1.0, 1.0, F0, S0, 2.0),
    "tendon": DIRECTED["transversely_isotropic"](1.0, 2.0, 3.0, 1.0, F0, "tension", 4.0),
    "linear fibres": DIRECTED["transversely_isotropic"](1.0, 2.0, 0.0, 1.0, F0, "both", 4.0),
    "artery": DIRECTED["holzapfel_gasser_ogden"](1.0, 2.0, 3.0, 0.7, 1.0, F0, S0, 0.1, 5.0),
    "heart": DIRECTED["holzapfel_ogden"](1.0, 2.0, 3.0, 1.0, 2.0, 1.0, 0.5, 2.0, 1.0, F0, S0, 3.0),
    "muscle": DIRECTED["active"](GUCCIONE, 2.0),
    "active rubber": DIRECTED["active"](MATERIALS["neo_hookean"](1.0, 0.3, 1.0), 2.0, F0),
}
