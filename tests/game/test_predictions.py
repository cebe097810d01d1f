"""Tests of --predict: a question before each turn, a score after it, and nothing revealed."""

import json
from pathlib import Path

import numpy as np
import pytest

import dmplay
from dmplay.core import belief
from dmplay.core.session import Session
from dmplay.core.uniforms import SeededUniforms
from dmplay.errors import BadParameter, UnknownName
from dmplay.game.game import Game
from dmplay.game.game_series import GameController
from dmplay.game.game_setup import start_new_game
from dmplay.game.launch_requests import GameRequest
from dmplay.ui.shell.commands import run_line, take_prediction_report
from tests.support.games import assert_verified
from tests.support.problem_cases import CASE_NAMES
from tests.support.programs import run_dmplay
from tests.support.screens import play_keys

pytestmark = pytest.mark.usefixtures("coarse")


def start_game(problem: str, prediction: str, path: Path, **options: object) -> Game:
    request = GameRequest(problem, seed=7, prediction=prediction, record_path=path, **options)  # type: ignore[arg-type]
    return start_new_game(request)


def play_lines(game: Game, *lines: str) -> list[str]:
    """Run typed lines; return the reply of each and the score that follows it, if any."""
    controller = GameController(game)
    replies = []
    for line in lines:
        replies.append(run_line(controller, line))
        score = take_prediction_report(game)
        if score:
            replies.append(score)
    return replies


def test_a_belief_is_scored_by_the_square_of_its_error(tmp_path: Path) -> None:
    """Fed, the baby is sated for certain, so that quiet says nothing new."""
    replies = play_lines(start_game("crying-baby", "belief", tmp_path / "game.dmt"), "feed", "0.3")
    assert replies == [
        "predict P(hungry) if quiet follows feed, from 0 to 1; Enter skips",
        "turn 1. chose feed, heard quiet. belief: sated 1.000, hungry 0.000.",
        (
            "P(hungry) if quiet follows feed is 0.000; you said 0.3: squared error 0.090 "
            "(mean of 1: 0.090)."
        ),
    ]


def test_the_observations_of_belief_questions_take_turns_and_follow_bayes_rule(
    tmp_path: Path,
) -> None:
    game = start_game("crying-baby", "belief", tmp_path / "game.dmt")
    play_lines(game, "feed", "skip", "ignore")
    assert game.predictor is not None
    question = game.predictor.question
    assert question is not None
    assert question.subject == "P(hungry) if crying follows ignore"
    before = game.view().belief
    posterior = belief.update_belief(game.problem, before, [2], [0]).belief
    labels = game.problem.observations[0]
    assert labels.format_observation(np.array(0)) == "crying"
    assert question.truth == pytest.approx(posterior[1])


def test_a_named_state_is_asked_for(tmp_path: Path) -> None:
    game = start_game("crying-baby", "belief:sated", tmp_path / "game.dmt")
    assert play_lines(game, "feed")[0].startswith("predict P(sated) if ")


def test_an_outcome_has_a_brier_score(tmp_path: Path) -> None:
    """(0.7 - 1)^2 = 0.09 if it happens, 0.8^2 = 0.64 if it does not."""
    game = start_game("hexworld", "outcome", tmp_path / "game.dmt")
    replies = play_lines(game, "se", "(8,1) 0.7", "se", "(8,1) 0.8")
    assert replies[2] == (
        "(8,1) happened, as you predicted; you gave (8,1) 0.7: "
        "Brier score 0.090 (mean of 1: 0.090)."
    )
    assert replies[5] == (
        "(9,0) happened; you gave (8,1) 0.8: Brier score 0.640 (mean of 2: 0.365)."
    )
    game.finish()
    assert (
        "2 predictions: mean Brier score 0.365; always saying 0.5 scores 0.250; "
        "you said 0.75 on average, and 1 of 2 happened"
    ) in game.closing_lines()


def test_a_value_is_compared_with_that_of_the_hint(tmp_path: Path) -> None:
    game = start_game("hexworld", "value", tmp_path / "game.dmt")
    *_, score = play_lines(game, "se", "6")
    value = dmplay.load_agent(game.problem, 0, "optimal").action_values(
        (game.session.initial_state[None],)
    )
    assert value is not None
    assert value[0, 5] == pytest.approx(7.0444, abs=1e-4)
    assert score == (
        "the value of se is 7.044 (exact values); you said 6: off by 1.044 (mean of 1: 1.044)."
    )


def test_the_reply_of_an_opponent_is_an_outcome(tmp_path: Path) -> None:
    game = start_game("prisoners-dilemma", "outcome", tmp_path / "game.dmt")
    *_, score = play_lines(game, "defect", "Cooperate 1")
    assert score.startswith(
        "cooperate happened, as you predicted; you gave cooperate 1: Brier score 0.000"
    )


@pytest.mark.parametrize("name", CASE_NAMES)
@pytest.mark.parametrize("kind", ["belief", "outcome", "value"])
def test_nothing_is_played_or_shown_before_the_answer(name: str, kind: str, tmp_path: Path) -> None:
    refusal = ""
    try:
        game = start_game(name, kind, tmp_path / "game.dmt", turns=2)
    except BadParameter as error:
        refusal = str(error)
    if refusal:
        assert refusal.startswith("--predict ")
        return
    label = next(label for label in game.session.action_labels(game.viewing_seat))
    legal = game.session.legal_actions_mask(game.viewing_seat)
    if legal is not None:
        label = game.session.action_labels(game.viewing_seat)[int(np.flatnonzero(legal)[0])]
    controller = GameController(game)
    text = (tmp_path / "game.dmt").read_text()
    question = run_line(controller, f"act {label}")
    assert question.startswith("predict ")
    assert (tmp_path / "game.dmt").read_text() == text
    assert not game.session.turns
    for command in ("hint", "values", "why", f"whatif {label}", "state", "policy"):
        with pytest.raises((BadParameter, UnknownName)):
            run_line(controller, command)
    assert not game.session.turns
    assert game.open_question == question
    assert run_line(controller, "undo") == "your choice is undone."
    assert not game.open_question
    run_line(controller, f"act {label}")
    run_line(controller, "")  # skips
    assert len(game.session.turns) == 1
    assert take_prediction_report(game) == ""


