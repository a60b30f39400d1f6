"""Reduced models: pressures over time in, outputs over time out; fast enough for control and for fits.

One file a model; `registry.py` lists them. What a model is: `model.py`.
"""
