"""Gymnasium environments of the problems: `gymnasium.make("dmplay.gym:dmplay/Hexworld-v0")`.

An environment is one seat of a problem; agents play the others. A learner gets the rewards, even
those that play withholds because they would reveal a hidden state. An illegal action changes
nothing in the game, and no turn passes, but the step counts: an episode is truncated after as many
steps as its turn limit, which is `turns`, else the problem's horizon, else 10,000. With
`illegal="penalty"` an illegal step is paid `illegal_reward`, and with `illegal="end"` it also
terminates the episode. `info["action_mask"]` and `action_masks()` mark the legal actions. The
observation is

- the state, where agents see it; in a game of one state the actions of the last round, each plus
  one, and zeros before the first;
- else the index of the observation, and one more than the last index before the first turn.
"""

from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode
from gymnasium.vector.utils import batch_space

from dmplay.core.arrays import Array, Bools, Reals
from dmplay.core.policy import Policy
from dmplay.core.problem import Problem, check_problem, find_seat
from dmplay.core.session import DEFAULT_TURN_LIMIT, Session
from dmplay.core.uniforms import SeededUniforms, new_seed
from dmplay.errors import BadParameter, EpisodeOver, IllegalAction
from dmplay.registry import agents, problems
from dmplay.registry.builtin_names import problem_names
from dmplay.simulation.seat_spaces import (
    IllegalActionRule,
    Info,
    SeatSpaces,
)
from dmplay.simulation.uniform_sources import FastUniforms, ReplayableUniforms
from dmplay.simulation.vector_games import VectorGames
from dmplay.views.protocol import DrawOptions, fit_board, load_view_module

RENDER_COLUMNS, RENDER_ROWS = 80, 24  # size of a rendered board
NOT_RESET_MESSAGE = "step: no game has started; call reset first"


