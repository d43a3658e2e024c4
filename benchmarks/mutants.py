"""How many wrong programs the checks notice, and name: mutants of the solutions, which nobody chose.

A mutant has one small change that a program makes in one method: another operator, a number, a factor or a statement
left out, arguments or components exchanged, a function in place of its neighbour. There is none in a while loop, which
might never end. A part notices it, or it does not: then it may be a right program. The finder names it, or describes
what is wrong. A name is wrong if the known mistake and the mutant differ for the inputs of another seed.

python -m benchmarks.mutants [ASSIGNMENT ...]
"""

import ast
import copy
import random
import sys
import time
from collections import Counter
from collections.abc import Iterator

from benchmarks.measure import describe_machine
from taichi_tracer.system import runtime
from taichi_tracer.teaching import catalogue, mistakes
from taichi_tracer.teaching.base import Assignment, Part
from taichi_tracer.teaching.cutting import solved
from taichi_tracer.teaching.judges import agree
from taichi_tracer.teaching.loading import OK, solution_of
from taichi_tracer.teaching.mistakes import find, split_at_method
from taichi_tracer.teaching.running import answer

COUNT, SEED, OTHER_SEED = 100, 2026, 7
OPERATORS = {ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult}
COMPARISONS = {ast.Lt: ast.Gt, ast.Gt: ast.Lt, ast.LtE: ast.GtE, ast.GtE: ast.LtE, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq}
FUNCTIONS = {"sin": "cos", "cos": "sin", "tan": "sin", "max": "min", "min": "max", "asin": "acos"}
UNWRAPPED = ("normalize", "abs", "sqrt", "clamp", "norm", "max")
COMPONENTS = {"x": "y", "y": "z", "z": "x"}
NAMES = {"w_i": "w_o", "w_o": "w_i", "u": "v", "v": "u", "v0": "v1", "v1": "v2", "v2": "v0", "n0": "n1", "n1": "n2"}
NAMES |= {"pdf": "other_pdf", "xi_x": "xi_y", "row": "column", "b0": "b1", "b1": "b0", "e1": "e2", "e2": "e1"}


def changes(node: ast.AST) -> Iterator[ast.AST]:
    """The nodes that may stand in the place of one."""
    if isinstance(node, ast.BinOp):
        if type(node.op) in OPERATORS:
            yield ast.BinOp(node.left, OPERATORS[type(node.op)](), node.right)
        yield node.left
        yield node.right
        if not isinstance(node.op, (ast.Add, ast.Mult)):
            yield ast.BinOp(node.right, node.op, node.left)
    elif isinstance(node, ast.Compare) and type(node.ops[0]) in COMPARISONS:
        yield ast.Compare(node.left, [COMPARISONS[type(node.ops[0])]()], node.comparators)
        yield ast.Constant(True)
    elif isinstance(node, ast.BoolOp):
        yield from (ast.BoolOp(node.op, [v for v in node.values if v is not one]) for one in node.values)
    elif isinstance(node, ast.Constant) and isinstance(node.value, (int, float)) and not isinstance(node.value, bool):
        yield from (ast.Constant(value) for value in {node.value + 1, node.value * 2, 0 * node.value} - {node.value})
    elif isinstance(node, ast.UnaryOp):
        yield node.operand
    elif isinstance(node, ast.Call):
        name = getattr(node.func, "attr", "")
        if name in FUNCTIONS and isinstance(node.func, ast.Attribute):
            yield ast.Call(ast.Attribute(node.func.value, FUNCTIONS[name], ast.Load()), node.args, node.keywords)
        if len(node.args) == 2 and name not in ("max", "min", "dot"):
            yield ast.Call(node.func, node.args[::-1], node.keywords)
        if name in UNWRAPPED and node.args:
            yield node.args[-1]
    elif isinstance(node, ast.Attribute) and node.attr in COMPONENTS and isinstance(node.ctx, ast.Load):
        yield ast.Attribute(node.value, COMPONENTS[node.attr], node.ctx)
    elif isinstance(node, ast.Name) and node.id in NAMES and isinstance(node.ctx, ast.Load):
        yield ast.Name(NAMES[node.id], node.ctx)
    elif isinstance(node, (ast.Assign, ast.AugAssign)):
        yield ast.Pass()


