"""The games of a language model: it sits in one seat of each, and knows them by ids alone."""

from dataclasses import dataclass
from pathlib import Path
from typing import TypedDict

from dmplay.bots.protocol import Facts, choices, learnt, sight
from dmplay.core import Problem
from dmplay.errors import BadParameter, UnknownName
from dmplay.finding import agents, problems
from dmplay.finding.names import problem_names
from dmplay.finding.ways import is_data, is_file
from dmplay.game import saves
from dmplay.game.errand import Hosting
from dmplay.game.game import Game
from dmplay.game.request import Request
from dmplay.game.start import new
from dmplay.reports.problems import about
from dmplay.session import MOST_TURNS
from dmplay.transcript.format import MODEL, PERSON
from dmplay.transcript.recorder import Recorder

MOST = 16  # games at once, with those of which only the end is still known


class Situation(TypedDict):
    """Where a game stands for the model, and what happened since it was told last."""

    game: str
    seat: str
    turn: int  # how many were played
    turns: list[Facts]  # those that were not told yet, by the keys of `bots.protocol.learnt`
    seen: object  # a name, numbers or the notation of a state; null for nothing yet
    legal: object  # names of actions, or the bounds of a number
    words: str  # the same, as a person would read it; '' where that would tell a belief
    ending: str  # how it ended; '' while it goes on


@dataclass
class Seat:
    """A game, the model's seat in it, and how many of its turns were told."""

    game: Game
    place: int
    told: int = -1  # the last; turn 0 is what was seen first


class Games:
    """What a model can ask for; DmplayError where it asks for what cannot be."""

    def __init__(self, terms: Hosting) -> None:
        self.terms = terms
        self.unwritten: list[Recorder] = []  # of games of which turns could not be written
        self._known: dict[str, str] = {}
        for name in terms.problems or _built_in():
            problems.resolve(name, {})  # refuses what there is not, before anybody asks
            if self._known.setdefault(_id(name), name) != name:
                raise BadParameter(f"{name}: {_id(name)} is {self._known[_id(name)]} already")
        if terms.folder:
            _make(terms.folder)
        self._seats: dict[str, Seat] = {}
        self._begun = 0

    def problems(self) -> list[dict[str, str]]:
        """The ids of problems, and what each is about."""
        each = ((name, problems.load(known)) for name, known in self._known.items())
        return [
            {"problem": name, "kind": one.kind, "about": problems.docs(one).partition("\n")[0]}
            for name, one in each
        ]

    def info(self, problem: str) -> dict[str, object]:
        """All about a problem that a player may know before a game."""
        told = about(self._named(problem))._asdict()
        del told["keys"], told["variants"]  # nobody presses keys here; variants have ids
        return told | {"problem": problem}

    def new(self, problem: str, seat: str = "", others: str = "") -> Situation:
        """Begins a game, in the first seat if none is named, with the usual agents in the others
        if none is.
        """
        name = self._named(problem)
        rules = problems.load(name)
        place = rules.seat(seat) if seat else 0
        who = _sitting(rules, place, others)
        self._make_room()
        terms, episode = self.terms, self._begun
        endless = terms.turns is None and rules.horizon is None
        request = Request(
            name,
            seats=[f"{agent}={one}" for agent, one in zip(rules.agents, who, strict=True)],
            seed=terms.seed,
            episode=0 if terms.seed is None else episode,
            turns=MOST_TURNS if endless else terms.turns,
            record=terms.folder and saves.free(terms.folder, problem),
            strict=terms.strict,
            person=MODEL,
            seed_known=False,
        )
        self._begun += 1
        found = self._seats[f"g{self._begun}"] = Seat(new(request), place)
        found.game.catch_up()
        return self._told(f"g{self._begun}")

    def look(self, game: str, *, history: bool = False) -> Situation:
        """Where a game stands; with all turns again if the history is asked for."""
        found = self._found(game)
        found.told = -1 if history else found.told
        return self._told(game)

    def act(self, game: str, action: str, turn: int = 0) -> Situation:
        """Plays an action; where a turn is named, only in that one."""
        found = self._found(game)
        played, view = found.game, found.game.view()
        number = len(played.session.turns) + 1
        if turn and turn != number and not played.session.over:
            raise BadParameter(f"turn: got {turn}, expected {number}")
        known = view.labels if view.called else played.problem.actions[found.place]
        played.choose(known.read(action))
        return self._told(game)

    def hint(self, game: str) -> Facts:
        """What a good player would do, which the transcript says was asked."""
        played = self._found(game).game
        played.may_help("hint")
        said = played.adviser.hint()
        advice = played.adviser.given
        if advice is None:
            raise BadParameter(said)
        played.helped()
        return advice.facts

    def undo(self, game: str, turns: int = 1) -> Situation:
        """Takes back the model's last choices, and what came of them."""
        found = self._found(game)
        if found.game.session.over:
            raise BadParameter("undo: the game is over")
        found.game.undo(turns)
        found.told = len(found.game.session.turns)
        return self._told(game)

    def over(self, game: str) -> Facts:
        """Ends a game that goes on; how it ended, and what was hidden."""
        found = self._found(game)
        self._end(found, "quit")
        return found.game.account.end()

    def close(self, reason: str = "interrupted") -> None:
        """Ends all games: nobody is there any more."""
        for found in self._seats.values():
            self._end(found, reason)

    def _end(self, found: Seat, reason: str) -> None:
        """Ends a game, once, and its transcript."""
        recorder = found.game.recorder
        goes_on = recorder and recorder.open
        found.game.finish(reason)
        if recorder and goes_on and not saves.dropped(recorder) and recorder.fault:
            self.unwritten.append(recorder)

    def _named(self, problem: str) -> str:
        """The problem of an id."""
        if problem not in self._known:
            raise UnknownName("problem", problem, self._known)
        return self._known[problem]

    def _found(self, game: str) -> Seat:
        """The game of an id."""
        if game not in self._seats:
            raise UnknownName("game", game, self._seats)
        return self._seats[game]

    def _make_room(self) -> None:
        """Forgets the first of too many games that is over; refuses one more if none is."""
        if len(self._seats) < MOST:
            return
        over = [name for name, one in self._seats.items() if one.game.session.over]
        if not over:
            raise BadParameter(f"new: {MOST} games are played; end one of them by over")
        del self._seats[over[0]]

    def _told(self, name: str) -> Situation:
        """What the model may know of a game, and was not told yet; one that is over is ended."""
        found = self._seats[name]
        game, place, session = found.game, found.place, found.game.session
        if session.over:
            self._end(found, "")
        news = range(found.told + 1, len(session.turns) + 1)
        found.told = len(session.turns)
        legal = session.legal(place)
        tells = self.terms.belief or not game.problem.hidden
        return {
            "game": name,
            "seat": game.problem.agents[place],
            "turn": found.told,
            "turns": [_turn(found, number) for number in news],
            "seen": sight(game.problem, place, session.observation(place, found.told)),
            "legal": choices(game.problem, place, legal, session.labels(place)),
            "words": game.account.situation(game.moment(place)) if tells else "",
            "ending": game.account.result() if session.over else "",
        }


