"""What every model asks of a drive, in one line where it is not so."""

from __future__ import annotations

import numpy as np

from fem_spa.errors import InputError
from fem_spa.reduced.model import Drive, ReducedModel
from fem_spa.units import ATMOSPHERE

HIGHEST = 1e8
"""Pa; a larger gauge pressure is a slip of units."""
GAP = 20.0
"""Median intervals; a longer one in a record of even sampling is a gap."""


def check_drive(drive: Drive, chambers: int, kind: str) -> tuple[np.ndarray, np.ndarray]:
    """Time (n,) s and pressure (n, chambers) Pa of a drive as float arrays, checked.

    Parameters
    ----------
    chambers : how many pressures the model takes;  kind : its name, for the error line

    Raises
    ------
    InputError : no rows, another number of chambers or of rows, times that do not increase, gaps (cells that
        are not finite), or a pressure below vacuum or above 100 MPa
    """
    time, pressure = np.asarray(drive.time, float), np.asarray(drive.pressure, float)
    check_time(time)
    pressure = pressure[:, None] if pressure.ndim == 1 else pressure
    if pressure.ndim != 2 or len(pressure) != len(time):
        raise InputError(f"given {len(time)} times and {len(pressure)} pressures; give one row a time")
    if pressure.shape[1] != chambers:
        one = "one pressure" if chambers == 1 else f"{chambers} pressures"
        raise InputError(
            f"given {pressure.shape[1]} pressures: kind '{kind}' takes {one}; give as many pressure columns"
        )
    if not np.all(np.isfinite(pressure)):
        row = int(np.argmin(np.isfinite(pressure).all(axis=1)))
        raise InputError(
            f"given a gap in the pressure at row {row + 1} ({time[row]:g} s); fill it in or cut there"
        )
    for worst, words in ((pressure.min(), "below vacuum"), (pressure.max(), "above 100 MPa")):
        if not -ATMOSPHERE <= worst <= HIGHEST:
            raise InputError(f"given a pressure of {worst / 1e3:g} kPa: {words}; see the unit of the column")
    if drive.temperature is not None and np.shape(drive.temperature) != time.shape:
        raise InputError(
            f"given {np.size(drive.temperature)} temperatures for {len(time)} times; give as many"
        )
    for what, value in (("orientation", drive.orientation), ("payload", drive.payload)):
        if not np.isfinite(value) or (what == "payload" and value < 0):
            raise InputError(f"given {what} {value:g}: a finite number is needed (payload: zero or more)")
    return time, pressure


def check_time(time: np.ndarray) -> None:
    """InputError where times (n,) are none, not finite, or do not increase."""
    if time.ndim != 1 or time.size == 0:
        raise InputError("given no times; at least one row of time and pressure is needed")
    if not np.all(np.isfinite(time)):
        row = int(np.argmin(np.isfinite(time)))
        raise InputError(f"given a gap in the time at row {row + 1}; fill it in or cut the record there")
    if time.size > 1 and not np.all(np.diff(time) > 0):
        row = int(np.argmax(np.diff(time) <= 0)) + 1
        raise InputError(
            f"given time {time[row]:g} s at row {row + 1} after {time[row - 1]:g} s: "
            "time must increase; sort the rows or cut the record there"
        )


def refuse_gap(time: np.ndarray) -> None:
    """InputError for rows that are missing: an interval of more than 20 of an otherwise even sampling.

    For readers of records. A model itself takes long intervals: pressure runs linearly between samples.
    """
    check_time(time)
    steps = np.diff(time)
    if steps.size < 10:
        return
    usual = float(np.median(steps))
    even = np.mean(np.abs(steps - usual) < 0.5 * usual) > 0.9
    row = int(np.argmax(steps))
    if even and steps[row] > GAP * usual:
        raise InputError(
            f"given a gap of {steps[row]:.4g} s after row {row + 1} ({time[row]:g} s), where samples are "
            f"{usual:.4g} s apart; cut the record there or fill it in"
        )


def outside(model: ReducedModel, drive: Drive) -> str | None:
    """A sentence where a drive leaves the range of the model's calibration, else None."""
    if model.valid is None:
        return None
    _, pressure = check_drive(drive, model.chambers, model.kind)
    for j, (low, high) in enumerate(zip(model.valid.low, model.valid.high, strict=True)):
        least, most = float(pressure[:, j].min()), float(pressure[:, j].max())
        slack = 1e-3 * (high - low)
        if least < low - slack or most > high + slack:
            name = "pressure" if model.chambers == 1 else f"pressure {j + 1}"
            return (
                f"{name} runs from {least / 1e3:.4g} to {most / 1e3:.4g} kPa; the model ({model.kind}) "
                f"was calibrated from {low / 1e3:.4g} to {high / 1e3:.4g} kPa"
            )
    return None
