"""``check-part`` says the first wrong number of a part."""

import pytest

from taichi_tracer.apps.cli import main
from taichi_tracer.apps.commands.new_part import text_of

# Kind → what is changed in a part that is right, and what must be told.
WRONG = {
    "brdf": (("ti.max(0.0, tm.dot(n, w_i)) / tm.pi", "1 / tm.pi"), "the integral of pdf is 4.0"),
    "light": (("distance**2, 1.0", "distance**2, 2.0"), "sample of a delta light returns a pdf of 2.0, not 1"),
    "sampler": (("as_fraction(b)", "as_fraction(a)"), "two pixels or samples have the same pair"),
    "camera": (("ti.cos(theta), 0)", "-ti.cos(theta), 0)"), "the central ray leads away from at"),
    "triangle_test": (("det = -tm", "det = tm"), "t is -2.7"),
    "intersector": (("tm.vec2(u, v)", "tm.vec2(v, u)"), "barycentric_coords is ["),
    "tone": (("self.white**2", "self.white"), "white, 4, becomes 1.6"),
}


@pytest.fixture
def check(tmp_path, monkeypatch, capsys):
    """``check(text, words)``: the exit code, what is printed, and the errors."""
    monkeypatch.chdir(tmp_path)

    def checked(text, *words):
        (tmp_path / "parts.py").write_text(text)
        code = main(["check-part", "parts.py", *words])
        return code, *capsys.readouterr()

    return checked


@pytest.mark.parametrize("kind", WRONG)
def test_the_first_wrong_number_is_told(kind, check):
    (right, wrong), told = WRONG[kind]
    text = text_of(kind, f"wrong_{kind}")
    assert text.count(right) >= 1
    code, out, _ = check(text.replace(right, wrong, 1))
    assert code == 1
    (line,) = [line for line in out.splitlines() if "WRONG" in line]
    assert told in line


def test_a_mistake_of_the_language_is_one_line(check):
    code, _, error = check(text_of("brdf", "faulty").replace("return material.Kd", "return material.kd"))
    assert code == 2
    assert "no member 'kd': did you mean 'Kd'?" in error
    assert error.count("\n") == 1
    code, _, error = check(text_of("brdf", "faulty").replace("return material.Ns <= 1", "return material.N <= 1"))
    assert code == 2
    assert "parts.py:21: AttributeError" in error
