"""Plain shapes to SVG and pixels, without matplotlib: how arenas, robots, networks and paths show themselves.

It lies below `world`, because it knows nothing but points, colors and text. What has a picture (an `Arena`, a
`JyroPlatform`, a `Genome`, a `Trajectory`) says so as a `Picture` of shapes, which notebooks show; the report draws the
same shapes into its figures, and matplotlib is imported only there. Results show themselves as a `Card` of tables and
pictures.
"""

from ._card import Bar, Card, Spark, Table
from ._ink import PENS, Ink
from ._picture import FONT, Disc, Line, Picture, Point, Shape, Text
from ._pixels import to_image, to_png
from ._shown import card_of, picture_of, widget_of
from ._theme import theme_rules, themed
from ._x11 import hex_of, rgb_of

__all__ = [
    "FONT",
    "PENS",
    "Bar",
    "Card",
    "Disc",
    "Ink",
    "Line",
    "Picture",
    "Point",
    "Shape",
    "Spark",
    "Table",
    "Text",
    "card_of",
    "hex_of",
    "picture_of",
    "rgb_of",
    "theme_rules",
    "themed",
    "to_image",
    "to_png",
    "widget_of",
]
