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
from dmplay.core import WAIT, Labels, Problem, Texts
from dmplay.dice import spread
from dmplay.errors import BadParameter, UnknownName
from dmplay.files.tree import told
from dmplay.guests.extras import RAISED, first_line, library
from dmplay.guests.history import LARGEST_SEED, Guest, Known, World
from dmplay.laws.sound import COMMANDS

EXTRA = "openspiel"
PERFECT = ("PERFECT_INFORMATION", "ONE_SHOT")  # after which all is known to all
TOLD_WHOLE = 30  # turns of a game of which a player is told all it knows; of a longer one the last
CHANCES = 16  # draws of one turn, at first
TRIES, ASKED = 6, 4000  # games played, and names asked for, to learn what actions are called
LONGEST = 1000  # turns of such a game
DIGITS = 16  # of a hash, by which two files are told apart
FILE = re.compile(r"efg_game\(filename=(.*?)(?:, sha256=\w+)?\)")
BETWEEN = re.compile(r"[\s_,;:]+")
PLAYER = re.compile(r"^\[P\d+\]|^Pl\d+: ")


def find(name: str) -> Problem:
    """The game of this name; raises BadParameter where it is of a kind that cannot be played."""
    made = Game(name=_exactly(name))
    made.check()
    return made


def _exactly(name: str) -> str:
    """The name, of a file with a hash of what it holds: it may hold another game tomorrow."""
    file = FILE.fullmatch(name.partition(":")[2])
    if not file:
        return name
    digest = hashlib.sha256(disk.content(Path(file[1]))).hexdigest()[:DIGITS]
    return f"{EXTRA}:efg_game(filename={file[1]}, sha256={digest})"


def names() -> list[str]:
    """The games that the library has."""
    return sorted(library("pyspiel", EXTRA, EXTRA).registered_names())


@cache
def _game(name: str) -> Any:
    """The game; raises UnknownName or BadParameter in one line."""
    pyspiel = library("pyspiel", EXTRA, name)
    text = name.partition(":")[2]
    short = text.partition("(")[0]
    if short not in pyspiel.registered_names():  # which would print
        raise UnknownName("game", short, pyspiel.registered_names(), where=EXTRA)
    file = FILE.fullmatch(text)
    tree = told(file[1], disk.content(Path(file[1]))) if file else ""
    try:
        with _hushed():
            return pyspiel.load_efg_game(tree) if tree else pyspiel.load_game(text)
    except RAISED as error:
        raise BadParameter(f"{name}: {first_line(error)}") from None


@contextmanager
def _hushed() -> Iterator[None]:
    """Shows nothing of what a library written in C++ prints before it raises."""
    kept, nowhere = os.dup(2), os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 2)
    try:
        yield
    finally:
        os.dup2(kept, 2)
        os.close(kept)
        os.close(nowhere)


def _kind(fact: object) -> str:
    """The name of a kind that a game is of."""
    return str(fact).rpartition(".")[2]


class Luck:
    """What chance does in one turn, as it follows from one draw."""

    def __init__(self, draw: float) -> None:
        self._draw = draw
        self._known: Sequence[float] = ()
        self._used = 0

    def pick(self, outcomes: Sequence[tuple[int, float]]) -> int:
        """One of some outcomes, by their probabilities."""
        if self._used == len(self._known):
            many = max(CHANCES, 2 * self._used)
            self._known = spread(np.array([self._draw]), many)[0].tolist()
        u, self._used = self._known[self._used], self._used + 1
        edges = np.cumsum([p for _, p in outcomes])[:-1]
        return outcomes[int(edges.searchsorted(u, "right"))][0]


def _settled(state: Any, luck: Luck) -> None:
    """Lets chance act until a player is to."""
    while state.is_chance_node():
        state.apply_action(luck.pick(state.chance_outcomes()))


class Playing(World):
    """A game that is played."""

    def __init__(self, name: str, state: Any = None, paid: Sequence[float] = ()) -> None:
        self._name, self._state, self._paid = name, state, paid

    def begin(self, draw: float) -> Known:
        """Chance may act first."""
        self._state = _game(self._name).new_initial_state()
        self._paid = [0.0] * self._state.num_players()
        _settled(self._state, Luck(draw))
        return self._known()

    def act(self, actions: tuple[float, ...], draw: float) -> Known:
        """Who is to act does; then chance may."""
        state = self._state
        if state.is_simultaneous_node():
            able = map(state.legal_actions, range(state.num_players()))
            pairs = zip(actions, able, strict=True)
            state.apply_actions([int(action) if may else 0 for action, may in pairs])
        else:
            state.apply_action(int(actions[state.current_player()]))
        _settled(state, Luck(draw))
        return self._known()

    def copy(self) -> "Playing":
        """A clone."""
        return Playing(self._name, self._state.clone(), self._paid)

    def _known(self) -> Known:
        state, players = self._state, range(self._state.num_players())
        before, self._paid = self._paid, state.returns()
        rewards = tuple(now - was for now, was in zip(self._paid, before, strict=True))
        over = state.is_terminal()
        told = str(state) or ("over" if over else "begun")
        seen = () if _perfect(self._name) else tuple(_seen(self._name, state, p) for p in players)
        able = tuple(self._legal(player, over=over) for player in players)
        return Known(rewards, over, able, seen, told.rstrip("\n"), self._called(able))

    def _called(self, able: Sequence[Sequence[int]]) -> tuple[dict[int, str], ...]:
        """What can be done by its names in this state, where these are not always the same."""
        always, wait = _names(self._name), _game(self._name).num_distinct_actions()
        pairs = [*zip(always, able, strict=True)]
        if not any(known[action] == _number(action) for known, may in pairs for action in may):
            return ()
        return tuple(
            {
                action: _typable(self._state.action_to_string(player, action)) or known[action]
                for action in may
                if action != wait
            }
            for player, (known, may) in enumerate(pairs)
        )

    def _legal(self, player: int, *, over: bool) -> Sequence[int]:
        if over:
            return ()
        state = self._state
        turn = state.is_simultaneous_node() or state.current_player() == player
        wait = (_game(self._name).num_distinct_actions(),)
        return (turn and state.legal_actions(player)) or wait


