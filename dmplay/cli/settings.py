"""Files and environment as the options of commands: what they may set, what is in force and why."""

import json
import os
from collections.abc import Iterable, Iterator, Mapping
from typing import Any, NamedTuple

import typer

from dmplay.cli import config
from dmplay.errors import BadParameter, UnknownName

COMMAND_LINE_ONLY = ("execute", "force", "help", "output", "record", "trust", "update", "write")
VALUE_TYPES: dict[str, tuple[tuple[type, ...], str]] = {  # by how click's name of a type begins
    "bool": ((bool,), "true or false"),
    "int": ((int,), "a whole number"),
    "float": ((int, float), "a number"),
    "": ((str,), "text"),
}
CommandsByName = Mapping[str, Any]  # click's, by name


class EffectiveSetting(NamedTuple):
    """The value of an option and where it comes from: a file, a variable, or the default."""

    name: str
    value: object
    source: str


def configurable_options(command: Any) -> dict[str, Any]:
    """The options of a command that files may set, by their long names."""
    named = {
        max(one.opts, key=len).lstrip("-"): one
        for one in command.params
        if one.param_type_name == "option"
    }
    return {name: one for name, one in named.items() if name not in COMMAND_LINE_ONLY}


def config_defaults(commands: CommandsByName) -> dict[str, dict[str, object]]:
    """What the files set, as click takes it: command -> parameter -> value."""
    found: dict[str, dict[str, object]] = {}
    for file in config.load_config_files():
        _reject_unknown_names(file, commands)
        for name, command in commands.items():
            for option, value in _iter_file_options(file, name, command):
                found.setdefault(name, {})[configurable_options(command)[option].name] = value
    return found


def _iter_file_options(
    file: config.ConfigFile, command_name: str, command: Any
) -> Iterator[tuple[str, object]]:
    """The options that a file sets for a command, checked."""
    known = configurable_options(command)
    general = {key: value for key, value in file.options.items() if key in known}
    if file.key_preset is not None and "keys" in known:
        general["keys"] = file.key_preset
    own = file.commands.get(command_name, {})
    for option, value in {**general, **own}.items():
        inside = {"keys": "keys.preset"}.get(option, option)
        where = f"{file.path}: {f'{command_name}.{option}' if option in own else inside}"
        if option not in known:
            raise UnknownName(
                "setting", option, known, error_prefix=f"{file.path}: [{command_name}]"
            )
        hints = (option, value) == ("strict", "hints")  # as it is said of the flag
        if not hints:
            _check_value(known[option], value, where)
        if not file.is_user_file:
            config.check_project_option(option, where)
        yield ("strict-hints", True) if hints else (option, value)


def _reject_unknown_names(file: config.ConfigFile, commands: CommandsByName) -> None:
    """Refuses settings, tables and aliases of names that a file cannot have."""
    for name in file.options:
        if name not in config.GENERAL_OPTIONS:
            known = [*config.GENERAL_OPTIONS, "keys", "aliases", *commands]
            raise UnknownName("setting", name, known, error_prefix=file.path)
    for name in file.commands:
        if name not in commands:
            raise UnknownName("table", name, ["keys", "aliases", *commands], error_prefix=file.path)
    for name in file.aliases:
        if name in commands:
            raise BadParameter(f"{file.path}: aliases.{name}: {name} is a command")


def _check_value(option: Any, value: object, location: str) -> None:
    """Refuses a value of another type, or out of bounds."""
    fitting, kind = next(
        told for word, told in VALUE_TYPES.items() if option.type.name.startswith(word)
    )
    if option.multiple and not isinstance(value, list):
        raise BadParameter(f"{location}: got {value!r}, expected a list, as [{value!r}]")
    for one in value if isinstance(value, list) and option.multiple else [value]:
        if type(one) not in fitting:
            raise BadParameter(f"{location}: got {one!r}, expected {kind}")
        try:
            option.type.convert(one, option, None)
        except typer.BadParameter as error:
            message = error.message.rstrip(".")
            raise BadParameter(f"{location}: {message[:1].lower()}{message[1:]}") from None
        except OverflowError:  # of more digits than a number can have
            raise BadParameter(f"{location}: expected {kind}, which is not as large") from None


def iter_effective_settings(root: Any) -> Iterator[EffectiveSetting]:
    """Every option of every command with its value; `root` is click's context of the program."""
    set_by = _option_files(root.command.commands)
    for name, command in root.command.commands.items():
        with command.make_context(name, [], parent=root, resilient_parsing=True) as context:
            for option, one in configurable_options(command).items():
                source = context.get_parameter_source(one.name).name
                told = {
                    "DEFAULT_MAP": set_by.get((name, option), ""),
                    "ENVIRONMENT": _variable_name(one, context),
                }.get(source, "default")
                yield EffectiveSetting(f"{name}.{option}", context.params.get(one.name), told)


def _option_files(commands: CommandsByName) -> dict[tuple[str, str], str]:
    """The file that sets an option."""
    return {
        (name, option): file.path
        for file in config.load_config_files()
        for name, command in commands.items()
        for option, _ in _iter_file_options(file, name, command)
    }


def _variable_name(option: Any, context: Any) -> str:
    own = [option.envvar] if isinstance(option.envvar, str) else []
    names = [*own, f"{context.auto_envvar_prefix}_{option.name.upper()}"]
    return next((name for name in names if os.environ.get(name)), names[-1])


def iter_keys_and_aliases() -> Iterator[EffectiveSetting]:
    """The keys and aliases that files set."""
    for file in config.load_config_files():
        for family, own in file.keys.items():
            for key, label in own.items():
                yield EffectiveSetting(f"keys.{family}.{key}", label, file.path)
        for alias, line in file.aliases.items():
            yield EffectiveSetting(f"aliases.{alias}", line, file.path)


def format_settings(settings: Iterable[EffectiveSetting], *, as_json: bool) -> str:
    """Settings for people, those at their default only for `play`; or all of them as data."""
    if as_json:
        return json.dumps([one._asdict() for one in settings], default=str)
    rows = [one for one in settings if one.source != "default" or one.name.startswith("play.")]
    return "\n".join(f"{one.name:<18} {_format_value(one.value):<24} {one.source}" for one in rows)


def _format_value(value: object) -> str:
    return "-" if value is None or value == [] else json.dumps(value, default=str)
