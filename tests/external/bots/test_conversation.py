"""Tests that a program receives only its seat's information and plays like the agent it runs."""

import json
import pickle
import re
from collections.abc import Sequence
from dataclasses import fields

import pytest

import dmplay
from dmplay.cli.servers import make_seat_factory
from dmplay.core.policy import Policy
from dmplay.core.problem import Problem
from dmplay.core.spaces import RealVector, TextLine
from dmplay.errors import BadParameter, Forfeit
from dmplay.external.bots.bot_policy import Bot, BotState
from dmplay.external.bots.conversation import MAX_OPEN_REQUESTS
from dmplay.external.bots.protocol import decode_observation
from dmplay.external.bots.shutdown import close_bots
from dmplay.problems.crying_baby.rules import CryingBaby
from dmplay.registry import agents
from dmplay.servers.bot_server import BotServer
from dmplay.transcript.format import collect_turn_facts
from tests.support.problem_cases import (
    CASE_NAMES,
    SHORT_GAME_TURNS,
    load_problem,
    load_small_problem,
    make_random_policies,
)
from tests.support.seated_agents import make_agent

LARGEST_BELIEF_PROBLEM = "collaborative-predator-prey"  # each turn has a belief over 1,728 states
SEED = 5  # with this seed, `down` is illegal on the first board of 2048
HELLO_LINE = '{"type": "hello", "protocol": 1}'


class InProcessServer:
    """A built-in agent behind the protocol, in this process."""

    log = b""

    def __init__(self, server: BotServer) -> None:
        self._speaker = server
        self._sent_lines: list[str] = []

    def send(self, text: str, seconds: float) -> None:
        answers = map(self._speaker.answer, text.splitlines())
        self._sent_lines += filter(None, answers)

    def read_line(self) -> str:
        return self._sent_lines.pop(0)

    def close(self, farewell: str = "") -> None:
        self.send(farewell, 0.0)


class ScriptedProgram:
    """A program that sends these lines regardless of its input."""

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

    def list_sent_values(self, key: str) -> list[object]:
        """Return the value of a key in each received message."""
        return [message.get(key) for message in self.heard]

    def seated(self, name: str, *, belief: bool = False) -> dmplay.Session:
        """Create a session with this program in the first seat."""
        problem = load_problem(name)
        bot = Bot(problem, 0, "it", name, open_channel=lambda _: self, belief=belief)
        return dmplay.Session(problem, dmplay.SeededUniforms(SEED), [bot])


def make_server_bot(problem: Problem, seat: int, agent: str, name: str) -> Bot:
    """Create a bot that runs a built-in agent."""
    server = BotServer(agent, make_seat_factory(agent, name))
    return Bot(problem, seat, "it", name, open_channel=lambda _: InProcessServer(server))


def encode_act(number: int, action: str) -> str:
    return json.dumps({"type": "act", "id": number, "action": action})


def encode_ignore_actions(turns: int) -> list[str]:
    return [encode_act(number, "ignore") for number in range(1, turns + 1)]


def play_and_collect_facts(
    policies: Sequence[Policy | None], problem: Problem
) -> list[dict[str, object]]:
    """Play a few turns and return the facts of each."""
    session = dmplay.Session(
        problem, dmplay.SeededUniforms(7), policies, turn_limit=SHORT_GAME_TURNS
    )
    rows = [collect_turn_facts(session)]
    while not session.over:
        session.advance()
        rows.append(collect_turn_facts(session))
    return rows


@pytest.mark.usefixtures("coarse")
@pytest.mark.parametrize(
    "name", [name for name in CASE_NAMES if not name.startswith(LARGEST_BELIEF_PROBLEM)]
)
def test_a_program_plays_like_the_agent_it_runs(name: str) -> None:
    problem = load_small_problem(name)
    for seat in range(len(problem.agents)):
        roster = agents.load_roster(problem, seat)
        # an agent that needs no long computation
        rule = next(name for name in roster.agents if name != roster.hint_provider)
        for agent in {"random", rule}:
            bot = make_server_bot(problem, seat, agent, name)
            results = []
            for policy in (make_agent(problem, seat, agent), bot):
                policies: list[Policy | None] = [*make_random_policies(problem)]
                policies[seat] = policy
                results.append(play_and_collect_facts(policies, problem))
            assert results[0] == results[1], agent


