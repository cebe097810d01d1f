"""Games of OpenSpiel: `openspiel:kuhn_poker`, `openspiel:kuhn_poker(players=3)`."""

import hashlib
import os
import re
from collections import Counter, defaultdict
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path
from typing import Any

import numpy as np

from dmplay import disk
from dmplay.core import WAIT_LABEL, Labels, Problem, TextLine
from dmplay.dice import expand_uniforms
from dmplay.errors import BadParameter, UnknownName
from dmplay.files.tree import normalize_efg
from dmplay.guests.extras import LIBRARY_ERRORS, import_library, summarize_error
from dmplay.guests.history import MAX_SEED, ExternalEnvironment, ExternalProblem, TimeStep
from dmplay.laws.sound import RESERVED_WORDS

PIP_EXTRA = "openspiel"
PERFECT_INFORMATION_TYPES = ("PERFECT_INFORMATION", "ONE_SHOT")  # after which all is known to all
MAX_FULL_HISTORY_TURNS = (
    30  # turns of a game of which a player is told all it knows; of a longer one the last
)
INITIAL_CHANCE_UNIFORMS = 16  # draws of one turn, at first
LABEL_TRIAL_GAMES, MAX_LABEL_QUERIES = (
    6,
    4000,
)  # games played, and names asked for, to learn what actions are called
MAX_TRIAL_TURNS = 1000  # turns of such a game
HASH_DIGITS = 16  # of a hash, by which two files are told apart
EFG_FILE_PATTERN = re.compile(r"efg_game\(filename=(.*?)(?:, sha256=\w+)?\)")
SEPARATOR_PATTERN = re.compile(r"[\s_,;:]+")
PLAYER_PREFIX_PATTERN = re.compile(r"^\[P\d+\]|^Pl\d+: ")


def load_problem(name: str) -> Problem:
    """The game of this name; raises BadParameter where it is of a kind that cannot be played."""
    made = OpenSpielProblem(name=_add_file_hash(name))
    made.check_playable()
    return made


def _add_file_hash(name: str) -> str:
    """The name, of a file with a hash of what it holds: it may hold another game tomorrow."""
    file = EFG_FILE_PATTERN.fullmatch(name.partition(":")[2])
    if not file:
        return name
    digest = hashlib.sha256(disk.read_bytes(Path(file[1]))).hexdigest()[:HASH_DIGITS]
    return f"{PIP_EXTRA}:efg_game(filename={file[1]}, sha256={digest})"


def list_problem_names() -> list[str]:
    """The games that the library has."""
    return sorted(import_library("pyspiel", PIP_EXTRA, PIP_EXTRA).registered_names())


@cache
def _load_game(name: str) -> Any:
    """The game; raises UnknownName or BadParameter in one line."""
    pyspiel = import_library("pyspiel", PIP_EXTRA, name)
    text = name.partition(":")[2]
    short = text.partition("(")[0]
    if short not in pyspiel.registered_names():  # which would print
        raise UnknownName("game", short, pyspiel.registered_names(), error_prefix=PIP_EXTRA)
    file = EFG_FILE_PATTERN.fullmatch(text)
    tree = normalize_efg(file[1], disk.read_bytes(Path(file[1]))) if file else ""
    try:
        with _silence_stderr():
            return pyspiel.load_efg_game(tree) if tree else pyspiel.load_game(text)
    except LIBRARY_ERRORS as error:
        raise BadParameter(f"{name}: {summarize_error(error)}") from None


@contextmanager
def _silence_stderr() -> Iterator[None]:
    """Shows nothing of what a library written in C++ prints before it raises."""
    kept, nowhere = os.dup(2), os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 2)
    try:
        yield
    finally:
        os.dup2(kept, 2)
        os.close(kept)
        os.close(nowhere)


def _enum_name(value: object) -> str:
    """The name of a kind that a game is of."""
    return str(value).rpartition(".")[2]


class ChanceSampler:
    """What chance does in one turn, as it follows from one draw."""

    def __init__(self, uniform: float) -> None:
        self._uniform = uniform
        self._uniforms: Sequence[float] = ()
        self._n_used = 0

    def sample_outcome(self, outcomes: Sequence[tuple[int, float]]) -> int:
        """One of some outcomes, by their probabilities."""
        if self._n_used == len(self._uniforms):
            many = max(INITIAL_CHANCE_UNIFORMS, 2 * self._n_used)
            self._uniforms = expand_uniforms(np.array([self._uniform]), many)[0].tolist()
        u, self._n_used = self._uniforms[self._n_used], self._n_used + 1
        edges = np.cumsum([p for _, p in outcomes])[:-1]
        return outcomes[int(edges.searchsorted(u, "right"))][0]


