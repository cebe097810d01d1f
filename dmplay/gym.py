"""The problems as environments of Gymnasium: `gymnasium.make("dmplay.gym:dmplay/Hexworld-v0")`.

An environment is one seat of a problem; agents sit in the others. It gives a learner the rewards
that play withholds where they would betray a hidden state. A move that is not legal changes
nothing, and no turn passes; `info["action_mask"]` marks those that are. A game is truncated at its
turn limit. The observation is

- the state, where agents see it; in a game of one state the actions of the last round, each plus
  one, and zeros before the first;
- else the index of what was observed, and one more than the last index before the first turn.
"""

from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode
from gymnasium.vector.utils import batch_space

from dmplay.chance import Array, Bools, Reals
from dmplay.core import Problem
from dmplay.dice import Dice, fresh
from dmplay.errors import BadParameter, IllegalAction
from dmplay.finding import problems
from dmplay.finding.names import problem_names
from dmplay.loops.luck import Fast, Recorded
from dmplay.loops.rows import Rows
from dmplay.loops.seat import Info, Seat, drawn, found, seated
from dmplay.session import Session

NOT_BEGUN = "step: no game was begun; call reset first"


class Env(gymnasium.Env[Any, Any]):
    """One game at a time: `reset(seed=s)` begins episode 0 of a seed, `reset()` the next one.

    Its episodes are those of a session, and the rows of a rollout, of the same seed.
    """

    metadata = {"render_modes": ["ansi"], "render_fps": 2}  # noqa: RUF012 - as Gymnasium has it

    def __init__(
        self,
        problem: str | Problem,
        *,
        seat: str = "",
        others: str = "",
        turns: int | None = None,
        render_mode: str | None = None,
        **parameters: Any,
    ) -> None:
        self.problem = found(problem, parameters)
        place = self.problem.seat(seat) if seat else 0
        self.seat = Seat(self.problem, place)
        self.action_space, self.observation_space = self.seat.actions, self.seat.observations
        self.render_mode = render_mode
        self._turns = turns
        self._policies = seated(self.problem, place, others)
        self._seed, self._episode = -1, 0
        self.session: Session | None = None

    def reset(self, *, seed: int | None = None, options: Info | None = None) -> tuple[Any, Info]:
        """Begins an episode: `options={"episode": n}` says which of the seed."""
        super().reset(seed=seed)
        if seed is not None or self._seed < 0:
            self._seed, self._episode = fresh() if seed is None else seed, -1
        self._episode = (options or {}).get("episode", self._episode + 1)
        dice = Dice(self._seed, self._episode)
        self.session = Session(self.problem, dice, self._policies, limit=self._turns)
        return self._seen(self.session), self.seat.info(self.session.legal(self.seat.seat))

    def step(self, action: Any) -> tuple[Any, float, bool, bool, Info]:
        """Plays a turn."""
        game, seat = self._game(), self.seat.seat
        done, legal = self.seat.act(np.asarray(action)[None])[0], game.legal(seat)
        reward = 0.0
        if legal is None or legal[int(done)]:
            turn = game.advance([done if i == seat else None for i in range(len(self._policies))])
            reward = float(turn.rewards[seat])
        over = game.ending
        info = self.seat.info(game.legal(seat))
        return self._seen(game), reward, over == "terminal", over not in (None, "terminal"), info

    def _game(self) -> Session:
        if self.session is None:
            raise BadParameter(NOT_BEGUN)
        return self.session

    def _seen(self, game: Session) -> Any:
        turn = len(game.turns)
        joint = game.turns[-1].actions[None] if turn else None
        return self.seat.seen(game.observation(self.seat.seat, turn)[None], joint)[0]

    def render(self) -> str | None:
        """The board as the seat sees it, with `render_mode="ansi"`."""
        return drawn(self._game(), self.seat.seat) if self.render_mode == "ansi" else None


class VectorEnv(gymnasium.vector.VectorEnv[Any, Any, Any]):
    """Many games at once; a row that is over begins anew with the next step.

    With `dice="recorded"` game k of row r is episode r + k * num_envs of the seed; with
    `dice="fast"` no seed plays the same game again, and a step takes a fraction of the time.
    """

    metadata = {"autoreset_mode": AutoresetMode.NEXT_STEP}  # noqa: RUF012 - as Gymnasium has it

    def __init__(  # noqa: PLR0913 - each is the caller's to choose
        self,
        problem: str | Problem,
        num_envs: int = 1,
        *,
        seat: str = "",
        others: str = "",
        turns: int | None = None,
        dice: str = "recorded",
        **parameters: Any,
    ) -> None:
        if dice not in ("recorded", "fast"):
            raise BadParameter(f"dice: got {dice!r}, expected recorded or fast")
        self.problem = found(problem, parameters)
        place = self.problem.seat(seat) if seat else 0
        self.num_envs = num_envs
        self._seat = Seat(self.problem, place)
        self.single_action_space = self._seat.actions
        self.single_observation_space = self._seat.observations
        self.action_space = batch_space(self._seat.actions, num_envs)
        self.observation_space = batch_space(self._seat.observations, num_envs)
        self._limit = self.problem.horizon if turns is None else turns
        self._policies = seated(self.problem, place, others)
        self._fast = dice == "fast"
        self._rows: Rows | None = None
        self._info = {**self._seat.info(None)}
        if self._info:
            self._info = {"action_mask": np.tile(self._info["action_mask"], (num_envs, 1))}

    def reset(self, *, seed: int | None = None, options: Info | None = None) -> tuple[Array, Info]:
        """Begins all rows; without a seed, the next games of the last one."""
        if self._rows is None or seed is not None:
            seed = fresh() if seed is None else seed
            luck = Fast(seed) if self._fast else Recorded(seed, self.num_envs)
            self._rows = Rows(self._seat, self._policies, luck, self.num_envs, self._limit)
        else:
            self._rows.begin()
        return self._rows.seen.copy(), self._told(self._rows)

    def step(self, actions: Array) -> tuple[Array, Reals, Bools, Bools, Info]:
        """Plays a turn in every row; one that was over begins anew, whichever action it has."""
        if self._rows is None:
            raise BadParameter(NOT_BEGUN)
        told = np.asarray(actions)
        if told.shape[:1] != (self.num_envs,):
            raise IllegalAction(f"step: got shape {told.shape}, expected {self.num_envs} actions")
        if self._rows.ended.any():
            told = told.copy()
            told[self._rows.ended] = 0  # what is not looked at may be anything, as in Gymnasium
        rewards, terminated, truncated = self._rows.play(self._seat.act(told))
        seen = self._rows.seen.copy()
        return seen, rewards, terminated, truncated.copy(), self._told(self._rows)

    def _told(self, rows: Rows) -> Info:
        """Which actions `[B, A]` are legal."""
        if rows.legal is None:
            return dict(self._info)
        return {"action_mask": rows.legal[:, self._seat.seat].astype(np.int8)}


def _register() -> None:
    """Has Gymnasium know every problem and variant, as `dmplay/CryingBaby-v0`."""
    for name in problem_names():
        for variant in problems.variants(name):
            spec = f"{name}:{variant}" if variant else name
            words = spec.replace(":", "-").split("-")
            gymnasium.register(
                f"dmplay/{''.join(word[:1].upper() + word[1:] for word in words)}-v0",
                entry_point="dmplay.gym:Env",
                vector_entry_point="dmplay.gym:VectorEnv",
                kwargs={"problem": spec},
            )


_register()
