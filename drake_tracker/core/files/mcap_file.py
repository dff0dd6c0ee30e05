"""MCAP files with the message schemas of Foxglove, for Foxglove and Rerun. Needs the package of the extra ``mcap``."""

import errno
import logging
import os
import re
import shutil
import struct
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import ArrayLike

from drake_tracker.core.errors import DrakeTrackerError, load_extra
from drake_tracker.core.files.atomic_file import unwritable

WORLD = "world"
"""Name of the world frame W in the file."""
_PACKAGE = "drake_tracker"
"""Package of the messages in Protocol Buffers that Foxglove does not define."""
_NANOSECONDS = 10**9
_JPEG_QUALITY = 85
_FLUSH_AFTER = 1.0
"""Time of the run [s] after which written data goes to the disk and survives a killed process."""
_FULL = 1 << 20
"""Free space [bytes] below which a disk counts as full."""
_VARINT, _DOUBLE, _BYTES = 0, 1, 2
"""Wire types."""


class McapFile:
    """An MCAP file that is written message by message.

    Times are those of the run, counted from its start [s]. Messages need not be written in the order of their times.

    Args:
        path: file to write; an existing file is replaced.

    Raises DrakeTrackerError when the extra is not installed, or the file cannot be written.
    """

    def __init__(self, path: Path) -> None:
        load_extra("foxglove", "mcap", path.name)
        import foxglove
        from foxglove import channels, messages

        self._make_channel: Any = foxglove.Channel
        self._make_schema: Any = foxglove.Schema
        self._channels: Any = channels
        self._messages: Any = messages
        self._context = foxglove.Context()
        self._open: dict[str, Any] = {}
        self._flushed = 0.0
        self._path = path
        self._failure: DrakeTrackerError | None = None
        logging.getLogger("foxglove").setLevel(logging.CRITICAL + 1)
        try:
            self._writer = foxglove.open_mcap(path, allow_overwrite=True, context=self._context)
        except OSError as error:
            raise unwritable(path, error) from None

    def image(self, topic: str, time: float, frame: str, rgb: np.ndarray) -> None:
        """Writes an image as ``foxglove.CompressedImage`` in JPEG format.

        Args:
            topic: of the message.
            time: of capture [s].
            frame: name of the camera's frame.
            rgb: uint8 image, shape (height, width, 3 or 4); a fourth channel is ignored.
        """
        code = cv2.COLOR_RGBA2BGR if rgb.shape[2] == 4 else cv2.COLOR_RGB2BGR
        _, data = cv2.imencode(".jpg", cv2.cvtColor(rgb, code), [cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY])
        self._log(topic, "CompressedImage", time, timestamp=True, frame_id=frame, data=data.tobytes(), format="jpeg")

    def pixel(self, topic: str, time: float, u: float, v: float, diameter: float) -> None:
        """Writes a circle around a pixel as ``foxglove.ImageAnnotations``, for views of images.

        Args:
            topic: of the message.
            time: of capture of the image [s].
            u: to the right [px].
            v: downwards [px].
            diameter: of the circle [px].
        """
        m = self._messages
        circle = m.CircleAnnotation(
            timestamp=self._stamp(time),
            position=m.Point2(x=u, y=v),
            diameter=diameter,
            thickness=2.0,
            fill_color=m.Color(r=0.0, g=0.0, b=0.0, a=0.0),  # absent, it is null in the schemas of Foxglove
            outline_color=m.Color(r=1.0, g=0.69, b=0.0, a=1.0),
        )
        self._log(topic, "ImageAnnotations", time, circles=[circle])

    def line(self, topic: str, time: float, pixels: np.ndarray) -> None:
        """Writes a line through pixels (n, 2) [px] as ``foxglove.ImageAnnotations``, for views of images."""
        m = self._messages
        line = m.PointsAnnotation(
            timestamp=self._stamp(time),
            type=m.PointsAnnotationType.LineStrip,
            points=[m.Point2(x=u, y=v) for u, v in pixels.tolist()],
            outline_color=m.Color(r=0.3, g=0.76, b=1.0, a=1.0),
            thickness=2.0,
        )
        self._log(topic, "ImageAnnotations", time, points=[line])

    def calibration(
        self, topic: str, time: float, frame: str, size: tuple[int, int], K: np.ndarray, distortion: np.ndarray
    ) -> None:
        """Writes a pinhole camera as ``foxglove.CameraCalibration``.

        Args:
            topic: of the message.
            time: from which it holds [s].
            frame: name of the camera's frame, x to the right, y down.
            size: (width, height) of the image [px].
            K: intrinsic matrix, shape (3, 3) [px].
            distortion: coefficients in OpenCV's order, shape (5,), (8,) or, of a fisheye, (4,).
        """
        self._log(
            topic,
            "CameraCalibration",
            time,
            timestamp=True,
            frame_id=frame,
            width=size[0],
            height=size[1],
            distortion_model={4: "kannala_brandt", 5: "plumb_bob", 8: "rational_polynomial"}[len(distortion)],
            D=[float(value) for value in distortion],
            K=np.ravel(K).tolist(),
            R=np.eye(3).ravel().tolist(),
            P=np.column_stack([K, np.zeros(3)]).ravel().tolist(),
        )

    def transforms(self, topic: str, time: float, poses: Mapping[str, np.ndarray]) -> None:
        """Writes frames as ``foxglove.FrameTransforms``.

        Args:
            topic: of the message.
            time: at which the frames are there [s].
            poses: {name of the frame F: X_WF, shape (4, 4) [m]}.
        """
        from scipy.spatial.transform import Rotation  # slow to load

        m = self._messages
        rows = []
        for name, X_WF in poses.items():
            p, q = X_WF[:3, 3].tolist(), Rotation.from_matrix(X_WF[:3, :3]).as_quat().tolist()
            rows.append(
                m.FrameTransform(
                    timestamp=self._stamp(time),
                    parent_frame_id=WORLD,
                    child_frame_id=name,
                    translation=m.Vector3(x=p[0], y=p[1], z=p[2]),
                    rotation=m.Quaternion(x=q[0], y=q[1], z=q[2], w=q[3]),
                )
            )
        self._log(topic, "FrameTransforms", time, transforms=rows)

    def points(self, topic: str, time: float, points: ArrayLike) -> None:
        """Writes points (n, 3) [m] in W as ``foxglove.PointCloud``.

        ``foxglove.Point3InFrame`` would be simpler, but neither Foxglove nor Rerun shows it.
        """
        m, size = self._messages, np.dtype("<f8").itemsize
        number = m.PackedElementFieldNumericType.Float64
        self._log(
            topic,
            "PointCloud",
            time,
            timestamp=True,
            frame_id=WORLD,
            pose=self._pose(np.zeros(3), [1.0, 0.0, 0.0, 0.0]),
            point_stride=3 * size,
            fields=[m.PackedElementField(name=axis, offset=k * size, type=number) for k, axis in enumerate("xyz")],
            data=np.asarray(points, dtype="<f8").tobytes(),
        )

    def pose(self, topic: str, time: float, p_WO: ArrayLike, quaternion: ArrayLike) -> None:
        """Writes the pose of an object in W as ``foxglove.PoseInFrame``.

        Args:
            topic: of the message.
            time: of the message [s].
            p_WO: position, shape (3,) [m].
            quaternion: orientation (w, x, y, z), shape (4,).
        """
        pose = self._pose(p_WO, quaternion)
        self._log(topic, "PoseInFrame", time, timestamp=True, frame_id=WORLD, pose=pose)

    def path(self, topic: str, time: float, points: np.ndarray, yaws: np.ndarray) -> None:
        """Writes points (n, 3) [m] in W and their directions of travel (n,) [rad] as ``foxglove.PosesInFrame``."""
        turns = np.column_stack([np.cos(yaws / 2), np.zeros((len(yaws), 2)), np.sin(yaws / 2)])
        poses = [self._pose(p_WQ, turn) for p_WQ, turn in zip(points, turns)]
        self._log(topic, "PosesInFrame", time, timestamp=True, frame_id=WORLD, poses=poses)

    def joints(
        self, topic: str, time: float, names: Iterable[str], q: ArrayLike, v: ArrayLike, effort: ArrayLike | None = None
    ) -> None:
        """Writes the joints of an arm as ``foxglove.JointStates``.

        Args:
            topic: of the message.
            time: of the state [s].
            names: of the joints, n in all.
            q: positions, shape (n,) [rad].
            v: velocities, shape (n,) [rad/s].
            effort: torques, shape (n,) [N m], or None.
        """
        given = (q, v) if effort is None else (q, v, effort)
        columns = [np.asarray(column, dtype=float).tolist() for column in given]
        keys = ("position", "velocity", "effort")
        make = self._messages.JointState
        joints = [make(name=name, **dict(zip(keys, row))) for name, row in zip(names, zip(*columns))]
        self._log(topic, "JointStates", time, timestamp=True, joints=joints)

    def note(self, topic: str, time: float, text: str) -> None:
        """Writes a line of text as ``foxglove.Log``."""
        level = self._messages.LogLevel.Info
        self._log(topic, "Log", time, timestamp=True, level=level, message=text, name=topic)

    def values(self, topic: str, time: float, values: Mapping[str, float]) -> None:
        """Writes named numbers for plots, as a message in Protocol Buffers with a ``double`` for each.

        Args:
            topic: of the message.
            time: of the message [s].
            values: {name: number}, the same names each time, identifiers.
        """
        if topic not in self._open:
            message = re.sub(r"\W", "_", topic.strip("/"))
            schema = self._make_schema(
                name=f"{_PACKAGE}.{message}", encoding="protobuf", data=number_schema(_PACKAGE, message, list(values))
            )
            self._open[topic] = self._make_channel(
                topic, schema=schema, message_encoding="protobuf", context=self._context
            )
        self._write(self._open[topic].log, encode_numbers(values.values()), log_time=_nanoseconds(time))

    def close(self) -> None:
        """Completes the file. May be called again. Raises DrakeTrackerError when it cannot be written."""
        if self._failure is None:
            self._write(self._writer.close)

    def _write(self, act: Callable[..., object], *arguments: Any, **options: Any) -> None:
        """Calls the library. Raises DrakeTrackerError when the file cannot be written, and from then on."""
        if self._failure is not None:
            raise self._failure
        try:
            act(*arguments, **options)
        except (RuntimeError, OSError) as error:  # its message does not say why
            full = shutil.disk_usage(self._path.parent).free < _FULL
            reason = OSError(errno.ENOSPC, os.strerror(errno.ENOSPC)) if full else OSError(str(error))
            self._failure = unwritable(self._path, reason)
            with suppress(RuntimeError, OSError):
                self._writer.close()  # the library would report it once more at the end of the process
            raise self._failure from None

    def _pose(self, p_WO: ArrayLike, quaternion: ArrayLike) -> Any:
        m = self._messages
        x, y, z = np.asarray(p_WO, dtype=float).tolist()
        qw, qx, qy, qz = np.asarray(quaternion, dtype=float).tolist()
        return m.Pose(position=m.Vector3(x=x, y=y, z=z), orientation=m.Quaternion(x=qx, y=qy, z=qz, w=qw))

    def _stamp(self, time: float) -> Any:
        return self._messages.Timestamp(*divmod(_nanoseconds(time), _NANOSECONDS))

    def _log(self, topic: str, schema: str, time: float, timestamp: bool = False, **fields: Any) -> None:
        if topic not in self._open:
            self._open[topic] = getattr(self._channels, f"{schema}Channel")(topic, context=self._context)
        if timestamp:
            fields["timestamp"] = self._stamp(time)
        self._write(self._open[topic].log, getattr(self._messages, schema)(**fields), log_time=_nanoseconds(time))
        if time >= self._flushed + _FLUSH_AFTER:
            self._flushed = time
            self._write(self._writer.flush)


