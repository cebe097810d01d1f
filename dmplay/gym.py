"""Gymnasium environments of the problems: `gymnasium.make("dmplay/Hexworld-v0")`.

An environment is one seat of a problem; agents play the others. A learner gets the rewards, even
those that play withholds because they would reveal a hidden state. An illegal action changes
nothing in the game, and no turn passes, but the step counts: an episode is truncated after as many
steps as its turn limit, which is `turns`, else the problem's horizon, else 10,000. At a horizon
that is a rule of the problem (`is_finite_horizon`), it is terminated. With `illegal="penalty"` an
illegal step is paid `illegal_reward`, and with `illegal="end"` it also terminates the episode.
`info["action_mask"]` and `action_masks()` mark the legal actions, and `info["turns_left"]` is the
number of steps until the limit. `observe` names the parts of the observation. Several parts, such
as `observe="belief+turns"` or a list, are a dictionary:

- `observation`, the default: the state, where agents see it; in a game of one state the actions of
  the last round, each plus one, and zeros before the first; else the index of the observation, and
  one more than the last index before the first turn.
- `belief`: the probability of each hidden state, given all that the seat has observed, if the other
  agents act at random.
- `history`: a row for the start, and one for each turn up to the limit. Its columns are 1, the
  actions, and the observation after them. The actions are those of all agents if states are
  visible, else that of the seat. Rows of turns that are not played yet are 0.
- `state`: the state, also if it is hidden from the seat.
- `turns`: the number of steps until the limit.
"""

from collections.abc import Callable, Mapping, Sequence
from inspect import signature
from typing import Any, TypeVar, cast

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode
from gymnasium.vector.utils import batch_space

from dmplay.agents.belief_policy import SeatBeliefs
from dmplay.core.arrays import Array, Bools, Ints, Reals
from dmplay.core.parameters import INTEGER_TYPES
from dmplay.core.policy import Policy
from dmplay.core.problem import Problem, find_seat
from dmplay.core.session import Session, has_visible_beliefs
from dmplay.core.uniforms import SeededUniforms, new_seed
from dmplay.draw.options import DrawOptions
from dmplay.errors import BadParameter, EpisodeOver, IllegalAction, UnknownName
from dmplay.external.optional_libraries import import_library
from dmplay.registry import problems
from dmplay.registry.agents import AgentLike, assign_agents, load_players, load_roster
from dmplay.registry.builtin_names import problem_names
from dmplay.registry.problems import ProblemLike
from dmplay.simulation.seat_spaces import (
    IllegalActionRule,
    Info,
    SeatObserver,
    SeatSpaces,
    TurnLimit,
    convert_to_action_array,
    select_row,
)
from dmplay.simulation.uniform_sources import (
    EpisodeSequence,
    FastUniforms,
    ReplayableUniforms,
    UniformSource,
)
from dmplay.simulation.vector_games import VectorGames
from dmplay.views.protocol import fit_board, load_view_module

RENDER_MODES = "ansi", "rgb_array"
RENDER_COLUMNS, RENDER_ROWS = 80, 24  # size of a rendered board
ROW_INCHES, DOTS_PER_INCH, LINE_SPACING = 0.2, 100, 1.2  # of a picture of the board
Games = TypeVar("Games")
MAX_ENVIRONMENTS = 10_000_000  # games of a VectorEnv


