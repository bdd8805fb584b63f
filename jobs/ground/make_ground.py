"""The elevation models and outlines of the two scenes on real ground, from formulas: python3 make_ground.py writes them beside it."""

import json
import math
import os

HERE = os.path.dirname(os.path.abspath(__file__))
CELL = 2.0  # m


def write_dem(name, columns, rows, west, south, height):
    """ESRI ASCII from the north, values at the centres of cells."""
    with open(os.path.join(HERE, name), "w", encoding="ascii") as out:
        out.write(f"ncols {columns}\nnrows {rows}\nxllcorner {west}\nyllcorner {south}\ncellsize {CELL:g}\nNODATA_value -9999\n")
        for j in range(rows - 1, -1, -1):
            row = (height(west + (i + 0.5) * CELL, south + (j + 0.5) * CELL) for i in range(columns))
            out.write(" ".join(f"{z:.3f}" for z in row) + "\n")


def write_outline(name, ring):
    """One polygon as GeoJSON in the map's own system."""
    crs = {"type": "name", "properties": {"name": "urn:ogc:def:crs:EPSG::6670"}}
    feature = {"type": "Feature", "properties": {}, "geometry": {"type": "Polygon", "coordinates": [ring + ring[:1]]}}
    with open(os.path.join(HERE, name), "w", encoding="ascii") as out:
        json.dump({"type": "FeatureCollection", "crs": crs, "features": [feature]}, out)
        out.write("\n")


def slope(x, _):
    """35 degrees, an arc of 20 m radius, level from x = 60 m on."""
    angle, radius, level = math.radians(35), 20.0, 60.0
    begin = level - radius * math.sin(angle)
    if x >= level:
        return 0.0
    if x >= begin:
        return radius - math.sqrt(radius * radius - (level - x) ** 2)
    return radius * (1 - math.cos(angle)) + math.tan(angle) * (begin - x)


def gully(x, y):
    """A valley of 30 degrees that turns to the north and flattens."""
    axis = 12.0 * math.tanh((x - 50.0) / 12.0) + 12.0  # y of its bottom
    fall = 0.5 * 22.0 * math.log1p(math.exp(-(x - 75.0) / 22.0)) * 2 * math.tan(math.radians(30))
    return fall + 10.0 * (1 - math.exp(-(((y - axis) / 14.0) ** 2)))


def main():
    write_dem("slope.asc", 75, 35, -15, -35, slope)
    write_outline("slope_scar.geojson", [[2, -7], [16, -7], [16, 7], [2, 7]])
    write_dem("gully.asc", 80, 50, -10, -40, gully)
    write_outline("gully_scar.geojson", [[2, -7], [16, -7], [16, 7], [2, 7]])


if __name__ == "__main__":
    main()
