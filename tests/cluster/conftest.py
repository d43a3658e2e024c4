"""A scheduler of Dask, to which a test adds workers."""

import pytest
from machines import Machines


@pytest.fixture
def machines(tmp_path):
    """A scheduler; a test adds its workers."""
    pytest.importorskip("distributed")
    made = Machines(tmp_path)
    yield made
    made.end()
