#!/usr/bin/python3
"""kuzure hazard: the same bytes for any --jobs, order and number of kills, what a failing member costs, what is refused, what check says."""
import csv
import json
import math
import os
import shutil
import sys

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
import harness
from harness import check, finish, program, root, scratch
from runs import Runs

work = scratch("hazard")
HEAP = """title = "heap"
dimensions = 3
[space]
spacing = 0.1
{space}
[time]
end = 0.6
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
surface = {{ friction_angle = 20.0 }}
[effects]
gravity = [0.0, 0.0, -9.81]
viscosity = {{ alpha = 0.1 }}
{maps}
{uncertain}
"""
MAPS = '[maps]\nlimits = [0.15, 0.4]\npoints = "houses.csv"\n'
UNCERTAIN = """[uncertain]
seed = 4
friction = { low = 20.0, likely = 25.0, high = 33.0 }
bed_friction = { low = 5.0, likely = 20.0, high = 30.0 }
thickness = { low = 0.7, likely = 1.0, high = 1.4 }
"""
with open(os.path.join(work, "houses.csv"), "w") as f:
    f.write("name,x,y\nunder the heap,0.3,0.3\nnear,0.7,0.3\nfar,2.9,1.9\n")


runs = Runs(work)
call = runs.call


def scene(name, maps=MAPS, uncertain=UNCERTAIN, space=""):
    runs.scene(name, HEAP.format(maps=maps, uncertain=uncertain, space=space))
    return name + ".toml"


def digest(directory):
    """What does not tell times: maps and the table of points."""
    return harness.digest(os.path.join(work, directory), ("points.csv",))


def answer(directory):
    return runs.json(directory, "hazard.json")


def same(directory, what, want):
    got = digest(directory)
    check(got == want, f"{what}: the same bytes of every map {sorted(k for k in want | got if want.get(k) != got.get(k))}")


