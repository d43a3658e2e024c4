"""What a report says of files that go round the rules."""

import pytest

from taichi_tracer.teaching.roundabout import check_imports

FILES = ("camera.py",)


@pytest.mark.parametrize(
    ("code", "told"),
    [
        ("import numpy as np, math", []),
        ("from renderer import A1Renderer", []),
        ("import scipy.special", ["camera.py imports 'scipy.special'"]),
        ("def f():\n    from os import system", ["camera.py imports 'os'"]),
        ("eval('1')", ["camera.py: it uses eval"]),
        ("from taichi_tracer.teaching.assignments.a1 import x", None),
        ("import taichi_tracer as tt\nf = tt.Camera.generate_ray", ["camera.py: it uses the package's own"]),
        ("class Camera:\n    def f(self): return super().generate_ray(1)", ["camera.py: it uses the package's own"]),
        ("class Camera:\n    def f(self): return self.generate_ray(1)", []),
        ("from taichi_tracer.teaching import catalogue, running", ["camera.py imports 'taichi_tracer.teaching."] * 2),
        ("from taichi_tracer.teaching import not_written", []),
        ("import taichi_tracer as tt\ntt.Camera.f = len", ["camera.py: it changes tt.Camera.f"]),
        ("import numpy as np\nnp.allclose = lambda a, b: True", ["camera.py: it changes np.allclose"]),
        ("import taichi_tracer as tt\nsetattr(tt.Camera, 'f', 1)", ["camera.py: it changes tt.Camera"]),
        ("class Camera:\n    def f(self): self.eye.x = 1; self.table[3] = 2", []),
        ("open('x')", ["camera.py: it opens a file: open('x')"]),
        ("import numpy as np\nx = np.load('x.npy')", ["camera.py: it opens a file: np.load"]),
        ("class Camera:\n    def f(self): return self.load(1)", []),
        ("(1).__class__.__mro__", ["camera.py: it uses __mro__"]),
        ("def (", []),
        ("x = 1 # \udcff", []),
    ],
)
def test_the_rule_of_imports(code, told, tmp_path):
    for folder in ("student", "solution"):
        (tmp_path / folder).mkdir()
    (tmp_path / "student" / "camera.py").write_bytes(code.encode(errors="surrogateescape"))
    (tmp_path / "student" / "renderer.py").write_text("")
    (tmp_path / "solution" / "camera.py").write_text("import math")
    found = check_imports(tmp_path / "student", tmp_path / "solution", FILES, {"Camera": {"generate_ray"}})
    if told is None:
        assert len(found) == 1
    else:
        assert len(found) == len(told)
        assert all(a.startswith(b) for a, b in zip(found, told, strict=True))
