"""From a scenario file to a verdict: read, build, run and judge a scenario, and repeat it in studies on workers.

It may import `sim`, `ident` and `support`, but no other folder of this package.
"""
