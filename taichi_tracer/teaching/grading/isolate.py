"""Runs a hand-in in a process of its own, isolated and limited; what it computes is judged outside.

``run`` starts a process with a file of requests, and reads the file of its answers when it has ended, as late as the
limits allow. Nothing that the process writes is trusted: answers are JSON with raw numbers, see ``messages``.
docs/teaching_security.md says what each level stops:

    limits      limits of time, memory, files and processes; if the grader is root, as a user of its own
    bwrap       limits; and another file system, no network, no other processes, made by the program bubblewrap
    container   the same, made by podman or docker from the teacher's image
"""

import contextlib
import json
import os
import secrets
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cache
from itertools import takewhile
from pathlib import Path
from typing import IO

import numpy as np

import taichi_tracer
from taichi_tracer.files.disk import scene_data_dir
from taichi_tracer.system.errors import InputError
from taichi_tracer.teaching.base import Arrays
from taichi_tracer.teaching.catalogue import SHIPPED

OTHER_USER, CONTAINER = "limits, as a user of its own", "container "  # before the name of its image
LEVELS = ("bwrap", OTHER_USER, "limits")  # the stronger first
PACKAGE = Path(taichi_tracer.__file__).resolve().parent
WORK = "/walled"  # the folder of an isolated hand-in; no other folder has this name
DISK = 128 << 20  # bytes that it can hold, in memory
USER = 60_000_000  # the first of the user numbers that hand-ins get if the grader is root
SECONDS_TO_LOAD = 120.0  # of the clock, for importing Taichi, the solution and the hand-in
OF_OTHERS = 10_000  # processes of the same user; where they count, too, looks at the processes end a fork bomb
POLL = 0.2  # seconds between two looks at the memory
SYSTEM = (  # what Python and Taichi read
    *("/usr", "/bin", "/sbin", "/lib", "/lib32", "/lib64", "/nix/store"),
    *("/etc/ld.so.cache", "/etc/alternatives", "/etc/localtime", "/sys/devices/system/cpu"),
)
# The folders of installed libraries; those in the teacher's home are not found without being named.
LIBRARIES = [path for path in sys.path if os.path.basename(path) in ("site-packages", "dist-packages")]
ENGINE = shutil.which("podman") or "docker"  # which runs containers
OF_IMAGE = "--container needs podman or docker, and an image with Python and the libraries of this package"
OF_BWRAP = (
    "bwrap needs bubblewrap (on Linux: apt-get install bubblewrap) and a system that allows namespaces; "
    "for submissions that you would run yourself: --trust (in Python: trust=True)"
)
KEPT_VARIABLES = ("PATH", "LANG", "LC_ALL", "LD_LIBRARY_PATH", "DYLD_LIBRARY_PATH", "TZ")


@dataclass(frozen=True)
class Limits:
    """What one hand-in may use.

    Attributes:
        cpu: seconds of CPU for one request. wall: seconds of the clock for one request.
        address_space: bytes of one process; Taichi needs about 4 GiB.
        resident: bytes of memory of all its processes together. file: bytes of one file, and of its prints.
        processes, files: how many; threads count as processes.
    """

    cpu: float = 20.0
    wall: float = 60.0
    address_space: int = 8 << 30
    resident: int = 3 << 30
    file: int = 64 << 20
    processes: int = 96
    files: int = 256


# ── messages: a line of JSON, [facts, name of an array → its type, its shape, and its bytes in hexadecimal digits] ──


def pack(facts: dict, arrays: Arrays) -> bytes:
    """A message."""
    packed = {name: (array.dtype.str, array.shape, array.tobytes().hex()) for name, array in arrays.items()}
    return json.dumps([facts, packed]).encode() + b"\n"


def messages(content: bytes) -> Iterator[tuple[dict, Arrays]]:
    """(facts, arrays of numbers) of each message in a file, up to the first that is none."""
    with contextlib.suppress(Exception):  # whatever a stranger wrote
        for line in content.splitlines():
            facts, packed = json.loads(line)
            arrays = {
                name: np.frombuffer(bytearray.fromhex(digits), kind).reshape(shape)
                for name, (kind, shape, digits) in packed.items()
                if np.dtype(kind).kind in "biuf"
            }
            yield dict(facts), arrays


# ── the process ──


