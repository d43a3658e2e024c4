"""What several tests of the teaching kit need."""

import pytest
from support import start

from taichi_tracer.teaching import base


@pytest.fixture(scope="module")
def own_cache(tmp_path_factory):
    """Taichi is started, and the answers of mistakes are kept in a folder of the tests."""
    start("f32")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(base.VARIABLE, str(tmp_path_factory.mktemp("cache")))
        yield