class Env(gymnasium.Env[Any, Any]):
    """One game at a time: `reset(seed=s)` starts episode 0 of a seed, `reset()` the next one.

    Its episodes are those of a session, and the rows of a rollout, of the same seed.
    """

    metadata = {"render_modes": ["ansi", "rgb_array"], "render_fps": 2}  # noqa: RUF012 - as Gymnasium has it

    def __init__(  # noqa: PLR0913 - each is the caller's to choose
        self,
        problem: ProblemLike,
        *,
        seat: str | int = 0,
        others: AgentLike | Sequence[AgentLike | None] = "",
        turns: int | None = None,
        render_mode: str | None = None,
        illegal: str = "noop",
        illegal_reward: float = -1.0,
        observe: str | Sequence[str] = "observation",
        **parameters: Any,
    ) -> None:
        self.problem = load_environment_problem(type(self), problem, parameters)
        seat_index = find_seat(self.problem, seat or 0)
        self._turn_limit = TurnLimit.from_option(self.problem, turns)
        self.seat = make_seat_spaces(self.problem, seat_index, self._turn_limit, observe)
        self.action_space = self.seat.action_space
        self.observation_space = self.seat.observation_space
        self.render_mode = check_render_mode(render_mode)
        self._illegal_rule = IllegalActionRule.from_option(illegal, illegal_reward)
        self._step_count, self._over = 0, False
        self._policies = load_other_policies(self.problem, seat_index, others, turns)
        self._uniforms: SeededUniforms | None = None
        self.session: Session | None = None

    def reset(self, *, seed: int | None = None, options: Info | None = None) -> tuple[Any, Info]:
        """Start an episode; `options={"episode": n}` selects the episode of the seed."""
        self._uniforms = choose_episode_uniforms(
            self._uniforms, seed, check_reset_options(options, "episode")
        )
        super().reset(seed=None if seed is None else self._uniforms.seed)
        self.session = Session(
            self.problem, self._uniforms, self._policies, turn_limit=self._turn_limit.steps
        )
        self._observer = SeatObserver(self.seat, self.session)
        self._step_count, self._over = 0, False
        return self._observe(), self._current_info(self.session)

    def step(self, action: Any) -> tuple[Any, float, bool, bool, Info]:
        """Play a turn and return the observation, reward, terminated, truncated and info."""
        game, seat = check_started(self.session, "step"), self.seat.seat
        chosen_action, legal = (self.seat.decode_action(action), game.legal_actions_mask(seat))
        if self._over and not game.over:
            raise EpisodeOver("step: the episode is over; call reset")
        self._step_count += 1
        reward, is_legal = self._illegal_rule.reward, legal is None or legal[int(chosen_action)]
        if is_legal:
            turn = game.advance(
                [chosen_action if i == seat else None for i in range(len(self._policies))]
            )
            reward = float(turn.rewards[seat])
        terminated = self._turn_limit.is_terminated(game) or (
            self._illegal_rule.ends_episode and not is_legal
        )
        truncated = not terminated and self._step_count == self._turn_limit.steps
        self._over = terminated or truncated
        return self._observe(), reward, terminated, truncated, self._current_info(game)

    def action_masks(self) -> Bools:
        """Return the mask `[A]` of the legal actions, as sb3-contrib's MaskablePPO asks for it."""
        return self.seat.action_masks(
            self._current_info(check_started(self.session, "action_masks"))
        )

    def _observe(self) -> Any:
        """Return the current observation of the seat."""
        return self._observer.observe(self._turn_limit.steps - self._step_count)

    def _current_info(self, game: Session) -> Info:
        """Return the current info of the seat."""
        turns_left = self._turn_limit.steps - self._step_count
        return self.seat.make_info(game.legal_actions_mask(self.seat.seat), turns_left)

    def render(self) -> str | Array | None:
        """Return the board as the seat sees it, as text or pixels; None without a render mode."""
        session = check_started(self.session, "render")
        return render_board(session, self.seat.seat, self.render_mode)


