"""Tests of the uniforms of a seed: the same bits in a session and in a batch of episodes."""

import numpy as np
import pytest

from dmplay.core.uniforms import SeededUniforms, generate_uniforms, generate_uniforms_of_turns

LATE_TURN = 2**31


SEEDS = [0, 3, 2**31, 2**32, 2**63 - 1, 2**127, 2**128, 2**200 + 7]


@pytest.mark.parametrize("seed", SEEDS)
def test_uniforms_are_those_of_numpys_pcg64_cut_to_nine_decimals(seed: int) -> None:
    for stream, turn, reroll in [
        (0, 0, 0),
        (2, 16, 0),
        (0, 63, 0),
        (3, 64, 0),
        (1, LATE_TURN, 0),
        (0, 2**32 + 1, 0),
        (1, 5, 2),
    ]:
        bit_generator = np.random.PCG64(
            np.random.SeedSequence(seed, spawn_key=(stream, turn, reroll))
        )
        full_precision = (bit_generator.random_raw(12) >> np.uint64(11)) * 2.0**-53
        expected = (np.floor(full_precision * 1e9) / 1e9).reshape(6, 2)
        for first in (0, 4):
            result = generate_uniforms(
                seed, stream, turn, reroll=reroll, first_episode=first, rows=2, count=2
            )
            assert result.tolist() == expected[first : first + 2].tolist()


@pytest.mark.parametrize("count", [0, 1, 3])
def test_selected_rows_have_the_same_uniforms_as_among_all_rows(count: int) -> None:
    selected = np.array([1, 4, 5])
    all_rows = generate_uniforms(7, 1, 2, first_episode=3, rows=9, count=count)
    assert (
        generate_uniforms(
            7, 1, 2, first_episode=3, rows=9, count=count, selected_rows=selected
        ).tolist()
        == all_rows[selected].tolist()
    )


@pytest.mark.parametrize("episode", [0, 12_345_678])
def test_the_uniforms_of_an_episode_equal_those_in_a_batch(episode: int) -> None:
    uniforms = SeededUniforms(7, episode)
    for stream, turn, count in [(0, 0, 1), (2, 5, 3), (1, LATE_TURN, 2), (0, 1, 0)]:
        result = uniforms.generate_uniforms(stream, turn, 0, count)
        batch = generate_uniforms(7, stream, turn, first_episode=episode, rows=2, count=count)
        assert result.tolist() == batch[:1].tolist()


@pytest.mark.parametrize("count", [0, 1, 3])
def test_the_uniforms_of_many_turns_are_those_of_each_turn(count: int) -> None:
    source = SeededUniforms(2**40, 5)
    turns = [(1, 0), (63, 0), (64, 2), (LATE_TURN, 0)]
    separate = [source.generate_uniforms(2, *turn, count) for turn in turns]
    together = generate_uniforms_of_turns(source, 2, turns, count)
    assert together.tolist() == np.concatenate(separate).tolist()


def test_the_uniforms_of_a_seed_never_change() -> None:
    assert generate_uniforms(7, 0, 1, rows=1, count=3).tolist() == [
        [0.571177616, 0.638631865, 0.051850858]
    ]


def test_a_reroll_has_different_uniforms() -> None:
    dice = SeededUniforms(7)
    first, second = (dice.generate_uniforms(0, 5, reroll, 2) for reroll in (0, 1))
    assert second.tolist() == generate_uniforms(7, 0, 5, reroll=1, rows=1, count=2).tolist()
    assert (first != second).all()
