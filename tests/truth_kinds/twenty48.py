import hashlib
from itertools import combinations

import numpy as np

import dmplay
from dmplay.problems.game_2048 import Game2048, slide_and_score
from tests.truth_kinds.case import Case, by_kind, reached

LEFT, RIGHT = 0, 2
NAMES = {"left": LEFT, "right": RIGHT}
GAMES = 200


def problem(case: Case) -> Game2048:
    found = dmplay.load_problem("2048", p_two=case.given.get("p_two", 0.8))
    assert isinstance(found, Game2048)
    return found


def exponents(board: list[list[int]]) -> np.ndarray:
    return np.array(
        [[[tile.bit_length() - 1 if tile else 0 for tile in row] for row in board]], np.uint8
    )


def tiles(board: np.ndarray) -> list[list[int]]:
    return [[2 ** int(e) if e else 0 for e in row] for row in board]


def slid(rows: np.ndarray, direction: str) -> tuple[np.ndarray, np.ndarray]:
    """Rows `[R, 4]` after a slide, each alone on a board, and what they pay."""
    boards = np.zeros((len(rows), 4, 4), np.uint8)
    boards[:, 0] = rows
    moved, pay = slide_and_score(boards, np.full(len(rows), NAMES[direction]))
    return moved[:, 0], pay


def row(case: Case) -> None:
    given = np.array([case.given["exponents"]], np.uint8)
    code = sum(int(e) << 4 * place for place, e in enumerate(case.given["exponents"]))
    assert code == case.given["code"]
    moved, pay = slid(given, case.given["direction"])
    case.close("exponents", moved[0])
    case.close("reward", pay[0])
    assert case.expect["legal"] == (moved != given).any()


def row_table(case: Case) -> None:
    codes = np.arange(65536)
    rows = np.stack([codes >> 4 * place & 15 for place in range(4)], axis=1).astype(np.uint8)
    moved, pay = slid(rows, case.given["direction"])
    if "-> 15" in case.given["overflow"]:  # the package's reading, from ours
        pay -= 32768.0 * (moved == 16).sum(axis=1)
        moved = np.minimum(moved, 15)
    told = np.column_stack([codes, moved, pay]).astype(int)
    dump = ("%d %d %d %d %d %d\n" * len(codes)) % (*told.ravel().tolist(),)
    case.close("sha256", hashlib.sha256(dump.encode()).hexdigest())
    if "-> 16" in case.given["overflow"]:
        case.close("illegal_rows", (moved == rows).all(axis=1).sum())
        case.close("sum_of_rewards", pay.sum())


def board(case: Case) -> None:
    s = exponents(case.given["board"])
    legal = problem(case).legal_actions_mask(s)[0, 0]
    for a, after in case.expect["after_slide"].items():
        moved, pay = slide_and_score(s, np.array([int(a)]))
        assert tiles(moved[0]) == after["board"]
        assert pay[0] == after["reward"]
        assert legal[int(a)] == after["legal"]
    assert np.flatnonzero(legal).tolist() == case.expect["legal"]
    assert problem(case).terminal(s)[0] == case.expect["over"]


def transition(case: Case) -> None:
    s, a = exponents(case.given["board"]), np.array([[case.given["action"]]])
    moved, _ = slide_and_score(s, a[:, 0])
    assert tiles(moved[0]) == case.expect["after_slide"]
    p, outcome = dmplay.enumerate_outcomes(problem(case), s, a)
    case.close("reward", p[0] @ outcome.rewards[0, :, 0])
    spawned = []
    for after in outcome.state[0]:
        ((r, c),) = np.argwhere(after != moved[0])
        spawned.append(f"row {r} col {c} value {2 ** int(after[r, c])}")
    case.close("spawn", reached(p[0], spawned))


def initial_board(case: Case) -> None:
    from dmplay.core import initial_state_distribution

    p, boards = initial_state_distribution(problem(case))
    assert ((boards > 0).sum(axis=(1, 2)) == case.expect["tiles"]).all()
    values = [",".join(map(str, sorted(2 ** b[b > 0].astype(int)))) for b in boards]
    never = dict.fromkeys(case.expect["values"], 0.0)  # unless reached
    case.close("values", never | reached(p, values))
    pairs = reached(p, [tuple(np.flatnonzero(b)) for b in boards])
    assert set(pairs) == set(combinations(range(16), 2))
    for share in pairs.values():
        case.close("cell_pair_probability", share)
    case.close("expected_sum", p @ np.where(boards > 0, 2.0**boards, 0).sum(axis=(1, 2)))


def random_play(case: Case) -> None:
    game = problem(case)
    played = dmplay.rollout(game, [dmplay.load_agent(game, 0, "random")], episodes=GAMES, seed=1)
    assert played.terminated.all()
    case.mean("mean_score", played.total_rewards[:, 0])
    case.mean("mean_moves", played.turn_counts)
    final = np.where(played.final_states > 0, 2.0**played.final_states, 0)
    case.mean("mean_final_tile_sum", final.sum(axis=(1, 2)))
    largest = final.max(axis=(1, 2))
    for tile, share in case.expect["max_tile_share"].items():
        case.share(share, float((largest == int(tile)).mean()), case.given["games"], GAMES)


KINDS = by_kind(
    row, board, transition, initial_board, random_play, row_table_sha256=row_table,
)  # fmt: skip
LATER: set[str] = set()
