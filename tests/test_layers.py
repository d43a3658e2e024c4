"""The house: imports go downwards only, one file starts Taichi, and every function can be read in one go.

The map in docs/design.md is made of this file and of the first sentences of the docstrings. ``python
tests/test_layers.py`` writes it anew.
"""

import ast
import importlib
import textwrap
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

import taichi_tracer
from taichi_tracer.system import registry
from taichi_tracer.system.wings import WINGS

PACKAGE = Path(taichi_tracer.__file__).parent
# The solutions of assignments are students' files: they use the package as a program does, and no part of it uses them.
FILES = [path for path in PACKAGE.rglob("*.py") if path.parent.name != "solution"]
MODULES = {".".join(path.relative_to(PACKAGE).with_suffix("").parts): path for path in FILES}
FOLDERS = sorted({module.split(".")[0] for module in MODULES if "." in module})
DESIGN = Path(__file__).parent.parent / "docs" / "design.md"
PUBLIC_LOADERS = {"scene_data_loader", "studies.__init__", "cluster.__init__"}  # their options are users' keywords
ORACLES = sorted(Path(__file__).parent.glob("oracles/*.py"))
MOST_LINES_OF_A_FILE, MOST_LINES_OF_A_FUNCTION, MOST_PARAMETERS = 450, 50, 7

# From the bottom up: a file uses what stands before it. A folder's name stands for all of its files.
LAYERS = (
    "values system",
    "formulas ray ray_hits random_numbers tones",
    "brdfs",
    "materials geometry textures mesh_parts instances places files",
    "environment background effects lights",
    "sampler samplers camera_settings camera_calls camera cameras",
    "ray_intersector intersectors",
    "options",
    "integrators unseen",
    "picture forms scene_parts scene_in_kernels scene_data",
    "explain pilot progressive modes",
    "renderer maps rt3 scene_data_loader camera_controller",
    "fast",
    "__init__",
    "course",
    "studies",
    "contracts",
    "teaching",
    "apps",
    "cluster",
    "__main__",
)
ORDER = " ".join(LAYERS).split()

# The map in docs/design.md: what stands together, for a reader. The root files of the first part are the handouts'.
MAP = {
    "what a student opens: the formulas and the plain forms": (
        "ray random_numbers sampler camera geometry materials textures environment ray_intersector progressive modes "
        "renderer scene_data scene_in_kernels scene_data_loader camera_controller"
    ),
    "parts: one file for each, in the folder of their kind": (
        "formulas cameras samplers brdfs lights integrators intersectors tones"
    ),
    "the door to the fast forms, and the wing behind it, which nobody needs to read": "forms fast",
    "the picture, the scene's effects and options, what is underneath": (
        "picture pilot unseen effects background mesh_parts instances places options values camera_settings "
        "camera_calls scene_parts ray_hits maps system"
    ),
    "outside; each folder but files can be taken off": (
        "files rt3 course studies contracts teaching explain apps cluster"
    ),
}
WIDTH, INDENT = 132, 26

# Who imports by a name that is made at run time, which the tests of the order cannot see, and what.
BY_NAME = ("import_module", "import_quickly", "resolve_name")
IMPORT_BY_NAME = {
    "__init__": "the public names, when they are first used",
    "course.files": "the files of a student, and the package's modules that they import",
    "system.registry": "the homes of the parts, when a part is first asked for; and the files of --parts",
    "system.wings": "modules of folders that may have been taken off",
    "system.taichi_17.patches": "names of Taichi, and what replaces them",
    "system.runtime": "the patches of Taichi, if their folder is there",
    "system.importing": "Taichi and modules that others ask for, whose import it makes shorter",
    "apps.cli": "the commands, each of which is a file of ``apps/commands``",
    "apps.grammar": "what a command runs",
}

# Who names a part above it in an import that never runs, which only editors read.
FOR_EDITORS = {
    "__init__": {"cluster", "course", "studies", "teaching", "apps"},
    "integrators.base": {"scene_data"},
    "integrators.rt3_blinn_phong": {"scene_data"},
    "options": {"integrators"},
    "pilot": {"progressive"},
    "scene_in_kernels": {"scene_data"},
}


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


def part_of(dotted: str) -> str:
    """Where a module, named within the package, stands in ``ORDER``."""
    first = dotted.split(".")[0]
    return first if first in ORDER else "__init__"


