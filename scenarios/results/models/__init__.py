"""Results as pydantic models, one module per kind: the basis of `--json`, JSON Schemas and pages."""
