"""Tests of Session: turns, undo, rerolls, endings, and the information that each seat has."""

import math
import re
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
import pytest

import dmplay
from dmplay.agents.random_agent import Random
from dmplay.agents.script import Script
from dmplay.core.arrays import Bools, Reals
from dmplay.core.policy import Memory, Percept, check_policies
from dmplay.core.session import SeatedPolicy, Session, count_turns_to_undo
from dmplay.core.spaces import Labels
from dmplay.core.uniforms import SeededUniforms
from dmplay.draw.options import DrawOptions
from dmplay.errors import BadParameter, BadPolicy, EpisodeOver, IllegalAction
from dmplay.evaluation.many_games import rollout
from dmplay.game.narration import Narrator
from dmplay.game.seat_snapshot import SeatSnapshot
from dmplay.problems.crying_baby.rules import CryingBaby
from dmplay.views.protocol import load_view_module
from tests.support.games import ScriptedUniforms, make_session
from tests.support.seated_agents import ObservationMutatingScript
from tests.support.user_problems import Key

E, NE, NW, W, SW, SE = range(6)
COOPERATE, DEFECT = 0, 1
FEED, IGNORE = 0, 2


def format_current_state(game: dmplay.Session) -> str:
    return game.problem.format_state(game.state)


def test_a_walk_east_slips_according_to_the_uniform() -> None:
    game = make_session("hexworld:straight-line", [0.3], [0.699999999], [0.7], [0.85])
    assert format_current_state(game) == "(2,0)"
    game.advance([E])
    assert format_current_state(game) == "(3,0)"
    game.advance([E])  # slips to the north-east, off the line
    assert format_current_state(game) == "(3,0)"
    assert game.turns[-1].rewards.tolist() == [-1]
    game.advance([E])  # slips to the south-east, off the line
    assert format_current_state(game) == "(3,0)"
    assert game.total_rewards().tolist() == [-2]
    assert game.returns().tolist() == [0.9 * -1 + 0.9**2 * -1]


def test_an_action_in_an_exit_pays_and_ends_the_game() -> None:
    game = make_session("hexworld:straight-line", [0.75], [0.0], [0.0])
    game.advance([E])
    assert format_current_state(game) == "(6,0)"
    assert not game.over
    game.advance([NW])
    assert format_current_state(game) == "over"
    assert game.turns[-1].rewards.tolist() == [10]
    assert game.end_reason == "terminal"
    with pytest.raises(EpisodeOver, match=r"turn 3: the game is over \(ended by the rules\)"):
        game.advance([E])


def test_undo_restores_the_same_uniforms() -> None:
    game = dmplay.Session(dmplay.load_problem("2048"), SeededUniforms(3))
    mask = game.legal_actions_mask(0)
    assert mask is not None
    legal = np.flatnonzero(mask)
    first = game.advance([legal[0]])
    game.undo()
    assert game.turns == []
    replayed = game.advance([legal[0]])
    assert (first.state == replayed.state).all()
    assert (first.uniforms == replayed.uniforms).all()


def test_a_reroll_repeats_the_action_with_new_uniforms_that_stay() -> None:
    game = dmplay.Session(dmplay.load_problem("crying-baby"), SeededUniforms(3))
    before = game.advance([2])
    after = game.reroll()
    assert after.actions == before.actions
    assert (after.uniforms != before.uniforms).all()
    game.undo()
    assert (game.advance([2]).uniforms == after.uniforms).all()


def test_undo_of_more_turns_than_were_played_is_refused() -> None:
    game = dmplay.Session(dmplay.load_problem("crying-baby"), SeededUniforms(3))
    with pytest.raises(IllegalAction, match="undo: no turn was played"):
        game.undo()