def parts_used(tree: ast.AST) -> set[str]:
    """The parts of the package, as ``ORDER`` names them, that a file imports; "." for a relative import."""
    names = imports(tree)
    own = {name for name in names if name.split(".")[0] == "taichi_tracer"}
    parts = {part_of(name.removeprefix("taichi_tracer").removeprefix(".")) for name in own}
    return parts | {"." for name in names if name.startswith(".")}


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


def functions_of(tree: ast.AST) -> list[ast.FunctionDef]:
    """Every function and method of a file."""
    return [node for node in ast.walk(tree) if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef))]


def calls(node: ast.AST, *names: str) -> bool:
    """Whether a node is a call of one of these functions, however it is reached."""
    if not isinstance(node, ast.Call):
        return False
    return getattr(node.func, "id", getattr(node.func, "attr", None)) in names


# ── the order ──


def test_the_order_names_every_file_once():
    assert len(ORDER) == len(set(ORDER))
    assert {module.split(".")[0] for module in MODULES} == set(ORDER)


@pytest.mark.parametrize("module", sorted(MODULES))
def test_imports_go_downwards_only(module):
    part = part_of(module)
    below = set(ORDER[: ORDER.index(part)])
    own_folder = {part} if "." in module else set()
    assert parts_used(read(MODULES[module])) <= below | own_folder | FOR_EDITORS.get(module, set())


@pytest.mark.parametrize("folder", FOLDERS)
def test_files_of_a_folder_do_not_import_each_other_in_a_circle(folder):
    names = {module for module in MODULES if module.startswith(f"{folder}.")}
    used = {name: {f"{i}.".removeprefix("taichi_tracer.") for i in imports(read(MODULES[name]))} for name in names}
    graph = {name: {n for n in names if any(i.startswith(f"{n}.") for i in used[name])} for name in names}
    assert set(TopologicalSorter(graph).static_order()) == names  # raises CycleError


def test_only_these_import_by_name():
    """What no test of the order can see is in these files, of which the registry alone reaches upwards."""
    found = {m for m, path in MODULES.items() if any(calls(n, *BY_NAME) for n in ast.walk(read(path)))}
    assert found == set(IMPORT_BY_NAME)


def test_the_registry_reaches_up_to_the_homes_of_the_parts_alone():
    homes = {home for modules, _ in registry.HOMES.values() for home in modules}
    assert homes <= {*MODULES, *FOLDERS}
    for home in homes:
        assert importlib.import_module(f"taichi_tracer.{home}")
    at_the_top = {name for node in read(MODULES["system.registry"]).body for name in imports(node) if "taichi" in name}
    assert {name.split(".")[1] for name in at_the_top} == {"system"}


def test_nobody_imports_the_fast_wing():
    """A reader of the plain forms meets the fast ones nowhere: ``forms`` alone looks whether they are there."""
    users = {m for m, path in MODULES.items() if "fast" in parts_used(read(path))}
    assert {m for m in users if m.split(".")[0] != "fast"} == set()


# ── what only one file does ──


def test_only_runtime_starts_taichi():
    assert {m for m, path in MODULES.items() if taichi_names(read(path)) & {"init", "reset"}} == {"system.runtime"}


def test_random_numbers_never_come_from_taichi_but_in_one_function():
    """``random_numbers.taichi_pair`` alone, for the kernels of students who have no sample; see ``given_or_drawn``.

    The checks of the teaching kit replace ``ti.random`` itself, so that students' code gives the same numbers again.
    """
    users = {m for m, path in MODULES.items() if taichi_names(read(path)) & {"random", "randn"}}
    assert users == {"random_numbers", "teaching.running"}
    tree = read(MODULES["random_numbers"])
    drawn = [node for node in ast.walk(tree) if is_taichi_random(node)]
    (pair,) = [f for f in functions_of(tree) if f.name == "taichi_pair"]
    assert len(drawn) == 2
    assert all(node in set(ast.walk(pair)) for node in drawn)
    assert [f.name for f in functions_of(tree) if any(calls(n, "taichi_pair") for n in ast.walk(f))] == [
        "given_or_drawn"
    ]
    assert not {m for m, path in MODULES.items() if any(name.endswith(".taichi_pair") for name in imports(read(path)))}


