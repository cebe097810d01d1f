"""Command lines and settings files: parameters, agents, options and nonsense."""

import json
from random import Random

from dmplay.registry import agents, problems
from tests.fuzz import hostile_values
from tests.fuzz.case import Case
from tests.fuzz.mutations import AGENT_TEXTS, draw_similar_value
from tests.fuzz.typed_lines import draw_lines, draw_problem_name
from tests.support.seated_agents import EXTERNAL_AGENTS

SLOW_AGENTS = {"equilibrium", "joint-plan"}  # agents whose default settings take longer than a case
FAST_SEARCH_SETTING = "simulations=100"  # lets a search of whole games choose within a case
OPTION_NAMES = (
    "--seed", "--episode", "--turns", "--variant", "--vs", "--seat", "--rate", "--speed", "--width",
    "--keys", "--theme", "--color", "-o", "--record", "--json", "--strict", "--quiet", "--plain",
    "--no-input", "--no-motion", "--ascii", "--nothing", "--help", "--set", "--agent",
)  # fmt: skip
COMMAND_NAMES = (
    "play", "list", "info", "agents", "guide", "config", "shell", "verify", "export", "review",
    "replay", "resume", "branch", "plot",
)  # fmt: skip
SETTING_KEYS = (
    "color", "theme", "ascii", "width", "speed", "plain", "motion", "input", "keys", "aliases",
    "play", "play.turns", "play.seed", "play.agent", "play.rate", "verify.allow-unfinished",
    "keys.hex", "keys.hex.k", "keys.2048", "keys.preset", "aliases.hw", "export.width", "nothing",
)  # fmt: skip
TOML_VALUES = (
    "true", "false", "0", "1", "-1", "80", "1e400", "nan", "inf", "''", '"never"', '"\\u001b[2J"',
    '"\\u202e"', "[]", "{}", "[[1]]", '"left"', "1979-05-27", "9" * 400, '"nw"', "[1, 'a']", "0x10",
    "[" * 2000, '"' + "x" * 5000 + '"', '"play 2048"', '"\'"', "", "=", '"""a\nb"""',
)  # fmt: skip


def draw_parameter_case(random: Random) -> Case:
    """Draw a game with other parameters: `--set`."""
    name = draw_problem_name(random)
    parameters = problems.parameter_values(problems.load_problem(name))
    assignments = [_draw_assignment(random, parameters) for _ in range(random.choice((1, 1, 2)))]
    return _make_game_case(
        random, name, *(word for assignment in assignments for word in ("--set", assignment))
    )


def draw_agent_case(random: Random) -> Case:
    """Draw a game with another agent: `--agent`."""
    name = draw_problem_name(random)
    all_agents = agents.load_roster(problems.load_problem(name)).agents
    roster = {
        base: make for base, make in all_agents.items() if base not in EXTERNAL_AGENTS | SLOW_AGENTS
    }
    base = random.choice((*roster, *AGENT_TEXTS))
    defaults = agents.default_parameters(roster[base]) if base in roster else {}
    assignments = [
        _draw_assignment(random, defaults)
        for _ in range(random.choice((0, 1, 1, 2)) if defaults else 0)
    ]
    if base == "search" and not any(
        assignment.startswith("simulations") for assignment in assignments
    ):
        assignments.append(FAST_SEARCH_SETTING)
    agent_text = f"{base}:{','.join(assignments)}" if assignments else base
    if random.random() < 0.2:
        agent_text = hostile_values.draw_argument(random) + agent_text
    return _make_game_case(random, name, "--agent", agent_text)


def draw_command_line_case(random: Random) -> Case:
    """Draw any command line."""
    arguments = [
        random.choice(COMMAND_NAMES) if random.random() < 0.8 else draw_problem_name(random)
    ]
    for _ in range(random.randint(0, 4)):
        nonsense = hostile_values.draw_argument(random)
        arguments.append(
            random.choice((random.choice(OPTION_NAMES), nonsense, draw_problem_name(random)))
        )
    return Case(tuple(arguments), typed=draw_lines(random, draw_problem_name(random)))


def draw_completion_case(random: Random) -> Case:
    """Draw a command line for which a shell asks for completions."""
    command_line = " ".join(("dmplay", *draw_command_line_case(random).words))
    variables = {
        "_DMPLAY_COMPLETE": f"complete_{random.choice(('bash', 'zsh', 'fish', 'powershell'))}",
        "COMP_WORDS": command_line,
        "COMP_CWORD": random.choice(("1", "2", "3", hostile_values.draw_argument(random))),
        "_TYPER_COMPLETE_ARGS": command_line,
        "_TYPER_COMPLETE_WORD_TO_COMPLETE": hostile_values.draw_argument(random),
    }
    return Case(variables=variables)


def draw_settings_case(random: Random) -> Case:
    """Draw a settings file in a folder, and a command to run there."""
    row_count = random.randint(1, 3)
    rows = [
        f"{random.choice(SETTING_KEYS)} = {random.choice(TOML_VALUES)}\n" for _ in range(row_count)
    ]
    text = "".join(rows).encode()
    if random.random() < 0.2:
        position = random.randrange(len(text) + 1)
        text = text[:position] + hostile_values.draw_bytes(random) + text[position:]
    arguments = random.choice(
        (("config", "show"), ("config", "show", "--json"), ("config", "path"), ("list",), ("hw",),
         ("hexworld", "--agent", "random", "--turns", "1"), ("2048", "--turns", "1"))
    )  # fmt: skip
    variables = {}
    if random.random() < 0.3:
        variable = random.choice(("COLOR", "WIDTH", "KEYS", "SET", "PLAY_TURNS", "SPEED", "THEME"))
        variables[f"DMPLAY_{variable}"] = hostile_values.draw_argument(random)
    if random.random() < 0.1:
        variables["COLUMNS"] = hostile_values.draw_argument(random)
    path = random.choice(("dmplay.toml", "config/dmplay/config.toml"))
    return Case(arguments, {path: text}, typed="e\nquit\n", variables=variables)


def _make_game_case(random: Random, name: str, *more: str) -> Case:
    last = ("--turns", random.choice("12"), "--seed", "3")
    return Case((name, *more, *last), typed=draw_lines(random, name))


def _draw_assignment(random: Random, defaults: dict[str, object]) -> str:
    key = random.choice((*defaults, *defaults, *defaults, hostile_values.draw_argument(random)))
    nonsense = random.choice(
        (hostile_values.draw_value(random).replace("\0", ""), hostile_values.draw_argument(random))
    )
    value = random.choice(
        (
            nonsense,
            draw_similar_value(random, defaults.get(key, 1)),
            json.dumps(defaults.get(key, 1)),
        )
    )
    return f"{key}={value}" if random.random() < 0.95 else key
