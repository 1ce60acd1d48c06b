"""Change signs, constants, indices and comparisons of the physics one at a time, and see whether the fast tests fail.

    python tools/mutate.py --seed 7 --number 20 --packages meltemi.sea meltemi.floating --out mutants.csv

Each change is written into a copy of the tree; tests run there until one fails: first, in plain Python, those of node
functions that name the changed module or its package, and the regression of one instant; then the fast tests that
name the module and the function (or its class), the regression, and those that name the module, the function or the
package. These need new machine code, which takes minutes, only if a kernel is changed: what no kernel calls leaves that
of the tree as it is. ``--plain`` changes kernels only, and leaves the second stage out; ``--near`` its last tests. What
survives is printed last: it is equivalent, or a test is missing.
"""

from __future__ import annotations

import argparse
import ast
import csv
import os
import random
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[1]
CORE = tuple(f"meltemi/{name}" for name in "aero structure simulation wind turbulence iec analyses".split())
PACKAGES = (*CORE, "meltemi.sea", "meltemi.floating", "meltemi.farm")
UNPHYSICAL = ("commands.py", "plots.py", "rao_plots.py", "report.py", "scene.py", "channels.py", "files")
"""Files and folders without physics."""
SWAPS = {
    ast.Add: "-", ast.Sub: "+", ast.Mult: "/", ast.Div: "*", ast.Lt: ">", ast.Gt: "<", ast.LtE: ">=", ast.GtE: "<=",
    ast.Eq: "!=", ast.NotEq: "==",
}  # fmt: skip
NAMES = {"sin": "cos", "cos": "sin", "min": "max", "max": "min", "x": "y", "y": "z", "z": "x"}
INSTANT = "tests/regression/test_numbers.py::test_numbers_are_those_of_the_file[instant]"
COMPILED = re.compile(r"@\w*kernel|@\w+\.variant|@by_record|@hook|@loose|njit")
"""Marks of functions that are compiled, or called where they are."""
LIMIT = 1800.0
"""[s] for the tests of a mutant; one that hangs is caught."""


class Mutant(NamedTuple):
    """A change of the characters from ``start`` to ``end`` of a line, counted from 1 and in bytes from 0."""

    file: str
    line: int
    start: int
    end: int
    after: str


def changes(node: ast.AST, lines: list[bytes]) -> Iterator[tuple[int, int, int, str]]:
    """Line, start, end and new text of the changes of one node; operators stand between their operands."""
    at: int = getattr(node, "lineno", 0)
    if isinstance(node, (ast.BinOp, ast.Compare)):
        left, op, right = (
            (node.left, node.op, node.right)
            if isinstance(node, ast.BinOp)
            else (node.left, node.ops[0], node.comparators[0])
        )
        between = lines[at - 1][left.end_col_offset : right.col_offset]
        text = between.strip(b" ()")
        if type(op) in SWAPS and left.end_lineno == right.lineno == at and text:
            start = (left.end_col_offset or 0) + between.index(text)
            yield at, start, start + len(text), SWAPS[type(op)]
    elif isinstance(node, ast.AugAssign) and type(node.op) in SWAPS and node.target.end_lineno == node.value.lineno:
        start = lines[at - 1].index(b"=", node.target.end_col_offset) - 1
        yield at, start, start + 1, SWAPS[type(node.op)]
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        yield at, node.col_offset, node.col_offset + 1, ""
    elif isinstance(node, ast.Constant) and isinstance(value := node.value, (int, float)) and node.end_lineno == at:
        if not isinstance(value, bool):
            other = value + 1 if isinstance(value, int) else 1.1 * value or 0.5
            yield at, node.col_offset, node.end_col_offset or 0, repr(other)
    elif isinstance(node, ast.Attribute) and node.attr in NAMES and node.end_lineno:
        end = node.end_col_offset or 0
        yield node.end_lineno, end - len(node.attr), end, NAMES[node.attr]
    elif isinstance(node, ast.Name) and node.id in ("sin", "cos", "min", "max"):
        yield at, node.col_offset, node.end_col_offset or 0, NAMES[node.id]


