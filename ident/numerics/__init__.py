"""Mathematics without robots: least squares, the span of columns, zero-phase filters.

It may import `support`.
"""
