"""Gates that are missed, and why. They stay missed in the record; a test that knows them (KUZURE_KNOWN=1) fails only when
another one is missed, or when one of these is met after all and should leave this list. Keys: the case and what was measured.
Cases written in C++ give their reasons themselves."""

CHECKERBOARD = (
    "zero-energy mode: neighbours in a row move up and down in turn, without plastic strain, and the motion grows exponentially; alpha = 0.5 slows it. "
    "It is of the kernel and not of the time step; accuracy.hourglass slows it thirtyfold, whose row stands below. Cubic spline with h 1.2 and Wendland C2 do not show it"
)

MISSES = {
    (
        "V-EXP-3",
        "axisymmetric: exponent of the run-out above the break",
    ): "two columns only (a = 2 and 5), and a frictional continuum, which has no collisions that dissipate, runs too far as a grows. The independent MPM, "
    "which throws spray at a = 5, has 0.905, 0.82 with the front at 0.05 L0 (0.75 here) and 0.71 at 0.1 L0 (0.81 here): too far apart to close this",
    ("V-EXP-4", "stable slope (SRF 1) at rest, cubic spline, h 1.3: displacement after 8 s"): CHECKERBOARD,
    (
        "V-EXP-4",
        "stable slope (SRF 1) at rest, cubic spline, h 1.3, hourglass 0.1: displacement after 8 s",
    ): "0.002 spacings, a thirty-eighth of that without, but not at rest at the end: what is viscous slows a growing motion and does not end it",
    ("V-EXP-4", "stable slope (SRF 1) at rest, cubic spline, h 1.5: displacement after 8 s"): CHECKERBOARD,
    (
        "V-EXP-5",
        "eps 1.0 instead of 0.5: change of the crest drop",
    ): "6 %; 50 % with the published form, which gave work to soil that is stretched",
}
