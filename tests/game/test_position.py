"""A position answers questions from the knowledge of one seat alone."""

import gc
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import dmplay
from dmplay.core.session import Session
from dmplay.core.typed_text import list_state_names
from dmplay.core.uniforms import SeededUniforms
from dmplay.errors import BadParameter, DmplayError, IllegalAction, UnknownName
from dmplay.game.manual_game import ManualGame
from dmplay.game.position import Position
from dmplay.game.rules_of_thumb import apply_rule, list_rules
from tests.privacy.indistinguishable_pairs import SECRET_PROBLEM_PARAMS, SHARED_TURNS, find_pair
from tests.support.problem_cases import CASE_NAMES, every_problem, load_small_problem

SHORT_TURNS = 4  # turn limit of the games
MAX_OBJECTS = 200_000  # objects that are searched for a session


def play_game(name: str, turns: int, seed: int = 7) -> ManualGame:
    """Return a game in which the first legal action was played in some turns."""
    game = dmplay.play(load_small_problem(name), seed=seed, turns=SHORT_TURNS)
    while len(game.session.turns) < turns and not game.over:
        game.session.advance([choose_first(game.session, seat) for seat in range(seat_count(game))])
    return game


def seat_count(game: ManualGame) -> int:
    """Return the number of seats."""
    return len(game.session.seated_policies)


def choose_first(session: Session, seat: int) -> float:
    """Return the first legal action of a seat, or 0."""
    legal = session.legal_actions_mask(seat)
    return 0.0 if legal is None else float(np.flatnonzero(legal)[0])


def list_facts(position: Position) -> list[str]:
    """Return all answers of a position as text."""
    rules = [(rule.text, apply_rule(position, rule)) for rule in list_rules(position.problem)]
    facts = [str(position.values()), str(position.best_actions()), str(rules)]
    for action in position.legal_actions[:4]:
        try:
            outcomes = [
                (item.label, f"{item.probability:.9f}") for item in position.outcomes(action)
            ]
            facts.append(str(outcomes))
        except DmplayError as error:
            facts.append(str(error))
    return facts


def reaches(start: object, types: tuple[type, ...]) -> bool:
    """Return whether an object of one of these types can be reached from an object."""
    pending, visited = [start], {id(start)}
    while pending and len(visited) < MAX_OBJECTS:
        item = pending.pop()
        if isinstance(item, types):
            return True
        for other in gc.get_referents(item):
            if id(other) not in visited and not isinstance(other, type) and not callable(other):
                visited.add(id(other))
                pending.append(other)
    return False


@every_problem
def test_no_session_and_no_random_numbers_can_be_reached_from_a_position(name: str) -> None:
    game = play_game(name, 1)
    assert reaches(game, (Session,))
    for seat in range(seat_count(game)):
        position = game.position(game.session.problem.agents[seat])
        position.values()
        assert not reaches(position, (Session, SeededUniforms))


@every_problem
def test_the_parts_of_each_exact_value_add_up_to_it(name: str) -> None:
    position = play_game(name, 1).position()
    values = position.values()
    if values is None:
        return
    for action in position.legal_actions[:4]:
        parts = position.break_down(action)
        if parts is None:
            continue
        assert sum(item.probability for item in parts.outcomes) == pytest.approx(1.0)
        is_exact = values.basis.accuracy is dmplay.Accuracy.EXACT and not values.basis.turns_scope
        if is_exact:
            assert parts.adds_up
            assert position.expected_rewards()[action] == pytest.approx(parts.reward)


