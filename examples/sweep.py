"""What the low-pass of the positions costs: one scenario, one value swept, the same noise each time."""

import scenarios

rows = scenarios.load("nominal").sweep({"observe.cutoff_hz": [8, 15, 30]}, seeds=2).to_frame()
found = rows[rows["identifiable"]].groupby("identification.observe.cutoff_hz")
table = found.agg(largest_error=("rel_error", lambda each: each.abs().max()), largest_std=("std", "max"))
print(table)
assert len(table) == 3
