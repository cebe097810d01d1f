"""Watching an algorithm: on problems, on recorded games, and on the position of a game."""

from pathlib import Path

import pytest

from dmplay.algorithms.step import WatchRequest
from dmplay.errors import BadParameter, EpisodeOver, UnknownName
from dmplay.game.game_series import GameController
from dmplay.game.game_setup import start_game
from dmplay.game.launch_requests import GameRequest
from dmplay.game.watching import WatchedSteps, WatchTarget, load_watched_steps, make_game_steps
from dmplay.ui.shell.commands import run_line
from tests.support.screens import make_game

TRANSCRIPTS = Path(__file__).parents[2] / "transcripts"


def play(name: str, *actions: str, strict: bool | str = False) -> GameController:
    """Return a controller of a game after these actions of a person."""
    controller = GameController()
    controller.set_game(start_game(GameRequest(name, seed=7, strict=strict)))
    for action in actions:
        run_line(controller, action)
    return controller


def test_each_step_is_computed_once_and_only_when_it_is_needed() -> None:
    watched = load_watched_steps("value-iteration", WatchTarget("hexworld"))
    assert watched.compute_until(2) == 2
    assert len(watched.steps) == 3
    third = watched.steps[2]
    assert watched.compute_until(1000) == 21
    assert watched.is_complete
    assert watched.steps[2] is third


def test_parameters_and_variants_are_those_of_the_command_line() -> None:
    target = WatchTarget("hexworld", "straight-line", ["slip=0"])
    watched = load_watched_steps("policy-iteration", target)
    assert watched.title == "policy-iteration on hexworld:straight-line"
    assert vars(watched.problem)["slip"] == 0


def test_a_problem_in_place_of_the_algorithm_gets_the_algorithms_that_fit() -> None:
    with pytest.raises(BadParameter) as caught:
        load_watched_steps("hexworld", WatchTarget(""))
    assert str(caught.value).startswith(
        "watch: got the problem hexworld, expected an algorithm before it; "
        "algorithms that fit it: policy-iteration"
    )


def test_other_wrong_words_get_one_line() -> None:
    with pytest.raises(UnknownName, match="did you mean belief-update"):
        load_watched_steps("belief-updat", WatchTarget("crying-baby"))
    with pytest.raises(BadParameter, match="expected a problem"):
        load_watched_steps("belief-update", WatchTarget(""))
    with pytest.raises(BadParameter, match="--at: only with a transcript"):
        load_watched_steps("belief-update", WatchTarget("crying-baby", turn=3))
    with pytest.raises(UnknownName, match="unknown seat"):
        load_watched_steps("belief-update", WatchTarget("crying-baby", seat="nurse"))


def test_a_transcript_gives_its_turns_up_to_the_typed_one() -> None:
    file = sorted((TRANSCRIPTS / "crying_baby").glob("*.dmt"))[0]
    watched = load_watched_steps("belief-update", WatchTarget(str(file), turn=2))
    titles = [step.title for step in watched.iter_steps()]
    assert titles[-1] == "turn 2: normalize"
    assert titles[1] == "turn 1: predict"
    with pytest.raises(BadParameter, match="--at: got 999, the game has"):
        load_watched_steps("belief-update", WatchTarget(str(file), turn=999))


def test_a_game_shows_the_belief_update_of_its_last_turn_which_is_no_hint() -> None:
    game = play("crying-baby", "feed", "ignore").game
    watched = make_game_steps(game)
    assert [step.title for step in watched.iter_steps()][1:] == [
        "turn 2: predict",
        "turn 2: observe",
        "turn 2: normalize",
    ]
    assert watched.steps[-1].pictures
    assert game.session.hint_counts["agent"] == 0


def test_an_algorithm_that_shows_good_actions_counts_as_a_hint() -> None:
    game = play("hexworld").game
    watched = make_game_steps(game, "value-iteration")
    assert game.session.hint_counts["agent"] == 1
    assert watched.request == WatchRequest(game.problem, 0, game.session)
    state = game.problem.format_state(game.session.state)
    watched.compute_until(3)
    assert watched.steps[3].formula.startswith(f"V{state} = ")


def test_a_game_that_forbids_hints_shows_only_what_is_no_hint() -> None:
    game = play("crying-baby", "feed", strict="hints").game
    assert make_game_steps(game, "belief-update").compute_until(3) == 3
    strict = play("hexworld", strict="hints").game
    with pytest.raises(BadParameter, match=r"watch: this game forbids hints \(--strict=hints\)"):
        make_game_steps(strict, "value-iteration")


def test_a_misfit_is_no_hint() -> None:
    game = play("crying-baby").game
    with pytest.raises(BadParameter, match="but the state is hidden"):
        make_game_steps(game, "value-iteration")
    assert game.session.hint_counts["agent"] == 0


def test_the_shell_command_prints_the_last_steps_without_a_screen() -> None:
    controller = play("crying-baby", "feed", "ignore")
    reply = run_line(controller, "watch")
    assert "step 4. turn 2: normalize." in reply
    assert "posterior:" in reply


def test_a_partner_seat_has_its_own_belief() -> None:
    game = make_game("multicaregiver-crying-baby", "human", "random")
    game.choose(0)
    watched = make_game_steps(game, "belief-update")
    assert isinstance(watched, WatchedSteps)
    assert watched.request.seat == 0


def test_a_search_after_the_end_of_a_game_gets_one_line() -> None:
    game = play("hexworld").game
    game.session.end("quit")
    assert make_game_steps(game).algorithm.name == "policy-iteration"
    with pytest.raises(EpisodeOver, match="game is over"):
        make_game_steps(game, "tree-search")
    assert game.session.hint_counts["agent"] == 0


@pytest.mark.parametrize(
    ("name", "actions", "algorithm"),
    [
        ("crying-baby", (), "tree-search"),
        ("crying-baby", ("feed",), "belief-update"),
        ("hexworld", (), "tree-search"),
        ("rock-paper-scissors", (), "fictitious-play"),
        ("simple-regulator", (), "tree-search"),
    ],
)
def test_without_a_name_the_algorithm_suits_the_position(
    name: str, actions: tuple[str, ...], algorithm: str
) -> None:
    assert make_game_steps(play(name, *actions).game).algorithm.name == algorithm
