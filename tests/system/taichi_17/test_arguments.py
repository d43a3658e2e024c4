"""Fields as arguments of kernels: kernels do with them what they do with Taichi's own fields."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import taichi as ti
import taichi.math as tm
from support import long_except, needs_arrays, without_arrays
from taichi.lang.exception import TaichiIndexError

import taichi_tracer as tt
from taichi_tracer.system import cache, memory

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
def components_are_read_and_written(s: ti.template()):
    for i in range(ROWS):
        s.mixed[i].y = s.vectors[i].z + s.mixed[i][0]
        s.vectors[i][2] = s.mixed[i].z
        s.lanes[i][i + 3] = s.lanes[i][i]
        s.small[i, 2].x = ti.cast(s.mark[i], ti.u8)
        s.squares[i][2, 1] = s.mixed_matrices[i, 0][1, 2]
        for k in range(3):
            s.mixed[i][k] = k * s.mixed[i][2 - k]
        for r, c in ti.static(ti.ndrange(2, 3)):
            s.mixed_matrices[i, 1][r, c] = s.matrices[i, 2][r, 2 - c]
    s.single[None].x = 3


@ti.kernel
def colours_have_letters(s: ti.template()):
    s.mixed[1].r = 4
    s.vectors[1].g = s.mixed[1].b


@ti.kernel
def some_components_are_read_together(s: ti.template()):
    for i in range(ROWS):
        s.mixed[i] = s.mixed[i].zxy
        s.vectors[i] = s.mixed[i].xxz


@ti.kernel
def some_components_are_written_together(s: ti.template()):
    for i in range(ROWS):
        s.vectors[i].xy = s.vectors[i].yz
        s.mixed[i].xy = s.mixed[i].yz


@ti.kernel
def some_components_are_increased_together(s: ti.template()):
    for i in range(ROWS):
        s.mixed[i].xy += s.mixed[i].yz


@ti.kernel
def rows_and_columns_are_read(s: ti.template()):
    for i in range(ROWS):
        s.mixed[i] = s.squares[i][:, 1]
        s.vectors[i] = s.mixed_matrices[i, 1][0, :]


@ti.kernel
def a_vector_is_written_from_its_own_components(s: ti.template()):
    for i in range(ROWS):
        s.mixed[i] = tm.vec3(s.mixed[i].z, s.mixed[i].x, s.mixed[i].y)
        s.mixed[i] = s.squares[i] @ s.mixed[i]
        s.mixed[i] = s.mixed[i] / s.mixed[i].norm() + s.mixed[i].max()


@ti.kernel
def elements_are_exchanged(s: ti.template()):
    s.numbers[0], s.numbers[1] = s.numbers[1], s.numbers[0]
    s.vectors[0], s.vectors[1] = s.vectors[1], s.vectors[0]
    s.mixed[0], s.mixed[1] = s.mixed[1], s.mixed[0]
    s.mixed[2].x, s.mixed[2].z = s.mixed[2].z, s.mixed[2].x


@ti.kernel
def a_variable_keeps_what_was_read(s: ti.template()):
    for i in range(ROWS):
        v, x = s.mixed[i], s.mixed[i].x
        s.mixed[i] = tm.vec3(1, 2, 3)
        s.vectors[i] = v + x


@ti.kernel
def numbers_and_lists_are_assigned(s: ti.template()):
    for i in range(ROWS):
        s.mixed[i] = [1.0, 2.0, 3.0]
        s.vectors[i] = [i, 2.0, 3.0]
        s.squares[i] = 2.5
        s.mixed_matrices[i, 0] = 1.5
        s.mark[i] = s.mixed[i].y + 0.75
        s.small[i, 1] = s.vectors[i] * 2
    s.mixed[1] = 2.5


@ti.func
def changed(x: ti.template(), v):
    x += v


@ti.func
def without_second(x):
    x.y = 0
    return x + 1


@ti.kernel
def functions_get_values_and_places(s: ti.template()):
    for i in range(ROWS):
        s.vectors[i] = without_second(s.mixed[i])
        changed(s.mixed[i], tm.vec3(i, 2, 3))
        changed(s.vectors[i], tm.vec3(i, 2, 3))
        changed(s.numbers[i], 3)


@ti.kernel
def fields_are_read_in_branches_and_afterwards(s: ti.template()):
    for i in range(ROWS):
        if i > 2:
            s.mixed[i] += 1
        else:
            s.vectors[i] = s.mixed[i] if s.mark[i] > 10 else s.vectors[i]
        s.numbers[i] = s.mixed[i].x
    k = 0
    while s.numbers[k] > 0 and k < 4:
        s.numbers[k] = -s.numbers[k + 1]
        k += 1
    s.vectors[0] = s.mixed[0]


@ti.kernel
def threads_add_to_the_same_element(s: ti.template()):
    for _ in range(1000):
        s.number[None] += 1
        s.single[None] += tm.vec3(1, 2, 3)
        s.vectors[0] += tm.vec3(1, 2, 3)
        s.mixed[0] += tm.vec3(1, 2, 3)
        s.mixed[1] -= 2
        s.mixed[2].y += 1
        s.lanes[0] += 1
        s.squares[1] += 1
        s.mixed_matrices[1, 2] += 2
        s.mark[3] += 1


@ti.kernel
def operations_change_elements(s: ti.template()):
    s.mixed[0] *= 2
    s.mixed[1] *= tm.vec3(1, 2, 3)
    s.mixed[2] //= 3
    s.mixed[3] %= 3
    s.vectors[0] /= 2
    s.small[1, 1] += 2
    s.mark[1] |= 64
    s.mark[2] <<= 1


@ti.kernel
def a_number_that_changes_with_the_vector_is_read_for_each_component(s: ti.template()):
    s.vectors[1] -= s.vectors[1].x
    s.mixed[1] -= s.mixed[1].x


@ti.kernel
def atomic_functions_change_numbers(s: ti.template()):
    for i in range(1000):
        ti.atomic_add(s.number[None], 1)
        ti.atomic_add(s.mixed[1].z, 2)
        ti.atomic_max(s.count[None], i)
        ti.atomic_min(s.numbers[2], -i)


@ti.kernel
def atomic_functions_change_vectors(s: ti.template()):
    for _ in range(100):
        ti.atomic_add(s.vectors[0], tm.vec3(1, 2, 3))


@ti.kernel
def atomic_functions_tell_the_number_before(s: ti.template()):
    s.mark[0] = ti.atomic_add(s.count[None], 2)


@ti.kernel
def indices_are_vectors(s: ti.template()):
    for i in range(ROWS):
        s.table[ti.Vector([i, 1])] = 9
        s.table[ti.Vector([i, 2]) - ti.Vector([0, 2])] = 8
        s.mixed_matrices[ti.Vector([i, 1])] = 3
        s.numbers[ti.Vector([i])] += 1


@ti.kernel
def indices_are_of_any_kind_of_integers(s: ti.template()):
    for i in range(ROWS):
        long, byte = ti.cast(i, ti.i64), ti.cast(i, ti.u8)
        s.numbers[long] += 1
        s.mixed[byte] += 1
        s.table[long, byte % 3] = 5
        s.vectors[ti.cast(i, ti.u32)] = tm.vec3(i)


@ti.kernel
def loops_have_an_index_for_each_axis(s: ti.template()):
    for i in s.numbers:
        s.numbers[i] += 10 * i
    for i in s.mixed:
        s.mixed[i] += i
    for i, j in s.table:
        s.table[i, j] += 100 * i + j


@ti.kernel
def loops_have_one_vector_as_index(s: ti.template()):
    for i in ti.grouped(s.table):
        s.mixed_matrices[i] *= s.table[i]
        s.small[i] = ti.cast(i.sum(), ti.u8)
    for i in ti.grouped(s.numbers):
        s.numbers[i] = i[0]


@ti.kernel
def loops_over_structs_have_their_indices(s: ti.template()):
    for i in s.structs:
        s.structs[i].a += i
        s.structs[i].b *= 2


@ti.kernel
def loops_can_be_serial(s: ti.template()):
    ti.loop_config(serialize=True)
    for i in s.numbers:
        s.numbers[i] += s.numbers[ti.max(i - 1, 0)]


@ti.kernel
def loops_can_be_continued(s: ti.template()):
    for i in s.numbers:
        if i == 2:
            continue
        s.numbers[i] = 9


@ti.kernel
def structs_are_read_and_written(s: ti.template()):
    for i in range(ROWS):
        pair = s.structs[i]
        pair.a += 2
        s.structs[i] = pair
        s.structs[i].b.y = 3
        s.structs[i].b += s.structs[i].a
    s.structs[1] = Pair(4, tm.vec3(1, 2, 3))


KERNELS = [
    whole_elements_are_read_and_written,
    components_are_read_and_written,
    colours_have_letters,
    some_components_are_read_together,
    some_components_are_written_together,
    some_components_are_increased_together,
    rows_and_columns_are_read,
    a_vector_is_written_from_its_own_components,
    elements_are_exchanged,
    a_variable_keeps_what_was_read,
    numbers_and_lists_are_assigned,
    functions_get_values_and_places,
    fields_are_read_in_branches_and_afterwards,
    threads_add_to_the_same_element,
    operations_change_elements,
    a_number_that_changes_with_the_vector_is_read_for_each_component,
    atomic_functions_change_numbers,
    atomic_functions_change_vectors,
    atomic_functions_tell_the_number_before,
    indices_are_vectors,
    indices_are_of_any_kind_of_integers,
    loops_have_an_index_for_each_axis,
    loops_have_one_vector_as_index,
    loops_over_structs_have_their_indices,
    loops_can_be_serial,
    loops_can_be_continued,
    structs_are_read_and_written,
]


@pytest.mark.parametrize("kernel", long_except(KERNELS, *KERNELS[::4]), ids=lambda kernel: kernel.__name__)
def test_kernels_do_what_they_do_with_fields_of_taichi(kernel):
    with without_arrays():
        other = Store()
        kernel(other)
    store = Store()
    before = store.numbers_of_all()
    kernel(store)
    found = store.numbers_of_all()
    assert any((found[name] != before[name]).any() for name in found)
    for name, expected in other.numbers_of_all().items():
        np.testing.assert_array_equal(found[name], expected, name)


@ti.kernel
def add_in_inner_loops(s: ti.template()):
    for i in range(2):
        for j in s.numbers:
            s.mark[j] += i + 1
        for j, k in s.table:
            s.count[None] += 10 * j + k


def test_inner_loops_have_the_same_indices():
    """Which Taichi's own fields do not have."""
    store = Store()
    for field in (store.mark, store.count):
        field.fill(0)
    add_in_inner_loops(store)
    assert store.mark.to_numpy().tolist() == [3] * ROWS
    assert store.count[None] == 2 * (10 * COLUMNS * 10 + ROWS * 3)