def test_a_turn_is_asked_about_once_although_it_is_undone(tmp_path: Path) -> None:
    game = start_game("crying-baby", "belief", tmp_path / "game.dmt")
    replies = play_lines(game, "feed", "0.3", "undo", "feed")
    assert replies[-1] == "turn 1. chose feed, heard quiet. belief: sated 1.000, hungry 0.000."


def test_predictions_are_notes_of_the_transcript_and_do_not_change_verification(
    tmp_path: Path,
) -> None:
    game = start_game("hexworld", "outcome", tmp_path / "game.dmt")
    play_lines(game, "se", "(8,1) 0.7", "se", "skip", "se", "over 1")
    game.finish()
    text = assert_verified(tmp_path / "game.dmt").read_text()
    assert "\n# prediction turn 1: outcome (8,1) 0.7, happened (8,1), Brier 0.090\n" in text
    assert text.count("# prediction ") == 2


@pytest.mark.parametrize(
    ("problem", "prediction", "answer", "message"),
    [
        ("crying-baby", "belief", "1.5", "got '1.5', expected a probability from 0 to 1"),
        ("crying-baby", "belief", "nan", "got 'nan', expected a probability from 0 to 1"),
        ("crying-baby", "outcome", "cryin 0.5", "unknown observation 'cryin'; did you mean crying"),
        ("crying-baby", "outcome", "0.5", "got '0.5', expected an outcome and its probability"),
        ("hexworld", "outcome", "here 0.5", "got 'here', expected a state such as (7,2)"),
        ("hexworld", "value", "inf", "got 'inf', expected a number"),
    ],
)
def test_an_invalid_prediction_is_one_line_and_asked_again(
    problem: str, prediction: str, answer: str, message: str, tmp_path: Path
) -> None:
    action = "feed" if problem == "crying-baby" else "se"
    game = start_game(problem, prediction, tmp_path / "game.dmt")
    controller = GameController(game)
    run_line(controller, action)
    with pytest.raises((BadParameter, UnknownName)) as error:
        run_line(controller, answer)
    assert str(error.value).startswith(message)
    assert game.open_question
    result = run_dmplay(
        tmp_path, problem, "--seed", "7", "--predict", prediction, stdin=f"{action}\n{answer}\n"
    )
    assert result.returncode == 2
    assert message in result.stderr


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["hexworld", "--predict", "belief"], "no belief over hidden states"),
        (["cart-pole", "--predict", "outcome"], "have no names to type"),
        (["simple-regulator", "--predict", "value"], "no agent computes action values"),
        (["hexworld", "--predict", "outcme"], "did you mean outcome"),
        (["crying-baby", "--predict", "belief:hungri"], "did you mean hungry"),
        (["hexworld", "--predict", "value", "--strict=hints"], "forbids hints"),
        (["hexworld", "--predict", "value", "--agent", "optimal"], "got 0 human players"),
    ],
)
def test_an_impossible_kind_of_prediction_is_refused_at_the_start(
    words: list[str], message: str, tmp_path: Path
) -> None:
    result = run_dmplay(tmp_path, *words)
    assert result.returncode == 2
    assert message in result.stderr


def test_json_has_events_for_the_question_and_the_score(tmp_path: Path) -> None:
    lines = "feed\n0.3\nignore\n\nquit\n"
    result = run_dmplay(
        tmp_path, "crying-baby", "--seed", "7", "--predict", "belief", "--json", stdin=lines
    )
    events = [json.loads(line) for line in result.stdout.splitlines()]
    assert [event["event"] for event in events] == [
        "start", "ask", "predict", "turn", "prediction", "ask", "predict", "turn", "ask", "end",
    ]  # fmt: skip
    assert events[4]["score"] == pytest.approx(0.09)
    assert events[-1]["predictions"] == {"kind": "belief", "count": 1, "mean_score": 0.09}


def test_keys_type_the_prediction_on_the_screen(tmp_path: Path) -> None:
    game = start_game("crying-baby", "belief", tmp_path / "game.dmt")
    frames = play_keys(game, "f", "0", ".", "3", "tab", "enter", size=(100, 24)).frames
    assert "predict P(hungry) if quiet follows feed" in frames[-6]
    assert frames[-6].split("\n")[-1].startswith(" Enter predicts  Esc skips")
    assert "prediction: 0.3 " in frames[-3]
    assert "prediction: 0.3 " in frames[-2], "Tab shows no hint before the answer"
    assert "squared error 0.090" in frames[-1]


def test_escape_skips_and_backspace_takes_the_action_back(tmp_path: Path) -> None:
    game = start_game("crying-baby", "belief", tmp_path / "game.dmt")
    play_keys(game, "f", "backspace")
    assert not game.session.turns
    assert not game.open_question
    play_keys(game, "f", "escape")
    assert len(game.session.turns) == 1
    assert game.predictor is not None
    assert game.predictor.scored == []


def test_a_game_without_the_option_asks_nothing() -> None:
    session = Session(dmplay.load_problem("hexworld"), SeededUniforms(7))
    assert start_new_game(GameRequest("hexworld", seed=7)).predictor is None
    assert session.turns == []
