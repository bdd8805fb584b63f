#!/usr/bin/python3
"""The roofline of a run's report as a picture of its own: perf/roofline.py RESULT_DIRECTORY FILE.svg"""
import re
import sys


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    with open(sys.argv[1] + "/report.html", encoding="utf-8") as f:
        page = f.read()
    style = re.search(r"<style>(.*?)</style>", page, re.S)
    drawing = re.search(r'<svg viewBox="([^"]*)" role="img" aria-label="roofline">(.*?)</svg>', page, re.S)
    if not style or not drawing:
        sys.exit(f"perf/roofline.py: {sys.argv[1]}/report.html has no roofline: run `kuzure report {sys.argv[1]}` first")
    # On a page of its own there is no dark scheme to follow: white ground, the light colours.
    light = re.sub(r"@media \(prefers-color-scheme:dark\)\{:root\{.*?\}\}", "", style.group(1), flags=re.S).replace(
        "color-scheme:light dark", "color-scheme:light"
    )
    x, y, width, height = drawing.group(1).split()
    with open(sys.argv[2], "w", encoding="utf-8") as f:
        f.write(
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="{drawing.group(1)}" width="{2 * float(width):g}" height="{2 * float(height):g}">'
            f'<style>{light}</style><rect x="{x}" y="{y}" width="{width}" height="{height}" fill="#fff"/><g class="chart">{drawing.group(2)}</g></svg>\n'
        )


if __name__ == "__main__":
    main()
