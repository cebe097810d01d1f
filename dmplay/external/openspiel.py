"""Games of OpenSpiel: `openspiel:kuhn_poker`, `openspiel:kuhn_poker(players=3)`."""

import hashlib
import os
import re
from collections import Counter, defaultdict
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache, cached_property
from graphlib import CycleError
from pathlib import Path
from typing import Any

import numpy as np

from dmplay.core import safe_files
from dmplay.core.best_actions import compute_reward_scale
from dmplay.core.playability_checks import RESERVED_WORDS
from dmplay.core.problem import WAIT_LABEL, Problem
from dmplay.core.spaces import Labels, TextLine
from dmplay.core.uniforms import expand_uniforms
from dmplay.errors import BadParameter, UnknownName
from dmplay.external.history_problem import (
    MAX_SEED,
    ExternalEnvironment,
    ExternalProblem,
    TimeStep,
    make_label_unique,
)
from dmplay.external.optional_libraries import LIBRARY_ERRORS, import_library, summarize_error
from dmplay.formats.gambit_efg import ExtensiveForm, read_efg, schedule_information_sets

PIP_EXTRA = "openspiel"
# types of games in which every player knows the state
PERFECT_INFORMATION_TYPES = ("PERFECT_INFORMATION", "ONE_SHOT")
# longest game in which players observe all they know; in longer ones, only the last turn
MAX_FULL_HISTORY_TURNS = 30
INITIAL_CHANCE_UNIFORMS = 16  # uniforms that are computed for a turn at first
# games that are played, and action names that are queried, to collect labels
LABEL_TRIAL_GAMES, MAX_LABEL_QUERIES = 6, 4000
MAX_TRIAL_TURNS = 1000  # turns of such a game
HASH_DIGITS = 16  # hexadecimal digits of the hash that identifies a file
EXTENSIVE_FORM_GAME = "efg_game("  # in the name of a game in extensive form, or of one made of it
NOTHING_OBSERVED = "nothing"
EFG_FILE_PATTERN = re.compile(r"efg_game\(filename=(.*?)(?:, sha256=\w+)?\)")
INNER_EFG_FILE_PATTERN = re.compile(r"efg_game\(filename=([^,()]*)")
MAX_NESTED_CALLS = 20  # games inside another game; OpenSpiel reads them by recursion
SEPARATOR_PATTERN = re.compile(r"[\s_,;:]+")
PLAYER_PREFIX_PATTERN = re.compile(r"^\[P\d+\]|^Pl\d+: ")


def load_problem(name: str) -> Problem:
    """Return the game of this name as a problem; raise BadParameter if it cannot be played."""
    problem = OpenSpielProblem(name=_add_file_hash(name))
    problem.check_playable()
    return problem


def _add_file_hash(name: str) -> str:
    """Return the name, with a hash of the content if it refers to a file.

    The file may contain another game later.
    """
    match = EFG_FILE_PATTERN.fullmatch(name.partition(":")[2])
    if not match:
        return name
    digest = hashlib.sha256(safe_files.read_bytes(Path(match[1]))).hexdigest()[:HASH_DIGITS]
    return f"{PIP_EXTRA}:efg_game(filename={match[1]}, sha256={digest})"


def _find_game_file(name: str) -> str:
    """Return the file that a game is read from, else the game's name."""
    match = EFG_FILE_PATTERN.fullmatch(name.partition(":")[2])
    return match[1] if match else name


def list_problem_names() -> list[str]:
    """Return the sorted names of all registered games."""
    return sorted(import_library("pyspiel", PIP_EXTRA, PIP_EXTRA).registered_names())


@cache
def _load_game(name: str) -> Any:
    """Return the game; raise UnknownName or BadParameter with a message of one line."""
    pyspiel = import_library("pyspiel", PIP_EXTRA, _find_game_file(name))
    text = name.partition(":")[2]
    base_name = text.partition("(")[0]
    if base_name not in pyspiel.registered_names():  # The library itself would print an error.
        raise UnknownName("game", base_name, pyspiel.registered_names(), error_prefix=PIP_EXTRA)
    if text.count("(") > MAX_NESTED_CALLS:
        raise BadParameter(
            f"{PIP_EXTRA}: {base_name}: got more than {MAX_NESTED_CALLS} nested games"
        )
    form = _read_extensive_form(name)
    for file in () if form else INNER_EFG_FILE_PATTERN.findall(text):
        _read_efg_file(file)  # OpenSpiel reads it again, and would crash if it were deep.
    try:
        with _silence_stderr():
            return pyspiel.load_efg_game(form.text) if form else pyspiel.load_game(text)
    except LIBRARY_ERRORS as error:
        raise BadParameter(f"{_find_game_file(name)}: {summarize_error(error)}") from None


