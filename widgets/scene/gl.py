"""Is there an OpenGL that VTK can draw with? Asked first, since VTK ends the process where there is none."""

from __future__ import annotations

import ctypes
import os
import sys
from collections.abc import Callable
from functools import cache
from typing import Any

REMEDY = (
    "install a graphics driver with OpenGL 3.2; on Debian and Ubuntu without a graphics card: "
    "apt-get install libegl1 libgl1 libgl1-mesa-dri"
)
_EGL_OPENGL_API, _EGL_RENDERABLE_TYPE, _EGL_OPENGL_BIT, _EGL_NONE = 0x30A2, 0x3040, 0x0008, 0x3038
_EGL_SURFACE_TYPE, _EGL_PBUFFER_BIT, _EGL_PLATFORM_DEVICE = 0x3033, 0x0001, 0x313F
SOFTWARE = ("llvmpipe", "softpipe", "swrast", "swr", "software")
"""Words in a renderer's name that tell that a processor draws, not a graphics card."""


@cache
def gl_problem() -> str | None:
    """Why nothing can be drawn in 3D on this machine and what to do; None where it can.

    Where VTK's first choice (GLX with a display, else EGL) does not work but EGL does, VTK is told to take EGL.
    """
    if sys.platform != "linux":
        return None  # the system always brings one
    asked = os.environ.get("VTK_DEFAULT_OPENGL_WINDOW", "")
    if asked == "vtkOSOpenGLRenderWindow":
        return None if _loads("libOSMesa.so.8") or _loads("libOSMesa.so") else _sentence("OSMesa is not installed")
    if not asked and os.environ.get("DISPLAY") and glx_fault() is None:
        return None
    fault = egl_fault()
    if fault is not None:
        return _sentence(fault)
    os.environ["VTK_DEFAULT_OPENGL_WINDOW"] = "vtkEGLRenderWindow"
    return None


def egl_fault(load: Callable[[str], Any] = ctypes.CDLL) -> str | None:
    """What EGL lacks for drawing without a display."""
    try:
        egl = load("libEGL.so.1")
    except OSError:
        return "the library libEGL.so.1 is not installed"
    for display in _displays(egl):
        major, minor, count = ctypes.c_int(), ctypes.c_int(), ctypes.c_int()
        if not egl.eglInitialize(display, ctypes.byref(major), ctypes.byref(minor)):
            continue
        wanted = (ctypes.c_int * 5)(
            _EGL_SURFACE_TYPE, _EGL_PBUFFER_BIT, _EGL_RENDERABLE_TYPE, _EGL_OPENGL_BIT, _EGL_NONE
        )
        if not egl.eglBindAPI(_EGL_OPENGL_API):
            continue
        # The display stays open: others in this process may share it, and EGL counts no users.
        if egl.eglChooseConfig(display, wanted, None, 0, ctypes.byref(count)) and count.value > 0:
            return None
    return "EGL finds no driver that draws OpenGL"


def glx_fault(load: Callable[[str], Any] = ctypes.CDLL) -> str | None:
    """What GLX lacks for drawing with the display in ``DISPLAY``."""
    try:
        x11, gl = load("libX11.so.6"), load("libGL.so.1")
    except OSError:
        return "the libraries libX11.so.6 and libGL.so.1 are not both installed"
    x11.XOpenDisplay.restype = ctypes.c_void_p
    display = x11.XOpenDisplay(None)
    if not display:
        return f"the display {os.environ.get('DISPLAY')} does not answer"
    pointer = ctypes.c_void_p(display)
    try:
        wanted = (ctypes.c_int * 4)(4, 5, 0, 0)  # GLX_RGBA, GLX_DOUBLEBUFFER, None
        gl.glXChooseVisual.restype = ctypes.c_void_p
        error, event = ctypes.c_int(), ctypes.c_int()
        if not gl.glXQueryExtension(pointer, ctypes.byref(error), ctypes.byref(event)):
            return "the display has no GLX"
        return None if gl.glXChooseVisual(pointer, 0, wanted) else "the display has no picture format for OpenGL"
    finally:
        x11.XCloseDisplay(pointer)


def _displays(egl: Any) -> list[Any]:
    """The displays EGL may draw with: of each device, as VTK looks for them, then the default one."""
    found: list[Any] = []
    egl.eglGetProcAddress.restype = ctypes.c_void_p
    query, platform = (egl.eglGetProcAddress(name) for name in (b"eglQueryDevicesEXT", b"eglGetPlatformDisplayEXT"))
    if query and platform:
        devices, count = (ctypes.c_void_p * 16)(), ctypes.c_int()
        ask = ctypes.CFUNCTYPE(ctypes.c_uint, ctypes.c_int, ctypes.c_void_p, ctypes.c_void_p)(query)
        display_of = ctypes.CFUNCTYPE(ctypes.c_void_p, ctypes.c_uint, ctypes.c_void_p, ctypes.c_void_p)(platform)
        if ask(16, ctypes.addressof(devices), ctypes.addressof(count)):
            found += [display_of(_EGL_PLATFORM_DEVICE, device, None) for device in devices[: count.value]]
    egl.eglGetDisplay.restype = ctypes.c_void_p
    found.append(egl.eglGetDisplay(None))
    return [ctypes.c_void_p(display) for display in found if display]


def _loads(name: str) -> bool:
    try:
        ctypes.CDLL(name)
    except OSError:
        return False
    return True


def _sentence(fault: str) -> str:
    return f"The 3D view cannot be drawn: {fault}. To see it, {REMEDY}."
