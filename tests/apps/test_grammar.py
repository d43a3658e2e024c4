"""Commands: each is a file, whose help answers at once; and folders of the package that are missing."""

import sys

from taichi_tracer.apps import commands
from taichi_tracer.apps.cli import main, make_parser

HELLO = '''"""Say hello."""


def add_arguments(parser):
    parser.add_argument("who")


def run(args):
    print("hello", args.who)
    return 7
'''


def choices(parser):
    """Name → parser of each command."""
    (kinds,) = (action for action in parser._actions if hasattr(action, "choices") and action.choices)
    return kinds.choices


def test_the_help_has_every_command_in_its_order():
    assert list(choices(make_parser())) == list(commands.ORDER) == commands.names()


def test_a_new_command_is_a_new_file(tmp_path, monkeypatch, capsys):
    (tmp_path / "hello.py").write_text(HELLO)
    monkeypatch.setattr(commands, "__path__", [*commands.__path__, str(tmp_path)])
    try:
        assert commands.help_of("hello") == "say hello"
        assert main(["hello", "you"]) == 7
    finally:
        sys.modules.pop(f"{commands.__name__}.hello", None)
    assert capsys.readouterr().out == "hello you\n"