@cache
def _read_extensive_form(name: str) -> ExtensiveForm | None:
    """Return the content of the file that a game is read from; None if there is no file."""
    match = EFG_FILE_PATTERN.fullmatch(name.partition(":")[2])
    return _read_efg_file(match[1]) if match else None


@cache
def _schedule_turns(name: str) -> dict[str, int]:
    """Return the number of turns before each information set, by its information state string.

    It is empty for a game that is not read from a file. Raises BadParameter if there are no such
    numbers.
    """
    form = _read_extensive_form(name)
    try:
        turns = schedule_information_sets(form.predecessors) if form else {}
    except CycleError as error:
        player = error.args[1][0][0] - 1
        reason = f"the number of turns would reveal hidden information to player-{player}"
        raise BadParameter(
            f"{_find_game_file(name)}: its information sets cannot be ordered in time: {reason}"
        ) from None
    return {
        f"{player - 1}-{player - 1}-{number}-": count for (player, number), count in turns.items()
    }


def _read_efg_file(name: str) -> ExtensiveForm:
    """Return the game in an `.efg` file; raise BadFile if it cannot be read."""
    return read_efg(name, safe_files.read_bytes(Path(name)))


@contextmanager
def _silence_stderr() -> Iterator[None]:
    """Run the block with stderr discarded, including what a C++ library prints there."""
    saved_fd, null_fd = os.dup(2), os.open(os.devnull, os.O_WRONLY)
    os.dup2(null_fd, 2)
    try:
        yield
    finally:
        os.dup2(saved_fd, 2)
        os.close(saved_fd)
        os.close(null_fd)


def _enum_name(value: object) -> str:
    """Return the name of a value of an OpenSpiel enumeration."""
    return str(value).rpartition(".")[2]


class ChanceSampler:
    """A sampler of the chance events in one turn, all determined by one uniform."""

    def __init__(self, uniform: float) -> None:
        self._uniform = uniform
        self._uniforms: Sequence[float] = ()
        self._n_used = 0

    def sample_outcome(self, outcomes: Sequence[tuple[int, float]]) -> int:
        """Return one of the outcomes, sampled by their probabilities."""
        if self._n_used == len(self._uniforms):
            uniform_count = max(INITIAL_CHANCE_UNIFORMS, 2 * self._n_used)
            self._uniforms = expand_uniforms(np.array([self._uniform]), uniform_count)[0].tolist()
        u, self._n_used = self._uniforms[self._n_used], self._n_used + 1
        edges = np.cumsum([p for _, p in outcomes])[:-1]
        return outcomes[int(edges.searchsorted(u, "right"))][0]


def _sample_chance_nodes(state: Any, sampler: ChanceSampler) -> None:
    """Apply sampled chance outcomes until a player is to act, or the game is over."""
    while state.is_chance_node():
        state.apply_action(sampler.sample_outcome(state.chance_outcomes()))


