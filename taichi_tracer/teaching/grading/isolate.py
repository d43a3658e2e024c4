"""Runs a hand-in in a process of its own, isolated and limited; what it computes is judged outside.

``SubmissionProcess.ask`` sends one request, and waits for one answer no longer than the limits allow. Nothing that the
process sends is trusted: an answer is a message, see ``unpack``, with the ticket of its request; prints are cut.
docs/teaching_security.md says what each level stops:

    limits      limits of time, memory, files and processes; if the grader is root, as a user of its own
    bwrap       limits; and another file system, no network, no other processes, made by the program bubblewrap
    container   the same, made by podman or docker from the teacher's image
"""

import contextlib
import io
import json
import math
import os
import secrets
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
from dataclasses import asdict, dataclass
from functools import cache
from multiprocessing import Pipe
from pathlib import Path

import numpy as np

import taichi_tracer
from taichi_tracer.files.disk import scene_data_dir
from taichi_tracer.system.errors import InputError
from taichi_tracer.teaching.base import Arrays
from taichi_tracer.teaching.catalogue import SHIPPED

OTHER_USER, CONTAINER = "limits, as a user of its own", "container "  # before the name of its image
LEVELS = ("bwrap", OTHER_USER, "limits")  # the stronger first
PACKAGE = Path(taichi_tracer.__file__).resolve().parent
IN_CONTAINER = "/kit"  # where the package is there
WORK = "/walled"  # the folder of an isolated hand-in; no other folder has this name
DISK = 128 << 20  # bytes that it can hold, in memory
USER = 60_000_000  # the first of the user numbers that hand-ins get if the grader is root
SECONDS_TO_LOAD = 120.0  # of the clock, for importing Taichi, the solution and the hand-in
SECONDS_TO_END = 5.0
NOBODY = "65534:65534"  # the user and the group in a container
OF_OTHERS = 10_000  # processes of the same user; where they count, too, looks at the processes end a fork bomb
POLL = 0.2  # seconds between two looks at the memory
CHUNK = 1 << 16  # bytes that are read at a time
MOST_BYTES = 64 << 20  # of an answer
SYSTEM = ("/usr", "/bin", "/sbin", "/lib", "/lib32", "/lib64", "/nix/store")  # what Python and Taichi read
SYSTEM += ("/etc/ld.so.cache", "/etc/alternatives", "/etc/localtime", "/sys/devices/system/cpu")
KEPT_VARIABLES = ("PATH", "LANG", "LC_ALL", "LD_LIBRARY_PATH", "DYLD_LIBRARY_PATH", "TZ")


@dataclass(frozen=True)
class Limits:
    """What one hand-in may use.

    Attributes:
        cpu: seconds of CPU for one request. wall: seconds of the clock for one request.
        address_space: bytes of one process; Taichi needs about 4 GiB.
        resident: bytes of memory of all its processes together. file: bytes of one file.
        processes, files: how many; threads count as processes. output: bytes of its prints that are kept.
    """

    cpu: float = 20.0
    wall: float = 60.0
    address_space: int = 8 << 30
    resident: int = 3 << 30
    file: int = 64 << 20
    processes: int = 96
    files: int = 256
    output: int = 16 << 10


@dataclass(eq=False)
class WorkerEnded(Exception):
    """The process does not answer any more: why, in one sentence; and whether it used up its time."""

    reason: str
    is_late: bool = False


# ── messages: a line of JSON, [facts, names of arrays], and each array as raw numbers in the format .npy ──


def pack(facts: dict, arrays: Arrays) -> bytes:
    """A message; a ValueError if an array consists of objects."""
    file = io.BytesIO()
    file.write(json.dumps([facts, list(arrays)]).encode() + b"\n")
    for array in arrays.values():
        np.lib.format.write_array(file, np.asarray(array), version=(1, 0), allow_pickle=False)
    return file.getvalue()


