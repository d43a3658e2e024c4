"""The grader's side of a submission's process: it starts the process, asks it, and ends it in time.

``SubmissionProcess.ask`` sends one request and waits for one answer, no longer than the limits allow. Nothing that
the process sends is trusted: the answer has to be a frame with the ticket of the request, and what is printed is cut.
"""

import contextlib
import importlib.util
import json
import os
import secrets
import selectors
import shutil
import signal
import socket
import subprocess
import sys
import time
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import taichi_tracer
from taichi_tracer.system.errors import InputError
from taichi_tracer.teaching import frames, keeper, temporary, walls
from taichi_tracer.teaching.catalogue import SHIPPED
from taichi_tracer.teaching.kept import VARIABLE, cache_folder
from taichi_tracer.teaching.walls import Limits, Surroundings

PACKAGE = Path(taichi_tracer.__file__).resolve().parent
SECONDS_TO_LOAD = 120.0  # of the clock, for importing Taichi, the solution and the submission
SECONDS_TO_END = 5.0  # that the keeper has to end everything, before it is ended itself
CHUNK = 1 << 16  # bytes that are read at a time
LIBRARIES = ("taichi", "numpy", "PIL", "trimesh", "tqdm", "mapbox_earcut")
KEPT_VARIABLES = ("PATH", "LANG", "LC_ALL", "LD_LIBRARY_PATH", "DYLD_LIBRARY_PATH", "TZ")


@dataclass(frozen=True)
class WallLevel:
    """How submissions are walled in on this machine.

    Attributes:
        name: one of ``walls.LEVELS``. user: whether each submission runs as a user of its own, as the grader is root.
    """

    name: str
    user: bool = False

    def __str__(self) -> str:
        return f"{self.name}, as a user of its own" if self.user else self.name


class ChildEnded(Exception):
    """The process does not answer any more.

    Attributes:
        is_late: whether it used up its time. reason: one sentence for the student.
    """

    def __init__(self, reason: str, is_late: bool = False) -> None:
        super().__init__(reason)
        self.reason, self.is_late = reason, is_late


