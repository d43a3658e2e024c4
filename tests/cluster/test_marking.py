"""A submission at a worker; ``test_jobs`` compares the marks of a class with those of the command."""

import pytest

import taichi_tracer as tt
from taichi_tracer.cluster.marking import mark_of_zip


@pytest.mark.parametrize("name", ["../123456789.zip", "/tmp/123456789.zip", "a/b.zip"])
def test_no_name_leads_out_of_the_folder(name, tmp_path):
    with pytest.raises(tt.InputError, match="is no file name"):
        mark_of_zip("rt3", name, b"", 1, True, tmp_path)
    assert not list(tmp_path.iterdir())
