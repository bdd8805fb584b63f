#!/usr/bin/python3
"""kuzure report for runs that finished, failed, were stopped, lost half their files, or never had a picture: the page is
well-formed, self-contained, has all its sections and the right verdict, and shows what users wrote as text. Where Chromium is
installed, no width makes it scroll sideways."""
import html.parser
import json
import os
import re
import shutil
import subprocess
import sys

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
from harness import block, check, finish, program, scratch

work = scratch("report")
os.environ["XDG_CACHE_HOME"] = work + "/cache"  # roofs measured beside other tests are not for keeping
SECTIONS = ["warnings", "pictures", "energy", "heap", "phases", "roofline", "balance", "effects", "provenance", "scene"]
SCENE = block(
    (0.32, 0, 0.32),
    ((-0.4, 0, -0.16), (0.72, 0, 0)),
    title="<b>sand</b> & 'clay' <script>alert(1)</script>",
    end=0.02,
    effects="viscosity = { alpha = 0.1, beta = 0.0 }",
    output='every = 0.01\nhistory = 0.001\npicture = { view = "cut", color = "speed" }',
)


class Page(html.parser.HTMLParser):
    VOID = {"meta", "img", "br", "hr", "input", "link"}
    LOADS = {"src", "href", "data", "action", "poster", "srcset", "xlink:href"}

    def __init__(self):
        super().__init__()
        self.open, self.wrong, self.outside, self.ids, self.tags, self.text = [], [], [], [], [], ""

    def handle_starttag(self, tag, attributes):
        self.tags.append(tag)
        for name, value in attributes:
            if name in self.LOADS and not (value or "").startswith("data:"):
                self.outside.append((tag, name, value))
            if name.startswith("on"):
                self.outside.append((tag, name, value))
            if name == "id":
                self.ids.append(value)
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attributes):
        self.handle_starttag(tag, attributes)
        if tag not in self.VOID:
            self.open.pop()

    def handle_endtag(self, tag):
        if not self.open or self.open.pop() != tag:
            self.wrong.append(f"</{tag}> at {self.getpos()}")

    def handle_data(self, data):
        if self.open and self.open[-1] == "style":
            if re.search(r"url\(|@import", data):
                self.outside.append(("style", "", "url or @import"))
        else:
            self.text += data + " "


def run(*args, expect=0):
    r = subprocess.run([program, *args], cwd=work, capture_output=True, text=True)
    check(
        r.returncode == expect,
        f"exit {expect} of {' '.join(args)[:70]}" + ("" if r.returncode == expect else f": {r.returncode} {r.stderr}"),
    )
    return r


def page(directory, verdict, what, report=True):
    if report:
        run("report", directory)
    text = open(f"{work}/{directory}/report.html", encoding="utf-8").read()
    p = Page()
    p.feed(text)
    p.close()
    check(not p.wrong and not p.open, f"{what}: tags are balanced {p.wrong[:3]}{p.open[:3]}")
    check(not p.outside, f"{what}: nothing is loaded from outside {p.outside[:3]}")
    check(not re.search(r"https?:|//[a-z]+\.", re.sub(r"base64,[A-Za-z0-9+/=]*", "", text)), f"{what}: no address of the network")
    missing = [s for s in SECTIONS if s not in p.ids]
    check(not missing, f"{what}: all sections {missing}")
    check(verdict in p.text, f"{what}: the verdict is '{verdict}'")
    check("script" not in p.tags, f"{what}: what users write stays text")
    check(not re.search(r"\bnan\b", re.sub(r"base64,[A-Za-z0-9+/=]*", "", text), re.I), f"{what}: no number that is none")
    return p, text


def sideways(directory):
    """Pixels by which the page is wider than a window of 390 and of 1280, as Chromium lays it out."""
    wrapper = f"{work}/{directory}/wrapper.html"
    with open(wrapper, "w") as f:
        f.write(
            "<!doctype html><body>"
            + "".join(f'<iframe src="report.html" width="{w}" height="800" style="border:0"></iframe>' for w in (390, 1280))
            + "<script>onload=()=>{document.title=[...document.querySelectorAll('iframe')].map(f=>"
            "f.contentDocument.documentElement.scrollWidth-f.clientWidth).join(' ')}</script>"
        )
    r = subprocess.run(
        [
            "chromium",
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--allow-file-access-from-files",
            "--virtual-time-budget=4000",
            f"--user-data-dir={work}/chromium",
            "--dump-dom",
            "file://" + wrapper,
        ],
        capture_output=True,
        text=True,
        timeout=240,
    )
    found = re.search(r"<title>(-?\d+) (-?\d+)</title>", r.stdout)
    return [int(x) for x in found.groups()] if found else r.stderr[-300:]


