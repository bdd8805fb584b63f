#!/usr/bin/python3
"""What users or strangers wrote does not become a command, a file elsewhere, a cursor's jump, or hours of work: scenes, sweeps, studies,
names of files, and the batch scripts and figures made of them. Run as hostile_text_test.py PROGRAM."""
import os
import re
import subprocess
import sys
import time

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
from harness import block, check, finish, program, root, scratch

work = scratch("hostile")
os.environ.update(OMP_NUM_THREADS="1", KUZURE_MPI="0")


def call(*args, expect=0, says=(), cwd=work, command=None):
    done = subprocess.run([*(command or [program]), *args], capture_output=True, text=True, timeout=300, cwd=cwd)
    wrong = [w for w in says if w not in done.stderr]
    good = done.returncode == expect and not wrong and "defect" not in done.stderr
    check(
        good,
        f"{' '.join(args)[:80]!r}: exit {done.returncode}, expected {expect}; missing {wrong}"
        + ("" if good else f": {done.stderr[:400]!r}"),
    )
    return done


def write(name, text):
    with open(os.path.join(work, name), "w") as f:
        f.write(text)
    return name


def everything():
    """All files below the folder of this test and beside it."""
    return {os.path.join(d, f) for d, _, files in os.walk(work) for f in files}


SCENE = block((0.32, 0, 0.32), ((-0.4, 0, -0.16), (0.72, 0, 0)), end=0.002)


