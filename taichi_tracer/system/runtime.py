"""The start of Taichi: which backend runs the kernels, in which precision, and where compiled kernels are kept.

A process has only one Taichi runtime. Starting it again frees the memory of everything that was made before. Only this
module starts it.

The cache is a writable folder in which Taichi keeps compiled kernels between runs, or none. If Taichi cannot write its
cache, it ends the process with a segmentation fault. This happens in containers, in computer labs and in automatic
graders. Therefore the folder is tested before Taichi starts. While Taichi writes kernels, an empty file is its lock. If
the process is killed meanwhile, the lock stays, and from then on no process saves any kernel, without a word. Therefore
a lock that is old is removed.
"""

import atexit
import contextlib
import ctypes
import ctypes.util
import functools
import io
import os
import stat
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import taichi as ti
from taichi.lang import impl

from taichi_tracer.system.compile_time import is_starter, note_start, one_at_a_time, usable_processors
from taichi_tracer.system.errors import InputError, one_of
from taichi_tracer.system.importing import import_quickly

# ── the cache ──


VARIABLE = "TI_OFFLINE_CACHE_FILE_PATH"  # the environment variable in which Taichi looks for the folder
LOCK = "ticache.lock"  # in the folder
OLD = 60.0  # seconds: writing kernels takes less than one
TRIED_BYTES = 4096  # the size of the file that is written to test whether the disk has space


def wanted_folder() -> Path:
    """The folder that Taichi would choose: that of the environment variable, or its default in the user's home."""
    return Path(os.environ.get(VARIABLE) or impl.default_cfg().offline_cache_file_path)


def cache_folder(wanted: str | Path) -> tuple[Path | None, str | None]:
    """The folder for compiled kernels, and a message if it is not the wanted folder.

    Args:
        wanted: the folder that Taichi would choose.

    Returns:
        ``wanted`` if it is writable, which is made if it is missing; otherwise None, which means that kernels are
        compiled again in every run.
    """
    folder = Path(wanted)
    try:
        folder.mkdir(parents=True, exist_ok=True, mode=stat.S_IRWXU)
        with tempfile.TemporaryFile(dir=folder) as file:
            file.write(bytes(TRIED_BYTES))
            file.flush()
    except OSError as error:
        problem = error.strerror or type(error).__name__
        advice = f"kernels are compiled anew in every run, unless {VARIABLE} names another folder"
        return None, f"the cache of compiled kernels, {wanted}, cannot be written ({problem}): {advice}"
    with contextlib.suppress(OSError):  # there is no lock, or another process has just removed it
        if time.time() - (folder / LOCK).stat().st_mtime > OLD:
            (folder / LOCK).unlink()
    return folder, None


# ── the start ──


ARCHS = ("auto", "cpu", "cuda", "metal", "vulkan")
PRECISIONS = ("f32", "f64")
F64_ARCHS = ("cpu", "cuda")  # Metal has no f64; Vulkan has it only in an extension, which Taichi does not use
# What kernels of the package need here and there, and only some backends can: what it is → where.
ABILITIES = {
    "f64": F64_ARCHS,
    "parallel building": ("cpu", "cuda"),  # vectors as elements of arrays that a kernel changes: trees are built so
    "separate roundings": ("cpu",),  # a b + c is rounded twice; elsewhere once at times, also without ``fast_math``
}
# Threads per CPU, if all CPUs are used. With two threads for two CPUs, Linux often starts both on the same CPU.
WORKERS_PER_CPU = 2
# Of the Vulkan 1.0 specification: the first number of a VkInstanceCreateInfo, whose other numbers are 0; 32-bit numbers
# that have room for a VkPhysicalDeviceProperties, of 824 bytes; the type of a device that is software.
INSTANCE_CREATE_INFO, PROPERTIES_SIZE, TYPE_CPU = 1, 256, 4
# Taichi's own optimisation passes take half of the compile time, and LLVM finds the same optimisations:
# benchmarks/RESULTS.md. With vectors of 16 numbers, and in scenes with spheres, they end the process.
COMPILATION = {"advanced_optimization": False, "cfg_optimization": False}


@dataclass(frozen=True)
class Settings:
    """The settings with which Taichi was started."""

    arch: str
    precision: str
    fast_math: bool


