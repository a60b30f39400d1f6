"""Signature statistics: what of a residual is an effect's own mark, one idea a file; `measure.py` has the
numbers, `statistic.py` says what one is."""
