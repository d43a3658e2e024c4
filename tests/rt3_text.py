"""RT3 documents for tests: a whole one about a world, and how it is read."""

from taichi_tracer.rt3.document import read_rt3

HEAD = """<RT3>
<lookat look_from="0 7 0" look_at="0 0 0" up="0 0 1"/>
<camera type="orthographic" screen_window="-4 4 -3 3"/>
<film x_res="40" y_res="30"/>
"""


def document(world="", head=HEAD, tail=""):
    """A document whose world begins in line 6 with ``world``."""
    return f"{head}<world_begin/>\n{world}\n<world_end/>\n{tail}</RT3>\n"


def read(folder, text, name="scene.xml"):
    """Write a text to a file, and read it."""
    path = folder / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return read_rt3(path)