class OpenSpielEnvironment(ExternalEnvironment):
    """An OpenSpiel game that is being played."""

    def __init__(
        self, name: str, state: Any = None, returns: Sequence[float] = (), turn_count: int = 0
    ) -> None:
        self._name, self._state, self._returns = name, state, returns
        self._turn_count = turn_count

    def reset(self, uniform: float) -> TimeStep:
        """Start a new game, and resolve the chance events before the first action."""
        self._state = _load_game(self._name).new_initial_state()
        self._returns, self._turn_count = [0.0] * self._state.num_players(), 0
        _sample_chance_nodes(self._state, ChanceSampler(uniform))
        return self._make_time_step()

    def step(self, actions: tuple[float, ...], uniform: float) -> TimeStep:
        """Apply the actions of the players to act, then resolve chance events."""
        state, is_delayed = self._state, self._is_delayed()
        self._turn_count += 1
        if is_delayed:
            return self._make_time_step()
        if state.is_simultaneous_node():
            legal_by_player = map(state.legal_actions, range(state.num_players()))
            pairs = zip(actions, legal_by_player, strict=True)
            state.apply_actions(
                [int(action) if legal_actions else 0 for action, legal_actions in pairs]
            )
        else:
            state.apply_action(int(actions[state.current_player()]))
        _sample_chance_nodes(state, ChanceSampler(uniform))
        return self._make_time_step()

    def clone(self) -> "OpenSpielEnvironment":
        """Return an independent copy of the game in the same state."""
        return OpenSpielEnvironment(
            self._name, self._state.clone(), self._returns, self._turn_count
        )

    def _is_delayed(self) -> bool:
        """Return whether all players wait this turn.

        They do before an information set that has a node deeper in the tree: if that node were
        reached later than this one, the number of turns would tell its player which one it is.
        """
        state, turns = self._state, _schedule_turns(self._name)
        if not turns or state.is_terminal():
            return False
        information_state = state.information_state_string(state.current_player())
        return self._turn_count < turns.get(information_state, 0)

    def _is_to_act(self, player: int) -> bool:
        """Return whether a player is to act this turn."""
        state = self._state
        return not self._is_delayed() and bool(
            state.is_simultaneous_node() or state.current_player() == player
        )

    def _make_time_step(self) -> TimeStep:
        """Return the time step in the current state."""
        state, players = self._state, range(self._state.num_players())
        previous_returns, self._returns = self._returns, state.returns()
        rewards = tuple(
            current - previous
            for current, previous in zip(self._returns, previous_returns, strict=True)
        )
        over = state.is_terminal()
        state_text = str(state) or ("over" if over else "begun")
        observations = (
            () if _has_perfect_information(self._name) else tuple(map(self._observe, players))
        )
        legal_actions = tuple(self._legal_actions(player, over=over) for player in players)
        return TimeStep(
            rewards,
            over,
            legal_actions,
            observations,
            state_text.rstrip("\n"),
            self._current_action_names(legal_actions),
        )

    def _observe(self, player: int) -> str:
        """Return a player's observation as text, NOTHING_OBSERVED if it is empty.

        In a game in extensive form, OpenSpiel describes the information set of the player to act to
        every player. The others do not know it, so they observe nothing.
        """
        if EXTENSIVE_FORM_GAME in self._name and not self._is_to_act(player):
            return NOTHING_OBSERVED
        state = self._state
        observe = state.observation_string
        if _shows_information_state(self._name):
            observe = state.information_state_string
        return str(observe(player)).strip("\n") or NOTHING_OBSERVED

    def _current_action_names(
        self, legal_actions: Sequence[Sequence[int]]
    ) -> tuple[dict[int, str], ...]:
        """Return the names of the legal actions in this state; () if the labels name them all."""
        labels_by_player = _collect_labels_by_playing(self._name)
        wait_action = _load_game(self._name).num_distinct_actions()
        pairs = [*zip(labels_by_player, legal_actions, strict=True)]
        if not any(
            labels[action] == _default_action_name(action)
            for labels, actions in pairs
            for action in actions
        ):
            return ()
        return tuple(
            {
                action: _clean_action_name(self._state.action_to_string(player, action))
                or labels[action]
                for action in actions
                if action != wait_action
            }
            for player, (labels, actions) in enumerate(pairs)
        )

    def _legal_actions(self, player: int, *, over: bool) -> Sequence[int]:
        """Return a player's legal actions: to wait if out of turn, none if the game is over."""
        if over:
            return ()
        wait_actions = (_load_game(self._name).num_distinct_actions(),)
        return (self._is_to_act(player) and self._state.legal_actions(player)) or wait_actions


def _has_perfect_information(name: str) -> bool:
    """Return whether all players of a game know its state."""
    return _enum_name(_load_game(name).get_type().information) in PERFECT_INFORMATION_TYPES


def _shows_information_state(name: str) -> bool:
    """Return whether players observe all they know, not only the last turn."""
    game = _load_game(name)
    game_type = game.get_type()
    is_short = game.max_game_length() <= MAX_FULL_HISTORY_TURNS
    return game_type.provides_information_state_string and (
        is_short or not game_type.provides_observation_string
    )


@cache
def _collect_labels_by_playing(name: str) -> tuple[Labels, ...]:
    """Return the action labels of each player, collected in some games that are played for this.

    OpenSpiel names an action only in a state. An action with different names in different states
    is labelled by its number. If there are several players, each can also wait.
    """
    game = _load_game(name)
    action_count, players = game.num_distinct_actions(), game.num_players()
    names_by_player: list[defaultdict[int, set[str]]] = [defaultdict(set) for _ in range(players)]
    query_count = 0
    for game_number in range(1, LABEL_TRIAL_GAMES + 1):
        state, sampler = game.new_initial_state(), ChanceSampler(game_number / MAX_SEED)
        for _ in range(MAX_TRIAL_TURNS):
            _sample_chance_nodes(state, sampler)
            if state.is_terminal() or query_count > MAX_LABEL_QUERIES:
                break
            joint = []
            is_simultaneous = state.is_simultaneous_node()
            for player in range(players) if is_simultaneous else [state.current_player()]:
                legal_actions = state.legal_actions(player)
                for action in legal_actions:
                    names_by_player[player][action].add(
                        _clean_action_name(state.action_to_string(player, action)).lower()
                    )
                query_count += len(legal_actions)
                joint.append(
                    sampler.sample_outcome([(a, 1 / len(legal_actions)) for a in legal_actions])
                    if legal_actions
                    else 0
                )
            state.apply_actions(joint) if is_simultaneous else state.apply_action(joint[0])
    wait_labels = (WAIT_LABEL,) if players > 1 else ()
    return tuple(
        Labels((*_choose_unique_labels(names_by_action, action_count), *wait_labels))
        for names_by_action in names_by_player
    )