def _resolve_chance_nodes(state: Any, sampler: ChanceSampler) -> None:
    """Lets chance act until a player is to."""
    while state.is_chance_node():
        state.apply_action(sampler.sample_outcome(state.chance_outcomes()))


class OpenSpielEnvironment(ExternalEnvironment):
    """A game that is played."""

    def __init__(self, name: str, state: Any = None, returns: Sequence[float] = ()) -> None:
        self._name, self._state, self._returns = name, state, returns

    def reset(self, draw: float) -> TimeStep:
        """Chance may act first."""
        self._state = _load_game(self._name).new_initial_state()
        self._returns = [0.0] * self._state.num_players()
        _resolve_chance_nodes(self._state, ChanceSampler(draw))
        return self._make_time_step()

    def step(self, actions: tuple[float, ...], draw: float) -> TimeStep:
        """Who is to act does; then chance may."""
        state = self._state
        if state.is_simultaneous_node():
            able = map(state.legal_actions, range(state.num_players()))
            pairs = zip(actions, able, strict=True)
            state.apply_actions([int(action) if may else 0 for action, may in pairs])
        else:
            state.apply_action(int(actions[state.current_player()]))
        _resolve_chance_nodes(state, ChanceSampler(draw))
        return self._make_time_step()

    def clone(self) -> "OpenSpielEnvironment":
        """A clone."""
        return OpenSpielEnvironment(self._name, self._state.clone(), self._returns)

    def _make_time_step(self) -> TimeStep:
        state, players = self._state, range(self._state.num_players())
        before, self._returns = self._returns, state.returns()
        rewards = tuple(now - was for now, was in zip(self._returns, before, strict=True))
        over = state.is_terminal()
        told = str(state) or ("over" if over else "begun")
        seen = (
            ()
            if _has_perfect_information(self._name)
            else tuple(_observe_player(self._name, state, p) for p in players)
        )
        able = tuple(self._legal_actions(player, over=over) for player in players)
        return TimeStep(
            rewards, over, able, seen, told.rstrip("\n"), self._current_action_names(able)
        )

    def _current_action_names(
        self, legal_actions: Sequence[Sequence[int]]
    ) -> tuple[dict[int, str], ...]:
        """What can be done by its names in this state, where these are not always the same."""
        always, wait = (
            _collect_action_labels(self._name),
            _load_game(self._name).num_distinct_actions(),
        )
        pairs = [*zip(always, legal_actions, strict=True)]
        if not any(
            known[action] == _default_action_name(action) for known, may in pairs for action in may
        ):
            return ()
        return tuple(
            {
                action: _clean_action_name(self._state.action_to_string(player, action))
                or known[action]
                for action in may
                if action != wait
            }
            for player, (known, may) in enumerate(pairs)
        )

    def _legal_actions(self, player: int, *, over: bool) -> Sequence[int]:
        if over:
            return ()
        state = self._state
        turn = state.is_simultaneous_node() or state.current_player() == player
        wait = (_load_game(self._name).num_distinct_actions(),)
        return (turn and state.legal_actions(player)) or wait


def _has_perfect_information(name: str) -> bool:
    return _enum_name(_load_game(name).get_type().information) in PERFECT_INFORMATION_TYPES


def _shows_information_state(name: str) -> bool:
    """Whether a player is told all that it knows, not what it sees last."""
    game = _load_game(name)
    kind = game.get_type()
    short = game.max_game_length() <= MAX_FULL_HISTORY_TURNS
    return kind.provides_information_state_string and (
        short or not kind.provides_observation_string
    )


def _observe_player(name: str, state: Any, player: int) -> str:
    told = (
        state.information_state_string
        if _shows_information_state(name)
        else state.observation_string
    )
    return str(told(player)).strip("\n") or "nothing"


