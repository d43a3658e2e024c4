"""A kernel counts as new if it took longer than finding what was kept of it."""

from taichi_tracer.system.compiling import Kernel


def test_a_large_kernel_that_was_loaded_is_not_new():
    assert not Kernel("a large one, loaded", 0.0, reading=1.0, translating=0.1, processor=0.05).is_new
    assert Kernel("a small one, translated", 0.0, reading=0.1, translating=0.05, processor=0.05).is_new