def test_an_illegal_slide_is_refused_and_changes_nothing() -> None:
    game = make_session("2048", [0.0, 0.0, 0.0, 0.0], [0.0, 0.0])
    assert format_current_state(game) == "2 2 . ./. . . ./. . . ./. . . ."
    with pytest.raises(IllegalAction, match=r"turn 1, agent: up moves no tile; expected .*down"):
        game.advance([3])
    assert game.turns == []
    assert format_current_state(game) == "2 2 . ./. . . ./. . . ./. . . ."


def test_an_illegal_action_error_does_not_reveal_the_state() -> None:
    class Dark(Key):
        observations = (Labels(("nothing",)),)

    problem = Dark()
    game = dmplay.Session(problem, ScriptedUniforms([0.0]), initial_uniforms=np.array([0.0]))
    message = "^turn 1, agent: open is not legal now; expected one of take, wait$"
    with pytest.raises(IllegalAction, match=message):
        game.advance([2])


@pytest.mark.parametrize("action", [6, -1, 2.5, None])
def test_an_action_out_of_range_is_refused(action: float | None) -> None:
    game = dmplay.Session(dmplay.load_problem("hexworld"), SeededUniforms(3))
    with pytest.raises(IllegalAction, match="turn 1, agent: "):
        game.advance([action])


def test_the_horizon_and_a_turn_limit_are_different_end_reasons() -> None:
    problem = dmplay.load_problem("crying-baby")
    for limit, reason in ((None, "horizon"), (20, "horizon"), (3, "turn limit")):
        game = dmplay.Session(problem, SeededUniforms(1), turn_limit=limit)
        while not game.over:
            game.advance([0])
        assert game.end_reason == reason
        assert len(game.turns) == (limit or 20)


def test_quitting_ends_a_game_once() -> None:
    game = dmplay.Session(dmplay.load_problem("hexworld"), SeededUniforms(1))
    game.end("quit")
    game.end("interrupted")
    assert game.end_reason == "quit"


def test_a_seat_of_a_pomdp_sees_neither_state_nor_reward() -> None:
    game = make_session("crying-baby", [0.9], [0.0])
    game.advance([2])
    view = game.view(0)
    assert view.rewards is None
    assert view.joint_actions is None
    assert [int(observation) for observation in view.observations] == [-1, 0]
    assert view.turns_played == 1
    assert view.last_action_label == "ignore"
    assert view.beliefs is not None
    assert view.beliefs[0].tolist() == [0.5, 0.5]
    assert view.belief.tolist() == view.beliefs[-1].tolist()


BELIEF_UPDATE_ACTIONS: list[Sequence[int | None]] = []  # the actions of each belief update


@dataclass(frozen=True)
class RecordingCryingBaby(CryingBaby):
    """A crying baby that records its belief updates."""

    def joint_belief_update(
        self, belief: Reals, actions: Sequence[int | None], observations: Sequence[int | None]
    ) -> Reals:
        BELIEF_UPDATE_ACTIONS.append(actions)
        return super().joint_belief_update(belief, actions, observations)


def test_beliefs_are_computed_once_and_only_when_read() -> None:
    BELIEF_UPDATE_ACTIONS.clear()
    game = dmplay.Session(RecordingCryingBaby(), SeededUniforms(1))
    early = game.view(0)
    for _ in range(3):
        game.advance([2])
        view = game.view(0)
    assert not BELIEF_UPDATE_ACTIONS
    assert early.beliefs is not None
    assert view.beliefs is not None
    assert len(view.beliefs[1:]) == len(BELIEF_UPDATE_ACTIONS) == 3
    assert (len(early.beliefs), len(view.beliefs)) == (1, 4)
    game.undo(2)
    assert game.view(0).belief is view.beliefs[1]
    assert len(BELIEF_UPDATE_ACTIONS) == 3


