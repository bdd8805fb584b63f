"""Every file operation of a short run fails once, and again with all after it failing too, with each error a system may give: the run ends
with exit 0 (it could do without) or 4 and names its last good checkpoint, and the next start ends with the bits of the undisturbed run."""
import errno
import json
import os
import re
import shutil
import subprocess

from faults import check, program, same_results, scene_text

LIBRARY = os.path.join(os.path.dirname(program), "tests", "libinject.so")
ERRORS = {
    "open": (errno.EACCES, errno.EMFILE, errno.EIO),
    "create": (errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EACCES, errno.EIO),
    "read": (errno.EIO, errno.ESTALE),
    "write": (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO),
    "sync": (errno.EIO, errno.ENOSPC, errno.EDQUOT),
    "rename": (errno.EIO, errno.ENOSPC, errno.EACCES),
    "truncate": (errno.EIO, errno.EFBIG),
    "allocate": (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EOPNOTSUPP),
    "mkdir": (errno.ENOSPC, errno.EDQUOT, errno.EACCES),
    "unlink": (errno.EIO, errno.EACCES),
}


class Campaign:
    def __init__(self, place):
        self.place = place
        # Without MPI's helper process a start takes a third of the time.
        self.environment = {**place.environment, "OMPI_MCA_ess_singleton_isolated": "1"}
        self.scene = place.write("scene.toml", scene_text(end=2e-4, every=2e-4, checkpoint=1e-6) + 'fields = ["velocity"]\n')
        self.record = {"injected": 0, "exit 0": 0, "exit 4": 0, "survived": 0}
        self.go("fresh")
        self.go("half", "--set", "time.end=1e-4")
        shutil.copytree(place("half"), place("restart"))
        self.go("restart", "--restart")
        same = place.summary("fresh")["state_hash"] == place.summary("restart")["state_hash"]
        check(same, "the undisturbed runs, straight and restarted, have the same bits")
        self.good = {"fresh": self.count("fresh"), "restart": self.count("restart")}

    def go(self, out, *more, **environment):
        return subprocess.run(
            self.place.command(self.scene, out, *more),
            capture_output=True,
            text=True,
            timeout=300,
            cwd=self.place.path,
            env={**self.environment, **environment},
        )

    def begin(self, out, how):
        for name in os.listdir(self.place.path):
            if name.startswith(out):
                shutil.rmtree(self.place(name), ignore_errors=True)
        if how == "restart":
            shutil.copytree(self.place("half"), self.place(out))

    def faulty(self, out, how, **environment):
        return self.go(out, "--restart", LD_PRELOAD=LIBRARY, KUZURE_FAULT_BELOW=self.place(out), **environment)

    def count(self, how):
        """How many operations of each kind an undisturbed run does in its directory."""
        self.begin("counted", how)
        done = self.faulty("counted", how, KUZURE_FAULT_COUNT=self.place("count.txt"))
        check(done.returncode == 0, f"{how}, nothing failing: exit {done.returncode} {done.stderr[-300:]}")
        with open(self.place("count.txt")) as f:
            counts = {kind: int(n) for kind, n in (line.split() for line in f)}
        same_results(self.place, "counted", how, f"{how}, nothing failing")
        print(how, counts, flush=True)
        return counts

    def one(self, how, kind, n, error, times):
        out = "out"
        what = f"{how}: {kind} {n} {errno.errorcode[error]}{' and all after it' if times == 0 else ''}"
        self.begin(out, how)
        done = self.faulty(out, how, KUZURE_FAULT=f"{kind}:{n}:{error}:{times}")
        code, said = done.returncode, done.stderr
        self.record["injected"] += 1
        good = True
        if code not in (0, 4):
            good = check(False, f"{what}: exit {code}, expected 0 or 4: {said[-400:]}")
        else:
            self.record[f"exit {code}"] += 1
        if code == 4:
            if "kuzure: " not in said or "defect" in said:
                good &= check(False, f"{what}: exit 4 without words: {said[-300:]}")
            # Once it had begun, it names what stands.
            named = re.search(r"The last good checkpoint is (\S+?)\.?$", said.strip(), re.M)
            if "predicted:" in done.stdout and not named and "No checkpoint" not in said:
                good &= check(False, f"{what}: the last good checkpoint is not named: {said[-300:]}")
            if named and not os.path.exists(named[1]):
                good &= check(False, f"{what}: {named[1]} is named as good and not there")
            again = self.go(out, "--restart")
            if again.returncode != 0:
                good &= check(False, f"{what}: the next start ends with {again.returncode}: {again.stderr[-300:]}")
        if good and code in (0, 4):
            a, b = self.place.summary(out) if os.path.exists(self.place(out, "summary.json")) else {}, self.place.summary(how)
            if a.get("state_hash") != b["state_hash"] or a.get("energy") != b["energy"] or a.get("pairs") != b["pairs"]:
                good = check(False, f"{what}: exit {code}, then other bits than the undisturbed run")
            else:
                quiet = open(self.place(out, "history.csv")).read() == open(self.place(how, "history.csv")).read()
                left = [f for f in os.listdir(self.place(out)) if f.startswith("kuzure.lock")] if code == 4 else []
                good = quiet and not left or check(False, f"{what}: history {quiet}, lock left {left}")
        self.record["survived"] += good
        return good

    def every(self, choose):
        """choose(k, kind) -> [(error, times)] for the k-th injection."""
        k = 0
        for how, counts in self.good.items():
            for kind, many in counts.items():
                for n in range(1, many + 1):
                    for error, times in choose(k, kind):
                        self.one(how, kind, n, error, times)
                    k += 1
                print(how, kind, json.dumps(self.record), flush=True)
        check(self.record["survived"] == self.record["injected"], json.dumps(self.record))
        return self.record