def computed(node: ast.AST) -> Iterator[ast.AST]:
    """What functions and constants of a module compute, without annotations, decorators, messages and fields."""
    if isinstance(node, (ast.Raise, ast.JoinedStr, ast.AnnAssign, ast.arguments)):
        return
    inner = node.body if isinstance(node, (ast.FunctionDef, ast.ClassDef, ast.Module)) else ast.iter_child_nodes(node)
    for each in inner:
        yield each
        yield from computed(each)


def mutants(package: str, kernels_only: bool) -> list[Mutant]:
    """All changes of a package, or of its files with kernels."""
    found = []
    for path in sorted((ROOT / "src" / package).rglob("*.py")):
        wanted = not kernels_only or b"@kernel" in path.read_bytes()
        if wanted and not any(part in UNPHYSICAL for part in path.parts):
            lines = path.read_bytes().split(b"\n")
            for node in computed(ast.parse(path.read_bytes())):
                found += [Mutant(path.relative_to(ROOT).as_posix(), *each) for each in changes(node, lines)]
    return found


def function_at(file: str, line: int) -> tuple[str, ast.FunctionDef] | None:
    """The function, or method of a class, whose body contains a line, behind its name or that of the class."""
    for node in ast.parse((ROOT / file).read_bytes()).body:
        for each in node.body if isinstance(node, ast.ClassDef) else [node]:
            if isinstance(each, ast.FunctionDef) and each.body[0].lineno <= line <= (each.end_lineno or 0):
                return node.name, each  # type: ignore[attr-defined]
    return None


def naming(words: list[str], among: str) -> list[str]:
    """Test files that contain one of some words."""
    files = sorted((ROOT / "tests").glob(among))
    imports = [rf"from {re.escape(a)} import .*\b{b}\b" for a, _, b in (word.rpartition(".") for word in words) if a]
    pattern = re.compile("|".join([*(rf"\b{re.escape(word)}\b" for word in words), *imports]))
    found = [file for file in files if pattern.search(file.read_text(encoding="utf-8"))]
    return [file.relative_to(ROOT).as_posix() for file in found]


def outwards(module: str) -> Iterator[str]:
    """A module and the packages around it."""
    while module:
        yield module
        module = module.rpartition(".")[0]


