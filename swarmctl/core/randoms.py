"""Random numbers by counter: a pure function of (seed, vehicle, tick, stream), never of what ran before.

So a result depends neither on the number of threads, nor on which vehicles share a process, nor on the
order in which stages draw.  The generator is splitmix64 (Steele, Lea & Flood 2014), one mixing round for
each part of the key; normals come from the inverse normal distribution (Wichura 1988, AS 241, accurate to
1e-16), so that one key gives one number.
"""

import math

import numpy as np

from .arrays import Floats
from .jit import kernel

# What a number is for.  Each purpose owns a range of streams so that no two draws share a key.
RULE = 0  # the random vector of a planner's rule (two numbers)
CHOICE = 8  # a planner's own choices: which side, which point, which length
FENCE = 64  # the fence response, two numbers a try
LOSS = 1 << 20  # radio loss, one number a sender
DETECT = 1 << 24  # detection, one number a target
NOISE = 1 << 28  # position noise, two numbers a target
ALARM = 1 << 32  # false alarms
LAYOUT = 1 << 36  # where targets lie
LAUNCH = 1 << 40  # initial headings

_GOLDEN = np.uint64(0x9E3779B97F4A7C15)
_MIX_1 = np.uint64(0xBF58476D1CE4E5B9)
_MIX_2 = np.uint64(0x94D049BB133111EB)
_S12 = np.uint64(12)
_S27 = np.uint64(27)
_S30 = np.uint64(30)
_S31 = np.uint64(31)
_ONE = np.uint64(1)


@kernel
def _mix(z: np.uint64) -> np.uint64:
    z = (z ^ (z >> _S30)) * _MIX_1
    z = (z ^ (z >> _S27)) * _MIX_2
    return z ^ (z >> _S31)


@kernel
def _absorb(state: np.uint64, part: int) -> np.uint64:
    return _mix(state + _GOLDEN * (np.uint64(part) + _ONE))


@kernel
def uniform(seed: int, vehicle: int, tick: int, stream: int) -> float:
    """A number in (0, 1), never 0 or 1; all four parts of the key are whole and not negative."""
    bits = _absorb(_absorb(_absorb(_absorb(_GOLDEN, seed), vehicle), tick), stream)
    # 52 bits and a half: with 53 the half would be rounded away, and the greatest number be 1.
    return (float(bits >> _S12) + 0.5) * (1.0 / 4503599627370496.0)


@kernel
def uniforms(seed: int, stream: int, numbers: Floats) -> None:
    """Fill ``numbers`` (V,) with one for each vehicle, at tick 0."""
    for i in range(numbers.shape[0]):
        numbers[i] = uniform(seed, i, 0, stream)


@kernel
def _tail(r: float) -> float:
    """AS 241 beyond |p - 0.5| = 0.425; ``r`` is sqrt(-log of the smaller tail)."""
    if r <= 5.0:
        r -= 1.6
        top = 7.74545014278341407640e-4
        top = top * r + 2.27238449892691845833e-2
        top = top * r + 2.41780725177450611770e-1
        top = top * r + 1.27045825245236838258e0
        top = top * r + 3.64784832476320460504e0
        top = top * r + 5.76949722146069140550e0
        top = top * r + 4.63033784615654529590e0
        top = top * r + 1.42343711074968357734e0
        low = 1.05075007164441684324e-9
        low = low * r + 5.47593808499534494600e-4
        low = low * r + 1.51986665636164571966e-2
        low = low * r + 1.48103976427480074590e-1
        low = low * r + 6.89767334985100004550e-1
        low = low * r + 1.67638483018380384940e0
        low = low * r + 2.05319162663775882187e0
        return top / (low * r + 1.0)
    r -= 5.0
    top = 2.01033439929228813265e-7
    top = top * r + 2.71155556874348757815e-5
    top = top * r + 1.24266094738807843860e-3
    top = top * r + 2.65321895265761230930e-2
    top = top * r + 2.96560571828504891230e-1
    top = top * r + 1.78482653991729133580e0
    top = top * r + 5.46378491116411436990e0
    top = top * r + 6.65790464350110377720e0
    low = 2.04426310338993978564e-15
    low = low * r + 1.42151175831644588870e-7
    low = low * r + 1.84631831751005468180e-5
    low = low * r + 7.86869131145613259100e-4
    low = low * r + 1.48753612908506148525e-2
    low = low * r + 1.36929880922735805310e-1
    low = low * r + 5.99832206555887937690e-1
    return top / (low * r + 1.0)


@kernel
def inverse_normal(p: float) -> float:
    """The standard normal's quantile at ``p`` in (0, 1)."""
    q = p - 0.5
    if abs(q) > 0.425:
        z = _tail(math.sqrt(-math.log(p if q < 0.0 else 1.0 - p)))
        return -z if q < 0.0 else z
    r = 0.180625 - q * q
    top = 2.50908092873012267270e3
    top = top * r + 3.34305755835881281050e4
    top = top * r + 6.72657709270087008530e4
    top = top * r + 4.59219539315498714570e4
    top = top * r + 1.37316937655094611250e4
    top = top * r + 1.97159095030655144270e3
    top = top * r + 1.33141667891784377450e2
    top = top * r + 3.38713287279636660800e0
    low = 5.22649527885285456100e3
    low = low * r + 2.87290857357219426740e4
    low = low * r + 3.93078958000927106100e4
    low = low * r + 2.12137943015865958670e4
    low = low * r + 5.39419602142475110770e3
    low = low * r + 6.87187007492057908300e2
    low = low * r + 4.23133307016009112520e1
    return q * top / (low * r + 1.0)


@kernel
def normal(seed: int, vehicle: int, tick: int, stream: int) -> float:
    """A standard normal number."""
    return inverse_normal(uniform(seed, vehicle, tick, stream))
