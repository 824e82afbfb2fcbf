"""Strangers: faults that no catalogue has, in sets, each written before the rules had seen it.

Whoever writes rules of a diagnosis does not read them.
"""

from figures.strangers.fifth import FIFTH
from figures.strangers.first import FIRST
from figures.strangers.fourth import FOURTH
from figures.strangers.seventh import SEVENTH
from figures.strangers.sixth import SIXTH
from figures.strangers.third import THIRD

__all__ = ["FIFTH", "FIRST", "FOURTH", "SEVENTH", "SIXTH", "THIRD"]
