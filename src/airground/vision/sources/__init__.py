"""Where frames come from: files, folders, cameras, streams."""

from airground.vision.sources.ahead import ahead
from airground.vision.sources.folder import ImageFolder
from airground.vision.sources.generated import GeneratedSource
from airground.vision.sources.live import LiveSource
from airground.vision.sources.opening import Backend, live_source, open_source
from airground.vision.sources.protocol import FrameSource, SourceHealth, SourceState
from airground.vision.sources.video_file import VideoFile

__all__ = [
    "Backend",
    "FrameSource",
    "GeneratedSource",
    "ImageFolder",
    "LiveSource",
    "SourceHealth",
    "SourceState",
    "VideoFile",
    "ahead",
    "live_source",
    "open_source",
]
