"""Kernels that another process has read: neither does Python read them again, nor does Taichi translate them.

Taichi keeps the machine code of a kernel in a folder, under a key that is computed from the whole kernel. So Python
must read it in each process, only to find the code. Here, all that the reading asked is kept, too (see ``shared``). If
another process gives the same answers, it makes a kernel with the same parameters, and with a few statements instead of
all: numbers that stand for the answers. Under the key of this small kernel, the folder has the code of the large one.

A kernel is kept only if every function and class that it asks for is one of the package, as its file has it. What a
student writes is always read.

If the folder does not have the code of the large kernel, then the small one is what runs. It returns ``ITSELF``, which
the large one does not: then the large one is read, and runs.
"""

import contextlib
import functools
import hashlib
import os
import pickle
import platform
import secrets
import shutil
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import taichi as ti
from taichi._lib import core
from taichi.lang import impl
from taichi.lang.expr import Expr, make_expr_group

from taichi_tracer.system import clock, compiling
from taichi_tracer.system.taichi_17 import records
from taichi_tracer.system.taichi_17.questions import Notes
from taichi_tracer.system.taichi_17.words import OWN

LONG = 0.02  # seconds of reading: a kernel that is read in less is not kept
MOST = 32  # readings that are kept for each function: to see that it is none of them takes 2 ms for each
MOST_FILES = 200  # of readings, of all functions under all circumstances: each version of the package has its own
ITSELF = 20051  # what a kernel returns that does nothing
FOLDER = "readings"  # in Taichi's folder
CODE = "T*.tic"  # Taichi's files
# Taichi's, which change how a kernel is read. What changes how it is translated is in the key of the small one.
SETTINGS = "arch", "debug", "fast_math", "opt_level"
RULES = "short_circuit_operators", "unrolling_limit"  # the same, for Python


class Kept(NamedTuple):
    """A reading that was kept.

    Attributes:
        record: see ``records``. seconds: that it took.
        small, large: the names of Taichi's files with the code of the small and of the large kernel; "" if Taichi has
            found code that was there before, under a name that nothing tells.
        salt: makes the keys of both new, so that the next process learns the names.
    """

    record: bytes
    seconds: float
    small: str
    large: str
    salt: str


@dataclass
class Waiting:
    """A reading that is kept at the end.

    Attributes:
        name: of the kernel, which no other kernel of any process has. file: where it is kept.
        record, seconds, salt: see ``Kept``. mode: Taichi's mode of the kernel.
    """

    name: str
    file: Path
    record: bytes
    seconds: float
    salt: str
    mode: Any


is_used = False  # whether readings are kept
parameters: list[tuple[str, tuple[Any, ...]]] = []  # of the kernel that is read: methods of Taichi's, and their words
_name: str | None = None  # of the kernel that is read, if it may be kept; no other kernel of any process has it
_salt = ""  # of this kernel
_waiting: list[Waiting] = []
_unproven: dict[Any, list[Any]] = {}  # kernels that may do nothing → record, its file, and Taichi's object of a launch
_missed: dict[bytes, Path] = {}  # records of kernels that did nothing → their files
_started = time.time() - clock.seconds_since_start()


def use() -> None:
    """Keep readings from now on."""
    global is_used
    is_used = True


def files_now() -> str | None:
    """The times and sizes of the package's files; None if one was changed after this process has begun."""
    home = Path(__file__).parents[2]
    places = [(root, names) for root, _, names in os.walk(home)]
    paths = sorted(os.path.join(root, name) for root, names in places for name in names if name.endswith(".py"))
    facts = [(path[len(str(home)) :], os.stat(path)) for path in paths]
    if max(fact.st_mtime for _, fact in facts) > _started:
        return None
    return repr([(name, fact.st_mtime_ns, fact.st_size) for name, fact in facts])


package_files = functools.lru_cache(maxsize=1)(files_now)  # as they were when the first kernel was read


def file_of(kernel: Any) -> Path | None:
    """The file of the readings of a function under the circumstances of this process; None if none are kept."""
    if not (is_used and is_plain(kernel) and ti.cfg.offline_cache and package_files()):
        return None
    running = impl.get_runtime()
    config = running.prog.config()
    settings = [str(getattr(config, name)) for name in SETTINGS] + [getattr(running, name) for name in RULES]
    settings += [kind.to_string() for kind in (config.default_fp, config.default_ip)]
    function = kernel.func.__module__, kernel.func.__qualname__
    facts = repr((function, package_files(), settings, versions()))
    return Path(ti.cfg.offline_cache_file_path) / FOLDER / hashlib.sha256(facts.encode()).hexdigest()


