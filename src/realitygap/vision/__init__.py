"""What cameras see: arrays and pictures in, values out. OpenCV comes with the extra `vision`."""

from ._tag_family import CORNER_FAMILY, FAMILIES, tag_bits
from ._tag_layout import CORNER_SIZE_M, RobotTag, corner_tags
from ._tag_print import print_tags
from ._track import Track, cells_along, track_of
from ._track_align import Beginning, find_beginning
from ._track_camera import Camera, fit_camera
from ._track_lens import Lens, fit_lens, read_lens
from ._track_live import LiveTrack
from ._track_overlay import draw_overlay, save_overlay
from ._track_source import CameraDevice, Source, VideoFile, open_source
from ._track_video import Marks, Tracked, track_video
from ._tracker import Sightings, Tracker, gray_of

__all__ = [
    "CORNER_FAMILY",
    "CORNER_SIZE_M",
    "FAMILIES",
    "Beginning",
    "Camera",
    "CameraDevice",
    "Lens",
    "LiveTrack",
    "Marks",
    "RobotTag",
    "Sightings",
    "Source",
    "Track",
    "Tracked",
    "Tracker",
    "VideoFile",
    "cells_along",
    "corner_tags",
    "draw_overlay",
    "find_beginning",
    "fit_camera",
    "fit_lens",
    "gray_of",
    "open_source",
    "print_tags",
    "read_lens",
    "save_overlay",
    "tag_bits",
    "track_of",
    "track_video",
]
