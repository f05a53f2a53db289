"""Plain shapes to SVG and pixels, without matplotlib: how arenas, robots, networks and paths show themselves.

It is a layer below `world`, because it has only points, colors, and text. An object with a picture (an `Arena`, a
`JyroPlatform`, a `Genome`, a `Trajectory`) returns it as a `Picture` of shapes, which notebooks show. The report draws
the same shapes into its figures, and only the report imports matplotlib. Notebooks show results as a `Card` of tables
and pictures.
"""

from ._card import Bar, Card, ShownAsCard, Spark, Table, card_of, picture_of, widget_of
from ._colors import PENS, Ink, hex_of, line_pen, rgb_of, theme_rules, themed, themed_color, themed_file
from ._picture import FONT, Disc, Line, Picture, Point, Shape, Text
from ._pixels import to_image, to_png

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
    "ShownAsCard",
    "Spark",
    "Table",
    "Text",
    "card_of",
    "hex_of",
    "line_pen",
    "picture_of",
    "rgb_of",
    "theme_rules",
    "themed",
    "themed_color",
    "themed_file",
    "to_image",
    "to_png",
    "widget_of",
]
