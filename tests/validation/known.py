"""Gates that are missed, and why. They stay missed in the record; a test that knows them (KUZURE_KNOWN=1) fails only when
another one is missed, or when one of these is met after all and should leave this list. Keys: the case and what was measured."""

CHECKERBOARD = ("zero-energy mode: neighbours in a row move up and down in turn, without strain, and the compression in the soil makes the mode grow; "
                "viscosity only slows it. Cubic spline with h 1.2 and Wendland C2 with h 1.5 do not show it")
ACCELERATION = "the bend of the displacement curve comes earlier than the slide; at psi = 0 finite elements fall by 4 to 8 % over refinement too"
UNBOOKED = "the ledger has no entry for the work of the artificial stress, and that work is not small"

MISSES = {
    ("V-EXP-1", "spacing 2 mm: x where the deposit is 5 mm high, surface by highest bars"):
        "single bars on a toe two or three bars thick; by volume the toe is within the gate",
    ("V-EXP-1", "spacing 2 mm: failure line (moved more than 1 mm), RMS distance"):
        "the line is straighter than the measured one: too far left by the crest, too far right near the floor; the mean distance is below 1 mm",
    ("V-EXP-3", "plane, a = 2: gate on the run-out"):
        "model bias: a frictional continuum released at once runs farther than the experiments behind the gate; the mu(I) continuum of Lagree et al. has 4.4",
    ("V-EXP-4", "factor of safety, cone plane strain, H/dx 20"): ACCELERATION,
    ("V-EXP-4", "factor of safety, cone compression, H/dx 20"): ACCELERATION,
    ("V-EXP-4", "stable slope (SRF 1) at rest, cubic spline, h 1.3 (the default): displacement after 8 s"): CHECKERBOARD,
    ("V-EXP-4", "stable slope (SRF 1) at rest, cubic spline, h 1.5: displacement after 8 s"): CHECKERBOARD,
    ("V-EXP-5", "eps 0.5, spacing 40 mm: clumped soil (neighbour nearer than 0.6 spacings)"):
        "six of 5,000 particles, in the shear band; without artificial stress it is 218",
    ("V-EXP-5", "eps 0.5, spacing 40 mm: energy ledger, residual of the potential drop"): UNBOOKED,
    ("V-EXP-5", "eps 1.0 instead of 0.5: change of the crest drop"):
        "the artificial stress does work on the soil as it flows: eps is not a neutral parameter here. See the energy residual",
}
