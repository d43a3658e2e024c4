"""Parts by kind for parametrised tests, and parts that are registered for the length of a test."""

from contextlib import contextmanager

import pytest
from support import DEBUG

from taichi_tracer.contracts import brdfs, integrators, intersectors
from taichi_tracer.contracts.steps import steps_of
from taichi_tracer.system.parts import PARTS

# Parts of a user are checked about three normals and with more rays; the package's in half the time.
brdfs.NORMALS, intersectors.RAYS = brdfs.NORMALS[::2], 10_000
if DEBUG:  # bounds are what is tested
    integrators.SIZE, integrators.SPP = 6, 2
    integrators.largest_z = lambda _count: float("inf")  # of so few samples
    intersectors.RAYS = 2_000


def every(kind, only=lambda part: True, alike=()):
    """A decorator: runs the test with ``part`` set to each part of the package of a kind, named by its name.

    Args:
        only: which parts of the kind.
        alike: names of parts that share most of their code with another: they are left out.
    """
    packages = [part for part in PARTS.all(kind) if type(part).__module__.startswith("taichi_tracer.")]  # not of a test
    parts = [part for part in packages if only(part) and part.name not in alike]
    return pytest.mark.parametrize("part", [pytest.param(part, id=part.name) for part in parts])


@contextmanager
def registered(part):
    """Register a class or an object; what the registry holds of it is given, and forgotten at the end."""
    PARTS.add(part)
    try:
        yield PARTS.find(part.kind, part.name)
    finally:
        PARTS.remove(part)


def check_part(part):
    """All that a part must do."""
    for _, check in steps_of(part):
        check()


def broken_parts(reasons):
    """A decorator: runs the test with ``broken`` and ``reason`` set to each of a dictionary class → what is found."""
    ids = [getattr(part, "name", str(part)) for part in reasons]
    return pytest.mark.parametrize(("broken", "reason"), list(reasons.items()), ids=ids)


def check_fails(part, check, reason):
    """Register a broken part: it is among those that are checked, and the check fails and says why.

    Args:
        reason: a regular expression that is found in the message.
    """
    before = PARTS.names(part.kind)
    with registered(part) as broken:
        assert broken in PARTS.all(part.kind)
        with pytest.raises(AssertionError, match=reason):
            check(broken)
    assert PARTS.names(part.kind) == before
