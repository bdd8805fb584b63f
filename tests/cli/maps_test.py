#!/usr/bin/python3
"""Maps ([maps]): the same bytes of every file on any ranks and threads and through a stop, volume kept, what GDAL reads, what is refused."""
import csv
import json
import math
import os
import shutil
import struct
import subprocess
import sys
import tempfile
import xml.etree.ElementTree

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
import harness
from harness import check, failures, finish, legs, program

work = tempfile.mkdtemp(prefix="kuzure-maps-")
NAMES = ["h_max", "h_end", "v_max", "hv_max", "p_max", "force_deposit", "t_arrival", "t_stop", "bed_change", "trust"]
RHO, DX, CELL = 1850.0, 0.1, 0.2

SCENE = """title = "heap"
dimensions = {dimensions}
[space]
spacing = 0.1
[time]
end = {end}
step = 0.004
[soil.sand]
density = 1850.0
young = 3.0e5
poisson = 0.3
friction_angle = 25.0
[[body]]
soil = "sand"
box = {{ low = [0.0, 0.0, 0.0], high = [0.6, 0.6, 0.8] }}
[[wall]]
box = {{ low = [-1.0, -1.0, -0.3], high = [3.0, 2.0, 0.0] }}
[effects]
gravity = [0.0, 0.0, -9.81]
viscosity = {{ alpha = 0.1 }}
{maps}
[output]
every = 0.2
"""
MAPS = """[maps]
limits = [0.15, 0.4]
points = "houses.csv"
"""
with open(os.path.join(work, "houses.csv"), "w") as f:
    f.write('name,x,y\nunder the heap,0.3,0.3\n"shed, old",0.7,0.3\nfar,2.9,1.9\n')


def scene(name, maps=MAPS, end=0.4, dimensions=3):
    path = os.path.join(work, name + ".toml")
    with open(path, "w") as f:
        f.write(SCENE.format(maps=maps, end=end, dimensions=dimensions))
    return path


def call(*args, expect=0, ranks=0):
    launcher = ["mpirun", "-n", str(ranks)] if ranks else []
    done = subprocess.run([*launcher, program, *args], capture_output=True, text=True, timeout=300, cwd=work)
    check(done.returncode == expect, f"{' '.join(args)[-90:]}: exit {done.returncode}, expected {expect} {done.stderr.strip()[-300:]}")
    return done


def digest(directory):
    """Every file that maps leave, by name."""
    return harness.digest(os.path.join(work, directory), ("front.csv", "points.csv"))


def summary(directory):
    with open(os.path.join(work, directory, "summary.json")) as f:
        return json.load(f)


def rows(directory, name):
    with open(os.path.join(work, directory, name), newline="") as f:
        return [r for r in csv.DictReader(f) if not next(iter(r.values())).startswith("#")]


def polygons(path):
    """The rings of a shapefile of polygons (ESRI's description, 1998), outer ones clockwise."""
    with open(path, "rb") as f:
        data = f.read()
    rings, at = [], 100
    while at < len(data):
        length = struct.unpack_from(">i", data, at + 4)[0] * 2
        kind, parts, points = struct.unpack_from("<i", data, at + 8)[0], *struct.unpack_from("<2i", data, at + 8 + 36)
        check(kind == 5, "a polygon")
        starts = [*struct.unpack_from(f"<{parts}i", data, at + 8 + 44), points]
        xy = struct.unpack_from(f"<{2 * points}d", data, at + 8 + 44 + 4 * parts)
        corners = list(zip(xy[::2], xy[1::2]))
        rings += [corners[a:b] for a, b in zip(starts, starts[1:])]
        at += 8 + length
    return rings


