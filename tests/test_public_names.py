"""The public names: all there, all explained, and importing the package costs and does next to nothing."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

import taichi_tracer as tt

PACKAGE = Path(tt.__file__).parent
MOST_MODULES = 20  # that importing the package may load, so that it takes no time

# Put before a program, it refuses every network call, and prints at the end which were tried.
OFFLINE = """
import atexit, sys
calls = []
def refuse(event, args):
    if event in ("socket.connect", "socket.getaddrinfo"):
        calls.append(event)
        raise OSError("offline")
sys.addaudithook(refuse)
atexit.register(lambda: calls and print("network:", *calls))
"""
# Taichi calls home in a thread.
START = f"{OFFLINE}\nimport taichi_tracer as tt, time\ntt.init('cpu')\ntime.sleep(0.5)"


def python(program: str, **variables: str) -> str:
    """All that a program prints in a new process that finds this copy of the package and has no settings of Taichi."""
    settings = {name: value for name, value in os.environ.items() if not name.startswith(("TI_", "ENABLE_TAICHI"))}
    environment = settings | {"PYTHONPATH": str(PACKAGE.parent)} | variables
    command = [sys.executable, "-c", program]
    result = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=120)
    assert result.returncode == 0, result.stderr
    return result.stdout + result.stderr


@pytest.mark.parametrize("name", tt.__all__)
def test_a_public_name_is_there(name):
    value = getattr(tt, name)
    assert getattr(value, "__name__", name) == name
    assert name in dir(tt)


def test_importing_the_package_loads_nothing_heavy():
    program = "import sys; before = set(sys.modules); import taichi_tracer; print(*sorted(set(sys.modules) - before))"
    loaded = {name.split(".")[0] for name in python(program).split()}
    assert len(loaded) < MOST_MODULES
    assert not loaded & {"taichi", "numpy", "trimesh", "PIL", "tqdm", "matplotlib"}
    assert "taichi_tracer" in loaded


def test_starting_taichi_says_nothing_and_calls_nobody(tmp_path):
    assert python(START, XDG_CACHE_HOME=str(tmp_path)) == ""
