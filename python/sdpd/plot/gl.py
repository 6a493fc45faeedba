"""Whether pictures in three dimensions can be drawn here: where they cannot, VTK just crashes."""

from __future__ import annotations

import os
import subprocess
import sys

from sdpd import optional

__all__ = ["require_gl"]

_PROBE = """
import pyvista
plotter = pyvista.Plotter(off_screen=True, window_size=(32, 32))
plotter.add_mesh(pyvista.Sphere(), color="red")
picture = plotter.screenshot(return_img=True)
assert picture.max() > picture.min(), "an empty picture"
"""
_known: dict[str, str] = {}  # "reason": why not, empty if it works; one probe a process


def require_gl() -> None:
    """Make sure that PyVista can draw without a screen, by a probe in another process.

    On Linux without a display VTK is told to use EGL.

    Raises
    ------
    ImportError
        If PyVista is not installed.
    RuntimeError
        If drawing fails here; names the packages that bring OpenGL.
    """
    # Before VTK is loaded, which reads it.
    headless = sys.platform.startswith("linux") and not os.environ.get("DISPLAY")
    if headless and not os.environ.get("WAYLAND_DISPLAY"):
        os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")
    optional.need("pyvista", "visual", "for pictures in three dimensions")
    if "reason" not in _known:
        _known["reason"] = _probe()
    if _known["reason"]:
        raise RuntimeError(
            "pictures in three dimensions need OpenGL, which does not work here "
            f"({_known['reason']}): install EGL (Debian: apt install libegl1 libegl-mesa0 "
            "libgl1-mesa-dri) or OSMesa (libosmesa6, with "
            "VTK_DEFAULT_OPENGL_WINDOW=vtkOSOpenGLRenderWindow)"
        )


def _probe() -> str:
    try:
        child = subprocess.run(
            [sys.executable, "-c", _PROBE], capture_output=True, text=True, timeout=120, check=False
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        return f"the probe did not run: {error}"
    if child.returncode == 0:
        return ""
    if child.returncode < 0:
        return f"the probe died of signal {-child.returncode}"
    lines = [line for line in child.stderr.splitlines() if line.strip()]
    return lines[-1].strip() if lines else f"the probe returned {child.returncode}"