@ti.kernel
def combined(s: ti.template(), factor: float, added: ti.types.ndarray(ndim=1)) -> tm.vec3:
    for i in s.numbers:
        s.numbers[i] = factor * s.mark[i] + added[i]
    return s.mixed[1] * factor


def test_a_kernel_has_its_own_arguments_and_a_value_as_well():
    store = Store()
    added = np.arange(ROWS, dtype=np.float32)
    for factor in (2, 3):
        found = combined(store, factor, added)
        assert found.to_list() == (factor * store.mixed.to_numpy()[1]).tolist()
        np.testing.assert_array_equal(store.numbers.to_numpy(), factor * store.mark.to_numpy() + added)


@ti.kernel
def ends_early(s: ti.template()):
    for i in s.numbers:
        if i == 2:
            break


@ti.kernel
def has_a_computed_real_index(s: ti.template()):
    s.numbers[s.number[None]] = 3


@ti.kernel
def has_a_real_index(s: ti.template()):
    s.numbers[1.5] = 3


@ti.kernel
def has_a_real_index_without_fraction(s: ti.template()):
    s.numbers[1.0] = 3


@ti.kernel
def has_too_few_indices(s: ti.template()):
    s.table[1] = 3


@ti.kernel
def has_too_many_indices(s: ti.template()):
    s.numbers[1, 2] = 3