@cache
def _collect_action_labels(name: str) -> tuple[Labels, ...]:
    """What the actions of each player are called: what they always were in some games, or a number.

    OpenSpiel knows an action's name in a state alone; where it has another in another, it has none.
    """
    game = _load_game(name)
    many, players = game.num_distinct_actions(), game.num_players()
    heard: list[defaultdict[int, set[str]]] = [defaultdict(set) for _ in range(players)]
    asked = 0
    for number in range(1, LABEL_TRIAL_GAMES + 1):
        state, luck = game.new_initial_state(), ChanceSampler(number / MAX_SEED)
        for _ in range(MAX_TRIAL_TURNS):
            _resolve_chance_nodes(state, luck)
            if state.is_terminal() or asked > MAX_LABEL_QUERIES:
                break
            joint = []
            together = state.is_simultaneous_node()
            for player in range(players) if together else [state.current_player()]:
                able = state.legal_actions(player)
                for action in able:
                    heard[player][action].add(
                        _to_action_label(state.action_to_string(player, action))
                    )
                asked += len(able)
                joint.append(luck.sample_outcome([(a, 1 / len(able)) for a in able]) if able else 0)
            state.apply_actions(joint) if together else state.apply_action(joint[0])
    waits = (WAIT_LABEL,) if players > 1 else ()
    return tuple(Labels((*_choose_unique_labels(each, many), *waits)) for each in heard)


def _clean_action_name(text: str) -> str:
    """A name as it is typed."""
    return SEPARATOR_PATTERN.sub("-", PLAYER_PREFIX_PATTERN.sub("", text).strip()).strip("-")


def _to_action_label(text: str) -> str:
    """A name as labels are written."""
    return _clean_action_name(text).lower()


def _default_action_name(action: int) -> str:
    """An action without a name."""
    return f"action-{action}"


def _choose_unique_labels(
    names_by_action: defaultdict[int, set[str]], action_count: int
) -> list[str]:
    """A name for each action, another for each."""
    named = [
        next(iter(names_by_action[n])) if len(names_by_action[n]) == 1 else _default_action_name(n)
        for n in range(action_count)
    ]
    count = Counter(named)
    return [
        f"{one}-{n}" if count[one] > 1 or one in ("", WAIT_LABEL, *RESERVED_WORDS) else one
        for n, one in enumerate(named)
    ]


@dataclass(frozen=True)
class OpenSpielProblem(ExternalProblem):
    """A game of OpenSpiel; of a turn there the others wait."""

    @cached_property
    def is_stochastic(self) -> bool:
        """Whether chance acts in it."""
        return _enum_name(_load_game(self.name).get_type().chance_mode) != "DETERMINISTIC"

    @cached_property
    def agents(self) -> tuple[str, ...]:
        """Its players."""
        players: int = _load_game(self.name).num_players()
        return ("agent",) if players == 1 else tuple(f"player-{n}" for n in range(players))

    @property
    def actions(self) -> tuple[Labels, ...]:
        """Those of each player, and to wait."""
        return _collect_action_labels(self.name)

    @cached_property
    def observations(self) -> tuple[TextLine, ...]:
        """What each player knows; nothing of its own where all is seen."""
        return () if _has_perfect_information(self.name) else (TextLine(),) * len(self.agents)

    @cached_property
    def shared_reward(self) -> bool:
        """Whether all are paid the same."""
        return (
            _enum_name(_load_game(self.name).get_type().utility) == "IDENTICAL"
            and len(self.agents) > 1
        )

    def make_environment(self) -> ExternalEnvironment:
        """A game of its own."""
        return OpenSpielEnvironment(self.name)

    def description(self) -> str:
        """The game's long name."""
        return str(_load_game(self.name).get_type().long_name)

    def check_playable(self) -> None:
        """Refuses what cannot be played."""
        kind = _load_game(self.name).get_type()
        told = kind.provides_information_state_string or kind.provides_observation_string
        reasons = {
            "a mean-field game: it has no players": _enum_name(kind.dynamics) == "MEAN_FIELD",
            "its chance is hidden, and cannot be drawn": _enum_name(kind.chance_mode)
            == "SAMPLED_STOCHASTIC",
            "it counts no actions": not _load_game(self.name).num_distinct_actions(),
            "it does not tell what a player sees": not (
                _has_perfect_information(self.name) or told
            ),
        }
        why = next((why for why, holds in reasons.items() if holds), "")
        if why:
            raise BadParameter(f"{self.name}: {why}")
