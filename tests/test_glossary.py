"""Names and docstrings follow the glossary: ordinary words, one word for one concept."""

import ast
import inspect
import re
from collections import defaultdict
from collections.abc import Iterator
from contextlib import suppress
from functools import cache
from importlib import import_module
from pathlib import Path

ROOT = Path(__file__).parent.parent
PACKAGE = ROOT / "dmplay"

# Participles, pronouns and private words that name nothing. Say the thing: message, rows, seat.
BANNED_NAMES = frozenset(
    """
    told tells found known kept seen asked made held said given met shown put lasting own locked
    heeds unheeded anyone one many each some those rest who able here now beside apart anew carry
    story sight opening place came haunt crew wishes errand staged curtained veiled breach betrayed
    blamed
    """.split()  # noqa: SIM905 - a list literal would need a line a word
)
DATA_NAMES = {  # names that a file format, a protocol or another library fixes
    ("tests/truth_cases/catch.py", "opening")  # kind of a case in tests/truth/catch.json
}
QUESTION_WORD = re.compile(
    r"(Returns? )?(what|who|whose|how|where|that|whatever|whoever)\b|whether\b", re.IGNORECASE
)


@cache
def parse(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


def iter_bound_names(tree: ast.Module) -> Iterator[tuple[str, int]]:
    """Yield each name that a file binds, with its line."""
    for node in ast.walk(tree):
        match node:
            case ast.FunctionDef() | ast.AsyncFunctionDef() | ast.ClassDef():
                yield node.name, node.lineno
            case ast.arg():
                yield node.arg, node.lineno
            case ast.Name(ctx=ast.Store()):
                yield node.id, node.lineno
            case ast.Attribute(ctx=ast.Store()):
                yield node.attr, node.lineno
            case ast.ExceptHandler(name=str(name)):
                yield name, node.lineno


def list_python_files() -> list[Path]:
    return sorted([*PACKAGE.rglob("*.py"), *(ROOT / "tests").rglob("*.py")])


def test_no_name_is_a_banned_word() -> None:
    banned = [
        f"{path.relative_to(ROOT)}:{line} {name}"
        for path in list_python_files()
        for name, line in [(path.stem, 1), *iter_bound_names(parse(path))]
        if name.strip("_").lower() in BANNED_NAMES
        and (str(path.relative_to(ROOT)), name) not in DATA_NAMES
    ]
    advice = "expected names that say what they mean; BANNED_NAMES in tests/test_glossary.py"
    assert not banned, "\n".join([*banned, advice])


def test_no_docstring_begins_with_a_question_word() -> None:
    openers = [
        f"{path.relative_to(ROOT)}:{getattr(node, 'lineno', 1)} {docstring.splitlines()[0]}"
        for path in list_python_files()
        for node in ast.walk(parse(path))
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef)
        and (docstring := ast.get_docstring(node))
        and QUESTION_WORD.match(docstring)
    ]
    advice = "expected a verb or a noun first; QUESTION_WORD in tests/test_glossary.py"
    assert not openers, "\n".join([*openers, advice])


def test_a_class_name_is_used_once_except_for_one_role_per_problem() -> None:
    homes = defaultdict(list)
    for path in sorted(PACKAGE.rglob("*.py")):
        for node in ast.walk(parse(path)):
            if isinstance(node, ast.ClassDef):
                homes[node.name].append(path)
    repeated = {
        name: [str(path.relative_to(ROOT)) for path in paths]
        for name, paths in homes.items()
        if sum(path.parts[-3:][::2] != ("problems", "agents.py") for path in paths) > 1
    }
    assert not repeated, f"expected another name in one of these files: {repeated}"


def list_parameters(owner: type, name: str) -> list[str]:
    """Return the parameters of a method that a class defines itself; none for anything else."""
    attribute = vars(owner).get(name)
    function = getattr(attribute, "__func__", attribute)  # of a class method or a static one
    return [*inspect.signature(function).parameters] if inspect.isfunction(function) else []


def test_an_override_keeps_the_names_of_the_parameters() -> None:
    renamed = []
    for path in sorted(PACKAGE.rglob("[!_]*.py")):
        module_name = ".".join(path.relative_to(ROOT).with_suffix("").parts)
        with suppress(ImportError):  # of a library that is not installed
            for kind in vars(import_module(module_name)).values():
                if isinstance(kind, type) and kind.__module__ == module_name:
                    renamed += list_renamed_parameters(kind)
    assert not renamed, "\n".join(renamed)


def list_renamed_parameters(kind: type) -> list[str]:
    """Return the methods of a class whose parameters have other names than in a base class."""
    bases = [base for base in kind.__mro__[1:] if base.__module__.startswith("dmplay.")]
    return [
        f"{kind.__module__.replace('.', '/')}.py {kind.__qualname__}.{name}: expected {parameters}"
        for name in vars(kind)
        if not name.startswith("__")
        for base in bases
        if (parameters := list_parameters(base, name))
        and (overriding := list_parameters(kind, name))
        and overriding[: len(parameters)] != parameters
    ]
