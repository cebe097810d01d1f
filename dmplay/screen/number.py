"""A number that is typed or nudged on the screen before Enter plays it."""

from contextlib import suppress

from dmplay.core import Interval
from dmplay.errors import DmplayError
from dmplay.game.game import Game

DIGITS = frozenset("0123456789.-")
NONE = "no number is written yet"


class Number:
    """What is written of a number so far."""

    def __init__(self) -> None:
        self.text = ""

    def press(self, game: Game, key: str) -> bool:
        """Writes, nudges, takes back, or has nothing to play; False if the key does none of it."""
        keyboard = game.keyboard
        if key in keyboard.nudges:
            self.text = self._nudged(game, keyboard.nudges[key])
        elif keyboard.types_numbers(game.watcher) and key in DIGITS:
            self.text += key
        elif key == "backspace" and self.text:
            self.text = self.text[:-1]
        else:
            return key == "enter" and keyboard.types_numbers(game.watcher)
        return True

    def shown(self, game: Game) -> str:
        """The number; where another person must not read it, nothing but that it is one."""
        if len(game.people) > 1:
            return "a hidden number   Enter plays it"
        try:
            return f"{self.text}{self._meaning(game)}   Enter plays it" if self.text else NONE
        except DmplayError as error:
            return f"{self.text}: expected {str(error).partition('expected ')[2]}"

    def action(self, game: Game) -> float | None:
        """The action that is written, if it is one and everybody may see it."""
        with suppress(DmplayError):
            if self.text and len(game.people) == 1:
                return game.keyboard.read(game.view(), self.text)
        return None

    def _meaning(self, game: Game) -> str:
        """What the action costs, if a view says; else which it is, if written otherwise."""
        action = game.keyboard.read(game.view(), self.text)
        name = game.session.action_name(game.watcher, action)
        other = f", that is {name}" if float(self.text) != float(name) else ""
        return game.price(action) or other

    def taken(self) -> str:
        """What was written; nothing is from now on."""
        text, self.text = self.text, ""
        return text

    def _nudged(self, game: Game, step: float) -> str:
        """The number written, or the last one played, moved by a step within its bounds."""
        actions, view = game.problem.actions[game.watcher], game.view()
        last = game.problem.action_name(game.watcher, view.actions[-1]) if view.turn else "0"
        try:
            value = float(self.text or last)
        except ValueError:
            value = 0.0
        if isinstance(actions, Interval):
            return f"{min(max(value + step, actions.low), actions.high):.9g}"
        numbers = [int(label) for label in actions]
        fresh = not self.text and not view.turn
        value = numbers[len(numbers) // 2] if fresh else value + step
        return str(int(min(max(value, numbers[0]), numbers[-1])))
