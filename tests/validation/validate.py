#!/usr/bin/python3
"""The whole validation suite: validate.py [--quick | --slow] [--known] [--publish] [PROGRAM] [CASE...]

--quick    coarse runs, under three minutes: for every day
--slow     also the expensive ends: V-EXP-1 at 1 mm, V-EXP-3 at a = 20
--known    a gate that known.py lists, with its reason, may be missed: what tests ask for. One that is met must leave the list
--publish  also the cases written in C++ ("closed forms", "hard cases"), and write the measured part of docs/verification.md and
           docs/figures instead of a page among the results
Exit status 1 if a gate is missed or a negative control passes, or a run fails; every case runs all the same.
"""
import os
import sys
import time


def main(arguments):
    flags = {a for a in arguments if a.startswith("--")}
    rest = [a for a in arguments if not a.startswith("--")]
    if unknown := flags - {"--quick", "--slow", "--known", "--publish"}:
        print(f"validate: unknown {' '.join(sorted(unknown))}\n{__doc__}")
        return 2
    if rest and os.access(rest[0], os.X_OK) and os.path.isfile(rest[0]):
        os.environ["KUZURE"] = os.path.abspath(rest.pop(0))
    here = os.path.dirname(os.path.abspath(__file__))
    docs = os.path.join(os.path.dirname(os.path.dirname(here)), "docs")
    if "--publish" in flags:
        os.environ["KUZURE_FIGURES"] = os.path.join(docs, "figures")

    if "--known" in flags:
        os.environ["KUZURE_KNOWN"] = "1"

    # only now: the environment above is read when common is imported
    import ablation
    import aluminium_bars
    import cohesive_block
    import collapsing_columns
    import programs
    import slope_safety
    import table
    from common import PROGRAM, RESULTS, RunFailed

    cases = {
        "V-EXP-1": aluminium_bars,
        "V-EXP-3": collapsing_columns,
        "V-EXP-4": slope_safety,
        "V-EXP-5": cohesive_block,
        "ablation": ablation,
        "closed forms": programs.ClosedForms,
        "hard cases": programs.HardCases,
    }
    if unknown := set(rest) - set(cases):
        print(f"validate: unknown case {' '.join(sorted(unknown))}; known: {' '.join(cases)}")
        return 2
    if not os.access(PROGRAM, os.X_OK):
        print(f"validate: no program at {PROGRAM}. Build it (cmake --build --preset release) or name it: validate.py PROGRAM")
        return 2
    failures, begin = [], time.time()
    for name, case in cases.items():
        of_a_program = name in ("closed forms", "hard cases")  # ctest runs these by themselves
        if name not in rest if rest else of_a_program and "--publish" not in flags:
            continue
        try:
            if case.main("--quick" in flags, "--slow" in flags) != 0:
                failures.append(f"{name}: see {RESULTS}")
        except RunFailed as failure:
            failures.append(str(failure))
            print(failure)
    table.main(os.path.join(docs, "verification.md") if "--publish" in flags else os.path.join(RESULTS, "verification.md"))
    print(
        f"{time.time() - begin:.0f} s; "
        + (
            ("all gates met" if "--known" not in flags else "nothing new")
            if not failures
            else f"{len(failures)} cases failed:\n  " + "\n  ".join(failures)
        )
    )
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