def test_a_seat_that_sees_the_state_sees_rewards_and_the_joint_action() -> None:
    game = dmplay.Session(dmplay.load_problem("prisoners-dilemma"), SeededUniforms(1))
    game.advance([COOPERATE, DEFECT])
    mine, theirs = game.view(0), game.view(1)
    assert ([*(mine.rewards or ())], [*(theirs.rewards or ())]) == ([-4.0], [0.0])
    assert mine.joint_actions is not None
    assert mine.joint_actions[0].tolist() == [COOPERATE, DEFECT]
    assert mine.beliefs is None


def test_a_policy_seated_late_has_the_whole_history() -> None:
    problem = dmplay.load_problem("prisoners-dilemma")
    game = dmplay.Session(problem, SeededUniforms(1))
    game.advance([COOPERATE, DEFECT])
    seated_policy = SeatedPolicy(game, 0, dmplay.load_agent(problem, 0, "tit-for-tat"))
    assert seated_policy.choose() == DEFECT
    game.undo()
    assert seated_policy.choose() == COOPERATE
    assert seated_policy.action_values() is None


@pytest.mark.parametrize("rerolls", [False, True])
def test_a_policy_seated_late_follows_turns_that_were_played_again(*, rerolls: bool) -> None:
    problem = dmplay.load_problem("crying-baby")
    game = dmplay.Session(problem, SeededUniforms(3))
    agent = dmplay.load_agent(problem, 0, "optimal")
    follower = SeatedPolicy(game, 0, agent)
    game.advance([FEED])
    game.advance([IGNORE])
    _ = follower.action_values()
    if rerolls:
        game.reroll(np.zeros_like(game.turns[-1].uniforms))  # now the baby cries
    else:
        game.undo(2)
        game.advance([IGNORE])
        game.advance([IGNORE])
    expected = SeatedPolicy(game, 0, agent).action_values()
    values = follower.action_values()
    assert values is not None
    assert expected is not None
    assert np.array_equal(values, expected)


def test_a_policy_that_does_not_return_one_action_is_named() -> None:
    problem = dmplay.load_problem("hexworld")

    class Broken(Script):
        def choose(self, *_: object) -> np.ndarray:
            return np.zeros(2)

    game = dmplay.Session(problem, SeededUniforms(1), [Broken(problem, 0, ())])
    with pytest.raises(BadPolicy, match="turn 1, agent: Broken chose"):
        game.advance()


@dataclass(frozen=True)
class Saying(Script):
    """A policy that chooses the same action in all games."""

    label: object = 0

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> np.ndarray:
        return np.full(len(u), self.label)


@pytest.mark.parametrize(
    ("name", "action", "message"),
    [
        ("hexworld", 6, "got action 6"),
        ("hexworld", -1, "got action -1"),
        ("hexworld", 1.5, r"got action 1\.5"),
        ("hexworld", math.nan, "got action nan"),
        ("hexworld", "e", "Saying chose array.*, expected an array of"),
        ("hexworld", "e" * 80, r"Saying chose array[^\n]*, expected an array of"),
        ("simple-regulator", 10.5, r"got 10\.5, expected a number from -10 to 10"),
        ("2048", 0, "left moves no tile; expected one of down, right, up"),
    ],
)
def test_an_invalid_action_is_refused_in_a_game_and_in_a_rollout(
    name: str, action: object, message: str
) -> None:
    problem = dmplay.load_problem(name)
    policy = Saying(problem, 0, (), action)
    with pytest.raises((BadPolicy, IllegalAction), match=f"turn 1, agent: {message}"):
        dmplay.Session(problem, SeededUniforms(0), [policy]).advance()
    with pytest.raises((BadPolicy, IllegalAction), match=f"turn 1, agent: {message}"):
        rollout(problem, [policy], episodes=2)