class VectorEnv(gymnasium.vector.VectorEnv[Any, Any, Any]):
    """Many games at once; a finished row starts its next game with the next step.

    With `uniforms="recorded"` game k of row r is episode r + k * num_envs of the seed, or episode k
    of seed r of a list. With `uniforms="fast"` no seed plays the same game again, and a step takes
    a fraction of the time.
    """

    metadata = {"autoreset_mode": AutoresetMode.NEXT_STEP}  # noqa: RUF012 - as Gymnasium has it

    def __init__(  # noqa: PLR0913 - each is the caller's to choose
        self,
        problem: ProblemLike,
        num_envs: int = 1,
        *,
        seat: str | int = 0,
        others: AgentLike | Sequence[AgentLike | None] = "",
        turns: int | None = None,
        uniforms: str = "recorded",
        illegal: str = "noop",
        illegal_reward: float = -1.0,
        observe: str | Sequence[str] = "observation",
        **parameters: Any,
    ) -> None:
        if not isinstance(uniforms, str) or uniforms not in ("recorded", "fast"):
            raise BadParameter(f"uniforms: got {uniforms!r}, expected recorded or fast")
        if not isinstance(num_envs, INTEGER_TYPES) or not 1 <= num_envs <= MAX_ENVIRONMENTS:
            raise BadParameter(
                f"num_envs: got {num_envs!r}, expected a whole number from 1 to {MAX_ENVIRONMENTS}"
            )
        self.problem = load_environment_problem(type(self), problem, parameters)
        seat_index = find_seat(self.problem, seat or 0)
        self.num_envs = int(num_envs)
        self._turn_limit = TurnLimit.from_option(self.problem, turns)
        self._seat = make_seat_spaces(self.problem, seat_index, self._turn_limit, observe)
        self.single_action_space = self._seat.action_space
        self.single_observation_space = self._seat.observation_space
        self.action_space = batch_space(self._seat.action_space, self.num_envs)
        self.observation_space = batch_space(self._seat.observation_space, self.num_envs)
        self._illegal_rule = IllegalActionRule.from_option(illegal, illegal_reward)
        self._policies = load_other_policies(self.problem, seat_index, others, turns)
        self._fast = uniforms == "fast"
        self._rows: VectorGames | None = None

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: Info | None = None
    ) -> tuple[Any, Info]:
        """Start a game in each row; without a seed, the next games of the last seed.

        A list has a seed for each row, or None to continue with its last seed. With
        `options={"reset_mask": mask}`, games start only in the rows that the mask `[B]` marks.
        """
        rows = self._read_reset_rows(options)
        row_seeds = self._read_row_seeds(seed)
        common_seed = None if seed is None or row_seeds else SeededUniforms(cast("int", seed)).seed
        if self._fast and (row_seeds or (common_seed is not None and rows is not None)):
            raise BadParameter(
                f"seed: got {seed!r}, expected one seed for all rows, because fast uniforms come "
                "from one generator"
            )
        selected = range(self.num_envs) if rows is None else {*rows.tolist()}
        sequences = {
            row: EpisodeSequence(row_seed, 0, 1)
            for row, row_seed in enumerate(row_seeds)
            if row in selected and row_seed is not None
        }
        if self._rows is None or (common_seed is not None and rows is None):
            first_seed = new_seed() if common_seed is None else common_seed
            source: UniformSource = FastUniforms(first_seed)
            if not self._fast:
                source = ReplayableUniforms(first_seed, self.num_envs)
            source.seed_rows(sequences)
            self._rows = VectorGames(
                self._seat,
                self._policies,
                source,
                self.num_envs,
                self._turn_limit,
                self._illegal_rule,
            )
            return self._rows.observe()
        if common_seed is not None:
            sequences = {row: EpisodeSequence(common_seed, row, self.num_envs) for row in selected}
        self._rows.uniform_source.seed_rows(sequences)
        if rows is None:
            self._rows.reset()
        else:
            self._rows.restart(rows)
        return self._rows.observe()

    def _read_reset_rows(self, options: object) -> Ints | None:
        """Return the rows that the option `reset_mask` marks; None for all rows."""
        values = check_reset_options(options, "reset_mask")
        if not values:
            return None
        mask = values["reset_mask"]
        is_mask = isinstance(mask, np.ndarray) and mask.dtype == np.bool_
        if not is_mask or mask.shape != (self.num_envs,) or not mask.any():
            raise BadParameter(
                f"reset_mask: got {mask!r}, expected a NumPy array of {self.num_envs} booleans, "
                "at least one of them True"
            )
        check_started(self._rows, "reset_mask")
        return np.flatnonzero(mask)

    def _read_row_seeds(self, seed: object) -> list[int | None]:
        """Return the seed of each row in a list of seeds; empty if `seed` is no list."""
        if not isinstance(seed, list | tuple) and not (
            isinstance(seed, np.ndarray) and seed.ndim == 1
        ):
            return []
        if len(seed) != self.num_envs:
            raise BadParameter(f"seed: got {len(seed)} seeds, expected {self.num_envs}")
        return [None if value is None else SeededUniforms(value).seed for value in seed]

    def step(self, actions: Array) -> tuple[Any, Reals, Bools, Bools, Info]:
        """Play a turn in each row; a finished row starts its next game and ignores its action."""
        rows = check_started(self._rows, "step")
        action_array = convert_to_action_array(actions)
        if action_array.shape[:1] != (self.num_envs,):
            raise IllegalAction(
                f"step: got shape {action_array.shape}, expected {self.num_envs} actions"
            )
        if len(rows.done_rows):
            action_array = action_array.copy()
            # Ignored actions may be anything, as in Gymnasium.
            action_array[rows.done_rows] = 0
        rewards, terminated, truncated = rows.step(self._seat.decode_actions(action_array))
        observations, info = rows.observe()
        return observations, rewards, terminated, truncated, info

    def action_masks(self) -> Bools:
        """Return the mask `[B, A]` of the legal actions in each row."""
        _, info = check_started(self._rows, "action_masks").observe()
        return self._seat.action_masks(info)

    def render(self) -> None:
        """Return None, because many games have no single board."""
        check_started(self._rows, "render")


