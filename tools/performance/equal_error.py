"""How much does a setting need for a given error, by its measured curve?

Between two measured points the curve is taken as a power law, x = x0 (e / e0)^k, which is a straight line on logarithmic axes: noise
falls as samples^-1/2, so the law is exact where nothing but noise is left. Outside of what was measured nothing is guessed: the
answer is then a bound, "<" (the first point is good enough) or ">" (not even the last one is).

Test: tests/house/test_performance_page.py
"""
import math
from typing import NamedTuple


class Need(NamedTuple):
    """An amount, exact ("") or a bound on it ("<" or ">")."""
    bound: str
    amount: float


def need(curve, error):
    """What it takes until the error is reached, and not lost again.

    curve: points (amount, error) in rising order of the amount; noisy curves may rise for a while.
    """
    if curve[-1][1] > error:
        return Need(">", curve[-1][0])
    after = len(curve) - 1
    while after > 0 and curve[after - 1][1] <= error:
        after -= 1
    amount, reached = curve[after]
    if reached == error:
        return Need("", amount)
    if after == 0 or reached == 0:  # A power law never gets to zero, so all that is known is that this point is enough.
        return Need("<", amount)
    amount_before, error_before = curve[after - 1]
    share = math.log(error / error_before) / math.log(reached / error_before)
    return Need("", amount_before * (amount / amount_before)**share)


def ratio(a, b):
    """a / b as a Need; none if both are bounds that leave it open."""
    opposite = {"<": ">", ">": "<", "": ""}
    bounds = {a.bound, opposite[b.bound]} - {""}
    return Need("".join(bounds), a.amount / b.amount) if len(bounds) < 2 else None


def common_error(first, second):
    """The smallest error that both curves get to: where the one that got less far ends."""
    return max(first[-1][1], second[-1][1])
