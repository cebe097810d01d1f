"""The game as a state machine: turns, undo, rerolls, endings, and what a seat may know."""

import math
import re
import tracemalloc
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import pytest

import dmplay
from dmplay.chance import Bools, Reals
from dmplay.core import Labels, Memory, Percept
from dmplay.dice import SeededUniforms
from dmplay.errors import BadPolicy, EpisodeOver, IllegalAction
from dmplay.game.account import Narrator
from dmplay.knowledge import CHUNK_TURNS
from dmplay.policies.general import Random
from dmplay.policies.script import Script
from dmplay.problems.crying_baby import CryingBaby
from dmplay.rollouts import rollout
from dmplay.session import SeatedPolicy, Turn
from dmplay.views.kept import SeatSnapshot
from tests.support.brought import Key
from tests.support.games import Scripted, session
from tests.support.seats import Rescaling

E, NE, NW, W, SW, SE = range(6)
COOPERATE, DEFECT = 0, 1


def notation(game: dmplay.Session) -> str:
    return game.problem.format_state(game.state)


def test_a_walk_east_slips_where_the_draw_says_so() -> None:
    game = session("hexworld:straight-line", [0.3], [0.699999999], [0.7], [0.85])
    assert notation(game) == "(2,0)"
    game.advance([E])
    assert notation(game) == "(3,0)"
    game.advance([E])  # slips to the north-east, off the line
    assert notation(game) == "(3,0)"
    assert game.turns[-1].rewards.tolist() == [-1]
    game.advance([E])  # slips to the south-east, off the line
    assert notation(game) == "(3,0)"
    assert game.total_rewards().tolist() == [-2]
    assert game.returns().tolist() == [0.9 * -1 + 0.9**2 * -1]


def test_an_exit_pays_when_it_is_acted_in_and_ends_the_game() -> None:
    game = session("hexworld:straight-line", [0.75], [0.0], [0.0])
    game.advance([E])
    assert notation(game) == "(6,0)"
    assert not game.over
    game.advance([NW])
    assert notation(game) == "over"
    assert game.turns[-1].rewards.tolist() == [10]
    assert game.end_reason == "terminal"
    with pytest.raises(EpisodeOver, match=r"turn 3: the game is over \(terminal\)"):
        game.advance([E])


def test_undo_gives_back_the_same_dice() -> None:
    game = dmplay.Session(dmplay.load_problem("2048"), SeededUniforms(3))
    able = game.legal_actions_mask(0)
    assert able is not None
    legal = np.flatnonzero(able)
    first = game.advance([legal[0]])
    game.undo()
    assert game.turns == []
    again = game.advance([legal[0]])
    assert (first.state == again.state).all()
    assert (first.uniforms == again.uniforms).all()


def test_a_reroll_plays_the_same_action_under_other_dice_and_stays() -> None:
    game = dmplay.Session(dmplay.load_problem("crying-baby"), SeededUniforms(3))
    before = game.advance([2])
    after = game.reroll()
    assert after.actions == before.actions
    assert (after.uniforms != before.uniforms).all()
    game.undo()
    assert (game.advance([2]).uniforms == after.uniforms).all()


def test_more_turns_than_were_played_cannot_be_taken_back() -> None:
    game = dmplay.Session(dmplay.load_problem("crying-baby"), SeededUniforms(3))
    with pytest.raises(IllegalAction, match="undo 1: 0 turns were played"):
        game.undo()


def test_an_illegal_slide_is_refused_and_changes_nothing() -> None:
    game = session("2048", [0.0, 0.0, 0.0, 0.0], [0.0, 0.0])
    assert notation(game) == "2 2 . ./. . . ./. . . ./. . . ."
    with pytest.raises(IllegalAction, match=r"turn 1, agent: up is not legal now; expected .*down"):
        game.advance([3])
    assert game.turns == []
    assert notation(game) == "2 2 . ./. . . ./. . . ./. . . ."


def test_the_state_is_not_told_by_what_cannot_be_played_in_it() -> None:
    class Dark(Key):
        observations = (Labels(("nothing",)),)

    problem = Dark()
    game = dmplay.Session(problem, Scripted([0.0]), initial_uniforms=np.array([0.0]))
    told = "^turn 1, agent: open is not legal now; expected one of take, wait$"
    with pytest.raises(IllegalAction, match=told):
        game.advance([2])