def test_each_turn_is_sent_once_and_all_turns_are_sent_again_after_an_undo() -> None:
    program = ScriptedProgram(HELLO_LINE, *encode_ignore_actions(4))
    game = program.seated("crying-baby")
    for _ in range(3):
        game.advance()
    assert program.list_sent_values("type") == [
        "hello",
        "turn",
        "act",
        "turn",
        "act",
        "turn",
        "act",
    ]
    assert program.list_sent_values("turn")[1:] == [0, 1, 1, 2, 2, 3]
    game.undo(2)
    game.advance()
    assert program.list_sent_values("type")[7:] == ["turn", "turn", "act"]
    assert program.list_sent_values("turn")[7:] == [0, 1, 2]


def test_a_program_receives_its_seat_s_information_and_the_end_of_the_game() -> None:
    program = ScriptedProgram(HELLO_LINE, *encode_ignore_actions(2))
    game = program.seated("crying-baby")
    game.advance()
    game.advance()
    game.end("quit")
    close_bots(game, "it")
    hello, first, _, turn, ask, last, over, end = program.heard
    parameters = {field.name: getattr(game.problem, field.name) for field in fields(game.problem)}
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


def test_the_final_message_of_a_resumable_game_has_no_returns() -> None:
    program = ScriptedProgram(HELLO_LINE, *encode_ignore_actions(1))
    game = program.seated("crying-baby")
    game.advance()
    game.end("interrupted")
    close_bots(game, "it")
    assert program.heard[-2] == {"type": "over", "reason": "interrupted", "turns": 1}


def test_a_program_that_wants_the_history_receives_all_turns() -> None:
    program = ScriptedProgram(
        HELLO_LINE[:-1] + ', "wants": ["history"]}', *encode_ignore_actions(2)
    )
    game = program.seated("crying-baby")
    game.advance()
    game.advance()
    assert program.list_sent_values("type") == ["hello", "act", "act"]
    turns = [
        {"turn": 0, "observation": None},
        {"turn": 1, "action": "ignore", "observation": "crying"},
    ]
    assert program.list_sent_values("history")[1:] == [turns[:1], turns]


def test_each_turn_of_simultaneous_games_is_sent_once() -> None:
    games, turns = MAX_OPEN_REQUESTS + 1, 2
    program = ScriptedProgram(
        HELLO_LINE[:-1] + ', "wants": ["games"]}', *encode_ignore_actions(games * turns)
    )
    problem = load_problem("crying-baby")
    bot = Bot(problem, 0, "it", "crying-baby", open_channel=lambda _: program)
    dmplay.rollout(problem, [bot], episodes=games, turn_limit=turns, seed=1)
    messages = [
        (message["type"], message["game"], message["turn"]) for message in program.heard[1:]
    ]
    # number of requests sent before the first answer
    batches = [[*range(MAX_OPEN_REQUESTS)], [MAX_OPEN_REQUESTS]]
    assert messages == [
        (kind, game, turn)
        for turns_played in range(turns)
        for batch in batches
        for game in batch
        for kind, turn in (("turn", turns_played), ("act", turns_played + 1))
    ]


def test_pickling_drops_a_running_program_and_preserves_a_forfeit() -> None:
    state = pickle.loads(pickle.dumps(BotState(log=b"of the one here")))
    assert state == BotState()
    forfeit = pickle.loads(pickle.dumps(Forfeit("dead", "it ended", "agent")))
    assert str(forfeit) == "agent forfeits, dead: it ended"
    assert str(Forfeit("dead", "it ended")) == "dead: it ended"


def test_a_belief_is_sent_only_if_the_program_wants_it_and_may_have_it() -> None:
    hello_with_belief = HELLO_LINE[:-1] + ', "wants": ["belief"]}'
    for hello, expects_belief in ((hello_with_belief, True), (HELLO_LINE, False)):
        program = ScriptedProgram(hello, *encode_ignore_actions(2))
        game = program.seated("crying-baby", belief=True)
        game.advance()
        beliefs = game.view(0).beliefs
        game.advance()
        assert beliefs is not None
        sated, hungry = beliefs[1].tolist()
        assert program.heard[-1].get("belief") == (
            {"sated": sated, "hungry": hungry} if expects_belief else None
        )
    with pytest.raises(
        Forfeit, match=r"got wants \['belief'\], expected a list of offers: history"
    ):
        ScriptedProgram(hello_with_belief).seated("crying-baby").advance()


