"""Map config files and environment variables to CLI options, and list the effective settings."""

import inspect
import json
import os
from collections import deque
from collections.abc import Iterable, Iterator
from typing import Any, Literal, NamedTuple, get_args, get_origin

import typer

from dmplay.cli import config_files
from dmplay.cli.commands import COMMANDS, build_command
from dmplay.core.text import format_json_report
from dmplay.errors import BadParameter, UnknownName

COMMAND_LINE_ONLY = ("execute", "force", "help", "output", "record", "trust", "update", "write")
# they suit some problems only
PROBLEM_OPTIONS = ("agent", "ghost", "predict", "seat", "state-belief", "set", "variant", "vs")
VALUE_TYPES: dict[type, tuple[tuple[type, ...], str]] = {
    bool: ((bool,), "true or false"),
    int: ((int,), "a whole number"),
    float: ((int, float), "a number"),
    str: ((str,), "text"),  # also of paths and choices
}


class EffectiveSetting(NamedTuple):
    """The value of an option and its source: a file, an environment variable, or the default."""

    name: str
    value: object
    source: str


def list_configurable_options(command: Any) -> dict[str, Any]:
    """Return the options of a command that config files may set, by long name."""
    by_name = {
        max(option.opts, key=len).lstrip("-"): option
        for option in command.params
        if option.param_type_name == "option"
    }
    return {name: option for name, option in by_name.items() if name not in COMMAND_LINE_ONLY}


def load_command_defaults(name: str) -> dict[str, dict[str, object]]:
    """Return the values that config files set for a command, as click's default map.

    It has the form command -> parameter -> value. Raise UnknownName or BadParameter if a file has
    an unknown name or an invalid value, also for another command.
    """
    values: dict[str, object] = {}
    for file in config_files.load_config_files():
        _reject_unknown_names(file)
        for table in {"play", *file.commands} - {name}:  # `play` has all general options
            deque(_iter_file_options(file, table), maxlen=0)
        if name in COMMANDS:
            parameters = list_configurable_options(build_command(name))
            for option, value in _iter_file_options(file, name):
                values[parameters[option].name] = value
    return {name: values}


def _iter_file_options(
    file: config_files.ConfigFile, command_name: str
) -> Iterator[tuple[str, object]]:
    """Yield the (option, value) pairs that a config file sets for a command, after checking them.

    Raise UnknownName for an option that the command does not have. `strict = "hints"` is yielded as
    the flag `strict-hints`. Raise an error for an option that suits some problems only, and if a
    project's file sets an option that only the user's own file may set.
    """
    command = build_command(command_name)
    available = list_configurable_options(command)
    annotations = inspect.signature(command.callback).parameters if available else {}
    presets = {} if file.key_preset is None else {"keys": file.key_preset}
    general_options = {
        option: value
        for option, value in {**file.options, **presets}.items()
        if option in available
    }
    command_options = file.commands.get(command_name, {})
    for option, value in {**general_options, **command_options}.items():
        general_key = "keys.preset" if option == "keys" else option
        key = f"{command_name}.{option}" if option in command_options else general_key
        location = f"{file.path}: {key}"
        if option not in available:
            prefix = f"{file.path}: [{command_name}]"
            raise UnknownName("setting", option, available, error_prefix=prefix)
        if option in PROBLEM_OPTIONS:
            command_line = f"{command_name} PROBLEM --{option} ..."
            raise BadParameter(
                f"{location}: a settings file applies to every problem; type --{option}, or define "
                f'an alias in your own config.toml, such as [aliases] my = "{command_line}"'
            )
        is_strict_hints = (option, value) == ("strict", "hints")
        if not is_strict_hints:
            _check_option_value(annotations[available[option].name].annotation, value, location)
        if not file.is_user_file:
            config_files.check_project_option(option, location)
        yield ("strict-hints", True) if is_strict_hints else (option, value)


