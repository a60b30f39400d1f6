"""Vulcanized natural rubber, 8 % sulphur, 20 degC: L. R. G. Treloar, Trans. Faraday Soc. 40 (1944) 59.

Nominal stress in MPa over stretch, the points that Steinmann, Hossain and Possart (Arch. Appl. Mech.
82 (2012) 1183) and most later comparisons of laws use.
"""

from __future__ import annotations

import numpy as np

from materials.specimen import Specimen

UNIAXIAL = """
0.0255 1.0200  0.1344 1.1250  0.2256 1.2400  0.3169 1.3900  0.4081 1.5850  0.5003 1.9000  0.5886 2.1800
0.6769 2.4200  0.8633 3.0200  1.0497 3.5700  1.2263 4.0300  1.5892 4.7600  1.9522 5.3600  2.3152 5.7500
2.6879 6.1500  3.0411 6.4000  3.4139 6.6000  3.7769 6.8500  4.1300 7.0500  4.4930 7.1500  4.8658 7.2500
5.2287 7.4000  5.5917 7.5000  6.3176 7.6000
"""
EQUIBIAXIAL = """
0.0925 1.0270  0.1570 1.0650  0.2387 1.1150  0.2570 1.1400  0.3282 1.2000  0.4364 1.3100  0.5146 1.4200
0.6557 1.6800  0.7652 1.9400  0.9617 2.4900  1.2386 3.0300  1.4401 3.4300  1.7096 3.7500  1.9845 4.0700
2.2065 4.2600  2.4426 4.4500
"""
PLANAR = """
0.0667 1.0300  0.1589 1.1200  0.2452 1.1900  0.3326 1.3100  0.4189 1.4600  0.5925 1.8400  0.7652 2.3800
0.9418 2.9700  1.1183 3.4700  1.2851 3.9500  1.4617 4.3700  1.6285 4.6900  1.8050 4.9700
"""
OGDEN_1972 = {"mu1": 0.63e6, "alpha1": 1.3, "mu2": 0.0012e6, "alpha2": 5.0, "mu3": -0.01e6, "alpha3": -2.0}
"""R. W. Ogden, Proc. R. Soc. A 326 (1972) 565, fitted by hand to the same tests."""


def specimens() -> list[Specimen]:
    """The three tests."""
    out = []
    for mode, text in (("uniaxial", UNIAXIAL), ("equibiaxial", EQUIBIAXIAL), ("planar", PLANAR)):
        table = np.array(text.split(), float).reshape(-1, 2)
        out.append(Specimen(f"Treloar {mode}", mode, "pull", table[:, 1], table[:, 0] * 1e6))
    return out