def test_an_outdated_answer_is_ignored() -> None:
    program = ScriptedProgram(
        HELLO_LINE,
        encode_act(1, "feed"),
        '{"type": "thought"}',
        encode_act(1, "feed"),
        encode_act(2, "sing"),
    )
    game = program.seated("crying-baby")
    assert [game.advance().actions.tolist() for _ in range(2)] == [[0], [1]]


def test_an_invalid_answer_is_a_forfeit_with_a_message() -> None:
    for line, message in {
        "[]": """garbled: the bot sent '[]': expected a JSON object with a "type\"""",
        "[" * 30_000: "garbled: the bot sent '[[[[",
        encode_act(1, "down"): "illegal: got down, expected one of ",
        '{"type": "act", "id": 1, "action": 3}': (
            "garbled: got action 3, expected the name of an action"
        ),
        '{"type": "act", "id": 1, "id": 1}': 'garbled: the bot sent \'{"type": "act", ',
        '{"type": "act"}': "garbled: got id None, expected 1",
    }.items():
        with pytest.raises(Forfeit, match=re.escape(f"agent forfeits, {message}")):
            ScriptedProgram(HELLO_LINE, line).seated("2048").advance()
    for invalid_field in ('"draws": -1', '"draws": true', '"wants": 1', '"wants": ["state"]'):
        with pytest.raises(Forfeit, match=r"garbled: got .*, expected "):
            ScriptedProgram(f"{HELLO_LINE[:-1]}, {invalid_field}}}").seated("2048").advance()


def test_a_program_plays_several_games_simultaneously() -> None:
    problem = load_problem("hexworld")
    bot = make_server_bot(problem, 0, "random", "hexworld")
    expected = dmplay.rollout(
        problem, make_random_policies(problem), episodes=3, turn_limit=SHORT_GAME_TURNS, seed=1
    )
    result = dmplay.rollout(problem, [bot], episodes=3, turn_limit=SHORT_GAME_TURNS, seed=1)
    assert (result.returns == expected.returns).all()
    assert (result.final_states == expected.final_states).all()


def test_a_request_that_the_server_cannot_answer_is_an_error() -> None:
    for lines, message in {
        ('{"type": "act"}',): "got act, expected hello first",
        ('{"type": "hello", "protocol": 2}',): "protocol: got 2, expected 1",
        ('{"type": "hello", "protocol": 1}',): "field 'parameters' is missing",
        ("hello",): "Expecting value",
    }.items():
        server = BotServer("random", make_seat_factory("random", "hexworld"))
        with pytest.raises(BadParameter, match=rf"^line \d+: got '.*': {message}"):
            [*map(server.answer, lines)]


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"seat": [0.5]}, "seat [0.5], expected a name"),
        ({"seat": {}}, "seat {}, expected a name"),
        ({"seat": 0}, "seat 0, expected a name"),
        ({"seat": "agnet"}, "unknown seat 'agnet'; did you mean agent?"),
        ({"parameters": []}, "parameters [], expected an object"),
        ({"parameters": None}, "parameters None, expected an object"),
        ({"turns": "3"}, "turns '3', expected a whole number, 1 or more, or null"),
        ({"turns": True}, "turns True, expected a whole number, 1 or more, or null"),
        ({"turns": -1}, "turns -1, expected a whole number, 1 or more, or null"),
        ({"offers": 3}, "offers 3, expected a list"),
    ],
)
def test_a_malformed_field_of_hello_is_named(fields: dict[str, object], message: str) -> None:
    hello = {"type": "hello", "protocol": 1, "parameters": {}, "seat": "agent", "turns": None}
    server = BotServer("random", make_seat_factory("random", "hexworld"))
    with pytest.raises(BadParameter, match=f"^line 1: got '.*: {re.escape(message)}$"):
        server.answer(json.dumps(hello | fields))
    assert json.loads(server.answer(json.dumps(hello)))["type"] == "hello"


