#!/usr/bin/python3
"""The ParaView macro on a run of two soils with walls: soil and walls apart, balls of the right size, one range of colours over all times,
mass and volume, arrows, a picture. Needs ParaView and a display in memory: jobs/install.sh paraview; not run (77) without.
Run as paraview_test.py PROGRAM."""
import atexit
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
from harness import block, check, finish, program, root, scratch

sys.path.insert(0, os.path.join(root, "python"))
os.environ["KUZURE"] = program
import numpy as np

MACRO = Path(root, "jobs/paraview/kuzure_view.py")
# The macro as ParaView's window runs it: on what is open and chosen.
INSPECT = """
import json, sys
sys.path.insert(0, sys.argv[1])
import kuzure_view
from paraview.simple import *
from paraview import servermanager
import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy
try:
    kuzure_view.opened()
    raise SystemExit("nothing is open, and opened() says nothing")
except RuntimeError:
    pass
SetActiveSource(OpenDataFile(sys.argv[2] + "/snapshots/state.hdf.series"))
soil, walls, arrows, view = kuzure_view.show(*kuzure_view.opened())
shown, held = GetRepresentation(soil, view), GetRepresentation(walls, view)
points = GetColorTransferFunction("displacement").RGBPoints
scene = GetAnimationScene(); scene.UpdateAnimationUsingDataTimeSteps(); scene.GoToLast()
data = servermanager.Fetch(soil)
array = lambda name: vtk_to_numpy(data.GetPointData().GetArray(name))
print("FACTS " + json.dumps({
    "soil": data.GetNumberOfPoints(), "walls": servermanager.Fetch(walls).GetNumberOfPoints(),
    "radius": [shown.GaussianRadius, held.GaussianRadius], "representation": [str(r.Representation).strip("'[]") for r in (shown, held)],
    "range": [points[0], points[-4]], "time": view.ViewTime, "color": str(shown.ColorArrayName[1]), "wall_color": str(held.ColorArrayName[1] or ""),
    "mass": float(array("mass").sum()), "volume": float(array("volume").sum()),
    "by_soil": [float(array("mass")[array("soil") == k].sum()) for k in (0, 1)],
    "arrows": GetRepresentation(arrows, view).Visibility, "parallel": view.CameraParallelProjection}))
"""


def main():
    work = Path(scratch("paraview"))
    text = block((0.4, 0, 0.4), ((-0.4, 0, -0.16), (1.2, 0, 0)), end=0.2, step=None, output="every = 0.05")
    (work / "s.toml").write_text(
        text.replace("[[wall]]", '[[body]]\nsoil = "clay"\nbox = { low = [0.4, 0, 0], high = [0.6, 0, 0.2] }\n[[wall]]', 1).replace(
            "[[body]]", "[soil.clay]\ndensity = 1500.0\nyoung = 1.8e6\npoisson = 0.3\ncohesion = 300.0\nfriction_angle = 10.0\n[[body]]", 1
        )
    )
    import kuzure

    run = kuzure.run(work / "s.toml", work / "a", threads=1, **{"effects.artificial_stress": "auto", "effects.viscosity.alpha": 0.1})
    if not (shutil.which("pvbatch") and shutil.which("Xvfb")):
        print("not run: pvbatch or Xvfb is not there; jobs/install.sh paraview installs them")
        compile(MACRO.read_text(), str(MACRO), "exec")
        finish(77)

    # A display in memory, which says its number when it is ready.
    reading, writing = os.pipe()
    server = subprocess.Popen(
        ["Xvfb", "-displayfd", str(writing), "-screen", "0", "1280x1024x24", "-nolisten", "tcp", "-noreset"],
        pass_fds=[writing],
        stderr=subprocess.DEVNULL,
    )
    atexit.register(server.terminate)
    os.close(writing)
    with os.fdopen(reading) as f:
        display = ":" + f.readline().strip()
    if not check(display != ":", f"a display in memory: {display}"):
        finish()

    def pvbatch(*words):
        environment = {**os.environ, "DISPLAY": display}
        done = subprocess.run(["pvbatch", *map(str, words)], capture_output=True, text=True, cwd=work, timeout=300, env=environment)
        return done.returncode, done.stdout + done.stderr

    (work / "look.py").write_text(INSPECT)
    code, said = pvbatch("look.py", MACRO.parent, "a")
    line = next((l for l in said.splitlines() if l.startswith("FACTS ")), None)
    if not check(line is not None, f"the macro on an open series: exit {code} {'' if line else said[-1500:]}"):
        finish()
    facts = json.loads(line[6:])
    largest = max(np.linalg.norm(s["displacement"], axis=1).max() for s in run.snapshots)
    check(
        facts["soil"] == run.snapshot().size and facts["walls"] == run.walls.size,
        f"soil and walls apart: {facts['soil']}, {facts['walls']}",
    )
    check(
        facts["radius"] == [0.02, 0.02] and set(facts["representation"]) == {"Point Gaussian"},
        f"balls of half the spacing: {facts['radius']}",
    )
    check(facts["color"] == "displacement" and not facts["wall_color"], "soil is coloured by displacement, walls by none")
    check(facts["range"][0] == 0 and abs(facts["range"][1] / largest - 1) < 1e-6, f"one range over all times: {facts['range']}, {largest}")
    check(abs(facts["time"] - 0.2) < 1e-9, f"the last time: {facts['time']}")
    check(np.allclose(facts["by_soil"], [1850 * 0.16, 1500 * 0.04]), f"mass by soil: {facts['by_soil']}")
    volume = sum(1850 * 0.0016 / s if k == 0 else 1500 * 0.0016 / s for k, s in zip(run.snapshot()["soil"], run.snapshot()["density"]))
    check(abs(facts["volume"] / volume - 1) < 1e-9, f"volume: {facts['volume']}")
    check(facts["arrows"] == 0 and facts["parallel"] == 1, "arrows wait behind their eye; 2-D is seen from the side")

    code, said = pvbatch(MACRO, "a", "a.png")
    check(code == 0 and (work / "a.png").exists(), f"a picture without a window: exit {code} {said[-300:]}")
    if (work / "a.png").exists():
        import matplotlib.image

        pixels = matplotlib.image.imread(work / "a.png")[:, :, :3].reshape(-1, 3)
        spread = pixels.max(axis=1) - pixels.min(axis=1)
        check((spread > 0.3).mean() > 0.01, f"soil in colours: {(spread > 0.3).mean():.3f} of the picture")
    code, said = pvbatch(MACRO, "nowhere")
    check(code != 0 and "nowhere/snapshots" in said, "a directory that is not there is named")
    finish()


if __name__ == "__main__":
    main()