@one_at_a_time
def init(
    arch: str = "auto",
    precision: str = "f32",
    fast_math: bool = False,
    *,
    force: bool = False,
    debug: bool = False,
    threads: int | None = None,
) -> Settings:
    """Start Taichi. This call is optional: the first scene starts Taichi with these defaults.

    Args:
        arch: "cpu", "cuda", "metal", "vulkan", or "auto": CUDA if it has a device, otherwise the CPU. The drivers of
            Metal and Vulkan differ, so that they must be named; Vulkan also where it is only software.
        precision: "f32" or "f64", for every coordinate and colour.
        fast_math: whether the compiler may ignore NaN, infinity and exact rounding. The default is False, because the
            watertight triangle test and the film's compensated sums need exact rounding. The accuracy study shows how
            much time it would save. A GPU rounds quotients and roots less exactly in any case.
        force: start again even if Taichi runs with other settings. Every scene that exists then becomes unusable.
        debug: whether to check the bounds of every array access and the ``assert`` statements in kernels (slow).
        threads: the number of CPUs to use; None uses all.

    If Taichi already runs with these settings, the call does nothing.

    Raises:
        InputError: a name is unknown, or the backend has no f64.
        RuntimeError: Taichi runs with other settings and ``force`` is False.
    """
    check_not_forked()
    if arch not in ARCHS:
        raise one_of("arch", arch, ARCHS)
    if precision not in PRECISIONS:
        raise one_of("precision", precision, PRECISIONS)
    if precision == "f64" and arch not in ("auto", *F64_ARCHS):
        raise InputError(f"precision 'f64' does not exist on arch {arch!r}: use one of {', '.join(F64_ARCHS)}")
    if threads is not None and not (isinstance(threads, int) and threads >= 1):
        raise InputError(f"threads must be a whole number of at least 1, or None for all, not {threads!r}")
    running = current()
    if running is not None and not force:
        chosen = running.arch if arch == "auto" else _choose(arch)[0]
        is_same = Settings(chosen, precision, bool(fast_math)) == running
        is_as_many = threads is None or workers(threads) == ti.cfg.cpu_max_num_threads
        if is_same and is_as_many and debug in (False, ti.cfg.debug):
            return running
        raise RuntimeError(
            f"Taichi already runs with ({running.arch}, {running.precision}, fast_math={running.fast_math}); "
            "starting it again with "
            f"(arch={arch}, {precision}, fast_math={fast_math}) frees the memory of every scene made so far. "
            "Call init(..., force=True) if that is what you want."
        )

    chosen, message = _choose(arch)
    note = _start(Settings(chosen, precision, bool(fast_math)), debug, threads)
    # A notebook shows stderr in red, like an error.
    stream = sys.stdout if type(sys.stderr).__module__.startswith("ipykernel") else sys.stderr
    for line in filter(None, (message, note)):
        print(f"taichi_tracer: {line}", file=stream)
    return ensure()


def _start(settings: Settings, debug: bool, threads: int | None) -> str | None:
    """Start Taichi, with the patches and with a folder for its cache. Returns a note on the cache, if there is one."""
    patches()
    cache, note = cache_folder(wanted_folder())
    log_level = ti.ERROR if settings.arch == "cpu" else ti.CRITICAL  # what a GPU cannot compile raises an error
    # Taichi makes the folder also if it keeps nothing there.
    unkept = {"offline_cache": False, "offline_cache_file_path": f"{tempfile.gettempdir()}/taichi"}
    with contextlib.redirect_stdout(io.StringIO()):  # hides Taichi's own line; _choose makes a clearer one
        note_start()
        ti.init(
            arch=getattr(ti, settings.arch),
            default_fp=getattr(ti, settings.precision),
            fast_math=settings.fast_math,
            debug=debug,
            log_level=log_level,
            **COMPILATION,
            cpu_max_num_threads=workers(threads),
            **(unkept if cache is None else {}),
        )
        impl.get_runtime().materialize()  # here, because Taichi allows it in this thread alone
    return note


@functools.lru_cache(maxsize=1)
def patches() -> str:
    """Replace names of Taichi, once. Returns why they are not replaced; "" if they are."""
    return import_quickly("taichi_tracer.system.taichi_17.patches").apply()


def workers(threads: int | None) -> int:
    """The number of threads that Taichi starts for a number of CPUs; None means all CPUs that this process may use."""
    cpus = usable_processors()
    return threads if threads is not None and threads < cpus else WORKERS_PER_CPU * (threads or cpus)


@one_at_a_time
def ensure() -> Settings:
    """The settings of the running Taichi. If it does not run yet, it is started with the defaults.

    A Taichi that other code has started gets what the package's kernels need, see ``COMPILATION``. Kernels that were
    compiled before stay as they are. The program's own kernels that follow get the settings, too.
    """
    check_not_forked()
    patches()  # here too, because other code may have started Taichi
    running = current()
    if running is None:
        return init()
    if not (is_starter() or impl.get_runtime().materialized):
        raise InputError("another thread has started Taichi: make the first scene there; then all threads may use it")
    config = impl.get_runtime().prog.config()
    for name, value in COMPILATION.items():
        setattr(config, name, value)
    return running


def checks_overflow() -> bool:
    """Whether kernels report each overflow of whole numbers: Taichi does so in debug mode."""
    return bool(impl.get_runtime().prog.config().debug)


