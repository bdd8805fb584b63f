"""What the Python tests share: the program under test, a directory of one's own, scenes, checks that are counted, the end.
Nothing here is a test.

A test in a folder below puts this one on its path:
    sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
"""
import atexit
import hashlib
import os
import shutil
import sys
import tempfile
import time

program = os.path.abspath(sys.argv[1])
root = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
failures = []


def check(good, what):
    """Says what holds and what does not, and gives it back; a test goes on, and fails at its end."""
    print(("ok    " if good else "FAIL  ") + what, flush=True)
    if not good:
        failures.append(what)
    return good


def need(good, fault):
    """As check(), for many things at once: says nothing but the fault, where there is one."""
    return good or check(False, fault)


def finish(code=0):
    """How many checks failed, and the exit code of the test: 1, or `code` where none did."""
    print(f"{len(failures)} failures")
    sys.exit(1 if failures else code)


def scratch(name):
    """A directory for this test, which goes when the test ends."""
    directory = tempfile.mkdtemp(prefix=f"kuzure-{name}-")
    atexit.register(shutil.rmtree, directory, ignore_errors=True)
    return directory


def wait_for(condition, seconds=600, every=0.005, process=None):
    """Whether the condition came to hold: before the process ended, where one is given that may end without it. So long that no machine is
    too slow for what takes a second on an idle one."""
    end = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > end or (process is not None and process.poll() is not None):
            return condition()
        time.sleep(every)
    return True


def legs(seconds):
    """Values for --max-minutes, for one start after the other of a run that took `seconds` here in one go: the first start ends with its
    first step, those after it come further and further, until one comes to the end. So the run is stopped at least once, and mostly some
    times on its way, also where the machine is by now several times faster or slower than it was."""
    yield "1e-9"
    for k in range(60):
        yield f"{seconds / 60 / 20 * 1.7**k:.9f}"


def digest(where, files):
    """SHA-256 by name of the files of a directory that `files` names, and of all in its maps/."""
    found = {}
    for folder in ("", "maps"):
        for name in sorted(os.listdir(os.path.join(where, folder))):
            if folder or name in files:
                with open(os.path.join(where, folder, name), "rb") as f:
                    found[name] = hashlib.sha256(f.read()).hexdigest()
    return found


def vector(v):
    return f"[{', '.join(str(float(x)) for x in v)}]"


def block(
    high=(0.32, 0.32, 0.32),
    floor=((-0.4, -0.4, -0.16), (0.72, 0.72, 0.0)),
    low=(0, 0, 0),
    title="a block",
    name="sand",
    young="1.8e6",
    spacing=0.04,
    h=1.2,
    end=0.004,
    step=1.0e-4,
    space="",
    soil="",
    body="",
    wall="",
    effects="",
    accuracy="",
    output="",
):
    """The scene most tests start from, as text: a block of soil on a floor (or on none), flat where it has no width.

    What is `space` ... `output` are lines more of these sections; h or step None leaves them to kuzure.
    """
    sections = [
        (f'title = "{title}"', f"dimensions = {3 if high[1] > low[1] else 2}"),
        ("[space]", f"spacing = {spacing}", f"h = {h}" if h else "", space),
        ("[time]", f"end = {end}", f"step = {step}" if step else ""),
        (f"[soil.{name}]", "density = 1850.0", f"young = {young}", "poisson = 0.3", "friction_angle = 25.0", soil),
        ("[[body]]", f'soil = "{name}"', f"box = {{ low = {vector(low)}, high = {vector(high)} }}", body),
        ("[[wall]]", f"box = {{ low = {vector(floor[0])}, high = {vector(floor[1])} }}", wall) if floor else (),
        ("[effects]", "gravity = [0.0, 0.0, -9.81]", effects),
        ("[accuracy]", accuracy) if accuracy else (),
        ("[output]", output) if output else (),
    ]
    return "\n".join(line for section in sections for line in section if line) + "\n"
