"""The file and line of definitions and errors in user-defined code."""

import ast
import inspect
import os
import re
import sys
import sysconfig
import traceback
from collections.abc import Sequence
from functools import cache
from pathlib import Path

from dmplay.errors import BadParameter, clip_message

PACKAGE_FOLDER = str(Path(__file__).parents[1])
STDLIB_FOLDER = sysconfig.get_path("stdlib")
LIBRARY_PATHS = map(sysconfig.get_path, ("purelib", "platlib"))
INSTALLED_PREFIXES = (PACKAGE_FOLDER, STDLIB_FOLDER, *LIBRARY_PATHS, "<")
# folders of installed packages, also in other environments
LIBRARY_FOLDERS = {"site-packages", "dist-packages"}

# the name of a module of a file, which contains its path, and the path after it in import errors;
# starting only at the start of a word keeps the time of a long word linear
FILE_MODULE_PATTERN = re.compile(r"(?<![\w.])[\w.]+\.(file|folder)_((?:[0-9a-f]{2})+)([.\w]*)")


def describe_error_location(error: BaseException) -> str:
    """Return the line of user-defined code that an error comes from, and the error; "" if none.

    User-defined is all code outside of dmplay, the standard library and installed packages.
    """
    frames = traceback.extract_tb(error.__traceback__)
    user_frames = [frame for frame in frames if not _is_installed(frame.filename)]
    if not user_frames:
        return ""
    error_text = f"{type(error).__name__}: {replace_modules_by_files(str(error))}"
    error_text = error_text.partition("\n")[0].removesuffix(": ")
    location = format_location(user_frames[-1].filename, user_frames[-1].lineno)
    return f"{location}: {clip_message(error_text)}"


def replace_modules_by_files(text: str) -> str:
    """Return a text in which modules that are named by their path are the paths of their files."""
    return FILE_MODULE_PATTERN.sub(_format_module_path, text)


def _format_module_path(match: re.Match[str]) -> str:
    """Return the file of a module that is named by its path, and the name of an object in it."""
    kind, path, names = match[1], bytes.fromhex(match[2]).decode(), match[3].strip(".")
    if kind == "folder" and names:
        part, _, names = names.partition(".")
        path = os.path.join(path, f"{part}.py")
    return format_location(path, None) + f":{names}" * bool(names)


def check_main_guard() -> None:
    """Raise BadParameter if the main script, run again by a new process, would start it again."""
    if location := _locate_unguarded_statement():
        remedy = 'put this line below `if __name__ == "__main__":`'
        raise BadParameter(f"{location}: worker processes import this script; {remedy}")


def _locate_unguarded_statement() -> str:
    """Return the running line of the main script that each new process would run again; "" if none.

    A process that starts without this process's state imports the script. A statement that mentions
    `__name__`, such as `if __name__ == "__main__":`, is taken to be skipped there.
    """
    script = vars(sys.modules["__main__"])
    file = os.path.abspath(script.get("__file__") or "")
    for frame, line in traceback.walk_stack(None):
        code = frame.f_code
        is_script = frame.f_globals is script and code.co_name == "<module>"
        if is_script and os.path.isfile(file) and os.path.abspath(code.co_filename) == file:
            for statement in _parse_source(file, os.path.getmtime(file)).body:
                if statement.lineno <= line <= (statement.end_lineno or line):
                    names = (node.id for node in ast.walk(statement) if isinstance(node, ast.Name))
                    return "" if "__name__" in names else format_location(file, line)
    return ""


def describe_user_exit(error: SystemExit) -> str:
    """Return the line of user-defined code that ends the program, and the error; "" if none.

    The result is "" if dmplay itself ends the program, as it does for signals.
    """
    last_frame = traceback.extract_tb(error.__traceback__)[-1]
    is_user_exit = not last_frame.filename.startswith(PACKAGE_FOLDER)
    location = describe_error_location(error) if is_user_exit else ""
    return f"{location}; user code must not exit the program" if location else ""


def _is_installed(file: str) -> bool:
    """Return whether a file belongs to dmplay, the standard library or an installed package."""
    return file.startswith(INSTALLED_PREFIXES) or not LIBRARY_FOLDERS.isdisjoint(Path(file).parts)


