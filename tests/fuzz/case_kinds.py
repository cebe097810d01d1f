"""The kinds of cases: the share of each in a run, and the functions that draw and run it."""

from collections.abc import Callable
from random import Random
from typing import NamedTuple

from dmplay.game.export_formats import EXPORT_FORMATS
from tests.fuzz import (
    changed_facts,
    environments,
    game_trees,
    lesson_quantities,
    machine_files,
    options,
    state_files,
    terminal_input,
    typed_lines,
    user_problems,
)
from tests.fuzz.case import GAME_FILE, Case, Program
from tests.fuzz.corpus import list_human_transcripts, list_transcripts
from tests.fuzz.mutations import mutate_transcript, parse_problem_name
from tests.fuzz.program import parse_case_transcript, run_dmplay
from tests.fuzz.screens import run_screen

SCREEN_SIZES = ((80, 24), (80, 24), (40, 12), (120, 40), (20, 5), (1, 1), (50, 14), (300, 2))
FEW_MUTATIONS = (0, 0, 1, 1, 2)  # mutation counts for transcripts that are continued


class Kind(NamedTuple):
    """Cases of one kind."""

    name: str
    share: int  # of a hundred cases
    draw: Callable[[Random], Case]
    program: Program = run_dmplay


def draw_read_case(random: Random) -> Case:
    """Draw a mutated transcript to parse."""
    return Case(files={GAME_FILE: mutate_transcript(random, random.choice(list_transcripts()))})


def draw_verify_case(random: Random) -> Case:
    """Draw a mutated transcript to verify, or at times to rewrite."""
    more = random.choice(((), (), (), ("--json",), ("--allow-unfinished",), ("--update",)))
    return Case(("verify", GAME_FILE, *more), draw_read_case(random).files)


def draw_resume_case(random: Random) -> Case:
    """Draw a mutated transcript to resume, usually without its end line."""
    raw = random.choice(list_human_transcripts())
    unfinished = raw[: raw.rfind(b"\n\nend: ") + 2] if random.random() < 0.9 else raw
    typed = typed_lines.draw_lines(random, parse_problem_name(raw))
    return Case(
        ("resume", GAME_FILE),
        {GAME_FILE: mutate_transcript(random, unfinished, FEW_MUTATIONS)},
        typed=typed,
    )


def draw_replay_case(random: Random) -> Case:
    """Draw a mutated transcript to replay."""
    more = random.choice(((), ("--json",), ("--plain",), ("--width", "7")))
    return Case(("replay", GAME_FILE, *more), draw_read_case(random).files)


def draw_review_case(random: Random) -> Case:
    """Draw a mutated transcript of people to review."""
    more = random.choice(((), (), ("--json",), ("--write",)))
    return Case(
        ("review", GAME_FILE, *more),
        {GAME_FILE: mutate_transcript(random, random.choice(list_human_transcripts()))},
    )


def draw_evaluate_case(random: Random) -> Case:
    """Draw a mutated transcript to evaluate, at times with others that are in order."""
    files = dict(draw_read_case(random).files)
    if random.random() < 0.3:
        files["second.dmt"] = random.choice(list_transcripts())
    more = random.choice(((), ("--json",), ("--csv", "--games"), ("--seat", "agent1")))
    return Case(("evaluate", *files, *more), files)


def draw_branch_case(random: Random) -> Case:
    """Draw a mutated transcript to branch at some turn."""
    turn = random.choice(("0", "1", "2", "3", "9", "-1", "x"))
    raw = random.choice(list_transcripts())
    typed = typed_lines.draw_lines(random, parse_problem_name(raw))
    words = ("branch", GAME_FILE, "--at", turn, "-o", "other.dmt")
    return Case(words, {GAME_FILE: mutate_transcript(random, raw, FEW_MUTATIONS)}, typed=typed)


def draw_export_case(random: Random) -> Case:
    """Draw a mutated transcript to export, printed or to a file."""
    form = f"--{random.choice([*EXPORT_FORMATS])}"
    more = random.choice(
        ((), (), ("-o", "out"), ("--at", "1"), ("--width", "10"), ("--ascii",), ("--review",))
    )
    path = random.choice((GAME_FILE, GAME_FILE, "."))
    return Case(("export", path, form, *more), draw_read_case(random).files)


def draw_shell_case(random: Random) -> Case:
    """Draw lines typed or piped into the shell, at times with a transcript in the folder."""
    name = typed_lines.draw_problem_name(random)
    first = f"play {' '.join(typed_lines.draw_game_arguments(random, name))}\n".replace(
        " --json", ""
    )
    files = draw_read_case(random).files if random.random() < 0.5 else {}
    typed = first + typed_lines.draw_lines(random, name)
    return Case(("shell",), files, typed=typed, terminal=random.random() < 0.5)


def draw_plain_case(random: Random) -> Case:
    """Draw lines typed or piped into a game."""
    name = typed_lines.draw_problem_name(random)
    typed = typed_lines.draw_lines(random, name)
    return Case(
        typed_lines.draw_game_arguments(random, name), typed=typed, terminal=random.random() < 0.5
    )


def draw_screen_case(random: Random) -> Case:
    """Draw keys of the full screen."""
    name = typed_lines.draw_problem_name(random)
    words = tuple(
        word for word in typed_lines.draw_game_arguments(random, name) if word != "--json"
    )
    return Case(words, keys=typed_lines.draw_keys(random, name), size=random.choice(SCREEN_SIZES))


KINDS = (
    Kind("read", 15, draw_read_case, parse_case_transcript),
    Kind("verify", 17, draw_verify_case),
    Kind("fact", 14, changed_facts.draw_changed_fact_case),
    Kind("resume", 5, draw_resume_case),
    Kind("replay", 5, draw_replay_case),
    Kind("review", 4, draw_review_case),
    Kind("evaluate", 1, draw_evaluate_case),
    Kind("branch", 5, draw_branch_case),
    Kind("export", 3, draw_export_case),
    Kind("shell", 3, draw_shell_case),
    Kind("plain", 3, draw_plain_case),
    Kind("screen", 3, draw_screen_case, run_screen),
    Kind("set", 3, options.draw_parameter_case),
    Kind("agent", 2, options.draw_agent_case),
    Kind("words", 1, options.draw_command_line_case),
    Kind("complete", 1, options.draw_completion_case),
    Kind("settings", 1, options.draw_settings_case),
    Kind("cup", 1, machine_files.draw_tournament_case),
    Kind("rerun", 1, machine_files.draw_rerun_case),
    Kind("bot", 1, machine_files.draw_bot_case),
    Kind("own", 2, user_problems.draw_user_problem_case),
    Kind("tree", 1, game_trees.draw_tree_case),
    Kind("quantity", 2, lesson_quantities.draw_quantity_case, lesson_quantities.run_quantity_case),
    Kind("input", 3, terminal_input.draw_input_case, terminal_input.run_input),
    Kind("state", 2, state_files.draw_state_case, state_files.run_state_case),
    Kind("env", 1, environments.draw_environment_case, environments.run_environment_case),
)


def draw_case(kind: Kind, seed: int, number: int) -> Case:
    """Draw the case of this number, which is the same in every run."""
    return kind.draw(Random(f"{seed}:{kind.name}:{number}"))


def count_cases(kind: Kind, cases: int) -> int:
    """Return the number of cases of this kind among all cases of a run."""
    return round(cases * kind.share / sum(entry.share for entry in KINDS))
