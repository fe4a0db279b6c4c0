"""The one door to Numba.

Kernels are plain scalar Python, decorated with :func:`kernel`.  They are compiled into whatever calls them
and are never cached on their own: Numba looks for changes only in the file where a *cached* function is
defined, so a cached inner function would go stale silently.  Only the entry points that ``core/bind.py``
makes are cached, in a folder named by a digest of every source in this package.
"""

from collections.abc import Callable
from typing import TypeVar, cast

from numba import njit

F = TypeVar("F", bound=Callable[..., object])


def kernel(function: F) -> F:
    """Compile ``function`` into its callers; its types and its result stay those of plain Python."""
    return cast(F, njit(error_model="numpy")(function))
