"""Tests of Gambit's extensive form: information that a file leaves out is filled in."""

from graphlib import CycleError

import pytest

from dmplay.errors import BadFile
from dmplay.formats import gambit_efg

GAME_TEXT = r"""EFG 2 D "A \"small\" game" { "ann" "b\\c" "eve" }
"Of three,
with chance."
c "root" 7 "" { "up" 1/4, "down" .75 } 0
p "left" 1 5 "first" { "a" "b" } 2 "on the way" { 1, -1 0 }
t "" 9 "nine" { 1/2 0 2e0 }
t "end" 2
p "" 3 4 { "a" "b
c" } 0
p "" 1 5 9
t "" 0
t "" 2
p "" 1 2 "" { "x" } 0
t "" 9 "nine"
"""
NORMALIZED_TEXT = """EFG 2 R "A 'small' game" { "ann" "b/c" "eve" }
""

c "" 1 "" { "up" 0.25 "down" 0.75 } 0
p "" 1 1 "" { "a" "b" } 0
t "" 1 "" { 1.5, -1.0, 2.0 }
t "" 2 "" { 2.0, -2.0, 0.0 }
p "" 3 1 "" { "a" "b c" } 0
p "" 1 1 "" { "a" "b" } 0
t "" 3 "" { 0.5, 0.0, 2.0 }
t "" 4 "" { 1.5, -1.0, 2.0 }
p "" 1 2 "" { "x" } 0
t "" 5 "" { 0.5, 0.0, 2.0 }
"""
FAULTS = [
    ("EFG 2", "EFG 1", "1:5: got '1', expected 2"),
    ('c "root"', 'd "root"', "4:1: got 'd', expected c or p or t"),
    ("3 4 {", "4 4 {", "8:6: got '4', expected the number of a player, 1 to 3"),
    ("3 4 {", "3 0 {", "8:8: got '0', expected the number of an information set, 1 or more"),
    ('1 2 "" { "x" }', '1 2 ""',
     "13:13: got '0', expected actions in braces, because this information set is new"),
    ('1 5 9\n', '1 5 { "a" } 9\n',
     "10:10: got '{', expected 2 actions, as at an earlier node of the information set"),
    ("1/4", "1/3", "4:17: got '\"up\"', expected probabilities that sum to 1"),
    ("2e0 }", "2e0 1 }", "6:27: got '1', expected }"),
    ('t "" 0', 't "" 3',
     "11:6: got '3', expected an outcome whose payoffs are given here or earlier"),
    ('t "" 9 "nine"\n', "", "got the end of the file, expected c or p or t"),
    ('"nine"\n', '"nine"\nt "" 0',
     "15:1: got 't', expected the end of the file, because the game tree is complete"),
    ('c "root"', 't "" 0 c',
     "4:1: got 't', expected c or p, because a game needs a node with actions"),
]  # fmt: skip


def test_every_node_is_complete_and_earlier_payoffs_are_paid_at_the_end() -> None:
    assert gambit_efg.read_efg("small.efg", GAME_TEXT.encode()).text == NORMALIZED_TEXT
    assert gambit_efg.read_efg("small.efg", NORMALIZED_TEXT.encode()).text == NORMALIZED_TEXT


def test_a_game_that_chance_ends_gets_a_final_node_of_the_first_player() -> None:
    root_text = 'EFG 2 R "draw" { "ann" }\nc "" 1 "" { "lost" 1/2 "won" 1/2 } 0\n'
    node_text = 't "" 1 "" { -7 }\np "" 1 1 "" { "a" } 0\nt "" 2 "" { 7 }\n'
    assert gambit_efg.read_efg("draw.efg", (root_text + node_text).encode()).text.splitlines()[
        3:
    ] == [
        'c "" 1 "" { "lost" 0.5 "won" 0.5 } 0',
        'p "" 1 1 "" { "end" } 0',
        't "" 1 "" { -7.0 }',
        'p "" 1 2 "" { "a" } 0',
        't "" 2 "" { 7.0 }',
    ]


@pytest.mark.parametrize(
    ("actions", "expected"),
    [
        ('"1" "1"', '"1" "1 (2)"'),
        ('"1" "1" "1"', '"1" "1 (2)" "1 (3)"'),
        ('"1" "1" "1 (2)"', '"1" "1 (3)" "1 (2)"'),
        ('"1 (2)" "1" "1 (2)" "1"', '"1 (2)" "1" "1 (2) (2)" "1 (3)"'),
        ('"a b" "a  b"', '"a b" "a b (2)"'),
        (r"""   "it's" "it\"s"   """.strip(), '"it\'s" "it\'s (2)"'),
        ('"" ""', '"" "(2)"'),
        ('"1" "01" "a" "A"', '"1" "01" "a" "A"'),
    ],
)  # fmt: skip
def test_equal_labels_of_a_node_are_numbered(actions: str, expected: str) -> None:
    header = 'EFG 2 R "labels" { "ann" }\n'
    ends = "".join(f't "" {n + 1} "" {{ {n} }}\n' for n in range(len(expected.split('" "'))))
    player_node = f'p "" 1 1 "" {{ {actions} }} 0\n'
    normalized = gambit_efg.read_efg("labels.efg", (header + player_node + ends).encode()).text
    assert normalized.splitlines()[3] == f'p "" 1 1 "" {{ {expected} }} 0'


