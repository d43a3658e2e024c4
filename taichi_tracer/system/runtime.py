"""Which backend runs the kernels, in which precision: chosen once, safely, and said.

Taichi is one global runtime per process; starting it again frees the memory of everything made before. This module is
the only one that starts it.
"""

import contextlib
import ctypes
import ctypes.util
import io
import os
import struct
import sys
from dataclasses import dataclass

import numpy as np
import taichi as ti
from taichi.lang import impl

from taichi_tracer.system.cache import cache_folder
from taichi_tracer.system.errors import InputError, one_of

ARCHS = ("auto", "cpu", "cuda", "metal", "vulkan")
PRECISIONS = ("f32", "f64")
F64_ARCHS = ("cpu", "cuda")  # Metal has no f64; Vulkan has it only as an extension that Taichi does not ask for
CPU_BLOCK = 512  # iterations of a parallel loop that Taichi gives to one CPU thread at a time, whatever block_dim says
WORKERS_PER_CPU = 2  # of a pool for all CPUs: of two workers for two CPUs, Linux often wakes both on the same one


@dataclass(frozen=True)
class Settings:
    """What the running Taichi was started with."""

    arch: str
    precision: str
    fast_math: bool

    def __str__(self) -> str:
        return f"{self.arch}, {self.precision}, fast_math={self.fast_math}"


def init(
    arch: str = "auto",
    precision: str = "f32",
    fast_math: bool = False,
    *,
    force: bool = False,
    debug: bool = False,
    threads: int | None = None,
) -> Settings:
    """Start Taichi; optional, since the first scene starts it with these defaults.

    Args:
        arch: "cpu", "cuda", "metal", "vulkan", or "auto": the first GPU backend that has a device, else the CPU.
        precision: "f32" or "f64", of every coordinate and colour.
        fast_math: lets the compiler treat NaN, infinity and rounding freely. Off, because the watertight triangle test
            and the film's compensated sums need exact rounding; the accuracy study shows what it would gain.
        force: start again although Taichi runs with other settings. Every scene made before becomes unusable.
        debug: check the bounds of every read and the ``assert`` in kernels (slow).
        threads: CPUs at work; None is all.

    Calling it again with the settings that are in force does nothing.

    Raises:
        InputError: a name that is not known, or f64 on a backend that has none.
        RuntimeError: Taichi runs with other settings and ``force`` is False.
    """
    global _fell_back_from
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
        chosen = running.arch if arch == "auto" or arch == _fell_back_from else arch
        is_same = Settings(chosen, precision, bool(fast_math)) == running
        is_as_many = threads is None or workers(threads) == ti.cfg.cpu_max_num_threads
        if is_same and is_as_many and debug in (False, ti.cfg.debug):
            return running
        raise RuntimeError(
            f"Taichi already runs with ({running}); starting it again with "
            f"(arch={arch}, {precision}, fast_math={fast_math}) frees the memory of every scene made so far. "
            "Call init(..., force=True) if that is what you want."
        )

    chosen, message = _choose(arch, precision)
    _fell_back_from = arch if chosen != arch else None
    cache, note = cache_folder(impl.default_cfg().offline_cache_file_path)
    with contextlib.redirect_stdout(io.StringIO()):  # Taichi prints its arch; _choose has the better line
        ti.init(
            arch=getattr(ti, chosen),
            default_fp=getattr(ti, precision),
            fast_math=bool(fast_math),
            debug=debug,
            log_level=ti.ERROR,
            # Taichi's own passes take half of the compilation and LLVM finds the same: benchmarks/RESULTS.md.
            advanced_optimization=False,
            cfg_optimization=False,
            cpu_max_num_threads=workers(threads),
            **({"offline_cache": False} if cache is None else {"offline_cache_file_path": str(cache)}),
        )
    for line in (message, note):
        if line is not None:
            print(f"taichi_tracer: {line}", file=sys.stderr)
    return current()


def workers(threads: int | None) -> int:
    """How many threads Taichi is to start for so many CPUs; None is all that this process may use."""
    has_affinity = hasattr(os, "sched_getaffinity")  # not on macOS and Windows
    cpus = len(os.sched_getaffinity(0)) if has_affinity else os.cpu_count() or 1
    return threads if threads is not None and threads < cpus else WORKERS_PER_CPU * (threads or cpus)


_fell_back_from: str | None = None  # the arch that was asked for in the start that is running, where it got another


def ensure() -> Settings:
    """The running settings; starts Taichi with the defaults if nobody has."""
    running = current()
    return init() if running is None else running