def _perfect(name: str) -> bool:
    return _kind(_game(name).get_type().information) in PERFECT


def _whole(name: str) -> bool:
    """Whether a player is told all that it knows, not what it sees last."""
    game = _game(name)
    kind = game.get_type()
    short = game.max_game_length() <= TOLD_WHOLE
    return kind.provides_information_state_string and (
        short or not kind.provides_observation_string
    )


def _seen(name: str, state: Any, player: int) -> str:
    told = state.information_state_string if _whole(name) else state.observation_string
    return str(told(player)).strip("\n") or "nothing"


@cache
def _names(name: str) -> tuple[Labels, ...]:
    """What the actions of each player are called: what they always were in some games, or a number.

    OpenSpiel knows an action's name in a state alone; where it has another in another, it has none.
    """
    game = _game(name)
    many, players = game.num_distinct_actions(), game.num_players()
    heard: list[defaultdict[int, set[str]]] = [defaultdict(set) for _ in range(players)]
    asked = 0
    for number in range(1, TRIES + 1):
        state, luck = game.new_initial_state(), Luck(number / LARGEST_SEED)
        for _ in range(LONGEST):
            _settled(state, luck)
            if state.is_terminal() or asked > ASKED:
                break
            joint = []
            together = state.is_simultaneous_node()
            for player in range(players) if together else [state.current_player()]:
                able = state.legal_actions(player)
                for action in able:
                    heard[player][action].add(_plain(state.action_to_string(player, action)))
                asked += len(able)
                joint.append(luck.pick([(a, 1 / len(able)) for a in able]) if able else 0)
            state.apply_actions(joint) if together else state.apply_action(joint[0])
    waits = (WAIT,) if players > 1 else ()
    return tuple(Labels((*_labels(each, many), *waits)) for each in heard)


def _typable(told: str) -> str:
    """A name as it is typed."""
    return BETWEEN.sub("-", PLAYER.sub("", told).strip()).strip("-")


def _plain(told: str) -> str:
    """A name as labels are written."""
    return _typable(told).lower()


def _number(action: int) -> str:
    """An action without a name."""
    return f"action-{action}"


def _labels(heard: defaultdict[int, set[str]], many: int) -> list[str]:
    """A name for each action, another for each."""
    named = [next(iter(heard[n])) if len(heard[n]) == 1 else _number(n) for n in range(many)]
    count = Counter(named)
    return [
        f"{one}-{n}" if count[one] > 1 or one in ("", WAIT, *COMMANDS) else one
        for n, one in enumerate(named)
    ]


@dataclass(frozen=True)
class Game(Guest):
    """A game of OpenSpiel; of a turn there the others wait."""

    @cached_property
    def drawn(self) -> bool:
        """Whether chance acts in it."""
        return _kind(_game(self.name).get_type().chance_mode) != "DETERMINISTIC"

    @cached_property
    def agents(self) -> tuple[str, ...]:
        """Its players."""
        players: int = _game(self.name).num_players()
        return ("agent",) if players == 1 else tuple(f"player-{n}" for n in range(players))

    @property
    def actions(self) -> tuple[Labels, ...]:
        """Those of each player, and to wait."""
        return _names(self.name)

    @cached_property
    def observations(self) -> tuple[Texts, ...]:
        """What each player knows; nothing of its own where all is seen."""
        return () if _perfect(self.name) else (Texts(),) * len(self.agents)

    @cached_property
    def shared_reward(self) -> bool:
        """Whether all are paid the same."""
        return _kind(_game(self.name).get_type().utility) == "IDENTICAL" and len(self.agents) > 1

    def world(self) -> World:
        """A game of its own."""
        return Playing(self.name)

    def story(self) -> str:
        """The game's long name."""
        return str(_game(self.name).get_type().long_name)

    def check(self) -> None:
        """Refuses what cannot be played."""
        kind = _game(self.name).get_type()
        told = kind.provides_information_state_string or kind.provides_observation_string
        reasons = {
            "a mean-field game: it has no players": _kind(kind.dynamics) == "MEAN_FIELD",
            "its chance is hidden, and cannot be drawn": _kind(kind.chance_mode)
            == "SAMPLED_STOCHASTIC",
            "it counts no actions": not _game(self.name).num_distinct_actions(),
            "it does not tell what a player sees": not (_perfect(self.name) or told),
        }
        why = next((why for why, holds in reasons.items() if holds), "")
        if why:
            raise BadParameter(f"{self.name}: {why}")
