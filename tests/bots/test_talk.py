"""A program is told what its seat may know, and plays as the agent would that it speaks for."""

import json
import pickle
import re
from collections.abc import Sequence
from dataclasses import fields

import pytest

import dmplay
from dmplay.bots.bot import Bot, BotState
from dmplay.bots.end import close_bots
from dmplay.bots.speaker import BotServer
from dmplay.bots.talk import MAX_OPEN_REQUESTS
from dmplay.cli.service import make_seat_factory
from dmplay.core import Policy, Problem
from dmplay.errors import BadParameter, Forfeit
from dmplay.finding import agents
from dmplay.transcript.format import collect_turn_facts
from tests.support.cases import CASES, SOME, load, random_play, small
from tests.support.seats import made

WIDEST = "collaborative-predator-prey"  # each turn carries a belief over 1,728 states
SEED = 5  # nothing can go down in its first board of 2048
HELLO = '{"type": "hello", "protocol": 1}'


class Inside:
    """An agent of ours at the other end of the lines."""

    log = b""

    def __init__(self, speaker: BotServer) -> None:
        self._speaker = speaker
        self._said: list[str] = []

    def send(self, text: str, seconds: float) -> None:
        answers = map(self._speaker.answer, text.splitlines())
        self._said += filter(None, answers)

    def read_line(self) -> str:
        return self._said.pop(0)

    def close(self, farewell: str = "") -> None:
        self.send(farewell, 0.0)


class Said:
    """A program that says these lines, whatever it hears."""

    log = b""

    def __init__(self, *lines: str) -> None:
        self.heard: list[dict[str, object]] = []
        self._lines = [*lines]

    def send(self, text: str, seconds: float) -> None:
        self.heard += map(json.loads, text.splitlines())

    def read_line(self) -> str:
        return self._lines.pop(0)

    def close(self, farewell: str = "") -> None:
        self.send(farewell, 0.0)

    def told(self, key: str) -> list[object]:
        """What every line that it heard has under a key."""
        return [said.get(key) for said in self.heard]

    def seated(self, name: str, *, belief: bool = False) -> dmplay.Session:
        """A game in which it plays."""
        problem = load(name)
        bot = Bot(problem, 0, "it", name, open_channel=lambda _: self, belief=belief)
        return dmplay.Session(problem, dmplay.SeededUniforms(SEED), [bot])


def ours(problem: Problem, seat: int, agent: str, name: str) -> Bot:
    """An agent of ours, as a program."""
    speaker = BotServer(agent, make_seat_factory(agent, name))
    return Bot(problem, seat, "it", name, open_channel=lambda _: Inside(speaker))


def act(number: int, action: str) -> str:
    return json.dumps({"type": "act", "id": number, "action": action})


def ignoring(turns: int) -> list[str]:
    return [act(number, "ignore") for number in range(1, turns + 1)]


def told(policies: Sequence[Policy | None], problem: Problem) -> list[dict[str, object]]:
    """The facts of some turns."""
    game = dmplay.Session(problem, dmplay.SeededUniforms(7), policies, turn_limit=SOME)
    rows = [collect_turn_facts(game)]
    while not game.over:
        game.advance()
        rows.append(collect_turn_facts(game))
    return rows


@pytest.mark.usefixtures("coarse")
@pytest.mark.parametrize("name", [name for name in CASES if not name.startswith(WIDEST)])
def test_a_program_plays_as_the_agent_that_it_speaks_for(name: str) -> None:
    problem = small(name)
    for seat in range(len(problem.agents)):
        roster = agents.load_roster(problem, seat)
        rule = next(
            name for name in roster.agents if name != roster.hint_provider
        )  # and soon found
        for agent in {"random", rule}:
            bot = ours(problem, seat, agent, name)
            played = []
            for who in (made(problem, seat, agent), bot):
                others: list[Policy | None] = [*random_play(problem)]
                others[seat] = who
                played.append(told(others, problem))
            assert played[0] == played[1], agent


