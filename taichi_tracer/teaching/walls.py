"""Walls around the process of a submission: bubblewrap's, and limits of time, memory, files and processes.

Everything here but the words for bubblewrap runs in the process that will become the submission's, before any of its
code is loaded. The file uses the standard library only, so that it is ready within milliseconds. Two levels exist;
docs/teaching_security.md says what each of them stops, and what it does not:

    limits      limits of time, memory, files and processes
    bwrap       limits; and another file system, no network, no other processes, made by the program bubblewrap

A grader that is root runs every submission as another user, at either level.
"""

import ctypes
import os
import shutil
import signal
import struct
import sys
from collections.abc import Iterable
from dataclasses import dataclass

LEVELS = ("bwrap", "limits")  # the stronger first
NOT_STOPPED = {
    "bwrap": "using a hole in the system's kernel, reading the package's own methods",
    "limits": "reading your files and the solution, changing and deleting files, filling the disk, using the network, "
    "ending your processes, and what bwrap does not stop",
}
WORK = "/walled"  # the folder of the submission in the world that bubblewrap makes; no other folder has this name
DISK = 128 << 20  # bytes that this folder can hold, in memory
USER = 60_000_000  # the first of the user numbers that submissions get if the grader is root

# Folders and files of the system that Python and Taichi read.
SYSTEM = ("/usr", "/bin", "/sbin", "/lib", "/lib32", "/lib64", "/nix/store")
SYSTEM += ("/etc/ld.so.cache", "/etc/alternatives", "/etc/localtime", "/sys/devices/system/cpu")

# Numbers of Linux, from its headers.
PR_SET_PDEATHSIG, PR_SET_CHILD_SUBREAPER, PR_SET_NO_NEW_PRIVS = 1, 36, 38
CAPABILITY_VERSION = 0x20080522


@dataclass(frozen=True)
class Limits:
    """What one submission may use.

    Attributes:
        cpu: seconds of CPU for one request. wall: seconds of the clock for one request.
        address_space: bytes of one process; Taichi needs about 4 GiB.
        resident: bytes of memory of all processes of the submission together.
        file: bytes of one file. processes, files: how many; threads count as processes.
        output: bytes of what the submission prints that are kept.
    """

    cpu: float = 20.0
    wall: float = 60.0
    address_space: int = 8 << 30
    resident: int = 3 << 30
    file: int = 64 << 20
    processes: int = 96
    files: int = 256
    output: int = 16 << 10


@dataclass(frozen=True)
class Surroundings:
    """Where a submission runs.

    Attributes:
        level: one of ``LEVELS``. given: the folder with the submission's files and its copy of the kernel cache.
        reads: what it may read beside the system's folders. user: a number of a user, if the grader is root; or None.
        hides: folders within these that it does not see.
    """

    level: str
    given: str
    reads: tuple[str, ...] = ()
    user: int | None = None
    hides: tuple[str, ...] = ()

    @property
    def folder(self) -> str:
        """The folder in which the submission may write."""
        return WORK if self.level == "bwrap" else self.given


_libc = ctypes.CDLL(None, use_errno=True) if os.name == "posix" else None


def checked(what: str, result: int) -> None:
    """An OSError if the result of a function of the C library says that it failed."""
    if result < 0:
        number = ctypes.get_errno()
        raise OSError(number, f"{what}: {os.strerror(number)}")


def prctl(what: str, option: int, value: int = 0) -> None:
    """Change a property of this process. Nothing happens where Linux does not run."""
    if sys.platform == "linux":
        checked(what, _libc.prctl(option, value, 0, 0, 0))


# ── limits ──


def set_limits(limits: Limits, tasks_of_others: int) -> None:
    """The limits that hold for this process and for those that it starts; none of them can be raised again.

    Args:
        tasks_of_others: how many processes and threads the same user has elsewhere, which count, too.
    """
    import resource

    values = {"RLIMIT_FSIZE": limits.file, "RLIMIT_NOFILE": limits.files, "RLIMIT_CORE": 0}
    values["RLIMIT_NPROC"] = limits.processes + tasks_of_others
    if sys.platform == "linux":  # macOS cannot limit the address space
        values["RLIMIT_AS"] = limits.address_space
    for name, value in values.items():
        number = getattr(resource, name)
        _, hard = resource.getrlimit(number)
        value = value if hard == resource.RLIM_INFINITY else min(value, hard)
        resource.setrlimit(number, (value, value))


