"""Cameras: pictures in, values out. OpenCV comes with the extra `vision`.

Pen traces on a photograph of a sheet: a `SheetLayout` is the printed sheet of an arena, with its grid, four tags, the
start, and a box to try each pen in. `score_sheet` finds the sheet and returns the cells that each pen's trace crosses,
with their confidence. Its steps are `find_sheet`, `rectify`, `ink_density`, `separate_pens`, `follow_traces`
and `visited_cells`.

A map of ROS is a picture, too: `arena_of_map` traces its free space, and `save_map` draws an arena.

A robot under a camera: `track_video` follows the tag on a robot in an arena with four corner tags.
"""

from ._cells import visited_cells
from ._find import Sheet, find_sheet, rectify
from ._ink import ink_density
from ._layout import PEN_NAMES, SheetLayout
from ._overlay import overlay_png
from ._pens import PenMaps, separate_pens
from ._photo import photo_bytes, photo_hash, read_photo
from ._pixels import View, raster, to_pixels
from ._print import sheet_pdf, sheet_tiles
from ._ros_map import arena_of_map, read_map, save_map
from ._score import SheetScore, TraceScore, score_sheet
from ._sheet_trials import SheetTrials, trials_on_sheet
from ._tag_print import print_tags
from ._tags import CORNER_FAMILY, CORNER_SIZE_M, FAMILIES, RobotTag, corner_tags, tag_bits
from ._trace import Trace, follow_traces
from .track._align import Beginning, find_beginning
from .track._camera import Camera
from .track._lens import Lens, fit_lens, read_lens
from .track._overlay import draw_overlay, save_overlay
from .track._source import CameraDevice, Source, VideoFile, open_source
from .track._track import Track
from .track._tracker import Tracker, gray_of
from .track._video import LiveTrack, Marks, Tracked, track_video

__all__ = [
    "CORNER_FAMILY",
    "CORNER_SIZE_M",
    "FAMILIES",
    "PEN_NAMES",
    "Beginning",
    "Camera",
    "CameraDevice",
    "Lens",
    "LiveTrack",
    "Marks",
    "PenMaps",
    "RobotTag",
    "Sheet",
    "SheetLayout",
    "SheetScore",
    "SheetTrials",
    "Source",
    "Trace",
    "TraceScore",
    "Track",
    "Tracked",
    "Tracker",
    "VideoFile",
    "View",
    "arena_of_map",
    "corner_tags",
    "draw_overlay",
    "find_beginning",
    "find_sheet",
    "fit_lens",
    "follow_traces",
    "gray_of",
    "ink_density",
    "open_source",
    "overlay_png",
    "photo_bytes",
    "photo_hash",
    "print_tags",
    "raster",
    "read_lens",
    "read_map",
    "read_photo",
    "rectify",
    "save_map",
    "save_overlay",
    "score_sheet",
    "separate_pens",
    "sheet_pdf",
    "sheet_tiles",
    "tag_bits",
    "to_pixels",
    "track_video",
    "trials_on_sheet",
    "visited_cells",
]
