"""The last row of the screen: the keys that count now."""

from collections.abc import Iterable, Iterator, Sequence
from functools import cache, lru_cache
from itertools import product
from typing import NamedTuple

from rich.text import Text

from dmplay.advice.adviser import Hint, count_fewest_decimals, format_fixed
from dmplay.game.game import Game
from dmplay.keys.keymap import KEY_SYMBOLS
from dmplay.screen.shown import EMPTY_FRAME_STATE, FrameState, Viewport, fit_text
from dmplay.views.canvas import BAR_LEVELS
from dmplay.views.style import BEST_LABEL, EQUALLY_GOOD_LABEL
from dmplay.words.commands import find_command

COMMAND_KEY_HELP = ": command"
GAME_OVER_KEYS = (
    ("new", "restart", "undo", "help", "quit"),
    ("new", "help", "quit"),
    ("help", "quit"),
)
COMMAND_KEYS = (
    ("hint", "whatif", "undo", "help", "quit"),
    ("hint", "undo", "help", "quit"),
    ("hint", "help", "quit"),
    ("help", "quit"),
)
SHORT_LABEL_COLUMNS = (7, 4)  # columns of a label where not all have room


class ActionKey(NamedTuple):
    """A key that plays: how it is shown, its action, whether it is legal, what is lost by it."""

    key: str
    label: str
    is_legal: bool
    regret_text: str = ""

    @property
    def text(self) -> str:
        """Key, action and loss between blanks; in their place brackets where it is not legal."""
        key = KEY_SYMBOLS.get(self.key, self.key)
        told = self.label if self.key == self.label else f"{key} {self.label}".strip()
        return f" {told}{self.regret_text} " if self.is_legal else f"[{told}]"


def format_footer(
    game: Game, viewport: Viewport, frame_state: FrameState = EMPTY_FRAME_STATE
) -> Text:
    """The keys that count now, the game's before the shell's; help and quit are always there."""
    if frame_state.handover_agent:
        return fit_text(Text(" Enter shows the board  q quit"), viewport)
    # A recording is never over: one goes back in it.
    ended = game.request is not None and game.session.over
    over, waits = bool(frame_state.is_lookback or ended), game.choosing_seat is not None
    unneeded = 0 if over else 3 if game.hints_forbidden else not waits
    barred = "undo" * bool(game.undo_forbidden_reason)
    tails = _format_command_tails(
        _navigation_keys(game, frame_state, is_game_over=ended), unneeded, barred, is_game_over=over
    )
    return (
        _fit_footer(_iter_key_rows(game, frame_state.hint), tails, viewport)
        if waits
        else _format_commands_only(tails, viewport)
    )


@lru_cache(16)
def _format_commands_only(command_rows: Sequence[str], viewport: Viewport) -> Text:
    """The shell's keys alone; nobody writes into the row."""
    return _fit_footer([Text("")], command_rows, viewport)


def _fit_footer(forms: Iterable[Text], command_rows: Sequence[str], viewport: Viewport) -> Text:
    """The first form that there is room for, else the last, and as many of the shell's keys."""
    left, row = viewport.width - len(command_rows[-1]) - 1, Text()
    for row in forms:
        if len(row.plain) <= left:
            break
    if len(row.plain) > left > 1:
        row.truncate(left - 1, overflow="ellipsis")
        row.append(" ")
    tail = next(
        (tail for tail in command_rows if len(row.plain) + 1 + len(tail) <= viewport.width),
        command_rows[-1],
    )
    return fit_text(row.append(" ").append(tail, style="dim"), viewport)


def _iter_key_rows(game: Game, hint: Hint | None) -> Iterator[Text]:
    """The keys that play, in words and in fewer."""
    if game.keyboard.is_number_entry(game.viewing_seat):
        nudges = " ".join(KEY_SYMBOLS.get(key, key) for key in game.keyboard.number_steps)
        best = f" {hint.recommended_action} {BEST_LABEL} " if hint else ""
        yield Text(f"{best} type a number, Enter plays it  {nudges} nudge it ")
        yield Text(f"{best} a number, Enter ")
    else:
        legal = [ActionKey(*one) for one in game.keyboard.list_actions_with_keys(game.view())]
        yield from (_join_keys(ranked) for ranked in _iter_ranked_keys(legal, hint))
        yield _join_keys(legal)
        for most in (*SHORT_LABEL_COLUMNS, 0):
            cut = [one._replace(label=_truncate_label(one.label, most)) for one in legal]
            if not most or len({one.label for one in cut}) == len(cut):  # tells them apart
                yield _join_keys(cut)


def _truncate_label(label: str, max_width: int) -> str:
    return label if len(label) <= max_width else f"{label[: max_width - 1]}…" if max_width else ""


def _join_keys(actions: Sequence[ActionKey]) -> Text:
    return Text("".join(action.text for action in actions))


def _iter_ranked_keys(actions: Sequence[ActionKey], hint: Hint | None) -> Iterator[list[ActionKey]]:
    """The legal actions, the best first, each with what it loses as a bar, with names or numbers
    or both or neither.
    """
    both = hint.ranked_actions if hint else []
    if not both or hint is None:
        return
    most, places = both[-1][1], count_fewest_decimals([loss for _, loss in both])
    for numbers, names in product((True, False), repeat=2):
        ranked = []
        for number, loss in both:
            equal = names and hint.action not in {None, number}
            lost = f" {EQUALLY_GOOD_LABEL if equal else BEST_LABEL}"
            if loss:
                bar = BAR_LEVELS[min(int(len(BAR_LEVELS) * loss / most), len(BAR_LEVELS) - 1)]
                lost = f" {bar}{format_fixed(-loss, places) if numbers else ''}"
            label = actions[number].label if names else ""
            ranked.append(actions[number]._replace(label=label, regret_text=lost))
        yield ranked


@lru_cache(16)
def _format_command_tails(
    navigation_keys: Sequence[str], skipped_count: int, excluded_command: str, *, is_game_over: bool
) -> tuple[str, ...]:
    """The shell's keys but one, most of them first, but for so many of these rows."""
    rows = (GAME_OVER_KEYS if is_game_over else COMMAND_KEYS)[skipped_count:]
    names = [[name for name in row if name != excluded_command] for row in rows]
    tails = [
        "  ".join([*navigation_keys, *map(_format_command_key, some), COMMAND_KEY_HELP])
        for some in names
    ]
    tails += ["  ".join([*navigation_keys, *map(_format_command_key, names[-1])])]
    return (*tails, "  ".join(map(_format_command_key, names[-1])))


def _navigation_keys(game: Game, frame_state: FrameState, *, is_game_over: bool) -> tuple[str, ...]:
    """The keys that lead through a game nobody plays, or that is over."""
    if frame_state.is_lookback:
        return ("← → turns", *["Enter plays on"] * (not game.strict))
    if game.human_seats:
        return ("Enter looks back",) * bool(game.session.over and game.session.turns)
    return () if is_game_over else ("Space step", "P play")


@cache
def _format_command_key(command_name: str) -> str:
    return f"{find_command(command_name).key_label} {command_name}"
