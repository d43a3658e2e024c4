"""Pages of HTML: their tables and scales."""

from taichi_tracer.files import page


def test_the_scale_of_a_map_says_what_white_is():
    assert page.scale_of_heat("35 %").endswith("<span>35 %</span></div>")


def test_a_table_can_be_sorted_and_its_words_are_no_html():
    whole = page.page("a < b", [page.table([{"name": "x & y"}], ["name", "n"])])
    assert "<td>x &amp; y</td><td></td>" in whole
    assert "<h1>a &lt; b</h1>" in whole
    assert whole.count("<script>") == 1
    assert "<script>" not in page.page("", [page.paragraph("class='sortable")])
