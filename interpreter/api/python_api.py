"""Python functions of the interpreter: `softmark.load`, `softmark.compare`, `softmark.robustness`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from softmark.grammar.diagnostic import Diagnostic, Source
from softmark.interpreter.language.compiled_scene import Scene, SceneError
from softmark.interpreter.language.scene_sources import UnreadableScene, locate_scene, read_scene_file
from softmark.interpreter.validation.scene_loader import load_scene
from softmark.records import dataclass

if TYPE_CHECKING:
    from softmark.interpreter.api.shown_report import RunReport
    from softmark.interpreter.api.shown_studies import ShownComparison, ShownRobustness

Parameter = Any  # a text such as "120 mm", a number for a parameter without unit, or a pint quantity
TOLD = ("model", "reference", "metric")  # kinds of declarations that `repr` of a scene lists


@dataclass(frozen=True)
class LoadedScene:
    """A scene without errors that is ready to run; `warnings` lists the warnings about it."""

    scene: Scene
    warnings: tuple[Diagnostic, ...]

    @property
    def title(self) -> str:
        """Title of the scene."""
        return self.scene.title

    @property
    def models(self) -> tuple[str, ...]:
        """Names of the models of the scene."""
        return tuple(self.scene.of_kind("model"))

    def __repr__(self) -> str:
        from softmark.interpreter.results.prompt_representation import join_names, shorten

        own = [f"{kind}s {join_names(list(known))}" for kind in TOLD if (known := self.scene.of_kind(kind))]
        counts = {"expectation": len(self.scene.expectations), "warning": len(self.warnings)}
        own += [f"{n} {noun}{'s' * (n != 1)}" for noun, n in counts.items() if n]
        return f"<Scene {shorten(self.title or self.scene.source.name)!r}: {'; '.join(own)}>"

    def _repr_html_(self) -> str:
        from softmark.interpreter.report.notebook.scene_box import inline

        return inline(self.scene, self.warnings)

    def run(self, models: str | Sequence[str] | None = None, repeat: int = 1, stated: bool = False) -> RunReport:
        """Solve the models and evaluate metrics and expectations; `models` selects some of them.

        Each solution is repeated `repeat` times for timing. With `stated` each model also estimates its own error,
        which about doubles the cost.

        A notebook shows the progress. Models that do not converge are in the report with their status: check the
        status before using their numbers. Raises SceneError if the scene cannot be built or a name in `models` is
        unknown, and its subclass BadArgument for an argument of a wrong type or size.
        """
        from softmark.interpreter.api import api_arguments
        from softmark.interpreter.validation.requested_names import unknown_models

        only = () if models is None else api_arguments.check_models(models)
        if models is not None and not only:
            raise api_arguments.BadArgument("`models` is empty; omit it to run all models")
        api_arguments.check_count("repeat", repeat)
        asked = () if api_arguments.check_flag("stated", stated) else None
        from softmark.interpreter.api import notebook_progress
        from softmark.interpreter.api.shown_report import RunReport
        from softmark.interpreter.pipeline.run_options import CheckedScene, RunOptions
        from softmark.interpreter.pipeline.run_pipeline import run_to_report

        if problems := unknown_models(self.scene, only):
            raise SceneError(problems)
        with notebook_progress.progress_line() as say:
            options = RunOptions(only=only, repeat=int(repeat), say=say, stated=asked, free=True)
            return RunReport.from_report(run_to_report(CheckedScene(self.scene, self.warnings), options))


def load(file: str | Path, /, plugins: Sequence[str | Path] = (), **parameters: Parameter) -> LoadedScene:
    """Return the scene of a file, or of the standard library by name: `load("beam.scene", L="120 mm")`.

    `parameters` replace those of the scene: texts, pint quantities, or numbers for parameters without a unit.
    `plugins` are plugin files or names of installed plugins whose words the scene may use. Raises SceneError with all
    diagnostics if the scene has errors, BadArgument for a value of a wrong type, FileNotFoundError if there is no
    such scene.
    """
    from softmark.interpreter.api.api_arguments import check_path

    check_path("file", file, "the file of a scene, or the name of a standard scene")
    try:
        path = locate_scene(str(file))
        source = read_scene_file(path)
    except UnreadableScene as missing:
        raise FileNotFoundError(f"{missing.reason}. {missing.remedy}") from missing
    return _load_source(source, path.parent, path, parameters, plugins)


def loads(text: str, /, plugins: Sequence[str | Path] = (), **parameters: Parameter) -> LoadedScene:
    """Return the scene of a text; file names in the text are relative to the working directory. Raises SceneError."""
    from softmark.interpreter.api import api_arguments

    api_arguments.check_text("text", text, "the text of a scene")
    return _load_source(Source("<text>", text), Path(), None, parameters, plugins)


def _load_source(
    source: Source,
    folder: Path,
    file: Path | None,
    parameters: Mapping[str, object],
    plugins: Sequence[str | Path],
) -> LoadedScene:
    from softmark.interpreter.api import api_arguments

    overrides = [api_arguments.format_override(name, value) for name, value in parameters.items()]
    return load_source(source, folder, file, overrides, api_arguments.check_paths("plugins", plugins))


def load_source(
    source: Source,
    folder: Path,
    file: Path | None,
    overrides: Sequence[str],
    plugins: Sequence[str],
    only: Sequence[str] = (),
) -> LoadedScene:
    """Return the scene of a source text, with overrides as on the command line: `L=120 mm`. Raises SceneError.

    With `only`, errors are ignored if they concern only models that are not listed.
    """
    scene, diagnostics = load_scene(source, folder, file, overrides, only, plugins)
    if any(d.severity == "error" for d in diagnostics) or scene is None:
        raise SceneError([d for d in diagnostics if d.severity == "error"])
    return LoadedScene(scene, tuple(diagnostics))


def compare(
    *scenes: str | Path | LoadedScene,
    vary: Mapping[str, Sequence[Parameter] | Parameter] | None = None,
    models: str | Sequence[str] = (),
    study: str | None = None,
    folder: str | Path | None = None,
    jobs: int = 1,
    cluster: str | None = None,
    timeout: float | None = None,
    repeats: int = 5,
    resume: bool = False,
    fresh: bool = False,
    allow_contaminated: bool = False,
) -> ShownComparison:
    """Solve every model of some scenes for all values of their studies, and compare errors and times.

    `vary={"h": ["10 mm", "5 mm"]}` replaces the studies. `folder` keeps the journal from which `resume` continues; by
    default no journal is kept. `timeout` is in s for each configuration; `repeats=0` skips timing. Raises SceneError,
    BadArgument, FileNotFoundError, journal.Refused for a folder that is in use or already has results, and
    pool.Unavailable if workers or a cluster are not available.
    """
    import tempfile

    from softmark.interpreter.api import api_arguments

    if not scenes:
        raise api_arguments.BadArgument(
            "`softmark.compare` needs a scene: a file, a standard scene, or the result of `load`"
        )
    texts, only = api_arguments.format_variations(vary), api_arguments.check_models(models)
    jobs, repeats = api_arguments.check_count("jobs", jobs), api_arguments.check_count("repeats", repeats, least=0)
    timeout = None if timeout is None else api_arguments.check_positive("timeout", timeout, "seconds", or_none=True)
    resume, fresh = api_arguments.check_resume_and_fresh(resume, fresh)
    api_arguments.check_flag("allow_contaminated", allow_contaminated)
    for name, value in (("study", study), ("cluster", cluster)):
        if value is not None:
            api_arguments.check_text(name, value, "a text or None")
    if folder is not None:
        api_arguments.check_path("folder", folder, "a folder")

    from softmark.interpreter.api import notebook_progress
    from softmark.interpreter.api.shown_studies import ShownComparison
    from softmark.interpreter.study.comparison_study import ComparisonRequest
    from softmark.interpreter.study.comparison_study import compare as carry_out
    from softmark.interpreter.study.configurations.configuration_expansion import SceneSubject, subject_of

    subjects: list[SceneSubject] = []
    for one in scenes:
        scene = one.scene if isinstance(one, LoadedScene) else load(one).scene
        subjects.append(subject_of(scene, [s.name for s in subjects]))
    with tempfile.TemporaryDirectory() as scratch, notebook_progress.progress_line() as say:
        request = ComparisonRequest(
            Path(folder or scratch), texts, only, study, jobs, cluster, timeout, repeats, resume, fresh,
            allow_contaminated, "softmark.compare", say,
        )  # fmt: skip
        return ShownComparison.from_comparison(carry_out(subjects, request))


def robustness(
    scene: str | Path | LoadedScene,
    models: str | Sequence[str] = (),
    study: str | None = None,
    folder: str | Path | None = None,
    jobs: int = 1,
    timeout: float = 60.0,
    memory: float = 4.0,
    resume: bool = False,
    fresh: bool = False,
) -> ShownRobustness:
    """Run the robustness studies of a scene, or one over all its numbers, and return where each model fails.

    `silent` of the result lists the points with a wrong result and no warning. `folder` keeps the journal from which
    `resume` continues; by default no journal is kept. `timeout` is in CPU seconds for each point, `memory` in GiB for
    each process. Raises SceneError, BadArgument, FileNotFoundError, journal.Refused for a folder that is in use or
    already has results, and pool.Unavailable if workers are not available.
    """
    import tempfile

    from softmark.interpreter.api import api_arguments

    only, jobs = api_arguments.check_models(models), api_arguments.check_count("jobs", jobs)
    timeout = api_arguments.check_positive("timeout", timeout, "seconds")
    memory = api_arguments.check_positive("memory", memory, "GiB")
    resume, fresh = api_arguments.check_resume_and_fresh(resume, fresh)
    if study is not None:
        api_arguments.check_text("study", study, "the name of a study or None")
    if folder is not None:
        api_arguments.check_path("folder", folder, "a folder")

    from softmark.interpreter.api import notebook_progress
    from softmark.interpreter.api.shown_studies import ShownRobustness
    from softmark.interpreter.study.configurations.configuration_expansion import subject_of
    from softmark.interpreter.study.robustness.robustness_study import RobustnessRequest
    from softmark.interpreter.study.robustness.robustness_study import run_robustness_studies as carry_out

    loaded = scene if isinstance(scene, LoadedScene) else load(scene)
    with tempfile.TemporaryDirectory() as scratch, notebook_progress.progress_line() as say:
        request = RobustnessRequest(
            Path(folder or scratch), only, study, jobs, timeout, memory, resume, fresh, "softmark.robustness", say
        )
        return ShownRobustness.showing(carry_out(subject_of(loaded.scene), request))


stress = robustness  # its earlier name