def is_taichi_random(node: ast.AST) -> bool:
    """Whether a node is ``ti.random`` or ``ti.randn``."""
    is_attribute = isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name)
    return is_attribute and node.value.id == "ti" and node.attr in ("random", "randn")


def test_only_programs_print():
    printing = {m for m, path in MODULES.items() if any(calls(node, "print") for node in ast.walk(read(path)))}
    says_which_backend_it_fell_back_to = {"system.runtime"}
    assert {m for m in printing if not m.startswith("apps.")} == says_which_backend_it_fell_back_to


@pytest.mark.parametrize("path", ORACLES, ids=lambda path: path.stem)
def test_an_oracle_knows_nothing_of_the_package(path):
    assert not {name.split(".")[0] for name in imports(read(path))} & {"taichi_tracer", "taichi"}


# ── what can be read in one go ──


@pytest.mark.parametrize("module", sorted(MODULES))
def test_files_and_functions_can_be_read_in_one_go(module):
    tree = read(MODULES[module])
    assert len(MODULES[module].read_text(encoding="utf-8").splitlines()) <= MOST_LINES_OF_A_FILE
    lengths = {f.name: f.end_lineno - f.lineno + 1 for f in functions_of(tree)}
    assert {name: length for name, length in lengths.items() if length > MOST_LINES_OF_A_FUNCTION} == {}
    if module.split(".")[0] != "fast" and module not in PUBLIC_LOADERS:
        many = {f.name: parameters_of(f) for f in functions_of(tree)}
        assert {name: count for name, count in many.items() if count > MOST_PARAMETERS} == {}


def parameters_of(function: ast.FunctionDef) -> int:
    """How many parameters a function has, without ``self`` and ``cls``."""
    names = [a.arg for a in function.args.posonlyargs + function.args.args + function.args.kwonlyargs]
    return len([name for name in names if name not in ("self", "cls")])


# ── every file has its tests ──

# Files that have no test file of their own name and that no test imports → what tests them.
TESTED_THROUGH = {
    "apps.compare": "apps/test_cli",
    "apps.effects": "apps/test_cli",
    "apps.export": "apps/test_cli",
    "apps.faults": "apps/test_parts",
    "apps.keeping": "apps/test_rescue",
    "apps.render": "apps/test_cli",
    "contracts.plots": "apps/test_check_part",
    "contracts.steps": "apps/test_check_part",
    "course.environment_sampling": "course/test_scripts",
    "course.geometry": "course/test_hand_ins",
    "fast.counted_tiles": "fast/test_tiles",
    "files.fonts": "apps/test_contact_sheet",
    "integrators.next_event": "integrators/test_direct_light",
    "integrators.one_sample": "contracts/test_integrators",
    "lights.choice": "contracts/test_lamp_choices",
    "lights.choose_by_hierarchy": "contracts/test_lamp_choices",
    "modes": "course/test_scripts",
    "picture.postprocessed": "course/test_scripts",
    "picture.rendered": "test_progressive",
    "system.own_code.interface": "system/own_code/test_faults",
    "system.own_code.rules": "system/own_code/test_faults",
    "system.own_code.kinds": "system/own_code/test_faults",
    "system.own_code.source": "system/own_code/test_faults",
    "system.taichi_17.own_code": "system/own_code/test_faults",
    "system.taichi_17.bounds": "system/own_code/test_bounds",
    "system.blocks": "system/taichi_17/test_blocks",
    "brdfs.handout": "brdfs/test_microfacet",
    "studies.hard.case": "test_hard_cases",
    "studies.hard.view_cases": "test_hard_cases",
    "system.taichi_17.components": "system/taichi_17/test_arguments",
    "system.types": "test_typed",
    "teaching.boxes": "teaching/test_notebooks",
    "teaching.child": "teaching/test_sandbox",
    "teaching.rooms": "teaching/test_mistakes",
    "teaching.sealed": "teaching/test_solutions",
    "teaching.sealing": "teaching/test_solutions",
    "unseen.rarely_met": "unseen/test_caustics",
    "tones.base": "contracts/test_tones",
    "tones.none": "contracts/test_tones",
}
TESTS = Path(__file__).parent