def check_not_forked() -> None:
    """Raise in a process that was forked after Taichi was started: its threads stayed behind, and a kernel would hang.

    Raises:
        RuntimeError: it was, whatever is asked of Taichi there.
    """
    if is_forked:
        raise RuntimeError(
            "Taichi was started before this process was forked, and would hang in it: start the process by "
            'multiprocessing.get_context("spawn")'
        )


def _note_fork() -> None:
    global is_forked
    program = impl.get_runtime().prog
    if program is not None:
        is_forked = True
        # Never destroyed here: its destructor waits for the threads, too.
        ctypes.pythonapi.Py_IncRef(ctypes.py_object(program))


def _finish() -> None:
    """Let Taichi write the kernels that were compiled into its cache.

    Taichi itself does so when its program is destroyed. At the end of a process that may never happen, because
    something can still refer to the program.
    """
    program = impl.get_runtime().prog
    if program is not None and not is_forked:
        program.finalize()


atexit.register(_finish)
is_forked = False  # whether this process was forked from one in which Taichi ran
if hasattr(os, "register_at_fork"):  # not on Windows, where no process is forked
    os.register_at_fork(after_in_child=_note_fork)


def current() -> Settings | None:
    """The settings of the running Taichi, even if other code started it; None if it does not run."""
    if impl.get_runtime().prog is None:
        return None
    arch = "cpu" if ti.cfg.arch in (ti.x64, ti.arm64) else ti.cfg.arch.name
    return Settings(arch, "f64" if ti.cfg.default_fp == ti.f64 else "f32", bool(ti.cfg.fast_math))


def dtype() -> type[np.float32] | type[np.float64]:
    """The numpy type of the running precision."""
    return np.float64 if ti.cfg.default_fp == ti.f64 else np.float32


def epsilon() -> float:
    """The distance from 1 to the next larger number in the running precision."""
    return float(np.finfo(dtype()).eps)


def smallest() -> float:
    """The smallest positive normal number in the running precision; a divisor of at least this size is never 0."""
    return float(np.finfo(dtype()).tiny)


def can(ability: str) -> bool:
    """Whether the running backend has one of the ``ABILITIES``."""
    return ensure().arch in ABILITIES[ability]


def can_widen() -> bool:
    """Whether kernels run in f32 and can compute single steps in f64."""
    return can("f64") and dtype() is np.float32


def _choose(arch: str) -> tuple[str, str | None]:
    """The backend to start, and a message for the user, or None. ``ti.gpu`` would crash if there is no driver."""
    if arch == "auto":
        return ("cuda" if has_device("cuda") else "cpu"), None
    if arch == "cpu" or has_device(arch):
        return arch, None
    if arch == "vulkan" and any(vulkan_devices()):
        return arch, "running on Vulkan in software, which is slower than arch 'cpu'"
    return "cpu", f"running on the CPU; arch {arch!r} was asked for, but there is no device for it"


def has_device(arch: str) -> bool:
    """Whether there is a real GPU for "cuda", "metal" or "vulkan". Software Vulkan is slower than the CPU backend."""
    ti.set_logging_level(ti.ERROR)  # otherwise Taichi reports every driver library that it does not find
    core = ti._lib.core
    if arch == "vulkan":
        return not all(vulkan_devices()) and core.with_vulkan()  # the second takes longer
    return {"cuda": core.with_cuda, "metal": core.with_metal}[arch]()


def vulkan_devices() -> list[bool]:
    """Whether each device of the Vulkan loader is a program on the CPU. Without a device, Taichi ends the process."""
    # On Linux, ``find_library`` would start other programs to find it.
    on_linux = sys.platform.startswith("linux")
    name = "libvulkan.so.1" if on_linux else ctypes.util.find_library("vulkan") or "vulkan-1"
    try:
        vk = ctypes.CDLL(name)
    except OSError:
        return []
    instance, count = ctypes.c_void_p(), ctypes.c_uint32()
    if vk.vkCreateInstance((ctypes.c_uint64 * 8)(INSTANCE_CREATE_INFO), None, ctypes.byref(instance)) != 0:
        return []
    vk.vkEnumeratePhysicalDevices(instance, ctypes.byref(count), None)
    handles = (ctypes.c_void_p * count.value)()
    vk.vkEnumeratePhysicalDevices(instance, ctypes.byref(count), handles)
    are_software = []
    for handle in handles:
        properties = (ctypes.c_uint32 * PROPERTIES_SIZE)()  # five numbers, of which the last is the type; char[256]
        vk.vkGetPhysicalDeviceProperties(ctypes.c_void_p(handle), properties)
        are_software.append(properties[4] == TYPE_CPU)
    vk.vkDestroyInstance(instance, None)
    return are_software
