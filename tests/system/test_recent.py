"""The last few objects are kept, and the one that was not asked for longest is forgotten."""

from taichi_tracer.system.recent import Recent


def test_the_last_ones_are_kept():
    made, recent = [], Recent(2)

    def ask(key):
        return recent.get(key, lambda: made.append(key) or f"for {key}")

    assert [ask(key) for key in "abab"] == ["for a", "for b"] * 2
    assert made == ["a", "b"]
    ask("a"), ask("c"), ask("a"), ask("b")  # b was forgotten for c
    assert made == ["a", "b", "c", "b"]
    assert "b" in recent
    assert "c" not in recent


def test_nothing_is_worth_keeping_too():
    made, recent = [], Recent(1)
    assert [recent.get(1, lambda: made.append(1)) for _ in range(2)] == [None, None]
    assert made == [1]
