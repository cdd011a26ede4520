"""The stretch of a dataset's film that belongs to a window, as a video of its own."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Iterator
from contextlib import closing
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any

from markerscope.solver.core.errors import InputError
from markerscope.solver.datasets.recording import Film
from markerscope.solver.io.atomic import atomic_path

if TYPE_CHECKING:
    from av import VideoFrame

_PICTURES = (".jpg", ".jpeg", ".png")
_LARGEST_PICTURE = 100 * 1024 * 1024
_UNPACK = "download it again"


def timing(film: Film) -> tuple[float, int]:
    """Rate in Hz and number of frames of a film; 0 frames where its container does not say."""
    if not film.camera:
        from markerscope.solver.video.frames import announced

        rate, count = announced(film.path)
        return film.rate or rate, count
    with closing(_Pictures(film)) as pictures:
        if not pictures.names:
            raise InputError(f"holds no pictures of {film.camera}", film.path, _UNPACK)
        return film.rate or 30.0, len(pictures.names)


def write_stretch(film: Film, start: float, stop: float, out: Path) -> float:
    """Write the frames between two times as a video; returns the time of the first, s from the film's first frame.

    Raises
    ------
    InputError : there are none, or they cannot be read
    """
    import av

    rate = timing(film)[0]
    first, last = max(0, round(start * rate)), round(stop * rate)
    with atomic_path(out) as temporary:
        written = 0
        with av.open(str(temporary), "w", format="mp4") as container:
            stream: Any = None
            for picture in _frames(film, first, last):
                width, height = (side // film.shrink // 2 * 2 for side in (picture.width, picture.height))
                if stream is None:
                    exact = Fraction(rate).limit_denominator(1001)
                    stream = container.add_stream("libx264", rate=exact, options={"crf": "18", "preset": "veryfast"})
                    stream.width, stream.height, stream.pix_fmt = width, height, "yuv420p"
                plain = picture.reformat(width=stream.width, height=stream.height, format="yuv420p")
                frame = av.VideoFrame.from_ndarray(plain.to_ndarray(), format="yuv420p")
                container.mux(stream.encode(frame))
                written += 1
            if stream is not None:
                container.mux(stream.encode(None))
        if not written:
            raise InputError(f"shows nothing between {start:g} and {stop:g} s", film.path, _UNPACK)
    return first / rate


def _frames(film: Film, first: int, last: int) -> Iterator[VideoFrame]:
    """Frames ``first`` to ``last``, the last one left out."""
    import av

    if not film.camera:
        from markerscope.solver.video.frames import read_frames

        for _, _, picture in read_frames(film.path, range(first, last)):
            yield av.VideoFrame.from_ndarray(picture, format="rgb24")
        return
    with closing(_Pictures(film)) as pictures:
        for name in pictures.names[first:last]:
            try:
                with av.open(io.BytesIO(pictures.read(name)), "r") as image:
                    yield next(image.decode(video=0))
            except (av.error.FFmpegError, StopIteration, ValueError) as error:
                raise InputError(f"the picture {name} cannot be read", film.path, _UNPACK) from error


class _Pictures:
    """The pictures of one camera in a folder or a ZIP file, by name."""

    def __init__(self, film: Film) -> None:
        self._film = film
        self._zip: zipfile.ZipFile | None = None
        if film.path.is_dir():
            names = [path.relative_to(film.path).as_posix() for path in film.path.rglob("*")]
        else:
            try:
                self._zip = zipfile.ZipFile(film.path)
            except (OSError, zipfile.BadZipFile) as error:
                raise InputError("is not a ZIP file of pictures", film.path, _UNPACK) from error
            names = self._zip.namelist()
        self.names = sorted(n for n in names if film.camera in n and n.lower().endswith(_PICTURES))

    def close(self) -> None:
        if self._zip is not None:
            self._zip.close()

    def read(self, name: str) -> bytes:
        """The bytes of one picture."""
        try:
            if self._zip is None:
                return (self._film.path / name).read_bytes()
            if self._zip.getinfo(name).file_size > _LARGEST_PICTURE:
                raise InputError(f"the picture {name} is too large", self._film.path, _UNPACK)
            return self._zip.read(name)
        except (OSError, zipfile.BadZipFile, RuntimeError, NotImplementedError) as error:
            raise InputError(f"the picture {name} cannot be read", self._film.path, _UNPACK) from error