def main():
    open(work + "/s.toml", "w").write(SCENE)
    done = run("run", "s.toml", "-o", "done")
    check("predicted" in done.stdout and "report.html" in done.stdout, "a run says what was predicted and where its report is")
    summary = json.load(open(work + "/done/summary.json"))
    check(summary["predicted_seconds"] > 0 and len(summary["predicted_interval"]) == 2, "summary.json keeps the prediction")
    p, text = page("done", "Finished", "written by the run", report=False)
    check(text.count("data:image/png") == 3, "start, during and end are shown")
    check("<b>sand</b>" in p.text, "the title is shown as written")
    p, text = page("done", "Finished", "finished")
    check("machine" in json.load(open(work + "/done/timers.json")) and 'class="roof"' in text, "the roofline has its roofs")
    check(p.tags.count("circle") >= 2, "the roofline has a dot a phase")
    progress = open(work + "/done/progress.csv").read().splitlines()
    check(progress[0] == "time,step,dt,wall,steps_per_second,balance" and len(progress) > 50, "progress.csv has its rows")
    run("run", "s.toml", "-o", "failed", "--quiet", "--force-step", "--set", "time.step=3.2e-3", "--set", "time.end=7.2", expect=3)
    p, text = page("failed", "the numbers broke (exit code 3)", "failed")
    check(
        "the moment of failure" in p.text and "the last picture before it" in p.text and text.count("data:image/png") == 3,
        "a failed run shows its moment and the last picture before it",
    )
    # In three seconds a fast machine might do it all, and a disk with little room would not hold all of its pictures.
    run("run", "s.toml", "-o", "stopped", "--quiet", "--force-size", "--set", "time.end=50", "--max-minutes", "0.005", expect=5)
    p, _ = page("stopped", "Stopped on request", "stopped")
    check("of 50 s" in p.text, "a stopped run says how far it came")
    steps = json.load(open(work + "/stopped/summary.json"))["steps"]
    run("run", "s.toml", "-o", "stopped", "--quiet", "--restart", "--set", f"time.end={(steps + 60) * 1e-4}")
    page("stopped", "Finished", "restarted")
    run("run", "s.toml", "-o", "bare", "--quiet", "--set", "time.end=0.002", "--set", "output.history=1.0", "--set", "output.every=1.0")
    for name in ("summary.json", "timers.json", "progress.csv"):
        os.remove(f"{work}/bare/{name}")
    for name in os.listdir(work + "/bare"):
        if name.startswith("picture_"):
            os.remove(f"{work}/bare/{name}")
    with open(work + "/bare/history.csv", "a") as f:
        f.write("0.003,30,1e-4,12")  # torn
    page("bare", "No end was recorded", "half-written")
    open(work + "/bare/summary.json", "w").write('{"status": 3, "energy": [], "effects": {"on": [1]}, "warn')
    open(work + "/bare/timers.json", "w").write("[]")
    page("bare", "No end was recorded", "damaged")
    os.mkdir(work + "/empty")
    check("result directory" in run("report", "empty", expect=2).stderr, "what is no result directory is refused")
    if shutil.which("ffmpeg"):
        r = run("report", "done", "--movie")
        check("movie." in r.stdout and "<video" in open(work + "/done/report.html").read(), "the film is made and shown")
    else:
        r = run("report", "done", "--movie", expect=4)
        check("ffmpeg" in r.stderr and "install" in r.stderr, "without ffmpeg the message says how to get it")
    if shutil.which("chromium"):
        wide = sideways("done")
        check(isinstance(wide, list) and max(wide) <= 0, f"no window of 390 or 1280 pixels scrolls sideways {wide}")
    else:
        print("skipped  the layout in a browser: no chromium")
    finish()


if __name__ == "__main__":
    main()
