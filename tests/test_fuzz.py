"""A fixed few hostile inputs for every reader and for ``scene.intersect``; ``python -m tests.fuzz`` runs many more."""

import fuzz
import pytest

EXAMPLES = 30


pytestmark = pytest.mark.usefixtures("f32")


@pytest.mark.parametrize("name", fuzz.targets())
def test_a_reader_answers_or_refuses(name):
    fuzz.run(*fuzz.targets()[name], EXAMPLES, 0)


def test_a_scene_answers_or_refuses():
    fuzz.run(*fuzz.targets(fuzz.a_scene())["intersect"], EXAMPLES, 0)
