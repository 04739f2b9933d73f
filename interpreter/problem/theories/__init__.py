"""Theories that references solve: a setup class for each kind of problem, which makes the problem from a case.

    theory_setup            base class TheorySetup: checks of the case, problem, forces, stress, warning, facts
    *_theory_setup          its classes
    reference_solution      problem and solution of a reference of a scene

To add a kind, write a module with a class derived from TheorySetup and add its line to THEORIES; references name the
kind as their `problem_kind`. The module is imported when a scene has such a reference.
"""

from __future__ import annotations

from importlib import import_module

from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.problem.body_case import fault
from softmark.interpreter.problem.theories.theory_setup import TheorySetup

THEORIES = {
    "bar": "bar_theory_setup:BarSetup",
    "block_stack": "patch_theory_setup:PatchTestSetup",
    "cantilever": "beam_theory_setup:CantileverSetup",
    "finite_porous_column": "porous_theory_setup:FinitePorousColumnSetup",
    "frame": "frame_theory_setup:FrameSetup",
    "hole": "inclusion_theory_setup:HoleSetup",
    "inclusion": "inclusion_theory_setup:InclusionSetup",
    "indentation": "contact_theory_setup:IndentationSetup",
    "inflation": "inflation_theory_setup:InflationSetup",
    "porous_column": "porous_theory_setup:PorousColumnSetup",
    "porous_disc": "porous_theory_setup:PorousDiscSetup",
    "porous_slab": "porous_theory_setup:PorousSlabSetup",
    "stopped_bar": "signorini_theory_setup:SignoriniSetup",
    "tendon_rod": "tendon_theory_setup:TendonRodSetup",
    "torsion": "torsion_theory_setup:TorsionSetup",
    "viscoelastic_bar": "relaxation_theory_setup:ViscoelasticBarSetup",
}


def theory_setup_of(reference: Declared) -> TheorySetup:
    """Return the setup object for the theory of a reference.

    A reference that is not solved by a theory, but measured or refined, gets the base class, which gives no results.
    Raises Fault if a plugin's reference names an unknown kind of problem.
    """
    if reference.thing.how != "solved":
        return TheorySetup()
    kind = reference.thing.problem_kind
    if kind not in THEORIES:
        raise fault("E503", reference.at(), f"`{reference.name}` solves problems of the unknown kind `{kind}`",
                    help=f"set `problem_kind` of its class to one of: {', '.join(THEORIES)}")  # fmt: skip
    module, name = THEORIES[kind].split(":")
    setup: TheorySetup = getattr(import_module(f"{__name__}.{module}"), name)()
    return setup
