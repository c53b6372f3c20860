"""From a scenario file to a verdict: read, build, run, judge, and repeat in studies on workers.

It may know `sim`, `ident` and `support`; nothing else of this package.
"""
