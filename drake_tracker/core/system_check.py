"""Checks whether this machine can run the project, and says what to do when it cannot."""

import ctypes
import glob
import importlib.metadata
import platform
import subprocess
import sys
from functools import cache

from drake_tracker.core.errors import DrakeTrackerError, MachineError
from drake_tracker.core.models_path import models_path

APT_LINE = "apt-get install -y libglib2.0-0 libegl1 libgl1-mesa-dri"
PACKAGES = ("drake", "numpy", "scipy", "opencv-python-headless", "matplotlib", "PyYAML")
PYTHONS = ((3, 11), (3, 13))

_MESA_DRIVERS = ("/usr/lib/*/dri/swrast_dri.so", "/usr/lib/*/libgallium*.so", "/usr/lib*/dri/swrast_dri.so")

# Renders one small image. It runs in a child process, which the renderer crashes when there is no Mesa driver.
_PROBE = """
from pydrake.geometry import ClippingRange, ColorRenderCamera, RenderCameraCore
from pydrake.geometry import MakeRenderEngineVtk, RenderEngineVtkParams
from pydrake.math import RigidTransform
from pydrake.systems.sensors import CameraInfo, ImageRgba8U

core = RenderCameraCore("probe", CameraInfo(8, 8, 1.0), ClippingRange(0.1, 10.0), RigidTransform())
image = ImageRgba8U(8, 8)
MakeRenderEngineVtk(RenderEngineVtkParams()).RenderColorImage(ColorRenderCamera(core), image)
assert image.data[..., 3].any(), "the image is empty"
"""


def probe_renderer(timeout: float = 60.0) -> str | None:
    """Renders one image in a child process.

    Args:
        timeout: wall time after which the renderer counts as broken [s].

    Returns None when it works, otherwise one line that says what went wrong.
    """
    try:
        child = subprocess.run([sys.executable, "-c", _PROBE], capture_output=True, text=True, timeout=timeout)
    except subprocess.TimeoutExpired:
        return f"it made no image within {timeout:g} s"
    if child.returncode == 0:
        return None
    if child.returncode < 0:
        return f"it crashed with signal {-child.returncode}, as it does without a Mesa driver"
    return (child.stderr.strip().splitlines() or [f"exit code {child.returncode}"])[-1]


@cache  # which keeps no errors: a renderer that does not work is tried again
def require_renderer() -> None:
    """Raises MachineError when this machine cannot render. Call it before the first image.

    It takes about a second, until the renderer has worked once in this process.
    """
    trouble = probe_renderer()
    if trouble:
        raise MachineError(f"the renderer does not work ({trouble}); as root: {APT_LINE}")


def examine() -> list[tuple[str, str, bool]]:
    """Returns rows (name, value, whether it is right) for Python, packages, libraries, models and the renderer."""
    low, high = PYTHONS
    findings = [("Python", platform.python_version(), low <= sys.version_info[:2] <= high)]
    for package in PACKAGES:
        try:
            findings.append((package, importlib.metadata.version(package), True))
        except importlib.metadata.PackageNotFoundError:
            findings.append((package, "missing: make setup", False))
    for package, library in (("libglib2.0-0", "libglib-2.0.so.0"), ("libegl1", "libEGL.so.1")):
        try:
            ctypes.CDLL(library)
            findings.append((package, library, True))
        except OSError:
            findings.append((package, f"{library} missing: {APT_LINE}", False))
    drivers = [path for pattern in _MESA_DRIVERS for path in glob.glob(pattern)]
    findings.append(("libgl1-mesa-dri", drivers[0] if drivers else f"missing: {APT_LINE}", bool(drivers)))
    try:
        findings.append(("models", str(models_path()), True))
    except DrakeTrackerError as error:
        findings.append(("models", str(error), False))
    trouble = probe_renderer()
    findings.append(("renderer", trouble or "works", not trouble))
    return findings


def main() -> int:
    """Prints the findings as a table. Returns 0 when the machine can run the project, else 2."""
    findings = examine()
    for what, value, ok in findings:
        print(f"{'ok ' if ok else 'BAD'}  {what:<22}  {value}")
    good = all(ok for _, _, ok in findings)
    if not good:
        print("this machine cannot run drake-tracker yet: see the lines marked BAD", file=sys.stderr)
    return 0 if good else 2