@ti.kernel
def has_no_index(s: ti.template()):
    s.numbers[None] = 3


@ti.kernel
def has_an_index_for_no_axis(s: ti.template()):
    s.number[0] = 3


@ti.kernel
def has_too_few_variables(s: ti.template()):
    for i in s.table:
        s.table[i, 0] = 3


@ti.kernel
def asks_for_a_component_that_there_is_not(s: ti.template()) -> float:
    return s.mixed[1].w


@ti.kernel
def changes_a_mixed_vector_by_an_atomic_function(s: ti.template()):
    ti.atomic_add(s.mixed[0], tm.vec3(1, 2, 3))


@ti.kernel
def assigns_a_vector_that_is_too_long(s: ti.template()):
    s.mixed[1] = tm.vec4(1, 2, 3, 4)


WRONG = [
    (ends_early, ti.TaichiSyntaxError, "Cannot break in the outermost loop"),
    (has_a_computed_real_index, ti.TaichiTypeError, "indices must be integers.*f32"),
    (has_a_real_index, ti.TaichiTypeError, "indices must be integers.*(f32|1.5)"),
    (has_a_real_index_without_fraction, ti.TaichiTypeError, "indices must be integers.*(f32|1.0)"),
    (has_too_few_indices, TaichiIndexError, "Field with dim 2 accessed with indices of dim 1"),
    (has_too_many_indices, TaichiIndexError, "Field with dim 1 accessed with indices of dim 2"),
    (has_no_index, TaichiIndexError, "Field with dim 1 accessed with indices of dim 0"),
    (has_an_index_for_no_axis, TaichiIndexError, "Field with dim 0 accessed with indices of dim 1"),
    (has_too_few_variables, ti.TaichiCompilationError, ""),
    (asks_for_a_component_that_there_is_not, ti.TaichiSyntaxError, "vec3 only has attributes"),
    (assigns_a_vector_that_is_too_long, ti.TaichiTypeError, "cannot assign"),
]


