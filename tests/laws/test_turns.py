"""What holds in every turn that random play comes to, of every kind there is."""

from dmplay.laws import play
from tests.support.cases import every_problem
from tests.support.pools import keeps

LAWS = {
    "a step is the move of the sampled events": play.sampled,
    "outcomes have the shapes and ranges that the problem states": play.shaped,
    "probabilities sum to one": play.summed,
    "the tables are what the outcomes amount to": play.tabulated,
    "a belief is carried as the listed outcomes say": play.carried,
    "the least and the greatest draw give outcomes that can happen": play.extreme,
}


@every_problem
def test_a_turn_keeps_every_law(name: str) -> None:
    for said, law in LAWS.items():
        keeps(name, law, said)