def run(
    level: str,
    limits: Limits,
    requests: Sequence[tuple[dict, Arrays]],
    folders: Mapping[str, Path],
    stopped: threading.Event,
    kernels: Path | None = None,
) -> tuple[list[tuple[dict, Arrays]], str, str, bool]:
    """What a process answers to requests, see ``worker``, until it has answered all, or has ended.

    Args:
        level: the isolation: one of ``LEVELS``, or "container IMAGE". limits: what the process may use.
        folders: name → a folder of which it gets a copy of this name; of an assignment, without its known mistakes.
        stopped: is set when the process is to end, whatever it does.
        kernels: where it keeps compiled kernels, if not in its copy of the folder "cache".

    Returns:
        (its answers, what it printed, why it ended, whether it used up its time).
    """
    user = USER + secrets.randbelow(10_000_000) if level == OTHER_USER else None
    with (
        tempfile.TemporaryDirectory(prefix="taichi_tracer_submission_", ignore_cleanup_errors=True) as given,
        tempfile.TemporaryFile() as answered,
        tempfile.TemporaryFile() as prints,
    ):
        folder = given if level.startswith("limits") else WORK  # in which the hand-in may write
        for name, source in folders.items():
            hidden = ("mistakes.py", "__pycache__") if name.startswith("assignment/") else ()
            shutil.copytree(source, f"{given}/{name}", symlinks=True, ignore=shutil.ignore_patterns(*hidden))
        Path(given, "requests").write_bytes(b"".join(pack(*request) for request in requests))
        if user is not None:
            subprocess.run(["chown", "-R", f"{user}:{user}", given], check=False)
        if level.startswith(CONTAINER):
            os.chmod(given, 0o755)  # its user is another one
        process = subprocess.Popen(
            command(level, given, folder, limits),
            stdin=subprocess.DEVNULL,
            stdout=answered,
            stderr=prints,
            cwd="/",
            env=None if level.startswith(CONTAINER) else environment(folder, str(kernels or f"{folder}/cache")),
            start_new_session=True,
            user=user,
            group=user,
            extra_groups=None if user is None else [],
        )
        try:
            reason, is_late = wait_for(process, limits, answered, len(requests), stopped)
        finally:
            kill(process.pid)
            if level.startswith(CONTAINER):
                subprocess.run([ENGINE, "kill", os.path.basename(given)], capture_output=True, check=False)
            process.wait()
        answered.seek(0)
        prints.seek(0)
        pairs = zip(requests, messages(answered.read()), strict=False)
        answers = [answer for _, answer in takewhile(lambda pair: pair[1][0].get("part") == pair[0][0]["part"], pairs)]
        return answers, prints.read().decode(errors="replace"), reason, is_late


def wait_for(
    process: subprocess.Popen, limits: Limits, answered: IO[bytes], count: int, stopped: threading.Event
) -> tuple[str, bool]:
    """Wait until a process has ended, uses more than its limits, or is to end: (why, whether it used up its time).

    Args:
        answered: what it writes answers to: an answer begins its time on the clock anew. count: of requests.
    """
    began = since = time.monotonic()
    size, most = 0, SECONDS_TO_LOAD + limits.wall * count
    while process.poll() is None:
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(POLL)
        started, now, former, size = below(process.pid), time.monotonic(), size, os.fstat(answered.fileno()).st_size
        since = now if size > former else since
        if stopped.is_set():
            return "the grader was stopped", False
        if now > since + (limits.wall if size else SECONDS_TO_LOAD) or now > began + most:
            return f"no answer came within {limits.wall if size else SECONDS_TO_LOAD:g} seconds", True
        if len(started) > limits.processes or sum(started.values()) > limits.resident:
            return f"it used more than {limits.processes} processes, or {limits.resident / 2**30:.3g} GiB", False
    code = process.returncode
    how = next((one.name for one in signal.Signals if one in (-code, code - 128)), f"exit code {code}")
    if how == "SIGXCPU":
        return f"it used more than {limits.cpu:g} seconds of the processor", True
    return f"the process ended ({how})", False


def kill(root: int) -> None:
    """End a process and everything that it started."""
    for _ in range(5):  # they may start more meanwhile
        for process in below(root):
            with contextlib.suppress(OSError):
                os.kill(process, signal.SIGKILL)
    with contextlib.suppress(OSError):
        os.killpg(root, signal.SIGKILL)


def below(root: int) -> dict[int, int]:
    """Process → resident bytes, of what a process has started, and what these have started; on Linux."""
    parents, used, found = {}, {}, {root}
    for path in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):  # it has ended
            words, process = path.read_bytes().rpartition(b")")[2].split(), int(path.parent.name)
            parents[process], used[process] = int(words[1]), int(words[21]) * os.sysconf("SC_PAGESIZE")
    while more := {process for process, parent in parents.items() if parent in found} - found:
        found |= more
    return {process: used[process] for process in found - {root}}


# ── what a process sees ──


