"""What a submission's process gets: the solution of the parts that were asked for before, and of no other one."""

import pytest
from teaching import sums

from taichi_tracer.teaching import catalogue, outline
from taichi_tracer.teaching.cutting import stub_of


@pytest.mark.parametrize("name", catalogue.names())
def test_what_a_method_calls_comes_before_it(name):
    assignment = catalogue.load(name)
    names, calls = outline.in_order(assignment), outline.called(assignment)
    assert sorted(names) == sorted(part.name for part in assignment.parts if part.replaces)
    for i, part in enumerate(names):
        assert not calls[part] & set(names[i + 1 :]), part


def test_the_order_in_words():
    names = outline.in_order(catalogue.load("a2"))
    assert names[-1] == "A2Renderer.shade_ray"
    assert names.index("Camera.generate_ndc_coords") < names.index("Camera.generate_ray")


def test_methods_that_call_each_other_are_put_in_order(tmp_path):
    folder = sums.write_assignment(tmp_path / "sums")
    text = sums.SOLUTION.replace("return a + b", "return self.subtract(a, -b)")
    (folder / "solution" / "sums.py").write_text(text.replace("return a - b", "return self.add(a, -b)"))
    assert len(outline.in_order(catalogue.load(folder))) == 3


@pytest.mark.parametrize("name", catalogue.names())
def test_an_outline_has_nothing_of_the_solution(name, tmp_path):
    assignment = catalogue.load(name)
    outline.write(assignment, tmp_path / name)
    for path in assignment.solution_folder.glob("*.py"):
        written = (tmp_path / name / "solution" / path.name).read_text()
        assert written == stub_of(path.read_text(), path.name)
    assert not (tmp_path / name / "mistakes.py").exists()
    assert [part.name for part in catalogue.load(tmp_path / name).parts] == [part.name for part in assignment.parts]


HELPER = '''
    def negative(self, b):
        """-b"""
        ### BEGIN SOLUTION
        return -b
        ### END SOLUTION
'''


def test_a_part_brings_its_helpers_and_no_other_part(tmp_path):
    folder = sums.write_assignment(tmp_path / "sums")
    text = sums.SOLUTION.replace("return a - b", "return a + self.negative(b)") + HELPER
    (folder / "solution" / "sums.py").write_text(text)
    assignment = catalogue.load(folder)
    (added,) = outline.solved_parts(assignment, ["Sums.add"]).values()
    (both,) = outline.solved_parts(assignment, ["Sums.add", "Sums.subtract"]).values()
    assert "return a + b" in added
    assert "self.negative" not in added
    assert "return -b" not in added
    assert "return a + self.negative(b)" in both
    assert "return -b" in both
    assert outline.solved_parts(assignment, []) == {}
