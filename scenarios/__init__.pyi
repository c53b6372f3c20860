from .assertions import assert_scenario as assert_scenario
from .experiments.files.loading import load_scenario as load_scenario
from .experiments.files.schema import Scenario as Scenario
from .experiments.judge import GainVerdict as GainVerdict
from .experiments.judge import Verdict as Verdict
from .experiments.run import Run as Run
from .experiments.run import run_scenario as run_scenario
from .support.errors import ScenarioError as ScenarioError