def allow_cpu(seconds: float) -> None:
    """The process is ended with SIGXCPU when it has used so many more seconds of CPU."""
    import resource

    used = resource.getrusage(resource.RUSAGE_SELF)
    limit = int(used.ru_utime + used.ru_stime + seconds) + 1
    _, hard = resource.getrlimit(resource.RLIMIT_CPU)
    resource.setrlimit(resource.RLIMIT_CPU, (limit, hard))


def become(user: int) -> None:
    """Become another user, without groups."""
    os.setgroups([])
    os.setresgid(user, user, user)
    os.setresuid(user, user, user)


def drop_privileges() -> None:
    """No capability is left, with which root could raise its limits; and no program can give one back, such as su."""
    if sys.platform == "linux":
        header = struct.pack("<Ii", CAPABILITY_VERSION, 0)
        checked("capset", _libc.capset(header, bytes(24)))
        prctl("no_new_privs", PR_SET_NO_NEW_PRIVS, 1)


# ── bubblewrap ──


def outermost(paths: Iterable[str]) -> list[str]:
    """Those of the paths that exist and are not within another one, the shortest first."""
    found: list[str] = []
    for path in sorted({os.path.normpath(p) for p in paths}, key=len):
        if os.path.lexists(path) and not any(path == p or path.startswith(f"{p}/") for p in found):
            found.append(path)
    return found


def bwrap_command(world: Surroundings) -> list[str]:
    """The words before a command that let bubblewrap make its world: what Python needs, read only, and ``WORK``."""
    words = ["bwrap", "--unshare-all", "--die-with-parent", "--new-session", "--cap-drop", "ALL"]
    shown = outermost([*SYSTEM, *world.reads, world.given])
    for path in shown:
        words += ["--symlink", os.readlink(path), path] if os.path.islink(path) else ["--ro-bind", path, path]
    for path in world.hides:
        words += ["--tmpfs", path] if os.path.isdir(path) else []
    words += ["--dev", "/dev", "--proc", "/proc", "--size", str(DISK), "--perms", "0777", "--tmpfs", WORK]
    if not any(path.startswith("/tmp/") for path in shown):
        words += ["--symlink", f"{WORK}/tmp", "/tmp"]
    return [*words, "--chdir", "/", "--remount-ro", "/"]


# ── processes ──


def processes() -> dict[int, tuple[int, int, int, int]]:
    """Process → (its parent, the user's number, resident bytes, threads), of all that this process can see."""
    found = {}
    for name in os.listdir("/proc") if os.path.isdir("/proc") else ():
        if name.isdecimal():
            try:
                with open(f"/proc/{name}/stat", "rb") as file:
                    words = file.read().rpartition(b")")[2].split()
                user = os.stat(f"/proc/{name}").st_uid
            except OSError:  # it has ended
                continue
            if words[0] != b"Z":
                found[int(name)] = int(words[1]), user, int(words[21]) * os.sysconf("SC_PAGESIZE"), int(words[17])
    return found


def tasks_of(user: int) -> int:
    """How many processes and threads a user has."""
    return sum(threads for _, owner, _, threads in processes().values() if owner == user)


def descendants(root: int) -> dict[int, int]:
    """Process → resident bytes, of the processes that a process has started, and that these have started."""
    all_of_them = processes()
    below: dict[int, list[int]] = {}
    for process, (parent, *_) in all_of_them.items():
        below.setdefault(parent, []).append(process)
    found, rest = {}, [root]
    while rest:
        for process in below.pop(rest.pop(), ()):
            found[process] = all_of_them[process][2]
            rest.append(process)
    return found


def end_descendants(most_rounds: int = 1000) -> None:
    """End every process that this process, or one of them, has started. Orphans belong to it as a subreaper."""
    for _ in range(most_rounds):
        found = descendants(os.getpid())
        for process in found:
            try:
                os.kill(process, signal.SIGSTOP)  # so that none of them starts another one meanwhile
                os.kill(process, signal.SIGKILL)
            except OSError:
                continue
        try:
            while os.waitpid(-1, os.WNOHANG)[0]:
                pass
        except ChildProcessError:
            if not found:
                return


def copy_into_world(world: Surroundings) -> None:
    """Copy the given files into the folder in which the submission may write, and go there."""
    if world.folder != world.given:
        shutil.copytree(world.given, world.folder, dirs_exist_ok=True)
    os.makedirs(f"{world.folder}/tmp", exist_ok=True)
    os.chdir(world.folder)


def give_folder_to(folder: str, user: int) -> None:
    """Another user owns a folder and what is in it, so that nobody else can write there."""
    os.chown(folder, user, user)
    os.chmod(folder, 0o700)
    for place, folders, files in os.walk(folder):
        for name in (*folders, *files):
            os.lchown(os.path.join(place, name), user, user)
