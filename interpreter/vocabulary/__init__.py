"""Words of the scene language for the experiment: bodies, regions, supports, loads, analyses, probes, studies.

To add a word: a class in the file of its kind and a line in the table of that kind here.
"""

from __future__ import annotations

from typing import Any

from softmark.interpreter.vocabulary.amplitude_words import PerState, Pulse, Ramp, Sine, Smooth, Table
from softmark.interpreter.vocabulary.analysis_words import Dynamic, Quasistatic, Static
from softmark.interpreter.vocabulary.body_words import Axisymmetric, BeamNetwork, PlaneStrain, PlaneStress, Rigid, Solid
from softmark.interpreter.vocabulary.contact_words import RigidContactPair
from softmark.interpreter.vocabulary.loads.body_force import Gravity
from softmark.interpreter.vocabulary.loads.centrifugal import Centrifugal
from softmark.interpreter.vocabulary.loads.line_force import LineLoad
from softmark.interpreter.vocabulary.loads.point_force import PointForce
from softmark.interpreter.vocabulary.loads.pressure import Pressure
from softmark.interpreter.vocabulary.loads.remote_stress import RemoteStressLoad
from softmark.interpreter.vocabulary.loads.surface_traction import Traction
from softmark.interpreter.vocabulary.loads.tendon import Tendon
from softmark.interpreter.vocabulary.loads.torque import Torque
from softmark.interpreter.vocabulary.probe_words import Line, Markers, MeshNodes, Point, Surface, Volume
from softmark.interpreter.vocabulary.published_words import Column
from softmark.interpreter.vocabulary.region_words import BodyGroup, BodyPart
from softmark.interpreter.vocabulary.self_contact_words import SelfContact, Tied
from softmark.interpreter.vocabulary.study_words import Convergence, Pareto, RobustnessStudy, Sweep
from softmark.interpreter.vocabulary.supports.displaced_part import Displaced
from softmark.interpreter.vocabulary.supports.drained_surface import Drained
from softmark.interpreter.vocabulary.supports.fixed_part import Fixed
from softmark.interpreter.vocabulary.supports.foundation_support import ElasticFoundationSupport
from softmark.interpreter.vocabulary.supports.measured_motion import MeasuredMotion
from softmark.interpreter.vocabulary.supports.pinned_points import Pinned
from softmark.interpreter.vocabulary.supports.pore_pressure_support import PorePressure
from softmark.interpreter.vocabulary.supports.rigid_plate import RigidPlate
from softmark.interpreter.vocabulary.supports.rotated_part import Rotated
from softmark.interpreter.vocabulary.supports.symmetry_plane import Symmetric

BODIES: dict[str, type[Any]] = {
    "solid": Solid,
    "plane_strain": PlaneStrain,
    "plane_stress": PlaneStress,
    "axisymmetric": Axisymmetric,
    "network": BeamNetwork,
    "rigid": Rigid,
}

REGIONS: dict[str, type[Any]] = {
    "part": BodyPart,
    "group": BodyGroup,
}

SUPPORTS: dict[str, type[Any]] = {
    "fixed": Fixed,
    "displaced": Displaced,
    "rotated": Rotated,
    "measured_motion": MeasuredMotion,
    "symmetric": Symmetric,
    "pinned": Pinned,
    "elastic_foundation": ElasticFoundationSupport,
    "rigid_plate": RigidPlate,
    "drained": Drained,
    "pore_pressure": PorePressure,
}

CONTACTS: dict[str, type[Any]] = {
    "rigid_contact": RigidContactPair,
    "self_contact": SelfContact,
    "tied": Tied,
}

LOADS: dict[str, type[Any]] = {
    "gravity": Gravity,
    "traction": Traction,
    "remote_stress": RemoteStressLoad,
    "pressure": Pressure,
    "point_force": PointForce,
    "torque": Torque,
    "line_load": LineLoad,
    "tendon": Tendon,
    "centrifugal": Centrifugal,
}

ANALYSES: dict[str, type[Any]] = {
    "static": Static,
    "dynamic": Dynamic,
    "quasistatic": Quasistatic,
}

AMPLITUDES: dict[str, type[Any]] = {
    "ramp": Ramp,
    "smooth": Smooth,
    "pulse": Pulse,
    "sine": Sine,
    "table": Table,
    "per_state": PerState,
}

PROBES: dict[str, type[Any]] = {
    "point": Point,
    "line": Line,
    "surface": Surface,
    "volume": Volume,
    "mesh_nodes": MeshNodes,
    "markers": Markers,
}

PUBLISHED: dict[str, type[Any]] = {
    "column": Column,
}

STUDIES: dict[str, type[Any]] = {
    "sweep": Sweep,
    "convergence": Convergence,
    "pareto": Pareto,
    "robustness": RobustnessStudy,
}
