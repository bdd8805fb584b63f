#!/usr/bin/python3
"""Real ground: kuzure terrain, the same ground from every kind of file, what is doubtful, and wrong files of every kind: exit 2, the file
named, a remedy, nothing written. Run as terrain_test.py PROGRAM."""
# Beyond 400 lines: a table, one entry a wrong input.
import json, math, os, re, shutil, struct, subprocess, sys, zipfile

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
from harness import check, finish, program, scratch

work = scratch("terrain")
os.environ["OMP_NUM_THREADS"] = "1"
X0, Y0, CELL, COLUMNS, ROWS = -1700.0, -12800.0, 2.0, 90, 70


def call(*args, folder=work):
    done = subprocess.run([program, *args], capture_output=True, text=True, timeout=300, cwd=folder)
    return done.returncode, done.stdout + done.stderr


def told(said):
    """The JSON at the front of what was said; warnings follow it."""
    return json.JSONDecoder().raw_decode(said, said.index("{"))[0]


def path(name):
    return os.path.join(work, name)


def write(name, data):
    with open(path(name), "wb" if isinstance(data, bytes) else "w") as f:
        f.write(data)
    return name


def height(x, y):
    """A slope of 30 degrees down to the east that ends on a flat, with ribs."""
    run = x - X0
    return round(60 - 0.577 * min(run, 90) + 0.6 * math.sin(0.11 * (y - Y0)) * math.exp(-(((run - 60) / 40) ** 2)), 2)


def heights(f=height, columns=COLUMNS, rows=ROWS):
    """Rows from the north."""
    return [[f(X0 + (i + 0.5) * CELL, Y0 + (rows - j - 0.5) * CELL) for i in range(columns)] for j in range(rows)]


def asc(grid, x=X0, y=Y0, cell=CELL, more=""):
    head = f"ncols {len(grid[0])}\nnrows {len(grid)}\nxllcorner {x}\nyllcorner {y}\ncellsize {cell}\nNODATA_value -9999\n{more}"
    return head + "".join(" ".join(f"{z:.2f}" for z in row) + "\n" for row in grid)