class SubmissionProcess:
    """A process that runs a submission, or the solution.

    Args:
        files: a folder whose files the process gets as a copy, in the folder "submission"; None for the solution.
        level: the walls. limits: None lets the process use what it wants, for the solution only.
        kernels: a folder with compiled kernels, of which the process gets a copy; None for none.
        keep: a folder that is used instead of a temporary one, and stays.
        outline: the folder of an assignment, of which the process gets a copy in the folder "assignment".
    """

    def __init__(
        self,
        files: Path | None,
        level: WallLevel,
        limits: Limits | None = None,
        kernels: Path | None = None,
        keep: Path | None = None,
        outline: Path | None = None,
    ) -> None:
        check_system()
        self.limits, self.printed, self.is_cut = limits, b"", False
        self._room = limits.output if limits else 1 << 20  # bytes of prints that are kept
        self._temporary = None if keep else temporary.folder("process")
        self.given = Path(keep or self._temporary)
        if files is not None:
            shutil.copytree(files, self.given / "submission", symlinks=True)
        if outline is not None:
            shutil.copytree(outline, self.given / "assignment" / outline.name)
        if kernels is not None:
            shutil.copytree(kernels, self.given / "cache")
        (self.given / "cache").mkdir(exist_ok=True)
        (self.given / "tmp").mkdir(exist_ok=True)
        user = walls.USER + secrets.randbelow(10_000_000) if level.user else None
        world = Surroundings(level.name, str(self.given), readable(), user, (str(SHIPPED),))
        if user is not None:
            walls.give_folder_to(world.given, user)
        self._start(world)

    def _start(self, world: Surroundings) -> None:
        """Start the keeper, and through it the process."""
        (requests, to_requests), (from_answers, answers) = os.pipe(), os.pipe()
        line, self._line = socket.socketpair()
        task = keeper.Task(world, self.limits, requests, answers, line.fileno())
        start = f"import sys; sys.path[:] = {python_path()!r}; from taichi_tracer.teaching import keeper; "
        python = os.path.abspath(sys.executable)  # a folder before a ".." need not exist within the walls
        command = [python, "-c", start + "keeper.main(sys.argv[1])", task.words()]
        if world.level == "bwrap":
            command = [*walls.bwrap_command(world), *command]
        as_user = (
            {"user": world.user, "group": world.user, "extra_groups": []}
            if world.user and world.level == "bwrap"
            else {}
        )
        self._process = subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            cwd="/",
            env=environment(world, is_trusted=self.limits is None),
            pass_fds=(requests, answers, line.fileno()),
            start_new_session=True,
            **as_user,
        )
        for descriptor in (requests, answers):
            os.close(descriptor)
        line.close()
        self._requests, self._answers, self._prints = to_requests, from_answers, self._process.stdout.fileno()
        for descriptor in (self._requests, self._answers, self._prints):
            os.set_blocking(descriptor, False)
        self._line.setblocking(False)
        self._decoder = frames.Decoder()

    def __enter__(self) -> "SubmissionProcess":
        return self

    def __exit__(self, *_error) -> None:
        self.end()

    def ask(
        self, message: dict, arrays: frames.Arrays | None = None, wall: float | None = None
    ) -> tuple[dict, frames.Arrays]:
        """Send a request, and wait for its answer.

        Args:
            message, arrays: as ``child`` describes them. wall: seconds of the clock; by default those of the limits.

        Raises:
            ChildEnded: the process has ended, was too slow, or sent something else. It is ended then.
        """
        ticket = secrets.token_hex(8)
        wall = wall if wall is not None else self.limits.wall if self.limits else float("inf")
        try:
            reply, found = self._exchange(frames.encode({**message, "ticket": ticket}, arrays), time.monotonic() + wall)
        except frames.FrameError as error:
            self.end()
            raise ChildEnded(f"the process sent something else than its answer: {error}") from None
        except TimeoutError:
            self.end()
            raise ChildEnded(f"no answer came within {wall:g} seconds", is_late=True) from None
        except (EOFError, BrokenPipeError):
            raise self._why_it_ended() from None
        if reply.get("ticket") != ticket:
            self.end()
            raise ChildEnded("the process sent something else than its answer: its ticket is wrong")
        return reply, found

    def _exchange(self, data: bytes, deadline: float) -> tuple[dict, frames.Arrays]:
        """Write a request, while prints are read, until one frame has arrived."""
        rest = memoryview(data)
        with selectors.DefaultSelector() as selector:
            selector.register(self._answers, selectors.EVENT_READ)
            if self._prints is not None:
                selector.register(self._prints, selectors.EVENT_READ)
            selector.register(self._requests, selectors.EVENT_WRITE)
            while True:
                left = deadline - time.monotonic()
                if left <= 0:
                    raise TimeoutError
                for key, _ in selector.select(min(left, 3600.0)):
                    if key.fd == self._requests:
                        rest = rest[os.write(self._requests, rest[:CHUNK]) :]
                        if not rest:
                            selector.unregister(self._requests)
                    elif key.fd == self._prints:
                        if not self._read_prints():
                            selector.unregister(key.fd)
                            self._prints = None
                    else:
                        data = os.read(self._answers, CHUNK)
                        if not data:
                            raise EOFError
                        if found := self._decoder.feed(data):
                            if len(found) > 1:
                                raise frames.FrameError("more than one answer came")
                            return found[0]

    def _read_prints(self) -> bool:
        """Read what was printed, and keep the first part; whether more can come."""
        data = os.read(self._prints, CHUNK)
        room = self._room - len(self.printed)
        self.printed += data[: max(0, room)]
        self.is_cut |= len(data) > room
        return bool(data)

    @property
    def output(self) -> str:
        """What was printed, cut."""
        text = self.printed.decode(errors="replace")
        return f"{text}\n… (cut)" if self.is_cut else text

    def _why_it_ended(self) -> ChildEnded:
        """The error for a process that has ended by itself, or that the keeper ended."""
        with contextlib.suppress(OSError):
            self._line.setblocking(True)
            self._line.settimeout(SECONDS_TO_END)
            told = self._line.makefile("rb").readline(CHUNK)
            facts = json.loads(told or b"{}")
            self.end()
            return ended(facts, self.limits)
        self.end()
        return ChildEnded("the process ended")

    def end(self) -> None:
        """End the process and everything that it started, and remove its folder."""
        for descriptor in (self._requests, self._answers):
            with contextlib.suppress(OSError):
                os.close(descriptor)
        self._requests = self._answers = -1
        if self.limits is None:  # the solution's process keeps its compiled kernels before it ends
            with contextlib.suppress(TimeoutError):
                self._wait(time.monotonic() + SECONDS_TO_END)
        self.hurry()
        try:
            self._wait(time.monotonic() + SECONDS_TO_END)
        except TimeoutError:
            with contextlib.suppress(OSError):
                os.killpg(self._process.pid, signal.SIGKILL)
            self._process.wait()
        with contextlib.suppress(OSError, TypeError):
            while len(self.printed) < self._room and self._read_prints():
                pass
        self._process.stdout.close()
        self._prints = None
        self._line.close()
        if self._temporary is not None:
            temporary.remove(self._temporary)

    def hurry(self) -> None:
        """Let the keeper end the process; ``ask`` raises ChildEnded then. Any thread may call this."""
        with contextlib.suppress(OSError):
            self._line.shutdown(socket.SHUT_WR)

    def _wait(self, deadline: float) -> None:
        """Wait until the keeper has ended, while prints are thrown away: it could wait for us to read them."""
        while self._process.poll() is None:
            if time.monotonic() > deadline:
                raise TimeoutError
            with contextlib.suppress(OSError, TypeError):
                if self._prints is not None and not self._read_prints():
                    self._prints = None
            time.sleep(0.01)


