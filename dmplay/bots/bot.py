"""A program in a seat: `bot:COMMAND`, a policy that asks another process."""

import shlex
import shutil
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, fields

import numpy as np

from dmplay import belief
from dmplay.bots.program import BotProcess
from dmplay.bots.protocol import MANY_GAMES_OFFER, JsonObject, encode_observation, encode_percept
from dmplay.bots.talk import ActionRequest, BotChannel, BotConversation, HistoryNode
from dmplay.chance import Array, Bools, Reals
from dmplay.core import Memory, Percept, parameter
from dmplay.errors import BadParameter, Forfeit
from dmplay.policies.kinds import SeatPolicy
from dmplay.session import MAX_LISTED_STATES, belief_size


@dataclass
class BotState:
    """A program that runs, or what it left."""

    conversation: BotConversation | None = None
    log: bytes = b""

    def __reduce__(self) -> tuple[type["BotState"], tuple[()]]:
        """A copy in another process begins its own program."""
        return BotState, ()


@dataclass(frozen=True)
class Bot(SeatPolicy):
    """A program that plays a seat, in a process of its own that begins with its first choice."""

    command: str
    problem_name: str = ""  # of the problem, as the program is told
    turn_limit: int | None = (
        None  # after which the game ends, where that is not the problem's horizon
    )
    open_channel: Callable[[Sequence[str]], BotChannel] = BotProcess
    clock: float = parameter(10.0, "seconds for an answer", 0.0, 86_400.0, exclusive_low=True)
    belief: bool = parameter(False, "whether it may be told what its seat is to believe")
    _state: BotState = field(default_factory=BotState, init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        """Refuses what is no program."""
        super().__post_init__()
        try:
            words = shlex.split(self.command)
        except ValueError as error:  # a quotation without end
            raise BadParameter(f"bot:{self.command}: {str(error).lower()}") from None
        if not words:
            raise BadParameter("bot: expected a command, as bot:./player or 'bot:python3 player'")
        if self.open_channel is BotProcess and shutil.which(words[0]) is None:
            raise BadParameter(f"bot: no program {words[0]!r}; give its path, as bot:./player")

    @property
    def depends_on_clock(self) -> bool:
        """It may do otherwise next time."""
        return True

    @property
    def uniform_count(self) -> int:
        """How many uniforms it wants for a choice, as it said."""
        with self._open_conversation() as talk:
            return talk.uniform_count

    def initial_memory(self, observation: Array) -> Memory:
        """What each row sees first."""
        prior = belief.initial_belief(self.problem) if self._sends_beliefs else None
        seen = [encode_observation(self.problem, self.seat, one) for one in observation]
        each = enumerate(seen)
        return (
            _to_object_array(
                [HistoryNode(None, 0, {"observation": one}, prior, n) for n, one in each]
            ),
        )

    def update_memory(self, memory: Memory, percept: Percept) -> Memory:
        """One more turn."""
        return (
            _to_object_array(
                [self._extend_history(row, one, percept) for row, one in enumerate(memory[0])]
            ),
        )

    def _extend_history(self, row: int, previous: HistoryNode, percept: Percept) -> HistoryNode:
        facts = encode_percept(self.problem, self.seat, percept, row)
        believed = self._update_belief(row, previous.belief, percept)
        return HistoryNode(previous, previous.turn + 1, facts, believed, previous.game_number)

    def _update_belief(self, row: int, previous: Reals | None, percept: Percept) -> Reals | None:
        """What the seat is to believe after a turn, by what it alone knows."""
        if previous is None:
            return None
        did: list[int | None] = [None] * len(self.problem.agents)
        saw = list(did)
        did[self.seat], saw[self.seat] = int(percept.action[row]), int(percept.observation[row])
        return belief.update_belief(self.problem, previous, did, saw).belief

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """What the program answers, row by row."""
        able = [None] * len(u) if legal is None else [*legal]
        with self._open_conversation() as talk:
            return np.array(talk.request_actions([*map(ActionRequest, memory[0], able, u)]))

    @property
    def _sends_beliefs(self) -> bool:
        """Whether it may be told beliefs, and there are any."""
        return self.belief and belief_size(self.problem) <= MAX_LISTED_STATES

    @contextmanager
    def _open_conversation(self) -> Iterator[BotConversation]:
        """The talk with the program; a forfeit ends it, and says whose it is."""
        try:
            yield self._state.conversation or self._start_conversation()
        except Forfeit as error:
            self.close()
            seat = self.problem.agents[self.seat]
            raise Forfeit(error.reason, error.details, seat) from None

    def _start_conversation(self) -> BotConversation:
        """The program, just begun."""
        problem = self.problem
        channel = self.open_channel(shlex.split(self.command))
        talk = self._state.conversation = BotConversation(channel, problem, self.seat, self.clock)
        parameters = {one.name: getattr(problem, one.name) for one in fields(problem)}
        told: JsonObject = {
            "problem": self.problem_name,
            "parameters": parameters,
            "turns": self.turn_limit,
        }
        talk.exchange_hello(told, ["history", MANY_GAMES_OFFER] + ["belief"] * self._sends_beliefs)
        return talk

    @property
    def is_running(self) -> bool:
        """Whether the program was begun, and is not ended."""
        return self._state.conversation is not None

    @property
    def log(self) -> str:
        """What it said on its standard error."""
        return self._state.log.decode(errors="replace")

    def close(self, end_facts: JsonObject | None = None, memory: Memory = ()) -> None:
        """Ends the program, which is told the last turn and the end where it plays on."""
        talk, self._state.conversation = self._state.conversation, None
        if talk:
            self._state.log = talk.close(end_facts, memory[0][0] if memory else None)


def _to_object_array(histories: Sequence[HistoryNode]) -> Array:
    """An array `[B]` of what each row has seen: tuples, which NumPy would take apart."""
    column = np.empty(len(histories), object)
    for row, one in enumerate(histories):
        column[row] = one
    return column
