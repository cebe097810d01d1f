"""A number that is typed or nudged on the screen before Enter plays it."""

from contextlib import suppress

from dmplay.core import Interval
from dmplay.errors import DmplayError
from dmplay.game.game import Game

NUMBER_KEYS = frozenset("0123456789.-")
NO_NUMBER_MESSAGE = "no number is written yet"


class NumberInput:
    """What is written of a number so far."""

    def __init__(self) -> None:
        self.text = ""

    def handle_key(self, game: Game, key: str) -> bool:
        """Writes, nudges, takes back, or has nothing to play; False if the key does none of it."""
        keyboard = game.keyboard
        if key in keyboard.number_steps:
            self.text = self._nudge(game, keyboard.number_steps[key])
        elif keyboard.is_number_entry(game.viewing_seat) and key in NUMBER_KEYS:
            self.text += key
        elif key == "backspace" and self.text:
            self.text = self.text[:-1]
        else:
            return key == "enter" and keyboard.is_number_entry(game.viewing_seat)
        return True

    def describe_input(self, game: Game) -> str:
        """The number; where another person must not read it, nothing but that it is one."""
        if len(game.human_seats) > 1:
            return "a hidden number   Enter plays it"
        try:
            return (
                f"{self.text}{self._describe_action(game)}   Enter plays it"
                if self.text
                else NO_NUMBER_MESSAGE
            )
        except DmplayError as error:
            return f"{self.text}: expected {str(error).partition('expected ')[2]}"

    def read_action(self, game: Game) -> float | None:
        """The action that is written, if it is one and everybody may see it."""
        with suppress(DmplayError):
            if self.text and len(game.human_seats) == 1:
                return game.keyboard.parse_action(game.view(), self.text)
        return None

    def _describe_action(self, game: Game) -> str:
        """What the action costs, if a view says; else which it is, if written otherwise."""
        action = game.keyboard.parse_action(game.view(), self.text)
        name = game.session.format_action(game.viewing_seat, action)
        other = f", that is {name}" if float(self.text) != float(name) else ""
        return game.describe_expected_reward(action) or other

    def take_text(self) -> str:
        """What was written; nothing is from now on."""
        text, self.text = self.text, ""
        return text

    def _nudge(self, game: Game, step: float) -> str:
        """The number written, or the last one played, moved by a step within its bounds."""
        actions, view = game.problem.actions[game.viewing_seat], game.view()
        last = (
            game.problem.format_action(game.viewing_seat, view.actions[-1])
            if view.turns_played
            else "0"
        )
        try:
            value = float(self.text or last)
        except ValueError:
            value = 0.0
        if isinstance(actions, Interval):
            return f"{min(max(value + step, actions.low), actions.high):.9g}"
        numbers = [int(label) for label in actions]
        fresh = not self.text and not view.turns_played
        value = numbers[len(numbers) // 2] if fresh else value + step
        return str(int(min(max(value, numbers[0]), numbers[-1])))
