"""Hostile submissions of ``sums``: code that attacks the grader, its files, the other students, or the machine.

Each attack is the text of a sums.py, and what the part "Sums.add" may become. "Sums.multiply" is never attacked: its
marks have to be full wherever the file can be loaded at all. {victim} is a folder that belongs to the grader's user,
{port} a port on which the grader's machine listens, and {pid} the number of the grader's process.
"""

from dataclasses import dataclass

from teaching.sums import submission

LOST = ("crashed", "out of time")  # the part has no answer
WRONG = ("wrong",)
ANY = ("right", "wrong", "crashed", "out of time")


@dataclass(frozen=True)
class Attack:
    """One hostile submission.

    Attributes:
        top: code that runs when the file is loaded. add: the body of the method that the part "Sums.add" tests.
        becomes: what this part may become. loses_all: whether no part can have an answer.
        needs_bwrap: whether limits alone do not stop it.
    """

    top: str = ""
    add: str = "return a + b"
    becomes: tuple[str, ...] = LOST
    loses_all: bool = False
    needs_bwrap: bool = False

    @property
    def code(self) -> str:
        """The file."""
        return submission(self.top, self.add)


FORGE = """
import json, os
def forged(message):
    return json.dumps([message, {}]).encode() + b"\\n"
def to_all(data):
    for descriptor in range(3, 64):
        try:
            os.set_blocking(descriptor, False)
            os.write(descriptor, data)
        except OSError:
            pass
"""