def command(level: str, given: str, folder: str, limits: Limits) -> list[str]:
    """The words that start the isolated process; see ``run``."""
    others = 0 if level in ("bwrap", OTHER_USER) else OF_OTHERS
    numbers = json.dumps(asdict(replace(limits, processes=limits.processes + others)))
    words = ["-m", "taichi_tracer.teaching.grading.worker", given, folder, numbers]
    if level.startswith(CONTAINER):
        return [*container_words(level.removeprefix(CONTAINER), given, limits), "python3", *words]
    outside = bwrap_words(given) if level == "bwrap" else []
    return [*outside, os.path.abspath(sys.executable), *words]  # bwrap knows no ".."


def environment(folder: str, kernels: str) -> dict[str, str]:
    """The environment of a process: nothing of the teacher's that Python does not need."""
    return {name: os.environ[name] for name in KEPT_VARIABLES if name in os.environ} | {
        "HOME": folder,
        "TMPDIR": folder,
        "PYTHONPATH": os.pathsep.join([str(PACKAGE.parent), *LIBRARIES]),
        "TI_OFFLINE_CACHE_FILE_PATH": kernels,
        "PYTHONDONTWRITEBYTECODE": "1",
        "PYTHONHASHSEED": "0",
        "PYTHONUTF8": "1",
        "TI_SKIP_VERSION_CHECK": "ON",
        "ENABLE_TAICHI_HEADER_PRINT": "0",
        "OMP_NUM_THREADS": "1",
        "OPENBLAS_NUM_THREADS": "1",
    }


def bwrap_words(given: str) -> list[str]:
    """The words that let bubblewrap make its world: what Python and the package need, read only, and ``WORK``."""
    own = {
        *(sys.prefix, sys.base_prefix, sys.exec_prefix, os.path.dirname(os.path.realpath(sys.executable))),
        *(*LIBRARIES, str(PACKAGE), str(scene_data_dir())),
    }
    words = ["bwrap", "--unshare-all", "--die-with-parent", "--new-session", "--cap-drop", "ALL"]
    for path in sorted({*SYSTEM, *own, *map(os.path.realpath, own), given}, key=len):  # what contains others is first
        words += ["--ro-bind-try", path, path]
    words += ["--tmpfs", str(SHIPPED), "--dev", "/dev", "--proc", "/proc"]
    return [*words, "--size", str(DISK), "--perms", "0777", "--tmpfs", WORK, "--chdir", "/", "--remount-ro", "/"]


def container_words(image: str, given: str, limits: Limits) -> list[str]:
    """The words that run a program in a container, which has this package, and Python and libraries of its own."""
    own = environment(WORK, f"{WORK}/cache") | {"PYTHONPATH": str(PACKAGE.parent)}
    words = ["sh", "-c", f'ulimit -f {limits.file >> 9}; exec "$@"', "sh", ENGINE]  # of what the container prints
    words += (
        f"run --rm --init --name {os.path.basename(given)} --network none --read-only --user 65534:65534 --workdir / "
        f"--cap-drop ALL --security-opt no-new-privileges --memory {limits.resident} --pids-limit {limits.processes} "
        f"--tmpfs {WORK}:rw,exec,mode=1777,size={DISK}"
    ).split()
    words += [f"--volume={path}:{path}:ro" for path in (given, PACKAGE)]
    words += [f"--env={name}={value}" for name, value in own.items() if name not in KEPT_VARIABLES]
    return [*words, f"--tmpfs={SHIPPED}", image]


# ── which levels this machine has ──


@cache
def problem_of(level: str) -> str | None:
    """Why a level does not work on this machine, in one line; None if it works. It is tried."""
    try:
        answers, printed, reason, _ = run(
            level, Limits(), [({"part": "", "assignment": ""}, {})], {}, threading.Event()
        )
    except OSError as error:
        answers, printed, reason = [], "", f"{error.strerror}: {error.filename}"
    return None if answers else f"{level} does not work here ({' '.join((printed or reason).split())[-200:]})"


def best_level(trust: bool = False, image: str = "") -> str:
    """The strongest level that works on this machine.

    Args:
        trust: whether limits alone are enough where bubblewrap does not work. image: of a container, if one is wanted.

    Raises:
        InputError: none does, or limits alone, which are not enough.
    """
    if os.name != "posix":
        raise InputError("submissions can be run on Linux and macOS only: on Windows, use its subsystem for Linux")
    for level in [CONTAINER + image] if image else LEVELS[: 3 if trust else 1]:
        if (problem := problem_of(level)) is None:
            return level
    raise InputError(f"submissions cannot be isolated: {problem}; {OF_IMAGE if image else OF_BWRAP}")
