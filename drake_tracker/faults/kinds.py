"""The registry of the faults."""

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from drake_tracker.core.registry import Registry
from drake_tracker.faults import config

if TYPE_CHECKING:
    from drake_tracker.faults.fault import Fault

FAULTS: "Registry[Fault]" = Registry(
    "fault",
    {
        config.CameraDark: "drake_tracker.faults.image_faults:CameraDarkFault",
        config.FrozenImage: "drake_tracker.faults.image_faults:FrozenImageFault",
        config.Flicker: "drake_tracker.faults.image_faults:FlickerFault",
        config.ImageNoise: "drake_tracker.faults.image_faults:ImageNoiseFault",
        config.CameraKnocked: "drake_tracker.faults.camera_faults:CameraKnockedFault",
        config.CameraShake: "drake_tracker.faults.camera_faults:CameraShakeFault",
        config.CameraPan: "drake_tracker.faults.camera_faults:CameraPanFault",
        config.CalibrationWrong: "drake_tracker.faults.camera_faults:CalibrationWrongFault",
        config.CastShadow: "drake_tracker.faults.image_faults:CastShadowFault",
        config.PassingOccluder: "drake_tracker.faults.scene_faults:PassingOccluderFault",
        config.SecondMover: "drake_tracker.faults.scene_faults:SecondMoverFault",
        config.LinkLoss: "drake_tracker.faults.link_faults:LossyLinkFault",
        config.LinkBursts: "drake_tracker.faults.link_faults:LossyLinkFault",
        config.LinkJitter: "drake_tracker.faults.link_faults:LossyLinkFault",
        config.LinkDelay: "drake_tracker.faults.link_faults:LossyLinkFault",
        config.HostStopped: "drake_tracker.faults.host_faults:HostStoppedFault",
        config.TrainStopped: "drake_tracker.faults.train_faults:TrainStoppedFault",
        config.TrainReversed: "drake_tracker.faults.train_faults:TrainReversedFault",
        config.TrainPushed: "drake_tracker.faults.train_faults:TrainPushedFault",
        config.TrainDerailed: "drake_tracker.faults.train_faults:TrainDerailedFault",
        config.TrainMoved: "drake_tracker.faults.train_faults:TrainCarriedFault",
        config.TrainRemoved: "drake_tracker.faults.train_faults:TrainCarriedFault",
        config.HandOverBelt: "drake_tracker.faults.scene_faults:HandOverBeltFault",
        config.EncoderJump: "drake_tracker.faults.scene_faults:EncoderJumpFault",
        config.EncoderStopped: "drake_tracker.faults.scene_faults:EncoderStoppedFault",
        config.StickingJoint: "drake_tracker.faults.arm_faults:StickingJointFault",
        config.SlowGripper: "drake_tracker.faults.arm_faults:SlowGripperFault",
        config.WeakGripper: "drake_tracker.faults.arm_faults:WeakGripperFault",
    },
)
"""Every fault by its settings; the one place where a fault is registered."""


def faults_of(task: str) -> Any:
    """Returns the Union of the settings of the faults that can happen in a task, for its scenario."""
    return FAULTS.union(without=[kind for kind in FAULTS.makers if task not in kind.tasks])  # type: ignore[attr-defined]


def make_faults(settings: Iterable[Any], *, seed: int, **context: Any) -> "tuple[Fault, ...]":
    """Returns the faults of a scenario.

    Args:
        settings: their settings, as the scenario lists them.
        seed: seed of their random draws. Each fault has its own random numbers, by its place in the list.
        **context: what they need to know about the run: ``lag``, the time from an image to the point at the estimator
            [s]; ``table_height`` [m]; ``work_volume``, its lowest and highest corner in W [m]; ``X_WCs``, {side: true
            pose of the camera, a homogeneous matrix (4, 4)}; ``servo_inertia`` of the joints [kg m^2];
            ``finger_stiffness`` [N/m]; ``time_step`` [s]; ``belt_middle`` and ``belt_height``, x and z of the belt in W
            [m].
    """
    return tuple(FAULTS.make(item, seed=seed, number=number, **context) for number, item in enumerate(settings))