def is_plain(kernel: Any) -> bool:
    """Whether a kernel returns nothing, and is no derivative."""
    return not kernel.return_type and kernel.autodiff_mode == core.AutodiffMode.NONE


def versions() -> tuple[str, ...]:
    """What is the same as long as nobody installs anything."""
    package, patches = sys.modules[OWN].__version__, os.environ.get("TAICHI_TRACER_PATCHES", "")
    return package, ti.__version__, np.__version__, sys.version, sys.platform, platform.machine(), patches


def told(features: Any) -> str:
    """What Taichi notes of arguments that are no objects, as text."""
    if isinstance(features, tuple):
        return f"({', '.join(map(told, features))})"
    return features.to_string() if isinstance(features, core.DataType) else repr(features)


def kept_in(file: Path) -> list[Kept]:
    """The readings in a file."""
    try:
        return pickle.loads(file.read_bytes())
    except (OSError, pickle.UnpicklingError, EOFError, ValueError, TypeError, AttributeError, ImportError, IndexError):
        return []


def find(kernel: Any, objects: tuple[Any, ...], features: Any) -> tuple[Notes, Any, Any] | None:
    """A kernel that another process has read: its questions, Taichi's object of it, and what sets its arguments.

    Args:
        kernel: Taichi's object of the function. objects, features: what it is called with, see ``shared``.
    """
    file = file_of(kernel)
    if file is None:
        return None
    for kept in kept_in(file):
        if kept.record in _missed or not kept.large:
            continue
        try:
            notes, facts = records.read(kept.record)
        except records.NoWordError:  # about something that this process has not imported
            continue
        found = notes.objects_of(objects) if facts["features"] == told(features) else None
        if found is None:
            continue
        launch = facts["launch"].of(found) if facts["launch"] is not None else None
        if (launch is None) == (facts["launch"] is None):
            made = small_kernel(kept, facts, file, kernel.func.__name__, kernel.autodiff_mode)
            _unproven[made] = [kept.record, file, None]
            return notes, made, launch
    return None


@contextlib.contextmanager
def reading(kernel: Any, features: Any) -> Iterator[Callable[[Notes, Any, Any], None]]:
    """While Python reads a kernel. Yields a function that keeps the questions, the kernel, and what sets arguments."""
    global _name, _salt
    file, began = file_of(kernel), time.perf_counter()
    parameters.clear()
    name = f"{kernel.func.__name__}_{secrets.token_hex(8)}"
    _name = name if is_used and is_plain(kernel) else None
    salt = _salt = next((one.salt for one in (kept_in(file) if file else []) if not one.large), "")

    def keep(notes: Notes, made: Any, launch: Any) -> None:
        seconds = time.perf_counter() - began
        if file is None or seconds < LONG or kernel.has_print:
            return
        facts = {"function": kernel.func.__qualname__, "features": told(features), "parameters": parameters}
        record = records.written(notes, launch=launch and launch.bare(), **facts)
        if record is not None:
            compiling.note_kept(made)
            _waiting.append(Waiting(name, file, record, seconds, salt, kernel.autodiff_mode))

    try:
        yield keep
    finally:
        _name = None


def naming(create: Callable) -> Callable:
    """``Program.create_kernel``, which gives a kernel that may be kept a name and a mark.

    Without the mark, the code of a kernel would be found under the key that it had before a file of the package was
    changed, and the readings of that time are not found: it would be read for ever.
    """

    @functools.wraps(create)
    def created(program: Any, build: Any, name: str, *words: Any) -> Any:
        if _name is None:
            return create(program, build, name, *words)

        def built(kernel: Any) -> None:
            mark(kernel.ast_builder(), repr((package_files(), versions(), _salt)).encode())
            build(kernel)

        return create(program, built, _name, *words)

    return created


def mark(builder: Any, facts: bytes) -> None:
    """Add statements to a kernel that do nothing but make it another one for other facts."""
    digest, place = hashlib.sha256(facts).digest(), core.DebugInfo("")
    for k in range(0, len(digest), 4):
        number = int.from_bytes(digest[k : k + 4], "little", signed=True)
        builder.expr_assign(builder.expr_alloca(place), core.make_const_expr_int(ti.i32, number), place)


def inserting(insert: Callable) -> Callable:
    """A method of Taichi's kernel that adds a parameter, which is noted."""

    @functools.wraps(insert)
    def inserted(kernel: Any, *words: Any) -> Any:
        parameters.append((insert.__name__, words))
        return insert(kernel, *words)

    return inserted


