"""JSON that programs exchange: a tournament's kept file, messages to a bot, and reports."""

import json
from functools import cache
from random import Random

from tests.fuzz import hostile_values
from tests.fuzz.case import Case
from tests.fuzz.mutations import change_bytes, replace_value
from tests.fuzz.program import run_dmplay

CUP_FILE, REPORT_FILE = "cup", "report.json"
TOURNAMENTS = (
    ("prisoners-dilemma", "grim", "tit-for-tat", "--turns", "2"),
    ("rock-paper-scissors", "nash", "random", "--turns", "3"),
    ("multicaregiver-crying-baby", "random", "feed-when-crying", "--turns", "3"),
)
HEXWORLD_MESSAGES = (
    """{"type": "hello", "protocol": 1, "problem": "hexworld", "parameters": {"discount": 0.9, """
    """"slip": 0.3, "bump_cost": 1.0, "hexes": [[4, 2], [5, 2], [4, 1]], "rewards": """
    """[[[5, 2], 5.0]]}, "turns": 2, "seat": "agent", "offers": ["history", "games"]}""",
    """{"type": "turn", "game": 0, "turn": 0, "observation": "(4,2)"}""",
    """{"type": "act", "id": 1, "game": 0, "turn": 1, "observation": "(4,2)", "legal": """
    """["e", "ne", "nw", "w", "sw", "se"], "luck": [0.962827634]}""",
    """{"type": "turn", "game": 0, "turn": 1, "action": "se", "observation": "(4,2)", """
    """"actions": {"agent": "se"}, "reward": -1.0}""",
    """{"type": "act", "id": 2, "game": 0, "turn": 2, "observation": "(4,2)", "legal": ["e"]}""",
)
BABY_MESSAGES = (
    """{"type": "hello", "protocol": 1, "problem": "crying-baby", "parameters": {"discount": """
    """0.9, "becomes_hungry": 0.1}, "turns": 2, "seat": "agent", "offers": []}""",
    """{"type": "turn", "game": 0, "turn": 0, "observation": null}""",
    """{"type": "act", "id": 1, "game": 0, "turn": 1, "observation": null, "legal": ["feed"]}""",
    """{"type": "turn", "game": 0, "turn": 1, "action": "feed", "observation": "quiet"}""",
    """{"type": "act", "id": 2, "game": 0, "turn": 2, "observation": "quiet", "legal": """
    """["feed", "sing", "ignore"]}""",
)
DILEMMA_MESSAGES = (
    """{"type": "hello", "protocol": 1, "problem": "prisoners-dilemma", "parameters": """
    """{"discount": 1.0}, "turns": 2, "seat": "agent1", "offers": ["games"]}""",
    """{"type": "turn", "game": 0, "turn": 0, "observation": "-"}""",
    """{"type": "act", "id": 1, "game": 0, "turn": 1, "legal": ["cooperate", "defect"]}""",
    """{"type": "turn", "game": 0, "turn": 1, "action": "cooperate", "observation": "-", """
    """"actions": {"agent1": "cooperate", "agent2": "defect"}, "reward": -4.0}""",
    """{"type": "act", "id": 2, "game": 0, "turn": 2, "legal": ["cooperate", "defect"]}""",
)
REGULATOR_MESSAGES = (
    """{"type": "hello", "protocol": 1, "problem": "simple-regulator", "parameters": """
    """{"noise": 0.1}, "turns": 2, "seat": "agent", "offers": ["history"]}""",
    """{"type": "turn", "game": 0, "turn": 0, "observation": [0.26952777460069016]}""",
    """{"type": "act", "id": 1, "game": 0, "turn": 1, "legal": {"low": -10.0, "high": 10.0}}""",
    """{"type": "turn", "game": 0, "turn": 1, "action": -0.27, "observation": [-0.0968]}""",
    """{"type": "act", "id": 2, "game": 0, "turn": 2, "legal": {"low": -10.0, "high": 10.0}}""",
)
REPORTS = (
    ("run", "hexworld", "--agent", "random", "--episodes", "2", "--turns", "3"),
    ("compare", "crying-baby", "qmdp", "random", "--episodes", "2", "--turns", "3"),
    ("evaluate", "random", "crying-baby", "hexworld", "--episodes", "2", "--turns", "3"),
    ("solve", "prisoners-dilemma"),
)
LONG_OPTIONS = ("episodes", "until_se", "turns", "work", "decide")  # a large number takes long
# messages of whole games by the words of the agents that answer them
MESSAGES_BY_BOT = {
    ("random", "--problem", "hexworld"): HEXWORLD_MESSAGES,
    ("optimal", "--problem", "hexworld"): HEXWORLD_MESSAGES,
    ("qmdp", "--problem", "crying-baby"): BABY_MESSAGES,
    ("tit-for-tat", "--problem", "prisoners-dilemma"): DILEMMA_MESSAGES,
    ("optimal", "--problem", "simple-regulator"): REGULATOR_MESSAGES,
}


