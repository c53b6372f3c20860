"""Results as pydantic models, a module a kind: their fields are what `--json` prints, schemas state and pages read."""