ATTACKS = {
    # time
    "endless loop": Attack(add="while True: pass"),
    "endless kernel": Attack(
        top="""
            import taichi as ti
            @ti.kernel
            def endless(n: ti.i32) -> ti.i32:
                found = 0
                ti.loop_config(serialize=True)
                for _ in range(1):
                    while n > 0:
                        found += n
                        if found == 12345678:
                            found = 0
                return found
            """,
        add="return a + endless(1)",
    ),
    "sleep": Attack("import time", "time.sleep(10000)"),
    "ignores the signal of the time limit": Attack(
        "import signal",
        """
            signal.signal(signal.SIGXCPU, signal.SIG_IGN)
            signal.signal(signal.SIGTERM, signal.SIG_IGN)
            while True: pass
            """,
    ),
    "raises its own limits": Attack(
        "import resource",
        """
            for name in ("RLIMIT_AS", "RLIMIT_CPU", "RLIMIT_FSIZE", "RLIMIT_NPROC"):
                number = getattr(resource, name)
                try:
                    resource.setrlimit(number, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
                except (ValueError, OSError):
                    continue
            while True: pass
            """,
    ),
    "endless loop on import": Attack("while True: pass", loses_all=True),
    "endless loop at exit": Attack(
        "import atexit\ndef wait():\n    while True: pass\natexit.register(wait)", becomes=("right",)
    ),
    "recursion": Attack("def deep(n): return deep(n + 1) + 1", "return a + deep(0)"),
    "recursion without a limit": Attack(
        "import sys\nsys.setrecursionlimit(10**9)\ndef deep(n): return deep(n + 1) + 1", "return a + deep(0)"
    ),
    # memory, disk, output
    "a billion pixels": Attack("import numpy as np", "return a + np.ones((10**9, 3)).sum()"),
    "a billion pixels in a field": Attack(
        "import taichi as ti",
        """
            field = ti.Vector.field(3, float, shape=10**9)
            field.fill(1.0)
            return a + field[0][0]
            """,
    ),
    "memory of many processes": Attack(
        "import os, time\nimport numpy as np",
        """
            for _ in range(12):
                if os.fork() == 0:
                    kept = np.ones(60_000_000)
                    time.sleep(1000)
            time.sleep(1000)
            """,
    ),
    "a huge answer": Attack("import numpy as np", "return np.zeros(30_000_000)"),
    "a gigabyte on stdout": Attack(
        "import sys", "for _ in range(1024): sys.stdout.write('x' * 2**20)\nreturn a + b", becomes=ANY
    ),
    "a full disk": Attack(
        "import os",
        """
            for i in range(100):
                with open(os.path.join(os.environ["TMPDIR"], str(i)), "wb") as file:
                    for _ in range(60):
                        file.write(bytes(2**20))
            return a + b
            """,
        needs_bwrap=True,
    ),
    "a huge file": Attack(
        "import os",
        """
            with open(os.path.join(os.environ["TMPDIR"], "x"), "wb") as file:
                for _ in range(200):
                    file.write(bytes(2**20))
            return a + b
            """,
    ),
    # the end of the process
    "os._exit": Attack("import os", "os._exit(0)"),
    "os._exit on import": Attack("import os\nos._exit(0)", loses_all=True),
    "sys.exit": Attack("import sys", "sys.exit(0)"),
    "sys.exit on import": Attack("import sys\nsys.exit(0)", loses_all=True),
    "KeyboardInterrupt": Attack(add="raise KeyboardInterrupt"),
    "an exception of its own": Attack("class Wild(BaseException):\n    def __str__(self): raise self", "raise Wild()"),
    "segmentation fault": Attack("import ctypes", "ctypes.string_at(0)"),
    "abort": Attack("import os", "os.abort()"),
    # processes
    "fork that stays": Attack(
        "import os, time", "if os.fork() == 0: time.sleep(10000)\nreturn a + b", becomes=("right",)
    ),
    "fork that answers, too": Attack("import os", "os.fork()\nreturn a + b", becomes=ANY),
    "daemon": Attack(
        "import os, time",
        """
            if os.fork() == 0:
                os.setsid()
                if os.fork() == 0:
                    while True: time.sleep(0.1)
                os._exit(0)
            return a + b
            """,
        becomes=("right",),
    ),
    "daemon that keeps the pipes of a process that ends": Attack(
        "import os, time",
        """
            if os.fork() == 0:
                os.setsid()
                time.sleep(40)
                os._exit(0)
            time.sleep(0.5)
            os._exit(0)
            """,
    ),
    "500 forks": Attack(
        "import os, time",
        """
            for _ in range(500):
                if os.fork() == 0:
                    time.sleep(10000)
            return a + b
            """,
    ),
    "thread that stays": Attack(
        "import threading",
        """
            def spin():
                while True: pass
            threading.Thread(target=spin).start()
            return a + b
            """,
        becomes=ANY,
    ),
    "signals to its parents": Attack(
        "import os, signal",
        """
            for process in (os.getppid(), {pid}):
                for number in (signal.SIGSTOP, signal.SIGTERM, signal.SIGKILL):
                    try:
                        os.kill(process, number)
                    except OSError:
                        pass
            return a + b
            """,
        becomes=ANY,
        needs_bwrap=True,
    ),
    "signals to everybody": Attack(
        "import os, signal", "os.kill(-1, signal.SIGKILL)\nreturn a + b", becomes=ANY, needs_bwrap=True
    ),
    # the grader's words
    "the solutions' files": Attack(
        "import taichi_tracer\nfrom pathlib import Path",
        """
            folder = Path(taichi_tracer.__file__).parent / "teaching" / "assignments"
            return a + b * bool(list(folder.rglob("*.py")))
            """,
        becomes=WRONG,
        needs_bwrap=True,
    ),
    "patched numpy": Attack(
        """
            import numpy as np
            np.allclose = np.array_equal = np.isclose = lambda *args, **named: True
            np.abs = lambda values: values * 0
            """,
        "return a * 0",
        becomes=WRONG,
    ),
    "patched grader": Attack(
        """
            from taichi_tracer.teaching import base
            base.Numbers.__call__ = lambda *args: base.PartResult("right", 1.0)
            base.Numbers.agrees = lambda self, inputs, *args: inputs["a"] == inputs["a"]
            """,
        "return a * 0",
        becomes=LOST,
        loses_all=True,
    ),
    "patched protocol": Attack(
        """
            import sys
            child = sys.modules["__main__"]
            plain = child.pack
            child.pack = lambda facts, arrays: plain({**facts, "status": "right", "share": 1.0, "points": 100}, arrays)
            """,
        "return a * 0",
        loses_all=True,
    ),
    "garbage on all descriptors": Attack(FORGE, "to_all(b'garbage' * 10)\nreturn a + b", becomes=ANY),
    "forged frames": Attack(
        FORGE, "to_all(forged({'status': 'ok', 'part': 'Sums.subtract'}) * 3)\nreturn a * 0", becomes=LOST + WRONG
    ),
    "a frame of a billion bytes": Attack(
        FORGE,
        """
            header = json.dumps([{"part": "Sums.add"}, {"value": ["<f8", [10**12], "00"]}]).encode() + b"\\n"
            to_all(header)
            return a * 0
            """,
    ),
    "closed descriptors": Attack("import os", "os.closerange(0, 256)\nreturn a + b"),
    "an answer of objects": Attack(
        "import numpy as np", "return np.array([print, open, {}], dtype=object)", becomes=WRONG
    ),
    "an answer that equals everything": Attack(
        """
            import numpy as np
            class Equal(np.ndarray):
                def __eq__(self, other): return True
                def __le__(self, other): return True
            """,
        "return (a * 0).view(Equal)",
        becomes=WRONG,
    ),
    "an answer without numbers": Attack("import numpy as np", "return np.full((20, 3, 1, 1), np.nan)", becomes=WRONG),
    "letters for the terminal": Attack(
        add="raise ValueError('\\x1b[2J\\x1b]0;x\\x07<script>alert(1)</script>')", becomes=("crashed",)
    ),
    # files, the network, the others
    "deleted files": Attack(
        "import shutil", "shutil.rmtree('{victim}', ignore_errors=True)\nreturn a + b", becomes=ANY, needs_bwrap=True
    ),
    "a file of the others": Attack(
        add="return a + b if 'secret' in open('{victim}/secret.txt').read() else a", needs_bwrap=True
    ),
    "the files of the others": Attack(
        "import os",
        """
            found = [name for name in os.listdir("/tmp") if name.startswith("taichi_tracer_submission")]
            assert not found
            return a + b
            """,
        becomes=ANY,
        needs_bwrap=True,
    ),
    "a changed package": Attack(
        """
            import pathlib, taichi_tracer
            place = pathlib.Path(taichi_tracer.__file__).parent / "hacked.py"
            """,
        "place.write_text('x = 1')\nreturn a + b",
        needs_bwrap=True,
    ),
    "links to outside": Attack(
        "import os",
        """
            os.symlink("{victim}", "link")
            os.symlink("/", os.path.join(os.environ["TMPDIR"], "root"))
            return a + b
            """,
        becomes=("right",),
    ),
    "a locked folder": Attack(
        "import os", "os.mkdir('x')\nopen('x/y', 'w').close()\nos.chmod('x', 0)\nreturn a + b", becomes=("right",)
    ),
    "poisoned kernels": Attack(
        "import os",
        """
            for place, _, files in os.walk(os.environ["TI_OFFLINE_CACHE_FILE_PATH"]):
                for name in files:
                    open(os.path.join(place, name), "wb").write(b"poison")
            return a + b
            """,
        becomes=("right",),
    ),
    "the network": Attack(
        "import socket",
        "socket.create_connection(('127.0.0.1', {port}), 3).send(b'secret')\nreturn a + b",
        needs_bwrap=True,
    ),
    "the environment": Attack(
        "import os", "assert 'TEACHERS_PASSWORD' not in os.environ\nreturn a + b", becomes=("right",)
    ),
    "the requests of others": Attack(
        "import os",
        """
            for name in os.listdir("/proc"):
                if name.isdecimal() and int(name) not in (os.getpid(), 1):
                    with open(f"/proc/{name}/environ", "rb") as file:
                        assert b"TEACHERS_PASSWORD" not in file.read()
            return a + b
            """,
        becomes=("right", "crashed"),
        needs_bwrap=True,
    ),
}
