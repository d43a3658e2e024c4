"""Pages of HTML: their tables and scales."""

import browser

from taichi_tracer.files import page


def test_the_scale_of_a_map_says_what_white_is():
    assert page.scale_of_heat("35 %").endswith("<span>35 %</span></div>")


def test_a_table_can_be_sorted_and_its_words_are_no_html():
    whole = page.page("a < b", [page.table([{"name": "x & y"}], ["name", "n"])])
    assert "<td data-head='name'>x &amp; y</td><td data-head='n'></td>" in whole
    assert "<h1>a &lt; b</h1>" in whole
    assert whole.count("<script>") == 1
    assert "<script>" not in page.page("", [page.paragraph("class='sortable")])


def test_nothing_is_cut_on_a_telephone(tmp_path):
    """A wide table, bars with long names, and words without a gap, on 390 pixels; skipped without a browser."""
    long = "a_name_without_any_gap_" * 4
    table = page.table([dict.fromkeys("abcdefghij", "1,234,567"), {"a": long}], list("abcdefghij"))
    whole = page.page(
        long, [table, page.bars([(long, 1.0, "1,234,567"), ("b", 0.5, "2")], "red"), page.paragraph(long)]
    )
    (tmp_path / "page.html").write_text(whole, encoding="utf-8")
    with browser.started(tmp_path) as shown:
        for scheme in ("light", "dark"):
            shown.open((tmp_path / "page.html").as_uri(), width=390, scheme=scheme)
            assert shown.evaluate(browser.CUT) == []
