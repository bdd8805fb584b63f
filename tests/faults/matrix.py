"""The restart matrix: so many ranks before, so many after, the bits of a run that never stopped."""
import shutil

from faults import Place, check, same_results, scene_text


def matrix(pairs):
    """{"before x after": state_hash} and the hash of the undisturbed run."""
    hashes = {}
    with Place("matrix") as place:
        whole, half = place.write("whole.toml", scene_text(end=0.016)), place.write("half.toml", scene_text(end=0.01))
        place.run(whole, "calm")
        calm = place.summary("calm")["state_hash"]
        for before in sorted({b for b, _ in pairs}):
            place.run(half, f"half{before}", ranks=before)
            for after in [a for b, a in pairs if b == before]:
                out = f"{before}x{after}"
                shutil.copytree(place(f"half{before}"), place(out))
                # A re-partition at every other list rebuild, so that the restart meets them too.
                place.run(whole, out, "--restart", "--recut-every", "2", ranks=after)
                same_results(place, out, "calm", f"{before} ranks, restarted on {after}")
                hashes[f"{before} x {after}"] = place.summary(out)["state_hash"]
    check(set(hashes.values()) == {calm}, f"{len(hashes)} restarts, one hash: {calm}")
    return hashes, calm
