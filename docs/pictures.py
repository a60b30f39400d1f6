"""Make the pictures of README.md: `python docs/pictures.py` (some five minutes).

Runs the deck beside this file and the study `composite_finger`, and keeps their pictures with few
enough colours to be small.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

from PIL import Image

from fem_spa.cli import main

HERE = Path(__file__).parent
WIDTH, COLOURS = 900, 256


def keep(source: Path, name: str, width: int = WIDTH, colours: int = COLOURS) -> None:
    """Write `source` to docs/pictures, smaller."""
    picture = Image.open(source).convert("RGB")
    if picture.width > width:
        height = round(width * picture.height / picture.width)
        picture = picture.resize((width, height), Image.Resampling.LANCZOS)
    picture.quantize(colours, Image.Quantize.MEDIANCUT, dither=Image.Dither.FLOYDSTEINBERG).save(
        HERE / "pictures" / name, optimize=True
    )


def readme() -> None:
    """The three pictures of README.md."""
    with tempfile.TemporaryDirectory() as folder:
        finger, study = Path(folder) / "finger", Path(folder) / "composite_finger"
        for words in (
            ["solve", str(HERE / "finger.toml"), "--out", str(finger)],
            ["study", "composite_finger", "--out", str(study)],
        ):
            if main(words):
                raise SystemExit(f"fem-spa {' '.join(words)} did not reach its end")
        keep(finger / "curve.png", "finger_curve.png")
        keep(finger / "shape.png", "finger_shape.png")
        keep(study / "shape.png", "composite_finger.png")


if __name__ == "__main__":
    readme()