def test_an_atomic_function_changes_a_mixed_vector_only_by_its_numbers():
    with pytest.raises(ti.TaichiSyntaxError, match="non-writable target"):
        changes_a_mixed_vector_by_an_atomic_function(Store())


@pytest.mark.parametrize("has_arrays", [True])
@pytest.mark.parametrize(("kernel", "error", "told"), WRONG, ids=[kernel.__name__ for kernel, _, _ in WRONG])
def test_a_mistake_in_a_kernel_is_told_as_taichi_tells_it(kernel, error, told, has_arrays):
    if has_arrays:
        with pytest.raises(error, match=told):
            kernel(Store())
    else:
        with without_arrays(), pytest.raises(error, match=told):
            kernel(Store())


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
    with pytest.raises(tt.StaleSceneError, match="was destroyed together with its owner"):
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
    environment = {**os.environ, cache.VARIABLE: str(place), "PYTHONPATH": str(Path(tt.__file__).parents[1])}
    kept = []
    for sizes in (["4x3x5"], ["7x9x600"], ["1x1x1", "30x20x3", "4x3x5"]):
        done = subprocess.run([sys.executable, program, *sizes], env=environment, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        kept.append(sorted(file.name for file in place.rglob("*.tic")))
    assert len(kept[0]) == 1
    assert kept[1] == kept[2] == kept[0]


def test_a_kernel_at_the_address_of_one_that_is_gone_has_none_of_its_arguments(monkeypatch):
    """Taichi's Python object of a kernel outlives it, and then stands for a new kernel at the same address."""
    from taichi_tracer.system.taichi_17 import arguments, shared

    class Kernel:
        pass

    kernel, launch = Kernel(), object()
    of_readings = [launch, None]
    monkeypatch.setattr(arguments.Reading, "kept", lambda self: of_readings.pop(0))
    create = arguments.reading(lambda program, build, name: kernel)
    create(None, None, "first")
    assert shared.arguments_of(kernel) is launch
    create(None, None, "second")
    assert shared.arguments_of(kernel) is None
