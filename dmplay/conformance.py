"""`dmplay check`: every law that a problem, its agents and its look are to keep."""

from collections.abc import Callable, Iterator
from functools import cache, partial

import numpy as np
from rich.text import Text

from dmplay.chance import Array
from dmplay.core import Policy, Problem
from dmplay.dice import Dice
from dmplay.errors import BadPolicy
from dmplay.finding import agents, modules, problems
from dmplay.keys.keymap import AS_DRAWN, hands
from dmplay.laws import play
from dmplay.laws.breach import Breach, Fact, Facts
from dmplay.laws.choices import choosing
from dmplay.laws.samples import SEED, Turns, final, frozen, parts, turns
from dmplay.laws.secret import secret
from dmplay.laws.sound import STAGES
from dmplay.policies.general import Random
from dmplay.session import Session
from dmplay.views.style import Look, Style, fit, style_of

ROWS = 200  # turns that each law is asked of
GAMES, TURNS = 30, 60  # of random play, to meet its ends
NOTED = 40  # states of random play that are written and read
ALONE = (slice(0, 1), slice(7, 8), slice(1, 4), slice(90, 190))  # rows apart from the others
ASKED = 7  # games in which an agent is asked
SHOWN = 4  # turns after which a look is drawn
WIDTHS = (40, 80, 120)


def check(problem: Problem) -> list[Breach]:
    """What of a problem breaks a law, each with the line that does; nothing where all hold.

    First its facts, arrays and first turn, then what comes of them, then agents and look that its
    module brings: each rests on those before.
    """
    for kind in (_facts, _dynamics, _agents, _look):
        found = [*dict.fromkeys(kind(problem))]
        if found:
            return found
    return []


def _facts(problem: Problem) -> Iterator[Breach]:
    """What it says of itself."""
    for stage in (*STAGES, (secret,)):
        found = [
            one for facts in stage for one in play.held(type(problem), partial(facts, problem))
        ]
        yield from found
        if found:
            return


def _dynamics(problem: Problem) -> Iterator[Breach]:
    """The laws of what happens, over turns of random play; each group rests on those before."""

    @cache
    def found() -> Turns:
        return turns(problem, ROWS)

    @cache
    def whole() -> tuple[Array, ...]:
        return play.everything(problem, found())

    @cache
    def ends() -> Array:
        return frozen(np.concatenate([found().s, final(problem, GAMES, TURNS)]))[0]

    def apart(rows: slice) -> Facts:
        return play.alone(problem, Turns(*parts(found(), rows)), parts(whole(), rows))

    singly: list[list[Callable[[], Facts]]] = [[partial(apart, rows)] for rows in ALONE]
    groups: list[list[Callable[[], Facts]]] = [
        [lambda: play.repeated(problem, found(), whole())],
        *singly,
        [lambda: play.shaped(problem, found())],
        [
            *(partial(lambda law: law(problem, found()), law) for law in play.LAWS),
            lambda: play.written(problem, ends()[:: ROWS // NOTED]),
            lambda: play.absorbing(problem, ends()),
        ],
    ]
    for group in groups:
        broken = [one for law in group for one in play.held(type(problem), law)]
        yield from broken
        if broken:
            return


def _agents(problem: Problem) -> Iterator[Breach]:
    """The agents that its module brings, in the seats that they fit."""
    for seat in range(len(problem.agents)):
        for name in modules.agents(problem):
            try:
                policy = agents.agent(problem, seat, name)
            except BadPolicy:  # not for this seat
                continue
            policies: list[Policy] = [Random(problem, at) for at in range(len(problem.agents))]
            policies[seat] = policy
            law = partial(choosing, problem, seat, policies, ASKED)
            for breach in play.held(type(policy), law):
                yield breach._replace(what=f"{name}: {breach.what}")


def _look(problem: Problem) -> Iterator[Breach]:
    """The look of a problem that is not built in: each part in turn, while a game is played."""
    if not problems.stem(problem):
        policies = [Random(problem, at) for at in range(len(problem.agents))]
        session = Session(problem, Dice(SEED), policies, limit=SHOWN)
        yield from play.held(type(problem), partial(_shown, session))


def _shown(session: Session) -> Facts:
    """What is drawn and told of a game fits and is text."""
    hands(session.problem, AS_DRAWN)
    style = style_of(session.problem)
    while True:
        for seat in range(len(session.problem.agents)):
            yield from _drawn(style, session, seat)
        if session.over:
            return
        session.advance()


def _drawn(style: Style, session: Session, seat: int) -> Facts:
    """A board, and the words beside it."""
    view = session.view(seat)
    state = session.state if session.over else None
    for width in WIDTHS:
        drawn = fit(style, view, Look(width, 24, state=state))
        told = f"boards: got {type(drawn).__name__}, expected Text of rich"
        yield Fact(isinstance(drawn, Text), "picture", told)
    for part in (style.told, style.situation) if view.turn else (style.situation,):
        words = part(view)
        told = f"{part.__name__}: got {words!r}, expected a sentence"
        yield Fact(isinstance(words, str) and bool(words), "picture", told)
    told = "goal: expected a list of clauses, panel: a list of pairs, all text"
    yield Fact(_clauses(style.goal(view)) and _pairs(style.panel(view)), "picture", told)


def _clauses(found: object) -> bool:
    return isinstance(found, list | tuple) and all(isinstance(word, str) for word in found)


def _pairs(found: object) -> bool:
    if not isinstance(found, list | tuple):
        return False
    return all(_clauses(pair) and len(pair) == 2 for pair in found)
