"""Where code that somebody brought says a thing, or fails: its file and line."""

import ast
import inspect
import os
import sysconfig
import traceback
from collections.abc import Sequence
from functools import cache
from pathlib import Path

OWN = str(Path(__file__).parent)
STANDARD = sysconfig.get_path("stdlib")
INSTALLED = (OWN, STANDARD, *map(sysconfig.get_path, ("purelib", "platlib")), "<")
LIBRARIES = {"site-packages", "dist-packages"}  # folders, of other environments too


def blamed(error: BaseException) -> str:
    """The line of code outside of dmplay and of packages that an error comes from, and the error;
    '' where there is none.
    """
    frames = traceback.extract_tb(error.__traceback__)
    own = [frame for frame in frames if not _installed(frame.filename)]
    if not own:
        return ""
    what = f"{type(error).__name__}: {error}".partition("\n")[0].removesuffix(": ")
    return f"{named(own[-1].filename, own[-1].lineno)}: {what}"


def left(error: SystemExit) -> str:
    """The line of such code that ends the program, and how; '' where dmplay does, as signals have
    it.
    """
    raised = traceback.extract_tb(error.__traceback__)[-1]
    return "" if _installed(raised.filename) else blamed(error)


def _installed(file: str) -> bool:
    """Whether a file is dmplay's, Python's or a package's."""
    return file.startswith(INSTALLED) or not LIBRARIES.isdisjoint(Path(file).parts)


def place(kind: type, name: str = "", argument: str = "", order: Sequence[str] = ()) -> str:
    """The line on which a class says a name, or an argument of the call, in this order, that is it.

    Where it leaves that to dmplay, the line on which the class begins; '' of one in no file.
    """
    for one in kind.__mro__:
        if name in vars(one) and not _file(one).startswith(OWN):
            return _line(one, name, argument, order)
    begins = _class(kind)
    return named(_file(kind), begins.lineno) if begins else ""


def named(file: str, line: int | None) -> str:
    """A file, and a line of it, as a person types it: `./tiger.py:14`."""
    path = os.path.relpath(file)
    path = file if path.startswith(os.path.join("..", "..")) else path
    path = path if path.startswith((".", os.sep)) else os.path.join(".", path)
    return f"{path}:{line}" if line else path


def _file(kind: type) -> str:
    """The file of a class; '' where it has none of its own."""
    try:
        file = inspect.getsourcefile(kind) or ""
    except (TypeError, OSError):  # built in, or made at a prompt
        return ""
    return "" if file.startswith(STANDARD) else file


@cache
def _tree(file: str, changed: float) -> ast.Module:
    return ast.parse(Path(file).read_bytes())  # in the encoding that it names


def _class(kind: type) -> ast.ClassDef | None:
    """Where a class stands in its file."""
    file = _file(kind)
    if not os.path.isfile(file):
        return None
    nodes = ast.walk(_tree(file, os.path.getmtime(file)))
    classes = (node for node in nodes if isinstance(node, ast.ClassDef))
    return next((node for node in classes if node.name == kind.__name__), None)


def _line(kind: type, name: str, argument: str, order: Sequence[str]) -> str:
    """The line of a method or a value in a class."""
    found = vars(kind)[name]
    written = getattr(found, "fget", None) or getattr(found, "func", None) or found
    if inspect.isfunction(written):
        code = written.__code__
        return named(code.co_filename, code.co_firstlineno)
    begins = _class(kind)
    for node in begins.body if begins else ():
        if any(isinstance(part, ast.Name) and part.id == name for part in _told(node)):
            return named(_file(kind), _within(node, argument, order))
    return place(kind)


def _told(node: ast.stmt) -> list[ast.AST]:
    """What a statement gives a value to."""
    targets = node.targets if isinstance(node, ast.Assign) else [getattr(node, "target", node)]
    kinds = ast.Assign | ast.AnnAssign
    return [part for one in targets for part in ast.walk(one)] if isinstance(node, kinds) else []


def _within(node: ast.stmt, argument: str, order: Sequence[str]) -> int:
    """The line of an argument of the call whose value is given; else of all."""
    call = getattr(node, "value", None)
    if not argument or not isinstance(call, ast.Call):
        return node.lineno
    given = dict(zip(order, call.args, strict=False)) | {
        one.arg: one.value for one in call.keywords
    }
    return given[argument].lineno if argument in given else node.lineno