class Env(gymnasium.Env[Any, Any]):
    """One game at a time: `reset(seed=s)` starts episode 0 of a seed, `reset()` the next one.

    Its episodes are those of a session, and the rows of a rollout, of the same seed.
    """

    metadata = {"render_modes": ["ansi"], "render_fps": 2}  # noqa: RUF012 - as Gymnasium has it

    def __init__(  # noqa: PLR0913 - each is the caller's to choose
        self,
        problem: str | Problem,
        *,
        seat: str = "",
        others: str = "",
        turns: int | None = None,
        render_mode: str | None = None,
        illegal: str = "noop",
        illegal_reward: float = -1.0,
        **parameters: Any,
    ) -> None:
        self.problem = resolve_problem(problem, parameters)
        seat_index = find_seat(self.problem, seat) if seat else 0
        self.seat = SeatSpaces(self.problem, seat_index)
        self.action_space, self.observation_space = (
            self.seat.action_space,
            self.seat.observation_space,
        )
        self.render_mode = render_mode
        self._turn_limit = resolve_turn_limit(self.problem, turns)
        self._illegal_rule = IllegalActionRule.from_option(illegal, illegal_reward)
        self._step_count, self._over = 0, False
        self._policies = load_other_policies(self.problem, seat_index, others)
        self._seed, self._episode = -1, 0
        self.session: Session | None = None

    def reset(self, *, seed: int | None = None, options: Info | None = None) -> tuple[Any, Info]:
        """Start an episode; `options={"episode": n}` selects the episode of the seed."""
        super().reset(seed=seed)
        if seed is not None or self._seed < 0:
            self._seed, self._episode = new_seed() if seed is None else seed, -1
        self._episode = (options or {}).get("episode", self._episode + 1)
        uniform_source = SeededUniforms(self._seed, self._episode)
        self.session = Session(
            self.problem, uniform_source, self._policies, turn_limit=self._turn_limit
        )
        self._step_count, self._over = 0, False
        return self._current_observation(self.session), self._current_info(self.session)

    def step(self, action: Any) -> tuple[Any, float, bool, bool, Info]:
        """Play a turn and return the observation, reward, terminated, truncated and info."""
        game, seat = self._current_session(), self.seat.seat
        chosen_action, legal = (
            self.seat.decode_actions(np.asarray(action)[None])[0],
            game.legal_actions_mask(seat),
        )
        if self._over and not game.over:
            raise EpisodeOver("step: the episode is over; call reset")
        self._step_count += 1
        reward, is_legal = self._illegal_rule.reward, legal is None or legal[int(chosen_action)]
        if is_legal:
            turn = game.advance(
                [chosen_action if i == seat else None for i in range(len(self._policies))]
            )
            reward = float(turn.rewards[seat])
        terminated = game.end_reason == "terminal" or (
            self._illegal_rule.ends_episode and not is_legal
        )
        truncated = not terminated and self._step_count == self._turn_limit
        self._over = terminated or truncated
        return (
            self._current_observation(game),
            reward,
            terminated,
            truncated,
            self._current_info(game),
        )

    def action_masks(self) -> Bools:
        """Return the mask `[A]` of the legal actions, as sb3-contrib's MaskablePPO asks for it."""
        return self.seat.action_masks(self._current_info(self._current_session()))

    def _current_info(self, game: Session) -> Info:
        """Return the current info of the seat, with the mask of its legal actions."""
        return self.seat.make_info(game.legal_actions_mask(self.seat.seat))

    def _current_session(self) -> Session:
        """Return the current session; raise BadParameter before the first reset."""
        if self.session is None:
            raise BadParameter(NOT_RESET_MESSAGE)
        return self.session

    def _current_observation(self, game: Session) -> Any:
        """Return the current observation of the seat, in the observation space."""
        turn = len(game.turns)
        joint = game.turns[-1].actions[None] if turn else None
        return self.seat.encode_observations(
            game.observation_after(self.seat.seat, turn)[None], joint
        )[0]

    def render(self) -> str | None:
        """Return the board as the seat sees it, with `render_mode="ansi"`; else None."""
        return (
            render_board(self._current_session(), self.seat.seat)
            if self.render_mode == "ansi"
            else None
        )


