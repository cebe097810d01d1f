"""No front end and no command reveals which of two indistinguishable games is played."""

from collections.abc import Callable, Iterator
from itertools import count, islice, product
from pathlib import Path

import pytest

import dmplay
from dmplay.core.policy import Policy
from dmplay.core.uniforms import SeededUniforms
from dmplay.game.export_formats import EXPORT_FORMATS
from dmplay.game.game import Game
from dmplay.game.game_series import GameController
from dmplay.game.game_setup import start_new_game
from dmplay.game.launch_requests import GameRequest
from dmplay.game.seats import make_seat_policy
from dmplay.ui.shell.commands import COMMANDS, run_line
from dmplay.ui.shell.plain_mode import JsonReporter, SentenceReporter
from tests.privacy.command_arguments import (
    CHANGING_COMMANDS,
    FOLLOW_UP_COMMANDS,
    QUERY_ARGUMENTS,
    QUERY_KEYS,
    READING_ARGUMENTS,
    list_actions,
    list_queries,
    make_placeholders,
)
from tests.privacy.front_ends import (
    FRONT_ENDS,
    PLAIN_TERMINAL,
    TRANSCRIPT_PATH,
    Response,
    assert_indistinguishable,
    make_line_front_end,
    make_screen_front_end,
    play_both,
)
from tests.privacy.indistinguishable_pairs import (
    FAST_BELIEF_PROBLEMS,
    SECRET_PROBLEM_PARAMS,
    SECRET_PROBLEMS,
    SHARED_TURNS,
    TURN_COUNT,
    Pair,
    Side,
    find_pair,
)
from tests.support.problem_cases import is_identical

LAST_SEATS = [(name, len(dmplay.load_problem(name).agents) - 1) for name in SECRET_PROBLEMS]
SMALL_PROBLEMS = ("machine-replacement", "predator-prey:circle")
every_secret_problem = pytest.mark.parametrize("name", SECRET_PROBLEM_PARAMS)
every_last_seat = pytest.mark.parametrize(("name", "seat"), LAST_SEATS)
SLOW_PLAIN = pytest.param("plain", marks=pytest.mark.slow)
END_FRONT_ENDS = [
    pytest.param(front_end, marks=() if front_end == "plain" else pytest.mark.slow)
    for front_end in FRONT_ENDS
]


def test_every_command_and_format_is_covered() -> None:
    assert {*QUERY_ARGUMENTS, *READING_ARGUMENTS, *CHANGING_COMMANDS} == {
        command.name for command in COMMANDS
    }
    exported = " ".join(READING_ARGUMENTS["export"])
    assert all(f"{{file}} --{name}" in exported for name in EXPORT_FORMATS)


@every_secret_problem
def test_the_games_repeat_their_actions_and_differ_in_hidden_information(
    name: str, game_folder: Path
) -> None:
    twins, sessions = find_pair(name, 0), []
    for number, side in enumerate(twins.sides):
        game = twins.begun(side, Path(f"{number}.dmt"))
        for joint in side.actions[:SHARED_TURNS]:
            game.choose(joint[0])
        actions = [turn.actions.tolist() for turn in game.session.turns]
        assert actions == [[*joint] for joint in side.actions[:SHARED_TURNS]]
        sessions.append(game.session)
    assert sessions[0].uniform_source != sessions[1].uniform_source
    assert twins.problem.partially_observable == (
        not is_identical(sessions[0].state, sessions[1].state)
    )
    last = [side.actions[-1] for side in twins.sides]
    assert last[0][0] == last[1][0]
    assert all(first != second for first, second in zip(last[0][1:], last[1][1:], strict=True))


@pytest.mark.parametrize("front", [SLOW_PLAIN, "json", "shell"])
@every_secret_problem
def test_no_query_reveals_which_game_it_is(name: str, front: str, game_folder: Path) -> None:
    twins = find_pair(name, 0)
    lines = [*list_actions(twins), *list_queries(twins, SHARED_TURNS, QUERY_ARGUMENTS)]
    assert_indistinguishable(
        *play_both(
            twins,
            game_folder,
            lambda side: FRONT_ENDS[front](twins.begun(side, TRANSCRIPT_PATH), lines),
        )
    )


@every_secret_problem
def test_no_key_and_no_typing_error_reveals_which_game_it_is(name: str, game_folder: Path) -> None:
    twins = find_pair(name, 0)
    # After a hint, Enter may play the hinted number.
    queries = ["<enter>", *list_queries(twins, SHARED_TURNS), *QUERY_KEYS]
    lines = [*list_actions(twins), *queries]
    assert_indistinguishable(
        *play_both(
            twins,
            game_folder,
            lambda side: FRONT_ENDS["screen"](twins.begun(side, TRANSCRIPT_PATH), lines),
        )
    )


