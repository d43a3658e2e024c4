"""Fields as arguments of kernels: kernels do with them what they do with Taichi's own fields."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import taichi as ti
import taichi.math as tm
from support import needs_arrays, without_arrays

import taichi_tracer as tt
from taichi_tracer.system import memory, runtime

ROWS, COLUMNS = 5, 3


@ti.dataclass
class Pair:
    """A struct with a number and a vector."""

    a: ti.i32
    b: tm.vec3


@pytest.fixture(autouse=True)
def in_f32(f32):
    """Taichi with fields in numpy's memory."""
    needs_arrays()


@ti.data_oriented
class Store:
    """Fields with numbers at random; "mixed" ones are in cells whose size is no multiple of that of the vector."""

    def __init__(self):
        self.memory = memory.Memory()
        fields = {
            "number": ti.field(float),
            "count": ti.field(ti.i32),
            "single": ti.Vector.field(3, float),
            "numbers": ti.field(float),
            "vectors": ti.Vector.field(3, float),
            "lanes": ti.Vector.field(16, float),
            "mark": ti.field(ti.i32),
            "mixed": ti.Vector.field(3, float),
            "table": ti.field(float),
            "small": ti.Vector.field(3, ti.u8),
            "matrices": ti.Matrix.field(2, 3, float),
            "mixed_matrices": ti.Matrix.field(2, 3, float),
            "flags": ti.field(ti.i32),
            "squares": ti.Matrix.field(3, 3, float),
        }
        self.structs = Pair.field()
        root = self.memory.fields
        root.place(fields["number"], fields["count"], fields["single"])
        for names in (["numbers"], ["vectors"], ["lanes"], ["mark", "mixed"], ["squares"]):
            root.dense(ti.i, ROWS).place(*(fields[name] for name in names))
        for names in (["table"], ["small"], ["matrices"], ["mixed_matrices", "flags"]):
            root.dense(ti.ij, (ROWS, COLUMNS)).place(*(fields[name] for name in names))
        root.dense(ti.i, ROWS).place(self.structs)
        self.memory.allocate()
        vars(self).update(fields)
        self.fields = fields | {f"structs.{name}": self.structs.get_member_field(name) for name in ("a", "b")}
        rng = np.random.default_rng(3)
        for field in self.fields.values():
            field.from_numpy(rng.integers(1, 40, field.to_numpy().shape).astype(field.to_numpy().dtype))

    def numbers_of_all(self):
        """Name of each field → its numbers."""
        return {name: field.to_numpy() for name, field in self.fields.items()}


@ti.kernel
def whole_elements_are_read_and_written(s: ti.template()):
    for i in range(ROWS):
        s.numbers[i] = 2 * s.mark[i] + s.number[None]
        s.mixed[i] = tm.cross(s.mixed[i], s.vectors[i]) + s.single[None]
        s.vectors[i] = ti.select(s.mixed[i] > 5, s.mixed[i], -s.vectors[i])
        s.lanes[i] = s.lanes[i] * s.lanes[0]
        s.squares[i] = s.squares[i] @ s.squares[i].transpose()
        s.mixed_matrices[i, 1] = s.matrices[i, 2] * 2 + s.mixed_matrices[i, 0]
        s.matrices[i, 0] = s.mixed_matrices[i, 2]
    s.single[None] = s.vectors[4]
    s.number[None] = s.mixed[2].norm()


@ti.kernel
def elements_are_exchanged(s: ti.template()):
    s.numbers[0], s.numbers[1] = s.numbers[1], s.numbers[0]
    s.vectors[0], s.vectors[1] = s.vectors[1], s.vectors[0]
    s.mixed[0], s.mixed[1] = s.mixed[1], s.mixed[0]
    s.mixed[2].x, s.mixed[2].z = s.mixed[2].z, s.mixed[2].x


@ti.kernel
def atomic_functions_change_numbers(s: ti.template()):
    for i in range(1000):
        ti.atomic_add(s.number[None], 1)
        ti.atomic_add(s.mixed[1].z, 2)
        ti.atomic_max(s.count[None], i)
        ti.atomic_min(s.numbers[2], -i)


@ti.kernel
def loops_can_be_serial(s: ti.template()):
    ti.loop_config(serialize=True)
    for i in s.numbers:
        s.numbers[i] += s.numbers[ti.max(i - 1, 0)]


