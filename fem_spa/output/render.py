"""Shaded images of triangles on paper, by VTK off screen, in a process of their own.

The process keeps VTK's memory, and a graphics driver that crashes, out of the run; it works while the
curve is drawn. Only the few modules of VTK that are needed are loaded.
"""

from __future__ import annotations

import io
import os
import subprocess
import sys
from collections.abc import Sequence
from typing import Any

import numpy as np

SHARPNESS = 2
"""Pixels rendered for one of the image, each way: smooth edges on any driver."""


class RenderingFailed(RuntimeError):
    """VTK is not there, or gave an empty image."""


class Window:
    """An off-screen window that looks at a rectangle of the paper.

    Parameters
    ----------
    box : (left, right, bottom, top) on paper, m
    width : pixels of the image
    """

    def __init__(self, box: tuple[float, float, float, float], width: int) -> None:
        if sys.platform.startswith("linux") and not os.environ.get("DISPLAY"):
            os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")
        try:
            import vtkmodules.vtkRenderingOpenGL2  # noqa: F401
            from vtkmodules.vtkCommonCore import vtkLogger
            from vtkmodules.vtkRenderingCore import vtkRenderer, vtkRenderWindow
        except ImportError as error:
            raise RenderingFailed(str(error)) from error
        vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_OFF)
        left, right, bottom, top = box
        height = max(1, round(width * (top - bottom) / (right - left)))
        self._renderer: Any = vtkRenderer()
        self._renderer.SetBackground(1.0, 1.0, 1.0)
        self._window: Any = vtkRenderWindow()
        self._window.SetOffScreenRendering(1)
        self._window.SetMultiSamples(0)
        self._window.SetSize(width * SHARPNESS, height * SHARPNESS)
        self._window.AddRenderer(self._renderer)
        camera = self._renderer.GetActiveCamera()
        camera.ParallelProjectionOn()
        x, y, far = 0.5 * (left + right), 0.5 * (bottom + top), 10.0 * (right - left + top - bottom)
        camera.SetFocalPoint(x, y, 0.0)
        camera.SetPosition(x, y, far)
        camera.SetViewUp(0.0, 1.0, 0.0)
        camera.SetParallelScale(0.5 * (top - bottom))
        camera.SetClippingRange(0.01 * far, 2.0 * far)

    def image(self, paper: np.ndarray, triangles: np.ndarray, colours: np.ndarray) -> np.ndarray:
        """(height, width, 4) of 0..1, transparent where there is nothing.

        Parameters
        ----------
        paper : (n, 3) right, up, depth, m
        triangles : (k, 3);  colours : (k, 3, 3) of their corners, 0..1
        """
        actor = self._actor(paper, triangles, colours)
        self._renderer.AddActor(actor)
        self._window.Render()
        pixels = self._pixels()
        self._renderer.RemoveActor(actor)
        if not pixels[..., 3].any():
            raise RenderingFailed("the image is empty")
        return pixels

    def _actor(self, paper: np.ndarray, triangles: np.ndarray, colours: np.ndarray) -> Any:
        from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray
        from vtkmodules.vtkCommonCore import vtkPoints
        from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData
        from vtkmodules.vtkRenderingCore import vtkActor, vtkPolyDataMapper

        corners = paper[triangles].reshape(-1, 3) * (1.0, 1.0, -1.0)
        points, cells, surface = vtkPoints(), vtkCellArray(), vtkPolyData()
        points.SetData(numpy_to_vtk(np.ascontiguousarray(corners), deep=1))
        count = len(triangles)
        cells.SetData(
            numpy_to_vtkIdTypeArray(np.arange(0, 3 * count + 1, 3), deep=1),
            numpy_to_vtkIdTypeArray(np.arange(3 * count), deep=1),
        )
        surface.SetPoints(points)
        surface.SetPolys(cells)
        shades = np.round(255.0 * np.clip(colours, 0.0, 1.0)).astype(np.uint8).reshape(-1, 3)
        surface.GetPointData().SetScalars(numpy_to_vtk(np.ascontiguousarray(shades), deep=1))
        mapper, actor = vtkPolyDataMapper(), vtkActor()
        mapper.SetInputData(surface)
        actor.SetMapper(mapper)
        actor.GetProperty().LightingOff()
        return actor

    def _pixels(self) -> np.ndarray:
        """What was rendered, `SHARPNESS` pixels made one."""
        from vtkmodules.util.numpy_support import vtk_to_numpy
        from vtkmodules.vtkCommonCore import vtkFloatArray, vtkUnsignedCharArray

        width, height = self._window.GetSize()
        raw, deep = vtkUnsignedCharArray(), vtkFloatArray()
        self._window.GetPixelData(0, 0, width - 1, height - 1, 1, raw, 0)
        self._window.GetZbufferData(0, 0, width - 1, height - 1, deep)
        colour = vtk_to_numpy(raw).reshape(height, width, 3)[::-1]
        seen = vtk_to_numpy(deep).reshape(height, width)[::-1] < 1.0
        n, rows, columns = SHARPNESS, height // SHARPNESS, width // SHARPNESS
        total, covered = np.zeros((rows, columns, 3), np.float32), np.zeros((rows, columns, 1), np.float32)
        for i in range(n):
            for j in range(n):
                part = seen[i : rows * n : n, j : columns * n : n, None]
                covered += part
                total += colour[i : rows * n : n, j : columns * n : n] * part
        total /= np.maximum(255.0 * covered, 1.0)
        return np.concatenate([total, covered / n**2], axis=2)


