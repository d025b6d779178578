"""How the figures look: letters, lines and colours, the same in all of them."""

from __future__ import annotations

import io
import os
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import IO, Any

import matplotlib as mpl
import numpy as np
from matplotlib.colors import Colormap, ListedColormap
from matplotlib.figure import Figure

__all__ = ["BLUE", "COLUMN", "INK", "PAGE", "QUALITY", "RED", "REJECTED", "SINGULAR", "Picture", "readable", "styled"]


#: Widths of a figure: one column of a journal's page, and the whole page [inches].
COLUMN, PAGE = 3.5, 7.16
#: Colours: ink of lines and letters, singular grasps, charts under expansion, and bounded charts (the paper's Fig. 7).
INK, SINGULAR, RED, BLUE = "#1c1c1c", "#000000", "#c8452f", "#4f7fb5"
#: Colour of charts that do not meet the requirements.
REJECTED = "#cfcfcf"

STYLE: dict[str, str | float | bool] = {
    "font.family": "STIXGeneral",
    "mathtext.fontset": "stix",
    "font.size": 8.5,
    "axes.titlesize": 9.0,
    "axes.labelsize": 8.5,
    "xtick.labelsize": 7.5,
    "ytick.labelsize": 7.5,
    "legend.fontsize": 7.5,
    "legend.frameon": False,
    "axes.linewidth": 0.6,
    "axes.edgecolor": INK,
    "axes.labelcolor": INK,
    "text.color": INK,
    "xtick.color": INK,
    "ytick.color": INK,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "xtick.minor.width": 0.4,
    "ytick.minor.width": 0.4,
    "lines.linewidth": 1.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.unicode_minus": True,
    "savefig.dpi": 200,
    "figure.dpi": 200,
}


class Picture(Figure):
    """A figure that a notebook shows and ``savefig`` writes; it belongs to no window, so none has to be closed."""

    def _repr_png_(self) -> bytes:
        stream = io.BytesIO()
        self.savefig(stream, format="png")
        return stream.getvalue()

    def savefig(self, fname: str | os.PathLike[str] | IO[bytes], **options: Any) -> None:
        """Write the figure as :meth:`matplotlib.figure.Figure.savefig` does, in the style it was drawn in."""
        with styled():
            super().savefig(fname, **options)


#: Matplotlib has one style in the whole process: one thread draws at a time.
_DRAWING = threading.RLock()


@contextmanager
def styled() -> Iterator[None]:
    """Draw in this style, whatever the user has set."""
    with _DRAWING, mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams.update(STYLE)  # type: ignore[arg-type, unused-ignore]  # names of settings are a type since 3.11
        yield


def readable(value: float, digits: int = 3) -> str:
    """A number for people, as matplotlib writes mathematics: 0.36, 12200, 1.32 x 10^8."""
    if value == 0.0 or 1e-3 <= abs(value) < 1e6:
        return f"{value:.{digits}g}" if abs(value) < 10.0**digits else f"{round(value)}"
    mantissa, _, exponent = f"{value:.{digits - 1}e}".partition("e")
    return rf"${mantissa} \times 10^{{{int(exponent)}}}$"


def _quality_colours() -> Colormap:
    """Dark red over orange and yellow to light green; lightness grows evenly, so that it also reads in grey.

    The path is drawn in OKLCh: lightness is linear, hue turns from red to green.
    """
    t = np.linspace(0.0, 1.0, 256)
    lightness = 0.45 + 0.43 * t**0.85
    hue = np.radians(26.0 + 119.0 * t**1.15)
    chroma = 0.17
    a, b = chroma * np.cos(hue), chroma * np.sin(hue)
    lms = np.stack(
        [
            lightness + 0.3963377774 * a + 0.2158037573 * b,
            lightness - 0.1055613458 * a - 0.0638541728 * b,
            lightness - 0.0894841775 * a - 1.2914855480 * b,
        ]
    )
    to_rgb = np.array(
        [
            [4.0767416621, -3.3077115913, 0.2309699292],
            [-1.2684380046, 2.6097574011, -0.3413193965],
            [-0.0041960863, -0.7034186147, 1.7076147010],
        ]
    )
    linear = np.clip(to_rgb @ lms**3, 0.0, 1.0)
    screen = np.where(linear > 0.0031308, 1.055 * linear ** (1.0 / 2.4) - 0.055, 12.92 * linear)
    return ListedColormap(screen.T, name="graspatlas")


#: From red, low quality, to green, high quality.
QUALITY = _quality_colours()