class ArrayCollector(Script):
    """A policy that collects every array that it receives."""

    received_arrays: ClassVar[list[np.ndarray]] = []

    def initial_memory(self, observation: np.ndarray) -> Memory:
        self.received_arrays.append(observation)
        return super().initial_memory(observation)

    def update_memory(self, memory: Memory, percept: Percept) -> Memory:
        self.received_arrays.extend(part for part in percept if part is not None)
        return super().update_memory(memory, percept)

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> np.ndarray:
        self.received_arrays.extend([] if legal is None else [legal])
        chosen = super().choose(memory, legal, u)
        return chosen if legal is None or len(u) == 1 else legal.argmax(axis=1)


@pytest.mark.parametrize("name", ["2048", "cart-pole", "crying-baby", "prisoners-dilemma"])
@pytest.mark.parametrize("batched", [False, True])
def test_arrays_passed_to_a_policy_are_readonly_copies(name: str, *, batched: bool) -> None:
    problem = dmplay.load_problem(name)
    ArrayCollector.received_arrays = []
    seats = [ArrayCollector(problem, n, (0, 1, 0, 1)) for n in range(len(problem.agents))]
    if batched:
        rollout(problem, seats, episodes=3, turn_limit=3)
    else:
        game = dmplay.Session(problem, SeededUniforms(1), seats)
        for _ in range(3):
            game.advance()
    assert ArrayCollector.received_arrays
    for array in ArrayCollector.received_arrays:
        assert not isinstance(array.base, np.ndarray)
        assert not array.flags.writeable
        with suppress(ValueError):  # raised for a cached array
            array.flags.writeable = True
            array[...] = 0  # must not change any other array
    if not batched:
        assert [turn.actions[0] for turn in game.turns] == [0, 1, 0]


@pytest.mark.parametrize(
    ("memory", "got"),
    [(None, "None"), ((0,), "(())"), ((np.zeros(1), np.zeros((2, 1))), "((1,), (2, 1))")],
)
def test_the_memory_of_a_policy_has_a_row_for_each_game(memory: object, got: str) -> None:
    problem = dmplay.load_problem("hexworld")
    policy_class = type("Given", (Random,), {"initial_memory": lambda self, observation: memory})
    message = rf"turn 1.* returned {re.escape(got)}, expected a tuple of arrays with 1 row each"
    with pytest.raises(BadPolicy, match=message):
        dmplay.Session(problem, SeededUniforms(1), [policy_class(problem, 0)]).advance()
    with pytest.raises(BadPolicy, match=message):
        dmplay.rollout(problem, [policy_class(problem, 0)], episodes=1)


class NotAPolicy:
    """A class without the methods of a policy."""


@pytest.mark.parametrize(
    ("policies", "message"),
    [
        ([Random],
         r"seat 0: got the class Random, expected an instance of it, such as Random(problem, 0)"),
        ([NotAPolicy], "seat 0: got the class NotAPolicy, expected an instance of it"),
        ([NotAPolicy()], "seat 0: got <"),
        (["random"],
         "seat 0: got 'random', expected a policy, such as dmplay.load_agent(problem, 0, NAME)"),
        (Random,
         "got <class 'dmplay.agents.random_agent.Random'>, expected a policy or None for each of"),
        (3, "got 3, expected a policy or None for each of"),
        ("r", "got 'r', expected a policy or None for each of"),
        ([None, None], "got 2 policies, expected a policy or None for each of"),
    ],
)  # fmt: skip
def test_what_is_not_a_policy_is_refused_in_one_line(policies: Any, message: str) -> None:
    problem = dmplay.load_problem("hexworld")
    with pytest.raises(BadPolicy, match=f"^{re.escape(message)}.*$"):
        dmplay.Session(problem, SeededUniforms(1), policies)


@pytest.mark.parametrize("uniform_source", [None, 7, "7", SeededUniforms])
def test_what_generates_no_uniforms_is_refused_in_one_line(uniform_source: Any) -> None:
    message = (
        f"got {uniform_source!r}, expected a source of uniforms, such as dmplay.SeededUniforms(7)"
    )
    with pytest.raises(BadParameter, match=f"^{re.escape(message)}$"):
        dmplay.Session(dmplay.load_problem("hexworld"), uniform_source)


