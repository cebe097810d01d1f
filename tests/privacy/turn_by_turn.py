"""The ways in which a seat follows a game, and everything that each of them shows turn by turn."""

import json
import shlex
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np

import dmplay
from dmplay.core.arrays import Array, Bools, Reals
from dmplay.core.policy import Memory, Percept, Policy
from dmplay.core.problem import WAIT_LABEL, Problem
from dmplay.core.session import Session
from dmplay.external.bots.bot_policy import Bot
from dmplay.game.command_line_results import McpServerConfig
from dmplay.game.game_setup import start_new_game
from dmplay.game.launch_requests import GameRequest
from dmplay.gym import Env
from dmplay.servers.mcp.language_model_games import ModelGames
from dmplay.zoo import ParallelEnv
from tests.privacy.front_ends import FRONT_ENDS

BOT_SOURCE = """
import json, sys
log, actions = open(sys.argv[1], "w"), iter(sys.argv[2:])
for line in sys.stdin:
    log.write(line)
    log.flush()
    message = json.loads(line)
    if message["type"] == "hello":
        print('{"type": "hello", "protocol": 1}', flush=True)
    elif message["type"] == "act":
        answer = {"type": "act", "id": message["id"], "action": next(actions)}
        print(json.dumps(answer), flush=True)
"""


class Play(NamedTuple):
    """The seed of a game and the actions of all seats, by turn and seat."""

    name: str
    problem: Problem
    seed: int
    labels: tuple[tuple[str, ...], ...]

    def own_labels(self, seat: int) -> list[str]:
        """Return the actions that a seat chose, without the turns in which it waited."""
        return [joint[seat] for joint in self.labels if joint[seat] != WAIT_LABEL]

    def own_turns(self, seat: int) -> list[int]:
        """Return the number of turns before each choice of a seat."""
        return [turn for turn, joint in enumerate(self.labels) if joint[seat] != WAIT_LABEL]


# everything that was shown to a seat, by the number of turns until then
OutputByTurn = dict[int, object]
Door = Callable[[Play, int], OutputByTurn]


@dataclass
class RecordingPolicy:
    """A policy that plays given actions, and records everything that it is called with."""

    play: Play
    seat: int
    uniform_count: int = 0
    calls: list[list[object]] = field(default_factory=list)  # by turn

    def initial_memory(self, observation: Array) -> Memory:
        self.calls.append([repr(observation)])
        return (np.zeros(len(observation), int),)

    def update_memory(self, memory: Memory, percept: Percept) -> Memory:
        self.calls.append([repr(percept)])
        return (memory[0] + 1,)

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        self.calls[-1].append(repr(legal))
        turn = int(memory[0][0])
        labels = self.play.labels[min(turn, len(self.play.labels) - 1)]
        return np.array([self.play.problem.parse_action(self.seat, labels[self.seat])])

    def action_values(self, memory: Memory) -> None:
        return None


def list_calls(policy: RecordingPolicy) -> OutputByTurn:
    """Return the calls of a policy until each turn."""
    return {turn: policy.calls[: turn + 1] for turn in range(len(policy.play.labels))}


def make_session(play: Play, policies: Sequence[Policy | None] = ()) -> Session:
    """Return the game of a play before its first turn."""
    return Session(play.problem, dmplay.SeededUniforms(play.seed), policies)


def advance(session: Session, play: Play, turn: int) -> None:
    """Play one turn of a play by the actions of all seats."""
    labels = enumerate(play.labels[turn])
    session.advance([play.problem.parse_action(seat, label) for seat, label in labels])


def watch_view(play: Play, seat: int) -> OutputByTurn:
    """Return the views and percepts of a seat."""
    session, outputs, entries = make_session(play), OutputByTurn(), list[str]()
    for turn in range(len(play.labels)):
        view = session.view(seat)
        facts = {
            name: value if isinstance(value, str) else repr(None if value is None else [*value])
            for name, value in vars(view).items()
            if name not in ("problem", "legal_actions_mask")
            and isinstance(value, str | Sequence | None)
        }
        entries.append(repr((facts, view.legal_actions_mask, view.last_action_label)))
        outputs[turn] = [*entries]
        advance(session, play, turn)
        entries.append(repr(session.build_percept(seat, turn + 1)))
    return outputs


def watch_policy(play: Play, seat: int) -> OutputByTurn:
    """Return the calls of a policy in a session."""
    policies = [RecordingPolicy(play, item) for item in range(len(play.problem.agents))]
    session = make_session(play, policies)
    for _ in play.labels:
        for seated_policy in session.seated_policies:
            assert seated_policy
            seated_policy.current_memory()
        session.advance()
    return list_calls(policies[seat])


def watch_rollout(play: Play, seat: int) -> OutputByTurn:
    """Return the calls of a policy in a rollout."""
    policies = [RecordingPolicy(play, item) for item in range(len(play.problem.agents))]
    dmplay.rollout(play.problem, policies, episodes=1, seed=play.seed, turn_limit=len(play.labels))
    policies[seat].calls = policies[seat].calls[-len(play.labels) - 1 :]
    return list_calls(policies[seat])


