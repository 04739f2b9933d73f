"""Support that moves a part of a body as points moved in an experiment."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

from softmark.interpreter.vocabulary.supports.support import DisplacementSupport, UndefinedMotion
from softmark.records import dataclass

if TYPE_CHECKING:
    import numpy as np

    from softmark.interpreter.vocabulary.supports.support import Floats, Measured
else:
    from softmark.solvers.runtime.lazy_modules import np


@dataclass(frozen=True)
class MeasuredMotion(DisplacementSupport):
    """Moves the selected part of a body as tracked points moved in an experiment.

    Displacements between the tracked points are interpolated by thin plate splines (Duchon 1977), exact at the points,
    and extrapolated beyond the outermost ones. If the points form a layer, a tenth as thick as wide or less, they are
    treated as lying in its plane: changes across the layer are ignored. Only tracked points within `reach` of the
    selected part are used. In a solid model every node of the selected part is moved.
    """

    moves = True
    displaces = True
    follows_amplitude = False
    nonrigid_reason = "follows tracked points, which do not move a section rigidly"

    body: Annotated[str, "body", "body that is moved"]
    where: Annotated[Any, "condition", "selected points, by undeformed coordinates"]
    of: Annotated[str, "reference", "measurement: a reference with tracked points"]
    reach: Annotated[float, "m in (0, inf)", "largest distance of a tracked point from the selected part"]
    components: Annotated[tuple[int, ...], "components", "directions in which displacements are imposed"] = (0, 1, 2)

    @property
    def tracked(self) -> str:
        """Name of the measurement whose points the support follows."""
        return self.of

    def prevents_rotation(self, planar: bool) -> bool:
        """Return False, because measured points may have rotated."""
        return False

    def prescribed_displacements(self, X: Floats, share: float = 1.0, measured: Measured | None = None) -> Floats:
        """Return displacements (n, 3), m, at points X (n, 3), m, by thin plate splines of the tracked points.

        `measured` has the tracked points of measurements, by name. Raises UndefinedMotion.
        """
        from scipy.interpolate import RBFInterpolator
        from scipy.spatial import cKDTree

        if measured is None or self.of not in measured:
            problem = f"follows `{self.of}`, which could not be read"
            raise UndefinedMotion("E406", ("of", problem, "", "see the reason in the report of the reference"))
        data = measured[self.of]
        near = cKDTree(X).query(data.X)[0] <= self.reach
        points = data.X[near]
        spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False) if len(points) > 3 else np.zeros(3)
        if len(points) < 4 or spread[1] < 1e-6 * spread[0]:
            problem = f"finds only {len(points)} tracked points near the part that it moves"
            help = "write a larger `reach`, or another `where`"
            raise UndefinedMotion("E302", ("reach", problem, "too few to define the motion", help))
        # nearly in one plane, as a layer of beads is, only their place within the plane says anything
        centre, axes = points.mean(axis=0), np.linalg.svd(points - points.mean(axis=0), full_matrices=False)[2]
        flat = spread[2] < 0.1 * spread[1]
        frame = axes[: 2 if flat else 3].T
        try:
            spline = RBFInterpolator((points - centre) @ frame, data.u[near], kernel="thin_plate_spline")
        except np.linalg.LinAlgError:
            problem = "finds tracked points at the same place in different layers"
            help = "write a smaller `reach`, so that only one layer is used"
            raise UndefinedMotion("E302", ("reach", problem, "motion not unique", help)) from None
        u: Floats = spline((X - centre) @ frame)
        return share * u

    def independent_positions(self, X: Floats) -> None:
        """Return None: no other formula interpolates between the tracked points."""
