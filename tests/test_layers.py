"""The house: imports go downwards only, one file starts Taichi, and nothing grows too large to be read."""

import ast
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

import taichi_tracer

PACKAGE = Path(taichi_tracer.__file__).parent
MODULES = {".".join(path.relative_to(PACKAGE).with_suffix("").parts): path for path in PACKAGE.rglob("*.py")}
ORACLES = sorted(Path(__file__).parent.glob("oracles/*.py"))
MOST_LINES, MOST_LINES_OF_A_FUNCTION = 400, 90

# From the bottom up: a file uses what stands before it. A folder's name stands for all of its files.
LAYERS = (
    "errors runtime error_estimate progress",
    "ray sampler camera_frame camera spheres",
    "materials geometry brdf files environment background",
    "ray_intersector bvh_build bvh_wide packets packet_triangles bvh",
    "film",
    "effects scene_data scene_data_loader",
    "primary_hits adaptive",
    "surface_views integrators direct_illumination renderer rt3_renderer",
    "__init__",
    "studies",
    "apps",
    "__main__",
)
ORDER = " ".join(LAYERS).split()


@cache
def read(path: Path) -> ast.Module:
    """The syntax tree of a file."""
    return ast.parse(path.read_text(encoding="utf-8"))


def imports(tree: ast.AST) -> set[str]:
    """Dotted names of everything that is imported anywhere in a file, also inside functions."""
    names = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            names |= {f"{'.' * node.level}{node.module or ''}.{alias.name}" for alias in node.names}
    return names


def parts_used(tree: ast.AST) -> set[str]:
    """The parts of the package, as ``ORDER`` names them, that a file imports; "." for a relative import."""
    dotted = [name.split(".") for name in imports(tree)]
    own = [name[1:] for name in dotted if name[0] == "taichi_tracer"]
    parts = {name[0] if name and name[0] in ORDER else "__init__" for name in own}
    return parts | {"." for name in dotted if name[0] == ""}


def taichi_names(tree: ast.AST) -> set[str]:
    """Names that a file takes from Taichi: "init" of ``ti.init`` and of ``from taichi import init``."""
    aliases = {
        alias.asname or alias.name
        for node in ast.walk(tree)
        if isinstance(node, ast.Import)
        for alias in node.names
        if alias.name == "taichi"
    }
    attributes = [node for node in ast.walk(tree) if isinstance(node, ast.Attribute)]
    dotted = {a.attr for a in attributes if isinstance(a.value, ast.Name) and a.value.id in aliases}
    return dotted | {name.split(".")[-1] for name in imports(tree) if name.startswith("taichi.")}


def test_the_order_names_every_file_once():
    assert len(ORDER) == len(set(ORDER))
    assert {name.split(".")[0] for name in MODULES} == set(ORDER)


@pytest.mark.parametrize("module", sorted(MODULES))
def test_imports_go_downwards_only(module):
    part = module.split(".")[0]
    below = set(ORDER[: ORDER.index(part)])
    own_folder = {part} if "." in module else set()
    assert parts_used(read(MODULES[module])) <= below | own_folder


@pytest.mark.parametrize("folder", ["files", "studies", "apps"])
def test_files_of_a_folder_do_not_import_each_other_in_a_circle(folder):
    names = {module for module in MODULES if module.startswith(f"{folder}.")}
    used = {name: {f"{i}.".removeprefix("taichi_tracer.") for i in imports(read(MODULES[name]))} for name in names}
    graph = {name: {n for n in names if any(i.startswith(f"{n}.") for i in used[name])} for name in names}
    assert set(TopologicalSorter(graph).static_order()) == names  # raises CycleError


def test_only_runtime_starts_taichi():
    assert {m for m, path in MODULES.items() if taichi_names(read(path)) & {"init", "reset"}} == {"runtime"}


def test_random_numbers_never_come_from_taichi():
    assert [m for m, path in MODULES.items() if taichi_names(read(path)) & {"random", "randn"}] == []


def test_only_programs_print():
    printing = {m for m, path in MODULES.items() if any(is_print(node) for node in ast.walk(read(path)))}
    says_which_backend_it_fell_back_to = {"runtime"}
    assert {m for m in printing if not m.startswith("apps.")} == says_which_backend_it_fell_back_to


def is_print(node: ast.AST) -> bool:
    """Whether a node is a call of ``print``."""
    return isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "print"


@pytest.mark.parametrize("path", ORACLES, ids=lambda path: path.stem)
def test_an_oracle_knows_nothing_of_the_package(path):
    assert not {name.split(".")[0] for name in imports(read(path))} & {"taichi_tracer", "taichi"}


@pytest.mark.parametrize("module", sorted(MODULES))
def test_files_and_functions_can_be_read_in_one_go(module):
    assert len(MODULES[module].read_text(encoding="utf-8").splitlines()) < MOST_LINES
    functions = [n for n in ast.walk(read(MODULES[module])) if isinstance(n, (ast.FunctionDef, ast.AsyncFunctionDef))]
    lengths = {f.name: f.end_lineno - f.lineno + 1 for f in functions}
    assert {name: length for name, length in lengths.items() if length >= MOST_LINES_OF_A_FUNCTION} == {}


@pytest.mark.parametrize(
    ("source", "part"),
    [
        ("import taichi_tracer as tt", "__init__"),
        ("from taichi_tracer import Camera", "__init__"),
        ("from taichi_tracer import renderer as r", "renderer"),
        ("def f():\n    import taichi_tracer.files.obj", "files"),
        ("from . import renderer", "."),
    ],
)
def test_every_way_to_import_is_seen(source, part):
    assert parts_used(ast.parse(source)) == {part}


@pytest.mark.parametrize(
    "source",
    ["import taichi as ti\nti.init()", "import taichi\nstart = taichi.init", "from taichi import init as start"],
)
def test_every_way_to_start_taichi_is_seen(source):
    assert "init" in taichi_names(ast.parse(source))
