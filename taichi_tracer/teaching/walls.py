"""Walls around the process of a submission: limits of the system, and a world in which little can be seen or changed.

Everything here runs in the process that will become the submission's, before any of its code is loaded. The file uses
the standard library only, so that it is ready within milliseconds. Four levels exist; docs/teaching_security.md says
what each of them stops, and what it does not:

    limits      limits of time, memory, files and processes
    landlock    limits; and Linux refuses to open files elsewhere, to connect by TCP, and to send signals elsewhere
    unshare     limits; and namespaces: another file system, no network, no other processes
    bwrap       as unshare, made by the program bubblewrap

A grader that is root runs every submission as another user, at any level.
"""

import ctypes
import os
import shutil
import signal
import struct
import sys
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

LEVELS = ("bwrap", "unshare", "landlock", "limits")  # the strongest first
NEW_WORLD = ("bwrap", "unshare")  # the levels with a file system of their own
WORK = "/work"  # the folder of the submission in such a file system
DISK = 128 << 20  # bytes that such a file system can hold, in memory
NODES = 4096  # files that it can hold
USER = 60_000_000  # the first of the user numbers that submissions get if the grader is root

# Folders and files of the system that Python and Taichi read.
SYSTEM = ("/usr", "/bin", "/sbin", "/lib", "/lib32", "/lib64", "/nix/store")
SYSTEM += ("/etc/ld.so.cache", "/etc/alternatives", "/etc/localtime", "/sys/devices/system/cpu")
DEVICES = ("/dev/null", "/dev/zero", "/dev/full", "/dev/random", "/dev/urandom")
FACTS = ("/proc/meminfo", "/proc/cpuinfo", "/proc/stat", "/proc/sys/vm/overcommit_memory")

# Numbers of Linux, from its headers.
CLONE_NEWNS, CLONE_NEWIPC, CLONE_NEWUSER, CLONE_NEWPID, CLONE_NEWNET = 1 << 17, 1 << 27, 1 << 28, 1 << 29, 1 << 30
MS_NOSUID, MS_NODEV, MS_BIND, MS_REC, MS_PRIVATE = 2, 4, 4096, 16384, 1 << 18
MNT_DETACH = 2
SYS_MOUNT_SETATTR = 442
AT_FDCWD, AT_RECURSIVE, MOUNT_ATTR_RDONLY = -100, 0x8000, 1
PR_SET_PDEATHSIG, PR_CAPBSET_DROP, PR_SET_CHILD_SUBREAPER, PR_SET_NO_NEW_PRIVS = 1, 24, 36, 38
CAPABILITY_VERSION, CAPABILITIES = 0x20080522, 64
SYS_LANDLOCK_CREATE, SYS_LANDLOCK_ADD, SYS_LANDLOCK_RESTRICT = 444, 445, 446
LANDLOCK_ASK_VERSION, LANDLOCK_PATH_BENEATH = 1, 1
READ = 0b1101  # execute a file, read a file, read a folder
OF_FILES = 0b111 | 1 << 14 | 1 << 15  # the rights that a rule for a file may have
FILE_RIGHTS = {1: 13, 2: 14, 3: 15, 4: 15}  # version → number of rights; later versions have 16
TCP, SCOPES = 0b11, 0b11  # bind and connect; abstract sockets and signals


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
class World:
    """Where a submission runs.

    Attributes:
        level: one of ``LEVELS``. given: the folder with the submission's files and its copy of the kernel cache.
        reads: what it may read beside the system's folders. user: a number of a user, if the grader is root; or None.
    """

    level: str
    given: str
    reads: tuple[str, ...] = ()
    user: int | None = None

    @property
    def folder(self) -> str:
        """The folder in which the submission may write."""
        return WORK if self.level in NEW_WORLD else self.given


class WallError(OSError):
    """The machine does not have this level."""


_libc = ctypes.CDLL(None, use_errno=True) if os.name == "posix" else None


def checked(what: str, result: int) -> int:
    """The result of a function of the C library; a WallError if it failed."""
    if result < 0:
        number = ctypes.get_errno()
        raise WallError(number, f"{what}: {os.strerror(number)}")
    return result


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
    """No capability is left, and no program that this process starts can have one."""
    if sys.platform != "linux":
        return
    for capability in range(CAPABILITIES):
        _libc.prctl(PR_CAPBSET_DROP, capability, 0, 0, 0)  # fails where there is none to drop
    header = struct.pack("<Ii", CAPABILITY_VERSION, 0)
    checked("capset", _libc.capset(header, bytes(24)))
    prctl("no_new_privs", PR_SET_NO_NEW_PRIVS, 1)


# ── namespaces ──


def unshare() -> None:
    """Leave the namespaces of the machine. The next process that is forked is the first of the new ones."""
    flags = CLONE_NEWNS | CLONE_NEWIPC | CLONE_NEWPID | CLONE_NEWNET
    user, group, is_root = os.getuid(), os.getgid(), os.geteuid() == 0
    if is_root and _libc.unshare(flags) == 0:
        return
    checked("unshare", _libc.unshare(flags | CLONE_NEWUSER))
    Path("/proc/self/setgroups").write_text("deny")
    Path("/proc/self/uid_map").write_text(f"{user} {user} 1")
    Path("/proc/self/gid_map").write_text(f"{group} {group} 1")


def mount(source: str, target: str, kind: str | None, flags: int, data: str = "") -> None:
    """Mount a file system, or bind a folder or a file to another place."""
    encoded = [None if text is None else text.encode() for text in (source, target, kind)]
    checked(f"mount {target}", _libc.mount(*encoded, ctypes.c_ulong(flags), data.encode()))


