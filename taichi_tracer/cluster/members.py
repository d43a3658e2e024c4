"""A cluster of Dask, and its workers: who is there, who fits, and who has which scene."""

import contextlib
import json
import logging
import os
import re
import socket
import threading
import time
import uuid
from collections.abc import Callable
from concurrent.futures import Future
from concurrent.futures import TimeoutError as FutureTimeout
from dataclasses import dataclass, field
from functools import partial
from typing import Any

from taichi_tracer.cluster import worker
from taichi_tracer.cluster.parcel import Parcel
from taichi_tracer.cluster.versions import difference, installation
from taichi_tracer.system.errors import IncompleteError, InputError

ADDRESS = re.compile(r"(?P<scheme>tcp|tls|ucx|ws|wss)://(?P<host>\[[0-9a-fA-F:.]+\]|[^:/\s]+):(?P<port>[0-9]{1,5})")
MOST_PORT = 65535
MOST_LOCAL = 8  # processes per processor of this machine
INSTALL = "--cluster needs the package distributed: pip install 'taichi_tracer[cluster]'"
CONNECT = 10.0  # seconds in which a scheduler has to answer
LOOK = 0.5  # seconds between two looks for workers that came or went
FIRST_LOOK = 0.5  # seconds that workers get to say who they are, before the scene is loaded here
TRIES = 3  # how often a worker may fail before it is left out
PATIENT = 5.0  # seconds after which the user is told that there is no worker yet


def distributed() -> Any:
    """The package of Dask, imported only now."""
    try:
        import distributed as package
    except ImportError:
        raise InputError(INSTALL) from None
    return package


def local_workers(where: str) -> int | None:
    """How many processes of this machine an address asks for; None if it is that of a scheduler.

    Raises:
        InputError: it is neither, or it asks for none or for too many.
    """
    local = re.fullmatch(r"local(?::(\d+))?", where, re.ASCII)
    if local is None:
        found = ADDRESS.fullmatch(where)
        if found is None or int(found["port"]) > MOST_PORT:
            raise InputError(f"--cluster {where}: give tcp://host:8786, tls://host:8786, local or local:4")
        return None
    count, most = int(local[1] or 1), MOST_LOCAL * (os.cpu_count() or 1)
    if count < 1:
        raise InputError(f"--cluster {where}: give at least one worker, such as local:2")
    if count > most:
        raise InputError(f"--cluster {where}: so many processes do not fit on this machine: give at most local:{most}")
    return count


def check_answers(where: str) -> None:
    """Raise an OSError at once if nobody listens at an address: Dask would wait, and try again."""
    found = ADDRESS.fullmatch(where)
    if found is not None and found["scheme"] in ("tcp", "tls"):
        socket.create_connection((found["host"].strip("[]"), int(found["port"])), CONNECT).close()


def client_class(package: Any) -> Any:
    """Dask's client class, changed so that a client that never connected is deleted without complaints."""

    class Client(package.Client):
        """A client that ``Cluster`` closes."""

        def __del__(self) -> None:
            """Do nothing: Dask's own method complains about a client that never connected."""

    return Client


@dataclass
class Given:
    """A range that a worker has: its future, and when it was given and done (``time.perf_counter``)."""

    future: Any
    given_at: float
    done_at: float | None = None


@dataclass
class Member:
    """One worker.

    Attributes:
        state: "new", "settling", "ready" or "refused"; a worker that has gone is no member.
        waiting: the future of what it was asked for last, while it is not a range.
        asked: the parcel and picture that it is loading. has: those that it has loaded.
        seconds_per_sample: as measured; None while unknown. last: the samples of its last range.
        pieces: the hashes of the pieces of files that were sent to it.
        given: range → what is known of it, in the order in which they were given.
        free_since: when it ended its last range.
    """

    address: str
    state: str = "new"
    waiting: Any = None
    asked: tuple | None = None
    has: set[tuple] = field(default_factory=set)
    seconds_per_sample: float | None = None
    last: int = 0
    given: dict[tuple[int, int], Given] = field(default_factory=dict)
    free_since: float = 0.0
    failures: int = 0
    done: int = 0
    facts: dict[str, Any] = field(default_factory=dict)
    pieces: set[str] = field(default_factory=set)


