#!/usr/bin/python3
"""kuzure report on results that were damaged, or made to do harm: it ends soon, within its memory, with a page or a message that names the
file. Every file of a result directory in turn, each kind of damage. Run as report_damage_test.py PROGRAM."""
import json
import os
import random
import resource
import shutil
import subprocess
import sys
import time

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
from harness import block, check, failures, finish, program, scratch

work = scratch("damage")
os.environ.update(OMP_NUM_THREADS="1", XDG_CACHE_HOME=work + "/cache")


SCENE = block(
    (0.32, 0, 0.32), ((-0.4, 0, -0.16), (0.72, 0, 0)), output='every = 0.002\nhistory = 0.0005\npicture = { view = "cut", color = "speed" }'
)
limit = 3 << 30  # bytes of address space


def bounded():
    if "ASAN_OPTIONS" not in os.environ:  # which reserves terabytes of it
        resource.setrlimit(resource.RLIMIT_AS, (limit, limit))


def report(what, name=None, expect=(0,)):
    begin = time.monotonic()
    try:
        done = subprocess.run([program, "report", "r"], cwd=work, capture_output=True, text=True, timeout=300, preexec_fn=bounded)
    except subprocess.TimeoutExpired:
        check(False, f"{what}: does not end")
        return
    page = open(work + "/r/report.html", encoding="utf-8").read() if done.returncode == 0 else ""
    words = done.stderr + page
    named = name is None or os.path.basename(name) in words
    sound = (
        "[json.exception" not in words and "defect" not in words and "std::" not in words and ">nan" not in page and len(page) < 20 << 20
    )
    if done.returncode in expect and named and sound:
        return
    check(False, f"{what}: exit {done.returncode}, named {named}, sound {sound}, {time.monotonic() - begin:.1f} s: {done.stderr[-200:]!r}")


def main():
    with open(work + "/s.toml", "w") as f:
        f.write(SCENE)
    made = subprocess.run([program, "run", "s.toml", "-o", "whole", "-q"], cwd=work, capture_output=True, text=True)
    check(made.returncode == 0, "a run to damage " + made.stderr)
    files = ["summary.json", "timers.json", "history.csv", "progress.csv", "scene.toml", "snapshots/state.hdf.series", "picture_000000.png"]

    def anew():
        shutil.rmtree(work + "/r", ignore_errors=True)
        shutil.copytree(work + "/whole", work + "/r")

    def put(name, data):
        anew()
        os.remove(f"{work}/r/{name}")
        with open(f"{work}/r/{name}", "wb") as f:
            f.write(data if isinstance(data, bytes) else data.encode())

    anew()
    report("whole")
    count = 0
    # ---- what any file may be: nothing, a directory, a pipe, a device, noise, cut anywhere
    noise = random.Random(1)
    for name in files:
        path = f"{work}/r/{name}"
        whole = open(f"{work}/whole/{name}", "rb").read()
        anew()
        os.remove(path)
        os.mkdir(path)
        report(f"{name} is a directory", None)
        count += 1
        anew()
        os.remove(path)
        os.mkfifo(path)
        report(f"{name} is a pipe", None)
        count += 1
        anew()
        os.remove(path)
        os.symlink("/dev/zero", path)
        report(f"{name} is /dev/zero", None)
        count += 1
        anew()
        os.chmod(path, 0)
        report(f"{name} may not be read", None)
        count += 1
        anew()
        os.remove(path)
        report(f"{name} is missing")
        count += 1
        for data in [b"", b"\0" * 1000, b"\xff\xfe" * 500, bytes(noise.randrange(256) for _ in range(5000)), whole + whole, whole[::-1]]:
            put(name, data)
            report(f"{name} of {data[:12]!r}")
            count += 1
        for part in range(1, 5):
            put(name, whole[: len(whole) * part // 5])
            report(f"{name} cut at {part}/5")
            count += 1
        for k in range(4):
            bent = bytearray(whole)
            for _ in range(20):
                bent[noise.randrange(len(bent))] = noise.randrange(256)
            put(name, bytes(bent))
            report(f"{name} bent, {k}")
            count += 1
        anew()
        with open(path, "wb") as f:
            f.truncate(4 << 30)
        report(f"{name} of 4 GiB", name if name.endswith((".json", ".csv", ".toml", ".png")) else None)
        count += 1
    # ---- JSON: every key of every file with a value of every other kind
    odd = [None, True, -1, 0, 1e308, -1e308, 5e-324, 10**30, "x", "\x1b[2J", "", [], {}, [[1]], {"a": 1}, [None] * 5, "9" * 5000]

    def places(j, path=()):
        if isinstance(j, dict):
            for key, value in j.items():
                yield path + (key,)
                yield from places(value, path + (key,))
        elif isinstance(j, list) and j:
            yield path + (0,)
            yield from places(j[0], path + (0,))

    for name in ("summary.json", "timers.json"):
        whole = open(f"{work}/whole/{name}").read()
        j = json.loads(whole)
        if name == "summary.json":
            j["error_bars"] = {"grain": 0.1, "run-out": {"value": 1.0, "half_width": 0.1, "unit": "m", "no_interval": "x"}}
            j["retries"] = [{"from_time": 0.1, "message": "m"}]
        else:
            j["machine"] = {"host": "h", "cpu": "c", "gflops_double_all": 10.0, "gbytes_all": 10.0}
        whole = json.dumps(j)
        all_places = list(places(j))
        for k, place in enumerate(all_places):
            for value in noise.sample(odd, 1) if len(all_places) > 60 else noise.sample(odd, 2):
                bent = json.loads(whole)
                here = bent
                for key in place[:-1]:
                    here = here[key]
                here[place[-1]] = value
                put(name, json.dumps(bent))
                report(f"{name}: {'.'.join(map(str, place))} = {value!r:.30}")
                count += 1
        put(name, "[" * 200000 + "]" * 200000)
        report(f"{name}: 200000 deep", name)
        count += 1
        put(name, '{"a":' * 200000 + "1" + "}" * 200000)
        report(f"{name}: tables 200000 deep", name)
        count += 1
        put(name, '{"warnings": [' + '"w",' * 2000000 + '"w"]}')
        report(f"{name}: two million warnings")
        count += 1
    # ---- tables: numbers that no axis holds, columns and rows without end
    head = open(work + "/whole/history.csv").read().split("\n")
    columns = head[0].count(",") + 1
    for a, b in [
        ("1e16", "10000000000000002"),
        ("0", "5e-324"),
        ("-1e308", "1e308"),
        ("1e100", "1e101"),
        ("0", "inf"),
        ("nan", "1"),
        ("1", "1"),
        ("2", "1"),
    ]:
        put("history.csv", "\n".join(head[:2] + [",".join([x] * columns) for x in (a, b)]) + "\n")
        report(f"history.csv from {a} to {b}")
        count += 1
        put(
            "progress.csv",
            "\n".join(open(work + "/whole/progress.csv").read().split("\n")[:1] + [",".join([x] * 6) for x in ("#", a, b)]) + "\n",
        )
        report(f"progress.csv from {a} to {b}")
        count += 1
    put("history.csv", "," * 30000000)
    report("history.csv of 30 million columns", "history.csv")
    count += 1
    put("history.csv", ",".join(f"a{k}" for k in range(1000)) + "\n#\n" + "\n" * 20000000)
    report("history.csv of 20 million empty rows")
    count += 1
    check(len(failures) == 0, f"{count} damaged directories")
    finish()


if __name__ == "__main__":
    main()