def mutants(text: str) -> dict[str, str]:
    """What was changed → the changed text, of the lines of a method."""
    begin = "def f(self):\n"
    tree = ast.parse(begin + text)
    found = {}
    endless = {id(node) for loop in ast.walk(tree) if isinstance(loop, ast.While) for node in ast.walk(loop)}
    for place, node in enumerate(ast.walk(tree)):
        if isinstance(node, (ast.FunctionDef, ast.arguments)) or is_operator(node) or id(node) in endless:
            continue
        for number in range(sum(1 for _ in changes(node))):
            copied = copy.deepcopy(tree)
            target = list(ast.walk(copied))[place]
            new = list(changes(target))[number]
            replaced(copied, target, new)
            body = ast.unparse(ast.fix_missing_locations(copied)).splitlines()[1:]
            key = f"{ast.unparse(node)} -> {ast.unparse(new)}".replace("\n", " ")
            if ast.unparse(node) == ast.unparse(new):
                continue
            found[f"line {getattr(node, 'lineno', 1) - 1}: {key}"] = "".join(f"    {line}\n" for line in body)
    return found


def is_operator(node: ast.AST) -> bool:
    """Whether a node is a sign, which the node around it changes."""
    return isinstance(node, (ast.Load, ast.Store, ast.operator, ast.cmpop, ast.boolop, ast.unaryop))


def replaced(tree: ast.AST, old: ast.AST, new: ast.AST) -> None:
    """Put a node in the place of another one."""
    for parent in ast.walk(tree):
        for name, value in ast.iter_fields(parent):
            if value is old:
                setattr(parent, name, new)
            elif isinstance(value, list) and any(one is old for one in value):
                setattr(parent, name, [new if one is old else one for one in value])


def verdict_of(assignment: Assignment, part: Part, text: str) -> tuple[str, float]:
    """What becomes of a mutant, and how long the first check looks for its name."""
    file = assignment.classes[part.replaces]
    path = assignment.solution_folder / file
    before, _, after = split_at_method(
        solved(path.read_text(encoding="utf-8"), file), part.replaces, part.method, str(path)
    )
    classes = mistakes.load_text(assignment, file, before + text + after)

    def answers(seed: int):
        inputs = assignment.inputs(part, seed)
        return inputs, answer(part, classes, solution_of(assignment), inputs, dict(assignment.classes))

    inputs, found = answers(0)
    if found.status != OK:
        return "told as a crash", 0.0
    right = mistakes.kept_expected(assignment, part, inputs)
    if part.judge.agrees(inputs, found.arrays, right).all():
        return "not noticed", 0.0
    start = time.perf_counter()
    findings = find(assignment, part, inputs, found.arrays, right, seconds=3.0)
    seconds = time.perf_counter() - start
    names = findings[0].names
    if not names:
        return "described", seconds
    other_inputs, other = answers(OTHER_SEED)
    known = tuple(one for one in assignment.mistakes_of(part) if one.name in names)
    theirs = mistakes.answers_of(assignment, part, known, other_inputs)
    is_same = theirs is not None and agree(part.judge, other_inputs, other.arrays, theirs).all()
    return ("named" if is_same else "named wrongly"), seconds


def main() -> None:
    """Print a table, and which mutants were not noticed or named wrongly."""
    runtime.ensure()
    rng, rows, told = random.Random(SEED), [], []
    for name in sys.argv[1:] or catalogue.names():
        assignment = catalogue.load(name)
        every = []
        for part in (part for part in assignment.parts if part.replaces):
            path = assignment.solution_folder / assignment.classes[part.replaces]
            source = solved(path.read_text(encoding="utf-8"), str(path))
            method = split_at_method(source, part.replaces, part.method, str(path))[1]
            every += [(part, what, text) for what, text in mutants(method).items()]
        counts: Counter[str] = Counter()
        longest = 0.0
        for part, what, text in rng.sample(every, min(COUNT, len(every))):
            verdict, seconds = verdict_of(assignment, part, text)
            counts[verdict] += 1
            longest = max(longest, seconds)
            if verdict in ("not noticed", "named wrongly"):
                told.append(f"{name} {part.name} {verdict}: {what}")
        rows.append(f"| {name} | {' | '.join(str(counts[word]) for word in KINDS)} | {longest:.1f} |")
        print(rows[-1], flush=True)
    print(describe_machine(), "", f"| assignment | {' | '.join(KINDS)} | longest search, s |", sep="\n")
    print("|---|" + "--:|" * (len(KINDS) + 1), *rows, "", *told, sep="\n")


KINDS = ("named", "described", "told as a crash", "named wrongly", "not noticed")


if __name__ == "__main__":
    main()
