"""A client of Dask for what ``--cluster`` names: processes of this machine, a scheduler that runs, or jobs of SLURM."""

import contextlib
import logging
import os
import re
import signal
import socket
from collections.abc import Callable
from typing import Any

from taichi_tracer.system.errors import IncompleteError, InputError
from taichi_tracer.system.importing import import_extra

FORM = re.compile(
    r"(?P<local>local)(:(?P<count>\d+))?|(?P<slurm>slurm):(?P<number>\d+)"
    r"|(tcp|tls)://(?P<host>\[[0-9a-fA-F:.]+\]|[^:/\s]+):(?P<port>\d{1,5})",
    re.ASCII,
)
FORMS = "local or local:4, tcp://host:8786, tls://host:8786, or slurm:4"
MOST_LOCAL = 8  # processes per processor of this machine
INSTALL = "--cluster needs the package distributed: pip install 'taichi_tracer[cluster]'"
NO_WORKERS = 'its workers did not start; a script must do this below if __name__ == "__main__":'
CONNECT = 10.0  # seconds in which a scheduler has to answer
PATIENT = 5.0  # seconds after which a line says that there is no worker yet
CLOSE = 2.0  # seconds in which a connection has to end


class Cluster:
    """A connection to a scheduler.

    Args:
        where: local, local:N, tcp://host:8786, tls://host:8786, or slurm:N.
        tell: called with what the user should know, one line each.

    Attributes:
        client: of Dask. threads: how many processors a worker uses; None for all that its process may use.
    """

    def __init__(self, where: str, tell: Callable[[str], Any]) -> None:
        self.where, self.threads, self.own = where, None, None
        self.form = FORM.fullmatch(where)
        if self.form is None:
            raise InputError(f"--cluster {where}: give {FORMS}")
        self.count = int(self.form["count"] or self.form["number"] or 1)
        most = MOST_LOCAL * (os.cpu_count() or 1)
        if self.count < 1 or (self.form["local"] and self.count > most):
            raise InputError(f"--cluster {where}: give at least 1 worker, and at most local:{most} on this machine")
        distributed = import_extra("distributed", INSTALL)
        for name in ["distributed", "tornado.application", *logging.root.manager.loggerDict]:
            if name.startswith(("distributed", "tornado")):
                logging.getLogger(name).setLevel(logging.CRITICAL)  # what matters is an error with one line
        dask = import_extra("dask", INSTALL)
        dask.config.set({"distributed.admin.large-graph-warning-threshold": "1TB"})  # a job has the scene's files
        try:
            self.client = distributed.Client(self.start() or where, timeout=CONNECT, set_as_default=False)
        except (OSError, OverflowError, ValueError, TypeError, RuntimeError) as error:
            self.close()
            if isinstance(error, InputError):
                raise
            why = NO_WORKERS if self.form["local"] else "no scheduler answers there"
            raise InputError(f"--cluster {where}: {why} ({last_line(error)}); see docs/cluster.md") from None
        try:
            self.client.wait_for_workers(1, timeout=PATIENT)
        except distributed.TimeoutError:
            tell(f"{where} has no workers yet: waiting for one (see docs/cluster.md)")

    def start(self) -> Any:
        """The cluster that this process starts; None where a scheduler runs already."""
        if self.form["local"]:
            from distributed import LocalCluster

            self.threads = max(1, (os.cpu_count() or 1) // self.count)
            quiet = {"silence_logs": logging.CRITICAL, "dashboard_address": None, "memory_limit": 0}
            preload = ["taichi_tracer.cluster.worker"]
            self.own = LocalCluster(n_workers=self.count, threads_per_worker=1, preload=preload, **quiet)
        elif self.form["slurm"]:
            advice = f"--cluster {self.where} needs dask-jobqueue: pip install dask-jobqueue"
            self.own = import_extra("dask_jobqueue", advice).SLURMCluster(processes=1)
            self.own.scale(jobs=self.count)
        else:  # Dask would try again for seconds where nobody listens
            place = self.form["host"].strip("[]"), int(self.form["port"])
            with socket.create_connection(place, CONNECT) as connection:
                if self.where.startswith("tcp"):
                    connection.recv(1)  # a scheduler speaks first; for others, Dask would wait without end
        return self.own

    def workers(self) -> int:
        """How many workers there are now.

        Raises:
            IncompleteError: the scheduler is gone.
        """
        with contextlib.suppress(Exception):  # Dask raises several kinds of errors for a connection that has ended
            if self.client.status == "running":
                return len(self.client.nthreads(callback_timeout=CONNECT))
        raise IncompleteError(f"the scheduler {self.where} is gone")

    def close(self) -> None:
        """Let go of the scheduler. What this process has started ends; local workers at once, whatever they render."""
        with contextlib.suppress(Exception):
            self.client.close(timeout=CLOSE)
        if self.own is not None:
            for nanny in self.own.workers.values() if self.form["local"] else ():
                nanny.auto_restart = False
                with contextlib.suppress(OSError, TypeError):  # it has ended
                    os.kill(nanny.pid, getattr(signal, "SIGKILL", signal.SIGTERM))
            with contextlib.suppress(Exception):
                self.own.close(timeout=CLOSE)

    def __enter__(self) -> "Cluster":
        return self

    def __exit__(self, *_error: object) -> None:
        self.close()


def last_line(error: BaseException) -> str:
    """What an error says, in one line: the last line if its text is a traceback."""
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    return lines[-1] if lines else type(error).__name__
