"""The last row of the play screen: the keys that work now."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import lru_cache, partial
from typing import NamedTuple

from rich.text import Text

from dmplay.draw.options import BEST_LABEL, EQUALLY_GOOD_LABEL
from dmplay.draw.theme import BAR_LEVELS
from dmplay.game.game import Game
from dmplay.game.hints.hint_provider import Hint, choose_hint_decimals, format_fixed
from dmplay.game.key_bindings import KEY_SYMBOLS
from dmplay.game.playback import Playback
from dmplay.ui.screen.frame_state import EMPTY_FRAME_STATE, FrameState, Viewport, fit_text
from dmplay.ui.screen.post_game_timeline import GameTimeline
from dmplay.ui.shell.commands import find_command

COMMAND_KEY_HELP = ": command"
HINT_KEY_HELP = "Tab hint"
WHY_KEY_HELP = "Tab why"  # after a hint; Y does the same without one, but y is an action on maps
LEARN_KEY = "M learn"
GAME_OVER_KEYS = (
    ("new", "restart", "undo", "help", "quit"),
    ("new", "restart", "help", "quit"),
    ("new", "help", "quit"),
    ("help", "quit"),
)
COMMAND_KEYS = (
    ("hint", "whatif", "undo", "help", "quit"),
    ("hint", "undo", "help", "quit"),
    ("hint", "help", "quit"),
    ("help", "quit"),
)
# whether a row of action keys has their names, bars and numbers, if a hint ranks the actions
RANKED_KEY_FORMS = (
    (True, True, True),
    (True, False, True),
    (True, False, False),
    (False, True, False),
)
SHORT_LABEL_COLUMNS = (7, 4)  # maximum label columns to try when the full labels do not fit


class ActionKey(NamedTuple):
    """A key that plays an action: the action's label, legality, regret and effect as text."""

    key: str
    label: str
    is_legal: bool
    regret_text: str = ""
    effect: str = ""
    has_brackets: bool = True  # around the effect

    @property
    def text(self) -> str:
        """The key, label and regret between blanks; of an illegal action only a known effect."""
        key = KEY_SYMBOLS.get(self.key, self.key)
        label = key if self.key == self.label else "=".join(filter(None, (key, self.label)))
        if not self.is_legal:
            return f" ({label} {self.effect}) " * bool(self.effect)
        effect = f"({self.effect})" if self.has_brackets else self.effect
        return f" {label}{f' {effect}' * bool(self.effect)}{self.regret_text} "


def format_footer(
    game: Game, viewport: Viewport, frame_state: FrameState = EMPTY_FRAME_STATE
) -> Text:
    """Return the footer row: the game's action keys, then the command keys.

    The help and quit keys are always included. Before a handover it has only Enter and quit, and
    in a picture no command.
    """
    if frame_state.handover_agent:
        return fit_text(Text(" Enter shows the board  q quit"), viewport)
    if game.open_question and game.predictor:
        keys = f" Enter {game.predictor.verb}  Esc skips  Bksp erases, or undoes"
        return fit_text(Text(keys), viewport)
    if frame_state.is_picture:  # A hint's ranking of the actions stays.
        is_ranked = frame_state.hint and game.choosing_seat is not None
        forms = _iter_key_rows(game, frame_state.hint, 0) if is_ranked else [Text("")]
        return _join_fitting_keys(forms, [""], viewport)
    # A replayed transcript never counts as over, because the player can step back in it.
    has_ended = game.request is not None and game.session.over
    uses_game_over_keys = bool(frame_state.is_lookback or has_ended)
    is_choosing = game.choosing_seat is not None
    skipped_count = 0 if uses_game_over_keys else 3 if game.hints_forbidden else not is_choosing
    can_undo = frame_state.is_lookback or game.has_choice_to_undo
    excluded_command = "undo" * bool(game.undo_forbidden_reason or not can_undo)
    navigation_keys = _navigation_keys(game, frame_state, is_game_over=has_ended)
    format_tails = partial(
        _format_command_tails,
        skipped_count=skipped_count,
        excluded_command=excluded_command,
        is_game_over=uses_game_over_keys,
        has_hint=frame_state.hint is not None,
    )
    command_rows = format_tails(navigation_keys)
    if LEARN_KEY in navigation_keys:  # left out if not all of the other keys fit beside it
        others = tuple(key for key in navigation_keys if key != LEARN_KEY)
        command_rows = (*command_rows[:-1], *format_tails(others))
    if is_choosing:
        hint_row = next((row for row in reversed(command_rows) if HINT_KEY_HELP in row), "")
        columns = viewport.width - len(hint_row) - 1
        forms = _iter_key_rows(game, frame_state.hint, columns)
        return _join_fitting_keys(forms, command_rows, viewport)
    return _format_commands_only(command_rows, viewport)


