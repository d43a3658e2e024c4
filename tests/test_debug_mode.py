"""Every picture and every answer in Taichi's debug mode, which tells what is read outside and what overflows."""

import pytest
from every_picture import THIRDS, made


@pytest.mark.long
@pytest.mark.parametrize("third", THIRDS)
def test_nothing_is_read_outside_and_nothing_overflows(third, tmp_path):
    assert len(made(tmp_path, "cpu", third, "debug")) > 40  # each with its seconds
