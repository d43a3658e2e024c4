"""The table of options: its words make values, its values make the same words again, and its names are checked."""

import pytest

from taichi_tracer.apps.cli import make_parser
from taichi_tracer.settings import OPTIONS, RenderSettings, flag_of

WORDS = {"up_axis": "z", "brdfs": "phong,diffuse", "lights": "point", "smooth": "40", "bounces": "0,1-3"}


def words_for(name):
    """Words that differ from the default."""
    option, flag = OPTIONS[name], flag_of(name)
    if not option.metavar:
        return [flag]
    if isinstance(option.metavar, tuple):
        return [flag, *["0.25", "0.5", "0.75", "0.875"][: len(option.metavar)]]
    number = "2" if option.read is not str else "some_name"
    return [flag, WORDS.get(name, number)]


@pytest.mark.parametrize("name", sorted(OPTIONS))
def test_the_value_of_an_option_makes_its_words_again(name):
    words = words_for(name)
    args = make_parser().parse_args(["render", "cube", *words])
    again = RenderSettings.of(args).words()
    assert again == ([words[0], "2x2"] if name == "size" else words)


@pytest.mark.parametrize("words", ["--max-bounces 3", "--mis-plight 1", "--map-of brdf", "--max-distance 3"])
def test_an_option_that_changes_nothing_is_told(words, capsys):
    from taichi_tracer.apps.commands.render import note_unused
    from taichi_tracer.apps.pictures import request_of

    args = make_parser().parse_args(["render", "cube", "--view", "normal", *words.split()])
    note_unused(request_of(RenderSettings.of(args)))
    assert f"{words} changes nothing here: it belongs to" in capsys.readouterr().err


# What need not say its default: the scene's own, or nothing; the description of its group says so.
