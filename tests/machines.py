"""A scheduler and workers of Dask on loopback, in processes of their own."""

import contextlib
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import taichi_tracer

PACKAGES = str(Path(taichi_tracer.__file__).parent.parent)
APART = "unshare", "--map-root-user", "--mount", "sh", "-c"  # a program that sees mounts of its own
SECONDS = 60  # in which a process has to be there


class Machines:
    """What a cluster consists of; everything ends with the test."""

    def __init__(self, folder: Path, options: tuple[str, ...] = ()) -> None:
        self.folder, self.options = folder, options
        self.file = folder / "scheduler.json"
        self.processes: list[subprocess.Popen] = []
        self.scheduler = self.start("dask_scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard")
        self.workers: list[subprocess.Popen] = []

    def start(self, program: str, *words: str, before: tuple[str, ...] = (), **variables: str) -> subprocess.Popen:
        """A process of Dask, in a group of its own; ``before`` is a program that runs it."""
        command = [*before, sys.executable, "-m", f"distributed.cli.{program}", "--scheduler-file", str(self.file)]
        log = open(self.folder / f"{program}_{len(self.processes)}.log", "w")  # noqa: SIM115 (the process has it)
        found = os.environ.get("PYTHONPATH")
        paths = {"PYTHONPATH": os.pathsep.join([*filter(None, [variables.pop("FIRST", None)]), PACKAGES, found or ""])}
        process = subprocess.Popen(
            [*command, *words, *self.options],
            stdout=log,
            stderr=log,
            cwd=self.folder,
            env=os.environ | paths | variables,
            start_new_session=True,
        )
        self.processes.append(process)
        return process

    @property
    def address(self) -> str:
        """Of the scheduler."""
        import json

        until = time.monotonic() + SECONDS
        while time.monotonic() < until:
            with contextlib.suppress(OSError, ValueError):
                return json.loads(self.file.read_text())["address"]
            time.sleep(0.05)
        raise AssertionError("the scheduler did not start")

    def add(self, room: str | None = None, **variables: str) -> subprocess.Popen:
        """One more worker; ``room`` is the size of its disk, such as "1m", where the system lets a user mount one."""
        assert self.address
        name = f"w{len(self.workers)}"
        words = ["--nthreads", "1", "--no-nanny", "--no-dashboard", "--name", name, "--host", "127.0.0.1"]
        local = self.folder / name
        local.mkdir()
        before = () if room is None else (*APART, f'mount -t tmpfs -o size={room} none "$0" && exec "$@"', str(local))
        worker = self.start("dask_worker", *words, "--local-directory", str(local), before=before, **variables)
        self.workers.append(worker)
        return worker

    def end(self) -> None:
        """End what is still there."""
        for process in self.processes:
            with contextlib.suppress(ProcessLookupError, PermissionError):
                os.killpg(process.pid, signal.SIGCONT)
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()
