"""Submissions: hostile zip files are refused, unusual ones are unpacked, and the rules of the course are read off."""

import os
import stat
import struct
import zipfile
import zlib

import pytest
from teaching.sums import zipped

from taichi_tracer.teaching.grading.submissions import RefusedError, find, submission, unpack

FILES = ("camera.py", "renderer.py")


def unpacked(path, tmp_path):
    """What a zip file or a folder gives."""
    return unpack(submission(path), tmp_path / "target", FILES)


def refused(path, tmp_path, reason=""):
    """Check that a zip file or a folder is refused."""
    with pytest.raises(RefusedError, match=reason):
        unpacked(path, tmp_path)


def entry(name: str, mode: int = 0) -> zipfile.ZipInfo:
    """An entry with a mode of Unix."""
    info = zipfile.ZipInfo(name)
    info.create_system, info.external_attr = 3, mode << 16
    return info


# ── what is refused ──


@pytest.mark.parametrize(
    "name", ["/etc/passwd", "../camera.py", "a/../../camera.py", "..\\..\\camera.py", "a\x1b[2J.py", "a\nb.py"]
)
def test_a_name_that_cannot_be(name, tmp_path):
    refused(zipped(tmp_path / "1.zip", {"camera.py": "", name: "x"}), tmp_path, "leads out of the folder, or cannot be")
    assert not (tmp_path / "camera.py").exists()


def test_a_link_in_a_zip_becomes_a_text_and_one_in_a_folder_is_refused(tmp_path):
    with zipfile.ZipFile(tmp_path / "1.zip", "w") as archive:
        archive.writestr(entry("camera.py", stat.S_IFLNK | 0o777), "/etc/passwd")
    found = unpacked(tmp_path / "1.zip", tmp_path)[0] / "camera.py"
    assert not found.is_symlink()
    assert found.read_text() == "/etc/passwd"
    (tmp_path / "2").mkdir()
    (tmp_path / "2" / "camera.py").symlink_to("/etc/passwd")
    with pytest.raises(RefusedError, match="link or a device"):
        unpack(submission(tmp_path / "2"), tmp_path / "again", FILES)


def test_too_many_bytes(tmp_path):
    with zipfile.ZipFile(tmp_path / "1.zip", "w") as archive:  # stored, so that the ratio is 1
        for i in range(19):
            archive.writestr(f"{i}.bin", os.urandom(1 << 20))
    path = tmp_path / "1.zip"
    unpacked(path, tmp_path)
    with zipfile.ZipFile(path, "a", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("z.bin", os.urandom(1 << 10) * (2 << 10))
    with pytest.raises(RefusedError, match="more than 20 MB"):
        unpack(submission(path), tmp_path / "again", FILES)


def test_sizes_are_counted_and_not_believed(tmp_path):
    """A header says 100 bytes; what is packed has 30 MB."""
    packed = zlib.compressobj(9, zlib.DEFLATED, -15)
    body = packed.compress(bytes(30 << 20)) + packed.flush()
    crc = zlib.crc32(bytes(30 << 20))
    name = b"camera.py"
    local = struct.pack("<4s5H3I2H", b"PK\x03\x04", 20, 0, 8, 0, 33, crc, len(body), 100, len(name), 0) + name
    central = struct.pack(
        "<4s6H3I5H2I", b"PK\x01\x02", 20, 20, 0, 8, 0, 33, crc, len(body), 100, len(name), 0, 0, 0, 0, 0, 0
    )
    central += name
    end = struct.pack("<4s4H2IH", b"PK\x05\x06", 0, 0, 1, 1, len(central), len(local) + len(body), 0)
    (tmp_path / "1.zip").write_bytes(local + body + central + end)
    refused(tmp_path / "1.zip", tmp_path)
    assert sum(p.stat().st_size for p in (tmp_path / "target").rglob("*")) < 1 << 20


@pytest.mark.parametrize("content", [b"", b"no zip", b"PK\x05\x06", b"PK\x05\x06" + bytes(18) + b"x", None])
def test_what_is_no_zip_file(content, tmp_path):
    if content is None:  # cut in the middle
        content = zipped(tmp_path / "1.zip", {"camera.py": os.urandom(5000)}).read_bytes()
        content = content[:2000] + content[-100:]
    (tmp_path / "1.zip").write_bytes(content)
    if content[:4] == b"PK\x05\x06" and len(content) == 23:
        unpacked(tmp_path / "1.zip", tmp_path)
        return
    refused(tmp_path / "1.zip", tmp_path)


# ── whose it is ──


@pytest.mark.parametrize(
    ("name", "student"),
    [
        ("123456789.zip", "123456789"),
        ("123456789", "123456789"),
        ("123456789_late.zip", "123456789"),
        ("hw1 (123456789).zip", "123456789"),
        ("Ann.zip", "Ann"),
        ("1234567890.zip", "1234567890"),
        ("123456789_987654321.zip", "123456789_987654321"),
    ],
)
def test_the_name_says_whose_it_is(name, student, tmp_path):
    path = tmp_path / name
    if name.endswith(".zip"):
        path.write_bytes(b"")
    else:
        path.mkdir()
    found = submission(path)
    assert found.student == student


def test_a_class_is_a_folder_of_zips_and_folders(tmp_path):
    for name in ("2.zip", "1.zip", ".DS_Store", "list.csv"):
        (tmp_path / name).write_bytes(b"")
    (tmp_path / "3").mkdir()
    (tmp_path / "__MACOSX").mkdir()
    assert [one.key for one in find(tmp_path, FILES)] == ["1.zip", "2.zip", "3"]