def unpack(message: bytes) -> tuple[dict, Arrays]:
    """(facts, arrays) of a message, none of which is larger than the message; an Exception if it is none."""
    file, arrays = io.BytesIO(message), {}
    facts, names = json.loads(file.readline())
    for name in names:
        arrays[str(name)] = numbers = np.lib.format.read_array(file, allow_pickle=False)  # no more than is there
        if numbers.dtype.kind not in "biuf":
            raise ValueError("an array has no numbers")
    return dict(facts), arrays


# ── the process ──


class SubmissionProcess:
    """A process that runs a hand-in.

    Args:
        level: the isolation: one of ``LEVELS``, or "container IMAGE". limits: what the hand-in may use.
        files: a folder whose files the process gets as a copy, in the folder "submission"; None for none.
        kernels: a folder with compiled kernels, of which the process gets a copy; None for none.
        assignment: a folder of which the process gets a copy in the folder "assignment", without the known mistakes.
        stopped: is set when the process is to end, whatever it does.
    """

    def __init__(
        self,
        level: str,
        limits: Limits,
        files: Path | None = None,
        kernels: Path | None = None,
        assignment: Path | None = None,
        stopped: threading.Event | None = None,
    ) -> None:
        self.limits, self.level, self._printed, self._stopped = limits, level, b"", stopped or threading.Event()
        self._asked_at, self._wall, self._excess = 0.0, math.inf, None  # of the request; why the process was ended
        self._temporary = tempfile.TemporaryDirectory(prefix="taichi_tracer_submission_", ignore_cleanup_errors=True)
        self.given = self._temporary.name
        folder = self.given if level.startswith("limits") else WORK  # in which the hand-in may write
        copies = {"submission": files, f"assignment/{assignment and assignment.name}": assignment, "cache": kernels}
        for name, source in copies.items():
            if source is not None:
                without = shutil.ignore_patterns("mistakes.py", "__pycache__") if source is assignment else None
                shutil.copytree(source, f"{self.given}/{name}", symlinks=True, ignore=without)
        user = USER + secrets.randbelow(10_000_000) if level == OTHER_USER else None
        if user is not None:
            subprocess.run(["chown", "-R", f"{user}:{user}", self.given], check=True)
        if level.startswith(CONTAINER):
            os.chmod(self.given, 0o755)  # its user is another one
        self._pipe, of_process = Pipe()
        self._process = subprocess.Popen(
            command(level, self.given, folder, limits),
            bufsize=0,
            stdin=of_process,
            stdout=of_process,
            stderr=subprocess.PIPE,
            cwd="/",
            env=environment(folder),
            start_new_session=True,
            user=user,
            group=user,
            extra_groups=None if user is None else [],
        )
        of_process.close()
        self._threads = [threading.Thread(target=work, daemon=True) for work in (self._read_prints, self._watch)]
        for thread in self._threads:
            thread.start()

    def ask(self, message: dict, arrays: Arrays | None = None, wall: float | None = None) -> tuple[dict, Arrays]:
        """Send a request, see ``worker``, and wait for its answer.

        Args:
            wall: seconds of the clock; by default those of the limits.

        Raises:
            WorkerEnded: the process has ended, was too slow, or sent something else. It is ended then.
        """
        ticket = secrets.token_hex(8)
        self._asked_at, self._wall = time.monotonic(), wall or self.limits.wall
        try:
            self._pipe.send_bytes(pack({**message, "ticket": ticket}, arrays or {}))
            reply, found = unpack(self._pipe.recv_bytes(MOST_BYTES))
            if reply.pop("ticket", None) != ticket:
                raise ValueError("its ticket is wrong")
        except (EOFError, ConnectionError):
            reason = self._excess or self._why_it_ended()
            self.end()
            raise reason from None
        except Exception as error:
            self.end()
            text = f"the process sent something else than its answer: {str(error)[:80]}"
            raise self._excess or WorkerEnded(text) from None
        self._wall = math.inf
        return reply, found

    def _watch(self) -> None:
        """End the process as soon as it uses more than its limits; when it has ended, ``ask`` waits no longer.

        Something that it started may have left it, and may hold its end of the pipe open.
        """
        while self._excess is None and self._process.poll() is None:
            with contextlib.suppress(subprocess.TimeoutExpired):
                self._process.wait(POLL)
            found = below(self._process.pid)
            if self._stopped.is_set():
                self._excess = WorkerEnded("the grader was stopped")
            elif time.monotonic() > self._asked_at + self._wall:
                self._excess = WorkerEnded(f"no answer came within {self._wall:g} seconds", is_late=True)
            elif len(found) > self.limits.processes:
                text = f"it started {len(found)} processes, of which {self.limits.processes} are allowed"
                self._excess = WorkerEnded(text)
            elif sum(found.values()) > self.limits.resident:
                self._excess = WorkerEnded(
                    f"the processes used more than {self.limits.resident / 2**30:.3g} GiB of memory"
                )
        self._kill()
        with contextlib.suppress(OSError), socket.socket(fileno=os.dup(self._pipe.fileno())) as ours:
            ours.shutdown(socket.SHUT_RDWR)

    def _read_prints(self) -> None:
        """Read what is printed, and keep the first part."""
        with contextlib.suppress(OSError, ValueError):
            while data := self._process.stderr.read(CHUNK):
                self._printed = (self._printed + data)[: self.limits.output + 1]

    @property
    def output(self) -> str:
        """What was printed, cut."""
        most = self.limits.output
        return self._printed[:most].decode(errors="replace") + "\n… (cut)" * (len(self._printed) > most)

    def _why_it_ended(self) -> WorkerEnded:
        """The error for a process that has closed its pipe."""
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(SECONDS_TO_END)
        code = self._process.poll() or 0
        how = next((one.name for one in signal.Signals if one in (-code, code - 128)), f"exit code {code}")
        if how == "SIGXCPU":
            return WorkerEnded(f"it used more than {self.limits.cpu:g} seconds of the processor", is_late=True)
        return WorkerEnded(f"the process ended ({how})")

    def _kill(self) -> None:
        """End the process and everything that it started."""
        for _ in range(50):  # they may start more meanwhile
            found = below(self._process.pid)
            for process in found:
                with contextlib.suppress(OSError):
                    os.kill(process, signal.SIGKILL)
            if not found:
                break
        with contextlib.suppress(OSError):
            os.killpg(self._process.pid, signal.SIGKILL)
        if self.level.startswith(CONTAINER):
            subprocess.run([engine(), "kill", os.path.basename(self.given)], capture_output=True, check=False)

    def end(self) -> None:
        """End the process and everything that it started, and remove its folder."""
        self._kill()
        self._process.wait()
        for thread in self._threads:
            thread.join(1)
        self._pipe.close()
        self._process.stderr.close()
        self._temporary.cleanup()