@pytest.mark.parametrize("action", [6, -1, 2.5, None])
def test_an_action_out_of_range_is_refused(action: float | None) -> None:
    game = dmplay.Session(dmplay.load_problem("hexworld"), SeededUniforms(3))
    with pytest.raises(IllegalAction, match="turn 1, agent: "):
        game.advance([action])


def test_the_horizon_and_a_turn_limit_are_two_reasons() -> None:
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
    game = session("crying-baby", [0.9], [0.0])
    game.advance([2])
    view = game.view(0)
    assert view.rewards is None
    assert view.joint_actions is None
    assert [int(seen) for seen in view.observations] == [-1, 0]
    assert view.turns_played == 1
    assert view.last_action_label == "ignore"
    assert view.beliefs is not None
    assert view.beliefs[0].tolist() == [0.5, 0.5]
    assert view.belief.tolist() == view.beliefs[-1].tolist()


WORKED: list[Sequence[int | None]] = []  # the actions after which a belief was worked out


@dataclass(frozen=True)
class Watched(CryingBaby):
    """A baby that tells of who works out what to believe of it."""

    def joint_belief_update(
        self, belief: Reals, actions: Sequence[int | None], observations: Sequence[int | None]
    ) -> Reals:
        WORKED.append(actions)
        return super().joint_belief_update(belief, actions, observations)


def test_beliefs_are_worked_out_once_and_when_they_are_looked_at() -> None:
    WORKED.clear()
    game = dmplay.Session(Watched(), SeededUniforms(1))
    early = game.view(0)
    for _ in range(3):
        game.advance([2])
        view = game.view(0)
    assert not WORKED
    assert early.beliefs is not None
    assert view.beliefs is not None
    assert len(view.beliefs[1:]) == len(WORKED) == 3
    assert (len(early.beliefs), len(view.beliefs)) == (1, 4)
    game.undo(2)
    assert game.view(0).belief is view.beliefs[1]
    assert len(WORKED) == 3


def test_a_seat_that_sees_the_state_sees_rewards_and_the_joint_action() -> None:
    game = dmplay.Session(dmplay.load_problem("prisoners-dilemma"), SeededUniforms(1))
    game.advance([COOPERATE, DEFECT])
    mine, theirs = game.view(0), game.view(1)
    assert ([*(mine.rewards or ())], [*(theirs.rewards or ())]) == ([-4.0], [0.0])
    assert mine.joint_actions is not None
    assert mine.joint_actions[0].tolist() == [COOPERATE, DEFECT]
    assert mine.beliefs is None


def test_an_adviser_that_comes_late_knows_what_it_would_have_known() -> None:
    problem = dmplay.load_problem("prisoners-dilemma")
    game = dmplay.Session(problem, SeededUniforms(1))
    game.advance([COOPERATE, DEFECT])
    adviser = SeatedPolicy(game, 0, dmplay.load_agent(problem, 0, "tit-for-tat"))
    assert adviser.choose() == DEFECT
    game.undo()
    assert adviser.choose() == COOPERATE
    assert adviser.action_values() is None


def test_a_policy_that_answers_no_single_action_is_named() -> None:
    problem = dmplay.load_problem("hexworld")

    class Broken(Script):
        def choose(self, *_: object) -> np.ndarray:
            return np.zeros(2)

    game = dmplay.Session(problem, SeededUniforms(1), [Broken(problem, 0, ())])
    with pytest.raises(BadPolicy, match="turn 1, agent: Broken chose"):
        game.advance()


@dataclass(frozen=True)
class Saying(Script):
    """Chooses the same in all games."""

    said: object = 0

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> np.ndarray:
        return np.full(len(u), self.said)


@pytest.mark.parametrize(
    ("name", "said", "told"),
    [
        ("hexworld", 6, "got action 6"),
        ("hexworld", -1, "got action -1"),
        ("hexworld", 1.5, r"got action 1\.5"),
        ("hexworld", math.nan, "got action nan"),
        ("hexworld", "e", "Saying chose array.*, expected an array of"),
        ("hexworld", "e" * 80, r"Saying chose array[^\n]*, expected an array of"),
        ("simple-regulator", 10.5, r"got 10\.5, expected a number from -10 to 10"),
        ("2048", 0, "left is not legal now; expected one of down, right, up"),
    ],
)
def test_what_cannot_be_done_is_refused_in_one_game_and_in_many(
    name: str, said: object, told: str
) -> None:
    problem = dmplay.load_problem(name)
    policy = Saying(problem, 0, (), said)
    with pytest.raises((BadPolicy, IllegalAction), match=f"turn 1, agent: {told}"):
        dmplay.Session(problem, SeededUniforms(0), [policy]).advance()
    with pytest.raises((BadPolicy, IllegalAction), match=f"turn 1, agent: {told}"):
        rollout(problem, [policy], episodes=2)


