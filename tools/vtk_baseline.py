#!/usr/bin/env python3
"""What VTK needs from a volume in memory to its first finished picture in memory.

    pip install vtk
    cargo run --release --example benchmark -- --export-raw out/turbulence-256.raw
    python3 tools/vtk_baseline.py out/turbulence-256.raw

The file beside the raw one (.json) names the size, the isovalue and the camera. Measured is
vtkFlyingEdges3D, with normals, plus off-screen rendering and reading the picture back, after one
warm-up on an unrelated small scene. Prints JSON: making the window is apart (pipelines_ms), memory is
the process' peak resident memory above that after the warm-up, with and without the volume itself.
`cargo run --release --example benchmark -- --set vtk` measures this library the same way.
"""

import argparse
import json
import time

import numpy
import vtk
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy

BACKGROUND = (1.0, 1.0, 1.0)


def status(name):
    """A number of /proc/self/status in bytes."""
    with open("/proc/self/status") as lines:
        for line in lines:
            if line.startswith(name + ":"):
                return int(line.split()[1]) * 1024
    return None


def reset_peak():
    """Lets the peak (VmHWM) start again from what is resident now, where the system allows it."""
    try:
        with open("/proc/self/clear_refs", "w") as file:
            file.write("5")
    except OSError:
        pass


def image_data(samples, dims):
    """Samples, x fastest, as an image that shares their memory."""
    image = vtk.vtkImageData()
    image.SetDimensions(*dims)
    image.GetPointData().SetScalars(numpy_to_vtk(samples, deep=False))
    return image


def make_window(size):
    """An off-screen window and its renderer, with a working context."""
    window, renderer = vtk.vtkRenderWindow(), vtk.vtkRenderer()
    window.SetOffScreenRendering(1)
    window.SetMultiSamples(0)
    window.SetSize(*size)
    renderer.SetBackground(*BACKGROUND)
    window.AddRenderer(renderer)
    window.Initialize()
    return window, renderer


def set_camera(renderer, view):
    camera = renderer.GetActiveCamera()
    camera.SetPosition(*view["eye"])
    camera.SetFocalPoint(*view["target"])
    camera.SetViewUp(*view["up"])
    camera.SetViewAngle(view["vertical_fov_degrees"])
    renderer.ResetCameraClippingRange()


def milliseconds(begin):
    return (time.perf_counter() - begin) * 1e3


def picture(image, view):
    """Times in milliseconds, the number of triangles, and the picture."""
    begin = time.perf_counter()
    window, renderer = make_window(view["size"])
    times = {"pipelines_ms": milliseconds(begin)}

    begin = time.perf_counter()
    surface = vtk.vtkFlyingEdges3D()
    surface.SetInputData(image)
    surface.SetValue(0, view["isovalue"])
    surface.ComputeNormalsOn()
    surface.ComputeScalarsOff()
    surface.Update()
    times["contour_ms"] = milliseconds(begin)

    mapper, actor = vtk.vtkPolyDataMapper(), vtk.vtkActor()
    mapper.SetInputConnection(surface.GetOutputPort())
    mapper.ScalarVisibilityOff()
    actor.SetMapper(mapper)
    renderer.AddActor(actor)
    set_camera(renderer, view)
    window.Render()
    times["drawn_ms"] = milliseconds(begin)

    grab = vtk.vtkWindowToImageFilter()
    grab.SetInput(window)
    grab.ReadFrontBufferOff()
    grab.ShouldRerenderOff()
    grab.Update()
    pixels = vtk_to_numpy(grab.GetOutput().GetPointData().GetScalars())
    times["picture_ms"] = milliseconds(begin)
    triangles = surface.GetOutput().GetNumberOfPolys()
    return times, triangles, pixels.copy(), grab.GetOutput(), window.GetClassName()


def warm_up():
    """A small surface of another kind."""
    edge = 48
    axis = numpy.linspace(0.0, 12.0, edge, dtype=numpy.float32)
    z, y, x = numpy.meshgrid(axis, axis, axis, indexing="ij")
    values = numpy.sin(x) * numpy.cos(y) + numpy.sin(y) * numpy.cos(z) + numpy.sin(z) * numpy.cos(x)
    view = {
        "size": [160, 120],
        "isovalue": 0.0,
        "eye": [24.0, 60.0, 120.0],
        "target": [24.0, 24.0, 24.0],
        "up": [0.0, 1.0, 0.0],
        "vertical_fov_degrees": 50.0,
    }
    picture(image_data(values.ravel(), [edge] * 3), view)


def write_png(path, image):
    writer = vtk.vtkPNGWriter()
    writer.SetFileName(path)
    writer.SetInputData(image)
    writer.Write()


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("raw", help="32-bit floats, x fastest; the view is in the .json beside it")
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--png", help="also write the picture to this file")
    arguments = parser.parse_args()
    with open(arguments.raw.removesuffix(".raw") + ".json") as file:
        view = json.load(file)

    vtk.vtkObject.GlobalWarningDisplayOff()
    # The contour filter runs on all cores where VTK has threads of its own.
    vtk.vtkSMPTools.SetBackend("STDThread")
    warm_up()
    after_warm_up = status("VmRSS")
    samples = numpy.fromfile(arguments.raw, dtype="<f4")
    image = image_data(samples, view["dims"])
    with_input = status("VmRSS")

    runs = []
    for _ in range(arguments.repeats):
        reset_peak()
        times, triangles, pixels, grabbed, window = picture(image, view)
        peak = status("VmHWM")
        runs.append(
            {
                **times,
                "growth_bytes": peak - after_warm_up,
                "growth_without_input_bytes": peak - with_input,
                "triangles": triangles,
                "hits": int((pixels[:, :3] != 255).any(axis=1).sum()),
            }
        )
    if arguments.png:
        write_png(arguments.png, grabbed)
    result = {
        "vtk": vtk.vtkVersion().GetVTKVersion(),
        "window": window,
        "threads": vtk.vtkSMPTools.GetEstimatedNumberOfThreads(),
        "backend": vtk.vtkSMPTools.GetBackend(),
        "size": view["size"],
        "dims": view["dims"],
        "input_bytes": samples.nbytes,
        "after_warm_up_bytes": after_warm_up,
        # Memory that one run gives back may serve the next: only the first tells how much it takes.
        "runs": runs,
    }
    print(json.dumps(result, indent=2))


if __name__ == "__main__":
    main()
