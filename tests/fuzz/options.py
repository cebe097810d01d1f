"""What stands on the command line and in files of settings: parameters, agents, and the rest."""

import json
from random import Random

from dmplay.finding import agents, problems
from tests.fuzz import absurd
from tests.fuzz.case import Case
from tests.fuzz.lines import lines, problem
from tests.fuzz.mutations import AGENTS, near
from tests.support.seats import FOREIGN

PONDEROUS = {"equilibrium", "joint-plan"}  # agents that, as they are, take longer than a case
SOON = "simulations=100"  # with which a search for the whole of a game chooses within a case
OPTIONS = (
    "--seed", "--episode", "--turns", "--variant", "--vs", "--seat", "--rate", "--speed", "--width",
    "--keys", "--theme", "--color", "-o", "--record", "--json", "--strict", "--quiet", "--plain",
    "--no-input", "--no-motion", "--ascii", "--nothing", "--help", "--set", "--agent",
)  # fmt: skip
COMMANDS = (
    "play", "list", "info", "agents", "guide", "config", "shell", "verify", "export", "review",
    "replay", "resume", "branch", "figure",
)  # fmt: skip
SETTINGS = (
    "color", "theme", "ascii", "width", "speed", "plain", "motion", "input", "keys", "aliases",
    "play", "play.turns", "play.seed", "play.agent", "play.rate", "verify.allow-unfinished",
    "keys.hex", "keys.hex.k", "keys.2048", "keys.preset", "aliases.hw", "export.width", "nothing",
)  # fmt: skip
TOML = (
    "true", "false", "0", "1", "-1", "80", "1e400", "nan", "inf", "''", '"never"', '"\\u001b[2J"',
    '"\\u202e"', "[]", "{}", "[[1]]", '"left"', "1979-05-27", "9" * 400, '"nw"', "[1, 'a']", "0x10",
    "[" * 2000, '"' + "x" * 5000 + '"', '"play 2048"', '"\'"', "", "=", '"""a\nb"""',
)  # fmt: skip


def parameter(random: Random) -> Case:
    """A game with another parameter: `--set`."""
    name = problem(random)
    known = problems.parameter_values(problems.load_problem(name))
    said = [_setting(random, known) for _ in range(random.choice((1, 1, 2)))]
    return _played(random, name, *(word for one in said for word in ("--set", one)))


def agent(random: Random) -> Case:
    """A game with another agent: `--agent`."""
    name = problem(random)
    every = agents.load_roster(problems.load_problem(name)).agents
    roster = {base: make for base, make in every.items() if base not in FOREIGN | PONDEROUS}
    base = random.choice((*roster, *AGENTS))
    known = agents.default_parameters(roster[base]) if base in roster else {}
    given = [_setting(random, known) for _ in range(random.choice((0, 1, 1, 2)) if known else 0)]
    if base == "search" and not any(one.startswith("simulations") for one in given):
        given.append(SOON)
    who = f"{base}:{','.join(given)}" if given else base
    if random.random() < 0.2:
        who = absurd.argument(random) + who
    return _played(random, name, "--agent", who)


def words(random: Random) -> Case:
    """Any words of the command line."""
    said = [random.choice(COMMANDS) if random.random() < 0.8 else problem(random)]
    for _ in range(random.randint(0, 4)):
        odd = absurd.argument(random)
        said.append(random.choice((random.choice(OPTIONS), odd, problem(random))))
    return Case(tuple(said), typed=lines(random, problem(random)))


def completed(random: Random) -> Case:
    """The same words, of which a shell asks what can follow."""
    said = " ".join(("dmplay", *words(random).words))
    variables = {
        "_DMPLAY_COMPLETE": f"complete_{random.choice(('bash', 'zsh', 'fish', 'powershell'))}",
        "COMP_WORDS": said,
        "COMP_CWORD": random.choice(("1", "2", "3", absurd.argument(random))),
        "_TYPER_COMPLETE_ARGS": said,
        "_TYPER_COMPLETE_WORD_TO_COMPLETE": absurd.argument(random),
    }
    return Case(variables=variables)


def settings(random: Random) -> Case:
    """A folder's file of settings, and a command in it."""
    many = random.randint(1, 3)
    rows = [f"{random.choice(SETTINGS)} = {random.choice(TOML)}\n" for _ in range(many)]
    text = "".join(rows).encode()
    if random.random() < 0.2:
        at = random.randrange(len(text) + 1)
        text = text[:at] + absurd.raw(random) + text[at:]
    said = random.choice(
        (("config", "show"), ("config", "show", "--json"), ("config", "path"), ("list",), ("hw",),
         ("hexworld", "--agent", "random", "--turns", "1"), ("2048", "--turns", "1"))
    )  # fmt: skip
    variables = {}
    if random.random() < 0.3:
        variable = random.choice(("COLOR", "WIDTH", "KEYS", "SET", "PLAY_TURNS", "SPEED", "THEME"))
        variables[f"DMPLAY_{variable}"] = absurd.argument(random)
    if random.random() < 0.1:
        variables["COLUMNS"] = absurd.argument(random)
    where = random.choice(("dmplay.toml", "config/dmplay/config.toml"))
    return Case(said, {where: text}, typed="e\nquit\n", variables=variables)


def _played(random: Random, name: str, *more: str) -> Case:
    last = ("--turns", random.choice("12"), "--seed", "3")
    return Case((name, *more, *last), typed=lines(random, name))


def _setting(random: Random, known: dict[str, object]) -> str:
    key = random.choice((*known, *known, *known, absurd.argument(random)))
    odd = random.choice((absurd.value(random).replace("\0", ""), absurd.argument(random)))
    value = random.choice((odd, near(random, known.get(key, 1)), json.dumps(known.get(key, 1))))
    return f"{key}={value}" if random.random() < 0.95 else key
