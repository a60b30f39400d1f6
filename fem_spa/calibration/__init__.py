"""Calibration: reduced models from FE curves or records, FE decks from records, rod laws from one chamber."""
