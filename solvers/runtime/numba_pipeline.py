"""Shortened numba compiler pipeline: two thirds of numba's passes, those that the project's kernels need.

The pipeline omits the passes for closures, `with` blocks, whole-array expressions, literal arguments and inlined
functions. Kernels contain none of these, and each pass visits all code of a kernel. The result type of an operation is
inferred once for all operands of the same types, whereas numba tries all its array rules at every operation.
"""

from __future__ import annotations

from typing import Any

from numba.core import compiler, compiler_machinery, typed_passes, types, untyped_passes

machinery: Any = compiler_machinery  # numba has no type annotations
typed: Any = typed_passes
early: Any = untyped_passes


@machinery.register_pass(mutates_CFG=True, analysis_only=False)
class CachedTypeInference(typed_passes.NopythonTypeInference):
    """numba's type inference, with a cache for functions whose arguments are all numbers."""

    _name = "types"

    def run_pass(self, state: Any) -> bool:
        """Infer the types of one kernel; results for functions of numbers are cached for this kernel.

        Kernels that it calls are compiled meanwhile, each with its own cache.
        """
        context, known = state.typingctx, {}
        resolve, before = context.resolve_function_type, vars(context).get("resolve_function_type")

        def remembered(function: Any, given: tuple[Any, ...], named: Any) -> Any:
            plain = isinstance(function, types.Function) and all(isinstance(a, types.Number) for a in given)
            if named or not plain:
                return resolve(function, given, named)
            if (function, given) not in known:
                known[function, given] = resolve(function, given, named)
            return known[function, given]

        context.resolve_function_type = remembered
        try:
            return bool(super().run_pass(state))  # type: ignore[no-untyped-call]
        finally:
            if before is None:
                del context.resolve_function_type
            else:
                context.resolve_function_type = before


ORDER = (
    early.TranslateByteCode,
    early.FixupArgs,
    early.IRProcessing,
    early.RewriteSemanticConstants,  # evaluates `x is None` ...
    early.DeadBranchPrune,  # ... and removes the excluded branch
    early.GenericRewrites,
    early.ReconstructSSA,
    CachedTypeInference,
    typed.PreLowerStripPhis,
    typed.IRLegalization,
    typed.AnnotateTypes,
    typed.NativeLowering,
    typed.NoPythonBackend,
)


class ShortPipeline(compiler.CompilerBase):
    """numba compiler with the shortened pipeline; an unsupported language feature ends in numba's error message."""

    def define_pipelines(self) -> list[Any]:
        """Return a single pipeline, without numba's second one for Python objects."""
        manager = machinery.PassManager("kernel")
        for step in ORDER:
            manager.add_pass(step, step.__name__)
        manager.finalize()
        return [manager]
