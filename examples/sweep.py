"""What the low-pass of the positions costs: one scenario, one value swept, the same noise each time."""

import numpy as np

from scenarios import load_scenario, run_scenario
from scenarios.experiments.files.settings import with_settings

nominal = load_scenario("nominal")
print("cutoff_hz  largest error [%]  largest 2 sigma [%]")
for cutoff in (8.0, 15.0, 30.0):
    run = run_scenario(
        with_settings(nominal, {"identification.observe.cutoff_hz": cutoff, "identification.method": "ls-2011"})
    )
    found = [gain for gain in run.verdict.gains if gain.rel_error is not None]
    error = max(abs(gain.rel_error) for gain in found)
    wide = max(2.0 * gain.std / gain.true for gain in found)
    print(f"{cutoff:9g}  {100.0 * error:17.2f}  {100.0 * wide:19.2f}")
    assert np.isfinite(error)