def small_kernel(one: Kept | Waiting, facts: dict, file: Path, name: str, mode: Any) -> Any:
    """A kernel that does nothing, and is told from all others by the answers and by the circumstances.

    Args:
        one: with the record. facts: see ``records``: the parameters are those of the large kernel. file: where the
            record is kept. name, mode: of the kernel.
    """

    def build(kernel: Any) -> None:
        for method, words in facts["parameters"]:
            getattr(kernel, method)(*words)
        kernel.insert_ret(ti.i32)
        kernel.finalize_params()
        kernel.finalize_rets()
        mark(kernel.ast_builder(), file.name.encode() + one.record + one.salt.encode())
        returned = make_expr_group(Expr(core.make_const_expr_int(ti.i32, ITSELF)))
        kernel.ast_builder().create_kernel_exprgroup_return(returned, core.DebugInfo(""))

    build.read_before = facts["function"], one.seconds  # type: ignore[attr-defined]  # for ``kernels``
    return impl.get_runtime().prog.create_kernel(build, name, mode)


def noting_launch(make: Callable) -> Callable:
    """``Kernel.make_launch_context``, which notes the launch of a kernel that may do nothing."""

    @functools.wraps(make)
    def made(kernel: Any) -> Any:
        context = make(kernel)
        if kernel in _unproven:
            _unproven[kernel][-1] = context
        return context

    return made


def did_nothing(made: Any) -> bool:
    """Whether a kernel that was just launched is a small one, which ran itself."""
    if made not in _unproven:
        return False
    record, file, context = _unproven.pop(made)
    if context.get_struct_ret_int((0,)) != ITSELF:
        return False
    _missed[record] = file
    return True


def finishing(finalize: Callable) -> Callable:
    """``Program.finalize``, with which Taichi writes code into its folder: readings are written, too."""

    @functools.wraps(finalize)
    def finalized(program: Any) -> None:
        place, before = Path(ti.cfg.offline_cache_file_path), set[Path]()
        if _waiting and files_now() != package_files():  # somebody has edited the package meanwhile
            _waiting.clear()
        if _waiting:
            before = {*place.glob(CODE)}
            for one in _waiting:
                with contextlib.suppress(records.NoWordError):  # a module that somebody has removed since
                    facts = records.read(one.record)[1]
                    small = small_kernel(one, facts, one.file, f"{one.name}_small", one.mode)
                    program.compile_kernel(program.config(), program.get_device_caps(), small)
        finalize(program)
        with contextlib.suppress(OSError):  # a folder that is full or gone: kernels are read again
            write([path for path in place.glob(CODE) if path not in before] if _waiting else [])
        for all_of in (_waiting, _unproven, _missed):
            all_of.clear()

    return finalized


def write(made: list[Path]) -> None:
    """Give the code of large kernels to the small ones, and write the readings.

    Args:
        made: the files that Taichi has just written.
    """
    code = {path.name: path.read_bytes() for path in made}

    def file_with(name: str) -> str:
        return next((one for one, content in code.items() if f"{name}_kernel_".encode() in content), "")

    for file in {*(one.file for one in _waiting), *_missed.values()}:
        kept = {one.record: one for one in kept_in(file)}
        for one in _waiting:
            if one.file == file:
                former = kept.pop(one.record, None) or Kept(b"", 0.0, "", "", "")
                small = file_with(f"{one.name}_small") or former.small
                large = file_with(one.name) or former.large
                new = Kept(one.record, one.seconds, small, large, one.salt)
                kept = {one.record: new if small and large else nameless(new), **kept}
        for record in kept.keys() & (_missed.keys() | {one.record for one in _waiting}):
            there = file.parent.parent / kept[record].large
            if there.is_file():
                replace(there.with_name(kept[record].small), there)
            else:
                kept[record] = nameless(kept[record])
        if kept:
            file.parent.mkdir(exist_ok=True)
            fresh = file.with_suffix(f".{secrets.token_hex(8)}")
            fresh.write_bytes(pickle.dumps([*kept.values()][:MOST]))
            fresh.replace(file)
            forget([*kept.values()][MOST:], file.parent.parent)
            for old in sorted(file.parent.iterdir(), key=lambda path: path.stat().st_mtime)[:-MOST_FILES]:
                forget(kept_in(old), file.parent.parent)
                old.unlink()


def nameless(one: Kept) -> Kept:
    """A reading of which Taichi has code, under a name that nothing tells."""
    return Kept(one.record, one.seconds, "", "", secrets.token_hex(8))


def forget(readings: list[Kept], folder: Path) -> None:
    """Remove the code under the keys of small kernels, whose readings are not kept any longer."""
    for name in {one.small for one in readings} - {""}:
        (folder / name).unlink(missing_ok=True)


def replace(file: Path, by: Path) -> None:
    """Give a file the content of another one, at once. It is a copy: Taichi may write into either of them."""
    fresh = file.with_suffix(f".{secrets.token_hex(8)}")
    shutil.copyfile(by, fresh)
    fresh.replace(file)