class Grasping(Script):
    """Writes into all that it is given, or follows it to where it came from."""

    given: ClassVar[list[np.ndarray]] = []

    def initial_memory(self, observation: np.ndarray) -> Memory:
        self.given.append(observation)
        return super().initial_memory(observation)

    def update_memory(self, memory: Memory, percept: Percept) -> Memory:
        self.given.extend(part for part in percept if part is not None)
        return super().update_memory(memory, percept)

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> np.ndarray:
        self.given.extend([] if legal is None else [legal])
        chosen = super().choose(memory, legal, u)
        return chosen if legal is None or len(u) == 1 else legal.argmax(axis=1)


@pytest.mark.parametrize("name", ["2048", "cart-pole", "crying-baby", "prisoners-dilemma"])
@pytest.mark.parametrize("many", [False, True])
def test_what_a_policy_is_given_is_its_own_and_not_to_be_written_into(
    name: str, *, many: bool
) -> None:
    problem = dmplay.load_problem(name)
    Grasping.given = []
    seats = [Grasping(problem, n, (0, 1, 0, 1)) for n in range(len(problem.agents))]
    if many:
        rollout(problem, seats, episodes=3, turn_limit=3)
    else:
        game = dmplay.Session(problem, SeededUniforms(1), seats)
        for _ in range(3):
            game.advance()
    assert Grasping.given
    for given in Grasping.given:
        assert not isinstance(given.base, np.ndarray)
        assert not given.flags.writeable
        with suppress(ValueError):  # of what is given again
            given.flags.writeable = True
            given[...] = 0  # of no effect on anything else
    if not many:
        assert [turn.actions[0] for turn in game.turns] == [0, 1, 0]


@pytest.mark.parametrize(
    ("memory", "got"),
    [
        (None, "None"),
        ((0,), "(())"),
        ((np.zeros(1), np.zeros((2, 1))), "((1,), (2, 1))"),
    ],
)
def test_what_a_policy_remembers_has_a_row_for_each_game(memory: object, got: str) -> None:
    problem = dmplay.load_problem("hexworld")
    given = type("Given", (Random,), {"initial_memory": lambda self, observation: memory})
    told = rf"turn 1.* gave {re.escape(got)}, expected a tuple of arrays of 1 row"
    with pytest.raises(BadPolicy, match=told):
        dmplay.Session(problem, SeededUniforms(1), [given(problem, 0)]).advance()
    with pytest.raises(BadPolicy, match=told):
        dmplay.rollout(problem, [given(problem, 0)], episodes=1)


def test_a_policy_that_writes_into_what_it_is_given_is_named() -> None:
    problem = dmplay.load_problem("cart-pole")
    seats = [Rescaling(problem, 0, (0, 0))]
    told = r"turn 2, agent: Rescaling\.update_memory writes into what it was given; copy it first"
    game = dmplay.Session(problem, SeededUniforms(1), seats)
    game.advance()
    with pytest.raises(BadPolicy, match=told):
        game.advance()
    with pytest.raises(BadPolicy, match=r"turn 1, agent: Rescaling\.update_memory writes"):
        rollout(problem, seats, episodes=2, turn_limit=1)


def test_another_error_of_a_policy_stays_what_it_is() -> None:
    problem = dmplay.load_problem("hexworld")

    class Wrong(Script):
        def update_memory(self, *_: object) -> Memory:
            raise ValueError("not for us to say")

    game = dmplay.Session(problem, SeededUniforms(1), [Wrong(problem, 0, (0, 0))])
    game.advance()
    with pytest.raises(ValueError, match="not for us to say"):
        game.advance()


@pytest.mark.parametrize("name", ["2048", "cart-pole", "crying-baby", "prisoners-dilemma"])
def test_nobody_writes_into_what_a_view_carries(name: str) -> None:
    problem = dmplay.load_problem(name)
    game = dmplay.Session(problem, SeededUniforms(1))
    able = game.legal_actions_mask(0)
    first = 0 if able is None else np.flatnonzero(able)[0]
    game.advance([first] * len(problem.agents))
    view = game.view(0)
    parts = [*view.observations, *(view.joint_actions or ()), *(view.beliefs or ())]
    parts += [] if view.legal_actions_mask is None else [view.legal_actions_mask]
    for part in parts:
        if np.ndim(part):
            assert not part.flags.writeable