def main():
    # ---- an answer
    heap = scene("heap")
    # Where no deadline is tried, one that no machine comes near.
    SIX = ("--members", "6", "--layers", "4", "--within", "1h")
    done = call("hazard", heap, "-o", "two", "--jobs", "2", *SIX)
    want, two = digest("two"), answer("two")
    NAMES = ["p_reach", "p_h_0.15", "p_h_0.4", "p_p_3", "p_p_30", "arrival_10", "arrival_median", "arrival_90", "h_10", "h_median", "h_90"]
    check(
        {n + e for n in NAMES for e in (".tif", ".qml")} | {f"outline_p{p}.shp" for p in ("05", "50", "95")} <= set(want),
        "a file for each map",
    )
    check(not [n for n in want if n.endswith((".tmp", ".new"))], "nothing half written")
    check(two["members_finished"] == 6 and len(two["members"]) == 6 and two["counted"] == 6 and two["final"], "six members are counted")
    check(two["deadline_seconds"] == 3600 and 0 < two["ended_seconds"] < 3600, "it ends when all that was asked for is done")
    check(two["reach"]["low"] <= two["reach"]["likely"] <= two["reach"]["high"], f"an interval of the reach: {two['reach']}")
    check(any("water" in w for w in two["not_modelled"]) and any("finer" in w for w in two["not_done"]), "it says what is not in it")
    how = two["discretisation"]
    check(
        how["half_width"] == how["front"] > 0 and "one resolution" in how["how"] and "a layer of particles" in how["how"],
        f"of one resolution the interval is what a layer more or less moves the front by: {how}",
    )
    check(
        two["reach"]["low"] <= two["reach"]["likely"] - how["front"] and two["reach"]["high"] >= two["reach"]["likely"] + how["front"],
        "which the reach has on both sides",
    )
    reaches = [m["reach"] for m in two["members"]]
    check(len(set(reaches)) == 6 and min(reaches) > 0.4, f"members differ: {reaches}")
    slipperiest = min(two["members"], key=lambda m: m["settings"]["bed_friction"])
    roughest = max(two["members"], key=lambda m: m["settings"]["bed_friction"])
    check(slipperiest["reach"] > roughest["reach"], "the least friction reaches farther than the most")
    for m in two["members"]:
        s = m["settings"]
        check(
            20 <= s["friction"] <= 33 and 5 <= s["bed_friction"] <= 30 and 0.7 <= s["thickness"] <= 1.4,
            f"member {m['number']} lies within the ranges",
        )
    check({s["input"] for s in two["sensitivity"]} == {"friction", "bed_friction", "thickness"}, "every input has a sensitivity")
    with open(os.path.join(work, "two", "points.csv"), newline="") as f:
        rows = [r for r in csv.DictReader(f) if not r["name"].startswith("#")]
    points = {r["name"]: r for r in rows}
    check(float(points["under the heap"]["p_reach"]) == 1 and float(points["far"]["p_reach"]) == 0, f"named points: {rows}")
    check(
        0 < float(points["near"]["p_reach"] or 0) and float(points["near"]["arrival_10"]) <= float(points["near"]["arrival_90"]),
        f"arrival in order: {points}",
    )
    with open(os.path.join(work, "two", "report.html")) as f:
        page = f.read()
    check(
        'lang="ja"' in page and "到達" in page and "What decides" in page and "data:image/png" in page,
        "a page in English and Japanese with its map",
    )
    call("report", os.path.join("two", "members", "001"))
    check(os.path.exists(os.path.join(work, "two", "members", "001", "report.html")), "a member is a run that report reads")

    # ---- the same bytes
    call("hazard", heap, "-o", "one", "--jobs", "1", *SIX)
    same("one", "one member at a time", want)
    again = call("hazard", heap, "-o", "two", *SIX)
    check("there already" in again.stdout, "a finished answer is not run again")
    same("two", "the same command once more", want)
    call("hazard", heap, "-o", "listed", "--members-from", os.path.join("two", "hazard.json"))
    same("listed", "--members-from", want)
    listed = answer("listed")
    check(listed["reach"] == two["reach"] and listed["sensitivity"] == two["sensitivity"], "and the same numbers")
    shuffled = dict(two, members=two["members"][::-1])
    with open(os.path.join(work, "two", "shuffled.json"), "w") as f:
        json.dump(shuffled, f)
    call("hazard", heap, "-o", "listed-2", "--members-from", os.path.join("two", "shuffled.json"))
    same("listed-2", "members listed in another order", want)

    runs.kill(("hazard", heap, "-o", "killed", "--jobs", "2", *SIX), 12, 0.05, 0.7, seed=11)
    call("hazard", heap, "-o", "killed", "--jobs", "2", *SIX)
    same("killed", "killed at 12 moments and gone on", want)
    check(not [n for n in os.listdir(os.path.join(work, "killed", "members")) if "old" in n], "and nothing is left of what was begun")

    # ---- a stop ends it as the deadline does
    published = lambda there: os.path.exists(os.path.join(there, "hazard.json"))
    code, _, there = runs.stop(("hazard", heap, "--jobs", "1", *SIX), "stopped", published)
    check(code == 5, f"a stop signal: exit {code}")
    stopped = answer(there)
    # All may be done when it hears the signal, while it writes the answer.
    told = any("no time was left" in w for w in stopped["not_done"]) or stopped["members_finished"] == 6
    check(stopped["final"] and told, f"what was not done: {stopped['not_done']}")
    call("hazard", heap, "-o", there, *SIX)
    same(there, "stopped and gone on", want)
    # Twice what eight runs took here and more: some come to their end, 4000 do not.
    soon = math.ceil(max(12, 2 * two["ended_seconds"]))
    call("hazard", heap, "-o", "early", "--members", "4000", "--layers", "4", "--within", f"{soon}s")
    late = answer("early")
    check(
        late["members_finished"] < 4000 and any("no time was left" in w for w in late["not_done"]),
        f"a deadline ends it: {late['ended_seconds']} s",
    )
    check(any(m["status"] == "finished" for m in late["likely_runs"]), "with what is finished")

    # ---- two resolutions, and real ground with every way of varying it
    call("hazard", heap, "-o", "finer", "--members", "3", "--layers", "2,4", "--within", "1h")
    finer = answer("finer")
    check(
        finer["discretisation"]["half_width"] >= finer["discretisation"]["front"] > 0
        and "two resolutions" in finer["discretisation"]["how"],
        f"{finer['discretisation']}",
    )
    check(finer["reach"]["low"] < min(m["reach"] for m in finer["members"]), "the interval of resolution widens that of the members")
    differs = [os.path.exists(os.path.join(work, out, "maps", "h_resolution.tif")) for out in ("finer", "early")]
    check(
        differs == [True, False] and finer["discretisation"]["thickness"] > 0 and late["discretisation"]["thickness"] is None,
        f"a map of the thickness between two resolutions, and none of one: {differs}",
    )
    shutil.copytree(os.path.join(root, "jobs", "ground"), os.path.join(work, "ground"))
    with open(os.path.join(work, "ground", "slope.toml")) as f:
        slope = f.read().replace("end = 10.0", "end = 3.0")
    with open(os.path.join(work, "ground", "slope.toml"), "w") as f:
        f.write(
            slope
            + "[uncertain]\nbed_friction = { low = 18.0, likely = 24.0, high = 30.0 }\nthickness = { low = 0.7, likely = 1.0, high = 1.3 }\n"
        )
        f.write(
            'dem_error = { height = 0.5, length = 20.0 }\n[[uncertain.key]]\nkey = "soil.debris.cohesion"\nlow = 0.0\nlikely = 0.0\nhigh = 500.0\n'
        )
    call("hazard", "ground/slope.toml", "-o", "slope", "--members", "3", "--layers", "2", "--within", "1h")
    ground = answer("slope")
    check(ground["members_finished"] == 3 and "6670" in ground["crs"], f"members on real ground: {ground['members_failed']} failed")
    with open(os.path.join(work, "slope", "maps", "outline_p05.geojson")) as f:
        polygon = json.load(f)["features"][0]["geometry"]["coordinates"][0][0]
    check(all(129 < x < 133 and 31 < y < 35 for x, y in polygon), f"outlines in longitude and latitude: {polygon[:2]}")
    with open(os.path.join(work, "slope", "members", "001", "scene.toml")) as f:
        member = f.read()
    check(
        "members-001/dem.tif" in member.replace("inputs/", "") and "cohesion = 0.0" not in member,
        "its ground has errors of its own, and its soil a cohesion",
    )
    mean = sum(m["volume"] / m["settings"]["thickness"] for m in ground["members"]) / 3
    check(
        all(abs(m["volume"] / m["settings"]["thickness"] / mean - 1) < 0.05 for m in ground["members"]),
        "the volume goes with the thickness",
    )

    # ---- a member that fails is counted, and never fatal
    narrow = scene("narrow", space="low = [-1.5, -1.5, -0.5]\nhigh = [0.85, 1.9, 2.0]")
    call("hazard", narrow, "-o", "narrow", "--members", "6", "--layers", "4", "--within", "1h")
    some = answer("narrow")
    check(
        0 < some["members_failed"] < 6 and some["members_finished"] + some["members_failed"] == 6,
        f"{some['members_failed']} of 6 members fail",
    )
    check(
        any("failed" in w for w in some["not_done"]) and some["counted"] >= some["members_finished"], f"and it says so: {some['not_done']}"
    )
    failed = next(m for m in some["members"] if m["status"] == "numbers failed")
    check(failed["message"] and not failed["counted"], "with the reason")

    hopeless = scene("hopeless", space="low = [-1.5, -1.5, -0.5]\nhigh = [0.62, 1.9, 2.0]")
    done = call("hazard", hopeless, "-o", "hopeless", "--members", "3", "--layers", "4", "--within", "1h", expect=3)
    check("no run" in done.stderr and "left the box" in done.stdout, "where all fail there is no answer, and it says why")

    # ---- what is refused leaves nothing
    def refused(name, *words, args=("--within", "30s"), **how):
        path = scene(name, **how)
        done = call("hazard", path, "-o", name + "-out", *args, expect=2)
        check(all(w in done.stderr for w in words), f"{name}: {done.stderr.strip()[:300]}")
        check(not os.path.exists(os.path.join(work, name + "-out")), f"{name}: nothing is written")

    refused(
        "reversed",
        "reversed.toml:",
        "uncertain.friction",
        "low <= likely <= high",
        uncertain="[uncertain]\nfriction = { low = 30.0, likely = 25.0, high = 33.0 }\n",
    )
    refused("certain", "nothing varies", uncertain="[uncertain]\nthickness = { low = 1.0, likely = 1.0, high = 1.0 }\n")
    refused("unknown", "did you mean", uncertain="[uncertain]\nbed_fricton = { low = 5.0, likely = 6.0, high = 7.0 }\n")
    refused("incomplete", "likely", uncertain="[uncertain]\nfriction = { low = 5.0, high = 7.0 }\n")
    refused("beyond", "friction", uncertain="[uncertain]\nfriction = { low = 5.0, likely = 50.0, high = 95.0 }\n")
    refused("empty", "expected something that is uncertain", uncertain="[uncertain]\nseed = 4\n")
    refused("no-number", "title", uncertain='[[uncertain.key]]\nkey = "title"\nlow = 0.0\nlikely = 1.0\nhigh = 2.0\n')
    refused("no-soil", "soil.clay", uncertain='[[uncertain.key]]\nkey = "soil.clay.cohesion"\nlow = 0.0\nlikely = 1.0\nhigh = 2.0\n')
    refused("out-of-range", "poisson", uncertain='[[uncertain.key]]\nkey = "soil.sand.poisson"\nlow = 0.2\nlikely = 0.3\nhigh = 0.6\n')
    refused("no-ground", "uncertain.dem_error", uncertain="[uncertain]\ndem_error = { height = 1.0, length = 10.0 }\n")
    refused("no-maps", "[maps]", maps="")
    refused("members", "[uncertain]", uncertain="", args=("--within", "30s", "--members", "3"))
    for wrong in ("soon", "-5m", "0s", "1h30", "9999h"):
        refused("within", "--within", args=(f"--within={wrong}",))
    refused("layers", "--layers", args=("--within", "30s", "--layers", "6,4"))
    refused("no-deadline", "--within", args=())
    refused("both", "--members-from", args=("--within", "30s", "--members-from", "x.json"))
    refused("no-list", "x.json", args=("--members-from", "x.json"))
    call("run", scene("reversed"), "-o", "reversed-run", "--quiet")
    done = call("hazard", scene("other", uncertain=UNCERTAIN.replace("seed = 4", "seed = 5")), "-o", "two", *SIX, expect=2)
    check("other" in done.stderr and digest("two") == want, "another scene does not go on in the directory of this one")
    # What stands in the files of an earlier answer, by whose hand ever.
    for what, changes in (
        ("a group that no memory holds", {"group": 10**12}),
        ("a group in words", {"group": "many"}),
        ("no spacing", {"preliminary_spacing": 0}),
        ("layers in words", {"ensemble_layers": "six"}),
        ("layers without end", {"finer_layers": [1e300]}),
    ):
        os.makedirs(os.path.join(work, "damaged"))
        with open(os.path.join(work, "damaged", "plan.json"), "w") as f:
            json.dump({**runs.json("two", "plan.json"), **changes}, f)
        done = call("hazard", heap, "-o", "damaged", *SIX, expect=4)
        check("plan.json: damaged" in done.stderr, f"plan.json with {what}: {done.stderr.strip()[:200]}")
        check(os.listdir(os.path.join(work, "damaged")) == ["plan.json"], "and nothing is written")
        shutil.rmtree(os.path.join(work, "damaged"))
    deep = "[" * 300000
    for what, text in (
        ("runs elsewhere", json.dumps(two).replace("members/001", "../two/members/001")),
        ("a number in words", json.dumps({**two, "group": "many"})),
        ("a list that is none", json.dumps({**two, "members": 3})),
        ("brackets without end", deep),
    ):
        with open(os.path.join(work, "forged.json"), "w") as f:
            f.write(text)
        refused("forged", "forged.json: expected a hazard.json", args=("--members-from", "forged.json"))
    os.makedirs(os.path.join(work, "mine"))
    open(os.path.join(work, "mine", "letter.txt"), "w").close()
    call("hazard", heap, "-o", "mine", *SIX, expect=2)
    check(os.listdir(os.path.join(work, "mine")) == ["letter.txt"], "nor in one with other things")

    # ---- check
    text = call("check", heap).stdout
    check("members that kuzure hazard draws" in text and "bed_friction [deg]" in text, "check prints the members")
    drawn = json.loads(call("check", heap, "--json", "--set", "uncertain.members=6").stdout)["uncertain"]["members"]
    for values, m in zip(drawn, two["members"]):
        check(values == list(m["settings"].values()), f"member {m['number']} is the one that check printed")
    fits = json.loads(call("check", heap, "--within", "10h", "--json").stdout)
    check(
        fits["fits"] and fits["members"] >= 3 and fits["layers"] >= 4 and fits["predicted_seconds"] < 36000,
        f"what fits into ten hours, also on a slow machine: {fits}",
    )
    far = json.loads(call("check", heap, "--within", "30m", "--machine", "slurm", "--json").stdout)
    check(far["members"] >= 12 and far["layers"] >= fits["preliminary_layers"], f"and on another machine: {far}")
    check("--within" in call("check", heap, "--within", "soon", expect=2).stderr, "a time that is none")
    finish()


if __name__ == "__main__":
    main()
