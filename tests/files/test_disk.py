"""Files as a whole: what is no file is refused, and a new file replaces an older one only when it is complete."""

import os
import socket
from pathlib import Path

import pytest

from taichi_tracer.files.disk import check_is_file, read_bytes
from taichi_tracer.system.errors import InputError, MissingFileError


def test_a_file_is_read(tmp_path):
    (tmp_path / "a").write_bytes(b"content")
    (tmp_path / "link").symlink_to(tmp_path / "a")
    check_is_file(tmp_path / "a")
    assert read_bytes(tmp_path / "link") == b"content"


def test_what_cannot_be_read_is_named(tmp_path):
    with pytest.raises(MissingFileError, match="gone: no such file"):
        read_bytes(tmp_path / "gone")
    with pytest.raises(InputError, match="this is a folder: give a file in it"):
        read_bytes(tmp_path)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="there are no pipes among the files")
def test_a_pipe_a_socket_and_a_device_are_refused_unread(tmp_path, monkeypatch):
    os.mkfifo(tmp_path / "pipe")
    monkeypatch.chdir(tmp_path)  # the path of a socket must be short
    with socket.socket(socket.AF_UNIX) as end:
        end.bind("socket")
        for path, kind in (("pipe", "a pipe"), ("socket", "a socket"), (Path("/dev/zero"), "a device")):
            with pytest.raises(InputError, match=f"{path}: this is {kind}: give a file that lies on a disk"):
                read_bytes(path)
