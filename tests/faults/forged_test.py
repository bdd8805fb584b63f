#!/usr/bin/python3
"""Checkpoints that are made to harm, every checksum right: compared with the scene before anything uses them, refused by name and with
what is wrong, on one rank and on two. What a field may hold is told by the file's own list, so a field of tomorrow is tried too."""
import json
import os
import shutil

import h5py
import numpy as np

from faults import Place, check, finish, scene_text

MASK = np.uint64(0xFFFFFFFFFFFFFFFF)


def mix(h):
    for _ in range(2):
        h = (h ^ (h >> np.uint64(32))) * np.uint64(0xD6E8FEB86659FD93)
    return h ^ (h >> np.uint64(32))


def sum_of_rows(table):
    """The checksum of io/checkpoint.cpp over the rows of a table."""
    rows = table.reshape(len(table), -1)
    words = (
        rows.view(np.uint64)
        if rows.dtype.itemsize == 8
        else rows.astype(np.uint32 if rows.dtype.itemsize == 4 else np.uint8).astype(np.uint64)
    )
    with np.errstate(over="ignore"):
        h = (np.arange(len(rows), dtype=np.uint64) + np.uint64(1)) * np.uint64(0x9E3779B97F4A7C15)
        for c in range(rows.shape[1]):
            h = mix(h ^ words[:, c])
        return int(h.sum(dtype=np.uint64))


def sum_of_text(text):
    data = np.frombuffer(text, dtype=np.uint8)
    with np.errstate(over="ignore"):
        return int(mix(np.uint64(sum_of_rows(data)) ^ np.uint64(len(data))))


def forge(good, path, change):
    """A copy of a checkpoint whose tables, header and manifest went through change(tables, header, manifest), checksums made anew."""
    with h5py.File(good) as f:
        tables = {name: f["particles"][name][:] for name in f["particles"]}
        header, manifest = json.loads(bytes(f["header"][:])), json.loads(bytes(f["manifest"][:]))
    change(tables, header, manifest)
    text = json.dumps(header).encode()
    for field in manifest["fields"]:
        if field["name"] in tables:
            field["checksum"] = f"{sum_of_rows(np.ascontiguousarray(tables[field['name']])):016x}"
    manifest["header_checksum"] = f"{sum_of_text(text):016x}"
    with h5py.File(path, "w", libver=("v108", "latest")) as f:
        for name, rows in tables.items():
            f.create_dataset(f"particles/{name}", data=rows)
        f.create_dataset("header", data=np.frombuffer(text, dtype=np.uint8))
        words = json.dumps(manifest).encode()
        f.create_dataset("manifest", data=np.frombuffer(words, dtype=np.uint8))
        f["manifest"].attrs["checksum"] = np.bytes_(f"{sum_of_text(words):016x}")


