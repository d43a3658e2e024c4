"""The files that come with the package: found inside an installed package, or beside it in a checkout."""

from taichi_tracer.files import disk


def test_scenes_and_environments_are_there():
    folder = disk.scene_data_dir()
    assert (folder / "cornell_box.obj").is_file()
    assert {"studio", "sunny", "white", "black"} <= set(disk.shipped_environments())
    assert all(path.suffix == ".npy" and path.is_file() for path in disk.shipped_environments().values())
    assert list(disk.shipped_environments()) == sorted(disk.shipped_environments())


def test_a_folder_inside_the_package_comes_first(tmp_path, monkeypatch):
    package = tmp_path / "taichi_tracer"
    (package / "files").mkdir(parents=True)
    (tmp_path / "scene_data_dir").mkdir()
    monkeypatch.setattr(disk, "__file__", str(package / "files" / "disk.py"))
    assert disk.scene_data_dir() == tmp_path / "scene_data_dir"
    (package / "scene_data_dir").mkdir()
    assert disk.scene_data_dir() == package / "scene_data_dir"
