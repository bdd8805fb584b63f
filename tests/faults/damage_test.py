#!/usr/bin/python3
"""Files cut short and bits flipped, in checkpoints, histories, snapshots and scenes: found and named, never followed."""
import os
import random
import shutil

from faults import Place, check, finish, same_results, scene_text

rng = random.Random(7)


def flip(path, bit):
    with open(path, "r+b") as f:
        f.seek(bit // 8)
        byte = f.read(1)[0]
        f.seek(bit // 8)
        f.write(bytes([byte ^ (1 << bit % 8)]))


def main():
    with Place("damage") as place:
        # A run stopped in the middle, with two generations of checkpoints.
        whole = place.write("whole.toml", scene_text())
        place.run(whole, "calm")
        half = place.write("half.toml", scene_text(end=0.01, checkpoint=1e-6))
        place.run(half, "half")
        size = os.path.getsize(place("half/checkpoint.h5"))
        count = 0

        def damaged(name, *harm):
            """A copy of the stopped run with `harm` done to files of it; resumed, it must end as if nothing had been."""
            nonlocal count
            out = f"case{count}"
            count += 1
            shutil.copytree(place("half"), place(out))
            for work in harm:
                work(place(out))
            done = place.run(whole, out, "--restart", ranks=rng.choice((1, 2)))
            same_results(place, out, "calm", name)
            shutil.rmtree(place(out))
            return done.stderr

        for share in (0.999, 0.5, 0.01, 0.0):
            said = damaged(f"checkpoint cut to {share}", lambda d: os.truncate(d + "/checkpoint.h5", int(share * size)))
            check(
                "checkpoint.h5" in said and "Going back to" in said,
                f"checkpoint cut to {share}: named, and what is taken instead: {said.strip()[-200:]}",
            )
        fell_back = 0
        for k in range(5):
            bit = rng.randrange(8 * size)
            said = damaged(f"bit {bit} of the checkpoint flipped", lambda d: flip(d + "/checkpoint.h5", bit))
            fell_back += "Going back to" in said
        check(fell_back >= 2, f"{fell_back} of 5 flipped bits were found, the others lay where nothing is stored")
        said = damaged("the checkpoint is missing", lambda d: os.remove(d + "/checkpoint.h5"))
        said = damaged("a stranger's half-written file", lambda d: open(d + "/checkpoint.h5.tmp", "w").write("half"))
        damaged("history.csv ends in half a row", lambda d: open(d + "/history.csv", "a").write("0.0105,10"))
        damaged("a half-written snapshot", lambda d: open(d + "/snapshots/state_000003.hdf.tmp", "w").write("half"))
        damaged("state.hdf.series is missing", lambda d: os.remove(d + "/snapshots/state.hdf.series"))
        damaged("scene.toml of the results is missing", lambda d: os.remove(d + "/scene.toml"))

        # Both generations damaged: refused by name, nothing is started from the beginning and nothing moved aside.
        shutil.copytree(place("half"), place("both"))
        for name in ("checkpoint.h5", "checkpoint.prev.h5"):
            os.truncate(place("both", name), size // 2)
        for ranks in (1, 2):
            done = place.run(whole, "both", "--restart", ranks=ranks, expect=4)
            check(
                "both/checkpoint.h5" in done.stderr and "both/checkpoint.prev.h5" in done.stderr, "two damaged checkpoints are both named"
            )
        check(not os.path.exists(place("both.old-1")), "with two damaged checkpoints nothing is moved aside")
        # Going on from the previous generation keeps it: the damaged newer one is set aside, not moved over it.
        shutil.copytree(place("half"), place("older"))
        flip(place("older", "checkpoint.h5"), 8 * (size // 2))
        good = open(place("older", "checkpoint.prev.h5"), "rb").read()
        place.run(whole, "older", "--restart", "--max-minutes", "1e-9", expect=5)
        check(open(place("older", "checkpoint.prev.h5"), "rb").read() == good, "the checkpoint gone on from is the previous generation")
        check(os.path.exists(place("older", "checkpoint.aside.h5")), "the damaged one is kept aside")
        # A whole checkpoint that had not got its name when the machine went down gets it.
        shutil.copytree(place("half"), place("unnamed"))
        os.rename(place("unnamed", "checkpoint.h5"), place("unnamed", "checkpoint.h5.tmp"))
        newest = open(place("unnamed", "checkpoint.h5.tmp"), "rb").read()
        place.run(whole, "unnamed", "--restart", "--max-minutes", "1e-9", expect=5)
        check(open(place("unnamed", "checkpoint.prev.h5"), "rb").read() == newest, "an unnamed checkpoint becomes a generation")

        # A file that is none, and one of another scene.
        done = place.run(whole, "x", f"--restart={whole}", expect=4)
        check("whole.toml" in done.stderr, "a checkpoint that is a scene is named")
        done = place.run(whole, "x", f"--restart={place('none.h5')}", expect=4)
        check("none.h5" in done.stderr, "a checkpoint that is not there is named")
        other = place.write("other.toml", scene_text().replace("1.8e6", "1.9e6"))
        done = place.run(other, "half", "--restart", expect=2)
        check("another scene" in done.stderr, "a checkpoint of another scene is refused")
        check(not os.path.exists(place("x")), "a refused restart writes nothing")

        # Scenes: cut short or with a flipped bit they are another scene or refused, never anything else.
        text = open(place.write("short.toml", scene_text(end=1e-4))).read().encode()
        refused = 0
        for k in range(16):
            if k < 5:
                wrong = text[: rng.randrange(len(text))]
            else:
                wrong = bytearray(text)
                wrong[rng.randrange(len(text))] ^= 1 << rng.randrange(8)
            with open(place("wrong.toml"), "wb") as f:
                f.write(wrong)
            done = place.run(
                place("wrong.toml"), "wrong", "--set", "time.end=1e-4", "--max-minutes", "0.02", expect=(0, 2, 3, 5), timeout=300
            )
            refused += done.returncode == 2
            check(done.returncode != 2 or "wrong.toml" in done.stderr, "a refusal names the file")
            check(done.returncode != 2 or not os.path.exists(place("wrong")), "a refused scene leaves nothing")
            shutil.rmtree(place("wrong"), ignore_errors=True)
        check(refused >= 5, f"{refused} of 16 damaged scenes were refused, the others were other scenes")
    finish()


if __name__ == "__main__":
    main()
