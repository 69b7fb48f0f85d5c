"""Texts of matplotlib figures, as a reader of the picture sees them."""

import re

from matplotlib import cbook
from matplotlib.text import Text

TEX = re.compile(r"\\[A-Za-z]+|\$")  # a command, or the mark of mathematics


def visible_texts(figure):
    """Every text of a figure, tick labels included, as the drawn artists hold it."""
    figure.canvas.draw()  # the texts of tick labels exist from here on
    return [text for text in figure.findobj(Text) if text.get_visible() and text.get_text()]


def is_typeset(text):
    """Whether matplotlib typesets the mathematics of a text, or draws its source."""
    return text.get_parse_math() and bool(cbook.is_math_text(text.get_text()))


def tex_source(figure):
    """Texts of a figure that show TeX source: a backslash command, or a $ that is not escaped."""
    texts = [text.get_text() for text in visible_texts(figure) if not is_typeset(text)]
    return [text for text in texts if TEX.search(text.replace(r"\$", ""))]
