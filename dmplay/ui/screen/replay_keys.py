"""The keys of a replay, and of the look back at a finished game.

They jump to a turn and to the worst choice, and play on as a person.
"""

from collections.abc import Callable

from dmplay.core.text import format_count
from dmplay.errors import BadParameter
from dmplay.game.game import Game
from dmplay.game.hints import review
from dmplay.game.playback import Playback
from dmplay.game.seats import HUMAN, list_human_seats
from dmplay.ui.screen.play_screen import PlayScreen
from dmplay.ui.screen.post_game_timeline import GameTimeline
from dmplay.ui.shell.commands import PlayerQuit, find_command

MAX_TURN_DIGITS = 9
WORST_KEY = "X"
REPLAY_HELP = (
    ("Left", "back", "in a replay: show the previous turn; Right shows the next one"),
    ("Home", "start", "in a replay: go to the start; End goes to the end"),
    ("0-9", "turn", "in a replay: type the number of a turn, then Enter"),
    (WORST_KEY, "worst", "in a replay: go to the choice with the largest regret, then the next"),
    ("M", "learn", "in a replay: look for better actions in your worst turns"),
    ("Enter", "play on", "in a replay: play on from here as a person, in a new file"),
)


def handle_replay_key(screen: PlayScreen, key: str) -> bool:
    """Handle a key that moves through a replay or plays on; return whether it was used."""
    playback = screen.game
    if not isinstance(playback, Playback):
        return False
    turn_before = len(playback.session.turns)
    if type_turn(screen, key, playback.count_turns, playback.go_to_turn):
        pass
    elif key in REPLAY_KEY_HANDLERS:
        REPLAY_KEY_HANDLERS[key](screen, playback)
    else:
        return False
    if screen.game is playback and len(playback.session.turns) != turn_before:
        screen.restart_log()
    return True


def type_turn(
    screen: PlayScreen,
    key: str,
    count_turns: Callable[[], int],
    go_to_turn: Callable[[int], object],
) -> bool:
    """Type the number of a turn, or go there with Enter; return whether the key was used.

    Any other key forgets the number. Raise BadParameter if the game has fewer turns.
    """
    typed_turn, screen.typed_turn = screen.typed_turn, ""
    if key.isascii() and key.isdecimal() and len(key) == 1:
        screen.typed_turn = (typed_turn + key)[-MAX_TURN_DIGITS:]
    elif key == "backspace" and typed_turn:
        screen.typed_turn = typed_turn[:-1]
    elif key == "enter" and typed_turn:
        turn, turn_count = int(typed_turn), count_turns()
        if turn > turn_count:
            raise BadParameter(f"turn {turn}: this game has {format_count(turn_count, 'turn')}")
        go_to_turn(turn)
        return True
    else:
        return False
    screen.message = f"turn {screen.typed_turn}: Enter goes there"
    return True


def _play_from_turn(screen: PlayScreen, playback: Playback) -> None:
    """Start a game from this turn; a person plays the first seat if agents alone played."""
    if list_human_seats(playback.player_names):
        play_again(screen, len(playback.session.turns))
    else:
        seat = playback.problem.agents[0]
        screen.show_reply(find_command("seat").run(screen.controller, f"{seat}={HUMAN}"))


def play_again(screen: PlayScreen, turn_count: int) -> None:
    """Play on as a new game from the position after so many turns."""
    screen.show_reply(find_command("branch").run(screen.controller, str(turn_count)))
    screen.message = f"turn {turn_count + 1} again, in a new game; the first one is saved"


def _go_to_worst_choice(screen: PlayScreen, playback: Playback) -> None:
    """Go to the position before the choice with the largest regret; repeated, the next largest."""
    timeline = prepare_timeline(screen, playback)
    turn = timeline.find_next_worst_turn(len(playback.session.turns) + 1)
    playback.go_to_turn(turn - 1)
    timeline.go_to_turn(turn - 1)
    screen.message = timeline.describe_next_choices()


def _leave_to_learn(screen: PlayScreen, playback: Playback) -> None:
    """Leave the replay to find better actions; raise BadParameter if no mistake is known."""
    human_seats = list_human_seats(playback.player_names)
    if not human_seats:
        raise BadParameter("M: no person played in this game")
    if not any(playback.problem.actions[seat].labels for seat in human_seats):
        raise BadParameter("M: there is no list of actions to ask for")
    timeline = prepare_timeline(screen, playback)
    if not timeline.worst_turns:
        raise BadParameter(f"M: {timeline.no_worst_turn_reason}")
    screen.learns_from_game = True
    raise PlayerQuit


def prepare_timeline(screen: PlayScreen, playback: Playback) -> GameTimeline:
    """Return the timeline of the replayed game, with the regrets of its choices.

    The seats of people are reviewed, or all seats if agents alone played.
    """
    if screen.replay_timeline is None:
        position = len(playback.session.turns)
        list(playback.iter_agent_turns())
        try:
            seats = list_human_seats(playback.player_names) or [*range(len(playback.player_names))]
            questions = [playback.advice_question(seat) for seat in seats]
            moves = review.run_review(playback.session, questions, can_sample=True)
            finished = Game(
                playback.problem_name,
                playback.session.copy_at_start(),
                playback.player_names,
                playback.keyboard,
            )
            finished.session.append_turns(playback.session.turns)
            screen.replay_timeline = GameTimeline(finished, moves, seats)
        finally:
            playback.go_to_turn(position)
    return screen.replay_timeline


def _undo_step(screen: PlayScreen, playback: Playback) -> None:
    """Go back by one turn or event."""
    playback.undo()


def _go_to_start(screen: PlayScreen, playback: Playback) -> None:
    """Go to the position before the first turn."""
    playback.go_to_start()


def _go_to_end(screen: PlayScreen, playback: Playback) -> None:
    """Play all turns that are left."""
    for _ in playback.iter_agent_turns():
        pass


REPLAY_KEY_HANDLERS = {
    "enter": _play_from_turn,
    "left": _undo_step,
    "home": _go_to_start,
    "end": _go_to_end,
    WORST_KEY: _go_to_worst_choice,
    "M": _leave_to_learn,
}
