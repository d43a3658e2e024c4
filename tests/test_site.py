"""The site has every page and every public name, is built without a warning, and asks no other host for anything."""

import re
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path

import browser
import pytest

import taichi_tracer as tt

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"


def test_every_page_is_in_the_contents():
    named = re.findall(r"^[\w/]+$", (DOCS / "index.md").read_text(encoding="utf-8"), re.MULTILINE)
    pages = {
        path.relative_to(DOCS).with_suffix("").as_posix()
        for path in DOCS.rglob("*")
        if path.suffix in (".md", ".ipynb")
    }
    assert sorted(named) == sorted(pages - {"index"})


def test_every_public_name_is_in_the_reference():
    text = (DOCS / "reference" / "python.md").read_text(encoding="utf-8")
    named = re.findall(r"^\.\. auto\w+:: (\w+)$", text, re.MULTILINE)
    assert sorted(named) == sorted(set(tt.__all__) - {"__version__"})


class Page(HTMLParser):
    """What a page loads, and the pictures that say nothing to who cannot see them."""

    def __init__(self):
        super().__init__()
        self.loads, self.silent = [], []

    def handle_starttag(self, tag, attributes):
        given = dict(attributes)
        if tag in ("script", "img", "iframe", "source") and "src" in given:
            self.loads.append(given["src"])
        if tag == "link" and given.get("rel") not in ("prev", "next", "index", "search", "canonical"):
            self.loads.append(given.get("href", ""))
        if tag == "img" and re.fullmatch(r"\s*|.*\.(png|svg)", given.get("alt", "")):
            self.silent.append(given.get("src"))


@pytest.mark.slow
def test_it_is_built_without_a_warning_and_loads_nothing_from_elsewhere(tmp_path):
    for module in ("furo", "myst_nb", "sphinx_copybutton", "latex2mathml"):
        pytest.importorskip(module)
    site = tmp_path / "site"
    words = [sys.executable, "-m", "sphinx", "-q", "-E", "-W", "--keep-going", "-j", "8", "-b", "html"]
    done = subprocess.run([*words, "-d", tmp_path / "trees", DOCS, site], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-3000:]
    pages = [path for path in site.rglob("*.html") if path.name not in ("search.html", "genindex.html")]
    assert len(pages) > 20
    assert len(list((site / "_images").glob("*.png"))) > 50
    first = (site / "notebooks" / "first_picture.html").read_text(encoding="utf-8")
    assert re.search(r'class="cell_output.*?<table', first, re.DOTALL)  # hits show themselves as a table
    for path in pages:
        page = Page()
        page.feed(path.read_text(encoding="utf-8"))
        assert [url for url in page.loads if re.match(r"(https?:)?//", url)] == [], path
        assert page.silent == [], path
    assert "<mi>&</mi>" not in (site / "handouts.html").read_text(encoding="utf-8")  # what the set formulas do not know
    text = (site / "reference" / "command_line.html").read_text(encoding="utf-8")
    assert "--lamp-choice" in text
    assert "throughput" in (site / "searchindex.js").read_text(encoding="utf-8")
    if browser.path_of_browser() is not None:
        with browser.started(tmp_path) as chromium:
            look_at(chromium, site)


FAINT = """(() => {
  const numbers = (c) => { const m = c.match(/[\\d.]+/g).map(Number); return m.length < 4 ? [...m, 1] : m; };
  const over = (a, b) => [0, 1, 2].map((i) => a[i] * a[3] + b[i] * (1 - a[3])).concat([1]);
  const linear = (v) => (v / 255 <= 0.03928 ? v / 255 / 12.92 : ((v / 255 + 0.055) / 1.055) ** 2.4);
  const light = (c) => 0.2126 * linear(c[0]) + 0.7152 * linear(c[1]) + 0.0722 * linear(c[2]);
  const behind = (e) => {
    const layers = [];
    for (; e; e = e.parentElement) layers.push(numbers(getComputedStyle(e).backgroundColor));
    return layers.reverse().reduce((below, layer) => over(layer, below), [255, 255, 255, 1]);
  };
  const found = [], walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (walker.nextNode()) {
    const e = walker.currentNode.parentElement, box = e.getBoundingClientRect();
    const text = walker.currentNode.data.trim();
    if (!text || box.width < 2 || e.closest("script, style, svg")) continue;
    const b = behind(e), c = over(numbers(getComputedStyle(e).color), b), two = [light(b), light(c)];
    if ((Math.max(...two) + 0.05) / (Math.min(...two) + 0.05) < 4.5) found.push(text.slice(0, 40));
  }
  return found;
})()"""


def look_at(chromium, site):
    """Every text has a contrast of 4.5, and nothing is wider than the screen, on a desk and on a phone."""
    for page in ("index", "notebooks/lamps", "accuracy", "gallery", "reference/command_line"):
        for width, scheme in ((1280, "light"), (390, "dark")):
            chromium.open((site / f"{page}.html").as_uri(), width, 900, scheme)
            assert chromium.evaluate(FAINT) == [], page
            assert chromium.evaluate("document.documentElement.scrollWidth") <= width, page
    assert [url for url in chromium.requests if not url.startswith("file:")] == []
