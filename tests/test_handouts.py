"""Codes such as A1-11 lead somewhere: each is a row of docs/handouts.md. So does every link of the documents."""

import ast
import io
import re
import tokenize
from collections import Counter
from collections.abc import Iterator
from itertools import groupby
from pathlib import Path
from urllib.parse import unquote

import pytest

ROOT = Path(__file__).parents[1]
HANDOUTS = ROOT / "docs" / "handouts.md"
DOCUMENTS = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
MODULES = sorted((ROOT / "taichi_tracer").rglob("*.py"))
SERIES = {"A1": 17, "A2": 13, "A3": 6, "A4": 5, "RT": 12, "C": 20, "T": 5}  # how many rows each has

CODE = re.compile(r"(?<![\w-])(A\d|RT|C|T)-(\d+)(?![\w-]|\.\d)")
RANGE = re.compile(rf"({CODE.pattern})\s*(?:…|\.\.\.|–|—|to)\s*({CODE.pattern})")
ANCHOR = re.compile(r"""<a\s+(?:id|name)=["']([^"']+)["']""")
LINK = re.compile(r"""\]\(\s*<?([^)\s>]+)|^\s*\[[^\]]+\]:\s*(\S+)|(?:src|href)=["']([^"']+)["']""", re.MULTILINE)


def codes_in(text: str) -> set[str]:
    """The codes that a text names, also those between the two ends of a range such as "A1-3 … A1-9".

    A range between two series, or from a larger number to a smaller one, has no members: then only its ends count.
    """
    codes = {match.group() for match in CODE.finditer(text)}
    for match in RANGE.finditer(text):
        _, first_series, first, _, last_series, last = match.groups()
        if first_series == last_series:
            codes |= {f"{first_series}-{number}" for number in range(int(first), int(last) + 1)}
    return codes


def missing_codes(text: str, known: set[str]) -> list[str]:
    """The codes of a text that are not known."""
    return sorted(codes_in(text) - known)


def remarks_of(source: str) -> Iterator[tuple[int, str]]:
    """(line, text) of the docstrings and the comments of a Python file; comments on consecutive lines are one text."""
    for node in ast.walk(ast.parse(source)):
        values = [node.value] if isinstance(node, ast.Expr) else []
        if isinstance(node, ast.Call):  # property(..., doc="...")
            values = [keyword.value for keyword in node.keywords if keyword.arg == "doc"]
        for value in values:
            if isinstance(value, ast.Constant) and isinstance(value.value, str):
                yield value.lineno, value.value
    tokens = tokenize.generate_tokens(io.StringIO(source).readline)
    found = [token for token in tokens if token.type == tokenize.COMMENT]
    comments = [(token.start[0], token.string.lstrip("#").strip()) for token in found]
    for _, group in groupby(enumerate(comments), key=lambda item: item[1][0] - item[0]):
        block = [comment for _, comment in group]
        yield block[0][0], "\n".join(text for _, text in block)


def anchors_of(markdown: str) -> list[str]:
    """Every fragment that a link to a document may have: explicit anchors, and headings as GitHub names them."""
    text = without_code_blocks(markdown)
    seen: Counter[str] = Counter()
    slugs = []
    for heading in re.findall(r"^#{1,6}\s+(.*?)\s*#*$", text, re.MULTILINE):
        slug = re.sub(r"[^\w\- ]", "", ANCHOR.sub("", heading).lower()).replace(" ", "-")
        slugs.append(f"{slug}-{seen[slug]}" if seen[slug] else slug)
        seen[slug] += 1
    return ANCHOR.findall(text) + slugs


def without_code_blocks(markdown: str) -> str:
    """The text without what stands between ``` and ```."""
    return re.sub(r"^```.*?^```", "", markdown, flags=re.MULTILINE | re.DOTALL)


def links_of(markdown: str) -> list[str]:
    """The targets of links and pictures that lie within the repository; not what looks like a link within code."""
    text = re.sub(r"`[^`\n]*`", "", without_code_blocks(markdown))
    targets = [next(group for group in match.groups() if group) for match in LINK.finditer(text)]
    return [unquote(target) for target in targets if not re.match(r"[a-z][a-z0-9+.-]*:", target, re.IGNORECASE)]


