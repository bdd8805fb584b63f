#!/usr/bin/python3
"""Which instructions of object files Knights Landing lacks: knl_instructions.py FILE.o...

Of AVX-512 it has F and CD (and ER and PF, which no other machine has and which are refused too), but not VL, BW, DQ or
anything later. Every EVEX and every mask instruction found by objdump is given back to the assembler with just F and
CD allowed: what it refuses, Knights Landing does not have. So there is no list of mnemonics to keep.
Prints up to five lines a file and exits 1 if there are any; 2 if the tools fail."""
import re
import subprocess
import sys
import tempfile
from pathlib import Path

# What Knights Landing shares with the AVX-512 machines that came after it.
ARCH = "generic64+sse4.2+avx2+fma+f16c+bmi+bmi2+lzcnt+popcnt+movbe+aes+pclmul+rdrnd+rdseed+adx+avx512f+avx512cd"


class ToolFailed(Exception):
    pass


def run(*command):
    try:
        done = subprocess.run(command, capture_output=True, text=True)
    except FileNotFoundError:
        raise ToolFailed(f"{command[0]} is missing: jobs/install.sh tests installs it")
    return done.returncode, done.stdout, done.stderr


def avx512_instructions(path):
    """{assembler text: (function, address) of its first use} of all EVEX and mask instructions of a file."""
    status, text, errors = run("objdump", "-d", "-w", str(path))
    if status != 0:
        raise ToolFailed(f"objdump cannot read {path}: {errors.strip()}")
    found, function = {}, "?"
    for line in text.splitlines():
        if label := re.match(r"[0-9a-f]+ <(.*)>:$", line):
            function = label[1]
        parts = line.split("\t")
        if len(parts) < 3:
            continue
        code, instruction = parts[1].split(), parts[2].split(" #")[0].split("<")[0].strip()
        while code and code[0] in ("64", "65", "67"):  # segment and address size come before EVEX
            code.pop(0)
        evex = bool(code) and code[0] == "62"  # in 64-bit code that byte begins nothing else
        mask = re.match(r"k[a-z]", instruction)
        if evex and not instruction.startswith("{evex}"):
            # Registers 0 to 15 at 128 and 256 bits have a VEX form, which the assembler would prefer.
            instruction = "{evex} " + instruction
        if evex or mask:
            found.setdefault(instruction, (function, parts[0].strip().rstrip(":")))
    return found


def refused(instructions):
    """Indices of those that the assembler does not take for ARCH."""
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder) / "all.s"
        source.write_text("".join(line + "\n" for line in instructions))
        status, _, errors = run("as", f"-march={ARCH}", "-o", str(Path(folder) / "all.o"), str(source))
    bad = sorted({int(m[1]) - 1 for m in re.finditer(r"all\.s:(\d+): Error:", errors)})
    if status != 0 and not bad:
        raise ToolFailed(f"as failed: {errors.strip()}")
    return bad


def violations(path):
    """[(function, address, instruction)] of one object file, and how many instructions were looked at."""
    found = avx512_instructions(path)
    instructions = list(found)
    return [(*found[instructions[k]], instructions[k]) for k in refused(instructions)], len(instructions)


def main(paths):
    total = seen = 0
    for path in paths:
        bad, looked_at = violations(path)
        seen += looked_at
        total += len(bad)
        for function, address, instruction in bad[:5]:
            print(f"{path}: {function[:100]} at {address}: {instruction}")
        if len(bad) > 5:
            print(f"{path}: and {len(bad) - 5} more")
    print(f"{len(paths)} files, {seen} different AVX-512 instructions, {total} that Knights Landing lacks")
    return 1 if total else 0


if __name__ == "__main__":
    try:
        sys.exit(main(sys.argv[1:]))
    except ToolFailed as e:
        print(f"knl_instructions.py: {e}", file=sys.stderr)
        sys.exit(2)