def test_equal_labels_of_chance_are_numbered() -> None:
    game_text = """EFG 2 R "coin" { "ann" }
c "" 1 "" { "1/2" 1/2 "1/2" 1/2 } 0
p "" 1 1 "" { "a" } 0
t "" 1 "" { 1 }
p "" 1 2 "" { "a" } 0
t "" 2 "" { 2 }
"""
    assert gambit_efg.read_efg("coin.efg", game_text.encode()).text.splitlines()[3] == (
        'c "" 1 "" { "1/2" 0.5 "1/2 (2)" 0.5 } 0'
    )


def test_all_nodes_of_a_set_have_the_labels_of_its_first_node() -> None:
    game_text = """EFG 2 R "hidden coin" { "ann" }
c "" 1 "" { "heads" 1/2 "tails" 1/2 } 0
p "" 1 1 "" { "call heads" "call tails" } 0
t "" 1 "" { 1 }
t "" 2 "" { 0 }
p "" 1 1 "" { "miss" "hit" } 0
t "" 2
t "" 1
"""
    rows = gambit_efg.read_efg("coin.efg", game_text.encode()).text.splitlines()
    assert rows[4] == rows[7] == 'p "" 1 1 "" { "call heads" "call tails" } 0'


def write_path(node_count: int, kind: str = "p") -> bytes:
    """Return a game whose only path has this many nodes before its end."""
    node = 'c "" {0} "" {{ "on" 1 }} 0' if kind == "c" else 'p "" 1 {0} "" {{ "on" }} 0'
    rows = [node.format(n + 1) for n in range(node_count)]
    return "\n".join(['EFG 2 R "path" { "ann" }', *rows, 't "" 1 "" { 1 }']).encode()


@pytest.mark.parametrize("kind", ["p", "c"])
def test_a_path_that_is_too_long_for_recursion_is_refused_where_it_becomes_so(kind: str) -> None:
    assert gambit_efg.read_efg("path.efg", write_path(500, kind)).text.count(f'\n{kind} ""') >= 500
    for node_count in (501, 14_000):
        with pytest.raises(BadFile) as error:
            gambit_efg.read_efg("path.efg", write_path(node_count, kind))
        assert str(error.value) == (
            f"path.efg:502:1: got '{kind}', "
            "expected t, because a path has at most 500 nodes before it"
        )


def test_a_missing_name_is_asked_for_with_the_right_article() -> None:
    text = 'EFG 2 R "" { "ann" }\np "" 1 1 "" { 5 } 0\n'
    with pytest.raises(BadFile, match="expected the name of an action in quotation marks"):
        gambit_efg.read_efg("game.efg", text.encode())


def test_faults_are_reported_with_line_and_column() -> None:
    for before, after, message in FAULTS:
        assert GAME_TEXT.count(before) == 1, before
        with pytest.raises(BadFile) as error:
            gambit_efg.read_efg("small.efg", GAME_TEXT.replace(before, after).encode())
        assert str(error.value).startswith("small.efg:")
        assert message in str(error.value), str(error.value)


ORDERED_TEXT = """EFG 2 R "a set at two depths" { "ann" "bob" }
c "" 1 "" { "early" 1/2 "late" 1/2 } 0
p "" 2 1 "" { "x" } 0
t "" 1 "" { 0 0 }
p "" 1 1 "" { "a" } 0
p "" 1 2 "" { "b" } 0
p "" 2 1 0
t "" 1
"""


def test_all_nodes_of_a_set_come_after_as_many_turns_as_the_deepest() -> None:
    form = gambit_efg.read_efg("ordered.efg", ORDERED_TEXT.encode())
    ann_first, ann_second, bob = (1, 1), (1, 2), (2, 1)
    assert form.predecessors == {bob: {ann_second}, ann_first: set(), ann_second: {ann_first}}
    assert gambit_efg.schedule_information_sets(form.predecessors) == {
        ann_first: 0, ann_second: 1, bob: 2,
    }  # fmt: skip


def test_sets_that_come_before_and_after_each_other_have_no_numbers_of_turns() -> None:
    with pytest.raises(CycleError):
        gambit_efg.schedule_information_sets({(1, 1): {(2, 1)}, (2, 1): {(1, 1)}})