def format_page_footer(page_index: int, page_count: int, viewport: Viewport) -> Text:
    """Return the footer row of a long message: the keys that turn its pages and close it."""
    next_key = "Space next  " * (page_index < page_count - 1)
    previous_key = "PgUp back  " * (page_index > 0)
    return fit_text(Text(f" {next_key}{previous_key}Esc close", style="dim"), viewport)


@lru_cache(64)
def _format_commands_only(command_rows: tuple[str, ...], viewport: Viewport) -> Text:
    """Return the footer with only the command keys."""
    return _join_fitting_keys([Text("")], command_rows, viewport)


def _join_fitting_keys(
    forms: Iterable[Text], command_rows: Sequence[str], viewport: Viewport
) -> Text:
    """Join the first form of the action keys that fits with the fullest command keys that fit.

    If no form fits, the last one is cut with an ellipsis.
    """
    available, row = viewport.width - len(command_rows[-1]) - 1, Text()
    for row in forms:
        if len(row.plain) <= available:
            break
    if len(row.plain) > available > 1:
        row.truncate(available - 1, overflow="ellipsis")
        row.append(" ")
    command_row = next(
        (
            command_row
            for command_row in command_rows
            if len(row.plain) + 1 + len(command_row) <= viewport.width
        ),
        command_rows[-1],
    )
    return fit_text(row.append(" ").append(command_row, style="dim"), viewport)


def _iter_key_rows(game: Game, hint: Hint | None, effect_columns: int) -> Iterator[Text]:
    """Yield the rows of action keys, from the fullest form to the shortest.

    For typed numbers these are instructions. With a hint, rows ranked by regret come first. The
    effects of actions are in brackets unless they then need more than `effect_columns`.
    """
    if game.keyboard.is_number_entry(game.viewing_seat):
        steps = game.keyboard.describe_number_steps()
        recommendation = f" {hint.recommended_action} {BEST_LABEL} " if hint else ""
        name = getattr(game.view_module, "NUMBER_NAME", "number")
        numbers = game.keyboard.describe_numbers(game.viewing_seat)
        for number in (f"{name} ({numbers})", name):
            yield Text(f"{recommendation} type a {number}, Enter plays it  {steps} ")
            yield Text(f"{recommendation} type a {number}, Enter  {steps} ")
        yield Text(f"{recommendation} type a {name}, Enter plays it ")
        yield Text(f"{recommendation} a {name}, Enter ")
    else:
        legal = [
            ActionKey(*action_key)
            for action_key in game.keyboard.list_actions_with_keys(game.view())
        ]
        yield from (_join_keys(ranked) for ranked in _iter_ranked_keys(legal, hint))
        describe_keys = getattr(game.view_module, "describe_keys", None)
        effects: Mapping[str, str] = describe_keys(game.view()) if describe_keys else {}
        with_effects = [key._replace(effect=effects.get(key.label, "")) for key in legal]
        row = _join_keys(with_effects)
        yield from [row] * (len(row.plain) <= effect_columns)
        yield _join_keys(key._replace(has_brackets=False) for key in with_effects)
        yield _join_keys(legal)
        for max_width in (*SHORT_LABEL_COLUMNS, 0):
            short_keys = [
                action_key._replace(label=_truncate_label(action_key.label, max_width))
                for action_key in legal
            ]
            # The shortened labels must stay distinct.
            if not max_width or len({action_key.label for action_key in short_keys}) == len(
                short_keys
            ):
                yield _join_keys(short_keys)


def _truncate_label(label: str, max_width: int) -> str:
    """Return a label cut to at most `max_width` columns with an ellipsis; '' if the width is 0."""
    return label if len(label) <= max_width else f"{label[: max_width - 1]}…" if max_width else ""


