"""Results for people: what is said (`content`, one module a result) apart from how it is drawn (`renderers`)."""
