from dmplay.core.chance import Categorical as Categorical
from dmplay.core.chance import DiscreteUniform as DiscreteUniform
from dmplay.core.chance import Normal as Normal
from dmplay.core.chance import Uniform as Uniform
from dmplay.core.policy import Policy as Policy
from dmplay.core.problem import Outcome as Outcome
from dmplay.core.problem import Problem as Problem
from dmplay.core.problem import enumerate_outcomes as enumerate_outcomes
from dmplay.core.session import Session as Session
from dmplay.core.spaces import Interval as Interval
from dmplay.core.spaces import Labels as Labels
from dmplay.core.tabular import Tables as Tables
from dmplay.core.tabular import Tabular as Tabular
from dmplay.core.uniforms import SeededUniforms as SeededUniforms
from dmplay.evaluation.comparison import compare as compare
from dmplay.evaluation.many_games import run as run
from dmplay.evaluation.tournament import run_tournament as run_tournament
from dmplay.game.manual_game import play as play
from dmplay.registry.agents import load_agent as load_agent
from dmplay.registry.problems import load_problem as load_problem
from dmplay.simulation.rollouts import rollout as rollout
from dmplay.validation.conformance import check as check

__version__: str