def test_a_policy_that_writes_into_its_arguments_is_named() -> None:
    problem = dmplay.load_problem("cart-pole")
    seats = [ObservationMutatingScript(problem, 0, (0, 0))]
    message = (
        r"turn 2, agent: ObservationMutatingScript\.update_memory "
        r"modifies an array that it received; copy the array first"
    )
    game = dmplay.Session(problem, SeededUniforms(1), seats)
    game.advance()
    with pytest.raises(BadPolicy, match=message):
        game.advance()
    with pytest.raises(
        BadPolicy, match=r"turn 1, agent: ObservationMutatingScript\.update_memory modifies"
    ):
        rollout(problem, seats, episodes=2, turn_limit=1)


def test_other_errors_of_a_policy_are_not_changed() -> None:
    problem = dmplay.load_problem("hexworld")

    class Wrong(Script):
        def update_memory(self, *_: object) -> Memory:
            raise ValueError("not for us to say")

    game = dmplay.Session(problem, SeededUniforms(1), [Wrong(problem, 0, (0, 0))])
    game.advance()
    with pytest.raises(ValueError, match="not for us to say"):
        game.advance()


@pytest.mark.parametrize("name", ["2048", "cart-pole", "crying-baby", "prisoners-dilemma"])
def test_arrays_of_a_view_are_readonly(name: str) -> None:
    problem = dmplay.load_problem(name)
    game = dmplay.Session(problem, SeededUniforms(1))
    mask = game.legal_actions_mask(0)
    first = 0 if mask is None else np.flatnonzero(mask)[0]
    game.advance([first] * len(problem.agents))
    view = game.view(0)
    parts = [*view.observations, *(view.joint_actions or ()), *(view.beliefs or ())]
    parts += [] if view.legal_actions_mask is None else [view.legal_actions_mask]
    for part in parts:
        if np.ndim(part):
            assert not part.flags.writeable


def test_a_seated_policy_has_one_value_per_action_of_its_seat() -> None:
    problem = dmplay.load_problem("hexworld")
    game = dmplay.Session(problem, SeededUniforms(7))
    values = SeatedPolicy(game, 0, dmplay.load_agent(problem, 0, "optimal")).action_values()
    assert values is not None
    assert values.shape == (6,)


def test_a_real_action_is_rounded_to_nine_decimals_and_bounded() -> None:
    game = dmplay.Session(dmplay.load_problem("simple-regulator"), SeededUniforms(1))
    assert game.advance([0.1234567891]).actions.tolist() == [0.123456789]
    assert game.view(0).observation == game.observation_after(0, 1) == game.state
    with pytest.raises(IllegalAction, match=r"got 10\.5, expected a number from -10"):
        game.advance([10.5])


def test_a_view_does_not_change_with_later_turns_or_undo() -> None:
    game = make_session("crying-baby", [0.9], [0.0], [0.95], [0.5])
    for action in (2, 1):
        game.advance([action])
    view = game.view(0)
    before = (
        [*view.actions],
        [*map(int, view.observations)],
        [b.tolist() for b in view.beliefs or ()],
    )
    game.undo()
    game.advance([0])
    after = (
        [*view.actions],
        [*map(int, view.observations)],
        [b.tolist() for b in view.beliefs or ()],
    )
    assert after == before
    assert (*view.actions,) == (2, 1)
    assert (*view.actions[-1:],) == (1,)
    assert (*game.view(0).actions,) == (2, 0)
    with pytest.raises(IndexError):
        view.actions[2]


def test_returns_are_summed_in_turn_order_without_undone_turns() -> None:
    game = dmplay.Session(dmplay.load_problem("simple-regulator"), SeededUniforms(1))
    for action in (0.1, -0.3, 0.7, 0.2):
        game.advance([action])
        assert game.returns().tolist() == [sum_in_order(game, game.problem.discount)]
    game.undo(2)
    game.advance([0.5])
    assert game.returns().tolist() == [sum_in_order(game, game.problem.discount)]
    assert game.total_rewards().tolist() == [sum_in_order(game, 1.0)]