def main():
    write("s.toml", SCENE)
    # ---- sizes: a message instead of a crash or of minutes
    begin = time.monotonic()
    deep = ".".join("a" * 50000)
    for name, text in {
        "key": f"{deep} = 1\n",
        "table": f"[{deep}]\n",
        "inline": f"x = {{ {deep} = 1 }}\n",
        "array": f"[[{deep}]]\n",
        "quoted": '"a".' * 50000 + "b = 1\n",
        "spaced": "a . " * 50000 + "b = 1\n",
    }.items():
        write(f"deep_{name}.toml", SCENE + "\n" + text)
        call("check", f"deep_{name}.toml", expect=2, says=[f"deep_{name}.toml:22: expected keys of at most 64 parts"])
    call("check", "s.toml", "--set", f"{deep}=1"[:100000], expect=2, says=["at most 64 parts"])
    for name, text in {"arrays": "x = " + "[" * 50000 + "]" * 50000, "tables": "x = " + "{a=" * 50000 + "1" + "}" * 50000}.items():
        write(f"{name}.toml", SCENE + "\n" + text + "\n")
        call("check", f"{name}.toml", expect=2, says=[f"{name}.toml:22"])
    write(
        "dots.toml",
        SCENE.replace('"a block"', '"' + "x. " * 1000 + '" # ' + "." * 500).replace("# ", "# '\"") + "\n[output]\nprobes_are_not = 1\n",
    )
    call("check", "dots.toml", expect=2, says=["probes_are_not"])  # dots in strings and comments are no key
    write("title.toml", SCENE.replace("a block", "t" * 66000))
    call("check", "title.toml", expect=2, says=["title.toml:1: title", "66000 bytes"])
    write("long.toml", SCENE.replace("a block", "t" * 4096))
    call("run", "long.toml", "-o", "long", "-q")
    n = 64  # bodies a side: 4096 that all touch their neighbours
    bodies = "".join(
        f'[[body]]\nsoil = "sand"\nbox = {{ low = [{0.04 * i:.2f}, 0.0, {0.04 * k:.2f}], high = [{0.04 * (i + 1):.2f}, 0.0, {0.04 * (k + 1):.2f}] }}\n'
        for i in range(n)
        for k in range(n)
    )
    many = SCENE[: SCENE.index("[[body]]")] + bodies + SCENE[SCENE.index("[[wall]]") :].replace("0.72", "4.0")
    write("many.toml", many)
    call("check", "many.toml")
    took = time.monotonic() - begin
    print(f"      all of these in {took:.1f} s")
    # ---- control characters: not in titles, and in no message raw
    for name, c in {"escape": "\\u001b[2J", "break": "\\n", "bell": "\\u0007", "c1": "\\u009b2J", "delete": "\\u007f"}.items():
        write(f"{name}.toml", SCENE.replace("a block", "a" + c + "block"))
        call("check", f"{name}.toml", expect=2, says=[f"{name}.toml:1: title: expected a string"])
    write("lines.toml", SCENE.replace('"a block"', '"""a\nblock"""'))
    call("check", "lines.toml", expect=2, says=["a line break"])
    for text in ('"\\u001b[2J" = 1', '[soil."\\u001b[2J"]\ndensity = 1.0', 'x = "\\u001b[2J"'):
        write("raw.toml", SCENE + text + "\n")
        check("\x1b" not in call("check", "raw.toml", expect=2).stderr, f"no message moves the cursor: {text!r}")
    check("\x1b" not in call("check", "\x1b[2J.toml", expect=2).stderr, "nor the name of a file")
    # ---- scripts: names of scenes, directories, sets and accounts stay what they are
    evil = "x\ntouch out\n#SBATCH --mail-user=me\n'$(touch out)`touch out`\";touch out;"
    os.makedirs(work + "/" + "d" + evil.replace("/", ""))
    scene = "d" + evil + "/" + evil + ".toml"
    write(scene, SCENE)
    for machine in ("slurm", "fugaku", "oakforest-pacs", "here"):
        script = call(
            "job",
            scene,
            "--machine",
            machine,
            "--nodes",
            "1",
            "-o",
            "r" + evil,
            "--set",
            "title='a `touch out` $(touch out)'",
            *(["--account", "gz00"] if machine != "here" else []),
        ).stdout
        directives = [line for line in script.split("\n") if line.startswith(("#SBATCH", "#PJM"))]
        usual = call("job", "s.toml", "--machine", machine, "--nodes", "1", *(["--account", "gz00"] if machine != "here" else [])).stdout
        check(
            len(directives) == sum(line.startswith(("#SBATCH", "#PJM")) for line in usual.split("\n"))
            and all(re.fullmatch(r"#(SBATCH|PJM) [-A-Za-z0-9_.,:=+@%/ ]+", d) for d in directives),
            f"{machine}: no directive of the scene's name",
        )
        head = script[: script.index("set -u\n")].split("\n")
        check(all(line.startswith("#") or not line for line in head), f"{machine}: what is above the shell's first line is comments")
        check(subprocess.run(["bash", "-n"], input=script, text=True).returncode == 0, f"{machine}: the script is sound shell")
        # Run it with a program that says what it got, launched by nothing.
        write("say", '#!/bin/bash\nprintf "%s\\0" "$@" > "$SAID"\n')
        os.chmod(work + "/say", 0o755)
        line = next(x for x in script.split("\n") if '"$program" run' in x)
        words = line[line.index('"$program"') :]
        first = script[script.index("program=") :]
        first = (
            "program=./say\n"
            + first[first.index("\nscene=") + 1 : first.index("\nresults=") + 1]
            + "results="
            + first[first.index("\nresults=") + 9 :]
        )
        # scene= and results= are single-quoted words that may span lines: cut behind the second
        rest = first[first.index("results=") + 8 :]
        match = re.match(r"(?:'[^']*'|\\'|\$'(?:\\.|[^'\\])*')+", rest)
        tried = first[: first.index("results=")] + "results=" + match.group(0) + "\nleft=600\n" + words + "\n"
        done = subprocess.run(["bash", "-c", tried], cwd=work, env={**os.environ, "SAID": work + "/said"}, capture_output=True, text=True)
        got = open(work + "/said").read().split("\0") if os.path.exists(work + "/said") else []
        check(work + "/out" not in everything(), f"{machine}: nothing of the names was carried out {done.stderr[:200]}")
        check(
            got[:3] == ["run", os.path.join(work, scene), "-o"]
            and got[3] == work + "/r" + evil
            and "title='a `touch out` $(touch out)'" in got,
            f"{machine}: the program gets every word as it was written",
        )
        if os.path.exists(work + "/said"):
            os.remove(work + "/said")
    for account in ("a b", "a\n#SBATCH --x", "$(touch out)", "-x", "a'b"):
        call("job", "s.toml", "--machine", "slurm", "--nodes", "1", "--account=" + account, expect=2, says=["--account", "letters, digits"])
    for minutes in ("0.001", "1e9", "nan", "-5"):
        call("job", "s.toml", "--machine", "slurm", "--nodes", "1", "--minutes", minutes, expect=2, says=["--minutes"])

    # ---- jobs/scaling.py: names become directories and figures
    def scaling(name, case, expect, says):
        write("scaling.toml", f'title = "w"\nkind = "strong"\n{case}')
        done = subprocess.run(
            ["/usr/bin/python3", root + "/jobs/scaling.py", "scaling.toml", "--kuzure", program, "-o", "swept"],
            capture_output=True,
            text=True,
            cwd=work,
            timeout=300,
        )
        wrong = [w for w in says if w not in done.stderr]
        check(
            done.returncode == expect and not wrong and "Traceback" not in done.stderr,
            f"scaling.py, {name}: exit {done.returncode}, missing {wrong} {done.stderr[-300:]}",
        )
        check(not os.path.exists(work + "/out") and os.path.exists(work + "/s.toml"), f"scaling.py, {name}: nothing outside")

    case = '[[case]]\nscene = "s.toml"\n'
    for bad in ("../../x", "a`touch out`", "a\\nb", "$(touch out)", 'a\\"b', "", ".", "-x", "a b"):
        scaling(f"series {bad!r}", case + f'series = "{bad}"\n', 2, ["series", "letters, digits"])
    scaling("a list of sets that is none", 'set = "x"\n' + case, 2, ["set", "array of strings"])
    scaling("layouts of words", '[here]\nlayouts = [["1`touch out`", 1]]\n' + case, 2, ["layouts"])
    scaling("sets of two lines", 'set = ["a\\nb"]\n' + case, 2, ["set", "one line"])
    os.makedirs(work + "/victim")
    write("victim/keep", "mine")
    scaling("a name upwards", case + 'series = "../victim"\n', 2, ["series"])
    check(open(work + "/victim/keep").read() == "mine", "what lies elsewhere is left alone")
    # ---- kuzure study: titles and curves become figures, its directory is a user's
    STUDY = 'title = "{title}"\nscene = "s.toml"\nmeasures = ["run-out"]\n[base]\n"space.spacing" = 0.04\n[[point]]\nname = "{name}"\n"space.h" = 1.3\n'
    os.makedirs(work + "/mine")
    write("mine/sweep.toml", "my own")
    write("study.toml", STUDY.format(title="t", name="n"))
    call("study", "study.toml", "-o", "mine", expect=2, says=["expected a new directory or that of a study"])
    check(
        open(work + "/mine/sweep.toml").read() == "my own" and os.listdir(work + "/mine") == ["sweep.toml"],
        "a user's sweep.toml is left alone",
    )
    write("study.toml", STUDY.format(title="a\\nb", name="n"))
    call("study", "study.toml", "-o", "broken", expect=2, says=["title", "line break"])
    finish()


if __name__ == "__main__":
    main()
