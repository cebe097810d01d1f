"""A policy that lets another process choose its actions: `bot:COMMAND`."""

import shlex
import shutil
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, fields

import numpy as np

from dmplay.agents.base import SeatPolicy
from dmplay.core import belief
from dmplay.core.arrays import Array, Bools, Reals
from dmplay.core.parameters import parameter
from dmplay.core.policy import Memory, Percept
from dmplay.core.safe_files import register_input_file
from dmplay.core.session import MAX_LISTED_STATES, belief_size
from dmplay.errors import BadParameter, Forfeit
from dmplay.external.bots.bot_process import BotProcess
from dmplay.external.bots.conversation import (
    ActionRequest,
    BotChannel,
    BotConversation,
    HistoryNode,
)
from dmplay.external.bots.protocol import (
    MANY_GAMES_OFFER,
    JsonObject,
    encode_observation,
    encode_percept,
)


@dataclass
class BotState:
    """The conversation with a bot while its process runs, and its log afterwards."""

    conversation: BotConversation | None = None
    log: bytes = b""

    def __reduce__(self) -> tuple[type["BotState"], tuple[()]]:
        """Return an empty state: a copy in another process starts its own bot."""
        return BotState, ()


@dataclass(frozen=True)
class Bot(SeatPolicy):
    """A program that plays a seat, in its own process, which starts with the first choice."""

    command: str
    problem_name: str = ""  # sent to the program
    turn_limit: int | None = None  # None if the problem's horizon is the only limit
    open_channel: Callable[[Sequence[str]], BotChannel] = BotProcess
    clock: float = parameter(
        10.0, "time limit for each answer, in seconds", 0.0, 86_400.0, exclusive_low=True
    )
    belief: bool = parameter(False, "whether the program can request the belief of its seat")
    _state: BotState = field(default_factory=BotState, init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        """Raise BadParameter if the command is empty, malformed, or names no program."""
        super().__post_init__()
        try:
            arguments = shlex.split(self.command)
        except ValueError as error:  # unbalanced quotation marks
            raise BadParameter(f"bot:{self.command}: {str(error).lower()}") from None
        if not arguments:
            raise BadParameter(
                "bot: expected a command, such as bot:./player or 'bot:python3 player'"
            )
        if self.open_channel is BotProcess and shutil.which(arguments[0]) is None:
            raise BadParameter(
                f"bot: program {arguments[0]!r} not found; give its path, such as bot:./player"
            )
        for argument in arguments:  # such as its script
            register_input_file(argument)

    @property
    def depends_on_clock(self) -> bool:
        """True: the program may choose differently next time."""
        return True

    @property
    def uniform_count(self) -> int:
        """The number of uniforms that the program requests for each choice."""
        with self._open_conversation() as conversation:
            return conversation.uniform_count

    def initial_memory(self, observation: Array) -> Memory:
        """Return the first history node of each row: the initial observation and belief."""
        prior = belief.initial_belief(self.problem) if self._sends_beliefs else None
        encoded_observations = [
            encode_observation(self.problem, self.seat, value) for value in observation
        ]
        rows = enumerate(encoded_observations)
        return (
            _to_object_array(
                [HistoryNode(None, 0, {"observation": value}, prior, n) for n, value in rows]
            ),
        )

    def update_memory(self, memory: Memory, percept: Percept) -> Memory:
        """Return the memory with one more turn in each row."""
        return (
            _to_object_array(
                [self._extend_history(row, node, percept) for row, node in enumerate(memory[0])]
            ),
        )

    def _extend_history(self, row: int, previous: HistoryNode, percept: Percept) -> HistoryNode:
        """Return one row's history node after a turn."""
        facts = encode_percept(self.problem, self.seat, percept, row)
        new_belief = self._update_belief(row, previous.belief, percept)
        return HistoryNode(previous, previous.turn + 1, facts, new_belief, previous.game_number)

    def _update_belief(self, row: int, previous: Reals | None, percept: Percept) -> Reals | None:
        """Return the seat's belief after a turn; None if no belief is computed.

        It uses only what the seat knows: its own action and observation.
        """
        if previous is None:
            return None
        actions: list[int | None] = [None] * len(self.problem.agents)
        observations = list(actions)
        actions[self.seat] = int(percept.action[row])
        observations[self.seat] = int(percept.observation[row])
        return belief.update_belief(self.problem, previous, actions, observations).belief

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """Return the program's action for each row."""
        legal_masks = [None] * len(u) if legal is None else [*legal]
        with self._open_conversation() as conversation:
            return np.array(
                conversation.request_actions([*map(ActionRequest, memory[0], legal_masks, u)])
            )

    def stated_belief(self, memory: Memory) -> Reals | None:
        """Return the beliefs `[B, S]` stated with the program's last actions; NaN for none."""
        conversation = self._state.conversation
        if conversation is None:
            return None
        rows = [conversation.stated_belief(node) for node in memory[0]]
        size = next((len(row) for row in rows if row is not None), 0)
        nothing = np.full(size, np.nan)
        return np.array([nothing if row is None else row for row in rows]) if size else None

    @property
    def _sends_beliefs(self) -> bool:
        """True if the program may receive beliefs and they are short enough to list."""
        return self.belief and belief_size(self.problem) <= MAX_LISTED_STATES

    @contextmanager
    def _open_conversation(self) -> Iterator[BotConversation]:
        """Run the block with the conversation, which is started if necessary.

        If the block raises Forfeit, close the bot and add its seat to the error.
        """
        try:
            yield self._state.conversation or self._start_conversation()
        except Forfeit as error:
            self.close()
            error.seat = self.problem.agents[self.seat]
            raise

    def _start_conversation(self) -> BotConversation:
        """Start the program and return the conversation, after the exchange of hello messages."""
        problem = self.problem
        channel = self.open_channel(shlex.split(self.command))
        conversation = self._state.conversation = BotConversation(
            channel, problem, self.seat, self.clock
        )
        parameters = {
            problem_field.name: getattr(problem, problem_field.name)
            for problem_field in fields(problem)
        }
        game_facts: JsonObject = {
            "problem": self.problem_name,
            "parameters": parameters,
            "turns": self.turn_limit,
        }
        conversation.exchange_hello(
            game_facts, ["history", MANY_GAMES_OFFER] + ["belief"] * self._sends_beliefs
        )
        return conversation

    @property
    def is_running(self) -> bool:
        """True if the program was started and has not been closed."""
        return self._state.conversation is not None

    @property
    def log(self) -> str:
        """The end of the program's stderr output, once it is closed."""
        return self._state.log.decode(errors="replace")

    def close(self, end_facts: JsonObject | None = None, memory: Memory = ()) -> None:
        """End the program, after sending it the last turn and `end_facts` if both are given."""
        conversation, self._state.conversation = self._state.conversation, None
        if conversation:
            self._state.log = conversation.close(end_facts, memory[0][0] if memory else None)


def _to_object_array(histories: Sequence[HistoryNode]) -> Array:
    """Return history nodes as an object array `[B]`; they are tuples, which NumPy would split."""
    column = np.empty(len(histories), object)
    for row, history in enumerate(histories):
        column[row] = history
    return column