def sb3_vec_env(problem: ProblemLike, num_envs: int = 1, **options: Any) -> Any:
    """Return a VecEnv of Stable-Baselines3 with the games of a `VectorEnv` of these options.

    A finished game restarts in the same step, and its info has the terminal observation. It is
    wrapped in VecMonitor, so that Stable-Baselines3 reports returns and lengths of games.
    """
    try:
        from stable_baselines3.common.vec_env import VecEnv, VecMonitor
    except ModuleNotFoundError:
        remedy = "pip install stable-baselines3"
        raise BadParameter(f"sb3_vec_env: needs Stable-Baselines3: {remedy}") from None

    class GamesVecEnv(VecEnv):  # type: ignore[misc] # Stable-Baselines3 may not be installed
        """A VectorEnv with the methods of Stable-Baselines3."""

        def __init__(self, games: VectorEnv) -> None:
            self.games = games
            self.first_seed: int | None = None
            spaces = games.single_observation_space, games.single_action_space
            super().__init__(games.num_envs, *spaces)

        def seed(self, seed: int | None = None) -> list[int | None]:
            """Set the seed of all games from the next reset on."""
            self.first_seed = seed
            return [seed] * self.num_envs

        def reset(self) -> Any:
            """Start a game in each row."""
            seed, self.first_seed = self.first_seed, None
            return self.games.reset(seed=seed)[0]

        def step_async(self, actions: Array) -> None:
            """Keep the actions for `step_wait`."""
            self.actions = actions

        def step_wait(self) -> tuple[Any, Reals, Bools, list[Info]]:
            """Play a turn, and restart the games that it ends."""
            observations, rewards, terminated, truncated, _ = self.games.step(self.actions)
            done, infos = terminated | truncated, [Info() for _ in range(self.num_envs)]
            for row in np.flatnonzero(done).tolist():
                infos[row]["terminal_observation"] = select_row(observations, row)
                infos[row]["TimeLimit.truncated"] = bool(truncated[row])
            if done.any():
                observations, _ = self.games.reset(options={"reset_mask": done})
            return observations, rewards.astype(np.float32), done, infos

        def close(self) -> None:
            """Close the games."""
            self.games.close()

        def env_method(self, method_name: str, *args: Any, indices: Any = None) -> list[Any]:
            """Return the rows of the result of a method of the games, such as `action_masks`."""
            values = getattr(self.games, method_name)(*args)
            return [values[row] for row in _list_rows(self.num_envs, indices)]

        def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
            """Return an attribute of the games once for each row."""
            return [getattr(self.games, attr_name) for _ in _list_rows(self.num_envs, indices)]

        def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
            """Set an attribute of the games, whatever the rows."""
            setattr(self.games, attr_name, value)

        def env_is_wrapped(self, wrapper_class: type, indices: Any = None) -> list[bool]:
            """Return False for each row: games have no wrappers."""
            return [False for _ in _list_rows(self.num_envs, indices)]

    return VecMonitor(GamesVecEnv(VectorEnv(problem, num_envs, **options)))


def _list_rows(count: int, indices: Any) -> list[int]:
    """Return the rows that Stable-Baselines3 means: all, one or several."""
    rows: list[int] = np.atleast_1d(range(count) if indices is None else indices).tolist()
    return rows


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


