"""Files that the tests read, as somebody would write them."""

from pathlib import Path

from dmplay.files import gambit, markov
from dmplay.files.problem import FileProblem, NormalFormGame

TIGER = """\
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

TEAM = """\
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

BALLET = r"""NFG 1 R "Ballet or \"the\" fight" { "Player 1" "Player 2" }
{ { "ballet" "the fight" } { "ballet" "the fight" } }
"Both want to meet."

3 2 0 0 0 0 2 3
"""


def tiger(*changes: tuple[str, str]) -> FileProblem:
    """The tiger, its file changed in some places."""
    return markov.read_markov_file("tiger.pomdp", changed(TIGER, *changes))


def team(*changes: tuple[str, str]) -> FileProblem:
    """The tiger of two, its file changed in some places."""
    return markov.read_markov_file("tiger.dpomdp", changed(TEAM, *changes), team=True)


def ballet(*changes: tuple[str, str]) -> NormalFormGame:
    """The game in normal form, its file changed in some places."""
    return gambit.read_nfg("ballet.nfg", changed(BALLET, *changes))


def changed(text: str, *changes: tuple[str, str]) -> bytes:
    """A file in which some words stand for others."""
    for before, after in changes:
        assert before in text, before
        text = text.replace(before, after)
    return text.encode()


def kept(folder: Path, name: str, text: str) -> str:
    """The path of a file of this content."""
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return str(path)