def test_each_turn_is_told_once_and_all_of_them_after_one_is_taken_back() -> None:
    program = Said(HELLO, *ignoring(4))
    game = program.seated("crying-baby")
    for _ in range(3):
        game.advance()
    assert program.told("type") == ["hello", "turn", "act", "turn", "act", "turn", "act"]
    assert program.told("turn")[1:] == [0, 1, 1, 2, 2, 3]
    game.undo(2)
    game.advance()
    assert program.told("type")[7:] == ["turn", "turn", "act"]
    assert program.told("turn")[7:] == [0, 1, 2]


def test_a_seat_is_told_what_it_may_know_and_how_it_ended() -> None:
    program = Said(HELLO, *ignoring(2))
    game = program.seated("crying-baby")
    game.advance()
    game.advance()
    game.end("quit")
    close_bots(game, "it")
    hello, first, _, turn, ask, last, over, end = program.heard
    parameters = {one.name: getattr(game.problem, one.name) for one in fields(game.problem)}
    assert hello["parameters"] == parameters
    assert hello["observations"] == ["crying", "quiet"]
    assert first == {"type": "turn", "turn": 0, "observation": None}
    assert turn == {"type": "turn", "turn": 1, "action": "ignore", "observation": "crying"}
    legal = ["feed", "sing", "ignore"]
    assert ask == {"type": "act", "id": 2, "turn": 2, "observation": "crying", "legal": legal}
    assert last["turn"] == 2
    sums = {"return": float(game.returns()[0]), "total": float(game.total_rewards()[0])}
    assert over == {"type": "over", "reason": "quit", "turns": 2, **sums}
    assert end == {"type": "quit"}


def test_what_a_game_that_can_be_played_on_paid_is_no_farewell() -> None:
    program = Said(HELLO, *ignoring(1))
    game = program.seated("crying-baby")
    game.advance()
    game.end("interrupted")
    close_bots(game, "it")
    assert program.heard[-2] == {"type": "over", "reason": "interrupted", "turns": 1}


def test_the_whole_history_is_told_to_who_asks_for_it() -> None:
    program = Said(HELLO[:-1] + ', "wants": ["history"]}', *ignoring(2))
    game = program.seated("crying-baby")
    game.advance()
    game.advance()
    assert program.told("type") == ["hello", "act", "act"]
    turns = [
        {"turn": 0, "observation": None},
        {"turn": 1, "action": "ignore", "observation": "crying"},
    ]
    assert program.told("history")[1:] == [turns[:1], turns]


def test_who_plays_many_games_at_once_is_told_each_turn_of_each_game_once() -> None:
    games, turns = MAX_OPEN_REQUESTS + 1, 2
    program = Said(HELLO[:-1] + ', "wants": ["games"]}', *ignoring(games * turns))
    problem = load("crying-baby")
    bot = Bot(problem, 0, "it", "crying-baby", open_channel=lambda _: program)
    dmplay.rollout(problem, [bot], episodes=games, turn_limit=turns, seed=1)
    told = [(said["type"], said["game"], said["turn"]) for said in program.heard[1:]]
    rounds = [
        [*range(MAX_OPEN_REQUESTS)],
        [MAX_OPEN_REQUESTS],
    ]  # so many are asked before the first answer
    assert told == [
        (kind, game, turn)
        for played in range(turns)
        for asked in rounds
        for game in asked
        for kind, turn in (("turn", played), ("act", played + 1))
    ]


def test_what_is_sent_to_a_worker_begins_a_program_there_and_brings_a_forfeit_back() -> None:
    there = pickle.loads(pickle.dumps(BotState(log=b"of the one here")))
    assert there == BotState()
    back = pickle.loads(pickle.dumps(Forfeit("dead", "it ended", "agent")))
    assert str(back) == "agent forfeits, dead: it ended"
    assert str(Forfeit("dead", "it ended")) == "dead: it ended"


