"""The steps by which numba compiles our kernels: those of its own that they need, two thirds of all.

Left out is what looks for closures, `with` blocks, expressions of whole arrays, literal arguments and functions to be
spliced in: a kernel has none of these, and each step goes through all of its code. And what an operation gives is
found out once for all operands of the same types, where numba asks all its rules for arrays anew at every sum.
"""

from __future__ import annotations

from typing import Any

from numba.core import compiler, compiler_machinery, typed_passes, types, untyped_passes

machinery: Any = compiler_machinery  # without types of their own
typed: Any = typed_passes
early: Any = untyped_passes


@machinery.register_pass(mutates_CFG=True, analysis_only=False)
class Types(typed_passes.NopythonTypeInference):
    """numba's inference of types, with a memory for functions of numbers."""

    _name = "types"

    def run_pass(self, state: Any) -> bool:
        """In the context of this kernel alone; those that it calls are compiled meanwhile, and have their own."""
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
    early.RewriteSemanticConstants,  # `x is None` is known, ...
    early.DeadBranchPrune,  # ... and what it excludes left out
    early.GenericRewrites,
    early.ReconstructSSA,
    Types,
    typed.PreLowerStripPhis,
    typed.IRLegalization,
    typed.AnnotateTypes,
    typed.NativeLowering,
    typed.NoPythonBackend,
)


class Passes(compiler.CompilerBase):
    """numba's compiler with the steps above; whatever else a kernel contains ends in its error message."""

    def define_pipelines(self) -> list[Any]:
        """One, without a second that would fall back on Python's objects."""
        manager = machinery.PassManager("kernel")
        for step in ORDER:
            manager.add_pass(step, step.__name__)
        manager.finalize()
        return [manager]
