"""Problem files that the tests read, as a person would write them."""

from pathlib import Path

from dmplay.formats import cassandra, gambit_nfg
from dmplay.formats.file_problems import FileProblem, NormalFormGame

TIGER_TEXT = """\
# Listen for the tiger, or open the door that it is not behind.
discount: 0.95
values: reward
states: tiger-left tiger-right
actions: listen open-left open-right
observations: hear-left hear-right

T: listen
identity
T: open-left
uniform
T: open-right
uniform

O: listen
0.85 0.15
0.15 0.85
O: open-left
uniform
O: open-right
uniform

R: listen : * : * : * -1
R: open-left : tiger-left : * : * -100
R: open-left : tiger-right : * : * 10
R: open-right : tiger-left : * : * 10
R: open-right : tiger-right : * : * -100
"""

TEAM_TEXT = """\
agents: 2
discount: 1
values: reward
states: tiger-left tiger-right
start:
uniform
actions:
listen open-left open-right
listen open-left open-right
observations:
hear-left hear-right
hear-left hear-right
T: * :
uniform
T: listen listen :
identity
O: * :
uniform
O: listen listen : tiger-left :
0.7225 0.1275 0.1275 0.0225
O: listen listen : tiger-right : hear-right hear-right : 0.7225
O: listen listen : tiger-right : hear-left hear-right : 0.1275
O: listen listen : tiger-right : hear-right hear-left : 0.1275
O: listen listen : tiger-right : hear-left hear-left : 0.0225
R: * : * : * : * : -100
R: listen listen: * : * : * : -2
R: open-left open-left : tiger-right : * : * : +20
R: open-right open-right : tiger-left : * : * : 20
"""

BALLET_TEXT = r"""NFG 1 R "Ballet or \"the\" fight" { "Player 1" "Player 2" }
{ { "ballet" "the fight" } { "ballet" "the fight" } }
"Both want to meet."

3 2 0 0 0 0 2 3
"""


def read_tiger(*changes: tuple[str, str]) -> FileProblem:
    """Read the tiger problem, with changes to its file."""
    return cassandra.read_markov_file("tiger.pomdp", replace_texts(TIGER_TEXT, *changes))


def read_team(*changes: tuple[str, str]) -> FileProblem:
    """Read the tiger problem of two agents, with changes to its file."""
    return cassandra.read_markov_file("tiger.dpomdp", replace_texts(TEAM_TEXT, *changes), team=True)


def read_ballet(*changes: tuple[str, str]) -> NormalFormGame:
    """Read the game in normal form, with changes to its file."""
    return gambit_nfg.read_nfg("ballet.nfg", replace_texts(BALLET_TEXT, *changes))


def replace_texts(text: str, *changes: tuple[str, str]) -> bytes:
    """Return the text as bytes, after replacing each first part of a pair by the second."""
    for before, after in changes:
        assert before in text, before
        text = text.replace(before, after)
    return text.encode()


def write_text_file(folder: Path, name: str, text: str) -> str:
    """Write a text file and return its path."""
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return str(path)