def _reject_unknown_names(file: config_files.ConfigFile) -> None:
    """Raise an error for an unknown setting or table, or an alias named as a command."""
    for name in file.options:
        if name not in config_files.GENERAL_OPTIONS:
            allowed = [*config_files.GENERAL_OPTIONS, "keys", "aliases", *COMMANDS]
            raise UnknownName("setting", name, allowed, error_prefix=file.path)
    for name in file.commands:
        if name not in COMMANDS:
            raise UnknownName("table", name, ["keys", "aliases", *COMMANDS], error_prefix=file.path)
    for name in file.aliases:
        if name in COMMANDS:
            location = f"{file.path}: aliases.{name}"
            raise BadParameter(f"{location}: {name} is a command; choose another name")


def _check_option_value(annotation: Any, value: object, location: str) -> None:
    """Raise BadParameter if a value has the wrong type for an option or is out of its bounds.

    `annotation` is that of the command's parameter: Annotated, with a Typer option.
    """
    value_type, typer_option = get_args(annotation)
    parts = [value_type, *get_args(value_type)]
    accepted_types, description = VALUE_TYPES[next((t for t in parts if t in VALUE_TYPES), str)]
    choices = next((get_args(part) for part in parts if get_origin(part) is Literal), ())
    is_list = get_origin(value_type) is list
    if is_list and not isinstance(value, list):
        raise BadParameter(f"{location}: got {value!r}, expected a list, such as [{value!r}]")
    for item in value if isinstance(value, list) and is_list else [value]:
        if type(item) not in accepted_types:
            raise BadParameter(f"{location}: got {item!r}, expected {description}")
        if choices and item not in choices:
            raise UnknownName("value", str(item), choices, error_prefix=location)
        if typer_option.parser:
            try:
                typer_option.parser(item)
            except typer.BadParameter as error:
                raise BadParameter(f"{location}: {error.message}") from None


def iter_effective_settings(root: Any) -> Iterator[EffectiveSetting]:
    """Yield every option of every command with its value and source.

    `root` is click's context of the program.
    """
    path_by_option = {  # the last file wins
        (name, option): file.path
        for file in config_files.load_config_files()
        for name in COMMANDS
        for option, _ in _iter_file_options(file, name)
    }
    for name in COMMANDS:
        command = build_command(name)
        defaults = load_command_defaults(name)[name]
        with command.make_context(
            name, [], parent=root, resilient_parsing=True, default_map=defaults
        ) as context:
            for option, parameter in list_configurable_options(command).items():
                source = context.get_parameter_source(parameter.name).name
                origin = {
                    "DEFAULT_MAP": path_by_option.get((name, option), ""),
                    "ENVIRONMENT": _variable_name(parameter, context),
                }.get(source, "default")
                value = context.params.get(parameter.name)
                yield EffectiveSetting(f"{name}.{option}", value, origin)


def _variable_name(option: Any, context: Any) -> str:
    """Return the environment variable that sets an option, or the one that would set it."""
    explicit_names = [option.envvar] if isinstance(option.envvar, str) else []
    names = [*explicit_names, f"{context.auto_envvar_prefix}_{option.name.upper()}"]
    return next((name for name in names if os.environ.get(name)), names[-1])


def iter_keys_and_aliases() -> Iterator[EffectiveSetting]:
    """Yield the key bindings and command aliases that config files set."""
    for file in config_files.load_config_files():
        for family, labels_by_key in file.keys.items():
            for key, label in labels_by_key.items():
                yield EffectiveSetting(f"keys.{family}.{key}", label, file.path)
        for alias, line in file.aliases.items():
            yield EffectiveSetting(f"aliases.{alias}", line, file.path)


def format_settings(settings: Iterable[EffectiveSetting], *, as_json: bool) -> str:
    """Return settings as text or as JSON.

    The JSON lists all settings; the text lists defaults only for the command `play`.
    """
    if as_json:
        return format_json_report({"settings": [setting._asdict() for setting in settings]})
    return "\n".join(
        f"{name:<18} {_format_value(value):<24} {source}"
        for name, value, source in settings
        if source != "default" or name.startswith("play.")
    )


def _format_value(value: object) -> str:
    """Return a setting's value as JSON, or '-' if it is None or an empty list."""
    return "-" if value is None or value == [] else json.dumps(value, default=str)
