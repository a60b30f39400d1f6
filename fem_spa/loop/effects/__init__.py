"""The effects that a model may lack, one file each; `registry.py` lists them, `effect.py` says what one
is."""
