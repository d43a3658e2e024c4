"""A fixed few hostile inputs for every reader and for ``scene.intersect``; ``python -m tests.fuzz`` runs many more."""

import fuzz
import pytest

EXAMPLES = 60


pytestmark = pytest.mark.usefixtures("f32")


@pytest.mark.parametrize("name", fuzz.targets())
def test_a_reader_answers_or_refuses(name):
    fuzz.run(*fuzz.targets()[name], EXAMPLES, 0)


def test_a_scene_answers_or_refuses():
    fuzz.run(*fuzz.targets(fuzz.a_scene())["intersect"], EXAMPLES, 0)


@pytest.mark.parametrize("failure", [ValueError("not the user's to mend"), AssertionError("wrong"), RecursionError()])
def test_every_other_error_is_a_failure(failure):
    """The fuzzer itself must be able to fail."""
    with pytest.raises(type(failure)), fuzz.bounded():
        raise failure


def test_the_long_run_says_what_failed(capsys, monkeypatch):
    monkeypatch.setattr(fuzz, "targets", lambda scene: {"obj": (fuzz.st.integers(), lambda n: 1 // (n - n))})
    monkeypatch.setattr(fuzz, "a_scene", lambda: None)
    assert fuzz.main(["--minutes", "0.05"]) == 1
    assert "failed: ['obj']" in capsys.readouterr().out