Layer = tuple[np.ndarray, np.ndarray, np.ndarray]
"""Points on paper (n, 3) m, triangles (k, 3), and colours (k, 3, 3) of the triangles' corners, 0..1."""


class Rendering:
    """Images of layers, being made by a process of their own from the moment this is created.

    Parameters
    ----------
    box : (left, right, bottom, top) on paper, m
    width : pixels
    """

    def __init__(self, box: Sequence[float], width: int, layers: Sequence[Layer]) -> None:
        buffer = io.BytesIO()
        arrays: dict[str, Any] = {"box": np.array(box), "width": np.array(width)}
        for i, (paper, triangles, colours) in enumerate(layers):
            arrays |= {f"paper{i}": paper, f"triangles{i}": triangles}
            arrays |= {f"colours{i}": colours.astype(np.float32)}
        np.savez(buffer, **arrays)
        self._process = subprocess.Popen(
            [sys.executable, "-m", __name__],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            env={**os.environ, "PYTHONPATH": os.pathsep.join(path for path in sys.path if path)},
        )
        assert self._process.stdin is not None
        try:
            self._process.stdin.write(buffer.getvalue())
            self._process.stdin.close()
        except OSError:
            pass  # the process is gone; `images` says so

    def images(self) -> np.ndarray:
        """(layers, height, width, 4) of 0..1.

        Raises
        ------
        RenderingFailed
            The process ended without them: no VTK, no driver, or a crash of either.
        """
        process = self._process
        assert process.stdout is not None
        data = process.stdout.read()
        process.stdout.close()
        if process.wait() != 0:
            raise RenderingFailed(f"the rendering process ended with status {process.returncode}")
        return np.load(io.BytesIO(data)).astype(np.float32) / 255.0


def main() -> None:
    """What the process does: layers on stdin, images on stdout."""
    output = os.dup(1)
    os.dup2(2, 1)  # whatever a driver prints stays out of the images
    given = np.load(io.BytesIO(sys.stdin.buffer.read()))
    count = sum(name.startswith("paper") for name in given.files)
    window = Window(tuple(given["box"]), int(given["width"]))
    images = [
        window.image(given[f"paper{i}"], given[f"triangles{i}"], given[f"colours{i}"]) for i in range(count)
    ]
    buffer = io.BytesIO()
    np.save(buffer, np.round(255.0 * np.array(images)).astype(np.uint8))
    with os.fdopen(output, "wb") as stream:
        stream.write(buffer.getvalue())


if __name__ == "__main__":
    main()