KERNELS = [
    whole_elements_are_read_and_written,
    elements_are_exchanged,
    atomic_functions_change_numbers,
    loops_can_be_serial,
]


@pytest.fixture(scope="module")
def stores(f32):
    """Two stores with the same numbers: one in Taichi's own fields, one in numpy's memory."""
    with without_arrays():
        other = Store()
    return other, Store()


@pytest.mark.parametrize("kernel", KERNELS, ids=lambda kernel: kernel.__name__)
def test_kernels_do_what_they_do_with_fields_of_taichi(kernel, stores):
    other, store = stores
    with without_arrays():
        kernel(other)
    before = store.numbers_of_all()
    kernel(store)
    found = store.numbers_of_all()
    assert any((found[name] != before[name]).any() for name in found)
    for name, expected in other.numbers_of_all().items():
        np.testing.assert_array_equal(found[name], expected, name)


@ti.kernel
def double(field: ti.template()):
    for i in field:
        field[i] *= 2


def one_field(*counts):
    """(memory, a field of integers in it)."""
    owner, field = memory.Memory(), ti.field(ti.i32)
    owner.fields.dense((ti.i, ti.ij)[len(counts) - 1], counts).place(field)
    owner.allocate()
    return owner, field


def test_a_kernel_is_not_started_with_memory_that_was_freed():
    owner, field = one_field(4)
    _, other = one_field(6)
    for one in (field, other):
        one.fill(1)
        double(one)
    owner.free()
    with pytest.raises(Exception, match="was destroyed together with its owner"):
        double(field)
    double(other)
    assert other.to_numpy().tolist() == [4] * 6


@ti.kernel
def last(field: ti.template()) -> ti.i32:
    return field[field.shape[0] - 1, field.shape[1] - 1]


def test_a_kernel_that_asks_for_shapes_gets_those_of_its_field():
    for rows, columns in ((3, 4), (5, 7), (2, 2), (3, 4)):
        _, field = one_field(rows, columns)
        field.from_numpy(np.arange(rows * columns).reshape(rows, columns))
        assert last(field) == rows * columns - 1


PROGRAM = """
import sys
import numpy as np
import taichi as ti
import taichi_tracer as tt
from taichi_tracer.system import memory

@ti.data_oriented
class Picture:
    def __init__(self, width, height, length):
        self.memory = memory.Memory()
        self.pixels, self.weights = ti.Vector.field(3, float), ti.field(float)
        self.marks, self.normals = ti.field(ti.i32), ti.Vector.field(3, float)
        self.memory.fields.dense(ti.ij, (width, height)).place(self.pixels, self.weights)
        self.memory.fields.dense(ti.i, length).place(self.marks, self.normals)
        self.memory.allocate()

    @ti.kernel
    def fill(self):
        for x, y in self.pixels:
            self.pixels[x, y] = ti.Vector([x, y, 1.0])
            self.weights[x, y] += 10 * x + y
        for i in self.normals:
            self.normals[i] = i
            self.marks[i] = i

tt.init("cpu")
for size in sys.argv[1:]:
    width, height, length = map(int, size.split("x"))
    picture = Picture(width, height, length)
    picture.fill()
    x, y = np.indices((width, height))
    np.testing.assert_array_equal(picture.weights.to_numpy(), 10 * x + y)
    np.testing.assert_array_equal(picture.pixels.to_numpy(), np.stack([x, y, np.ones_like(x)], -1))
    np.testing.assert_array_equal(picture.marks.to_numpy(), np.arange(length))
    np.testing.assert_array_equal(picture.normals.to_numpy(), np.arange(length)[:, None] + np.zeros(3))
"""


def test_one_kernel_serves_every_size(tmp_path):
    """In one process and across processes: Taichi keeps nothing new for another size."""
    place, program = tmp_path / "kernels", tmp_path / "program.py"
    program.write_text(PROGRAM)  # a kernel is read from its file
    environment = {**os.environ, runtime.VARIABLE: str(place), "PYTHONPATH": str(Path(tt.__file__).parents[1])}
    kept = []
    for sizes in (["4x3x5"], ["7x9x600"], ["1x1x1", "30x20x3", "4x3x5"]):
        done = subprocess.run([sys.executable, program, *sizes], env=environment, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        kept.append(sorted(file.name for file in place.rglob("*.tic")))
    assert len(kept[0]) == 1
    assert kept[1] == kept[2] == kept[0]