def test_a_turn_without_the_actions_that_a_policy_reads_is_named() -> None:
    hello = {"type": "hello", "protocol": 1, "parameters": {}, "seat": "agent1", "turns": None}
    server = BotServer("tit-for-tat", make_seat_factory("tit-for-tat", "prisoners-dilemma"))
    server.answer(json.dumps(hello))
    server.answer(json.dumps({"type": "turn", "turn": 0, "observation": ""}))
    turn = {"type": "turn", "turn": 1, "action": "cooperate", "observation": ""}
    with pytest.raises(BadParameter, match=r"field 'actions' is missing$"):
        server.answer(json.dumps(turn))


HIDDEN_STATE_LINES = (
    '{"type": "hello", "protocol": 1, "parameters": {}, "turns": 2, "seat": "agent"}',
    '{"type": "turn", "game": 0, "turn": 0, "observation": null}',
    '{"type": "act", "id": 1, "game": 0, "turn": 1, "legal": ["feed", "sing", "ignore"]}',
    '{"type": "turn", "game": 0, "turn": 1, "action": "feed", "observation": "quiet"}',
    '{"type": "act", "id": 2, "game": 0, "turn": 2, "legal": ["feed", "sing", "ignore"]}',
)
A_COUNT, A_LABEL = "a whole number, 0 or more", "one of crying, quiet"


@pytest.mark.parametrize(
    ("number", "old", "new", "message"),
    [
        (2, '"game": 0', '"game": null', f"game null, expected {A_COUNT}"),
        (2, '"game": 0', '"game": -1', f"game -1, expected {A_COUNT}"),
        (2, '"turn": 0', '"turn": "0"', f'turn "0", expected {A_COUNT}'),
        (2, '"turn": 0, ', "", "field 'turn' is missing"),
        (2, "null", "[0]", f"observation [0], expected {A_LABEL}"),
        (3, '["feed", "sing", "ignore"]', "[]", "legal [], expected a list of one or more"),
        (3, '["feed", "sing", "ignore"]', "null", "legal null, expected a list of one or more"),
        (3, '"ignore"', '"ignored"', 'legal ["feed", "sing", "ignored"], expected a list of one'),
        (3, '"id": 1, ', "", "field 'id' is missing"),
        (3, '"id": 1', '"luck": [0.5], "id": 1', "luck [0.5], expected a list of 0 numbers"),
        (4, '"quiet"', "null", f"observation null, expected {A_LABEL}"),
        (4, '"quiet"', '""', f'observation "", expected {A_LABEL}'),
        (4, '"quiet"', '"quite"', "unknown observation 'quite'; did you mean quiet?"),
        (4, '"feed"', "null", "action null, expected one of feed, sing, ignore"),
        (4, '"feed"', "0", "action 0, expected one of feed, sing, ignore"),
        (4, '"feed"', '"fed"', "unknown action 'fed'; did you mean feed?"),
        (4, '"game": 0', '"game": 7', "game 7 has no turn 0"),
        (4, '"action"', '"actions": [], "action"',
         "actions [], expected an action for each of agent"),
        (4, '"action"', '"reward": true, "action"', "reward true, expected a number"),
        (5, '"game": 0', '"game": []', f"game [], expected {A_COUNT}"),
        (5, '"game": 0', '"game": 1', "game 1 has no turn 0"),
        (5, '"type"', "'type'", "Expecting property name enclosed in double quotes, at column 2"),
    ],
)  # fmt: skip
def test_an_invalid_value_in_a_request_is_named_with_its_line(
    number: int, old: str, new: str, message: str
) -> None:
    lines = [*HIDDEN_STATE_LINES]
    assert old in lines[number - 1]
    lines[number - 1] = lines[number - 1].replace(old, new)
    server = BotServer("optimal", make_seat_factory("optimal", "crying-baby"))
    with pytest.raises(BadParameter, match=rf"^line {number}: got .*: {re.escape(message)}"):
        [*map(server.answer, lines)]


