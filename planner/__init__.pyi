"""The types of what `import planner` offers, which is imported when it is used."""

from planner.api.bench import export as export
from planner.api.comparing import afford as afford
from planner.api.comparing import compare as compare
from planner.api.comparing import why as why
from planner.api.data import apply as apply
from planner.api.data import calibrate as calibrate
from planner.api.data import look as look
from planner.api.data import reduce as reduce
from planner.api.diagnosing import diagnose as diagnose
from planner.api.diagnosing import update as update
from planner.api.fleet import accept as accept
from planner.api.fleet import forecast as forecast
from planner.api.fleet import plan_check as plan_check
from planner.api.fleet import recalibrate as recalibrate
from planner.api.migrating import migrate as migrate
from planner.api.planning import allow as allow
from planner.api.planning import check as check
from planner.api.planning import plan as plan
from planner.api.planning import report as report
from planner.api.planning import schema as schema
from planner.api.planning import sensitivity as sensitivity
from planner.api.promise import verify as verify
from planner.api.reproducing import reproduce as reproduce
from planner.api.simulating import simulate as simulate
from planner.api.simulating import simulate_signals as simulate_signals
from planner.api.spec import Spec as Spec
from planner.api.spec import load as load
from planner.api.sweeping import sweep as sweep
from planner.errors import InfeasibleError as InfeasibleError
from planner.errors import InputError as InputError
from planner.errors import PlannerError as PlannerError
from planner.errors import StoppedEarly as StoppedEarly

__all__: list[str]
__version__: str