def watch_manual_game(play: Play, seat: int) -> OutputByTurn:
    """Return the answers of `dmplay.play` to a seat."""
    agent = play.problem.agents[seat]
    game = dmplay.play(play.problem, seed=play.seed)
    outputs = OutputByTurn()
    entries = list[object]()
    for turn, labels in enumerate(play.labels):
        entries += [game.last_observation(agent), game.legal_actions(agent)]
        entries.append(game.last_percept(agent) if turn else None)
        outputs[turn] = [*entries]
        game.act(*labels)
    return outputs


def watch_notebook(play: Play, seat: int) -> OutputByTurn:
    """Return the displays of a game in a notebook with one seat for a person."""
    policies = [RecordingPolicy(play, item) for item in range(len(play.problem.agents))]
    session = make_session(
        play, [None if item == seat else policy for item, policy in enumerate(policies)]
    )
    outputs, entries = OutputByTurn(), list[object]()
    for turn in range(len(play.labels)):
        entries.append(session._repr_mimebundle_())
        outputs[turn] = [*entries]
        advance(session, play, turn)
    return outputs


def watch_bot(play: Play, seat: int) -> OutputByTurn:
    """Return the messages to a program, until each of its choices."""
    Path("bot.py").write_text(BOT_SOURCE, encoding="utf-8")
    words = [sys.executable, "-S", "-E", "bot.py", "log", *play.own_labels(seat)]
    bot = Bot(play.problem, seat, shlex.join(words), problem_name=play.name)
    policies: list[Policy] = [
        RecordingPolicy(play, item) for item in range(len(play.problem.agents))
    ]
    policies[seat] = bot
    session = make_session(play, policies)
    for _ in play.labels:
        session.advance()
    bot.close()
    outputs, messages = OutputByTurn(), list[str]()
    log_path = Path("log")  # There is none if the program was never to choose.
    for line in log_path.read_text(encoding="utf-8").splitlines() if log_path.exists() else []:
        messages.append(line)
        message = json.loads(line)
        if message["type"] == "act":
            outputs[message["turn"] - 1] = [*messages]
    log_path.unlink(missing_ok=True)
    return outputs


def watch_front_end(front: str, play: Play, seat: int) -> OutputByTurn:
    """Return the output of a front end, until each choice of a person in the seat.

    Random agents play the other seats.
    """
    players = [
        f"{agent}={'human' if item == seat else 'random'}"
        for item, agent in enumerate(play.problem.agents)
    ]
    request = GameRequest(
        play.name, seed=play.seed, seats=players, is_seed_visible=False, has_fresh_seed=True
    )
    own_labels = play.own_labels(seat)
    responses = FRONT_ENDS[front](start_new_game(request), own_labels) if own_labels else []
    return {turn: responses[: n + 1] for n, turn in enumerate(play.own_turns(seat))}


def watch_gym(play: Play, seat: int) -> OutputByTurn:
    """Return the answers of a Gymnasium environment in which agents play the other seats."""
    others = "random" if len(play.problem.agents) > 1 else ""
    environment = Env(play.problem, seat=play.problem.agents[seat], others=others)
    observation, info = environment.reset(seed=play.seed)
    outputs, entries = OutputByTurn(), [repr((observation, info))]
    for turn, labels in enumerate(play.labels):
        outputs[turn] = [*entries]
        action = play.problem.parse_action(seat, labels[seat])
        observation, reward, _, _, info = environment.step(action)
        entries.append(repr((observation, info, play.problem.rewards_observable and reward)))
    return outputs


def watch_zoo(play: Play, seat: int) -> OutputByTurn:
    """Return the answers of a PettingZoo environment to one agent."""
    environment, agent = ParallelEnv(play.problem), play.problem.agents[seat]
    observations, infos = environment.reset(seed=play.seed)
    outputs, entries = OutputByTurn(), [repr((observations[agent], infos[agent]))]
    for turn, labels in enumerate(play.labels):
        outputs[turn] = [*entries]
        actions = {
            name: play.problem.parse_action(item, labels[item])
            for item, name in enumerate(play.problem.agents)
        }
        observations, rewards, _, _, infos = environment.step(actions)
        reward = play.problem.rewards_observable and rewards[agent]
        entries.append(repr((observations[agent], infos[agent], reward)))
    return outputs


def watch_model(play: Play, seat: int) -> OutputByTurn:
    """Return the answers to a language model over MCP, until each of its choices.

    Random agents play the other seats.
    """
    games = ModelGames(
        McpServerConfig((play.name,), seed=play.seed, transcript_folder=Path("games"))
    )
    problem_id = Path(play.name).stem if play.name.endswith(".efg") else play.name
    answers: list[object] = [games.start_game(problem_id, play.problem.agents[seat], "random")]
    outputs = OutputByTurn()
    for turn, label in zip(play.own_turns(seat), play.own_labels(seat), strict=True):
        outputs[turn] = [*answers]
        answers.append(games.play_action("g1", label))
    games.end_all_games()
    return outputs


TURN_DOORS: dict[str, Door] = {
    "view": watch_view,
    "policy": watch_policy,
    "rollout": watch_rollout,
    "dmplay.play": watch_manual_game,
    "notebook": watch_notebook,
    "bot": watch_bot,
}
LINE_DOORS: dict[str, Door] = {
    front: partial(watch_front_end, front) for front in ("json", "plain", "screen")
} | {"mcp": watch_model}
LEARNING_DOORS: dict[str, Door] = {"gym": watch_gym, "zoo": watch_zoo}