def broken_links(document: Path) -> list[str]:
    """The links of a document to a file that does not exist, or to a place that the file does not have."""
    broken = []
    for link in links_of(document.read_text(encoding="utf-8")):
        name, _, fragment = link.partition("#")
        target = document.parent / name if name else document
        if not target.exists() or not has_place(target, fragment):
            broken.append(link)
    return broken


def has_place(target: Path, fragment: str) -> bool:
    """Whether a file has the place that a fragment names; only of Markdown files is that known."""
    return fragment == "" or target.suffix != ".md" or fragment in anchors_of(target.read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def rows() -> list[str]:
    """The codes that docs/handouts.md has rows for, in its order."""
    return [anchor for anchor in ANCHOR.findall(HANDOUTS.read_text(encoding="utf-8")) if CODE.fullmatch(anchor)]


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_the_documents_name_only_rows_that_exist(document, rows):
    assert missing_codes(document.read_text(encoding="utf-8"), set(rows)) == []


def test_every_series_is_numbered_from_one_without_a_gap(rows):
    series = {name: sorted(int(row.split("-")[1]) for row in rows if row.startswith(f"{name}-")) for name in SERIES}
    assert series == {name: list(range(1, count + 1)) for name, count in SERIES.items()}


def test_an_anchor_stands_before_its_own_code():
    text = HANDOUTS.read_text(encoding="utf-8")
    titles = re.findall(r'^<a id="([^"]+)"></a>\*\*([^ ]+)\. ', text, re.MULTILINE)
    assert [anchor for anchor, title in titles if anchor != title] == []
    assert len(titles) == sum(SERIES.values())


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_anchors_are_unique(document):
    counts = Counter(anchors_of(document.read_text(encoding="utf-8")))
    assert [anchor for anchor, count in counts.items() if count > 1] == []


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_links_lead_to_a_file_and_to_a_place_in_it(document):
    assert broken_links(document) == []


@pytest.mark.parametrize(
    ("text", "codes"),
    [
        ("by Cramer's rule (A1-11).", {"A1-11"}),
        ("A1-17, C-16 and RT-5; T-2.", {"A1-17", "C-16", "RT-5", "T-2"}),
        ("docs/handouts.md#A2-3", {"A2-3"}),
        ("A4-1 … A4-3", {"A4-1", "A4-2", "A4-3"}),
        ("(A1-3 to\nA1-5)", {"A1-3", "A1-4", "A1-5"}),
        ("RT-8–RT-9", {"RT-8", "RT-9"}),
        ("A1-3 … RT-1", {"A1-3", "RT-1"}),
        ("RT3, a T-shirt, C-3PO, UTC-5, GPT-4, RTX-3090, C-1.5 and A1-1-1", set()),
    ],
)
def test_what_a_code_is(text, codes):
    assert codes_in(text) == codes


def test_a_code_without_a_row_is_found(rows):
    assert missing_codes("t > 0 (A1-11, A1-99)", set(rows)) == ["A1-99"]
    assert missing_codes("A1-16 … A1-19", set(rows)) == ["A1-18", "A1-19"]


def test_codes_are_found_in_docstrings_and_comments_alone():
    source = '''
"""A1-1"""
class K:
    """A1-2"""
    x = 1  # A1-3
    """A1-4"""
    p = property(f, doc="A1-5")
    def f(self):
        # from A1-6 …
        # A1-8
        return "A1-9", A1-10
'''
    found = {line: codes_in(text) for line, text in remarks_of(source)}
    expected = {2: {"A1-1"}, 4: {"A1-2"}, 5: {"A1-3"}, 6: {"A1-4"}, 7: {"A1-5"}, 9: {"A1-6", "A1-7", "A1-8"}}
    assert found == expected


def test_a_broken_link_is_found(tmp_path):
    (tmp_path / "b.md").write_text("# Two words: here\n\n# Two words, here\n", encoding="utf-8")
    text = '# Top\n<a id="C-1"></a>\n'
    text += "[1](b.md) [2](b.md#two-words-here) [3](b.md#two-words-here-1) [4](#C-1) [5](#top)\n"
    text += '[6](b.md#three) [7](c.md) [8](#C-2) ![9](d.png) <img src="e.png"> `[10](f.md)` [11](https://x.org/#y)\n'
    text += "```\n# [12](g.md)\n```\n"
    (tmp_path / "a.md").write_text(text, encoding="utf-8")
    assert broken_links(tmp_path / "a.md") == ["b.md#three", "c.md", "#C-2", "d.png", "e.png"]
