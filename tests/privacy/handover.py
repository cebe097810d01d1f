"""Two people who take turns at one screen: everything that is shown to one of them or to both."""

from collections.abc import Iterator, Sequence
from itertools import product

from dmplay.game.game import Game
from tests.privacy.front_ends import TRANSCRIPT_PATH, RecordedScreen, Response
from tests.privacy.indistinguishable_pairs import SHARED_TURNS, TURN_COUNT, Pair, Side


def iter_keys(game: Game, action: int) -> Iterator[str]:
    """Yield the keys that play an action."""
    label = game.problem.actions[game.viewing_seat].labels[action]
    if game.keyboard.is_number_entry(game.viewing_seat):
        yield from (*label, "enter")
    else:
        yield next(
            key
            for key, name, _ in game.keyboard.list_actions_with_keys(game.view())
            if name == label
        )


def play_handover(twins: Pair, side: Side, queries: Sequence[str]) -> list[Response]:
    """Return the responses shown while this seat, or neither person, may look.

    The queries are typed before the last turn of this seat.
    """
    game = twins.begun(side, TRANSCRIPT_PATH, alone=False)
    recorded = RecordedScreen(game)
    responses: list[Response] = []

    def press(key: str) -> None:
        recorded.handle_key(key)
        response = recorded.heard[-1]._replace(done="a hidden key")
        only_other_looks = (
            game.has_private_views
            and not recorded.screen.controller.awaiting_handover
            and game.viewing_seat != twins.seat_index
        )
        if not only_other_looks and [response] != responses[-1:]:
            responses.append(response)

    for turn, seat in product(range(TURN_COUNT), range(len(side.actions[0]))):
        if recorded.screen.controller.awaiting_handover:
            press("enter")
        if (turn, seat) == (SHARED_TURNS, twins.seat_index):
            recorded.heard.clear()
            for line in queries:
                recorded.do(line)
            responses += recorded.heard
            assert game.choosing_seat == twins.seat_index
        if turn < SHARED_TURNS or seat == 0:  # the last choice ends the game
            for key in iter_keys(game, side.actions[turn][seat]):
                press(key)
    return responses
