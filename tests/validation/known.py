"""Gates that are missed, and why. They stay missed in the record; a test that knows them (KUZURE_KNOWN=1) fails only when
another one is missed, or when one of these is met after all and should leave this list. Keys: the case and what was measured."""

CHECKERBOARD = (
    "zero-energy mode: neighbours in a row move up and down in turn, without plastic strain, and the motion grows exponentially; alpha = 0.5 slows it. "
    "Cubic spline with h 1.2 and Wendland C2 with h 1.5 do not show it"
)
EARLY = (
    "not separated yet: the curve bends upwards 2 to 4 % before the slope slides by 0.05 H, for all three cones alike, and the slide (see the note of the row) is "
    "where it was predicted"
)
THIN = (
    "partly measurement: the front is one spacing high, which is a tenth of the lowest column in plane strain and a fifth in the axisymmetric case, so low columns "
    "seem to stop short. With 40 spacings in plane strain it is 1.27; what remains is not explained"
)
BIAS = (
    "model bias, most likely: 40 spacings, another kernel and E x 4 move the run-out by 3 % at most, and the frictional continuum of Lagree et al. (mu(I)) runs as far, "
    "released at once, without side walls or collisions that dissipate. One front is good to about +-0.2 L0"
)

MISSES = {
    (
        "V-EXP-1",
        "spacing 2 mm: x where the deposit is 5 mm high, surface by highest bars",
    ): "single bars on a toe two or three bars thick; by volume the toe is within the gate",
    (
        "V-EXP-1",
        "spacing 2 mm: failure line (moved more than 1 mm), RMS distance",
    ): "the line is straighter than the measured one: too far left under the crest, too far right near the floor; the mean distance is below 1 mm",
    ("V-EXP-3", "plane, a = 2: gate on the run-out"): BIAS,
    ("V-EXP-3", "plane: exponent of the run-out below the break"): THIN,
    (
        "V-EXP-3",
        "plane: exponent of the run-out above the break",
    ): "model bias, as the reference warns: tall columns of a frictional continuum run too far (Kumar 2015)",
    ("V-EXP-3", "axisymmetric: exponent of the run-out below the break"): THIN,
    (
        "V-EXP-3",
        "axisymmetric: exponent of the run-out above the break",
    ): "two columns only (a = 2 and 5), both short of the experiments and the lower one more so; 10 spacings across the radius are too few to separate resolution from the model",
    ("V-EXP-4", "factor of safety, cone plane strain, H/dx 20"): EARLY,
    ("V-EXP-4", "factor of safety, cone compression, H/dx 20"): EARLY,
    ("V-EXP-4", "stable slope (SRF 1) at rest, cubic spline, h 1.3: displacement after 8 s"): CHECKERBOARD,
    ("V-EXP-4", "stable slope (SRF 1) at rest, cubic spline, h 1.5: displacement after 8 s"): CHECKERBOARD,
    (
        "V-EXP-5",
        "eps 0.5, spacing 40 mm: clumped soil (neighbour nearer than 0.6 spacings)",
    ): "six of 5,000 particles; without artificial stress 218",
    (
        "V-EXP-5",
        "eps 1.0 instead of 0.5: change of the crest drop",
    ): "the artificial stress does work on the soil as it flows: eps is not a neutral parameter here (that work is booked under viscous)",
}