def ended(facts: dict, limits: Limits | None) -> ChildEnded:
    """What the keeper's words on the end of a process mean."""
    number = facts.get("signal") or max(0, (facts.get("exit") or 0) - 128)
    if "failed" in facts:
        return ChildEnded(f"the process could not be started: {facts['failed']}")
    if "processes" in facts:
        return ChildEnded(f"it started {facts['processes']} processes, of which {limits.processes} are allowed")
    if "memory" in facts:
        return ChildEnded(f"the processes used more than {limits.resident / 2**30:.3g} GiB of memory")
    if number == signal.SIGXCPU or (number == signal.SIGKILL and limits is None):
        return ChildEnded(f"it used more than {limits.cpu:g} seconds of the processor", is_late=True)
    if number:
        name = signal.Signals(number).name if number in set(signal.Signals) else f"signal {number}"
        return ChildEnded(f"the process crashed ({name})")
    return ChildEnded(f"the process ended itself with the exit code {facts.get('exit')}")


# ── what a process sees ──


def python_path() -> list[str]:
    """Where this process finds modules, without the working folder, whose files could stand before Python's own."""
    package = str(PACKAGE.parent)
    paths = (os.path.normpath(p) for p in sys.path if p not in ("", package) and Path(p).resolve() != Path.cwd())
    return [package, *paths]


@cache
def _libraries() -> tuple[str, ...]:
    """Where Python, the package and its libraries are."""
    places = {
        sys.prefix,
        sys.base_prefix,
        sys.exec_prefix,
        str(PACKAGE),
        os.path.dirname(os.path.realpath(sys.executable)),
    }
    places |= {p for p in sys.path if os.path.basename(p) in ("site-packages", "dist-packages")}
    for name in LIBRARIES:
        spec = importlib.util.find_spec(name)
        places |= {os.path.dirname(p) for p in (spec.submodule_search_locations if spec else ())}
    return tuple(places | {os.path.realpath(p) for p in places})


def readable() -> tuple[str, ...]:
    """What a process may read beside the system's folders."""
    from taichi_tracer.files import shipped

    scenes = Path(shipped.scene_data_dir())
    return (*_libraries(), str(scenes), str(scenes.resolve()))


def environment(world: Surroundings, is_trusted: bool) -> dict[str, str]:
    """The environment of a process: nothing of the teacher's that Python does not need."""
    kept = {name: os.environ[name] for name in KEPT_VARIABLES if name in os.environ}
    if is_trusted:
        kept[VARIABLE] = str(cache_folder().parent)
    return kept | {
        "HOME": world.folder,
        "TMPDIR": f"{world.folder}/tmp",
        "PYTHONDONTWRITEBYTECODE": "1",
        "PYTHONHASHSEED": "0",
        "PYTHONUTF8": "1",
        "TI_SKIP_VERSION_CHECK": "ON",
        "ENABLE_TAICHI_HEADER_PRINT": "0",
        "OMP_NUM_THREADS": "1",
        "OPENBLAS_NUM_THREADS": "1",
    }


# ── which levels this machine has ──


def check_system() -> None:
    """Raise an InputError where no submission can be run, whatever its walls."""
    if os.name != "posix":
        raise InputError("submissions can be run on Linux and macOS only: on Windows, use its subsystem for Linux")


@cache
def problem_of(level: WallLevel, starts_taichi: bool = True) -> str | None:
    """Why a level does not work on this machine, in one line; None if it works. It is tried, with Taichi or without."""
    if level.name == "bwrap" and sys.platform != "linux":
        return "bubblewrap runs on Linux only"
    if level.name == "bwrap" and shutil.which("bwrap") is None:
        return "bubblewrap is not installed: apt-get install bubblewrap"
    try:
        with SubmissionProcess(None, level, Limits()) as child:
            child.ask({"do": "hello", "starts_taichi": starts_taichi}, wall=SECONDS_TO_LOAD)
    except ChildEnded as error:
        if level.name == "limits":
            return f"{error.reason} {child.output.strip()[-200:]}".strip()
        told = " ".join((child.output or error.reason).split())[-200:]
        return f"bubblewrap does not work here, perhaps as a container refuses namespaces ({told})"
    return None


def candidates() -> list[WallLevel]:
    """Every level, the strongest first. Bubblewrap stops more than a user of its own does."""
    users = (True, False) if hasattr(os, "geteuid") and os.geteuid() == 0 else (False,)
    return [WallLevel(name, user) for name in walls.LEVELS for user in users]


@cache
def best_level(trust: bool = False) -> WallLevel:
    """The strongest level that works on this machine.

    Args:
        trust: whether limits alone are enough where bubblewrap does not work.

    Raises:
        InputError: none does, or limits alone, which are not enough.
    """
    check_system()
    for level in candidates():
        if level.name == "bwrap" or trust:
            problem = problem_of(level)
            if problem is None:
                return level
    advice = "" if trust else "; for submissions that you would run yourself: --trust (in Python: trust=True)"
    raise InputError(f"there are no walls for submissions: {problem}{advice}")