@pytest.mark.parametrize("front", ["screen", SLOW_PLAIN, "json"])
@every_secret_problem
def test_no_ghost_reveals_which_game_it_is(name: str, front: str, game_folder: Path) -> None:
    twins = find_pair(name, 0)
    lines = [*list_actions(twins), *FOLLOW_UP_COMMANDS]

    def play(side: Side) -> list[Response]:
        return FRONT_ENDS[front](twins.begun(side, TRANSCRIPT_PATH, ghost="random"), lines)

    assert_indistinguishable(*play_both(twins, game_folder, play))


@pytest.mark.slow
@every_last_seat
def test_no_query_and_no_small_screen_reveals_the_game_to_the_last_seat(
    name: str, seat: int, game_folder: Path
) -> None:
    twins = find_pair(name, seat)
    early = [
        *list_queries(twins, 0, QUERY_ARGUMENTS, READING_ARGUMENTS),
        *list_actions(twins, 0, 1),
        *list_queries(twins, 1, QUERY_ARGUMENTS),
        *list_actions(twins, 1),
    ]
    late = list_queries(twins, SHARED_TURNS, QUERY_ARGUMENTS)
    small = [*list_actions(twins), "<enter>", *late, *QUERY_KEYS]
    shell, screen = FRONT_ENDS["shell"], make_screen_front_end((40, 12))
    assert_indistinguishable(
        *play_both(
            twins, game_folder, lambda side: shell(twins.begun(side, TRANSCRIPT_PATH), early + late)
        )
    )
    assert_indistinguishable(
        *play_both(
            twins, game_folder, lambda side: screen(twins.begun(side, TRANSCRIPT_PATH), small)
        )
    )


def make_changed_game(
    twins: Pair, front: str, line: str, turn: int
) -> Callable[[Side], list[Response]]:
    """Return a function that plays, types a line that changes the game, and plays on."""
    lines = [
        *list_actions(twins),
        "save copy.dmt",
        line.format(**make_placeholders(twins, turn)),
        *FOLLOW_UP_COMMANDS,
    ]
    lines += (
        [*list_actions(twins, turn, turn + 1), *FOLLOW_UP_COMMANDS] if turn < SHARED_TURNS else []
    )
    return lambda side: FRONT_ENDS[front](twins.begun(side, TRANSCRIPT_PATH), lines)


@pytest.mark.parametrize("command", CHANGING_COMMANDS)
def test_no_command_that_changes_the_game_reveals_which_it_is(
    command: str, game_folder: Path
) -> None:
    for line, turn in CHANGING_COMMANDS[command].items():
        twins = find_pair("multicaregiver-crying-baby", 0)
        assert_indistinguishable(
            *play_both(twins, game_folder, make_changed_game(twins, "shell", line, turn))
        )


@pytest.mark.slow
@pytest.mark.parametrize("front", ["screen", "plain", "json"])
@pytest.mark.parametrize("command", CHANGING_COMMANDS)
def test_no_command_that_changes_the_game_reveals_it_in_any_front_end(
    command: str, front: str, game_folder: Path
) -> None:
    for name, (line, turn) in product(SMALL_PROBLEMS, CHANGING_COMMANDS[command].items()):
        twins = find_pair(name, 0)
        assert_indistinguishable(
            *play_both(twins, game_folder, make_changed_game(twins, front, line, turn))
        )


@pytest.mark.slow
@pytest.mark.parametrize("name", FAST_BELIEF_PROBLEMS)
def test_no_command_that_changes_the_game_reveals_it_in_any_problem(
    name: str, game_folder: Path
) -> None:
    twins = find_pair(name, 0)
    for turns_by_line in CHANGING_COMMANDS.values():
        for line, turn in turns_by_line.items():
            assert_indistinguishable(
                *play_both(twins, game_folder, make_changed_game(twins, "shell", line, turn))
            )


@pytest.mark.parametrize("front", END_FRONT_ENDS)
@every_secret_problem
def test_the_end_reveals_what_was_hidden(name: str, front: str, game_folder: Path) -> None:
    twins = find_pair(name, 0)
    front_ends = FRONT_ENDS | {
        "plain": make_line_front_end(SentenceReporter(PLAIN_TERMINAL)),
        "json": make_line_front_end(JsonReporter()),
    }
    end = list_actions(twins, 0, TURN_COUNT)
    first, second = (
        [response.output.replace(str(side.seed), "") for response in responses]
        for side, responses in zip(
            twins.sides,
            play_both(
                twins,
                game_folder,
                lambda side: front_ends[front](twins.begun(side, TRANSCRIPT_PATH), end),
            ),
            strict=True,
        )
    )
    assert first[:SHARED_TURNS] == second[:SHARED_TURNS]
    if twins.problem.partially_observable:
        assert first != second


