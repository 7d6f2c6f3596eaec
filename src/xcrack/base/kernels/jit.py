"""Compilation of kernels: what they need and no more, with a cache that never stands in the way.

Much of numba's work on a function is for what kernels do not have: closures, generators, array
expressions, object mode; and its helpers are optimised and turned into machine code of their own
before they are made part of their callers. Kernels leave this out, by numba's own means: a list of
passes, and a library for helpers that stays code to be linked. It halves the time of a first run.
What an operator means for given types is looked up once (`_signature`), and new arrays are made in
place (`arrays.py`): another quarter.

numba keeps compiled code beside the source or in the user's cache folder. It raises where neither
may be written to (containers, clusters), and at every later run once a cache file is damaged.
"""

import gc
import logging
import os
import stat
import sys
import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numba
from numba.core import caching, types
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder, Flags
from numba.core.compiler_machinery import PassManager, register_pass
from numba.core.typed_passes import NativeLowering

from xcrack.base.errors import warn

_DAMAGE = (Exception,)  # what unpickling damaged bytes raises is anybody's guess


# Passes for what kernels do not contain, by name: a version of numba without one of them has one
# less to leave out.
_NOT_NEEDED = {
    "AnnotateTypes", "DumpParforDiagnostics", "FindLiterallyCalls", "InlineClosureLikes",
    "InlineInlinables", "InlineOverloads", "LiteralPropagationSubPipelinePass", "LiteralUnroll",
    "MakeFunctionToJitFunction", "NoPythonSupportedFeatureValidation", "NopythonRewrites",
    "RewriteDynamicRaises", "RewriteSemanticConstants", "WithLifting",
}  # fmt: skip


class _Library(JITCodeLibrary):
    """Machine code of a kernel: optimised once, with its helpers, and not function by function."""

    def _optimize_functions(self, ll_module: Any) -> None:
        ll_module.data_layout = self._codegen._data_layout

    def _optimize_final_module(self) -> None:
        # numba's passes run twice, the first time for its counts of references, at the highest of
        # three levels: half as long again, for kernels that are a little slower (measured).
        passes, builder = self._codegen._module_pass_manager(opt=2)
        passes.run(self._final_module, builder)


class _HelperLibrary(_Library):
    """Code of a helper, for its callers to link: it never becomes machine code by itself."""

    def finalize(self) -> None:
        for library in dict.fromkeys(self._linking_libraries):
            self._reload_init.update(library._reload_init)
            self._final_module.link_in(library._get_module_for_linking(), preserve=True)
        self._finalized = True


@register_pass(mutates_CFG=True, analysis_only=False)
class _HelperLowering(NativeLowering):
    """Lowering that ends before machine code."""

    _name = "xcrack_helper_lowering"

    def run_pass(self, state: Any) -> bool:
        state.flags.no_compile = True
        super().run_pass(state)
        # numba finds a function by its entry point. This one is a callable of its own, as numba
        # wants it, which refuses all arguments: Python has no business in a helper.
        compile_result, entry_point = state["cr"], f"{state.func_id.unique_name}".upper
        state.targetctx.insert_user_function(entry_point, compile_result.fndesc, [state.library])
        state["cr"] = compile_result._replace(cfunc=entry_point)
        return True


class _Flags(Flags):
    """numba's flags, that are compared by what is set.

    Each look for an overload compares flags; numba takes all two dozen of them by their names for
    that, which is a sixth of what compiling takes.
    """

    __slots__ = ()

    def __hash__(self) -> int:
        return _FLAGS_HASH

    def __eq__(self, flags: object) -> bool:
        return self is flags or (
            isinstance(flags, Flags) and (self._values == flags._values or super().__eq__(flags))
        )


_FLAGS_HASH = hash(Flags())  # the same for all of them: of their names


_LOOK_UP = types.BaseFunction.get_call_type
_SIGNATURES: dict[Any, Any] = {}  # what was found, by function and types of its arguments


def _signature(function: Any, context: Any, args: Any, kws: Any) -> Any:
    """Signature of a call, found once.

    numba looks through all that an operator may mean, each time that it meets one and several times
    in each compilation: twenty thousand times for less than a thousand answers. This takes the
    place of its method while a kernel is compiled, which it does in one thread at a time.
    """
    if kws or not isinstance(function, types.Function):
        return _LOOK_UP(function, context, args, kws)
    call = function, context, tuple(args)
    if call not in _SIGNATURES:
        _SIGNATURES[call] = _LOOK_UP(function, context, args, kws)
    return _SIGNATURES[call]