class Cluster:
    """A connection to a scheduler, and the workers that fit.

    Args:
        where: the address of a scheduler, such as ``tcp://host:8786`` or ``tls://host:8786``; or ``local``, ``local:N``
            for N processes on this machine.
        tell: a function that is called with what the user should know, one line each.
    """

    def __init__(self, where: str, tell: Callable[[str], Any]) -> None:
        count = local_workers(where)
        self.where, self.tell, self.is_local = where, tell, count is not None
        package = distributed()
        for name in ["distributed", "tornado.application", *logging.root.manager.loggerDict]:
            if name.startswith(("distributed", "tornado")):
                logging.getLogger(name).setLevel(logging.CRITICAL)  # what matters is told in the words of this package
        self.session = uuid.uuid4().hex
        self.members: dict[str, Member] = {}
        self.pieces: dict[str, Any] = {}
        self.settings: tuple | None = None
        self.wanted: dict[str, str] = {}
        self.bytes_sent, self.numbers = 0, 0
        self.wake = threading.Event()
        self.looked_at, self.began_at, self.is_told = -LOOK, time.perf_counter(), False
        self.reasons: list[str] = []
        self.own: Any = None
        try:
            if count is None:
                check_answers(where)
            else:
                share = max(1, (os.cpu_count() or 1) // count)
                size = {"n_workers": count, "threads_per_worker": share, "memory_limit": 0}
                self.own = package.LocalCluster(processes=False, dashboard_address="127.0.0.1:0", **size)
            make = partial(client_class(package), self.own or where, timeout=CONNECT, set_as_default=False)
            self.client = later(make).result(2 * CONNECT)  # who listens there, but is no scheduler, may never answer
        except (OSError, ValueError, TypeError, FutureTimeout) as error:
            if self.own is not None:
                self.own.close(timeout=5)
            reason = " ".join(str(error).split()) or "who listens there does not answer as a scheduler does"
            why = f"no scheduler answers there ({reason}): start one with: dask scheduler"
            if "ssl_context" in reason:
                why = "Dask's configuration has no certificates for tls://: see docs/cluster.md"
            raise InputError(f"--cluster {where}: {why}") from None

    def __enter__(self) -> "Cluster":
        return self

    def __exit__(self, *_error: object) -> None:
        self.close()

    def close(self) -> None:
        """Let the processes of this session end; the workers of a cluster that ran before stay."""
        addresses = [m.address for m in self.members.values() if m.state in ("settling", "ready")]
        with contextlib.suppress(Exception):  # what is gone needs no farewell
            if addresses and not self.is_lost:
                leave = partial(self.client.run, worker.leave, self.session, workers=addresses, on_error="ignore")
                later(leave).result(CONNECT)
        with contextlib.suppress(Exception):
            self.pieces.clear()
            self.client.close(timeout=1)
        if self.own is not None:
            with contextlib.suppress(Exception):
                self.own.close(timeout=5)

    def prepare(self, arch: str, precision: str, fast_math: bool) -> None:
        """From now on, workers start Taichi with these settings; one where it runs otherwise is refused."""
        is_first, self.settings = self.settings is None, (arch, precision, fast_math)
        for member in self.members.values() if is_first else ():
            if member.state == "ready":
                self.settle(member)
        self.wanted = {"backend": arch, "precision": precision, "fast math": str(fast_math)}

    def begin(self) -> None:
        """Let the workers that are there start Taichi, while this machine loads the scene."""
        until = time.perf_counter() + FIRST_LOOK
        self.look()
        while time.perf_counter() < until and any(member.state == "new" for member in self.members.values()):
            self.wait_for_answers()

    def wait_for_answers(self) -> None:
        """Wait a moment for answers of workers that have just come, and take those that are there."""
        self.wait(FIRST_LOOK / 10)
        for member in list(self.members.values()):
            self.advance(member)

    def wait(self, seconds: float) -> None:
        """Wait until a worker ends something, but no longer than this."""
        self.wake.wait(seconds)
        self.wake.clear()

    # ── who is there ──

    @property
    def is_lost(self) -> bool:
        """Whether the scheduler is gone."""
        return self.client.status != "running"

    def check(self) -> None:
        """Raise an IncompleteError if the scheduler is gone."""
        if self.is_lost:
            raise IncompleteError(f"the scheduler {self.where} is gone")

    def submit(self, function: Callable, *words: Any, at: list[str], priority: int = 0) -> Any:
        """The future of a function that runs on one of these workers."""
        self.numbers += 1
        key = f"taichi_tracer-{function.__name__}-{self.session[:8]}-{self.numbers}"
        self.check()
        options = {"workers": at, "allow_other_workers": False, "pure": False, "priority": priority, "key": key}
        future = self.client.submit(function, *words, **options)
        future.add_done_callback(lambda _: self.wake.set())
        return future

    def look(self) -> list[Member]:
        """Ask workers that came since the last look what is installed there. Returns the workers that have gone."""
        self.check()
        now = time.perf_counter()
        if now - self.looked_at < LOOK:
            return []
        self.looked_at = now
        try:
            there = later(self.client.nthreads).result(CONNECT)
        except Exception:  # Dask raises several kinds of errors for a connection that ends
            self.check()
            raise IncompleteError(f"the scheduler {self.where} does not answer") from None
        gone = [self.members.pop(address) for address in list(self.members) if address not in there]
        for address in there:
            if address not in self.members:
                self.members[address] = member = Member(address)
                member.waiting = self.submit(worker.introduce, at=[address], priority=20)
        for member in list(self.members.values()):
            self.advance(member)
        if not self.members and not self.is_told and now - self.began_at > PATIENT:
            self.is_told = True
            self.tell(f"{self.where} has no workers yet: waiting for one (start it with: dask worker {self.where})")
        if self.members and all(member.state == "refused" for member in self.members.values()):
            raise IncompleteError(f"no worker of {self.where} can be used: {self.reasons[-1]}")
        return gone

    def advance(self, member: Member) -> None:
        """Take a worker's answer to what it was asked for, and ask for the next thing."""
        if member.waiting is None or not member.waiting.done():
            return
        future, member.waiting = member.waiting, None
        if future.status != "finished":
            self.failed(member, future)
        elif member.state == "new":
            unlike = difference(future.result(), installation())
            if unlike:
                self.refuse(member, unlike)
            elif self.settings is None:
                member.state = "ready"  # for what needs no process of this session, such as a study
            else:
                self.settle(member)
        elif member.state == "settling":
            unlike = difference(future.result(), self.wanted)
            if unlike:
                self.refuse(member, unlike)
            else:
                member.state = "ready"
        elif member.asked is not None:
            (parcel, which, facts), member.asked = member.asked, None
            answer = future.result()
            if answer["facts"] != facts:
                theirs, ours = json.loads(answer["facts"]), json.loads(facts)
                unlike = [name for name in ours if theirs.get(name) != ours[name]]
                self.refuse(member, f"it has another {', '.join(unlike) or 'picture'} than this machine")
            else:
                member.has.add((parcel.id, which))
                member.seconds_per_sample, member.last = answer["seconds"], 0
                member.facts = {"pid": answer["pid"], "memory": answer["memory"]}

    def settle(self, member: Member) -> None:
        """Let a worker start its process, or a new one where that has ended."""
        member.state, member.has, member.asked = "settling", set(), None
        words = self.session, self.settings, not self.is_local
        member.waiting = self.submit(worker.settle, *words, at=[member.address], priority=20)

    def failed(self, member: Member, future: Any) -> None:
        """Ask a worker again that did not do what it was asked for, or leave it out."""
        if future.status != "error":  # cancelled, because something that it needed was lost
            member.asked = None
            if member.state == "new":
                member.waiting = self.submit(worker.introduce, at=[member.address], priority=20)
            elif member.state == "settling":
                self.settle(member)
            return
        error, member.failures = future.exception(), member.failures + 1
        text = last_line(error)
        if isinstance(error, InputError):
            self.refuse(member, text)
        elif isinstance(error, (ImportError, AttributeError)):
            self.refuse(member, f"it has no taichi_tracer that can do this ({text})")
        elif member.failures >= TRIES:
            self.refuse(member, f"it failed {TRIES} times: {text}")
        else:
            self.settle(member)

    def refuse(self, member: Member, why: str) -> None:
        """Leave a worker out, and say why."""
        member.state = "refused"
        self.reasons.append(f"worker {member.address}: {why}")
        self.tell(f"worker {member.address} is left out: {why}")

    # ── who has the scene ──

    def ready(self, parcel: Parcel, which: tuple, facts: str) -> list[Member]:
        """The workers that have a picture; those that could have it are sent it."""
        found = []
        for member in self.members.values():
            if member.state != "ready":
                continue
            if (parcel.id, which) in member.has:
                found.append(member)
            elif member.waiting is None and not member.given:
                member.asked = parcel, which, facts
                words = self.session, parcel.message(), list(which), list(parcel.hashes)
                pieces = self.pieces_for(member, parcel)
                member.waiting = self.submit(worker.receive, *words, *pieces, at=[member.address], priority=20)
        return found

    def pieces_for(self, member: Member, parcel: Parcel) -> list[Any]:
        """The futures of all pieces of a parcel. Those that this worker does not have yet travel to it."""
        found = [self.piece(parcel, one, member.address) for one in parcel.hashes]
        for one, (_, size) in zip(parcel.hashes, found, strict=True):
            if one not in member.pieces:
                member.pieces.add(one)
                self.bytes_sent += size
        return [future for future, _ in found]

    def piece(self, parcel: Parcel, wanted: str, address: str) -> tuple[Any, int]:
        """The future of a piece of a file, and its size. It is sent to one worker, and goes on from there."""
        known = self.pieces.get(wanted)
        if known is None or known[0].status != "finished":
            content = parcel.content(wanted)
            key = f"taichi_tracer-piece-{self.session[:8]}-{wanted}"
            futures = self.client.scatter({key: content}, workers=[address])
            self.pieces[wanted] = futures[key], len(content)
        return self.pieces[wanted]


def later(function: Callable[[], Any]) -> Future:
    """The future of a call in a thread of its own, which may never return if the machine that it asks has gone."""
    future: Future = Future()

    def call() -> None:
        try:
            future.set_result(function())
        except BaseException as error:
            future.set_exception(error)

    threading.Thread(target=call, daemon=True).start()
    return future


def last_line(error: BaseException) -> str:
    """What an error says, in one line: the last line if its text is a traceback."""
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    return lines[-1] if lines else type(error).__name__
