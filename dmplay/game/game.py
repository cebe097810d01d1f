"""A game that people play: a session, who sits where, and its transcript."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import cast

from rich.text import Text

from dmplay.advice.adviser import Adviser
from dmplay.advice.ghost import Ghost
from dmplay.budget import Stopped
from dmplay.chance import Array
from dmplay.core import Problem
from dmplay.describe import ended, one_line
from dmplay.dice import Dice
from dmplay.errors import BadParameter, Forfeit
from dmplay.finding.ways import is_program
from dmplay.game.account import Account
from dmplay.game.request import Request
from dmplay.keys.keyboard import Keyboard
from dmplay.policies.script import EndOfScript
from dmplay.session import Follower, Session, View
from dmplay.signals import WHOLE
from dmplay.terminal import clean
from dmplay.thought import About, think
from dmplay.transcript.recorder import Recorder
from dmplay.transcript.seal import LEFT, secret
from dmplay.views.kept import Moment
from dmplay.views.style import Look, pictured, style_of

NOTHING: Mapping[int, float] = {}
AGAIN = "# again: under dice that were played before"


class Game:
    """What is played and recorded; its account tells of it, its keyboard says which keys act."""

    paid = False  # whether rewards are told that the game does not show

    def __init__(  # noqa: PLR0913, PLR0917 - what is played, who sits there, and where it is kept
        self,
        name: str,
        session: Session,
        seats: Sequence[str],
        keyboard: Keyboard,
        recorder: Recorder | None = None,
        request: Request | None = None,
    ) -> None:
        self.name = name
        self.seats = tuple(seats)
        self.people = keyboard.people
        self.keyboard = keyboard
        self.recorder = recorder
        self.request = request  # None for a recording
        self.style = style_of(session.problem)
        self.warning = ""  # for whoever goes on with it, or looks at it
        self.notes = ""  # for the end of the transcript
        self.verdict: Sequence[str] = ()  # what its moves and dice were worth, once it is over
        self.ghost: Ghost | None = None
        self.removed = 0  # older games that had to make room for it where games are kept
        self.repeats = False  # whether one of the same dice was played before it
        self.between: Callable[[], object] = lambda: None  # after a turn that another follows
        self.logs: list[Path] = []  # of programs that play, once it is over
        agents = {clean(who): None for seat, who in enumerate(seats) if seat not in self.people}
        who = " and ".join(agents) + (" are" if len(agents) > 1 else " is")
        self._choosing = About(f"{who} thinking", move=True)
        self._chosen: dict[int, float] = {}
        self._undone: list[list[float]] = []
        self._sit(session)

    def _sit(self, session: Session) -> None:
        """Plays this session from now on."""
        self.session = session
        self.account = Account(session, self.people, reveal=self.reveal)
        self._advisers: dict[int, Adviser] = {}
        self._now: Moment | None = None
        self._drawn: tuple[Moment, Look, Text] | None = None

    @property
    def problem(self) -> Problem:
        """The problem played."""
        return self.session.problem

    @property
    def source(self) -> Path | None:
        """The file that holds the game."""
        return self.recorder.path if self.recorder else None

    @property
    def settings(self) -> list[str]:
        """The parameters that differ from the default, as they are typed."""
        return self.request.told if self.request else []

    @property
    def strict(self) -> bool:
        """Whether nothing may be taken back."""
        return self.request is not None and bool(self.request.strict)

    @property
    def unaided(self) -> bool:
        """Whether nobody may be given advice."""
        return self.request is not None and self.request.strict == "hints"

    @property
    def reveal(self) -> bool:
        """Whether what is hidden is shown."""
        return self.request is not None and self.request.reveal

    @property
    def sealed(self) -> bool:
        """Whether there are secrets and the game can be played on, so that they must stay so."""
        left = (self.session.ending or "") in LEFT
        return left and secret(self.problem, self.seats, reveal=self.reveal)

    @property
    def seed(self) -> int:
        """The seed of the dice."""
        return cast(Dice, self.session.source).seed

    @property
    def shows_seed(self) -> bool:
        """Whether the player knows the seed: a fresh one is told after the game."""
        return self.request is None or self.request.seed_known or self.session.over

    @property
    def again(self) -> str:
        """The command that plays a game of fresh dice once more; '' for another."""
        fresh = self.request is not None and self.request.fresh
        return self.request.command(self.name, self.seed) if self.request and fresh else ""

    @property
    def private(self) -> bool:
        """Whether several people play of whom each may know something else."""
        return len(self.people) > 1 and self.problem.hidden

    @property
    def watched(self) -> bool:
        """Whether agents alone play it, now."""
        return self.request is not None and not self.people

    @property
    def watcher(self) -> int:
        """The seat whose view is shown: the person to choose, else the first."""
        waiting = self.waiting
        return waiting if waiting is not None else (self.people or [0])[0]

    @property
    def waiting(self) -> int | None:
        """The person who chooses next."""
        if not self.people or self.session.over:
            return None
        left = (seat for seat in self.session.asked(self.people) if seat not in self._chosen)
        return next(left, None)

    @property
    def adviser(self) -> Adviser:
        """Who gives hints to the watcher."""
        seat = self.watcher
        if seat not in self._advisers:
            self._advisers[seat] = Adviser(self.session, seat, self.seats)
        return self._advisers[seat]

    def moment(self, seat: int | None = None) -> Moment:
        """What the watcher, or another seat, may know now.

        The watcher's is made anew only when a turn, the seat or the end is new.
        """
        if seat is not None:
            return Moment(self.session, seat, paid=self.paid, watched=self.watched)
        watcher = self.watcher
        if self._now is None or not self._now.lasts(watcher):
            self._now = Moment(self.session, watcher, paid=self.paid, watched=self.watched)
        return self._now

    def view(self, seat: int | None = None) -> View[Problem]:
        """The same as policies and drawings are given it."""
        return self.moment(seat).view

    def draw(self, look: Look, now: Moment | None = None) -> Text:
        """The board in the room there is; the state too where it is revealed.

        It is drawn anew only for another moment or look; nobody writes into it.
        """
        now = now or self.moment()
        ghost = self.ghost.session.state if self.ghost and self.ghost.early else look.ghost
        names = {**self.keyboard.names(self.watcher), **look.names}
        look = look._replace(state=self._told, ghost=ghost, names=names)
        if not (self._drawn and self._drawn[0] is now and self._drawn[1].alike(look)):
            self._drawn = now, look, self.account.kept.fit(now, look)
        return self._drawn[2]

    def price(self, action: float) -> str:
        """What an action costs, behind a blank; '' where its view does not say."""
        told: Callable[[View[Problem], float], str] | None = getattr(self.style, "price", None)
        return f" {told(self.view(), action)}" if told else ""

    @property
    def _told(self) -> Array | None:
        """The state where what is hidden is told."""
        told = self.reveal or (self.session.over and self.problem.hidden)
        return self.session.state if told else None

    def pictured(self) -> list[str]:
        """The rows of the picture that a problem brings of what the watcher may see; else none."""
        drawn = pictured(self.style, self.view(), self._told)
        return drawn.plain.split("\n") if drawn else []

    def choose(self, action: float, seat: int | None = None) -> bool:
        """Takes a person's choice, the next one's to choose unless `seat` says whose.

        Plays the turn once everybody's is in.
        """
        waiting = self.waiting if seat is None else seat
        if self.session.over:
            raise BadParameter(f"the game is over ({ended(self.session.ending)})")
        if waiting is None:
            raise BadParameter("no person plays here")
        self.session.check(waiting, action)
        chosen = {**self._chosen, waiting: action}
        if len(chosen) == len(self.session.asked(self.people)):
            played = self.advance(chosen)
            self.catch_up()
            return played
        self._chosen = chosen
        return False

    def advance(self, chosen: Mapping[int, float] = NOTHING) -> bool:
        """Plays a turn of these choices and the agents'; none is kept of one that is not played."""
        try:
            actions = self._decided([chosen.get(seat) for seat in range(len(self.seats))])
        except EndOfScript:
            self.session.end("quit")
            return False
        except Forfeit as forfeit:
            self.account.forfeit = one_line(clean(str(forfeit)))
            self.session.end("forfeit")
            return False
        finally:
            self._chosen = {}
        with WHOLE:
            self.session.advance(actions)
            self._undone.clear()
            self._record()
        self._haunt()
        return True

    def catch_up(self) -> None:
        """Plays the turns of others until a person is asked."""
        while self.session.idle(self.people):
            self.between()
            self.advance()

    def _decided(self, actions: Sequence[float | None]) -> Sequence[float | None]:
        """The choices of people, and of the agents, who may think for long."""
        if len(self.people) == len(self.seats):
            return actions
        return think(self._choosing, lambda: self.session.decided(actions))

    def leave_alone(self) -> None:
        """Has agents and advisers think anew: one of them may still be thinking."""
        session = self.session
        session.followers = [
            follower and Follower(session, follower.seat, follower.policy)
            for follower in session.followers
        ]
        self._advisers, self._chosen = {}, {}
        self.ghost = self.account.ghost = None

    def unattended(self) -> bool:
        """Plays a turn of a game without people; False once it is over."""
        return not self.session.over and self.advance()

    def run(self) -> Iterator[int]:
        """Plays a game without people to its end; before each turn, or event of a recording, which
        may take turns back, how many turns there were.
        """
        before = len(self.session.turns)
        while self.unattended():
            yield before
            before = len(self.session.turns)

    def undo(self, turns: int = 1) -> None:
        """Takes back turns; the transcript keeps that it was done."""
        self._may("undo")
        if self._chosen:  # a first choice of two is taken back before any turn is
            self._chosen.clear()
            return
        with WHOLE:
            taken = self.session.undo(self.session.back(self.people, turns))
            self._undone += [list(turn.actions) for turn in reversed(taken)]
            if self.recorder:
                self.recorder.event("undo", len(taken))
        self._haunt()

    def redo(self) -> None:
        """Plays the turn last taken back again."""
        if not self._undone:
            raise BadParameter("redo: nothing was taken back")
        self._chosen.clear()
        self._again()
        while self._undone and self.session.idle(self.people):
            self.between()
            self._again()
        self.catch_up()

    def _again(self) -> None:
        with WHOLE:
            self.session.advance(self._undone[-1])
            self._undone.pop()
            self._record()
        self._haunt()

    def reroll(self) -> None:
        """Plays the last turn again under other dice; the transcript says so."""
        self._may("reroll")
        if not self.session.turns:
            raise BadParameter("reroll: no turn was played yet")
        self._chosen.clear()
        self._undone.clear()
        with WHOLE:
            self.session.reroll()
            if self.recorder:
                self.recorder.event("reroll", self.session.rerolls[len(self.session.turns)])
            self._record()
        self._haunt()
        self.catch_up()

    def haunt(self, ghost: Ghost | None) -> None:
        """Has this ghost play beside, up to the present turn."""
        self.ghost = self.account.ghost = ghost
        self._haunt()

    def repeat(self) -> None:
        """Has its transcript say at once, and once, that its dice were played before."""
        if self.recorder and not self.repeats:
            self.recorder.note(AGAIN)
        self.repeats = True

    def _haunt(self) -> None:
        """Has the ghost play as far as the person did, where it may be seen before the end."""
        ghost = self.ghost
        if ghost and ghost.early:
            with suppress(Stopped):
                think(About(f"{clean(ghost.name)} plays beside you"), ghost.follow)

    def may_help(self, command: str) -> None:
        """Refuses advice where nobody may be given any."""
        if self.unaided:
            raise BadParameter(f"{command}: this game is strict about help")

    def helped(self) -> None:
        """Counts that the watcher was given advice; the transcript keeps it."""
        if self.watcher not in self.people:
            return
        name = self.problem.agents[self.watcher]
        with WHOLE:
            self.session.help[name] += 1
            if self.recorder:
                self.recorder.event("help", {name: 1})

    @property
    def final(self) -> str:
        """Why it would not be fair to take turns back; '' where they may be."""
        if self.strict:
            return "this game is strict"
        shown = self.session.over and self.problem.hidden and self.people and not self.reveal
        return "the game is over and what was hidden is shown" if shown else ""

    def _may(self, command: str) -> None:
        """Refuses to take back where that is not fair."""
        if self.final:
            raise BadParameter(f"{command}: {self.final}")

    def _record(self) -> None:
        if self.recorder:
            self.recorder.turn()

    def finish(self, reason: str = "quit") -> None:
        """Ends the game and its transcript, and the programs that play in it."""
        with WHOLE:
            self.session.end(reason)
            if self.recorder:
                why = f"# {self.account.forfeited}\n" if self.account.forfeited else ""
                self.recorder.end(f"{why}{self.notes}")
        if any(map(is_program, self.seats)):
            from dmplay.bots.end import dismissed  # not needed where none plays

            self.logs += dismissed(self.session, self.name)
