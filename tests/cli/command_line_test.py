#!/usr/bin/python3
"""The command line as a door: words before MPI, the nearest command, option and key, one sentence for what is not there, ranks that agree,
progress where it belongs, and what check and a run say of a scene. Run as command_line_test.py PROGRAM."""
import json
import os
import pty
import re
import subprocess
import sys

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
from harness import block, check, finish, program, scratch

work = scratch("door")
os.environ["OMP_NUM_THREADS"] = "1"


def call(*args, expect=0, launcher=(), says=(), silent_of=(), **env):
    done = subprocess.run([*launcher, program, *args], capture_output=True, timeout=300, cwd=work, env={**os.environ, **env})
    done.stdout, done.stderr = done.stdout.decode(), done.stderr.decode()  # as they are: text=True would make line ends of a bar's returns
    wrong = [w for w in says if w not in done.stderr + done.stdout] + [f"not {w}" for w in silent_of if w in done.stderr + done.stdout]
    good = done.returncode == expect and not wrong and "defect" not in done.stderr
    check(
        good,
        f"{' '.join([*launcher, 'kuzure', *args])[:100]}: exit {done.returncode}, expected {expect}; missing {wrong}"
        + ("" if good else f": {done.stderr[-600:]}"),
    )
    return done


def write(name, text):
    with open(os.path.join(work, name), "w") as f:
        f.write(text)
    return name


SCENE = block(
    (0.32, 0, 0.32),
    ((-0.4, 0, -0.16), (0.72, 0, 0)),
    name="clay",
    end=0.01,
    soil="cohesion = 2000.0",
    effects="viscosity = { alpha = 0.1, beta = 0.0 }",
    output="every = 1.0",
)
two = ("mpirun", "-n", "2")
# An MPI that cannot start: no messages of this kind are there.
broken = {"OMPI_MCA_pml": "nosuch"}