def main():
    with Place("forged") as place:
        scene = place.write("scene.toml", scene_text(end=0.001))
        place.run(scene, "good")
        longer = ("--set", "time.end=0.002", "--set", "space.low=[-9,-9,-9]", "--set", "space.high=[9,9,9]")
        place.run(scene, "boxed", "--set", "space.low=[-9,-9,-9]", "--set", "space.high=[9,9,9]")
        good = place("boxed/checkpoint.h5")

        same = place("same.h5")
        forge(good, same, lambda t, h, m: None)
        place.run(scene, "same", f"--restart={same}", *longer)
        place.run(scene, "straight", *longer)
        check(
            place.summary("same")["state_hash"] == place.summary("straight")["state_hash"],
            "a checkpoint written by other means goes on: what is refused below is refused for what it says",
        )

        def put(name, row, value):
            def change(tables, header, manifest):
                tables[name] = tables[name].copy()
                tables[name][row] = value

            return change

        def without(rows):
            def change(tables, header, manifest):
                for name in tables:
                    tables[name] = tables[name][rows:]
                manifest["particles"] -= rows

            return change

        def without_field(name):
            def change(tables, header, manifest):
                del tables[name]
                manifest["fields"] = [f for f in manifest["fields"] if f["name"] != name]

            return change

        def clock(**values):
            return lambda tables, header, manifest: header.update(values)

        cases = [
            ("an id twice", put("id", 5, 7), "twice"),
            ("an id above all", put("id", 5, 10**9), "id 1000000000"),
            ("a negative id", put("id", 5, -1), "id -1"),
            ("a particle too few", without(1), "particles, the scene has"),
            ("a particle outside the box", put("position", 3, [50.0, 0, 0]), "outside the box"),
            ("no density", put("density", 3, 0.0), "density"),
            ("a time below 0", clock(time=-1.0), "clock"),
            ("a step below 0", clock(step=-5), "clock"),
            ("a time that is none", clock(time="noon"), "clock"),
        ]
        with h5py.File(good) as f:
            kinds = {name: f["particles"][name].dtype.kind for name in f["particles"]}
        for name, kind in kinds.items():
            if name not in ("id",):
                cases.append(
                    (f"{name} not a number", put(name, 11, np.nan), name)
                    if kind == "f"
                    else (f"{name} out of range", put(name, 11, 999), "particle")
                )
            if name not in ("id", "position"):
                cases.append((f"no field {name}", without_field(name), name))
        for k, (what, change, word) in enumerate(cases):
            bad = place("bad.h5")
            forge(good, bad, change)
            for ranks in (1, 2) if k < 4 else (1 + k % 2,):
                done = place.run(scene, "out", f"--restart={bad}", *longer, ranks=ranks, expect=4, timeout=300)
                check(
                    bad in done.stderr and word in done.stderr,
                    f"{what}: the file is named, and what is wrong: {done.stderr.strip()[-250:]}",
                )
                check(not os.path.exists(place("out")), f"{what}: nothing is written")

        # Events that have begun before their time: what has begun stays begun, and is not told again.
        event = "[[event]]\nat = 0.0016\n"
        events = f"\n{event}damping = 0.01\n{event}[event.soil.sand]\ncohesion = 900.0\n"
        staged = place.write("staged.toml", scene_text(end=0.001) + events)
        place.run(staged, "staged")
        for begun in (1, 2):
            bad = place("early.h5")
            forge(place("staged/checkpoint.h5"), bad, clock(events=begun))
            place.run(staged, f"early{begun}", f"--restart={bad}", "--set", "time.end=0.002")
            with open(place(f"early{begun}/events.csv")) as f:
                told = f.read().splitlines()[2:]
            check(len(told) == 2 - begun, f"{begun} of two events begun too early: the others are told, once: {told}")
        forge(place("staged/checkpoint.h5"), bad, clock(events=3))
        done = place.run(staged, "early3", f"--restart={bad}", "--set", "time.end=0.002", expect=4)
        check("events have begun" in done.stderr, f"more events than the scene has: {done.stderr.strip()[-200:]}")
        forge(place("staged/checkpoint.h5"), bad, clock(version=5))
        place.run(staged, "unnamed", f"--restart={bad}", "--set", "time.end=0.002")

        # Tables that lie elsewhere: external and soft links, raw data in another file.
        for what in ("external link", "soft link", "external link to a group", "raw data elsewhere"):
            bad = place("bad.h5")
            shutil.copy(good, bad)
            with h5py.File(bad, "r+") as f:
                if what == "external link to a group":
                    del f["particles"]
                    f["particles"] = h5py.ExternalLink(good, "/particles")
                elif what == "raw data elsewhere":
                    n = len(f["particles/density"])
                    f["particles/density"][:].tofile(place("raw.bin"))
                    del f["particles/density"]
                    f["particles"].create_dataset("density", (n,), "f8", external=[(place("raw.bin"), 0, n * 8)])
                else:
                    f["particles/twin"] = f["particles/density"]
                    del f["particles/density"]
                    f["particles/density"] = (
                        h5py.SoftLink("/particles/twin") if what == "soft link" else h5py.ExternalLink(good, "/particles/density")
                    )
            done = place.run(scene, "out", f"--restart={bad}", *longer, expect=4)
            check(
                bad in done.stderr and ("link" in done.stderr or "stored in a way" in done.stderr),
                f"{what}: refused: {done.stderr.strip()[-200:]}",
            )
    finish()


if __name__ == "__main__":
    main()
