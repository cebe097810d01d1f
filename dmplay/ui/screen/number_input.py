"""A number that the player types or changes by steps before Enter plays it."""

from collections.abc import Callable
from contextlib import suppress

from dmplay.core.spaces import Interval
from dmplay.errors import DmplayError
from dmplay.game.game import Game

NUMBER_KEYS = frozenset("0123456789.-")
NO_NUMBER_MESSAGE = "type a number first"


class NumberInput:
    """The text of a number that the player is entering."""

    def __init__(self) -> None:
        self.text = ""
        # whether the text was chosen by steps or refused; a digit then replaces it
        self._is_replaceable = False

    def handle_key(self, game: Game, key: str) -> bool:
        """Handle a key that types, steps or erases the number; return whether the key was used.

        Esc erases it and does not count as used. Enter counts as used if actions are typed numbers:
        with an empty text there is nothing to play.
        """
        keyboard = game.keyboard
        if key in keyboard.number_steps:
            self.text = self._change_by_step(game, keyboard.number_steps[key])
            self._is_replaceable = True
        elif keyboard.is_number_entry(game.viewing_seat) and key in NUMBER_KEYS:
            self._append(key)
        elif key == "backspace" and self.text:
            self.text = self.text[:-1]
        else:
            self.text = "" if key == "escape" else self.text
            return key == "enter" and keyboard.is_number_entry(game.viewing_seat)
        return True

    def type_other_key(self, game: Game, key: str) -> bool:
        """Type a character that no number has, so that Enter refuses the text as it was typed.

        Return False if no number is typed here, or if a letter would begin it.
        """
        character = " " if key == "space" else key
        is_typed = len(character) == 1 and (self.text != "" or not character.isalpha())
        if is_typed := is_typed and game.keyboard.is_number_entry(game.viewing_seat):
            self._append(character)
        return is_typed

    def submit_text(self, play: Callable[[str], None]) -> None:
        """Call a function with the text and clear it; if an error is raised, the text stays."""
        text, self.text = self.text, ""
        try:
            play(text)
        except DmplayError:
            self.text, self._is_replaceable = text, True
            raise

    def describe_input(self, game: Game, effect: str) -> str:
        """Describe the number and the effect of Enter, or the error in the number.

        If several people play, say only that there is one.
        """
        if len(game.human_seats) > 1:
            return f"the number is hidden   {effect}"
        try:
            if self.text:
                return f"{self.text}{self._describe_action(game)}   {effect}"
            return NO_NUMBER_MESSAGE
        except DmplayError as error:
            return f"{self.text}: expected {str(error).partition('expected ')[2]}"

    def read_action(self, game: Game) -> float | None:
        """Return the action of the typed number; None if it is not legal or several people play."""
        with suppress(DmplayError):
            if self.text and len(game.human_seats) == 1:
                return game.keyboard.parse_action(game.view(), self.text)
        return None

    def _describe_action(self, game: Game) -> str:
        """Describe the action by its expected reward, or by its name if written otherwise."""
        action = game.keyboard.parse_action(game.view(), self.text)
        name = game.session.format_action(game.viewing_seat, action)
        name_note = f" = {name}" if float(self.text) != float(name) else ""
        return name_note + game.describe_expected_reward(action)

    def _append(self, character: str) -> None:
        """Append a character to the text, or begin a new text if this one is replaceable."""
        self.text = ("" if self._is_replaceable else self.text) + character
        self._is_replaceable = False

    def _change_by_step(self, game: Game, step: float) -> str:
        """Return the number, or else the last action, changed by `step` within the bounds, as text.

        Before the first turn, an untyped whole number starts in the middle of the range.
        """
        actions, view = game.problem.actions[game.viewing_seat], game.view()
        last_action = "0"
        if view.turns_played:
            last_action = game.problem.format_action(game.viewing_seat, view.actions[-1])
        try:
            value = float(self.text or last_action)
        except ValueError:
            value = 0.0
        if isinstance(actions, Interval):
            return f"{min(max(value + step, actions.low), actions.high):.9g}"
        numbers = [int(label) for label in actions]
        is_first_number = not self.text and not view.turns_played
        value = numbers[len(numbers) // 2] if is_first_number else value + step
        return str(int(min(max(value, numbers[0]), numbers[-1])))