def locate_definition(
    user_class: type, name: str = "", argument: str = "", order: Sequence[str] = ()
) -> str:
    """Return the file and line where a user-defined class defines a name.

    If the value is a call, `argument` selects the line of this argument; `order` names the
    positional ones. If the class leaves the name to dmplay, return the line where the class begins;
    "" for a class without a file.
    """
    for base in user_class.__mro__:
        if name in vars(base) and not _find_class_file(base).startswith(PACKAGE_FOLDER):
            return _locate_definition(base, name, argument, order)
    class_node = _find_class_node(user_class)
    return format_location(_find_class_file(user_class), class_node.lineno) if class_node else ""


def format_location(file: str, line: int | None) -> str:
    """Return a file and a line as a person types them: `./tiger.py:14`."""
    path = os.path.relpath(file)
    path = file if path.startswith(os.path.join("..", "..")) else path
    path = path if path.startswith((".", os.sep)) else os.path.join(".", path)
    return f"{path}:{line}" if line else path


def locate_assignment(file: str, name: str) -> str:
    """Return a file, and the line on which it assigns or defines a name at its top, if any."""
    nodes = _parse_source(file, os.path.getmtime(file)).body if os.path.isfile(file) else []
    lines = [node.lineno for node in nodes if name in _list_defined_names(node)]
    return format_location(file, lines[-1] if lines else None)


def _list_defined_names(node: ast.stmt) -> list[str]:
    """Return the names that an assignment, a definition or an import defines."""
    if isinstance(node, ast.Import | ast.ImportFrom):
        return [alias.asname or alias.name for alias in node.names]
    targets = [target.id for target in _list_assigned_nodes(node) if isinstance(target, ast.Name)]
    return [*targets, getattr(node, "name", "")]


def locate_function(function: object) -> str:
    """Return the file and line of a user-defined function; "" for any other object."""
    code = getattr(inspect.unwrap(function) if callable(function) else None, "__code__", None)
    if code is None or _is_installed(code.co_filename):
        return ""
    return format_location(code.co_filename, code.co_firstlineno)


def _find_class_file(kind: type) -> str:
    """Return the source file of a class; "" if it has none, or one of the standard library."""
    try:
        file = inspect.getsourcefile(kind) or ""
    except (TypeError, OSError):  # built in, or defined at a prompt
        return ""
    return "" if file.startswith(STDLIB_FOLDER) else file


@cache
def _parse_source(file: str, changed: float) -> ast.Module:
    """Return the syntax tree of a file, cached by its modification time."""
    # bytes, so that the encoding declaration is respected
    return ast.parse(Path(file).read_bytes())


def _find_class_node(kind: type) -> ast.ClassDef | None:
    """Return the syntax node of a class in its file; None if the file or the class is missing."""
    file = _find_class_file(kind)
    if not os.path.isfile(file):
        return None
    nodes = ast.walk(_parse_source(file, os.path.getmtime(file)))
    classes = (node for node in nodes if isinstance(node, ast.ClassDef))
    return next((node for node in classes if node.name == kind.__name__), None)


def _locate_definition(kind: type, name: str, argument: str, order: Sequence[str]) -> str:
    """Return the file and line of a method or a value that a class itself defines."""
    attribute = vars(kind)[name]
    function = getattr(attribute, "fget", None) or getattr(attribute, "func", None) or attribute
    if inspect.isfunction(function):
        code = function.__code__
        return format_location(code.co_filename, code.co_firstlineno)
    class_node = _find_class_node(kind)
    for node in class_node.body if class_node else ():
        targets = (target for target in _list_assigned_nodes(node) if isinstance(target, ast.Name))
        if name in {target.id for target in targets}:
            return format_location(
                _find_class_file(kind), _find_argument_line(node, argument, order)
            )
    return locate_definition(kind)


def _list_assigned_nodes(node: ast.stmt) -> list[ast.AST]:
    """Return the nodes of the targets that an assignment assigns to; empty for other statements."""
    if not isinstance(node, ast.Assign | ast.AnnAssign):
        return []
    targets = node.targets if isinstance(node, ast.Assign) else [node.target]
    return [child for target in targets for child in ast.walk(target)]


def _find_argument_line(node: ast.stmt, argument: str, order: Sequence[str]) -> int:
    """Return the line of an argument of the assigned call, else the line of the statement."""
    call = getattr(node, "value", None)
    if not argument or not isinstance(call, ast.Call):
        return node.lineno
    arguments: dict[str | None, ast.expr] = dict(zip(order, call.args, strict=False))
    arguments |= {keyword.arg: keyword.value for keyword in call.keywords}
    return arguments[argument].lineno if argument in arguments else node.lineno
