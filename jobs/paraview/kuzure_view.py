#!/usr/bin/pvbatch
"""ParaView macro: the snapshots of a kuzure run as they should look: soil as balls of the right size, coloured by displacement with one range
over all times, walls apart and grey, arrows of the velocity (hidden at first), mass and volume of each particle for SPH interpolation.

In ParaView 5.11 or later: Macros, Import new macro ..., this file; then open snapshots/state.hdf.series, Apply, and click the macro.
Without a window: pvbatch kuzure_view.py DIR [picture.png], or xvfb-run -a pvbatch ... where there is no display; DIR: a result directory.
"""
import os
import re
import sys
import tomllib

from paraview.simple import *

UNITS = {"displacement": "m", "plastic_strain": "1", "velocity": "m/s", "density": "kg/m^3"}
WALL_COLOR, SOIL_MAP = (0.62, 0.58, 0.53), "Viridis (matplotlib)"


def scene_of(series):
    """The scene as run: ../scene.toml beside the snapshots."""
    file = os.path.join(os.path.dirname(os.path.dirname(os.path.abspath(series))), "scene.toml")
    try:
        with open(file, "rb") as f:
            return tomllib.load(f)
    except (OSError, ValueError) as e:
        raise RuntimeError(f"{file}: expected the scene that the run left beside its snapshots: {e}") from None


def opened():
    """What is open and chosen, and the path of its series."""
    source = GetActiveSource()
    if source is None:
        raise RuntimeError("open snapshots/state.hdf.series of a result directory first, choose it, and click the macro again")
    name = source.GetProperty("FileName") or source.GetProperty("FileNames")
    files = list(name) if name is not None and not isinstance(name, str) else [name] if name else []
    if not files:
        raise RuntimeError("the chosen source is no file: choose snapshots/state.hdf.series in the pipeline browser")
    return source, files[0]


def arrays(proxy):
    return {proxy.PointData.GetArray(k).Name: proxy.PointData.GetArray(k) for k in range(proxy.PointData.GetNumberOfArrays())}


def with_mass(soil, scene):
    """The soil with arrays `mass` (kg, in 2-D kg/m) and, where the snapshots have the density, `volume` (m^3, in 2-D m^2)."""
    volume = scene["space"]["spacing"] ** scene["dimensions"]
    terms = [f"if(soil == {k}, {kind['density'] * volume!r}, 0)" for k, kind in enumerate(scene["soil"].values())]
    mass = Calculator(registrationName="soil mass", Input=soil, ResultArrayName="mass", Function=" + ".join(terms))
    if "density" not in arrays(soil):
        return mass
    return Calculator(registrationName="soil mass and volume", Input=mass, ResultArrayName="volume", Function="mass/density")


def as_balls(proxy, view, radius):
    shown = Show(proxy, view)
    shown.SetRepresentationType("Point Gaussian")
    shown.GaussianRadius = radius
    shown.ShaderPreset = "Sphere"
    shown.ScaleByArray = 0
    return shown


def show(source, series):
    """Builds the pipeline behind an open series; gives soil, walls (None where there are none), arrows (None without velocity), view."""
    scene = scene_of(series)
    spacing = scene["space"]["spacing"]
    view = GetActiveViewOrCreate("RenderView")
    source.UpdatePipeline()
    Hide(source, view)
    soil = Threshold(registrationName="soil", Input=source, Scalars=["POINTS", "kind"], LowerThreshold=0, UpperThreshold=0)
    soil.UpdatePipeline()
    soil = with_mass(soil, scene)
    soil.UpdatePipeline()
    shown = as_balls(soil, view, 0.5 * spacing)
    there = arrays(soil)
    color = next(name for name in ("displacement", "plastic_strain", "velocity", "density", "id") if name in there)
    ColorBy(shown, ("POINTS", color, "Magnitude") if there[color].GetNumberOfComponents() == 3 else ("POINTS", color))
    table = GetColorTransferFunction(color)
    table.ApplyPreset(SOIL_MAP, True)
    shown.RescaleTransferFunctionToDataRangeOverTime()
    shown.SetScalarBarVisibility(view, True)
    bar = GetScalarBar(table, view)
    bar.Title, bar.ComponentTitle = f"{color.replace('_', ' ')} ({UNITS.get(color, '1')})", ""

    arrows = None
    if "velocity" in there:
        arrows = Glyph(registrationName="velocity", Input=soil, GlyphType="Arrow")
        arrows.OrientationArray, arrows.ScaleArray = ["POINTS", "velocity"], ["POINTS", "velocity"]
        arrows.ScaleFactor = spacing  # an arrow as long as a spacing for 1 m/s
        arrows.GlyphMode, arrows.MaximumNumberOfSamplePoints = "Uniform Spatial Distribution (Bounds Based)", 2000
        Show(arrows, view)
        Hide(arrows, view)  # a click on its eye shows them

    walls = None
    file = os.path.join(os.path.dirname(os.path.abspath(series)), "walls.hdf")
    if os.path.exists(file):
        walls = OpenDataFile(file)
        RenameSource("walls", walls)
        held = as_balls(walls, view, 0.5 * spacing)
        held.ColorArrayName = ("POINTS", "")  # one colour
        held.AmbientColor = held.DiffuseColor = WALL_COLOR

    flat = scene["dimensions"] == 2
    view.AxesGrid.Visibility = 1
    view.CameraParallelProjection = int(flat)
    view.CameraFocalPoint, view.CameraViewUp = (0, 0, 0), (0, 0, 1)
    view.CameraPosition = (0, -1, 0) if flat else (1, -1.6, 0.9)
    view.ResetCamera()
    SetActiveSource(soil)
    Render(view)
    return soil, walls, arrows, view


def main(arguments):
    """Without a window: the series of a result directory, and a picture of its last time."""
    if not arguments:
        raise SystemExit(f"usage: pvbatch {os.path.basename(__file__)} DIR [picture.png]")
    series = os.path.join(arguments[0], "snapshots/state.hdf.series")
    if not os.path.exists(series):
        raise SystemExit(f"{series}: no such file: expected the result directory of a run")
    source = OpenDataFile(series)
    GetActiveViewOrCreate("RenderView").ViewSize = [1200, 700]
    soil, walls, arrows, view = show(source, series)
    if len(arguments) > 1:
        scene = GetAnimationScene()
        scene.UpdateAnimationUsingDataTimeSteps()
        scene.GoToLast()
        SaveScreenshot(arguments[1], view, ImageResolution=(1200, 700))
        print(arguments[1])
    return soil, walls, arrows, view


if __name__ == "__main__" and re.search(r"pv(batch|python)", os.path.basename(sys.executable or "") + " ".join(sys.orig_argv[:1])):
    main(sys.argv[1:])
elif __name__ == "__main__":
    show(*opened())