class VectorEnv(gymnasium.vector.VectorEnv[Any, Any, Any]):
    """Many games at once; a finished row starts its next game with the next step.

    With `uniforms="recorded"` game k of row r is episode r + k * num_envs of the seed; with
    `uniforms="fast"` no seed plays the same game again, and a step takes a fraction of the time.
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
        uniforms: str = "recorded",
        illegal: str = "noop",
        illegal_reward: float = -1.0,
        **parameters: Any,
    ) -> None:
        if uniforms not in ("recorded", "fast"):
            raise BadParameter(f"uniforms: got {uniforms!r}, expected recorded or fast")
        self.problem = resolve_problem(problem, parameters)
        seat_index = find_seat(self.problem, seat) if seat else 0
        self.num_envs = num_envs
        self._seat = SeatSpaces(self.problem, seat_index)
        self.single_action_space = self._seat.action_space
        self.single_observation_space = self._seat.observation_space
        self.action_space = batch_space(self._seat.action_space, num_envs)
        self.observation_space = batch_space(self._seat.observation_space, num_envs)
        self._turn_limit = resolve_turn_limit(self.problem, turns)
        self._illegal_rule = IllegalActionRule.from_option(illegal, illegal_reward)
        self._policies = load_other_policies(self.problem, seat_index, others)
        self._fast = uniforms == "fast"
        self._rows: VectorGames | None = None
        self._info = {**self._seat.make_info(None)}
        if self._info:
            self._info = {"action_mask": np.tile(self._info["action_mask"], (num_envs, 1))}

    def reset(self, *, seed: int | None = None, options: Info | None = None) -> tuple[Array, Info]:
        """Start a game in each row; without a seed, the next games of the last seed."""
        if self._rows is None or seed is not None:
            seed = new_seed() if seed is None else seed
            uniform_source = (
                FastUniforms(seed) if self._fast else ReplayableUniforms(seed, self.num_envs)
            )
            self._rows = VectorGames(
                self._seat,
                self._policies,
                uniform_source,
                self.num_envs,
                self._turn_limit,
                self._illegal_rule,
            )
        else:
            self._rows.reset()
        return self._rows.observations.copy(), self._reset_info(self._rows)

    def step(self, actions: Array) -> tuple[Array, Reals, Bools, Bools, Info]:
        """Play a turn in each row; a finished row starts its next game and ignores its action."""
        rows = self._current_rows()
        action_array = np.asarray(actions)
        if action_array.shape[:1] != (self.num_envs,):
            raise IllegalAction(
                f"step: got shape {action_array.shape}, expected {self.num_envs} actions"
            )
        if rows.done_mask.any():
            action_array = action_array.copy()
            # Ignored actions may be anything, as in Gymnasium.
            action_array[rows.done_mask] = 0
        rewards, terminated, truncated = rows.step(self._seat.decode_actions(action_array))
        observations = rows.observations.copy()
        return observations, rewards, terminated, truncated.copy(), self._reset_info(rows)

    def action_masks(self) -> Bools:
        """Return the mask `[B, A]` of the legal actions in each row."""
        return self._seat.action_masks(self._reset_info(self._current_rows()))

    def _current_rows(self) -> VectorGames:
        """Return the games of all rows; raise BadParameter before the first reset."""
        if self._rows is None:
            raise BadParameter(NOT_RESET_MESSAGE)
        return self._rows

    def _reset_info(self, rows: VectorGames) -> Info:
        """Return the info with the mask `[B, A]` of the legal actions."""
        if rows.legal_actions_mask is None:
            return dict(self._info)
        return {"action_mask": rows.legal_actions_mask[:, self._seat.seat].astype(np.int8)}


def _register_environments() -> None:
    """Register each problem and variant with Gymnasium, for example as `dmplay/CryingBaby-v0`."""
    for name in problem_names():
        for variant in problems.load_variants(name):
            spec = f"{name}:{variant}" if variant else name
            words = spec.replace(":", "-").split("-")
            gymnasium.register(
                f"dmplay/{''.join(word[:1].upper() + word[1:] for word in words)}-v0",
                entry_point="dmplay.gym:Env",
                vector_entry_point="dmplay.gym:VectorEnv",
                kwargs={"problem": spec},
            )


_register_environments()


def resolve_problem(problem: str | Problem, parameters: Info) -> Problem:
    """Return the problem of this name, or the given problem, with these parameters."""
    if isinstance(problem, str):
        return problems.load_problem(problem, **parameters)
    return problems.with_parameters(problem, parameters)


def resolve_turn_limit(problem: Problem, turns: int | None) -> int:
    """Return the turn limit of an environment: `turns`, else the problem's horizon, else 10,000.

    The last is the limit of all games without people. Raise BadParameter for an invalid limit.
    """
    check_problem(problem, turns)
    return turns if turns is not None else problem.horizon or DEFAULT_TURN_LIMIT


def load_other_policies(problem: Problem, seat: int, others: str) -> list[Policy | None]:
    """Load the named policy for all other seats; "" loads the default partner of each seat.

    The learner's seat has None.
    """
    policy_names = [
        others or agents.load_roster(problem, i).default_partner for i in range(len(problem.agents))
    ]
    numbered_names = enumerate(policy_names)
    return [
        None if i == seat else agents.load_agent(problem, i, name) for i, name in numbered_names
    ]


def render_board(session: Session, seat: int) -> str:
    """Return the board as a seat sees it, in plain text."""
    look = DrawOptions(width=RENDER_COLUMNS, height=RENDER_ROWS)
    return fit_board(load_view_module(session.problem), session.view(seat), look).plain
