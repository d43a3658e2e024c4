"""The doctor: every line says whether it is well, and what would mend it if not."""

from taichi_tracer.apps.cli import main
from taichi_tracer.apps.commands import doctor


def test_the_doctor_finds_nothing_to_fail_on(capsys):
    assert main(["doctor"]) == 0
    lines = capsys.readouterr().out.splitlines()
    facts = [line for line in lines if not line.lstrip().startswith("->")]
    assert all(line.endswith((" ok", " missing")) for line in facts)
    for name in ("Python", "taichi", "numpy", "trimesh", "backend chosen", "window", "kernel cache"):
        assert any(line.startswith(name) for line in facts)
    for above, below in zip(lines, [*lines[1:], ""], strict=True):
        if above.endswith(" missing"):
            assert below.lstrip().startswith("-> ")


def test_what_is_missing_is_shown_with_its_remedy(monkeypatch):
    monkeypatch.setattr(doctor.importlib.util, "find_spec", lambda name: None)
    monkeypatch.setattr(doctor, "missing_for_window", lambda: ("no screen", "plug one in"))
    remedies = {name: remedy for name, _, is_ok, remedy in doctor.examine() if not is_ok}
    assert "taichi_tracer[notebook]" in remedies["ipykernel"]
    assert "taichi_tracer[exr]" in remedies["OpenImageIO"]
    assert remedies["window"] == "plug one in"
