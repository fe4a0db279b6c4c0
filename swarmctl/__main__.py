"""``python -m swarmctl`` is ``swarmctl``."""

from .cli import main

main()
