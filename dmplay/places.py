"""Where code that somebody brought says a thing, or fails: its file and line."""

import ast
import inspect
import os
import sysconfig
import traceback
from collections.abc import Sequence
from functools import cache
from pathlib import Path

PACKAGE_FOLDER = str(Path(__file__).parent)
STDLIB_FOLDER = sysconfig.get_path("stdlib")
INSTALLED_PREFIXES = (
    PACKAGE_FOLDER,
    STDLIB_FOLDER,
    *map(sysconfig.get_path, ("purelib", "platlib")),
    "<",
)
LIBRARY_FOLDERS = {"site-packages", "dist-packages"}  # folders, of other environments too


def describe_error_location(error: BaseException) -> str:
    """The line of code outside of dmplay and of packages that an error comes from, and the error;
    '' where there is none.
    """
    frames = traceback.extract_tb(error.__traceback__)
    own = [frame for frame in frames if not _is_installed(frame.filename)]
    if not own:
        return ""
    what = f"{type(error).__name__}: {error}".partition("\n")[0].removesuffix(": ")
    return f"{format_location(own[-1].filename, own[-1].lineno)}: {what}"


def describe_exit_location(error: SystemExit) -> str:
    """The line of such code that ends the program, and how; '' where dmplay does, as signals have
    it.
    """
    raised = traceback.extract_tb(error.__traceback__)[-1]
    return "" if _is_installed(raised.filename) else describe_error_location(error)


def _is_installed(file: str) -> bool:
    """Whether a file is dmplay's, Python's or a package's."""
    return file.startswith(INSTALLED_PREFIXES) or not LIBRARY_FOLDERS.isdisjoint(Path(file).parts)


def locate_definition(
    user_class: type, name: str = "", argument: str = "", order: Sequence[str] = ()
) -> str:
    """The line on which a class says a name, or an argument of the call, in this order, that is it.

    Where it leaves that to dmplay, the line on which the class begins; '' of one in no file.
    """
    for one in user_class.__mro__:
        if name in vars(one) and not _class_file(one).startswith(PACKAGE_FOLDER):
            return _definition_line(one, name, argument, order)
    begins = _find_class_node(user_class)
    return format_location(_class_file(user_class), begins.lineno) if begins else ""


def format_location(file: str, line: int | None) -> str:
    """A file, and a line of it, as a person types it: `./tiger.py:14`."""
    path = os.path.relpath(file)
    path = file if path.startswith(os.path.join("..", "..")) else path
    path = path if path.startswith((".", os.sep)) else os.path.join(".", path)
    return f"{path}:{line}" if line else path


def _class_file(kind: type) -> str:
    """The file of a class; '' where it has none of its own."""
    try:
        file = inspect.getsourcefile(kind) or ""
    except (TypeError, OSError):  # built in, or made at a prompt
        return ""
    return "" if file.startswith(STDLIB_FOLDER) else file


@cache
def _parse_source(file: str, changed: float) -> ast.Module:
    return ast.parse(Path(file).read_bytes())  # in the encoding that it names


def _find_class_node(kind: type) -> ast.ClassDef | None:
    """Where a class stands in its file."""
    file = _class_file(kind)
    if not os.path.isfile(file):
        return None
    nodes = ast.walk(_parse_source(file, os.path.getmtime(file)))
    classes = (node for node in nodes if isinstance(node, ast.ClassDef))
    return next((node for node in classes if node.name == kind.__name__), None)


def _definition_line(kind: type, name: str, argument: str, order: Sequence[str]) -> str:
    """The line of a method or a value in a class."""
    found = vars(kind)[name]
    written = getattr(found, "fget", None) or getattr(found, "func", None) or found
    if inspect.isfunction(written):
        code = written.__code__
        return format_location(code.co_filename, code.co_firstlineno)
    begins = _find_class_node(kind)
    for node in begins.body if begins else ():
        if any(
            isinstance(part, ast.Name) and part.id == name for part in _assignment_targets(node)
        ):
            return format_location(_class_file(kind), _argument_line(node, argument, order))
    return locate_definition(kind)


def _assignment_targets(node: ast.stmt) -> list[ast.AST]:
    """What a statement gives a value to."""
    targets = node.targets if isinstance(node, ast.Assign) else [getattr(node, "target", node)]
    kinds = ast.Assign | ast.AnnAssign
    return [part for one in targets for part in ast.walk(one)] if isinstance(node, kinds) else []


def _argument_line(node: ast.stmt, argument: str, order: Sequence[str]) -> int:
    """The line of an argument of the call whose value is given; else of all."""
    call = getattr(node, "value", None)
    if not argument or not isinstance(call, ast.Call):
        return node.lineno
    given = dict(zip(order, call.args, strict=False)) | {
        one.arg: one.value for one in call.keywords
    }
    return given[argument].lineno if argument in given else node.lineno