def main():
    write("s.toml", SCENE)
    # ---- commands that compute nothing, and a run on one process, need no MPI
    control = subprocess.run(
        [*two, program, "run", "s.toml", "-o", "control"], capture_output=True, cwd=work, env={**os.environ, **broken}, timeout=300
    )
    check(control.returncode != 0, "the broken MPI does break a run on ranks")
    call("--help", says=["Usage: kuzure", "run", "check"], **broken)
    call("--version", says=["kuzure", "MPI", "HDF5"], **broken)
    call("check", "s.toml", **broken)
    call("job", "s.toml", "--machine", "slurm", "--nodes", "1", **broken)
    call("reference", **broken)
    call("scale", "s.toml", "--ranks", "2", **broken)
    call("run", "s.toml", "-o", "alone", "--quiet", **broken)
    call("report", "alone", **broken)
    call("run", "s.toml", "--dry-run", says=["a block", "particles"], launcher=two, **broken)
    once = call("check", "s.toml", launcher=two, **broken)
    check(once.stdout.count("  particles   ") == 1, "under mpirun one rank says what check says")
    call("check", "s.toml", "--set", "soil.clay.young=1e-4", says=["time        about"])  # soil so soft that its steps are longer than runs
    # ---- alone without MPI, alone with it and on two ranks: the same bits
    call("run", "s.toml", "-o", "one", "-q", KUZURE_MPI="1")
    call("run", "s.toml", "-o", "two", "-q", launcher=two)
    states = {json.load(open(f"{work}/{d}/summary.json"))["state_hash"] for d in ("alone", "one", "two")}
    check(len(states) == 1, f"without MPI, with it, and on two ranks: the same bits {states}")
    ranks = [json.load(open(f"{work}/{d}/summary.json"))["ranks"] for d in ("alone", "two")]
    check(ranks == [1, 2], f"ranks that took part: {ranks}")
    # ---- help and short options
    bare = call(expect=2, says=["expected a command", "Usage: kuzure", "First steps"])
    check("First steps" in bare.stdout, "bare kuzure shows the help")
    check(call("help", "run").stdout == call("run", "--help").stdout, "kuzure help run is kuzure run --help")
    check(call("-V").stdout == call("--version").stdout, "-V is --version")
    check(
        "bar shows" not in call("run", "s.toml", "-o", "short", "-q").stdout
        and call("run", "s.toml", "-o", "short", "-q", "--force").stdout == "",
        "-q is --quiet",
    )
    call("run", "-n", "s.toml", says=["K0"])
    check(not os.path.exists(work + "/results"), "-n runs nothing")
    # ---- the nearest command and option, and none where nothing is like it
    call("rnu", "s.toml", expect=2, says=['did you mean "run"?', "Commands: run, check"])
    call("frobnicate", expect=2, says=["expected a command", "Commands: run"], silent_of=["did you mean"])
    call("s.toml", expect=2, says=["kuzure run s.toml"])
    call("--threads", "2", expect=2, says=["kuzure run ... --threads"])
    call("run", "s.toml", "--treads", "2", expect=2, says=["--treads", "did you mean --threads?", "see kuzure run --help"])
    call("run", "--ouptut", "x", expect=2, says=["did you mean --output?"])
    call("run", "s.toml", "--nodes=4", expect=2, says=["kuzure job has it"])
    call("run", "s.toml", "--zzzz", expect=2, says=["--zzzz"], silent_of=["did you mean"])
    call("run", "s.toml", "--progress", "plian", expect=2, says=['did you mean "plain"?'])

    # ---- keys: near ones, far ones, and ideas that are not there
    def keys(addition, *words, **kw):
        write("k.toml", SCENE.replace("[effects]\n", "[effects]\n" + addition + "\n"))
        call("check", "k.toml", expect=2, says=[*words, "k.toml:"], **kw)

    keys("gravty = [0.0, 0.0, -9.81]", 'did you mean "gravity"?')
    keys("rain = 20.0", "Rain and infiltration are not simulated", "effects.pore_pressure", silent_of=["did you mean"])
    keys("vegetation = true", "Plants are not simulated", silent_of=["did you mean"])
    keys("earthquake = 0.2", "Shaking ground is an event: [[event]] shaking", silent_of=["did you mean"])
    keys("qwertz = 1", "Known here", silent_of=["did you mean"])
    keys("cfl = 1.0", 'did you mean "accuracy.cfl"?')
    # ---- --set: the word that is wrong, not the file
    for words, says in {
        "soil.caly.young=2e6": ['found none called "caly"', 'did you mean "clay"?', "The file has: clay"],
        "soil.quartz.young=2e6": ['found none called "quartz"', "The file has: clay"],
        "soil.caly={young=2e6}": ['did you mean "clay"?'],
        "spce.spacing=0.02": ['"spce"', 'did you mean "space"?'],
        "space.spacin=0.02": ['did you mean "spacing"?'],
        "spce=1": ['did you mean "space"?'],
    }.items():
        call("check", "s.toml", "--set", words, expect=2, says=["kuzure: --set " + words, *says], silent_of=["s.toml:"])
    whole = "soil.sand={density=1800.0,young=2e6,poisson=0.3,friction_angle=30.0}"
    call("check", "s.toml", "--set", whole, "--set", "body.0.soil=sand")  # a whole soil may come by --set

    # ---- ranks that were given different things: exit 2 on all, named, and no rank waits for another
    def mpmd(first, second, *says):
        done = subprocess.run(
            ["mpirun", "-n", "1", program, *first, ":", "-n", "1", program, *second], capture_output=True, text=True, timeout=300, cwd=work
        )
        wrong = [w for w in says if w not in done.stderr]
        check(
            done.returncode == 2 and not wrong,
            f"{first} beside {second}: exit {done.returncode}, missing {wrong} {done.stderr[:300] if wrong else ''}",
        )

    plain = ["run", "s.toml", "-o", "mpmd", "-q"]
    mpmd(plain, plain + ["--set", "time.end=0.005"], "rank 1 was given", "time.end=0.005")
    mpmd(plain + ["--set", "time.end=0.005"], plain, "rank 1 was given", "time.end=0.005")
    mpmd(plain, plain + ["--treads", "1"], "rank 1", "did you mean --threads?")
    mpmd(plain + ["--treads", "1"], plain, "did you mean --threads?")
    mpmd(plain, ["rnu", "s.toml"], "rank 1", 'did you mean "run"?')
    mpmd(plain, ["run", "other.toml", "-o", "mpmd", "-q"], "rank 1 was given", "other.toml")
    mpmd(plain, ["--help"], "rank 1 was given", "--help")
    mpmd(["check", "s.toml"], plain, "rank 1 was given")
    check(not os.path.exists(work + "/mpmd"), "ranks that disagree write nothing")
    done = subprocess.run(
        ["mpirun", "-n", "1", program, *plain, "--threads", "1", ":", "-n", "1", program, *plain, "--threads", "2"],
        capture_output=True,
        text=True,
        timeout=300,
        cwd=work,
    )
    check(done.returncode == 0, f"threads may differ: exit {done.returncode} {done.stderr[-300:]}")

    # ---- progress: a bar on one's own terminal, lines elsewhere
    def on_terminal(*args, launcher=()):
        """What a terminal gets."""
        parent, child = pty.openpty()
        process = subprocess.Popen(
            [*launcher, program, *args], stdout=child, stderr=child, stdin=subprocess.DEVNULL, cwd=work, env={**os.environ, "TERM": "xterm"}
        )
        os.close(child)
        out = b""
        while True:
            try:
                data = os.read(parent, 65536)
            except OSError:
                break
            if not data:
                break
            out += data
        process.wait(300)
        os.close(parent)
        return out.decode().replace("\r\n", "\n")

    shown = on_terminal("run", "s.toml", "-o", "t1")
    check("\r[" in shown and "####" in shown, "on a terminal progress is a bar")
    shown = on_terminal("run", "s.toml", "-o", "t2", "--progress=plain")
    check("\r" not in shown and re.search(r"^100 %  t 0\.0100", shown, re.M), "--progress=plain: lines on a terminal too")
    shown = on_terminal("run", "s.toml", "-o", "t3", launcher=two)
    check(
        "\r" not in shown and "\x1b" not in shown and re.search(r"^100 %  t 0\.0100", shown, re.M),
        "under mpirun on a terminal: plain lines",
    )
    shown = call("run", "s.toml", "-o", "t4", launcher=two, TERM="xterm").stdout
    check(
        "\r" not in shown and "\x1b" not in shown and re.search(r"^100 %  t 0\.0100", shown, re.M), "under mpirun into a file: plain lines"
    )
    shown = call("run", "s.toml", "-o", "t5", "--progress", "none").stdout
    check(" %  t " not in shown and "results in t5" in shown, "--progress none: no progress, the rest is said")
    shown = call("run", "s.toml", "-o", "t6", "--progress=bar").stdout
    check("\r[" in shown, "--progress=bar: a bar wherever")

    # ---- what check tells of a soil
    call("check", "s.toml", says=["unit weight 18.15 kN/m3", "K0 0.429", "c_p ", "c_s ", "c/(gamma H) 0.34"])
    soils = json.loads(call("check", "s.toml", "--json").stdout)["soils"]
    c_s = (1.8e6 / 2.6 / 1850) ** 0.5
    c_p = (1.8e6 * 0.7 / (1.3 * 0.4) / 1850) ** 0.5
    s = soils["clay"]
    check(
        abs(s["unit_weight"] - 1850 * 9.81) < 1e-6
        and abs(s["c_s"] / c_s - 1) < 1e-12
        and abs(s["c_p"] / c_p - 1) < 1e-12
        and abs(s["stability"] - 2000 / (1850 * 9.81 * 0.32)) < 1e-12,
        f"its numbers are right: {s}",
    )

    # ---- soil at an open edge, and how much of it has left the ground
    def warnings(*sets):
        return json.loads(call("check", "s.toml", "--json", *(w for x in sets for w in ("--set", x))).stdout)["warnings"]

    check(not any("open edge" in w for w in warnings()), "a floor that goes on draws no warning")
    narrow = "wall.0.box.high=[0.32,0.0,0.0]"
    found = [w for w in warnings(narrow) if "open edge" in w]
    check(
        len(found) == 1 and "body.0" in found[0] and "high x" in found[0] and "low x" not in found[0],
        f"a floor that ends at the soil does: {found}",
    )
    write("walled.toml", SCENE.replace("0.72, 0.0, 0.0]", "0.32, 0.0, 0.0]") + "")
    with open(work + "/walled.toml", "a") as f:
        f.write("[[wall]]\nbox = { low = [0.32, 0.0, -0.16], high = [0.48, 0.0, 0.4] }\n")
    held = json.loads(call("check", "walled.toml", "--json").stdout)["warnings"]
    check(not any("open edge" in w for w in held), "a wall that stands there holds it")
    call(
        "run",
        "s.toml",
        "-o",
        "off",
        "--set",
        narrow,
        "--set",
        "body.0.velocity=[6.0,0.0,0.0]",
        "--set",
        "soil.clay.friction_angle=5.0",
        "--set",
        "time.end=0.05",
        "--set",
        "output.history=0.01",
        "--set",
        "time.step=5e-5",
        says=["off the ground"],
    )
    share = json.load(open(work + "/off/summary.json"))["soil_off_ground"]
    check(0.2 < share <= 1, f"summary.json has the share that left: {share}")
    check("off the ground" in open(work + "/off/report.html").read(), "and the report")
    check(json.load(open(work + "/alone/summary.json"))["soil_off_ground"] == 0, "soil that stays has left nothing")
    # ---- more threads than cores
    many = str(4 * os.cpu_count())
    call(
        "run", "s.toml", "-o", "many", "-q", "--set", "time.end=0.001", "--threads", many, says=["warning", f"{many} threads", "--threads"]
    )
    call("run", "s.toml", "-o", "few", "-q", "--set", "time.end=0.001", "--threads", "1", silent_of=["threads"])
    call("run", "s.toml", "-o", "huge", "-q", OMP_NUM_THREADS="1000000", expect=2, says=["OMP_NUM_THREADS", "at most 4096"])
    check(not os.path.exists(work + "/huge"), "threads that no machine has are refused before anything is written")
    finish()


if __name__ == "__main__":
    main()