@pytest.mark.parametrize("name", [name for name in CASE_NAMES if name != "2048"])
def test_a_position_made_from_text_has_the_values_of_the_game(name: str) -> None:
    game = play_game(name, 2)
    problem, session = game.session.problem, game.session
    if game.over or len(problem.agents) > 1 or not problem.actions[0].labels:
        return
    played = game.position()
    left = SHORT_TURNS - len(session.turns)
    if problem.partially_observable:
        history = [
            f"{problem.format_action(0, turn.actions[0])} "
            f"{problem.observations[0].format_observation(turn.observations[0])}"
            for turn in session.turns
        ]
        described = Position.from_text(problem, history=history, turns_left=left)
        belief = " ".join(
            f"{problem.format_state(state)} {p!r}"
            for state, p in zip(
                problem.enumerate_states(), played.view.belief.tolist(), strict=True
            )
        )
        from_belief = Position.from_text(problem, belief=belief, turns_left=left)
    else:
        state = problem.format_state(session.state)
        described = from_belief = Position.from_text(problem, state=state, turns_left=left)
    expected = played.values()
    assert expected is not None
    for position in (described, from_belief):
        values = position.values()
        assert values is not None
        assert values.q == pytest.approx(expected.q, abs=1e-6, nan_ok=True)
        assert position.best_actions() == played.best_actions()


@pytest.mark.parametrize("name", SECRET_PROBLEM_PARAMS)
def test_games_that_a_seat_cannot_tell_apart_have_the_same_position(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    twins, answers = find_pair(name, 0), []
    for number, side in enumerate(twins.sides):
        game = twins.begun(side, Path(f"{number}.dmt"))
        for joint in side.actions[:SHARED_TURNS]:
            game.choose(joint[0])
        answers.append(list_facts(game.position(0)))
    assert answers[0] == answers[1]


def test_a_position_does_not_change_when_the_game_goes_on() -> None:
    game = dmplay.play("crying-baby", seed=7, turns=5)
    game.act("ignore")
    position, later = game.position(), game.position()
    before = list_facts(position)
    game.act("feed")
    assert list_facts(position) == list_facts(later) == before
    assert list_facts(game.position()) != before


def test_a_wrong_text_is_one_clear_error() -> None:
    with pytest.raises(BadParameter, match=r"got '9,9', expected a state such as \(-?\d,\d\)"):
        Position.from_text("hexworld", state="9,9")
    for history in (["feed"], [("feed", "quiet")], "feed quiet"):
        with pytest.raises(BadParameter, match=r"an action .* as in \['feed crying'\]"):
            Position.from_text("crying-baby", history=history)  # type: ignore[arg-type]
    with pytest.raises(BadParameter, match=r"add up to 1\.2"):
        Position.from_text("crying-baby", belief="hungry 0.5 sated 0.7")
    with pytest.raises(UnknownName, match="sing"):
        Position.from_text("crying-baby").outcomes("sign")
    with pytest.raises(IllegalAction, match="expected"):
        Position.from_text("hexworld").outcomes(6)
    with pytest.raises(BadParameter, match="expected a history or a belief"):
        Position.from_text("crying-baby", state="hungry")
    with pytest.raises(BadParameter, match="not both"):
        Position.from_text("crying-baby", history=["feed quiet"], belief="hungry 1")
    with pytest.raises(BadParameter, match="expected a state"):
        Position.from_text("hexworld", belief="hungry 1")
    with pytest.raises(BadParameter, match="got 2, expected 0 to 1"):
        Position.from_text("prisoners-dilemma", 2)
    with pytest.raises(BadParameter, match="got 0, expected 1 or more"):
        Position.from_text("hexworld", turns_left=0)
    with pytest.raises(BadParameter, match="got 1, expected one for each of 2 agents"):
        Position.from_text("prisoners-dilemma", players=["human"])
    with pytest.raises(BadParameter, match="the state is hidden"):
        _ = Position.from_text("crying-baby").state


@pytest.mark.parametrize(
    "belief", [[0.7, 0.3], np.array([0.7, 0.3]), {"hungry": 0.3, "sated": 0.7}]
)
def test_a_position_accepts_a_belief_as_numbers(belief: Any) -> None:
    names = list_state_names(dmplay.load_problem("crying-baby"))
    text = " ".join(f"{name} {chance}" for name, chance in zip(names, [0.7, 0.3], strict=True))
    from_numbers = Position.from_text("crying-baby", belief=belief, turns_left=3).values()
    expected = Position.from_text("crying-baby", belief=text, turns_left=3).values()
    assert from_numbers is not None
    assert expected is not None
    np.testing.assert_array_equal(from_numbers.q, expected.q)
