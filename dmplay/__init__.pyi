from dmplay.chance import Categorical as Categorical
from dmplay.chance import DiscreteUniform as DiscreteUniform
from dmplay.chance import Normal as Normal
from dmplay.chance import Uniform as Uniform
from dmplay.conformance import check as check
from dmplay.core import Interval as Interval
from dmplay.core import Labels as Labels
from dmplay.core import Outcome as Outcome
from dmplay.core import Policy as Policy
from dmplay.core import Problem as Problem
from dmplay.core import enumerate_outcomes as enumerate_outcomes
from dmplay.evaluation.comparison import compare as compare
from dmplay.evaluation.many_games import run as run
from dmplay.evaluation.tournament import run_tournament as run_tournament
from dmplay.manual_game import play as play
from dmplay.registry.agents import load_agent as load_agent
from dmplay.registry.problems import load_problem as load_problem
from dmplay.rollouts import rollout as rollout
from dmplay.session import Session as Session
from dmplay.tabular import Tables as Tables
from dmplay.tabular import Tabular as Tabular
from dmplay.uniforms import SeededUniforms as SeededUniforms

__version__: str
