"""References: reference solutions by methods that share nothing with the solvers, and measurements.

Theories:

    straight_cantilever         the clamped beam that a scene is reduced to, and `NotApplicable`
    beam_centre_line            its result: displacements of any point of the beam
    elastica_collocation        the boundary-value problem of two of the beam theories, and `NotSolved`
    elastica                    large deflections in bending only
    simo_reissner               large deflections with shear and stretch
    small_deflection            closed form for small deflections
    rucker_webster              a tendon-driven rod in space, by the equations of `tendon_driven_rod`
    frame_theory                a frame of beams under small loads, by the stiffness method
    graded_bar                  a bar whose constants vary along it, under axial load
    prony                       a viscoelastic bar under any amplitude of displacement or force
    terzaghi                    consolidation of a porous column in small strain, by `diffusion_modes`
    mandel, unconfined_compression  a porous slab or disc between plates, by `poroelastic_compression`
    confined_compression        a porous column in finite strain, by collocation; laws in `porous_skeletons`
    rubber_torsion              torsion of a rubber cylinder by any angle
    rubber_inflation            inflation of a thick-walled rubber sphere; laws in `rubber_energies`
    goodier, kirsch             an inclusion or a cavity in a sphere, a hole in a plate, by `inclusion`
    hertz, hertz_line, sneddon  indentation by a rigid sphere, cylinder, cone or punch: `half_space_indentation`
    dimitriadis, layer_indentation  indentation of a layer, by a series and by `layer_integral_equation`
    cattaneo_mindlin            a sphere in normal contact, moved tangentially with friction
    signorini                   a bar stopped by a rigid plane
    contact_patch_test          blocks in line that touch or are glued
    self_converged              the scene's own models refined; they are solved elsewhere

Measurements and given values:

    data_download               public data sets, by name and checksum
    measured_data               surfaces and tracked points in metres, with their uncertainty
    measured_surface, ct_volume, tracked_points, measured_curve, virtual_scan   readers
    published_values            values written in the scene
    code_consensus              values and curves on which several codes agree, with their band
    csv_tables                  named columns of numbers, with the place of each defect
    surface_geometry, registration, surface_smoothing, voxel_files  shared geometry and files

To add one, write a file with a frozen dataclass derived from `Reference`: fields as in `Elastica` (the scene language
reads them), class attributes `how`, `source` and `error_meaning`, and either `solve(cantilever) -> CentreLine` or
`load()`, which returns a `MeasuredSurface`, `MeasuredPoints`, `MeasuredCurve` or `KnownValue`; then add its line to
`REFERENCES`. Its docstring is shown by `dsl list` (first line) and `dsl explain` (the rest).

Importing this package imports neither numpy nor scipy: naming a reference costs nothing until it is solved.
"""

from __future__ import annotations

from softmark.references.cattaneo_mindlin import CattaneoMindlin
from softmark.references.code_consensus import Consensus, ConsensusCurve
from softmark.references.confined_compression import Confined
from softmark.references.contact_patch_test import PatchTest
from softmark.references.ct_volume import CtVolume
from softmark.references.dimitriadis import Dimitriadis
from softmark.references.elastica import Elastica
from softmark.references.frame_theory import FrameTheory
from softmark.references.goodier import Goodier
from softmark.references.graded_bar import GradedBar
from softmark.references.hertz import Hertz
from softmark.references.hertz_line import HertzLine
from softmark.references.kirsch import Kirsch
from softmark.references.layer_indentation import PressedLayer
from softmark.references.mandel import Mandel
from softmark.references.measured_curve import CurveInTable
from softmark.references.measured_surface import SurfaceScan
from softmark.references.prony import Prony
from softmark.references.published_values import Values
from softmark.references.rubber_inflation import Inflation
from softmark.references.rubber_torsion import Torsion
from softmark.references.rucker_webster import RuckerWebster
from softmark.references.self_converged import SelfConverged
from softmark.references.signorini import Signorini
from softmark.references.simo_reissner import SimoReissner
from softmark.references.small_deflection import SmallDeflection
from softmark.references.sneddon import Sneddon
from softmark.references.terzaghi import Terzaghi
from softmark.references.tracked_points import TrackedPoints
from softmark.references.unconfined_compression import Unconfined
from softmark.references.virtual_scan import VirtualScan

REFERENCES: dict[str, type] = {
    "elastica": Elastica,
    "small_deflection": SmallDeflection,
    "simo_reissner": SimoReissner,
    "torsion": Torsion,
    "inflation": Inflation,
    "goodier": Goodier,
    "kirsch": Kirsch,
    "rucker_webster": RuckerWebster,
    "frame_theory": FrameTheory,
    "graded_bar": GradedBar,
    "prony": Prony,
    "terzaghi": Terzaghi,
    "mandel": Mandel,
    "unconfined": Unconfined,
    "confined": Confined,
    "hertz": Hertz,
    "hertz_line": HertzLine,
    "sneddon": Sneddon,
    "dimitriadis": Dimitriadis,
    "pressed_layer": PressedLayer,
    "cattaneo_mindlin": CattaneoMindlin,
    "signorini": Signorini,
    "patch_test": PatchTest,
    "self_converged": SelfConverged,
    "surface": SurfaceScan,
    "markers": TrackedPoints,
    "curve": CurveInTable,
    "values": Values,
    "consensus": Consensus,
    "consensus_curve": ConsensusCurve,
    "ct_volume": CtVolume,
    "virtual_scan": VirtualScan,
}