def test_values_of_an_adviser_are_those_of_its_seat() -> None:
    problem = dmplay.load_problem("hexworld")
    game = dmplay.Session(problem, SeededUniforms(7))
    values = SeatedPolicy(game, 0, dmplay.load_agent(problem, 0, "optimal")).action_values()
    assert values is not None
    assert values.shape == (6,)


def test_a_real_action_is_kept_to_nine_decimals_within_its_bounds() -> None:
    game = dmplay.Session(dmplay.load_problem("simple-regulator"), SeededUniforms(1))
    assert game.advance([0.1234567891]).actions.tolist() == [0.123456789]
    assert game.view(0).observation == game.observation_after(0, 1) == game.state
    with pytest.raises(IllegalAction, match=r"got 10\.5, expected a number from -10"):
        game.advance([10.5])


def test_a_view_stays_what_it_was_whatever_is_played_or_taken_back() -> None:
    game = session("crying-baby", [0.9], [0.0], [0.95], [0.5])
    for action in (2, 1):
        game.advance([action])
    view = game.view(0)
    was = [*view.actions], [*map(int, view.observations)], [b.tolist() for b in view.beliefs or ()]
    game.undo()
    game.advance([0])
    now = [*view.actions], [*map(int, view.observations)], [b.tolist() for b in view.beliefs or ()]
    assert now == was
    assert (*view.actions,) == (2, 1)
    assert (*view.actions[-1:],) == (1,)
    assert (*game.view(0).actions,) == (2, 0)
    with pytest.raises(IndexError):
        view.actions[2]


def test_returns_are_summed_turn_by_turn_in_order_and_forget_what_is_taken_back() -> None:
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


class Read(list[Turn]):
    """Turns that count how many of them are read."""

    many = 0

    def __getitem__(self, place: Any) -> Any:
        found = super().__getitem__(place)
        self.many += len(found) if isinstance(place, slice) else 1
        return found

    def __iter__(self) -> Iterator[Turn]:
        self.many += len(self)
        return super().__iter__()


def test_telling_of_a_turn_reads_as_many_turns_however_many_were_played() -> None:
    game = dmplay.Session(dmplay.load_problem("hexworld", rewards=[]), SeededUniforms(1))
    turns = game.turns = Read()
    account = Narrator(game, [0], reveal=False)
    reads = []
    for _ in range(200):
        before = turns.many
        game.advance([E])
        account.describe_turn(SeatSnapshot(game, 0))
        reads.append(turns.many - before)
    assert sum(reads[100:]) <= sum(reads[:100])


def told_game(turns: int) -> dmplay.Session:
    game = dmplay.Session(dmplay.load_problem("hexworld", rewards=[]), SeededUniforms(1))
    for number in range(turns):
        game.advance([number % 6])
    game.view(0)
    return game


@pytest.mark.parametrize("turns", [CHUNK_TURNS - 1, CHUNK_TURNS, CHUNK_TURNS + 1, 2 * CHUNK_TURNS])
@pytest.mark.parametrize("taken", [1, CHUNK_TURNS])
def test_what_a_seat_was_told_of_a_long_game_is_told_again_after_an_undo(
    turns: int, taken: int
) -> None:
    game = told_game(turns)
    view = game.view(0)
    was = [*view.actions]
    taken = min(taken, turns)
    game.undo(taken)
    assert [*game.view(0).actions] == was[:-taken]
    for _ in range(3):
        game.advance([5])
    assert [*game.view(0).actions] == [*was[:-taken], 5, 5, 5]
    assert len(game.view(0).observations) == turns - taken + 4
    assert [*view.actions] == was


def test_an_undo_copies_as_little_late_in_a_game_as_early() -> None:
    copied = []
    for turns in (10 + CHUNK_TURNS, 10 + 13 * CHUNK_TURNS):
        game = told_game(turns)
        tracemalloc.start()
        try:
            game.undo()
            copied.append(tracemalloc.get_traced_memory()[1])
        finally:
            tracemalloc.stop()
    assert copied[1] < 1.5 * copied[0]


def test_who_chose_in_every_turn_goes_back_as_many() -> None:
    session = dmplay.Session(dmplay.load_problem("rock-paper-scissors"), dmplay.SeededUniforms(1))
    for _ in range(3):
        session.advance([0, 0])
    assert [session.turns_to_undo([0], choices) for choices in (1, 2, 3, 4)] == [1, 2, 3, 4]
