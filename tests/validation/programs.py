"""The cases written in C++, tests/validation/*_test.cpp and tests/stability/*_test.cpp, the long ones too: their programs beside kuzure, one
after another, with their records in $KUZURE_RESULTS, those of the hard cases in stability/ below it. A program that has passed and was
not built anew since is not run again."""
import glob
import hashlib
import os
import subprocess

from common import HERE, PROGRAM, RESULTS, RunFailed


def fingerprint(file):
    with open(file, "rb") as f:
        return hashlib.sha256(f.read()).hexdigest()


def run_all(folder, results):
    """Exit status: 1 if a program failed, that is, if a number is worse than what its test asserts."""
    failed, log = [], os.path.join(results, "programs")
    os.makedirs(log, exist_ok=True)
    for source in sorted(glob.glob(os.path.join(os.path.dirname(HERE), folder, "*_test.cpp")), key=lambda f: ("_long_" in f, f)):
        name = os.path.basename(source)[: -len(".cpp")]
        file, stamp = os.path.join(os.path.dirname(PROGRAM), "tests", name), os.path.join(log, name + ".key")
        if not os.path.exists(file):
            raise RunFailed(f"{folder}/{name}: no program {file}; build all")
        key = fingerprint(file)
        if os.path.exists(stamp):
            with open(stamp) as f:
                if f.read() == key:
                    continue
        print(f"  {folder}/{name}", flush=True)
        environment = dict(
            os.environ, KUZURE_RESULTS=results, OMP_NUM_THREADS="1", OMPI_ALLOW_RUN_AS_ROOT="1", OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="1"
        )
        with open(os.path.join(log, name + ".log"), "w") as out:
            status = subprocess.run([file], stdout=out, stderr=subprocess.STDOUT, env=environment).returncode
        if status == 0:
            with open(stamp, "w") as f:
                f.write(key)
        else:
            failed.append(name)
    print(f"{folder}: " + (f"failed: {', '.join(failed)}; see {log}" if failed else "all programs passed"), flush=True)
    return 1 if failed else 0


class ClosedForms:
    @staticmethod
    def main(quick=False, slow=False):
        return run_all("validation", RESULTS)


class HardCases:
    @staticmethod
    def main(quick=False, slow=False):
        return run_all("stability", os.path.join(RESULTS, "stability"))