def _join_keys(actions: Iterable[ActionKey]) -> Text:
    """Join the texts of action keys into one row."""
    row = Text()
    for action in actions:
        start = len(row.plain) + 1
        row.append(action.text, "" if action.is_legal else "dim")
        if action.is_legal and action.label != action.key:
            row.stylize("bold", start, start + len(KEY_SYMBOLS.get(action.key, action.key)))
    return row


def _iter_ranked_keys(actions: Sequence[ActionKey], hint: Hint | None) -> Iterator[list[ActionKey]]:
    """Yield the legal actions ranked by regret, best first, each with its regret as a bar.

    Yield nothing if the hint has no regrets.
    """
    ranking = hint.ranked_actions if hint else []
    if not ranking or hint is None or hint.values is None:
        return
    max_regret = ranking[-1][1]
    decimals = choose_hint_decimals([regret for _, regret in ranking], hint.values.scale)
    for with_names, with_bars, with_numbers in RANKED_KEY_FORMS:
        if not (with_names or max_regret):
            continue  # among equals, the names of the keys tell more
        ranked = []
        for action, regret in ranking:
            is_equally_good = with_names and hint.action not in {None, action}
            regret_text = f" {EQUALLY_GOOD_LABEL if is_equally_good else BEST_LABEL}"
            if regret:
                level = min(int(len(BAR_LEVELS) * regret / max_regret), len(BAR_LEVELS) - 1)
                bar = BAR_LEVELS[level] * with_bars
                number = format_fixed(-regret, decimals) * with_numbers
                regret_text = f" {bar}{number}".rstrip()
            label = actions[action].label if with_names else ""
            ranked.append(actions[action]._replace(label=label, regret_text=regret_text))
        yield ranked


@lru_cache(64)
def _format_command_tails(
    navigation_keys: tuple[str, ...],
    skipped_count: int,
    excluded_command: str,
    *,
    is_game_over: bool,
    has_hint: bool,
) -> tuple[str, ...]:
    """Return the command keys as texts, from the fullest row to the shortest.

    The `navigation_keys` come first, and the last of them are left out first. `excluded_command` is
    left out, and the first `skipped_count` rows are not used. With a hint, its key explains it.
    """
    rows = (GAME_OVER_KEYS if is_game_over else COMMAND_KEYS)[skipped_count:]
    command_rows = [
        [
            WHY_KEY_HELP if name == "hint" and has_hint else _format_command_key(name)
            for name in row
            if name != excluded_command
        ]
        for row in rows
    ]
    tails = []
    for index, command_row in enumerate(command_rows):
        row = "  ".join([*navigation_keys, *command_row])
        tails.append(f"{row}  {COMMAND_KEY_HELP}")
        if is_game_over or index:
            tails.append(row)
    last_row = command_rows[-1]
    counts = range(max(len(navigation_keys) - 1, 0), -1, -1)
    return (*tails, *("  ".join([*navigation_keys[:count], *last_row]) for count in counts))


def _navigation_keys(game: Game, frame_state: FrameState, *, is_game_over: bool) -> tuple[str, ...]:
    """Return the keys of a replay, a finished game, a game of agents alone, or the clock."""
    if frame_state.is_lookback:
        # Where the only costly turn comes next, the key would do nothing.
        costly_turns = game.worst_turns if isinstance(game, GameTimeline) else []
        worst = ["X worst"] * any(turn != len(game.session.turns) + 1 for turn in costly_turns)
        why = [WHY_KEY_HELP] * (frame_state.hint is not None)
        return ("← → turns", *worst, *why, *["Enter play on"] * (not game.strict))
    if game.lesson_goal and game.session.over:
        return ("Enter back to the lesson",)
    if game.human_seats and not (game.session.over and game.session.turns):
        return frame_state.clock_keys
    if game.human_seats:
        worst = ["X worst"] * bool(game.verdict.costly_choices)
        return "Enter look back", "PgUp log", *worst, *[LEARN_KEY] * game.has_known_mistakes
    if isinstance(game, Playback):
        return "← → turns", "P play", *filter(None, [frame_state.worst_key]), "Enter play from here"
    return () if is_game_over else ("Space step", "P play")


def _format_command_key(command_name: str) -> str:
    """Return the key and name of a command, such as 'Bksp undo'."""
    return f"{find_command(command_name).key_label} {command_name}"