def make_seat_spaces(
    problem: Problem, seat: int, limit: TurnLimit, observe: str | Sequence[str]
) -> SeatSpaces:
    """Return the spaces of a seat that observes these parts; see `read_observed_names`."""
    beliefs = SeatBeliefs(problem, seat) if has_visible_beliefs(problem) else None
    return SeatSpaces(problem, seat, limit, observe, beliefs)


def load_environment_problem(
    environment: Callable[..., object], problem: ProblemLike, parameters: Mapping[str, Any]
) -> Problem:
    """Return a problem with parameters; the error for an unknown one knows the options too."""
    try:
        return problems.load_problem(problem, **parameters)
    except UnknownName:
        names = [*problems.parameter_values(problems.load_problem(problem))]
        items = signature(environment).parameters.values()
        names += [item.name for item in items if item.kind is item.KEYWORD_ONLY]
        for name in parameters:
            problems.find_parameter_name(name, names)
        raise


def check_render_mode(render_mode: str | None) -> str | None:
    """Return a render mode; raise BadParameter for an unknown one, or if it needs matplotlib."""
    is_known = isinstance(render_mode, str) and render_mode in RENDER_MODES
    if render_mode is not None and not is_known:
        expected = ", ".join(map(repr, RENDER_MODES))
        raise BadParameter(f"render_mode: got {render_mode!r}, expected {expected} or None")
    if render_mode == "rgb_array":
        import_library("matplotlib", "plot", "rgb_array")
    return render_mode


def check_reset_options(options: object, option: str, *, ignore_unknown: bool = False) -> Info:
    """Return the options of a reset, at most this one; raise an error for any other."""
    if options is None:
        return {}
    if not isinstance(options, Mapping):
        raise BadParameter(f"options: got {options!r}, expected a dict with {option!r}")
    for key in options:
        if key != option and not ignore_unknown:
            raise UnknownName("option of reset", str(key), [option])
    return {option: options[option]} if option in options else {}


def choose_episode_uniforms(
    last: SeededUniforms | None, seed: int | None, values: Info
) -> SeededUniforms:
    """Return the uniforms of the next episode: that of `values`, or the one after the last.

    Without a seed and a last episode, the seed is new.
    """
    if seed is None and last is not None:
        return SeededUniforms(last.seed, values.get("episode", last.episode + 1))
    return SeededUniforms(new_seed() if seed is None else seed, values.get("episode", 0))


def check_started(games: Games | None, method: str) -> Games:
    """Return the games of an environment; raise BadParameter before the first reset."""
    if games is None:
        raise BadParameter(f"{method}: no game has started; call reset first")
    return games


def load_other_policies(
    problem: Problem, seat: int, others: AgentLike | Sequence[AgentLike | None], turns: int | None
) -> list[Policy | None]:
    """Return the policy of each other seat, and None for the learner's seat.

    `others` is one agent for all other seats, or has an agent for each seat, of which that of the
    learner is not used; "" is the default partner of each seat.
    """
    if others == "":
        seats = range(len(problem.agents))
        others = [load_roster(problem, index).default_partner for index in seats]
    players = assign_agents(problem, others)
    players[seat] = None
    return load_players(problem, players, turns=turns)


def render_board(session: Session, seat: int, render_mode: str | None) -> str | Array | None:
    """Return the board as a seat sees it: plain text, pixels `[H, W, 3]`, or None without a mode.

    Pictures have one size, so that they make a film.
    """
    if render_mode is None:
        return None
    look = DrawOptions(width=RENDER_COLUMNS, height=RENDER_ROWS)
    text = fit_board(load_view_module(session.problem), session.view(seat), look).plain
    if render_mode == "ansi":
        return text
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    # The width of a character of this font is half of the height of a row.
    size = RENDER_COLUMNS * ROW_INCHES / 2, RENDER_ROWS * ROW_INCHES
    figure = Figure(size, dpi=DOTS_PER_INCH)
    canvas: Any = FigureCanvasAgg(figure)
    font = {"family": "monospace", "size": 72 * ROW_INCHES / LINE_SPACING}
    figure.text(0, 1, text, font, va="top", linespacing=LINE_SPACING, parse_math=False)
    canvas.draw()
    return np.array(canvas.buffer_rgba())[:, :, :3]
