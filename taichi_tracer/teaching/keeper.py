"""The process that keeps a submission's process: it starts it behind walls, watches it, and ends all that it started.

    grader ── (bubblewrap) ── keeper ── submission

The keeper runs no code of the submission. It ends when the submission's process has ended, when that uses too much
memory, or when the grader closes its end of the socket; before that, it ends every process that descends from it.
"""

import atexit
import json
import os
import select
import signal
import socket
import sys
from dataclasses import dataclass

from taichi_tracer.teaching import walls
from taichi_tracer.teaching.walls import Limits, Surroundings

POLL = 0.2  # seconds between two looks at the memory
FAILED = 71  # exit code of a process that could not make its walls


@dataclass(frozen=True)
class Task:
    """What a keeper is asked for, as JSON in its arguments.

    Attributes:
        world, limits: where the submission runs, and what it may use; limits None are for the solution only.
        requests, answers, line: descriptors of the pipes, and of the socket between the grader and the keeper.
    """

    world: Surroundings
    limits: Limits | None
    requests: int
    answers: int
    line: int

    def words(self) -> str:
        """The task as JSON."""
        limits = None if self.limits is None else vars(self.limits)
        return json.dumps(vars(self) | {"world": vars(self.world), "limits": limits})

    @classmethod
    def of(cls, words: str) -> "Task":
        """The task of a JSON text."""
        values = json.loads(words)
        world = values["world"] | {name: tuple(values["world"][name]) for name in ("reads", "hides")}
        limits = None if values["limits"] is None else Limits(**values["limits"])
        return cls(**values | {"world": Surroundings(**world), "limits": limits})


def main(words: str) -> None:
    """Run a task. This process never returns to its caller."""
    task = Task.of(words)
    for descriptor in (task.requests, task.answers, task.line):
        os.set_inheritable(descriptor, False)
    line = socket.socket(fileno=task.line)
    walls.prctl("subreaper", walls.PR_SET_CHILD_SUBREAPER, 1)
    awake, waker = os.pipe()
    os.set_blocking(waker, False)
    signal.set_wakeup_fd(waker)
    signal.signal(signal.SIGCHLD, lambda *_: None)
    try:
        tasks = walls.tasks_of(os.getuid()) if task.limits is not None and os.getuid() != 0 else 0
        child = os.fork()
    except OSError as error:
        tell(line, {"failed": str(error)})
        os._exit(FAILED)
    if child == 0:
        signal.set_wakeup_fd(-1)
        signal.signal(signal.SIGCHLD, signal.SIG_DFL)
        child_of_keeper(task, line, tasks)
    for descriptor in (task.requests, task.answers):
        os.close(descriptor)
    tell(line, watch(child, line, awake, task.limits))
    walls.end_descendants()
    os._exit(0)


def tell(line: socket.socket, facts: dict) -> None:
    """Tell the grader how it ended; it may have gone."""
    try:
        line.sendall(json.dumps(facts).encode() + b"\n")
    except OSError:
        return


def watch(child: int, line: socket.socket, awake: int, limits: Limits | None) -> dict:
    """Wait until the child has ended, needs too much memory, or is not needed any more. How it ended."""
    while True:
        ready, _, _ = select.select([line, awake], [], [], POLL)
        if awake in ready:
            os.read(awake, 1000)
        while True:
            try:
                process, status = os.waitpid(-1, os.WNOHANG)
            except ChildProcessError:
                return {"exit": None}
            if process == child:
                code = os.waitstatus_to_exitcode(status)
                return {"signal": -code} if code < 0 else {"exit": code}
            if process == 0:
                break
        if line in ready and not line.recv(1):
            return {"exit": None}
        if limits is not None:
            found = walls.descendants(os.getpid())
            if len(found) > limits.processes:
                return {"processes": len(found)}
            used = sum(found.values())
            if used > limits.resident:
                return {"memory": used}


def child_of_keeper(task: Task, line: socket.socket, tasks: int) -> None:
    """The child of the keeper: it takes its limits, and becomes the process of the submission."""
    try:
        os.setsid()
        wall_in(task, tasks)
    except OSError as error:
        tell(line, {"failed": str(error)})
        os._exit(FAILED)
    line.close()
    from taichi_tracer.teaching import child

    child.serve(task.requests, task.answers, None if task.limits is None else task.limits.cpu)
    if task.limits is None:
        atexit._run_exitfuncs()  # Taichi writes its compiled kernels then
    os._exit(0)


def wall_in(task: Task, tasks: int) -> None:
    """Everything that the submission's process cannot do afterwards."""
    world = task.world
    walls.copy_into_world(world)
    os.environ.update({"HOME": world.folder, "TMPDIR": f"{world.folder}/tmp"})
    os.environ["TI_OFFLINE_CACHE_FILE_PATH"] = f"{world.folder}/cache"
    if task.limits is not None:
        walls.set_limits(task.limits, tasks)
    if world.user is not None and os.geteuid() == 0:
        walls.give_folder_to(world.folder, world.user)
        walls.become(world.user)
    if task.limits is not None:
        walls.drop_privileges()
    walls.prctl("pdeathsig", walls.PR_SET_PDEATHSIG, signal.SIGKILL)  # after the change of the user, which clears it


if __name__ == "__main__":
    main(sys.argv[1])
