"""A centroid as a point in pixels, for a camera without calibration, as a Drake System."""

from pydrake.systems.framework import BasicVector, Context, InputPort, LeafSystem, OutputPort

from drake_tracker.core.messages import Centroid, TrackPoint, message_size


class PixelPointSystem(LeafSystem):
    """Outputs a centroid as a point whose unit of length is the pixel, so that it can be filtered like any other.

    .. pydrake_system::

        name: PixelPointSystem
        input_ports:
        - centroid
        output_ports:
        - point

    A `Localiser` for one camera that is not calibrated. ``centroid`` is a `Centroid` vector [px], and ``point`` a
    `TrackPoint` vector with x = u, y = v and z = 0 [px], the same stamp and no gap. When the centroid is invalid, so is
    the point, with zeros beside its stamp. There is no state: ``point`` is that of the present ``centroid``.
    """

    def __init__(self) -> None:
        super().__init__()
        self._centroid = self.DeclareVectorInputPort("centroid", message_size(Centroid))
        self._point = self.DeclareVectorOutputPort("point", message_size(TrackPoint), self._calc_point)

    @property
    def centroid_ports(self) -> tuple[InputPort, ...]:
        """The input ``centroid``."""
        return (self._centroid,)

    @property
    def point_port(self) -> OutputPort:
        """The output ``point``."""
        return self._point

    def _calc_point(self, context: Context, output: BasicVector) -> None:
        centroid = Centroid(self._centroid.Eval(context))
        u, v = (centroid.u, centroid.v) if centroid.valid else (0.0, 0.0)
        output.SetFromVector([centroid.stamp, u, v, 0.0, 0.0, centroid.valid])