def test_a_belief_is_told_only_where_it_is_asked_for_and_allowed() -> None:
    wants = HELLO[:-1] + ', "wants": ["belief"]}'
    for hello, asked in ((wants, True), (HELLO, False)):
        program = Said(hello, *ignoring(2))
        game = program.seated("crying-baby", belief=True)
        game.advance()
        beliefs = game.view(0).beliefs
        game.advance()
        assert beliefs is not None
        sated, hungry = beliefs[1].tolist()
        assert program.heard[-1].get("belief") == (
            {"sated": sated, "hungry": hungry} if asked else None
        )
    with pytest.raises(Forfeit, match=r"wants \['belief'\], expected some of history"):
        Said(wants).seated("crying-baby").advance()


def test_an_answer_that_nobody_waits_for_any_more_is_passed_over() -> None:
    program = Said(HELLO, act(1, "feed"), '{"type": "thought"}', act(1, "feed"), act(2, "sing"))
    game = program.seated("crying-baby")
    assert [game.advance().actions.tolist() for _ in range(2)] == [[0], [1]]


def test_what_is_said_of_an_answer_that_cannot_be() -> None:
    for line, why in {
        "[]": """garbled: said '[]': no object with a "type\"""",
        "[" * 30_000: "garbled: said '[[[[",
        act(1, "down"): "illegal: got down, expected one of ",
        '{"type": "act", "id": 1, "action": 3}': "garbled: answered action 3",
        '{"type": "act", "id": 1, "id": 1}': 'garbled: said \'{"type": "act", ',
        '{"type": "act"}': "garbled: answered id None, expected 1",
    }.items():
        with pytest.raises(Forfeit, match=re.escape(f"agent forfeits, {why}")):
            Said(HELLO, line).seated("2048").advance()
    for wish in ('"draws": -1', '"draws": true', '"wants": 1', '"wants": ["state"]'):
        with pytest.raises(Forfeit, match=r"garbled: wants .*, expected "):
            Said(f"{HELLO[:-1]}, {wish}}}").seated("2048").advance()


def test_a_program_plays_many_games_at_once() -> None:
    problem = load("hexworld")
    bot = ours(problem, 0, "random", "hexworld")
    played = dmplay.rollout(problem, random_play(problem), episodes=3, turn_limit=SOME, seed=1)
    its = dmplay.rollout(problem, [bot], episodes=3, turn_limit=SOME, seed=1)
    assert (its.returns == played.returns).all()
    assert (its.final_states == played.final_states).all()


def test_what_a_speaker_cannot_answer_is_said() -> None:
    for lines, why in {
        ('{"type": "act"}',): "expected hello before act",
        ('{"type": "hello", "protocol": 2}',): "protocol 2, expected 1",
        ('{"type": "hello", "protocol": 1}',): "no 'parameters'",
        ("hello",): "Expecting value",
    }.items():
        speaker = BotServer("random", make_seat_factory("random", "hexworld"))
        with pytest.raises(BadParameter, match=f"^got '.*': {why}"):
            [*map(speaker.answer, lines)]


def test_what_is_no_program_is_refused_before_a_game_begins() -> None:
    for name, why in {
        "bot:": "expected a command, as bot:./player",
        "bot:./nobody": "no program './nobody'",
        "bot:'sh": "no closing quotation",
        "bot:clock=soon,sh": "clock: got 'soon', expected a number",
        "bot:clock=0,sh": "clock: got 0, expected a number at least 1e-06",
        "bot:belief=1,sh": "belief: got '1', expected true or false",
    }.items():
        with pytest.raises(BadParameter, match=re.escape(why)):
            dmplay.load_agent(load("hexworld"), 0, name)
    bot = dmplay.load_agent(load("hexworld"), 0, "bot:belief=true,clock=2.5,sh -c 'echo clock=1'")
    assert isinstance(bot, Bot)
    assert (bot.belief, bot.clock, bot.command) == (True, 2.5, "sh -c 'echo clock=1'")