def passes(tree: Path, tests: list[str], cache: Path, **environment: str) -> bool:
    """Whether tests pass in a tree."""
    paths = {"PYTHONPATH": str(tree / "src"), "MELTEMI_CACHE_DIR": str(cache), "PYTHONDONTWRITEBYTECODE": "1"}
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-n", "0", "-p", "no:cacheprovider", *tests]
    try:
        done = subprocess.run(
            command,
            cwd=tree,
            env={**os.environ, **paths, **environment},
            capture_output=True,
            timeout=LIMIT,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return False
    return done.returncode in (0, 5)


def machine_code(tree: Path, cache: Path) -> Path:
    """Folder of the machine code of a tree."""
    program = "from meltemi.compiler.kernels import cache_folder; print(cache_folder())"
    environment = {**os.environ, "PYTHONPATH": str(tree / "src"), "MELTEMI_CACHE_DIR": str(cache)}
    done = subprocess.run([sys.executable, "-c", program], env=environment, capture_output=True, text=True, check=True)
    return Path(done.stdout.strip())


@dataclass
class Run:
    """The copy of the tree in which mutants are tested.

    Attributes:
      tree, cache: folders of the copy and of its machine code.
      code: folder of the machine code of the tree without changes; None if plain Python decides.
      near: whether only the nearest tests and the regression run.
      checked: tests that pass without a change.
    """

    tree: Path
    cache: Path
    code: Path | None
    near: bool
    checked: set[str] = field(default_factory=set)

    def check(self, tests: list[str], **environment: str) -> None:
        """Run tests without a change once, which also compiles what they need."""
        new = [each for each in tests if each + str(environment) not in self.checked]
        if new and not passes(self.tree, new, self.cache, **environment):
            raise SystemExit(f"without a change, one of these fails: {' '.join(new)}")
        self.checked |= {each + str(environment) for each in new}

    @contextmanager
    def changed(self, mutant: Mutant) -> Iterator[None]:
        """The tree with a mutant."""
        path = self.tree / mutant.file
        original = path.read_bytes()
        lines = original.split(b"\n")
        text = lines[mutant.line - 1]
        lines[mutant.line - 1] = text[: mutant.start] + mutant.after.encode() + text[mutant.end :]
        path.write_bytes(b"\n".join(lines))
        try:
            yield
        finally:
            path.write_bytes(original)


def verdict(run: Run, package: str, mutant: Mutant) -> str:
    """By which tests a mutant is caught, or that it survives."""
    file, function = mutant.file, function_at(mutant.file, mutant.line)
    module, dotted = file.removeprefix("src/").removesuffix(".py").replace("/", "."), package.replace("/", ".")
    around = [each for each in outwards(module) if each.startswith(dotted)]
    direct = next(filter(None, (naming([each], "unit/test_node_*.py") for each in around)), [])
    direct += [INSTANT] if package in CORE else []
    run.check(direct, NUMBA_DISABLE_JIT="1")
    with run.changed(mutant):
        if direct and not passes(run.tree, direct, run.cache, NUMBA_DISABLE_JIT="1"):
            return "caught in plain Python"
    if run.code is None:
        return "survives plain Python"
    of_module = next(filter(None, (naming([each], "*/test_*.py") for each in around)), [])
    of_function = naming([function[0]], "*/test_*.py") if function else []
    near = [each for each in of_module if each in of_function] or of_module
    regression, far = ["tests/regression"] if package in CORE else [], naming([dotted], "*/test_*.py")
    tests = list(dict.fromkeys([*near, *regression, *([] if run.near else [*of_module, *of_function, *far])]))
    run.check(tests)
    with run.changed(mutant):
        own = machine_code(run.tree, run.cache)
        if own != run.code and function is not None and not COMPILED.search(ast.unparse(function[1])):
            shutil.rmtree(own, ignore_errors=True)
            shutil.copytree(run.code, own)
        found = "survives" if not tests or passes(run.tree, tests, run.cache) else "caught"
        if own != run.code:
            shutil.rmtree(own)
    return found


def main() -> None:
    """Mutants of all packages, one after the other."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--number", type=int, default=10, help="of mutants of each package")
    parser.add_argument("--packages", nargs="+", default=PACKAGES, help="folders of src")
    parser.add_argument("--plain", action="store_true", help="kernels only, by tests that need no compilation")
    parser.add_argument(
        "--near", action="store_true", help="only tests that name module and function, and the regression"
    )
    parser.add_argument("--cache", type=Path, help="machine code of the tree without changes; by default a new one")
    parser.add_argument("--out", type=Path, default=Path("mutants.csv"))
    options = parser.parse_args()
    survivors, total = [], 0
    with tempfile.TemporaryDirectory() as folder, options.out.open("w", newline="", encoding="utf-8") as table:
        tree, cache, rows = Path(folder) / "tree", options.cache or Path(folder) / "cache", csv.writer(table)
        ignored = shutil.ignore_patterns(".git", "__pycache__", ".*")
        shutil.copytree(ROOT, tree, ignore=ignored)
        run = Run(tree, cache, None if options.plain else machine_code(tree, cache), options.near)
        rows.writerow(["seed", "file", "line", "before", "after", "verdict", "seconds"])
        for package in options.packages:
            chosen = random.Random(f"{options.seed} {package}").sample(mutants(package, options.plain), options.number)
            for each in chosen:
                began, found = time.monotonic(), verdict(run, package, each)
                text = (ROOT / each.file).read_bytes().split(b"\n")[each.line - 1]
                after = text[: each.start] + each.after.encode() + text[each.end :]
                spent = f"{time.monotonic() - began:.0f}"
                row = [options.seed, each.file, each.line, text.decode().strip(), after.decode().strip(), found, spent]
                rows.writerow(row)
                table.flush()
                print(*row, sep=" | ", flush=True)
                total += 1
                survivors += [row] if found.startswith("survives") else []
    print(f"{total - len(survivors)} of {total} caught; survivors:")
    for row in survivors:
        print(*row, sep=" | ")


if __name__ == "__main__":
    main()