def below(root: int) -> dict[int, int]:
    """Process → resident bytes, of what a process has started, and what these have started; on Linux."""
    parents, used, found = {}, {}, {root}
    for name in filter(str.isdecimal, os.listdir("/proc") if os.path.isdir("/proc") else ()):
        with contextlib.suppress(OSError):  # it has ended
            words = Path(f"/proc/{name}/stat").read_bytes().rpartition(b")")[2].split()
            if words[0] != b"Z":
                parents[int(name)], used[int(name)] = int(words[1]), int(words[21]) * os.sysconf("SC_PAGESIZE")
    while more := {process for process, parent in parents.items() if parent in found} - found:
        found |= more
    return {process: used[process] for process in found - {root}}


# ── what a process sees ──


def command(level: str, given: str, folder: str, limits: Limits) -> list[str]:
    """The words that start the isolated process; see ``SubmissionProcess``."""
    numbers = asdict(limits)
    if level not in ("bwrap", OTHER_USER):
        numbers["processes"] += OF_OTHERS
    python = "python3" if level.startswith(CONTAINER) else os.path.abspath(sys.executable)  # bwrap knows no ".."
    words = [python, "-m", "taichi_tracer.teaching.grading.worker", given, folder, json.dumps(numbers)]
    if level.startswith(CONTAINER):
        return [*container_words(level.removeprefix(CONTAINER), given, limits), *words]
    return [*bwrap_words(given), *words] if level == "bwrap" else words