@pytest.mark.parametrize(
    ("name", "agent", "observation", "message"),
    [
        ("mountain-car", "random", [0.5], "observation [0.5], expected numbers of shape [2]"),
        ("mountain-car", "random", ["a", 1], 'observation ["a", 1], expected numbers of shape'),
        ("mountain-car", "random", [[1], [2, 3]], "observation [[1], [2, 3]], expected numbers"),
        ("mountain-car", "random", None, "observation null, expected numbers of shape [2]"),
        ("catch", "random", "near", "unknown observation 'near'; expected one of caught, dropped"),
        ("hexworld", "random", None, "observation null, expected a state as text, such as "),
        ("hexworld", "random", 3, "observation 3, expected a state as text, such as "),
        ("hexworld", "random", "no", 'observation "no", expected a state as text, such as '),
    ],
)
def test_an_invalid_first_observation_is_named(
    name: str, agent: str, observation: object, message: str
) -> None:
    server = BotServer(agent, make_seat_factory(agent, name))
    hello = {"type": "hello", "protocol": 1, "parameters": {}, "seat": "agent", "turns": None}
    server.answer(json.dumps(hello))
    turn = {"type": "turn", "turn": 0, "observation": observation}
    with pytest.raises(BadParameter, match=rf"^line 2: got .*: {re.escape(message)}"):
        server.answer(json.dumps(turn))


class MeasuredBaby(CryingBaby):
    """Shows two numbers of a hidden state."""

    observations = (RealVector(2),)  # type: ignore[assignment] # labels in the base class


class TalkingBaby(CryingBaby):
    """Shows a text about a hidden state."""

    observations = (TextLine(),)  # type: ignore[assignment] # labels in the base class


@pytest.mark.parametrize(
    ("problem", "value", "invalid", "expected"),
    [
        (MeasuredBaby(), [0.5, -1], [0.5], "numbers of shape [2]"),
        (TalkingBaby(), "a cry, far away", "", "text"),
    ],
)
def test_hidden_states_show_numbers_or_text(
    problem: dmplay.Problem, value: object, invalid: object, expected: str
) -> None:
    assert decode_observation(problem, 0, value).tolist() == [value]
    for received in (invalid, None, 3):
        message = f"observation {json.dumps(received)}, expected {expected}"
        with pytest.raises(BadParameter, match=f"^{re.escape(message)}$"):
            decode_observation(problem, 0, received)
    null_observation = decode_observation(problem, 0, None, initial=True)
    assert problem.observations[0].format_observation(null_observation[0]) == "nothing yet"


def test_the_uniforms_of_a_request_are_as_many_as_the_policy_wants() -> None:
    server = BotServer("random", make_seat_factory("random", "hexworld"))
    hello = {"type": "hello", "protocol": 1, "parameters": {}, "seat": "agent", "turns": None}
    server.answer(json.dumps(hello))
    server.answer(json.dumps({"type": "turn", "turn": 0, "observation": "(1,2)"}))
    act = {"type": "act", "id": 1, "turn": 1, "legal": ["e", "w"]}
    for luck in ([], [0.5, 0.5], ["0.5"], [True], 0.5, [2], None):
        expected = f"luck {json.dumps(luck)}, expected a list of 1 number from 0 to 1"
        with pytest.raises(BadParameter, match=re.escape(expected)):
            server.answer(json.dumps({**act, "luck": luck}))
    assert json.loads(server.answer(json.dumps({**act, "luck": [0.2]})))["action"] == "e"


def test_an_invalid_program_is_rejected_before_the_game_starts() -> None:
    for name, message in {
        "bot:": "expected a command, such as bot:./player",
        "bot:./nobody": "program './nobody' not found",
        "bot:'sh": "no closing quotation",
        "bot:clock=soon,sh": "clock: got 'soon', expected a number",
        "bot:clock=0,sh": "clock: got 0, expected a number at least 1e-06",
        "bot:belief=1,sh": "belief: got '1', expected true or false",
    }.items():
        with pytest.raises(BadParameter, match=re.escape(message)):
            dmplay.load_agent(load_problem("hexworld"), 0, name)
    bot = dmplay.load_agent(
        load_problem("hexworld"), 0, "bot:belief=true,clock=2.5,sh -c 'echo clock=1'"
    )
    assert isinstance(bot, Bot)
    assert (bot.belief, bot.clock, bot.command) == (True, 2.5, "sh -c 'echo clock=1'")