def ask_for_advice(game: Game) -> list[str]:
    """Return the advice on the current turn, without the answers that show the seed."""
    controller = GameController(game)
    labels = game.session.action_labels(game.viewing_seat)
    actions = [f"{command} {labels[i]}" for command in ("whatif", "why") for i in (0, -1)]
    return [run_line(controller, line) for line in ("hint", "why", "values", "belief", *actions)]


CAREGIVER_TURNS = 6


def choose_actions(seed: int) -> list[int]:
    """Return the person's one to three actions in the game of a seed."""
    return [(seed // 6 + turn) % 3 for turn in range(1 + seed % 3)]


def start_caregiver_game(seat: int, partner: str, seed: int) -> Game:
    """Return a game in which a person in this seat has played some turns beside a partner."""
    seats = [f"caregiver{1 + seat}=human", f"caregiver{2 - seat}={partner}"]
    game = start_new_game(
        GameRequest("multicaregiver-crying-baby", seed=seed, seats=seats, turns=CAREGIVER_TURNS)
    )
    for action in choose_actions(seed):
        game.choose(action)
    return game


def iter_caregiver_twins(seat: int, partner: str) -> Iterator[tuple[int, int]]:
    """Yield the seeds of two games that look the same to this seat, with other states."""
    problem = dmplay.load_problem("multicaregiver-crying-baby")
    policies: list[Policy | None] = [None, None]
    policies[1 - seat] = make_seat_policy(problem, 1 - seat, partner)
    seeds_by_observations: dict[tuple[object, ...], tuple[int, int]] = {}
    for seed in count():
        session = dmplay.Session(
            problem, SeededUniforms(seed), policies, turn_limit=CAREGIVER_TURNS
        )
        for action in choose_actions(seed):
            session.advance([None, action] if seat else [action, None])
        state = int(session.state)
        observed = tuple(
            (int(turn.actions[seat]), int(turn.observations[seat])) for turn in session.turns
        )
        twin_seed, twin_state = seeds_by_observations.setdefault(observed, (seed, state))
        if twin_state != state:
            del seeds_by_observations[observed]
            yield twin_seed, seed


@pytest.mark.parametrize(
    "pair_count", [pytest.param(4, id="few"), pytest.param(8, id="many", marks=pytest.mark.slow)]
)
@pytest.mark.parametrize(
    ("seat", "partner"),  # the plans of others feed in each turn in seat 0, which hides nothing
    [(0, "feed-when-crying"), (0, "joint-plan"), (0, "best-response"), (1, "feed-when-crying")],
)
def test_advice_for_a_known_partner_uses_only_what_the_seat_observes(
    seat: int, partner: str, pair_count: int
) -> None:
    for seeds in islice(iter_caregiver_twins(seat, partner), pair_count):
        first, second = (start_caregiver_game(seat, partner, seed) for seed in seeds)
        assert first.session.state != second.session.state
        assert ask_for_advice(first) == ask_for_advice(second)
        first.finish()
        second.finish()


def iter_choice_twins(name: str, opponent: str) -> Iterator[tuple[int, int]]:
    """Yield the seeds of two games with equal first turns and another choice of the opponent."""
    problem = dmplay.load_problem(name)
    policies = [None, make_seat_policy(problem, 1, opponent)]
    seeds_by_history: dict[str, tuple[int, float]] = {}
    for seed in count():
        session = dmplay.Session(
            problem, SeededUniforms(seed), policies, turn_limit=CAREGIVER_TURNS
        )
        states = [session.state.tolist()]
        for action in [*choose_actions(seed), 0]:
            session.advance([action % 2, None])
            states.append(session.state.tolist())
        *turns, last = [tuple(turn.actions.tolist()) for turn in session.turns]
        history = str((states[:-1], turns))
        twin_seed, twin_choice = seeds_by_history.setdefault(history, (seed, last[1]))
        if twin_choice != last[1]:
            del seeds_by_history[history]
            yield twin_seed, seed


@pytest.mark.parametrize(
    ("name", "opponent"),
    [("prisoners-dilemma", "random"), ("rock-paper-scissors", "nash"),
     ("predator-prey:triangle", "equilibrium"), ("predator-prey:triangle", "random")],
)  # fmt: skip
@pytest.mark.parametrize(
    "pair_count", [pytest.param(4, id="few"), pytest.param(8, id="many", marks=pytest.mark.slow)]
)
def test_advice_against_a_known_opponent_does_not_know_its_next_choice(
    name: str, opponent: str, pair_count: int
) -> None:
    for seeds in islice(iter_choice_twins(name, opponent), pair_count):
        advice = []
        for seed in seeds:
            request = GameRequest(name, seed=seed, other_agent=opponent, turns=CAREGIVER_TURNS)
            game = start_new_game(request)
            for action in choose_actions(seed):
                game.choose(action % 2)
            advice.append(ask_for_advice(game))
            game.finish()
        assert advice[0] == advice[1]
        assert f"against {opponent}" in advice[0][0]