def make_read_only(target: str, with_what_is_below: bool = True) -> None:
    """Nobody can write below a mount any more, not even root."""
    attributes = struct.pack("<QQQQ", MOUNT_ATTR_RDONLY | MS_NOSUID | MS_NODEV, 0, 0, 0)
    flags = AT_RECURSIVE if with_what_is_below else 0
    result = _libc.syscall(SYS_MOUNT_SETATTR, AT_FDCWD, target.encode(), flags, attributes, len(attributes))
    checked(f"mount_setattr {target}", result)


def make_world(world: World) -> None:
    """A new root folder: what Python needs, read only, and one folder in memory to write in.

    It must run in the first process after ``unshare``.
    """
    mount("none", "/", None, MS_REC | MS_PRIVATE)
    mount("tmpfs", "/tmp", "tmpfs", MS_NOSUID | MS_NODEV, "mode=755,size=1m")
    os.mkdir("/tmp/old")
    checked("pivot_root", _libc.pivot_root(b"/tmp", b"/tmp/old"))
    os.chdir("/")
    for path in outermost([*SYSTEM, *world.reads, world.given], "/old"):
        bind(path)
    for path in DEVICES:
        bind(path, is_device=True)
    for path, kind in (("/proc", "proc"), (WORK, "tmpfs")):
        os.mkdir(path)
        mount(kind, path, kind, MS_NOSUID | MS_NODEV, f"mode=777,size={DISK},nr_inodes={NODES}" * (kind == "tmpfs"))
    os.symlink("/proc/self/fd", "/dev/fd")
    if not os.path.exists("/tmp"):  # it exists if Python's libraries or the package are below it
        os.symlink(f"{WORK}/tmp", "/tmp")
    checked("umount", _libc.umount2(b"/old", MNT_DETACH))
    os.rmdir("/old")
    make_read_only("/", with_what_is_below=False)


def outermost(paths: Iterable[str], root: str = "") -> list[str]:
    """Those of the paths that exist and are not within another one, the shortest first."""
    found: list[str] = []
    for path in sorted({os.path.normpath(p) for p in paths}, key=len):
        if os.path.lexists(root + path) and not any(path == p or path.startswith(f"{p}/") for p in found):
            found.append(path)
    return found


def bind(path: str, is_device: bool = False) -> None:
    """Show a folder or a file of the old root in the new one, read only."""
    old = f"/old{path}"
    os.makedirs(os.path.dirname(path), exist_ok=True)
    if os.path.islink(old):
        os.symlink(os.readlink(old), path)
        return
    if os.path.isdir(old):
        os.makedirs(path, exist_ok=True)
    elif os.path.exists(old):
        Path(path).touch()
    else:
        return
    mount(old, path, None, MS_BIND | MS_REC)
    if not is_device:
        make_read_only(path)


def bwrap_command(world: World) -> list[str]:
    """The words before a command that let bubblewrap make the same world."""
    words = ["bwrap", "--unshare-all", "--die-with-parent", "--new-session", "--cap-drop", "ALL"]
    shown = outermost([*SYSTEM, *world.reads, world.given])
    for path in shown:
        words += ["--symlink", os.readlink(path), path] if os.path.islink(path) else ["--ro-bind", path, path]
    words += ["--dev", "/dev", "--proc", "/proc", "--size", str(DISK), "--perms", "0777", "--tmpfs", WORK]
    if not any(path.startswith("/tmp/") for path in shown):
        words += ["--symlink", f"{WORK}/tmp", "/tmp"]
    return [*words, "--chdir", "/", "--remount-ro", "/"]


# ── Landlock ──


def landlock_version() -> int:
    """The version of Landlock that this system has; 0 if it has none."""
    if sys.platform != "linux":
        return 0
    return max(0, _libc.syscall(SYS_LANDLOCK_CREATE, None, 0, LANDLOCK_ASK_VERSION))


def lock_files(world: World) -> None:
    """From here on, Linux refuses this process everything but to read what Python needs and to write in its folder."""
    version = landlock_version()
    if version == 0:
        raise WallError("this system has no Landlock")
    rights = (1 << FILE_RIGHTS.get(version, 16)) - 1
    rules = [rights, *([TCP] if version >= 4 else []), *([SCOPES] if version >= 6 else [])]
    attributes = struct.pack(f"<{len(rules)}Q", *rules)
    ruleset = checked("landlock", _libc.syscall(SYS_LANDLOCK_CREATE, attributes, len(attributes), 0))
    for path in (*SYSTEM, *world.reads, *FACTS, *DEVICES, f"/proc/{os.getpid()}"):
        allow(ruleset, path, READ)
    allow(ruleset, "/dev/null", rights)
    allow(ruleset, world.folder, rights)
    prctl("no_new_privs", PR_SET_NO_NEW_PRIVS, 1)
    checked("landlock", _libc.syscall(SYS_LANDLOCK_RESTRICT, ruleset, 0))
    os.close(ruleset)


def allow(ruleset: int, path: str, rights: int) -> None:
    """Allow some rights for a path and what is below it; nothing happens if it does not exist."""
    try:
        descriptor = os.open(path, os.O_PATH | os.O_CLOEXEC)
    except OSError:
        return
    rights &= -1 if os.path.isdir(path) else OF_FILES
    rule = struct.pack("<Qi", rights, descriptor)
    try:
        checked(f"landlock {path}", _libc.syscall(SYS_LANDLOCK_ADD, ruleset, LANDLOCK_PATH_BENEATH, rule, 0))
    finally:
        os.close(descriptor)


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


def copy_into_world(world: World) -> None:
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
