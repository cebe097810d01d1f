"""A program in a seat: `bot:COMMAND`, a policy that asks another process."""

import shlex
import shutil
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, fields

import numpy as np

from dmplay import belief
from dmplay.bots.program import Program
from dmplay.bots.protocol import GAMES, Facts, learnt, sight
from dmplay.bots.talk import Asked, Channel, Seen, Talk
from dmplay.chance import Array, Bools, Reals
from dmplay.core import Memory, Percept, parameter
from dmplay.errors import BadParameter, Forfeit
from dmplay.policies.kinds import Seated
from dmplay.session import LONGEST_LIST, believed


@dataclass
class Live:
    """A program that runs, or what it left."""

    talk: Talk | None = None
    log: bytes = b""

    def __reduce__(self) -> tuple[type["Live"], tuple[()]]:
        """A copy in another process begins its own program."""
        return Live, ()


@dataclass(frozen=True)
class Bot(Seated):
    """A program that plays a seat, in a process of its own that begins with its first choice."""

    command: str
    name: str = ""  # of the problem, as the program is told
    turns: int | None = None  # after which the game ends, where that is not the problem's horizon
    start: Callable[[Sequence[str]], Channel] = Program
    clock: float = parameter(10.0, "seconds for an answer", 0.0, 86_400.0, above=True)
    belief: bool = parameter(False, "whether it may be told what its seat is to believe")
    _live: Live = field(default_factory=Live, init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        """Refuses what is no program."""
        super().__post_init__()
        try:
            words = shlex.split(self.command)
        except ValueError as error:  # a quotation without end
            raise BadParameter(f"bot:{self.command}: {str(error).lower()}") from None
        if not words:
            raise BadParameter("bot: expected a command, as bot:./player or 'bot:python3 player'")
        if self.start is Program and shutil.which(words[0]) is None:
            raise BadParameter(f"bot: no program {words[0]!r}; give its path, as bot:./player")

    @property
    def timed(self) -> bool:
        """It may do otherwise next time."""
        return True

    @property
    def draws(self) -> int:
        """How many uniforms it wants for a choice, as it said."""
        with self._talking() as talk:
            return talk.draws

    def begin(self, observation: Array) -> Memory:
        """What each row sees first."""
        prior = belief.prior(self.problem) if self._believes else None
        seen = [sight(self.problem, self.seat, one) for one in observation]
        each = enumerate(seen)
        return (_column([Seen(None, 0, {"observation": one}, prior, n) for n, one in each]),)

    def update(self, memory: Memory, percept: Percept) -> Memory:
        """One more turn."""
        return (_column([self._after(row, one, percept) for row, one in enumerate(memory[0])]),)

    def _after(self, row: int, before: Seen, percept: Percept) -> Seen:
        facts = learnt(self.problem, self.seat, percept, row)
        believed = self._believed(row, before.belief, percept)
        return Seen(before, before.turn + 1, facts, believed, before.game)

    def _believed(self, row: int, before: Reals | None, percept: Percept) -> Reals | None:
        """What the seat is to believe after a turn, by what it alone knows."""
        if before is None:
            return None
        did: list[int | None] = [None] * len(self.problem.agents)
        saw = list(did)
        did[self.seat], saw[self.seat] = int(percept.action[row]), int(percept.observation[row])
        return belief.update(self.problem, before, did, saw).belief

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """What the program answers, row by row."""
        able = [None] * len(u) if legal is None else [*legal]
        with self._talking() as talk:
            return np.array(talk.asked([*map(Asked, memory[0], able, u)]))

    @property
    def _believes(self) -> bool:
        """Whether it may be told beliefs, and there are any."""
        return self.belief and believed(self.problem) <= LONGEST_LIST

    @contextmanager
    def _talking(self) -> Iterator[Talk]:
        """The talk with the program; a forfeit ends it, and says whose it is."""
        try:
            yield self._live.talk or self._met()
        except Forfeit as error:
            self.close()
            seat = self.problem.agents[self.seat]
            raise Forfeit(error.reason, error.told, seat) from None

    def _met(self) -> Talk:
        """The program, just begun."""
        problem = self.problem
        channel = self.start(shlex.split(self.command))
        talk = self._live.talk = Talk(channel, problem, self.seat, self.clock)
        parameters = {one.name: getattr(problem, one.name) for one in fields(problem)}
        told: Facts = {"problem": self.name, "parameters": parameters, "turns": self.turns}
        talk.meet(told, ["history", GAMES] + ["belief"] * self._believes)
        return talk

    @property
    def running(self) -> bool:
        """Whether the program was begun, and is not ended."""
        return self._live.talk is not None

    @property
    def log(self) -> str:
        """What it said on its standard error."""
        return self._live.log.decode(errors="replace")

    def close(self, end: Facts | None = None, memory: Memory = ()) -> None:
        """Ends the program, which is told the last turn and the end where it plays on."""
        talk, self._live.talk = self._live.talk, None
        if talk:
            self._live.log = talk.over(end, memory[0][0] if memory else None)


def _column(seen: Sequence[Seen]) -> Array:
    """An array `[B]` of what each row has seen: tuples, which NumPy would take apart."""
    column = np.empty(len(seen), object)
    for row, one in enumerate(seen):
        column[row] = one
    return column
