"""Command `dsl plan`: prints the task graph of a scene."""

from __future__ import annotations

import argparse

from softmark.grammar.diagnostic import make_visible
from softmark.interpreter.cli.commands.common_options import add_scene_options
from softmark.interpreter.cli.commands.scene_arguments import errors, load, show


def arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `dsl plan`: `FILE [-p NAME=VALUE]... [--model NAME]...`."""
    add_scene_options(parser)


def run(parsed: argparse.Namespace) -> int:
    """Print the task graph of a scene without solving any model."""
    scene, found = load(parsed.file, parsed.overrides, parsed.model, parsed.plugins)
    show(errors(found))
    if scene is None:
        return 2
    from softmark.interpreter.planning.run_plan import plan_of
    from softmark.interpreter.validation.requested_names import unknown_models

    if problems := unknown_models(scene, tuple(parsed.model)):
        show(problems)
        return 2
    plan = plan_of(scene, tuple(parsed.model))
    rows = [(t.kind, t.name, make_visible(t.detail), f"line {t.asked.span.line}") for t in plan.tasks]
    widths = [max((len(r[i]) for r in rows), default=0) for i in range(2)]
    print(make_visible(scene.title))
    print("tasks of `dsl run`, each with the line of the scene that needs it:")
    for kind, name, detail, line in rows:
        print(f"  {kind:<{widths[0]}}  {name:<{widths[1]}}  {detail}   ({line})")
    studies = scene.of_kind("study")
    stability = [n for n, d in studies.items() if d.constructor.name == "robustness"]
    if compared := [n for n in studies if n not in stability]:
        print(f"  studies, computed by `dsl compare`: {', '.join(compared)}")
    if stability:
        print(f"  studies, computed by `dsl robustness`: {', '.join(stability)}")
    if plan.idle:
        print(f"  not computed, because no metric or expectation needs them: {', '.join(plan.idle)}")
    return 0