class _Kernel(CompilerBase):
    """numba's passes without those that kernels do not need."""

    library, lowering = _Library, NativeLowering

    def __init__(  # the arguments of numba, in its order
        self, typingctx: Any, targetctx: Any, library: Any, args: Any, return_type: Any,
        flags: Any, locals: Any,
    ) -> None:  # fmt: skip
        super().__init__(typingctx, targetctx, library, args, return_type, _Flags(flags), locals)

    def compile_extra(self, func: Any) -> Any:
        """Compile without the collector of garbage, which finds little and looks at everything."""
        is_collecting, look_up = gc.isenabled(), types.BaseFunction.get_call_type
        gc.disable()
        types.BaseFunction.get_call_type = _signature
        try:
            return super().compile_extra(func)
        finally:
            types.BaseFunction.get_call_type = look_up
            if is_collecting:
                gc.enable()

    def define_pipelines(self) -> list[Any]:
        state, passes = self.state, PassManager("kernel")
        state.library = self.library(state.targetctx.codegen(), state.func_id.func_qualname)
        state.library.enable_object_caching()
        left_out = set(_NOT_NEEDED)
        for pass_class, text in DefaultPassBuilder.define_nopython_pipeline(state).passes:
            if pass_class.__name__ not in left_out:
                passes.add_pass(self.lowering if pass_class is NativeLowering else pass_class, text)
            if pass_class.__name__ == "DeadBranchPrune":  # once: where an argument is None
                left_out.add(pass_class.__name__)
        passes.finalize()
        return [passes]


class _Helper(_Kernel):
    """The same for a function that only kernels call."""

    library, lowering = _HelperLibrary, _HelperLowering


class _Cache(caching.FunctionCache):
    """numba's cache of one function; files that cannot be read or written are compiled anew."""

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        try:
            overload = super().load_overload(sig, target_context)
        except _DAMAGE:
            overload = None
        if overload is None:
            _announce()
        return overload

    def save_overload(self, sig: Any, data: Any) -> None:
        try:
            super().save_overload(sig, data)
        except _DAMAGE:
            try:  # the index may be what is damaged
                self.flush()
                super().save_overload(sig, data)
            except _DAMAGE:
                self.disable()  # a full disk, for one; the compiled code is in memory


@cache
def _announce() -> None:
    """Say once in a process why what follows takes longer than it will the next time."""
    line = "xcrack compiles kernels that were not needed here before: up to half a minute, once"
    logging.getLogger("xcrack").info(line)
    if sys.stderr.isatty():
        print(line, file=sys.stderr)


def kernel(function: Callable[..., Any]) -> Any:
    """Compile a function of arrays; its machine code is kept on disk.

    Division by zero gives inf or nan as in numpy. Python's lock is released, so that threads run
    kernels side by side. The helpers that a kernel calls stand in its own
    file: numba notices changes of that file alone. Their names begin with an underscore, and only
    kernels call them. Loops are written out: an array expression makes a temporary array of
    each of its terms.

    Parameters
    ----------
    function : callable
    """
    is_helper = function.__name__.startswith("_")
    dispatcher = numba.njit(
        error_model="numpy", nogil=True, no_cfunc_wrapper=True, no_cpython_wrapper=is_helper,
        pipeline_class=_Helper if is_helper else _Kernel,
    )(function)  # fmt: skip
    if not numba.config.DISABLE_JIT:
        dispatcher._cache = caching.NullCache() if is_helper else _cache_of(function)
        dispatcher.get_call_template = _of_types(dispatcher.get_call_template)
    return dispatcher


def _of_types(get_call_template: Callable[..., Any]) -> Callable[..., Any]:
    """A helper called with a constant is compiled for its type; numba does it for its value."""

    def without_values(args: Any, kws: Any) -> Any:
        types = {name: numba.types.unliteral(value) for name, value in kws.items()}
        return get_call_template(tuple(numba.types.unliteral(t) for t in args), types)

    return without_values


def _cache_of(function: Callable[..., Any]) -> Any:
    """The cache of a function: where numba wants it, in a temporary folder, or none."""
    try:
        return _Cache(function)
    except RuntimeError:  # no folder that numba knows of may be written to
        folder = _temporary_cache()
    if folder is None:
        return caching.NullCache()
    numba.config.CACHE_DIR = str(folder)
    return _Cache(function)


@cache
def _temporary_cache() -> Path | None:
    """A temporary folder, with one warning for all kernels."""
    folder = _own_folder()
    remedy = "Set NUMBA_CACHE_DIR to a folder that may be written to and stays."
    if folder is None:
        warn(
            "neither xcrack's folder, the user's cache folder nor a temporary one may be written "
            f"to: each process compiles its kernels, which takes some seconds. {remedy}"
        )
    else:
        warn(
            "neither xcrack's folder nor the user's cache folder may be written to: compiled "
            f"kernels are stored in {folder}. {remedy}"
        )
    return folder


def _own_folder() -> Path | None:
    """Temporary folder that belongs to this user alone: what lies in it will be executed."""
    user = os.getuid() if hasattr(os, "getuid") else "user"
    try:
        folder = Path(tempfile.gettempdir()) / f"xcrack-kernels-{user}"
        folder.mkdir(mode=0o700, exist_ok=True)
        status = folder.lstat()
        is_foreign = stat.S_IMODE(status.st_mode) & 0o022 or not stat.S_ISDIR(status.st_mode)
        if is_foreign or (hasattr(os, "getuid") and status.st_uid != user):
            return Path(tempfile.mkdtemp(prefix="xcrack-kernels-"))
        return folder
    except OSError:
        return None


__all__ = ["kernel"]