def _clean_action_name(text: str) -> str:
    """Return an action name in a form that can be typed, without the player's number."""
    return SEPARATOR_PATTERN.sub("-", PLAYER_PREFIX_PATTERN.sub("", text).strip()).strip("-")


def _default_action_name(action: int) -> str:
    """Return the label of an action that has no fixed name."""
    return f"action-{action}"


def _choose_unique_labels(
    names_by_action: defaultdict[int, set[str]], action_count: int
) -> list[str]:
    """Return a distinct label for each action.

    An action without a single name is labelled by its number, which also distinguishes equal names.
    """
    labels = [
        next(iter(names_by_action[n])) if len(names_by_action[n]) == 1 else _default_action_name(n)
        for n in range(action_count)
    ]
    label_counts = Counter(labels)
    return [
        make_label_unique(label, n, label_counts)
        if label_counts[label] > 1 or label in ("", WAIT_LABEL, *RESERVED_WORDS)
        else label
        for n, label in enumerate(labels)
    ]


@dataclass(frozen=True)
class OpenSpielProblem(ExternalProblem):
    """A game of OpenSpiel. Players wait while another one acts."""

    @property
    def source(self) -> str:
        """The file that the game is read from, else its name."""
        return _find_game_file(self.name)

    @cached_property
    def is_stochastic(self) -> bool:
        """True if the game has chance events."""
        return _enum_name(_load_game(self.name).get_type().chance_mode) != "DETERMINISTIC"

    @cached_property
    def agents(self) -> tuple[str, ...]:
        """The names of the players."""
        players: int = _load_game(self.name).num_players()
        return ("agent",) if players == 1 else tuple(f"player-{n}" for n in range(players))

    @property
    def actions(self) -> tuple[Labels, ...]:
        """The action labels of each player, with one to wait if there are several players."""
        return _collect_labels_by_playing(self.name)

    @cached_property
    def observations(self) -> tuple[TextLine, ...]:
        """A text observation for each player; () if all players know the state."""
        return () if _has_perfect_information(self.name) else (TextLine(),) * len(self.agents)

    @cached_property
    def shared_reward(self) -> bool:
        """True if there are several players and all get the same reward."""
        return (
            _enum_name(_load_game(self.name).get_type().utility) == "IDENTICAL"
            and len(self.agents) > 1
        )

    @cached_property
    def reward_scale(self) -> float:
        """The power of 2 to which tolerances of values are relative, from the final payoffs."""
        game = _load_game(self.name)
        return compute_reward_scale(np.array([game.min_utility(), game.max_utility()]))

    @cached_property
    def return_bounds(self) -> tuple[float, float] | None:
        """The least and the greatest payoff of a game in a file; 0 if the game is not finished."""
        if not EFG_FILE_PATTERN.fullmatch(self.name.partition(":")[2]):
            return None
        game = _load_game(self.name)
        return min(game.min_utility(), 0.0), max(game.max_utility(), 0.0)

    def make_environment(self) -> ExternalEnvironment:
        """Return a new game that has not been started."""
        return OpenSpielEnvironment(self.name)

    def description(self) -> str:
        """Return the long name of the game."""
        return str(_load_game(self.name).get_type().long_name)

    def check_playable(self) -> None:
        """Raise BadParameter if the game is of a kind that cannot be played."""
        _schedule_turns(self.name)
        game_type = _load_game(self.name).get_type()
        has_observations = (
            game_type.provides_information_state_string or game_type.provides_observation_string
        )
        reasons = {
            "a mean-field game, which has no individual players": _enum_name(game_type.dynamics)
            == "MEAN_FIELD",
            "its chance events are hidden, so dmplay cannot draw them": _enum_name(
                game_type.chance_mode
            )
            == "SAMPLED_STOCHASTIC",
            "it has no list of actions": not _load_game(self.name).num_distinct_actions(),
            "it does not provide observations for the players": not (
                _has_perfect_information(self.name) or has_observations
            ),
        }
        reason = next((reason for reason, applies in reasons.items() if applies), "")
        if reason:
            raise BadParameter(f"{self.source}: {reason}")