def _turn(found: Seat, number: int) -> Facts:
    """What a turn taught the seat; the first, what it saw before it did anything."""
    session, place = found.game.session, found.place
    if not number:
        facts = {"observation": sight(session.problem, place, session.observation(place, 0))}
    else:
        facts = learnt(session.problem, place, session.percept(place, number), 0)
    return {"turn": number} | facts


def _built_in() -> list[str]:
    """The built-in problems and their variants."""
    return [
        f"{name}:{variant}" if variant else name
        for name in problem_names()
        for variant in problems.variants(name)
    ]


def _make(folder: Path) -> None:
    """Makes a folder where there is none."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise BadParameter(f"--output: {folder}: {error.strerror}") from None


def _id(name: str) -> str:
    """By what a model knows a problem: its name, of a file without the place."""
    if is_data(name):
        return Path(name).stem
    place, colon, rest = name.partition(":")
    return f"{Path(place).stem}{colon}{rest}" if is_file(name) else name


def _sitting(problem: Problem, place: int, others: str) -> list[str]:
    """Who sits where: agents that dmplay knows, and whoever asks in this place."""
    if others and len(problem.agents) == 1:
        raise BadParameter(f"others: got {others!r}, expected none: there is one seat only")
    who = []
    for seat in range(len(problem.agents)):
        known = agents.roster(problem, seat)
        base = others.partition(":")[0]
        if others and base not in known.agents:
            raise UnknownName("agent", base, known.agents)
        who.append(PERSON if seat == place else others or known.partner)
    return who