def draw_tournament_case(random: Random) -> Case:
    """Draw a tournament that goes on from a file that was changed by hand."""
    words = random.choice(TOURNAMENTS)
    content = change_rows(random, [*_list_kept_rows(words)], first_share=0.1)
    more = random.choice(((), (), ("--json",), ("--csv",)))
    return Case(
        (*_tournament_words(words), *more), {CUP_FILE: content.encode(errors="surrogatepass")}
    )


def _tournament_words(words: tuple[str, ...]) -> tuple[str, ...]:
    return ("tournament", *words, "--episodes", "2", "-o", CUP_FILE)


@cache
def _list_kept_rows(words: tuple[str, ...]) -> tuple[str, ...]:
    """Return the lines of the file that a tournament keeps."""
    return (*run_dmplay(Case(_tournament_words(words))).files[CUP_FILE].decode().splitlines(),)


def draw_bot_case(random: Random) -> Case:
    """Draw messages to a bot, one or more of them malformed."""
    words = random.choice([*MESSAGES_BY_BOT])
    return Case(
        ("bot", *words), typed=change_rows(random, [*MESSAGES_BY_BOT[words]], first_share=0.4)
    )


def draw_rerun_case(random: Random) -> Case:
    """Draw a report of which a value, a key or some characters were changed, to be repeated."""
    report = json.loads(_print_report(random.choice(REPORTS)))
    options = report["provenance"]["options"]
    part = random.choice([report, report["provenance"], options, options])
    key = random.choice([key for key in part if key not in {*LONG_OPTIONS, "options"}])
    value = part.pop(key)
    text = json.dumps(report)
    if random.random() < 0.7:
        changed = random.choice((hostile_values.draw_value(random), replace_value(random, value)))
        part[key] = "@changed"
        text = json.dumps(report).replace('"@changed"', changed)
    raw = text.encode(errors="surrogatepass")
    raw = change_bytes(random, raw) if random.random() < 0.1 else raw
    more = random.choice(((), (), ("--trust",)))
    return Case(("rerun", REPORT_FILE, *more), {REPORT_FILE: raw})


@cache
def _print_report(words: tuple[str, ...]) -> str:
    """Return the report that a command prints as JSON."""
    return run_dmplay(Case((*words, "--json"))).output


def change_rows(random: Random, rows: list[str], *, first_share: float) -> str:
    """Change, repeat, remove or move lines of JSON, usually one; a share of them is the first."""
    for _ in range(random.choice((1, 1, 1, 2, 4))):
        index = 0 if random.random() < first_share else random.randrange(len(rows))
        row = rows.pop(index)
        changed = _change_row(random, row)
        replacement = random.choice(
            ([changed], [changed], [changed], [], [row, row], [row, changed])
        )
        target = index if random.random() < 0.8 else random.randrange(len(rows) + 1)
        rows[target:target] = replacement
        rows = rows or [""]
    end = "" if random.random() < 0.1 else "\n"
    return "\n".join(rows) + end


def _change_row(random: Random, row: str) -> str:
    """Change one line: a value or a key in its JSON, or its characters."""
    kind = random.random()
    try:
        value = json.loads(row)
    except (ValueError, RecursionError):  # changed before
        kind = 1.0
    if kind < 0.7:
        return replace_value(random, value)
    if kind < 0.85 and isinstance(value, dict) and value:
        value.pop(random.choice([*value]))
        return json.dumps(value)
    position = random.randrange(len(row) + 1)
    return row[:position] + hostile_values.draw_word(random) + row[position + 1 :]
