from .assertions import assert_scenario as assert_scenario
from .errors import ScenarioError as ScenarioError
from .files.loading import load_scenario as load_scenario
from .files.schema import Scenario as Scenario
from .judge import GainVerdict as GainVerdict
from .judge import Verdict as Verdict
from .run import Run as Run
from .run import run_scenario as run_scenario
