"""A camera video that this process draws and encodes."""

from collections.abc import Mapping
from pathlib import Path

from drake_tracker.run.video_file import VideoFile
from drake_tracker.run.video_page import CameraSight, PageState, VideoPage
from drake_tracker.tasks.filming import FRAMES_PER_SECOND


class DrawnVideo:
    """Draws frames and appends them to a video file. It is a `FrameSink`.

    Args:
        path: MP4 file to write.
        page: draws the frames.
    """

    wanted = True
    """Whether the next frame is wanted, which it always is."""

    def __init__(self, path: Path, page: VideoPage) -> None:
        self._page, self._file = page, VideoFile(path, FRAMES_PER_SECOND, page.size)

    def write(self, sights: Mapping[str, CameraSight], state: PageState) -> None:
        """Draws a frame and appends it, see `VideoPage.draw`. Raises DrakeTrackerError when it cannot be written."""
        self._file.write(self._page.draw(sights, state))

    def close(self) -> None:
        """Completes the file. A second call does nothing."""
        self._file.close()