def _nanoseconds(time: float) -> int:
    return max(0, round(time * _NANOSECONDS))


def number_schema(package: str, message: str, names: Sequence[str]) -> bytes:
    """Returns the ``FileDescriptorSet`` of a message with a ``double`` for each name, numbered from 1.

    Args:
        package: of the message, an identifier.
        message: name of the message, an identifier.
        names: of its fields, identifiers.
    """
    optional, double = 1, 1  # FieldDescriptorProto.Label and .Type
    fields = [
        _text(1, name) + _number(3, place) + _number(4, optional) + _number(5, double)
        for place, name in enumerate(names, 1)
    ]
    descriptor = _text(1, message) + b"".join(_bytes(2, field) for field in fields)
    file = _text(1, f"{package}/{message}.proto") + _text(2, package) + _bytes(4, descriptor) + _text(12, "proto3")
    return _bytes(1, file)


def encode_numbers(values: Iterable[float]) -> bytes:
    """Returns the bytes of a message of `number_schema` with these values, in the order of its names."""
    return b"".join(_tag(place, _DOUBLE) + struct.pack("<d", value) for place, value in enumerate(values, 1))


def _varint(value: int) -> bytes:
    encoded = bytearray()
    while value > 0x7F:
        encoded.append(value & 0x7F | 0x80)
        value >>= 7
    encoded.append(value)
    return bytes(encoded)


def _tag(place: int, wire_type: int) -> bytes:
    return _varint(place << 3 | wire_type)


def _number(place: int, value: int) -> bytes:
    return _tag(place, _VARINT) + _varint(value)


def _bytes(place: int, value: bytes) -> bytes:
    return _tag(place, _BYTES) + _varint(len(value)) + value


def _text(place: int, value: str) -> bytes:
    return _bytes(place, value.encode())