def current() -> Settings | None:
    """What Taichi runs with, whoever started it; None before that."""
    if impl.get_runtime().prog is None:
        return None
    arch = "cpu" if ti.cfg.arch in (ti.x64, ti.arm64) else ti.cfg.arch.name
    return Settings(arch, "f64" if ti.cfg.default_fp == ti.f64 else "f32", bool(ti.cfg.fast_math))


def dtype() -> type:
    """The numpy type of the running precision."""
    return np.float64 if ti.cfg.default_fp == ti.f64 else np.float32


def epsilon() -> float:
    """The distance from 1 to the next number in the running precision."""
    return float(np.finfo(dtype()).eps)


def has_f64() -> bool:
    """Whether kernels may compute in f64, whatever the default precision."""
    return ensure().arch in F64_ARCHS


def can_widen() -> bool:
    """Whether kernels run in f32 and may compute a detail in f64."""
    return has_f64() and dtype() is np.float32


def _choose(arch: str, precision: str) -> tuple[str, str | None]:
    """The backend to start, and what to tell the user about it. ``ti.gpu`` would crash where no driver is."""
    wanted = [arch] if arch != "auto" else ["cuda", "metal", "vulkan"]
    wanted = [a for a in wanted if precision == "f32" or a in F64_ARCHS]
    for candidate in wanted:
        if candidate == "cpu" or has_device(candidate):
            return candidate, None
    if arch == "auto":
        return "cpu", f"running on the CPU; no GPU was found for {', '.join(wanted)}"
    return "cpu", f"running on the CPU; arch {arch!r} was asked for, but there is no device for it"


def has_device(arch: str) -> bool:
    """Whether a real GPU answers for "cuda", "metal" or "vulkan"; software Vulkan is slower than the CPU backend."""
    ti.set_logging_level(ti.ERROR)  # else Taichi reports every driver library that it does not find
    core = ti._lib.core
    if arch == "vulkan":
        return core.with_vulkan() and any(not d.is_software for d in vulkan_devices())
    return {"cuda": core.with_cuda, "metal": core.with_metal}[arch]()


@dataclass(frozen=True)
class VulkanDevice:
    """A device that the Vulkan loader offers; ``is_software`` when it is a program running on the CPU."""

    name: str
    is_software: bool


class _InstanceCreateInfo(ctypes.Structure):
    """VkInstanceCreateInfo of the Vulkan 1.0 specification, chapter 4.2."""

    _fields_ = (
        ("sType", ctypes.c_int),
        ("pNext", ctypes.c_void_p),
        ("flags", ctypes.c_uint32),
        ("pApplicationInfo", ctypes.c_void_p),
        ("enabledLayerCount", ctypes.c_uint32),
        ("ppEnabledLayerNames", ctypes.c_void_p),
        ("enabledExtensionCount", ctypes.c_uint32),
        ("ppEnabledExtensionNames", ctypes.c_void_p),
    )


def vulkan_devices() -> list[VulkanDevice]:
    """Devices of the Vulkan loader, asked directly: Taichi itself ends the process when there is none."""
    library = ctypes.util.find_library("vulkan") or ctypes.util.find_library("vulkan-1")
    if library is None:
        return []
    try:
        vk = ctypes.CDLL(library)
    except OSError:
        return []
    instance = ctypes.c_void_p()
    structure_type_instance_create_info = 1
    create_info = _InstanceCreateInfo(sType=structure_type_instance_create_info)
    if vk.vkCreateInstance(ctypes.byref(create_info), None, ctypes.byref(instance)) != 0:
        return []
    count = ctypes.c_uint32()
    vk.vkEnumeratePhysicalDevices(instance, ctypes.byref(count), None)
    handles = (ctypes.c_void_p * count.value)()
    vk.vkEnumeratePhysicalDevices(instance, ctypes.byref(count), handles)
    devices = [_describe(vk, handle) for handle in handles]
    vk.vkDestroyInstance(instance, None)
    return devices


def _describe(vk: ctypes.CDLL, handle: int) -> VulkanDevice:
    """Read deviceType and deviceName of VkPhysicalDeviceProperties: five uint32, then char[256]."""
    properties = (ctypes.c_uint8 * 1024)()  # the structure has 824 bytes
    vk.vkGetPhysicalDeviceProperties(ctypes.c_void_p(handle), properties)
    raw = bytes(properties)
    device_type = struct.unpack_from("<5I", raw)[4]
    physical_device_type_cpu = 4
    return VulkanDevice(raw[20:276].split(b"\0")[0].decode(errors="replace"), device_type == physical_device_type_cpu)
