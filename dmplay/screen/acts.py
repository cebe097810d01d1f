"""What is done on the play screen: actions, looks ahead, real time, agents' turns, typed lines."""

from dmplay.describe import counted
from dmplay.screen.modes import Event, Mode
from dmplay.screen.motion import LASTS
from dmplay.screen.screen import Screen
from dmplay.words.commands import Leave, own_parts, typed
from dmplay.words.game_commands import foresee

SLOWEST, FASTEST = 0.1, 50.0  # turns a second
ENDED = "the game is over"
MANY = 20  # turns that nobody wants to lose by one key


def act(screen: Screen, action: float, seat: int | None = None) -> None:
    """Plays an action, or shows what it may bring; in real time, keeps it for the clock."""
    game = screen.game
    if screen.modes.shows is Mode.AHEAD:
        mine = seat in (None, game.watcher)
        screen.message = foresee(game, action) if mine else "another's key"
        screen.foretold = screen.message if mine else ""
        return
    if screen.rate:
        screen.clock.held = action
        start_clock(screen)
        return
    played = game.choose(action, seat)
    screen.note()
    if played:
        _move(screen)
    if not (played or game.private or game.waiting is None):  # a curtain tells it in private
        name = game.problem.agents[game.waiting]
        screen.message = f"{name} chooses; the other choice stays hidden until both are in"


def look_ahead(screen: Screen) -> None:
    """Asks for an action, to show what it may bring."""
    game = screen.game
    game.may_help("whatif")
    if game.waiting is None:
        screen.message = f"what if: {ENDED if game.session.over else 'nobody chooses here'}"
    elif screen.rate:
        screen.message = "what if: the clock runs"
    else:
        screen.modes.happens(Event.ASKED)
        screen.message = "what if: press an action, Enter then plays it, Esc leaves"


def start_clock(screen: Screen) -> None:
    """Lets real time begin, once."""
    screen.message = screen.clock.start(len(screen.game.session.turns)) or screen.message


def pace(screen: Screen) -> float:
    """Beats of the clock a second."""
    return screen.clock.pace(len(screen.game.session.turns))


def tick(screen: Screen) -> None:
    """A beat of the clock in real time: it counts down, then the last push repeats."""
    if screen.modes.moves is not Mode.CLOCK or screen.game.waiting is None:
        return
    told = screen.clock.counted()
    if told is not None:
        screen.message = told
    elif screen.clock.held is not None:
        with screen.caught():
            screen.game.choose(screen.clock.held)
            screen.note()


def pause(screen: Screen) -> None:
    """Lets agents play or stops them; stops the clock of real time or lets it go on."""
    game = screen.game
    if game.session.over:
        screen.message = ENDED
    elif not game.people and not screen.terminal.motion:
        screen.message = "nothing moves by itself; Space steps on, :auto plays to the end"
    elif game.people and not screen.rate:
        screen.message = "the game waits for you; there is nothing to pause"
    else:
        moving = screen.modes.moves in (Mode.AUTO, Mode.CLOCK)
        screen.modes.happens(Event.HALTED if moving else Event.LET_GO)
        screen.message = "paused; P goes on" if moving else ""


def step(screen: Screen) -> None:
    """A turn of a game without people."""
    session = screen.game.session
    if session.over:
        screen.message = ENDED
        return
    before = len(session.turns)
    screen.game.unattended()
    screen.note()
    if len(screen.game.session.turns) > before and screen.speed * LASTS < 1:
        _move(screen)


def _move(screen: Screen) -> None:
    """Has the last turn seen to happen, where its view can draw that and things may move."""
    if screen.terminal.motion and getattr(screen.game.style, "MOVES", False):
        screen.motion.begin()


def autoplay(screen: Screen) -> None:
    """A turn of a game that plays by itself; an error stops it."""
    screen.modes.happens(Event.HALTED)
    with screen.caught():
        step(screen)
        screen.modes.happens(Event.LET_GO)


def quicken(screen: Screen, times: float) -> None:
    """Lets agents play so many times as fast."""
    screen.speed = min(max(screen.speed * times, SLOWEST), FASTEST)
    screen.message = f"{counted(screen.speed, 'turn', '.3g')} a second"


def obey(screen: Screen, line: str) -> None:
    """Does what a line of the command row says; raises Leave."""
    screen.modes.happens(Event.CLOSED)
    with screen.caught():
        for part in own_parts(screen.table, line):
            screen.say(typed(screen.table, part))


def leave(screen: Screen) -> None:
    """Leaves the game; where many turns of it are not kept, only when asked twice."""
    recorder = screen.game.recorder
    unkept = 0 if recorder and not recorder.fault else len(screen.game.session.turns)
    if unkept <= MANY or screen.modes.shows is Mode.WARNED:
        raise Leave
    screen.modes.happens(Event.WARNED)
    screen.message = f"{unkept} turns are not kept; q once more leaves"
