"""Two people before the screen, one after the other: all that is shown to one, or to both."""

from collections.abc import Iterator, Sequence
from itertools import product

from dmplay.game.game import Game
from tests.privacy.fronts import FILE, Looked, Told
from tests.privacy.pairs import LOOKED_AT, TURNS, Pair, Side


def keys(game: Game, action: int) -> Iterator[str]:
    """The keys that play an action."""
    label = game.problem.actions[game.viewing_seat].labels[action]
    if game.keyboard.is_number_entry(game.viewing_seat):
        yield from (*label, "enter")
    else:
        yield next(
            key
            for key, name, _ in game.keyboard.list_actions_with_keys(game.view())
            if name == label
        )


def sat(twins: Pair, side: Side, asked: Sequence[str]) -> list[Told]:
    """What both people are shown while this seat, or nobody, may look; it asks before its last."""
    game = twins.begun(side, FILE, alone=False)
    looked = Looked(game)
    heard: list[Told] = []

    def press(key: str) -> None:
        looked.handle_key(key)
        seen = looked.heard[-1]._replace(done="a hidden key")
        others = (
            game.has_private_views
            and not looked.screen.controller.awaiting_handover
            and game.viewing_seat != twins.seat_index
        )
        if not others and [seen] != heard[-1:]:
            heard.append(seen)

    for turn, who in product(range(TURNS), range(len(side.actions[0]))):
        if looked.screen.controller.awaiting_handover:
            press("enter")
        if (turn, who) == (LOOKED_AT, twins.seat_index):
            looked.heard.clear()
            for line in asked:
                looked.do(line)
            heard += looked.heard
            assert game.choosing_seat == twins.seat_index
        if turn < LOOKED_AT or who == 0:  # the last choice ends the game
            for key in keys(game, side.actions[turn][who]):
                press(key)
    return heard
