"""A number that the player types or changes by steps before Enter plays it."""

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
        self._is_stepped = False  # whether the text was chosen by steps; a digit then replaces it

    def handle_key(self, game: Game, key: str) -> bool:
        """Handle a key that types, steps or erases the number; return whether the key was used.

        Enter counts as used if actions are typed numbers: with an empty text there is nothing to
        play.
        """
        keyboard = game.keyboard
        if key in keyboard.number_steps:
            self.text, self._is_stepped = self._nudge(game, keyboard.number_steps[key]), True
        elif keyboard.is_number_entry(game.viewing_seat) and key in NUMBER_KEYS:
            self.text, self._is_stepped = ("" if self._is_stepped else self.text) + key, False
        elif key == "backspace" and self.text:
            self.text = self.text[:-1]
        else:
            return key == "enter" and keyboard.is_number_entry(game.viewing_seat)
        return True

    def describe_input(self, game: Game, effect: str) -> str:
        """Describe the number and the effect of Enter, or the error in the number.

        If several people play, say only that there is one.
        """
        if len(game.human_seats) > 1:
            return f"the number is hidden   {effect}"
        try:
            return (
                f"{self.text}{self._describe_action(game)}   {effect}"
                if self.text
                else NO_NUMBER_MESSAGE
            )
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

    def take_text(self) -> str:
        """Return the text of the number and clear it."""
        text, self.text = self.text, ""
        return text

    def _nudge(self, game: Game, step: float) -> str:
        """Return the number, or else the last action, changed by `step` within the bounds, as text.

        Before the first turn, an untyped whole number starts in the middle of the range.
        """
        actions, view = game.problem.actions[game.viewing_seat], game.view()
        last_action = (
            game.problem.format_action(game.viewing_seat, view.actions[-1])
            if view.turns_played
            else "0"
        )
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