def tiff(
    grid,
    x=X0,
    y=Y0,
    epsg=6670,
    dx=CELL,
    dy=CELL,
    nodata="-9999",
    code="f",
    matrix=None,
    geographic=False,
    bands=1,
    point=False,
    keys=True,
    scale=True,
):
    """A GeoTIFF of one strip, uncompressed."""
    columns, rows = len(grid[0]), len(grid)
    data = b"".join(struct.pack(f"<{columns}{code}", *row) for row in grid)
    size = struct.calcsize(code)
    tags, blob = [], b""

    def tag(number, kind, values):
        nonlocal blob
        form, width = {2: ("s", 1), 3: ("H", 2), 4: ("I", 4), 12: ("d", 8)}[kind]
        raw = values if kind == 2 else struct.pack(f"<{len(values)}{form}", *values)
        tags.append((number, kind, len(raw) // width, raw))

    tag(256, 4, [columns]), tag(257, 4, [rows]), tag(258, 3, [8 * size] * bands), tag(259, 3, [1]), tag(262, 3, [1])
    tag(273, 4, [8]), tag(277, 3, [bands]), tag(278, 4, [rows]), tag(279, 4, [len(data)]), tag(
        339, 3, [{"f": 3, "d": 3, "h": 2, "e": 3}[code]] * bands
    )
    if scale and matrix is None:
        tag(33550, 12, [dx, dy, 0.0]), tag(33922, 12, [0.0, 0.0, 0.0, x, y + rows * dy, 0.0])
    if matrix is not None:
        tag(34264, 12, matrix)
    if keys:
        tag(
            34735,
            3,
            [1, 1, 0, 3, 1024, 0, 1, 2 if geographic else 1, 1025, 0, 1, 2 if point else 1, 2048 if geographic else 3072, 0, 1, epsg],
        )
    if nodata:
        tag(42113, 2, nodata.encode() + b"\0")
    tags.sort()
    start = 8 + len(data)
    after = start + 2 + 12 * len(tags) + 4
    directory = struct.pack("<H", len(tags))
    for number, kind, count, raw in tags:
        if len(raw) <= 4:
            directory += struct.pack("<HHI", number, kind, count) + raw.ljust(4, b"\0")
        else:
            directory += struct.pack("<HHII", number, kind, count, after + len(blob))
            blob += raw + b"\0" * (len(raw) % 2)
    return b"II*\0" + struct.pack("<I", start) + data + directory + struct.pack("<I", 0) + blob


def geojson(*rings, properties=None, crs="urn:ogc:def:crs:EPSG::6670", kind="Polygon"):
    features = [{"type": "Feature", "properties": properties or {}, "geometry": {"type": kind, "coordinates": one}} for one in rings]
    whole = {"type": "FeatureCollection", "features": features}
    if crs:
        whole["crs"] = {"type": "name", "properties": {"name": crs}}
    return json.dumps(whole)


def box(x, y, w, h):
    return [[X0 + x, Y0 + y], [X0 + x + w, Y0 + y], [X0 + x + w, Y0 + y + h], [X0 + x, Y0 + y + h], [X0 + x, Y0 + y]]


SCENE = """title = "a slide"
dimensions = 3
[space]
spacing = 0.5
[time]
end = 0.01
[soil.debris]
density = 1900.0
young = 5.0e6
poisson = 0.3
friction_angle = 30.0
[terrain]
dem = "dem.asc"
crs = "EPSG:6670"
window = [-1696.0, -12796.0, -1530.0, -12670.0]
friction = 24.0
[[body]]
soil = "debris"
release = { outline = "scar.geojson", thickness = 4.0 }
[effects]
gravity = [0.0, 0.0, -9.81]
viscosity = { alpha = 0.1, beta = 0.0 }
"""


def scene(*changes):
    text = SCENE
    for a, b in changes:
        assert a in text, a
        text = text.replace(a, b)
    return text


DEM, RELEASE, FRICTION = 'dem = "dem.asc"', "thickness = 4.0", "friction = 24.0"
NO_CRS = ('crs = "EPSG:6670"\n', "")
NO_WINDOW = ("window = [-1696.0, -12796.0, -1530.0, -12670.0]\n", "")


def hashed(name):
    code, said = call("check", name, "--json")
    return told(said)["scene_hash"] if code == 0 and "scene_hash" in said else f"exit {code}: {said[-500:]}"


def gml(
    grid, west, south, cell, start=(0, 0), end=None, order="+x-y", system="fguuid:jgd2011.bl", head="UTF-8", extra=(), kind="地表面", size=None
):
    columns, rows = size or (len(grid[0]), len(grid))
    values = [z for row in grid for z in row][start[1] * columns + start[0] : end]
    lines = [f"{'データなし' if z == -9999 else kind},{z:.2f}" if z != -9999 else "データなし,-9999." for z in values] + list(extra)
    return (
        f"""<?xml version="1.0" encoding="{head}"?>
<Dataset xmlns="http://fgd.gsi.go.jp/spec/2008/FGD_GMLSchema" xmlns:gml="http://www.opengis.net/gml/3.2"><DEM gml:id="DEM001"><mesh>48304671</mesh>
<coverage gml:id="DEM001-3"><gml:boundedBy><gml:Envelope srsName="{system}"><gml:lowerCorner>{south:.9f} {west:.9f}</gml:lowerCorner>
<gml:upperCorner>{south + rows * cell:.9f} {west + columns * cell:.9f}</gml:upperCorner></gml:Envelope></gml:boundedBy>
<gml:gridDomain><gml:Grid dimension="2"><gml:limits><gml:GridEnvelope><gml:low>0 0</gml:low><gml:high>{columns - 1} {rows - 1}</gml:high></gml:GridEnvelope></gml:limits>
<gml:axisLabels>x y</gml:axisLabels></gml:Grid></gml:gridDomain>
<gml:rangeSet><gml:DataBlock><gml:tupleList>
"""
        + "\n".join(lines)
        + f"""
</gml:tupleList></gml:DataBlock></gml:rangeSet>
<gml:coverageFunction><gml:GridFunction><gml:sequenceRule order="{order}">Linear</gml:sequenceRule><gml:startPoint>{start[0]} {start[1]}</gml:startPoint></gml:GridFunction></gml:coverageFunction>
</coverage></DEM></Dataset>
"""
    )


def main():
    grid = heights()
    write("dem.asc", asc(grid))
    write("scar.geojson", geojson([box(20, 50, 24, 30)]))
    write("s.toml", scene())
    code, said = call("check", "s.toml")
    check(code == 0, f"a scene on real ground is whole: exit {code}{'' if code == 0 else said[-1500:]}")
    if code != 0:
        return

    # ---- kuzure terrain
    code, said = call("terrain", "dem.asc", "--crs", "EPSG:6670", "--json", "-o", "dem.png")
    facts = told(said)
    check(
        code == 0 and facts["epsg"] == 6670 and [facts["columns"], facts["rows"], facts["cell"]] == [COLUMNS, ROWS, CELL],
        "kuzure terrain says system and cells",
    )
    check(facts["extent"] == [X0, Y0, X0 + COLUMNS * CELL, Y0 + ROWS * CELL] and facts["nodata_share"] == 0, "and where it lies")
    check(
        abs(facts["highest"] - max(map(max, grid))) < 1e-3 and sum(facts["slope_cells"]) == (COLUMNS - 2) * (ROWS - 2),
        "and heights and slopes",
    )
    check(open(path("dem.png"), "rb").read(8) == b"\x89PNG\r\n\x1a\n", "and draws a picture")
    code, said = call("terrain", "dem.asc")
    check(code == 0 and "names no system" in said and "25-30" in said, "in words, with a warning")
    check(
        call("terrain", "dem.asc", "-o", "dem.asc")[0] == 2 and open(path("dem.asc")).read() == asc(grid),
        "a picture never takes the place of an elevation model",
    )
    check(call("terrain", "absent.tif")[0] == 2, "no file is exit 2")

    # ---- the same ground from every kind of file gives the same scene, wherever the files lie
    want = hashed("s.toml")
    check(re.fullmatch("[0-9a-f]{16}", want) is not None, f"the scene has a hash: {want}")
    write("dem.tif", tiff(grid))
    write("dem64.tif", tiff(grid, code="d", epsg=6670))
    write("dem.prj", "")
    tiles = []
    for name, rows, columns in (
        ("nw", (0, 31), (0, 40)),
        ("ne", (0, 31), (40, COLUMNS)),
        ("sw", (31, ROWS), (0, 40)),
        ("se", (31, ROWS), (40, COLUMNS)),
    ):
        part = [row[columns[0] : columns[1]] for row in grid[rows[0] : rows[1]]]
        write(f"{name}.asc", asc(part, X0 + columns[0] * CELL, Y0 + (ROWS - rows[1]) * CELL))
        tiles.append(f'"{name}.asc"')
    for what, changes in {
        "a GeoTIFF": [(DEM, 'dem = "dem.tif"'), NO_CRS],
        "one in double precision": [(DEM, 'dem = "dem64.tif"')],
        "four tiles": [(DEM, f"dem = [{', '.join(tiles)}]")],
        "four tiles in another order": [(DEM, f"dem = [{', '.join(reversed(tiles))}]")],
    }.items():
        write("other.toml", scene(*changes))
        got = hashed("other.toml")
        check(got == want, f"{what} gives the same bits: {got}")
    holes = [[-9999 if 20 < i < 40 and 20 < j < 40 else z for i, z in enumerate(row)] for j, row in enumerate(grid)]
    write("holes.tif", tiff(holes))
    write("filled.toml", scene((DEM, 'dem = ["holes.tif", "dem.asc"]')))
    check(hashed("filled.toml") == want, "a later file fills holes")
    moved = [row[:] for row in grid]
    moved[40][50] += 0.01
    write("moved.tif", tiff(moved))
    write("moved.toml", scene((DEM, 'dem = "moved.tif"')))
    check(
        hashed("moved.toml") not in (want,) and re.fullmatch("[0-9a-f]{16}", hashed("moved.toml")) is not None,
        "a height changed by a centimetre gives another hash",
    )

    # ---- GSI's files, the same as a raster in degrees
    cell = 0.2 / 3600
    west, south = 130.984, 32.885
    flat = [[round(100 - 0.2 * i + 0.05 * j, 2) for i in range(60)] for j in range(50)]
    write("gsi.xml", gml(flat, west, south, cell))
    write("gsi_sjis.xml", gml(flat, west, south, cell, head="Shift_JIS").encode("cp932"))
    write("degrees.tif", tiff(flat, west, south, epsg=6668, geographic=True, dx=cell, dy=cell))
    with zipfile.ZipFile(path("gsi.zip"), "w", zipfile.ZIP_DEFLATED) as z:
        z.writestr("FG-GML-4830-46-71-dem5a.xml", gml([row[:25] for row in flat], west, south, cell))
        z.writestr("FG-GML-4830-46-72-dem5a.xml", gml([row[25:] for row in flat], west + 25 * cell, south, cell))
        z.writestr("readme.txt", "not a mesh")
    base = [NO_WINDOW, ('"scar.geojson"', '"here.geojson"')]
    write(
        "here.geojson",
        geojson([[[130.9852, 32.8860], [130.9856, 32.8860], [130.9856, 32.8863], [130.9852, 32.8863], [130.9852, 32.8860]]], crs=None),
    )
    hashes = {}
    for name in ("gsi.xml", "gsi_sjis.xml", "degrees.tif", "gsi.zip"):
        write("gsi.toml", scene((DEM, f'dem = "{name}"'), *base))
        hashes[name] = hashed("gsi.toml")
    check(
        len(set(hashes.values())) == 1 and re.fullmatch("[0-9a-f]{16}", hashes["gsi.xml"]) is not None,
        f"GSI's XML, Shift-JIS, a zip of meshes and a raster in degrees give the same bits: {hashes}",
    )
    code, said = call("terrain", "gsi.zip", "--json")
    facts = told(said)
    check(
        facts["format"] == "GSI JPGIS"
        and facts["columns"] == 60
        and abs(facts["cell_metres"][1] - 6.17) < 0.02
        and abs(facts["cell_metres"][0] - 5.2) < 0.02,
        "kuzure terrain reads a zip of meshes",
    )
    write("late.xml", gml(flat, west, south, cell, start=(10, 3), end=2000))
    facts = told(call("terrain", "late.xml", "--json")[1])
    check(
        abs(facts["nodata_share"] - (1 - (2000 - 190) / 3000)) < 1e-9,
        f"a list that begins late and ends early leaves the rest open: {facts['nodata_share']}",
    )

    # ---- what a run is told of the mass
    ways = {
        "a thickness map": 'thickness_map = "t.asc"',
        "a slip surface": 'surface = "slip.asc"',
        "before and after": 'before = "dem.asc", after = "slip.asc"',
    }
    inside = lambda x, y: X0 + 20 <= x <= X0 + 44 and Y0 + 50 <= y <= Y0 + 80
    write("t.asc", asc(heights(lambda x, y: 4.0 if inside(x, y) else 0.0)))
    write("slip.asc", asc(heights(lambda x, y: height(x, y) - (4.0 if inside(x, y) else 0.0))))
    for what, words in ways.items():
        for outline in ('outline = "scar.geojson", ', ""):
            write("way.toml", scene(('outline = "scar.geojson", thickness = 4.0', outline + words)))
            code, said = call("check", "way.toml", "--json")
            soil = told(said)["soil_particles"] if code == 0 else said[-500:]
            check(
                code == 0 and abs(soil * 0.125 / (24 * 30 * 4) - 1) < 0.02,
                f"{what}{' with an outline' if outline else ''}: the mass is 2880 m^3, found {soil} particles",
            )
    hole = geojson([box(20, 50, 24, 30), box(26, 56, 6, 6)])
    write("hole.geojson", hole)
    write("hole.toml", scene(('"scar.geojson"', '"hole.geojson"')))
    code, said = call("check", "hole.toml", "--json")
    soil = told(said)["soil_particles"] if code == 0 else said[-500:]
    check(code == 0 and abs(soil * 0.125 / ((24 * 30 - 36) * 4) - 1) < 0.02, f"a hole in the outline holds no soil: {soil}")
    write("by_feature.geojson", geojson([box(20, 50, 24, 30)], properties={"thickness": 4.0}))
    write("by_feature.toml", scene(('"scar.geojson", thickness = 4.0', '"by_feature.geojson"')))
    code, said = call("check", "by_feature.toml", "--json")
    soil = told(said)["soil_particles"] if code == 0 else said[-500:]
    check(code == 0 and abs(soil * 0.125 / 2880 - 1) < 0.02, f"thickness by the attribute of a feature: {soil}")

    # ---- a run keeps the keys, and its ground
    code, said = call("run", "s.toml", "-o", "out", "--threads", "1", "--set", "time.end=0.001")
    kept = open(path("out/scene.toml")).read() if code == 0 else ""
    check(
        code == 0 and "[terrain]" in kept and 'release = { outline = "/' in kept and "[[wall]]" not in kept,
        f"a run's scene.toml has the keys and not the ground as a wall: exit {code} {said[-800:] if code else ''}",
    )
    check(hashed("out/scene.toml") == want, "and reads back to the same scene")

    launcher = ["mpirun", "-n", "2", program, "run", "s.toml", "-o", "two", "--threads", "1", "--set", "time.end=0.001"]
    done = subprocess.run(launcher, capture_output=True, text=True, timeout=300, cwd=work)
    states = [
        json.load(open(path(f"{d}/summary.json")))["state_hash"] if done.returncode == 0 else done.stderr[-500:] for d in ("out", "two")
    ]
    check(states[0] == states[1], f"two ranks give the same bits: {states}")
    facts = told(call("check", "s.toml", "--json")[1])["ground"]
    one = facts["releases"][0]
    check(
        facts["origin"] == [-1696, -12796] and facts["crs"].endswith("(EPSG:6670)") and facts["cell"] == CELL,
        f"kuzure check says where the ground lies: {facts}",
    )
    check(
        abs(one["volume"] / 2880 - 1) < 0.02
        and abs(one["mean_thickness"] - 4) < 0.01
        and one["bed"] == "the elevation model less the thickness",
        f"and how large the mass is: {one}",
    )

    for words, changes in {
        'surface = "rough"': [("friction = 24.0", 'surface = "rough"')],
        'surface = "smooth"': [("friction = 24.0", 'surface = "smooth"')],
        'edge = "closed"': [("friction = 24.0", 'friction = 24.0\nedge = "closed"')],
    }.items():
        write("words.toml", scene(*changes))
        said = call("check", "words.toml")[1]
        check(
            words in said and re.fullmatch("[0-9a-f]{16}", hashed("words.toml")) and hashed("words.toml") != want,
            f"{words} is written as it was read",
        )

    # ---- friction from a raster: the numbers count, not the file; one number everywhere is that number
    rubbed = [[24.0 + (x < 40) for x in range(COLUMNS)]] * ROWS
    rubbed_in_part = [[24.0 if x > 40 else -9999.0 for x in range(COLUMNS)]] * ROWS
    write("r1.tif", tiff(rubbed))
    write("r2.asc", asc(rubbed))
    write("r2.prj", open(path("dem.prj")).read() if os.path.exists(path("dem.prj")) else "EPSG:6670")
    write("r3.tif", tiff([[x + 0.5 for x in row] for row in rubbed]))
    hashes = []
    for change in ('friction_map = "r1.tif"', 'friction = 3.0\nfriction_map = "r2.asc"', 'friction_map = "r3.tif"'):
        write("words.toml", scene((FRICTION, change)))
        hashes.append(hashed("words.toml"))
    check(
        len({want, *hashes}) == 4 and all(len(h) == 16 for h in hashes),
        f"friction by a raster, and other rasters, are other scenes: {hashes}",
    )
    states = {}
    for name, change in {
        "number": FRICTION,
        "same": 'friction_map = "same.tif"',
        "part": 'friction = 24.0\nfriction_map = "part.tif"',
        "other": 'friction_map = "r1.tif"',
        "dragged": FRICTION + "\nxi = 20.0",
    }.items():
        write("same.tif", tiff([[24.0] * COLUMNS] * ROWS))
        write("part.tif", tiff(rubbed_in_part))
        write("words.toml", scene((FRICTION, change)))
        code, said = call("run", "words.toml", "-o", f"bed_{name}", "--threads", "1", "-q", "--set", "time.end=0.5")
        states[name] = json.load(open(path(f"bed_{name}/summary.json")))["state_hash"] if code == 0 else said[-300:]
    check(states["same"] == states["part"] == states["number"], f"a raster of 24 degrees, with gaps or without, is friction = 24: {states}")
    check(len(set(states.values())) == 3, f"another raster, and drag, are another slide: {states}")

    # ---- doubtful
    doubts = {
        "edge": ([], "the edge of the ground lies within reach"),
        "layers": ([("spacing = 0.5", "spacing = 1.0")], "layers of particles thick"),
        "whole": ([(DEM, 'dem = "whole.asc"')], "whole metres"),
        "steep": ([(DEM, 'dem = "steep.asc"')], "steeper than 55 degrees"),
        "gaps": ([(DEM, 'dem = "gaps.asc"')], "have no data"),
        "thin": ([(RELEASE, "thickness = 0.05"), ("spacing = 0.5", "spacing = 0.02")], "area^1.5"),
        "coarse": ([(RELEASE, "thickness = 1.5"), ("spacing = 0.5", "spacing = 0.25")], "coarser than the release is thick"),
        "zone": ([('crs = "EPSG:6670"', 'crs = "EPSG:2056"')], "outside the area"),
        "shifted": (
            [('outline = "scar.geojson", thickness = 4.0', 'outline = "scar.geojson", before = "dem.asc", after = "low.asc"')],
            "outside the outline too",
        ),
    }
    write("whole.asc", asc([[float(round(z)) for z in row] for row in grid]))
    write("steep.asc", asc(heights(lambda x, y: height(x, y) - (12 if x > X0 + 60 else 0))))
    write("gaps.asc", asc([[-9999 if i == 60 and j > 30 else z for i, z in enumerate(row)] for j, row in enumerate(grid)]))
    write("low.asc", asc(heights(lambda x, y: height(x, y) - 4)))
    for name, (changes, words) in doubts.items():
        write("doubt.toml", scene(*changes, *([('"scar.geojson"', '"scar2056.geojson"')] if name == "zone" else [])))
        if name == "zone":
            write("scar2056.geojson", geojson([box(20, 50, 24, 30)], crs="urn:ogc:def:crs:EPSG::2056"))
        code, said = call("check", "doubt.toml")
        check(code == 0 and words in said, f"{name}: a warning says \"{words}\": exit {code} {'' if words in said else said[-900:]}")

    # ---- wrong files
    bow_tie = [[X0 + 20, Y0 + 50], [X0 + 44, Y0 + 80], [X0 + 44, Y0 + 50], [X0 + 20, Y0 + 80], [X0 + 20, Y0 + 50]]
    nw = [row[:] for row in grid]
    nw[33][15] = -9999
    good = asc(grid)
    lines = good.split("\n")
    wrong = {  # name: (files, changes of the scene, what the message has)
        "no_crs": ({}, [NO_CRS], ["dem.asc: it has no system of coordinates", "terrain.crs", "Remedy"]),
        "crs_unknown": ({}, [('"EPSG:6670"', '"EPSG:99999"')], ["terrain.crs: expected a coordinate system", "EPSG:99999"]),
        "crs_degrees": ({}, [('"EPSG:6670"', '"EPSG:4326"')], ["degrees"]),
        "crs_heights": ({}, [('"EPSG:6670"', '"EPSG:6695"')], ["expected a projected or geographic"]),
        "crs_feet": ({}, [('"EPSG:6670"', '"EPSG:2225"')], ["not in metres"]),
        "degrees_as_metres": (
            {"w.tif": tiff(flat, west, south, dx=cell, dy=cell)},
            [(DEM, 'dem = "w.tif"'), NO_WINDOW],
            ["w.tif", "which are degrees"],
        ),
        "metres_as_degrees": ({"w.tif": tiff(grid, epsg=4326, geographic=True)}, [(DEM, 'dem = "w.tif"')], ["w.tif", "which are metres"]),
        "degrees_without_map": (
            {"w.tif": tiff(flat, west, south, epsg=6668, geographic=True, dx=cell, dy=cell)},
            [(DEM, 'dem = "w.tif"'), NO_CRS, NO_WINDOW],
            ["w.tif: it is in degrees", "EPSG:32652"],
        ),
        "other_crs": (
            {"w.tif": tiff(grid, epsg=6671)},
            [(DEM, 'dem = "w.tif"')],
            ["w.tif: it is in JGD2011 / Japan Plane Rectangular CS III", "gdalwarp -t_srs EPSG:6670"],
        ),
        "two_crs": (
            {"w.tif": tiff(grid), "v.tif": tiff(grid, epsg=6671)},
            [(DEM, 'dem = ["w.tif", "v.tif"]'), NO_CRS],
            ["v.tif: it is in"],
        ),
        "friction_none": (
            {"w.tif": tiff(rubbed_in_part)},
            [(FRICTION, 'friction_map = "w.tif"')],
            ["terrain.friction_map", "w.tif: no data at", "friction = 24.0"],
        ),
        "friction_zero": (
            {"w.tif": tiff([[0.0 if x < 30 else 20.0 for x in range(COLUMNS)]] * ROWS)},
            [(FRICTION, 'friction_map = "w.tif"')],
            ["terrain.friction_map", "found 0 at"],
        ),
        "friction_other_crs": (
            {"w.tif": tiff(grid, epsg=6671)},
            [(FRICTION, 'friction_map = "w.tif"')],
            ["terrain.friction_map", "w.tif: it is in"],
        ),
        "friction_map_rough": (
            {"w.tif": tiff(rubbed)},
            [(FRICTION, 'surface = "rough"\nfriction_map = "w.tif"')],
            ["terrain.friction_map", "rough or smooth"],
        ),
        "xi_rough": ({}, [(FRICTION, 'surface = "rough"\nxi = 500.0')], ["terrain.xi", "rough or smooth"]),
        "xi_zero": ({}, [(FRICTION, FRICTION + "\nxi = 0.0")], ["terrain.xi", "0 < x"]),
        "xi_leap_frog": (
            {},
            [(FRICTION, FRICTION + "\nxi = 500.0"), ("[terrain]", '[accuracy]\nscheme = "leap-frog"\n[terrain]')],
            ["terrain.xi", 'accuracy.scheme = "staggered"'],
        ),
        "dem_absent": ({}, [(DEM, 'dem = "nowhere.tif"')], ["nowhere.tif: cannot be opened", "scene file's directory"]),
        "dem_directory": ({}, [(DEM, 'dem = "."')], ["found a directory"]),
        "dem_none": ({}, [(DEM, "dem = []")], ["terrain.dem: expected a string or an array of strings"]),
        "dem_number": ({}, [(DEM, "dem = 3")], ["terrain.dem: expected a string or an array of strings, found 3"]),
        "dem_empty_file": ({"w.asc": ""}, [(DEM, 'dem = "w.asc"')], ["w.asc: expected a GeoTIFF"]),
        "dem_picture": ({"w.png": b"\x89PNG\r\n\x1a\n" + bytes(100)}, [(DEM, 'dem = "w.png"')], ["w.png: expected a GeoTIFF"]),
        "asc_word": (
            {"w.asc": good.replace(lines[20].split()[3], "high", 1)},
            [(DEM, 'dem = "w.asc"')],
            ["w.asc:", 'expected a number, found "high"', "row "],
        ),
        "asc_short": (
            {"w.asc": good[: len(good) // 2]},
            [(DEM, 'dem = "w.asc"')],
            ["w.asc: 70 rows of 90 numbers were expected, the file ends in row"],
        ),
        "asc_long": ({"w.asc": good + "1 2 3\n"}, [(DEM, 'dem = "w.asc"')], ["w.asc:", "more than 90 x 70 numbers"]),
        "asc_no_cell": ({"w.asc": good.replace("cellsize 2.0\n", "")}, [(DEM, 'dem = "w.asc"')], ["w.asc: its header has no cellsize"]),
        "asc_two_corners": (
            {"w.asc": good.replace("NODATA", "xllcenter -1699\nNODATA")},
            [(DEM, 'dem = "w.asc"')],
            ["both xllcorner and xllcenter"],
        ),
        "asc_not_square": (
            {"w.asc": good.replace("cellsize 2.0", "dx 2.0\ndy 3.0")},
            [(DEM, 'dem = "w.asc"')],
            ["cells of 2 x 3 are not square", "gdalwarp"],
        ),
        "asc_columns": ({"w.asc": good.replace("ncols 90", "ncols -90")}, [(DEM, 'dem = "w.asc"')], ["whole numbers of columns and rows"]),
        "asc_prj": ({"w.asc": good, "w.prj": "PROJCS[nothing"}, [(DEM, 'dem = "w.asc"')], ["w.prj: expected a coordinate system"]),
        "tif_turned": (
            {"w.tif": tiff(grid, matrix=[1.9, 0.5, 0, X0, 0.5, -1.9, 0, Y0 + ROWS * CELL, 0, 0, 0, 0, 0, 0, 0, 1])},
            [(DEM, 'dem = "w.tif"')],
            ["w.tif: its grid is turned", "gdalwarp"],
        ),
        "tif_not_square": ({"w.tif": tiff(grid, dy=3.0)}, [(DEM, 'dem = "w.tif"')], ["w.tif: cells of 2 x 3 are not square", "gdalwarp"]),
        "tif_nowhere": (
            {"w.tif": tiff(grid, scale=False)},
            [(DEM, 'dem = "w.tif"')],
            ["w.tif: it does not say where on the map it lies", "gdal_translate"],
        ),
        "tif_south_up": ({"w.tif": tiff(grid, dy=-2.0)}, [(DEM, 'dem = "w.tif"')], ["w.tif: its cells run"]),
        "tif_bands": (
            {"w.tif": tiff([[z for z in row for _ in range(3)][: 3 * (COLUMNS // 3)] for row in grid], bands=3)},
            [(DEM, 'dem = "w.tif"')],
            ["found 3 bands"],
        ),
        "tif_half": ({"w.tif": tiff(grid, code="e")}, [(DEM, 'dem = "w.tif"')], ["expected float32, float64 or integers", "16 bits"]),
        "tif_cut": ({"w.tif": tiff(grid)[:9000]}, [(DEM, 'dem = "w.tif"')], ["w.tif"]),
        "tif_nodata_word": ({"w.tif": tiff(grid, nodata="none")}, [(DEM, 'dem = "w.tif"')], ['its nodata value "none" is no number']),
        "heights_nodata_undeclared": (
            {"w.tif": tiff([[-32768 if j < 9 else z for z in row] for j, row in enumerate(grid)], nodata="")},
            [(DEM, 'dem = "w.tif"')],
            ["height of -32768 m", "gdal_translate -a_nodata -32768"],
        ),
        "window_outside": (
            {},
            [("-1696.0, -12796.0, -1530.0, -12670.0", "0.0, 0.0, 10.0, 10.0")],
            ["terrain.window", "does not meet the elevation model"],
        ),
        "window_turned": (
            {},
            [("-1696.0, -12796.0, -1530.0, -12670.0", "-1530.0, -12796.0, -1696.0, -12670.0")],
            ["terrain.window: expected [x from, y from, x to, y to]"],
        ),
        "window_three": ({}, [("-1696.0, -12796.0, -1530.0, -12670.0", "1.0, 2.0, 3.0")], ["terrain.window: expected four numbers"]),
        "window_tiny": ({}, [("-1530.0, -12670.0", "-1692.0, -12792.0")], ["terrain.window", "at least 5 x 5 cells"]),
        "friction_none": ({}, [("friction = 24.0\n", "")], ["terrain.friction: expected the friction angle"]),
        "friction_beside_rough": (
            {},
            [("friction = 24.0", 'friction = 24.0\nsurface = "rough"')],
            ["terrain.friction: expected none beside a rough"],
        ),
        "friction_radians": ({}, [("friction = 24.0", "friction = 124.0")], ["terrain.friction: expected a number in deg"]),
        "flat": ({}, [("dimensions = 3", "dimensions = 2")], ["dimensions = 3"]),
        "release_alone": (
            {},
            [('[terrain]\ndem = "dem.asc"\ncrs = "EPSG:6670"\nwindow = [-1696.0, -12796.0, -1530.0, -12670.0]\nfriction = 24.0\n', "")],
            ["body.0.release: expected [terrain]"],
        ),
        "release_nothing": ({}, [('outline = "scar.geojson", thickness = 4.0', "")], ["body.0.release", "how thick the mass is"]),
        "release_two_ways": ({}, [(RELEASE, 'thickness = 4.0, surface = "slip.asc"')], ["body.0.release: expected one of thickness"]),
        "release_no_outline": ({}, [('outline = "scar.geojson", ', "")], ["body.0.release.thickness: expected an outline"]),
        "release_before_alone": ({}, [(RELEASE, 'before = "dem.asc"')], ["body.0.release.before: expected before and after together"]),
        "release_thickness_negative": ({}, [(RELEASE, "thickness = -4.0")], ["body.0.release.thickness: expected a number in m, 0 < x"]),
        "release_on_top": ({}, [(RELEASE, 'surface = "slip.asc", on_top = true')], ["body.0.release.on_top"]),
        "outline_absent": ({}, [('"scar.geojson"', '"w.geojson"')], ["w.geojson: there is no such file"]),
        "outline_ending": ({"w.kml": "x"}, [('"scar.geojson"', '"w.kml"')], ["w.kml: expected a name ending in .shp"]),
        "outline_text": ({"w.geojson": "{ nothing"}, [('"scar.geojson"', '"w.geojson"')], ["w.geojson: cannot be read as GeoJSON"]),
        # The library copies and writes JSON by calling itself: it would end the program.
        "outline_deep": (
            {"w.geojson": '{"type": "Feature", "properties": {"thickness": ' + "[" * 200000 + "]" * 200000 + '}, "geometry": null}'},
            [('"scar.geojson"', '"w.geojson"')],
            ["w.geojson: cannot be read as GeoJSON"],
        ),
        "dem_short": (
            {"w.asc": "ncols 19000\nnrows 19000\nxllcorner -9000\nyllcorner -19000\ncellsize 1\n1 2 3\n"},
            [("dem.asc", "w.asc")],
            ["w.asc: 19000 rows of 19000 numbers were expected, its 74 bytes do not hold them"],
        ),
        "outline_shp_alone": ({"w.shp": b"\0" * 200}, [('"scar.geojson"', '"w.shp"')], ["w.shp: its .shx is not beside it"]),
        "outline_open": (
            {"w.geojson": geojson([box(20, 50, 24, 30)[:-1]])},
            [('"scar.geojson"', '"w.geojson"')],
            ["w.geojson: feature 1: its ring is open"],
        ),
        "outline_crosses": (
            {"w.geojson": geojson([bow_tie])},
            [('"scar.geojson"', '"w.geojson"')],
            ["w.geojson: feature 1: its outline crosses itself at (-1668, -12735)"],
        ),
        "outline_overlap": (
            {"w.geojson": geojson([box(20, 50, 24, 30)], [box(30, 60, 24, 30)])},
            [('"scar.geojson"', '"w.geojson"')],
            ["w.geojson: feature 1: it overlaps feature 2"],
        ),
        "outline_inside": (
            {"w.geojson": geojson([box(20, 50, 24, 30)], [box(26, 56, 6, 6)])},
            [('"scar.geojson"', '"w.geojson"')],
            ["w.geojson: feature 2: it lies inside feature 1"],
        ),
        "outline_line": (
            {"w.geojson": geojson(box(20, 50, 24, 30), kind="LineString")},
            [('"scar.geojson"', '"w.geojson"')],
            ['feature 1: expected a Polygon or MultiPolygon, found "LineString"'],
        ),
        "outline_nothing": (
            {"w.geojson": geojson()},
            [('"scar.geojson"', '"w.geojson"')],
            ["w.geojson: expected polygons, found no feature"],
        ),
        "outline_beyond": (
            {"w.geojson": geojson([[[X0 + 20, Y0 + 50], [X0 + 40, Y0 + 50], [1e200, Y0 + 90], [X0 + 20, Y0 + 50]]])},
            [('"scar.geojson"', '"w.geojson"')],
            ["w.geojson: feature 1: (1e+200, -12710) is no place on the map"],
        ),
        "outline_sliver": (
            {"w.geojson": geojson([[[X0 + 20, Y0 + 50], [X0 + 40, Y0 + 50], [X0 + 20, Y0 + 50]]])},
            [('"scar.geojson"', '"w.geojson"')],
            ["feature 1: a ring that encloses nothing"],
        ),
        "outline_metres": (
            {"w.geojson": geojson([box(20, 50, 24, 30)], crs=None)},
            [('"scar.geojson"', '"w.geojson"')],
            ["w.geojson: feature 1:", "no longitude and latitude", "RFC 7946"],
        ),
        "outline_other_crs": (
            {"w.geojson": geojson([box(20, 50, 24, 30)], crs="urn:ogc:def:crs:EPSG::32652")},
            [('"scar.geojson"', '"w.geojson"')],
            ["w.geojson: it is in WGS 84 / UTM zone 52N"],
        ),
        "outline_elsewhere": (
            {"w.geojson": geojson([box(5000, 50, 24, 30)])},
            [('"scar.geojson"', '"w.geojson"')],
            ["w.geojson: it lies at", "do not overlap"],
        ),
        "outline_swapped": (
            {"w.geojson": geojson([[[y, x] for x, y in box(20, 50, 24, 30)]])},
            [('"scar.geojson"', '"w.geojson"')],
            ["With x and y exchanged"],
        ),
        "outline_over_edge": (
            {"w.geojson": geojson([box(-20, 50, 40, 30)])},
            [('"scar.geojson"', '"w.geojson"')],
            ["w.geojson: its corner", "outside the ground"],
        ),
        "outline_no_thickness": ({}, [(", thickness = 4.0", "")], ['scar.geojson: feature 1: it has no attribute "thickness"']),
        "outline_thickness_word": (
            {"w.geojson": geojson([box(20, 50, 24, 30)], properties={"thickness": "deep"})},
            [('"scar.geojson"', '"w.geojson"'), (", thickness = 4.0", "")],
            ['w.geojson: feature 1: its attribute "thickness"', 'found "deep"'],
        ),
        "outline_thickness_negative": (
            {"w.geojson": geojson([box(20, 50, 24, 30)], properties={"thickness": -2})},
            [('"scar.geojson"', '"w.geojson"'), (", thickness = 4.0", "")],
            ["w.geojson: feature 1", 'found "-2"'],
        ),
        "nodata_under": ({"w.asc": asc(nw)}, [(DEM, 'dem = "w.asc"')], ["w.asc: no data at (-1669, -12727) under the release"]),
        "map_negative": (
            {"w.asc": asc(heights(lambda x, y: -1.0 if x > X0 + 60 else 2.0))},
            [(RELEASE, 'thickness_map = "w.asc"')],
            ["w.asc: expected thicknesses from 0, found -1 m"],
        ),
        "map_gap": (
            {"w.asc": asc([[-9999 if j == 33 else 2.0 for _ in row] for j, row in enumerate(grid)])},
            [(RELEASE, 'thickness_map = "w.asc"')],
            ["w.asc: no data at", "under the release"],
        ),
        "map_zero": (
            {"w.asc": asc(heights(lambda x, y: 0.0))},
            [('outline = "scar.geojson", thickness = 4.0', 'thickness_map = "w.asc"')],
            ["w.asc: no cell of it is thicker than 0"],
        ),
        "map_elsewhere": (
            {"w.asc": asc(grid, x=90000)},
            [('outline = "scar.geojson", thickness = 4.0', 'thickness_map = "w.asc"')],
            ["w.asc: it lies at", "do not overlap"],
        ),
        "slip_above": (
            {"w.asc": asc(heights(lambda x, y: height(x, y) + 3))},
            [(RELEASE, 'surface = "w.asc"')],
            ["w.asc: the slip surface lies 3.00 m above the ground"],
        ),
        "exchanged": (
            {},
            [(RELEASE, 'before = "slip.asc", after = "dem.asc"')],
            ["body.0.release: the ground is nowhere lower after than before", "exchanged?"],
        ),
        "xml_long": (
            {"w.xml": gml(flat, west, south, cell, extra=["地表面,1.00"])},
            [(DEM, 'dem = "w.xml"'), *base],
            ["w.xml: value 3001", "its list is longer than its grid"],
        ),
        "xml_start": (
            {"w.xml": gml(flat, west, south, cell).replace("<gml:startPoint>0 0", "<gml:startPoint>70 0")},
            [(DEM, 'dem = "w.xml"'), *base],
            ["w.xml: its startPoint 70 0 lies outside"],
        ),
        "xml_order": (
            {"w.xml": gml(flat, west, south, cell, order="+x+y")},
            [(DEM, 'dem = "w.xml"'), *base],
            ['w.xml: expected values in the order "+x-y"'],
        ),
        "xml_type": ({"w.xml": gml(flat, west, south, cell, kind="月面")}, [(DEM, 'dem = "w.xml"'), *base], ["w.xml: value 1", "月面"]),
        "xml_number": (
            {"w.xml": gml(flat, west, south, cell).replace("地表面,100.00", "地表面,?", 1)},
            [(DEM, 'dem = "w.xml"'), *base],
            ["w.xml: value 1", "expected a height"],
        ),
        "xml_system": (
            {"w.xml": gml(flat, west, south, cell, system="fguuid:tokyo.bl")},
            [(DEM, 'dem = "w.xml"'), *base],
            ["w.xml: expected latitude and longitude in fguuid:jgd2011.bl"],
        ),
        "xml_broken": ({"w.xml": gml(flat, west, south, cell)[:3000]}, [(DEM, 'dem = "w.xml"'), *base], ["w.xml: cannot be read as XML"]),
        "xml_other": (
            {"w.xml": '<?xml version="1.0"?><kml/>'},
            [(DEM, 'dem = "w.xml"'), *base],
            ["w.xml: expected an elevation model of GSI"],
        ),
        "zip_empty": ({"w.zip": b"PK\x03\x04" + b"\0" * 60}, [(DEM, 'dem = "w.zip"'), *base], ["w.zip"]),
        "edge_word": ({}, [("friction = 24.0", 'friction = 24.0\nedge = "shut"')], ['terrain.edge: expected one of "open", "closed"']),
        "misspelt": ({}, [("friction = 24.0", "frictoin = 24.0")], ['did you mean "friction"']),
    }
    check(len(wrong) >= 40, f"{len(wrong)} wrong inputs")
    shared = ["slip.asc", "dem.asc", "scar.geojson", "here.geojson"]
    for name, (files, changes, says) in wrong.items():
        folder = path("wrong-" + name)
        os.mkdir(folder)
        for f in shared:
            shutil.copy(path(f), folder)
        for file, data in files.items():
            write(os.path.join("wrong-" + name, file), data)
        write(os.path.join("wrong-" + name, "s.toml"), scene(*changes))
        before = sorted(os.listdir(folder))
        code, said = call("run", "s.toml", "-o", "out", folder=folder)
        missing = [w for w in says if w not in said]
        check(
            code == 2 and not missing and "s.toml" in said and sorted(os.listdir(folder)) == before,
            f"{name}: exit {code}, missing {missing}{': ' + said[-600:] if code != 2 or missing else ''}",
        )


if __name__ == "__main__":
    if "built without maps" in call("terrain", "x.tif")[1]:
        print("not run: built without maps (KUZURE_TERRAIN=OFF)")
        sys.exit(77)
    main()
    finish()
