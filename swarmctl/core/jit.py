"""The one door to Numba.

Kernels are plain scalar Python, decorated with :func:`kernel`.  They are compiled into whatever calls them
and are never cached on their own: Numba looks for changes only in the file where a *cached* function is
defined, so a cached inner function would go stale silently.  Only the entry points that ``core/bind.py``
makes are cached, in a folder named by a digest of every source in this package.
"""

from collections.abc import Callable
from typing import Any, TypeVar, cast

from numba import njit

F = TypeVar("F", bound=Callable[..., object])
_njit: Callable[..., Any] = njit  # its stubs do not know all of its options


def kernel(function: F) -> F:
    """Compile ``function`` into its callers; its types and its result stay those of plain Python.

    It makes no arrays, so it needs not count who holds them: Numba's atomic counting of every array argument of
    every call took more than half of a study's time.  (``_nrt`` is Numba's own switch for its runtime.)
    """
    return cast(F, _njit(error_model="numpy", _nrt=False)(function))


def inlined_kernel(function: F) -> F:
    """A kernel that is copied into each that calls it: handing on its arrays would cost more than it does."""
    return cast(F, _njit(error_model="numpy", _nrt=False, forceinline=True)(function))


def allocating_kernel(function: F) -> F:
    """A kernel that makes arrays of its own."""
    return cast(F, _njit(error_model="numpy", _nrt=True)(function))
