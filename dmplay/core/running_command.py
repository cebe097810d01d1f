"""The command of the command line that runs, as the source of what is written."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple


class RunningCommand(NamedTuple):
    """A command without aliases, variables and settings, which are resolved."""

    words: tuple[str, ...] = ()  # empty if no command runs
    options: Mapping[str, Any] = {}  # all, also those with defaults


_running = [RunningCommand()]  # the last one runs


def set_running_command(command: RunningCommand) -> None:
    """Set the command whose output is written from now on."""
    _running[:] = [command]


def get_running_command() -> RunningCommand:
    """Return the command that runs; it has no words if none does."""
    return _running[-1]


def list_words(options: Sequence[Any], values: Mapping[str, Any]) -> Iterator[str]:
    """Yield the words that set the options of a command which differ from their defaults.

    `options` are the options and arguments of a command of the command line, in their order.
    """
    for option in options:
        value = values.get(option.name)
        items = value if isinstance(value, list | tuple) else [value]
        texts = [str(item) for item in items if item is not None and item != ""]
        if option.param_type_name == "argument":
            yield from texts
        elif value == option.default or not texts:
            continue
        elif isinstance(value, bool):
            yield from (option.opts if value else option.secondary_opts)[:1]
        else:
            for text in texts:
                yield from (max(option.opts, key=len), text)
