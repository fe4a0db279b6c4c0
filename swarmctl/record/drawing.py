"""How all pictures look: colours, quiet axes, and a PNG that is written whole.

Colours are Okabe and Ito's, which colour-blind readers can tell apart; whatever has a colour also differs in shape
or place.
"""

from io import BytesIO
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine

from .folder import write_whole

Style = dict[str, Any]  # keyword arguments of matplotlib's

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#7A5195", "#8C6D31")
LIGHT_COLOURS = ("#CC79A7", "#E69F00", "#56B4E9")  # these take dark letters
INK, GREY, PALE, GROUND = "#1F2933", "#6B7785", "#D5DAE0", "#EEF1F4"
DPI = 110


def new_figure(width: float, height: float) -> Figure:
    """An empty figure of that many inches, which lays itself out and needs no display."""
    layout = ConstrainedLayoutEngine(w_pad=0.14, h_pad=0.12)
    figure = Figure(figsize=(width, height), dpi=DPI, layout=layout)
    FigureCanvasAgg(figure)
    return figure


def plain(axes: Axes) -> None:
    """No frame, quiet ticks."""
    axes.tick_params(length=0, colors=GREY, labelsize=9)
    for spine in axes.spines.values():
        spine.set_visible(False)


def save(figure: Figure, path: Path) -> None:
    """Write the figure as PNG.  Raises RunFolderError where ``path`` cannot be written."""
    image = BytesIO()
    figure.savefig(image, format="png", facecolor="white")
    write_whole(path, image.getvalue())