def main():
    one = scene("one")
    call("run", one, "-o", "one", "--threads", "1", "--quiet")
    want = digest("one")
    OUTLINES = {f"outline_{limit}.{ending}" for limit in ("0.15", "0.4") for ending in ("shp", "shx", "dbf")}
    check(
        {n + ".tif" for n in NAMES} | {n + ".qml" for n in NAMES} | OUTLINES | {"front.csv", "points.csv", "h_max.png", "t_arrival.png"}
        == {n for n in want if not n.endswith((".cpg", ".prj"))},
        f"one file a map, its style, outlines, front and points, and nothing half written: {sorted(want)}",
    )

    # ---- the same bytes whatever the ranks, threads and stops
    for ranks, threads in ((1, 2), (2, 1), (4, 1)):
        call("run", one, "-o", f"r{ranks}t{threads}", "--threads", str(threads), "--quiet", ranks=ranks)
        check(digest(f"r{ranks}t{threads}") == want, f"{ranks} ranks with {threads} threads: the same bytes of every map")
    stopped, at = scene("stopped"), []
    for minutes in legs(summary("one")["wall_seconds"]):
        launcher = ["mpirun", "-n", "2"] if len(at) % 2 else []
        leg = ["run", stopped, "-o", "stopped", "--threads", "1", "--quiet", "--restart", "--max-minutes", minutes]
        done = subprocess.run([*launcher, program, *leg], capture_output=True, text=True, timeout=300, cwd=work)
        if done.returncode != 5:
            break
        at.append(summary("stopped")["time"])
        check(0 < at[-1] < 0.4 and summary("stopped")["maps"]["time"] == at[-1], f"maps of the moment it stopped, {at[-1]} s")
    check(done.returncode == 0 and at, f"stopped {len(at)} times on the way, then exit {done.returncode} {done.stderr.strip()[-300:]}")
    check(digest("stopped") == want, "through stops and restarts on other ranks: the same bytes of every map")
    short = scene("short", end=0.16)
    call("run", short, "-o", "short", "--threads", "1", "--quiet")
    call("run", scene("short", end=0.4), "-o", "short", "--restart", "--quiet")
    got = digest("short")
    check({k for k in want if got.get(k) != want[k]} <= {"front.csv"}, "a run that ended and goes on longer: the same bytes of every map")

    # ---- what the maps say
    maps = summary("one")["maps"]
    initial = 0.6 * 0.6 * 0.8
    check(maps["columns"] == 20 and maps["rows"] == 15 and maps["cell"] == CELL, f"two spacings a cell over the walls: {maps}")
    check(maps["volume_beyond"] == 0 and abs(maps["volume"] / initial - 1) < 0.02, f"the heap keeps its volume: {maps['volume']} m3")
    points = {p["name"]: p for p in rows("one", "points.csv")}
    check(list(points) == ["under the heap", "shed, old", "far"], f"points by name: {list(points)}")
    check(
        float(points["under the heap"]["h_max"]) >= 0.79 and float(points["under the heap"]["t_arrival"]) == 0,
        f"under the heap it is as thick as the heap from the start: {points['under the heap']}",
    )
    check(
        0 < float(points["shed, old"]["t_arrival"]) < 0.4 and float(points["shed, old"]["v_max"]) > 0.1,
        f"the shed is reached on the way: {points['shed, old']}",
    )
    check(all(points["far"][c] == "" for c in ("t_arrival", "h_max", "v_max", "p_max")), f"nothing comes far: {points['far']}")
    front = rows("one", "front.csv")
    far = [float(r["distance"]) for r in front if r["distance"]]
    check(len(front) > 50 and far[-1] > far[0] + 0.3, f"the front goes on: {len(front)} rows, {far[0]} to {far[-1]} m")
    for limit, least in (("0.15", 0.5), ("0.4", 0.2)):
        rings = polygons(os.path.join(work, "one", "maps", f"outline_{limit}.shp"))
        check(rings and all(r[0] == r[-1] and len(r) > 4 for r in rings), f"outline of {limit} m: closed rings")
        area = sum(0.5 * sum(b[0] * a[1] - a[0] * b[1] for a, b in zip(r, r[1:])) for r in rings)
        check(least < area < 4, f"outline of {limit} m: {area:.3f} m2")

    with open(os.path.join(work, "one", "report.html")) as f:
        page = f.read()
    check(
        '<section id="maps">' in page and page.split('<section id="maps">')[1].split("</section>")[0].count("data:image/png") == 2,
        "the report shows thickness and arrival",
    )
    with open(os.path.join(work, "one", "maps", "h_max.qml")) as f:
        style = xml.etree.ElementTree.fromstring(f.read()).find(".//colorrampshader")
    check(
        len(style) == 11 and float(style[-1].get("value")) == float(style.get("maximumValue")),
        "a style of eleven colours up to the greatest value",
    )

    # ---- as others read them
    if shutil.which("gdalinfo") and shutil.which("gdallocationinfo"):

        def value(name, x, y):
            said = subprocess.run(
                ["gdallocationinfo", "-valonly", "-geoloc", f"one/maps/{name}.tif", str(x), str(y)],
                capture_output=True,
                text=True,
                cwd=work,
            )
            return float(said.stdout)

        for name in NAMES:
            said = json.loads(
                subprocess.run(["gdalinfo", "-json", "-stats", f"one/maps/{name}.tif"], capture_output=True, text=True, cwd=work).stdout
            )
            band = said["bands"][0]
            check(
                said["size"] == [20, 15]
                and said["geoTransform"] == [-1.0, 0.2, 0.0, 2.0, 0.0, -0.2]
                and band["type"] == "Float32"
                and band["noDataValue"] == -9999,
                f"{name}: size, place, cell, nodata as GDAL reads them",
            )
        for name in NAMES:
            os.path.exists(aux := os.path.join(work, "one", "maps", name + ".tif.aux.xml")) and os.remove(aux)
        for p in points.values():
            for column in ("t_arrival", "h_max", "v_max", "hv_max", "p_max", "h_end", "force_deposit"):
                here = value(column, p["x"], p["y"])
                there = float(p[column]) if p[column] else -9999
                check(
                    math.isclose(here, there, rel_tol=1e-6, abs_tol=1e-9),
                    f"{column} at {p['name']}: {here} in the map, {there} in points.csv",
                )
        total = sum(v for k in range(15) for c in range(20) if (v := value("h_end", -0.9 + 0.2 * c, -0.9 + 0.2 * k)) > 0) * CELL**2
        check(abs(total / maps["volume"] - 1) < 1e-6, f"the cells of h_end hold all soil: {total} of {maps['volume']} m3")
        h = value("h_end", 0.3, 0.3)
        sine = math.sin(math.radians(25))
        check(
            abs(value("force_deposit", 0.3, 0.3) / ((1 - sine) / (1 + sine) * RHO * 9.81 * h / 1000) - 1) < 0.05,
            "active pressure of the deposit",
        )
        check(abs(value("trust", 0.3, 0.3) - h / DX) < 1e-4, "trust counts layers")
        check(abs(value("bed_change", 0.3, 0.3) - (h - 0.8)) < 1e-5 and value("bed_change", 0.7, 0.3) > 0, "the surface sank and rose")
    else:
        print("gdal-bin is not installed: what GDAL reads was not looked at")

    # ---- when numbers fail the maps tell what came before; with time.retry they go back with the run
    wild = ("--force-step", "--set", "time.end=0.39", "--quiet", "--set")
    call("run", one, "-o", "broken", *wild, "time.step=0.03", expect=3)
    maps = summary("broken").get("maps", {})
    check(
        maps.get("time") == summary("broken")["time"] and "h_max.tif" in os.listdir(os.path.join(work, "broken", "maps")),
        f"a failure: {maps}",
    )
    call("run", one, "-o", "mended", *wild, "time.step=0.03", "--set", "time.retry=true")
    call("run", one, "-o", "half", *wild, "time.step=0.015")
    check(
        summary("mended")["retries"] and summary("mended")["state_hash"] == summary("half")["state_hash"],
        "back to the start, on with half the step",
    )
    check(digest("mended") == digest("half"), "the failed attempt is on no map")

    # ---- on real ground: its coordinate system, map coordinates, points of a file that names its system
    X0, Y0 = -11000.0, -12800.0
    with open(os.path.join(work, "dem.asc"), "w") as f:
        f.write(f"ncols 60\nnrows 40\nxllcorner {X0}\nyllcorner {Y0}\ncellsize 1\nNODATA_value -9999\n")
        f.writelines(" ".join(f"{100 - 0.6 * x:.3f}" for x in range(60)) + "\n" for _ in range(40))

    def collection(kind, coordinates, properties):
        return json.dumps(
            {
                "type": "FeatureCollection",
                "crs": {"type": "name", "properties": {"name": "urn:ogc:def:crs:EPSG::6670"}},
                "features": [{"type": "Feature", "properties": properties, "geometry": {"type": kind, "coordinates": coordinates}}],
            }
        )

    for name, text in (
        ("scar.geojson", collection("Polygon", [[[X0 + x, Y0 + y] for x, y in ((10, 14), (18, 14), (18, 24), (10, 24), (10, 14))]], {})),
        ("houses.geojson", collection("Point", [X0 + 19.5, Y0 + 19.5], {"name": "mill"})),
        (
            "slide.toml",
            SCENE.format(dimensions=3, end=1.5, maps='[maps]\nlimits = [0.5]\npoints = "houses.geojson"')
            .replace("spacing = 0.1", "spacing = 0.5")
            .replace("step = 0.004\n", "")
            .replace("3.0e5", "3.0e6")
            .replace(
                "[[wall]]\nbox = { low = [-1.0, -1.0, -0.3], high = [3.0, 2.0, 0.0] }",
                '[terrain]\ndem = "dem.asc"\ncrs = "EPSG:6670"\nfriction = 20.0',
            )
            .replace(
                "box = { low = [0.0, 0.0, 0.0], high = [0.6, 0.6, 0.8] }",
                'release = { outline = "scar.geojson", thickness = 2.0, on_top = true }',
            ),
        ),
    ):
        with open(os.path.join(work, name), "w") as f:
            f.write(text)
    call("run", "slide.toml", "-o", "slide", "--quiet")
    maps = summary("slide")["maps"]
    check("EPSG:6670" in maps["crs"], f"the ground's system: {maps['crs']}")
    check(
        abs(maps["x"] - X0) <= 3 and abs(maps["y"] - Y0) <= 3 and maps["columns"] >= 52 and maps["rows"] >= 32, f"over the ground: {maps}"
    )
    whole = maps["volume"] + maps["volume_beyond"]
    check(abs(whole / 160 - 1) < 0.03, f"160 m3 failed, {whole} m3 are there")
    mill = rows("slide", "points.csv")[0]
    check(mill["name"] == "mill" and 0 < float(mill["t_arrival"]) < 2, f"they come to the mill: {mill}")
    front = rows("slide", "front.csv")
    check(float(front[-1]["x"]) > X0 + 19 and abs(float(front[-1]["h_over_l"]) - 0.6) < 0.15, f"downhill, on a slope of 0.6: {front[-1]}")
    outline = polygons(os.path.join(work, "slide", "maps", "outline_0.5.shp"))
    check(all(X0 < x < X0 + 60 and Y0 < y < Y0 + 40 for r in outline for x, y in r), "the outline lies on the map")
    check(os.path.exists(os.path.join(work, "slide", "maps", "outline_0.5.prj")), "with its system")
    if shutil.which("gdalinfo"):
        for name in NAMES:
            said = json.loads(
                subprocess.run(["gdalinfo", "-json", f"slide/maps/{name}.tif"], capture_output=True, text=True, cwd=work).stdout
            )
            check("6670" in said["coordinateSystem"]["wkt"][-20:], f"{name}: GDAL reads the ground's system")
            place = said["geoTransform"]
            check(
                [place[0], place[1], place[5]] == [maps["x"], 1.0, -1.0] and place[3] == maps["y"] + maps["rows"],
                f"{name}: and its place, {place}",
            )

    # ---- what is refused: exit 2, and nothing is written
    flat = scene("flat", maps="[maps]", dimensions=2)
    check("maps: expected dimensions = 3" in call("run", flat, "-o", "flat", expect=2).stderr, "2-D")
    nowhere = scene("nowhere", maps='[maps]\npoints = "nowhere.csv"')
    for command in (("run", nowhere, "-o", "nowhere"), ("check", nowhere)):
        check("nowhere.csv" in call(*command, expect=2).stderr, f"{command[0]}: points that are not there")
    with open(os.path.join(work, "elsewhere.csv"), "w") as f:
        f.write("name,x,y\na,100,200\nb,300,400\n")
    beyond = scene("beyond", maps='[maps]\npoints = "elsewhere.csv"')
    said = call("run", beyond, "-o", "beyond", expect=2).stderr
    check(
        'elsewhere.csv: "a" at (100, 200) is not on the maps' in said and "none of the points is" in said,
        f"points of another place: {said}",
    )
    check(not any(os.path.exists(os.path.join(work, d)) for d in ("flat", "nowhere", "beyond")), "nothing was written")
    plain = scene("plain", maps="", end=0.05)
    call("run", plain, "-o", "plain", "--quiet")
    check(not os.path.exists(os.path.join(work, "plain", "maps")) and "maps" not in summary("plain"), "no maps where none are asked for")
    said = call("run", scene("plain", end=0.1), "-o", "plain", "--restart", expect=2).stderr
    check("without them" in said and "go on without [maps]" in said, f"a checkpoint without maps: {said}")
    said = call("run", scene("short", maps=MAPS + "cell = 0.3\n", end=0.5), "-o", "short", "--restart", expect=2).stderr
    check("cells of 0.2 m" in said and "maps.cell = 0.2" in said, f"a checkpoint with other cells: {said}")
    call("run", scene("short", maps=MAPS.replace("[0.15, 0.4]", "[0.3]"), end=0.45), "-o", "short", "--restart", "--quiet")
    check(os.path.exists(os.path.join(work, "short", "maps", "outline_0.3.shp")), "other limits may be drawn on a restart")
    check(not any(n.startswith("outline_0.15") for n in os.listdir(os.path.join(work, "short", "maps"))), "and those before are gone")

    if not failures:
        shutil.rmtree(work)
    finish()


if __name__ == "__main__":
    main()
