"""DPSO-U (Sánchez-García et al. 2019), the paper's own baseline: MDC's rule without the random vector.

It is given MDC's jump-out and return visit; without them it hardly ever leaves its first cluster and could not
reach Table 2's last column at all.
"""

from . import mdc

TITLE = "baseline of the paper: MDC without a random vector"
PARAMETERS = tuple(p._replace(default=0.0, search=None) if p.name == "random" else p for p in mdc.PARAMETERS)
MEMORY = mdc.MEMORY
LISTS = mdc.LISTS
start, tell, step = mdc.start, mdc.tell, mdc.step
