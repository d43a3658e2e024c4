"""What the site has beside the pages: commands and options from their parser, and links that lead out of the folder."""

import argparse
import re
from pathlib import Path

from docutils import nodes
from docutils.parsers.rst import Directive
from sphinx.application import Sphinx

from taichi_tracer.apps.cli import make_parser


class CommandLine(Directive):
    """Every command: what it does, how it is used, and a table of its options."""

    def run(self) -> list[nodes.Node]:
        """A section for each command."""
        parser = make_parser()
        commands = next(a for a in parser._actions if isinstance(a, argparse._SubParsersAction))
        return [section_of(name, command) for name, command in commands.choices.items()]


def section_of(name: str, parser: argparse.ArgumentParser) -> nodes.section:
    """A command with its own commands, if it has some."""
    section = nodes.section(ids=[nodes.make_id(f"command-{name}")])
    section += nodes.title(text=name)
    section += nodes.paragraph(text=parser.description or "")
    below = next((a for a in parser._actions if isinstance(a, argparse._SubParsersAction)), None)
    if below is not None:
        section += [section_of(f"{name} {own}", command) for own, command in below.choices.items()]
        return section
    rows = [row_of(parser, action) for action in parser._actions if action.help != argparse.SUPPRESS]
    section += table_of(rows)
    return section


def row_of(parser: argparse.ArgumentParser, action: argparse.Action) -> tuple[str, str]:
    """(the words of an option or an argument, what it does)."""
    formatter = parser._get_formatter()
    words = formatter._format_action_invocation(action)
    return words, formatter._expand_help(action) if action.help else ""


def table_of(rows: list[tuple[str, str]]) -> nodes.table:
    """A table of two columns: words and their meaning."""
    table = nodes.table(classes=["options"])
    group = nodes.tgroup(cols=2)
    table += group
    group += [nodes.colspec(colwidth=width) for width in (3, 7)]
    body = nodes.tbody()
    for words, what in rows:
        row = nodes.row()
        for cell in (nodes.literal(text=words), nodes.inline(text=what)):
            row += nodes.entry("", nodes.paragraph("", "", cell))
        body += row
    group += body
    return table


ANCHOR = re.compile(r'^<a id="([^"]+)"></a>', re.MULTILINE)
OPTIONS = re.compile(r"The options of a \w+.*\.")  # the line in a docstring after which ``with_options`` explains them
OUTSIDE = re.compile(
    r"\[([^\]]+)\]\((?:\.\./)*((?:benchmarks|scene_data_dir|taichi_tracer|LICENSE|CHANGELOG|CONTRIBUTING)[\w/.]*)\)"
)
INSIDE = re.compile(r"\]\(docs/([\w/.#-]+)")  # a link from outside into this folder
TO_A_PLACE = re.compile(r"\]\(([\w./]*\.md)#([^)]+)\)")
# Pages of the site that are files outside of this folder: their place from its top → the name of the page.
PAGES = {
    "README.md": "index",
    "CHANGELOG.md": "changes",
    "CONTRIBUTING.md": "contributing",
    "benchmarks/RESULTS.md": "reference/results",
    "scene_data_dir/README.md": "scenes",
}
TOP = Path(__file__).parent.parent


def read_page(app: Sphinx, name: str, source: list[str]) -> None:
    """Let places that links lead to, and links out of the folder, be those of the site; GitHub shows them as they are.

    A page may consist of a file outside of the folder: then the first line is its name.
    """

    def link(found: re.Match) -> str:
        text, path = found.groups()
        if path in PAGES:
            return f"[{text}](/{PAGES[path]}.md)"
        return text if "`" in text or not path.endswith(".py") else f"`{path}`"

    first, _, rest = source[0].partition("\n")
    if first in PAGES:
        app.env.note_dependency(str(TOP / first))
        source[0] = INSIDE.sub(r"](\1", (TOP / first).read_text(encoding="utf-8")) + rest
    text = OUTSIDE.sub(link, ANCHOR.sub(r"(\1)=\n", source[0]))
    source[0] = TO_A_PLACE.sub(lambda found: f"]({found[1]}#{found[2].lower()})", text)  # Sphinx writes places small


def read_docstring(app: Sphinx, what: str, name: str, of: object, options: object, lines: list[str]) -> None:
    """Let options stand in a list, as arguments do; and a bar be the sign of a length, not that of a substitution."""
    begin = next((k for k, line in enumerate(lines) if OPTIONS.fullmatch(line)), len(lines))
    lines[begin:] = ["Keyword Args:", *("    " + line for line in lines[begin + 2 :])] if begin < len(lines) else []
    lines[:] = [line.replace("|", "\\|") for line in lines]


def setup(app: Sphinx) -> dict[str, bool]:
    """Give the directive to Sphinx."""
    app.add_directive("command-line", CommandLine)
    app.connect("source-read", read_page)
    app.connect("autodoc-process-docstring", read_docstring, priority=100)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