def sum_in_order(game: dmplay.Session, discount: float) -> float:
    total, weight = 0.0, 1.0
    for turn in game.turns:
        total, weight = total + weight * turn.rewards[0], weight * discount
    return float(total)


class CountingList(list[Any]):
    """A list that counts the items that are read."""

    read_count = 0

    def __getitem__(self, index: Any) -> Any:
        result = super().__getitem__(index)
        self.read_count += len(result) if isinstance(index, slice) else 1
        return result

    def __iter__(self) -> Iterator[Any]:
        self.read_count += len(self)
        return super().__iter__()


def test_describing_a_turn_reads_no_more_turns_in_a_long_game() -> None:
    game = dmplay.Session(dmplay.load_problem("hexworld", rewards=[]), SeededUniforms(1))
    turns = game.turns = CountingList()
    account = Narrator(game, [0], reveal=False)
    reads = []
    for _ in range(200):
        before = turns.read_count
        game.advance([E])
        account.describe_turn(SeatSnapshot(game, 0))
        reads.append(turns.read_count - before)
    assert {*reads[1:]} == {reads[1]}


def test_drawing_a_board_reads_no_more_beliefs_in_a_long_game() -> None:
    problem = dmplay.load_problem("crying-baby")
    game = dmplay.Session(problem, SeededUniforms(1), [Random(problem, 0)], turn_limit=80)
    module, options = load_view_module(problem), DrawOptions(80, 14, allow_large=True)
    reads = []
    for _ in range(79):
        game.advance()
        view = game.view(0)
        beliefs = CountingList(view.beliefs or ())
        next(iter(module.iter_boards(replace(view, beliefs=beliefs), options)))
        reads.append(beliefs.read_count)
    assert 0 < reads[-1] == reads[50]


def play_in_rotation(turns: int) -> dmplay.Session:
    game = dmplay.Session(dmplay.load_problem("hexworld", rewards=[]), SeededUniforms(1))
    for number in range(turns):
        game.advance([number % 6])
    game.view(0)
    return game


@pytest.mark.parametrize("turns", [1, 200])
@pytest.mark.parametrize("undo_count", [1, 100])
def test_the_history_of_a_game_is_right_after_an_undo(turns: int, undo_count: int) -> None:
    game = play_in_rotation(turns)
    view = game.view(0)
    before = [*view.actions]
    undo_count = min(undo_count, turns)
    game.undo(undo_count)
    assert [*game.view(0).actions] == before[:-undo_count]
    for _ in range(3):
        game.advance([5])
    assert [*game.view(0).actions] == [*before[:-undo_count], 5, 5, 5]
    assert len(game.view(0).observations) == turns - undo_count + 4
    assert [*view.actions] == before


def test_undoing_n_choices_undoes_n_turns_if_the_seat_always_chose() -> None:
    session = dmplay.Session(dmplay.load_problem("rock-paper-scissors"), dmplay.SeededUniforms(1))
    for _ in range(3):
        session.advance([0, 0])
    assert [count_turns_to_undo(session, [0], choices) for choices in (1, 2, 3, 4)] == [1, 2, 3, 4]


def test_a_class_in_place_of_a_problem_is_named_with_its_call() -> None:
    hexworld = type(dmplay.load_problem("hexworld"))
    with pytest.raises(BadParameter, match=r"expected a problem, such as HexWorld\(\)"):
        Session(hexworld, SeededUniforms(7))  # type: ignore[arg-type]


def test_policies_for_too_few_seats_are_refused() -> None:
    with pytest.raises(BadPolicy, match="expected a policy for each of a, b"):
        check_policies(("a", "b"), [None])
