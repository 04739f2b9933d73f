"""References: what the answer should be, by means that share nothing with the solvers.

    cantilever         the straight clamped beam that a scene is reduced to, and `Refused`
    centre_line        the result: displacements of any point of the beam
    collocation        the boundary-value problem that two of the theories share, and `NotSolved`
    elastica           large deflections, bending alone
    simo_reissner      large deflections with shear and stretch
    small_deflection   the closed form for small ones
    rucker_webster     a beam that tendons bend and twist in space, by the equations of `driven_rod`
    frame_theory       a network of beams under small loads, by the stiffness method
    graded_bar         a bar whose constants vary along it, pulled along its axis
    prony              a bar whose stress relaxes, moved or pulled by any course
    terzaghi           a porous column that is pressed a little and cannot widen; `modes` sums what diffuses
    mandel, unconfined  a porous slab or disc between plates, open at its sides: `between_plates` solves both
    confined           a porous column that is pressed far, by collocation; `skeletons` has the laws
    torsion            a cylinder of rubber that is twisted by any angle, with what its ends carry
    inflation          a ball of rubber that is blown up; `rubber` has the laws of both
    goodier, kirsch    an inclusion or a cavity in a ball, a hole in a plate, pulled from afar: `round_core` solves both
    hertz, hertz_line, sneddon  a rigid sphere, cylinder, cone or punch that is pressed into a face: `half_space`
    dimitriadis, pressed_layer  the same into a layer, by a series and by the integral equation of `layer`
    cattaneo_mindlin   a sphere that is pressed and dragged, with friction
    signorini          a bar that a rigid plane stops
    patch_test         blocks end to end that touch or are glued

    self_converged     the scene's own models refined: what is asked for; solving them is not done here

and what was measured:

    data               public data sets, by name and checksum
    measured           surfaces and tracked points in metres, with their uncertainty
    surface, ct_volume, markers, curve, virtual_scan   how they are read or made
    values              what was published, written in the scene
    consensus           values and curves on which several codes agreed, with their band
    tables              named columns of numbers, with the place of each defect
    surfaces, registration, smoothing, volumes  geometry that they share

To add one, write a file with a frozen dataclass derived from `Reference`: fields as in `Elastica` (the scene
language reads them), class attributes `how`, `source` and `error_meaning`, and either `solve(cantilever) ->
CentreLine` or `load()`, which gives a `MeasuredSurface`, `MeasuredPoints`,
`MeasuredCurve` or `KnownValue`; then add its line to `REFERENCES`.
Its docstring is what `dsl list` (first line) and `dsl explain` (the rest) show.

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
