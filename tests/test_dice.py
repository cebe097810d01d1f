"""The draws of a seed: the same bits whether thrown turn by turn or many turns together."""

import numpy as np
import pytest

from dmplay.dice import (
    LONG_BATCH_TURNS,
    SHORT_BATCH_TURNS,
    SHORT_GAME_TURNS,
    SeededUniforms,
    generate_uniforms,
)

LATE = 2**31


SEEDS = [0, 3, 2**31, 2**32, 2**63 - 1, 2**127, 2**128, 2**200 + 7]


@pytest.mark.parametrize("seed", SEEDS)
def test_dice_are_those_of_numpys_seeds_cut_to_nine_decimals(seed: int) -> None:
    for stream, turn, reroll in [
        (0, 0, 0),
        (2, SHORT_BATCH_TURNS - 1, 0),
        (2, SHORT_BATCH_TURNS, 0),
        (1, LATE, 0),
        (1, 5, 2),
    ]:
        bits = np.random.PCG64(np.random.SeedSequence(seed, spawn_key=(stream, turn, reroll)))
        whole = (bits.random_raw(12) >> np.uint64(11)) * 2.0**-53
        cut = (np.floor(whole * 1e9) / 1e9).reshape(6, 2)
        for first in (0, 4):
            drawn = generate_uniforms(
                seed, stream, turn, reroll=reroll, first_episode=first, rows=2, count=2
            )
            assert drawn.tolist() == cut[first : first + 2].tolist()


@pytest.mark.parametrize("count", [0, 1, 3])
def test_some_rows_have_the_dice_that_they_have_among_all(count: int) -> None:
    some = np.array([1, 4, 5])
    every = generate_uniforms(7, 1, 2, first_episode=3, rows=9, count=count)
    assert (
        generate_uniforms(
            7, 1, 2, first_episode=3, rows=9, count=count, selected_rows=some
        ).tolist()
        == every[some].tolist()
    )


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("episode", [0, 12_345_678])
def test_the_dice_of_many_turns_are_those_of_each(seed: int, episode: int) -> None:
    dice = SeededUniforms(seed, episode)
    for stream in (0, 2):
        for turn in (0, 1, SHORT_GAME_TURNS - 1, SHORT_GAME_TURNS, 99_999, 1, LATE):
            for count in (0, 1, 3, LONG_BATCH_TURNS + 1):
                drawn = dice.generate_uniforms(stream, turn, 0, count)
                alone = generate_uniforms(
                    seed, stream, turn, first_episode=episode, rows=1, count=count
                )
                assert drawn.tolist() == alone.tolist()


def test_a_reroll_has_dice_of_its_own() -> None:
    dice = SeededUniforms(7)
    first, second = (dice.generate_uniforms(0, 5, reroll, 2) for reroll in (0, 1))
    assert second.tolist() == generate_uniforms(7, 0, 5, reroll=1, rows=1, count=2).tolist()
    assert (first != second).all()


def test_who_writes_into_a_draw_changes_no_other() -> None:
    dice = SeededUniforms(7)
    was = dice.generate_uniforms(0, 1, 0, 1).tolist()
    drawn = dice.generate_uniforms(0, 1, 0, 1)
    assert drawn.base is None
    drawn[:] = 0.5
    assert dice.generate_uniforms(0, 1, 0, 1).tolist() == was


def test_dice_are_the_same_whatever_was_drawn() -> None:
    used, fresh = SeededUniforms(7), SeededUniforms(7)
    used.generate_uniforms(0, 1, 0, 1)
    assert used == fresh
    assert hash(used) == hash(fresh)
    assert repr(used) == "SeededUniforms(seed=7, episode=0)"
