"""Every picture and every answer in Taichi's debug mode, which tells what is read outside and what overflows."""

import pytest
from every_picture import made


@pytest.mark.long
def test_nothing_is_read_outside_and_nothing_overflows(tmp_path):
    assert len(made(tmp_path, "cpu", "debug")) > 100