def test_every_file_has_its_tests():
    """A test file of its own name, or one that imports it, or one that is named here."""
    imported = {name for path in TESTS.rglob("*.py") for name in imports(read(path))}
    alone = set()
    for module, path in MODULES.items():
        inside = path.relative_to(PACKAGE)
        is_of_a_kind = path.name == "__init__.py" or {"commands", "assignments"} & set(inside.parts[:-1])
        has_own = (TESTS / inside.parent / f"test_{path.stem}.py").exists()
        is_imported = any(f"{name}.".startswith(f"taichi_tracer.{module}.") for name in imported)
        if not (is_of_a_kind or has_own or is_imported):
            alone.add(module)
    assert alone == set(TESTED_THROUGH)
    assert all((TESTS / f"{name}.py").exists() for name in TESTED_THROUGH.values())


# ── the map ──


def first_sentence(path: Path) -> str:
    """The first sentence of a file's docstring, without markup."""
    text = " ".join((ast.get_docstring(read(path)) or "").split("\n\n")[0].split()).replace("``", "")
    return min((text.split(end)[0] for end in (". ", "; ")), key=len).removesuffix(".")


def lines_of(name: str) -> list[str]:
    """A file or a folder in the map: what it is, and the files of the folder."""
    folder = PACKAGE / name
    if not folder.is_dir():
        return [f"  {name + '.py':<{INDENT - 2}}{first_sentence(PACKAGE / f'{name}.py')}"]
    inside = sorted({m.split(".")[1] for m in MODULES if m.startswith(f"{name}.")} - {"__init__"})
    pad = " " * INDENT
    files = textwrap.wrap(", ".join(inside), WIDTH, initial_indent=pad, subsequent_indent=pad)
    return [f"  {name + '/':<{INDENT - 2}}{first_sentence(folder / '__init__.py')}", *files]


def the_map() -> str:
    """The map of the house: what stands together, and in which order imports go."""
    lines = ["```", "taichi_tracer/"]
    for title, names in MAP.items():
        lines += [f"  ── {title}", *(line for name in names.split() for line in lines_of(name))]
    order = ", ".join(f"`{name}`" for name in reversed(ORDER))
    lines += ["```", "", f"A file imports only what comes after it in this order: {order}."]
    return "\n".join(lines)


def with_map(document: str) -> str:
    """A document in which the map stands between its two marks."""
    begin, end = "<!-- the map: made by python tests/test_layers.py -->\n", "<!-- end of the map -->"
    return document[: document.index(begin) + len(begin)] + the_map() + "\n" + document[document.index(end) :]


def test_the_map_in_the_documents_is_this_one():
    named = " ".join(MAP.values()).split()
    assert sorted(named) == sorted(set(ORDER) - {"__init__", "__main__"})
    document = DESIGN.read_text(encoding="utf-8")
    assert document == with_map(document), "run: python tests/test_layers.py"


def number_of_lines(is_wanted, zeros):
    """The lines of all files whose first name, a folder or a file of the root, is wanted, with so many zeros."""
    files = [path for module, path in MODULES.items() if is_wanted(module.split(".")[0])]
    return round(sum(len(path.read_text(encoding="utf-8").splitlines()) for path in files), -zeros)


def test_the_readme_counts_the_lines_of_what_is_to_be_read():
    """The files that students open, and the parts; what can be taken off; and what holds the rest together."""
    read = " ".join(list(MAP.values())[:2]).split()
    readme = " ".join((DESIGN.parent.parent / "README.md").read_text(encoding="utf-8").split())
    assert f"{number_of_lines(read.__contains__, 2):,} lines of Python in all" in readme
    assert f"measure it and hand it out, {number_of_lines(WINGS.__contains__, 3):,} lines, can be taken off" in readme
    always = number_of_lines(lambda name: name not in read and name not in WINGS, 3)
    assert f"always needed are {always:,} more, for files, pictures, Taichi and options" in readme


# ── whether these tests see what they look for ──


@pytest.mark.parametrize(
    ("source", "part"),
    [
        ("import taichi_tracer as tt", "__init__"),
        ("from taichi_tracer import Camera", "__init__"),
        ("from taichi_tracer import renderer as r", "renderer"),
        ("def f():\n    import taichi_tracer.files.obj", "files"),
        ("from taichi_tracer.fast import wide_bvh", "fast"),
        ("if TYPE_CHECKING:\n    from taichi_tracer.scene_data import SceneData", "scene_data"),
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


if __name__ == "__main__":
    DESIGN.write_text(with_map(DESIGN.read_text(encoding="utf-8")), encoding="utf-8")
