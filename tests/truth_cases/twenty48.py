import hashlib
from itertools import combinations

import numpy as np

import dmplay
from dmplay.problems.game_2048.rules import Game2048, slide_and_score
from tests.truth_cases.case import Case, map_by_kind, sum_probabilities

LEFT, RIGHT = 0, 2
DIRECTIONS = {"left": LEFT, "right": RIGHT}
GAME_COUNT = 200


def load_problem(case: Case) -> Game2048:
    game = dmplay.load_problem("2048", p_two=case.inputs.get("p_two", 0.8))
    assert isinstance(game, Game2048)
    return game


def make_boards(board: list[list[int]]) -> np.ndarray:
    return np.array(
        [[[tile.bit_length() - 1 if tile else 0 for tile in row] for row in board]], np.uint8
    )


def list_tiles(board: np.ndarray) -> list[list[int]]:
    return [[2 ** int(e) if e else 0 for e in row] for row in board]


def slide_rows(rows: np.ndarray, direction: str) -> tuple[np.ndarray, np.ndarray]:
    """Slide rows `[R, 4]`, each on its own board; return the new rows and their rewards."""
    boards = np.zeros((len(rows), 4, 4), np.uint8)
    boards[:, 0] = rows
    moved, rewards = slide_and_score(boards, np.full(len(rows), DIRECTIONS[direction]))
    return moved[:, 0], rewards


def row(case: Case) -> None:
    rows = np.array([case.inputs["exponents"]], np.uint8)
    code = sum(int(e) << 4 * index for index, e in enumerate(case.inputs["exponents"]))
    assert code == case.inputs["code"]
    moved, rewards = slide_rows(rows, case.inputs["direction"])
    case.close("exponents", moved[0])
    case.close("reward", rewards[0])
    assert case.expect["legal"] == (moved != rows).any()


def check_row_table(case: Case) -> None:
    codes = np.arange(65536)
    rows = np.stack([codes >> 4 * index & 15 for index in range(4)], axis=1).astype(np.uint8)
    moved, rewards = slide_rows(rows, case.inputs["direction"])
    # convert our result to the reading of the published package
    if "-> 15" in case.inputs["overflow"]:
        rewards -= 32768.0 * (moved == 16).sum(axis=1)
        moved = np.minimum(moved, 15)
    table = np.column_stack([codes, moved, rewards]).astype(int)
    dump = ("%d %d %d %d %d %d\n" * len(codes)) % (*table.ravel().tolist(),)
    case.close("sha256", hashlib.sha256(dump.encode()).hexdigest())
    if "-> 16" in case.inputs["overflow"]:
        case.close("illegal_rows", (moved == rows).all(axis=1).sum())
        case.close("sum_of_rewards", rewards.sum())


def board(case: Case) -> None:
    s = make_boards(case.inputs["board"])
    legal = load_problem(case).legal_actions_mask(s)[0, 0]
    for a, expected in case.expect["after_slide"].items():
        moved, rewards = slide_and_score(s, np.array([int(a)]))
        assert list_tiles(moved[0]) == expected["board"]
        assert rewards[0] == expected["reward"]
        assert legal[int(a)] == expected["legal"]
    assert np.flatnonzero(legal).tolist() == case.expect["legal"]
    assert load_problem(case).terminal(s)[0] == case.expect["over"]


def transition(case: Case) -> None:
    s, a = make_boards(case.inputs["board"]), np.array([[case.inputs["action"]]])
    moved, _ = slide_and_score(s, a[:, 0])
    assert list_tiles(moved[0]) == case.expect["after_slide"]
    p, outcome = dmplay.enumerate_outcomes(load_problem(case), s, a)
    case.close("reward", p[0] @ outcome.rewards[0, :, 0])
    spawned = []
    for after in outcome.state[0]:
        ((r, c),) = np.argwhere(after != moved[0])
        spawned.append(f"row {r} col {c} value {2 ** int(after[r, c])}")
    case.close("spawn", sum_probabilities(p[0], spawned))


def initial_board(case: Case) -> None:
    from dmplay.core.problem import initial_state_distribution

    p, boards = initial_state_distribution(load_problem(case))
    assert ((boards > 0).sum(axis=(1, 2)) == case.expect["tiles"]).all()
    values = [",".join(map(str, sorted(2 ** b[b > 0].astype(int)))) for b in boards]
    # values that are not reached have probability 0
    zeros = dict.fromkeys(case.expect["values"], 0.0)
    case.close("values", zeros | sum_probabilities(p, values))
    pairs = sum_probabilities(p, [tuple(np.flatnonzero(b)) for b in boards])
    assert set(pairs) == set(combinations(range(16), 2))
    for share in pairs.values():
        case.close("cell_pair_probability", share)
    case.close("expected_sum", p @ np.where(boards > 0, 2.0**boards, 0).sum(axis=(1, 2)))


def random_play(case: Case) -> None:
    game = load_problem(case)
    batch = dmplay.rollout(
        game, [dmplay.load_agent(game, 0, "random")], episodes=GAME_COUNT, seed=1
    )
    assert batch.terminated.all()
    case.mean("mean_score", batch.total_rewards[:, 0])
    case.mean("mean_moves", batch.turn_counts)
    final = np.where(batch.final_states > 0, 2.0**batch.final_states, 0)
    case.mean("mean_final_tile_sum", final.sum(axis=(1, 2)))
    largest = final.max(axis=(1, 2))
    for tile, share in case.expect["max_tile_share"].items():
        case.share(share, float((largest == int(tile)).mean()), case.inputs["games"], GAME_COUNT)


KINDS = map_by_kind(
    row, board, transition, initial_board, random_play, row_table_sha256=check_row_table,
)  # fmt: skip
LATER: set[str] = set()