def libraries() -> list[str]:
    """The folders of installed libraries; those in the teacher's home are not found without being named."""
    return [path for path in sys.path if os.path.basename(path) in ("site-packages", "dist-packages")]


def environment(folder: str) -> dict[str, str]:
    """The environment of a process: nothing of the teacher's that Python does not need."""
    kept = {name: os.environ[name] for name in KEPT_VARIABLES if name in os.environ}
    return kept | {
        "HOME": folder,
        "TMPDIR": folder,
        "PYTHONPATH": os.pathsep.join([str(PACKAGE.parent), *libraries()]),
        "TI_OFFLINE_CACHE_FILE_PATH": f"{folder}/cache",
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
    python = {sys.prefix, sys.base_prefix, sys.exec_prefix, os.path.dirname(os.path.realpath(sys.executable))}
    own = {*python, *libraries(), str(PACKAGE), str(scene_data_dir())}
    words = ["bwrap", "--unshare-all", "--die-with-parent", "--new-session", "--cap-drop", "ALL"]
    for path in sorted({*SYSTEM, *own, *map(os.path.realpath, own), given}, key=len):  # what contains others is first
        words += ["--ro-bind-try", path, path]
    words += ["--tmpfs", str(SHIPPED), "--dev", "/dev", "--proc", "/proc"]
    return [*words, "--size", str(DISK), "--perms", "0777", "--tmpfs", WORK, "--chdir", "/", "--remount-ro", "/"]


def engine() -> str:
    """The program that runs containers; an InputError if there is none."""
    found = shutil.which("podman") or shutil.which("docker")
    if found is None:
        raise InputError("--container needs podman or docker, and neither is installed")
    return found


def container_words(image: str, given: str, limits: Limits) -> list[str]:
    """The words that run a program in a container, which has this package, and Python and libraries of its own."""
    words = [engine(), "run", "--rm", "--interactive", "--name", os.path.basename(given)]
    words += ["--network", "none", "--read-only"]
    words += ["--cap-drop", "ALL", "--security-opt", "no-new-privileges", "--user", NOBODY, "--workdir", "/"]
    words += ["--memory", str(limits.resident), "--pids-limit", str(limits.processes)]
    words += ["--tmpfs", f"{WORK}:rw,exec,mode=1777,size={DISK}", "--volume", f"{given}:{given}:ro"]
    words += ["--volume", f"{PACKAGE}:{IN_CONTAINER}/{PACKAGE.name}:ro"]
    words += ["--tmpfs", f"{IN_CONTAINER}/{SHIPPED.relative_to(PACKAGE.parent)}"]
    for variable, value in (environment(WORK) | {"PYTHONPATH": IN_CONTAINER}).items():
        words += [] if variable in KEPT_VARIABLES else ["--env", f"{variable}={value}"]
    return [*words, image]


# ── which levels this machine has ──


@cache
def problem_of(level: str) -> str | None:
    """Why a level does not work on this machine, in one line; None if it works. It is tried."""
    try:
        child = SubmissionProcess(level, Limits())
        child.ask({"do": "hello"}, wall=SECONDS_TO_LOAD)
        child.end()
    except (OSError, subprocess.CalledProcessError):
        return "bubblewrap, which runs on Linux only, is not installed: apt-get install bubblewrap"
    except WorkerEnded as error:
        output = " ".join((child.output or error.reason).split())[-200:]
        return f"{level} does not work here, perhaps as a container refuses namespaces ({output})"
    return None


@cache
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
        problem = problem_of(level)
        if problem is None:
            return level
    advice = "" if trust or image else "; for submissions that you would run yourself: --trust (in Python: trust=True)"
    raise InputError(f"submissions cannot be isolated: {problem}{advice}")
