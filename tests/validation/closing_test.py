#!/usr/bin/python3
"""What closes a gate that is missed, and how the table counts it: another code's number within 5 % does, one farther away does not, and a gate
that is met needs none. Run as closing_test.py PROGRAM (which is not used)."""
import os
import sys
import tempfile

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
from harness import check, finish


def main():
    with tempfile.TemporaryDirectory(prefix="kuzure-closing-") as work:
        os.environ["KUZURE_RESULTS"] = work
        os.environ.pop("KUZURE_FIGURES", None)
        import table
        from common import Case

        case = Case("planted")
        case.record("met", 1.0, 1.0, passed=True, independent=(1.0, "a code"))
        case.record("near", 1.0, 2.0, passed=False, independent=(2.09, "a code"))
        case.record("far", 1.0, 2.0, passed=False, independent=(2.12, "a code"))
        case.record("alone", 1.0, 2.0, passed=False)
        case.record("old criterion: near", 1.0, 2.0, tolerance="old criterion: +-3 %")
        check(case.failed == ["far", "alone"] and case.surprises == ["far: missed", "alone: missed"], f"what failed: {case.failed}")
        check(case.done() == 1, "a case with a gate that is missed fails")
        page = table.render(os.path.join(work, "page.md"), table.rows())
        check(page.startswith("4 gates, 1 met, 1 closed, 2 missed; 5 rows."), page.splitlines()[0])
        check("| planted | near | 1, " in page and "a code: 2.09 |" in page, "whose number closes a gate is named")
        check(page.count("| closed |") == 1 and page.count("**missed**") == 2, "verdicts of single rows")
    finish()


if __name__ == "__main__":
    main()
