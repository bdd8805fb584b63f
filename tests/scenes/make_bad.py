#!/usr/bin/python3
"""Writes tests/scenes/bad/*.toml: a good scene broken once a file, with the message expected as a regular expression in
the first line. The files are kept in the repository; run this after adding a case."""
import pathlib

GOOD = """title = "a good scene"
dimensions = 3
[space]
spacing = 0.1
h = 1.2
[time]
end = 1.0
[soil.sand]
density = 1850.0
young = 1.8e6
poisson = 0.3
friction_angle = 25.0
[[body]]
soil = "sand"
box = { low = [0.0, 0.0, 0.0], high = [1.0, 1.0, 1.0] }
[[wall]]
box = { low = [-1.0, -1.0, -0.4], high = [2.0, 2.0, 0.0] }
[effects]
gravity = [0.0, 0.0, -9.81]
[accuracy]
[output]
"""
BOX = "box = { low = [0.0, 0.0, 0.0], high = [1.0, 1.0, 1.0] }"
FLAT = ("dimensions = 3", "dimensions = 2")
CASES = {
    # spelling and structure
    "unknown_top": ([("dimensions = 3", "dimensions = 3\ncolour = 1")], r':4: colour: expected a known key, found "colour"; did you mean'),
    "misspelt_spacing": ([("spacing = 0.1", "spacing = 0.1\nspaceing = 0.1")], r':6: space\.spaceing: .*did you mean "spacing"'),
    "misspelt_table": ([("[effects]", "[efects]")], r':19: efects: .*did you mean "effects"'),
    "misspelt_nested": ([("[accuracy]", "viscosity = { alfa = 0.1, alpha = 0.1 }\n[accuracy]")], r':21: effects\.viscosity\.alfa: .*"alpha"'),
    "wrong_section": ([("end = 1.0", "end = 1.0\ncfl = 0.2")], r':9: time\.cfl: .*did you mean "accuracy\.cfl"'),
    "softening_without_slip": ([("poisson = 0.3", "poisson = 0.3\nsoftening = { friction_angle = 20.0 }")], r'soil\.sand\.softening\.slip: expected a number in m, x > 0, found nothing'),
    "softening_misspelt": ([("poisson = 0.3", "poisson = 0.3\nsoftening = { rate = 1.0, slip = 0.1 }")], r'soil\.sand\.softening\.rate: expected a known key'),
    "softening_that_hardens": ([("poisson = 0.3", "poisson = 0.3\nsoftening = { friction_angle = 35.0, slip = 0.1 }")], r'soil\.sand\.softening: expected a residual strength of at most the first'),
    "softening_adds_cohesion": ([("poisson = 0.3", "poisson = 0.3\nsoftening = { cohesion = 10.0, slip = 0.1 }")], r'soil\.sand\.softening: expected a residual strength of at most the first'),
    "rate_friction_falls": ([("poisson = 0.3", "poisson = 0.3\nrate_friction = { friction_angle = 20.0, grain = 0.001 }")], r'rate_friction\.friction_angle: expected at least the friction angle at rest'),
    "rate_friction_without_grain": ([("poisson = 0.3", "poisson = 0.3\nrate_friction = { friction_angle = 35.0 }")], r'rate_friction\.grain: expected a number in m'),
    "rate_friction_of_clay": ([("friction_angle = 25.0", "cohesion = 1e3\nrate_friction = { friction_angle = 35.0, grain = 0.001 }")], r'rate_friction: expected a soil with a friction_angle above 0'),
    "dilation_decay_zero": ([("poisson = 0.3", "poisson = 0.3\ndilation_decay = 0")], r'dilation_decay: expected a number, x > 0, found 0'),
    "pore_pressure_sideways": ([("[accuracy]", "pore_pressure = { table = [[0.0, 1.0]] }\n[accuracy]"), ("[0.0, 0.0, -9.81]", "[1.0, 0.0, -9.81]")], r'effects\.pore_pressure: expected gravity along -z'),
    "pore_pressure_dry": ([("[accuracy]", "pore_pressure = { table = [] }\n[accuracy]")], r'effects\.pore_pressure\.table: expected at least one corner'),
    "pore_pressure_backwards": ([("[accuracy]", "pore_pressure = { table = [[1.0, 1.0], [0.0, 1.0]] }\n[accuracy]")], r'effects\.pore_pressure\.table: expected corners with increasing x'),
    "diffusion_too_strong": ([("[accuracy]", "stress_diffusion = { zeta = 10 }\n[accuracy]")], r'effects\.stress_diffusion\.zeta: expected a number, 0 <= x <= 1, found 10'),
    "diffusion_switch": ([("[accuracy]", "stress_diffusion = true\n[accuracy]")], r'effects\.stress_diffusion: expected "auto" or a table, found true'),
    "not_offered_walls": ([("[accuracy]", "[accuracy]\nwalls = \"extrapolated\"")], r'accuracy\.walls: expected a known key'),
    "not_offered_correction": ([("[accuracy]", "[accuracy]\ncorrection = \"kernel\"")], r'accuracy\.correction: expected one of "none", "gradient", found "kernel"'),
    "quoted_path": ([("dimensions = 3", "dimensions = 3\n\"space.h\" = 1.2")], r'expected a known key, found "space\.h"'),
    "not_toml": ([("end = 1.0", "end = = 1.0")], r':8: expected TOML, found an error'),
    "twice": ([("end = 1.0", "end = 1.0\nend = 2.0")], r':9: expected TOML, found an error.*'),
    "soil_is_no_table": ([("[soil.sand]", "[soil]\nclay = 3\n[soil.sand]")], r'soil\.clay: expected a soil.s table, found 3'),
    "soil_name": ([("[soil.sand]", "[soil.\"wet sand\"]")], r'soil\.wet sand: expected a name of letters'),
    "body_is_a_table": ([("[[body]]", "[body]")], r':14: body: expected tables \[\[body\]\], found a table'),
    # what is needed
    "no_title": ([("title = \"a good scene\"", "")], r':1: title: expected a string, found nothing; write, for example, title ='),
    "no_dimensions": ([("dimensions = 3", "")], r'dimensions: expected an integer, 2 <= x <= 3, found nothing'),
    "no_spacing": ([("spacing = 0.1", "")], r':4: space\.spacing: expected a number in m.*found nothing; write, for example, spacing = 0\.04'),
    "no_space": ([("[space]\nspacing = 0.1\nh = 1.2", "")], r'space: expected a table, found nothing'),
    "no_end": ([("end = 1.0", "")], r':7: time\.end: expected a number in s, x > 0, found nothing'),
    "no_soil": ([(GOOD[GOOD.index("[soil"):GOOD.index("[[body")], "")], r'soil: expected tables \[soil\.<name>\], found nothing'),
    "no_body": ([(GOOD[GOOD.index("[[body"):GOOD.index("[[wall")], "")], r'body: expected tables \[\[body\]\], found nothing'),
    "no_density": ([("density = 1850.0", "")], r':9: soil\.sand\.density: expected a number in kg/m\^3'),
    "no_young": ([("young = 1.8e6", "")], r'soil\.sand\.young: expected a number in Pa'),
    "no_poisson": ([("poisson = 0.3", "")], r'soil\.sand\.poisson: expected a number'),
    "no_body_soil": ([("soil = \"sand\"", "")], r':14: body\.0\.soil: expected a string, found nothing'),
    "no_shape": ([(BOX, "")], r':14: body\.0: expected exactly one of box, cylinder, sphere, polygon, found none'),
    "two_shapes": ([(BOX, BOX + "\nsphere = { center = [0.0, 0.0, 0.0], radius = 1.0 }")], r'body\.0: expected exactly one of .* found box and sphere'),
    "no_radius": ([(BOX, "sphere = { center = [0.0, 0.0, 2.0] }")], r'body\.0\.sphere\.radius: expected a number in m'),
    # types
    "title_is_a_number": ([("title = \"a good scene\"", "title = 5")], r'title: expected a string, found 5'),
    "dimensions_is_a_float": ([("dimensions = 3", "dimensions = 3.0")], r'dimensions: expected an integer'),
    "dimensions_is_4": ([("dimensions = 3", "dimensions = 4")], r':3: dimensions: expected an integer, 2 <= x <= 3, found 4'),
    "spacing_is_a_string": ([("spacing = 0.1", "spacing = \"0.1\"")], r':5: space\.spacing: expected a number in m.*found "0\.1"'),
    "end_is_a_date": ([("end = 1.0", "end = 2020-01-01")], r'time\.end: expected a number in s, x > 0, found a date or time'),
    "gravity_is_a_number": ([("gravity = [0.0, 0.0, -9.81]", "gravity = -9.81")], r'effects\.gravity: expected three numbers \[x, y, z\] in m/s\^2, found -9\.81'),
    "gravity_has_two": ([("gravity = [0.0, 0.0, -9.81]", "gravity = [0.0, -9.81]")], r'effects\.gravity: .*found an array of 2'),
    "gravity_is_nan": ([("gravity = [0.0, 0.0, -9.81]", "gravity = [0.0, 0.0, nan]")], r'effects\.gravity: .*found nan among them'),
    "young_is_infinite": ([("young = 1.8e6", "young = inf")], r'soil\.sand\.young: .*found inf'),
    "density_is_true": ([("density = 1850.0", "density = true")], r'soil\.sand\.density: .*found true'),
    "space_is_a_number": ([("[space]\nspacing = 0.1\nh = 1.2", ""), ("dimensions = 3", "dimensions = 3\nspace = 1")], r'space: expected a table, found 1'),
    # ranges
    "spacing_is_negative": ([("spacing = 0.1", "spacing = -0.1")], r'space\.spacing: .*found -0\.1'),
    "h_is_small": ([("h = 1.2", "h = 0.3")], r'space\.h: .*0\.8 <= x <= 3, found 0\.3'),
    "end_is_0": ([("end = 1.0", "end = 0.0")], r'time\.end: .*x > 0, found 0'),
    "poisson_is_half": ([("poisson = 0.3", "poisson = 0.5")], r'soil\.sand\.poisson: expected a number, 0 <= x < 0\.5, found 0\.5'),
    "friction_is_95": ([("friction_angle = 25.0", "friction_angle = 95")], r':13: soil\.sand\.friction_angle: expected a number in deg, 0 <= x < 90, found 95'),
    "cohesion_is_negative": ([("poisson = 0.3", "poisson = 0.3\ncohesion = -1.0")], r'soil\.sand\.cohesion: .*x >= 0, found -1'),
    "density_is_0": ([("density = 1850.0", "density = 0")], r'soil\.sand\.density: .*x > 0, found 0'),
    "skin_is_large": ([("[accuracy]", "[accuracy]\nskin = 0.9")], r'accuracy\.skin: .*0\.01 <= x <= 0\.5, found 0\.9'),
    "place_is_far": ([(BOX, BOX.replace("1.0, 1.0, 1.0", "1e300, 1.0, 1.0"))], r'body\.0\.box\.high: .*among them, outside'),
    # choices
    "cone_misspelt": ([("poisson = 0.3", "poisson = 0.3\ncone = \"compresion\"")], r'soil\.sand\.cone: expected one of "compression", .*did you mean "compression"'),
    "kernel_unknown": ([("[accuracy]", "[accuracy]\nkernel = \"wendland c6\"")], r'accuracy\.kernel: .*"wendland c4", found "wendland c6"; did you mean "wendland c[24]"'),
    "precision_unknown": ([("[accuracy]", "[accuracy]\nprecision = \"single\"")], r'accuracy\.precision: expected one of "double", "mixed", found "single"'),
    "surface_unknown": ([("[effects]", "surface = \"ruff\"\n[effects]")], r'wall\.0\.surface: expected "rough", "smooth" or a table, found "ruff"; did you mean "rough"'),
    "surface_without_angle": ([("[effects]", "surface = {}\n[effects]")], r'wall\.0\.surface\.friction_angle: expected a number in deg'),
    "field_unknown": ([("[output]", "[output]\nfields = [\"velocity\", \"stres\"]")], r'output\.fields: .*found "stres"; did you mean "stress"'),
    "field_twice": ([("[output]", "[output]\nfields = [\"stress\", \"stress\"]")], r'output\.fields: .*"stress" twice'),
    "fields_empty": ([("[output]", "[output]\nfields = []")], r'output\.fields: .*name at least one or leave the key out'),
    "periodic_unknown": ([("h = 1.2", "h = 1.2\nperiodic = [\"w\"]")], r'space\.periodic: .*found "w"'),
    "artificial_stress_unknown": ([("[accuracy]", "artificial_stress = \"on\"\n[accuracy]")], r'effects\.artificial_stress: expected "auto" or a table, found "on"'),
    "picture_unknown": ([("[output]", "[output]\npicture = { view = \"front\" }")], r'output\.picture\.view: expected one of "oblique"'),
    "body_soil_unknown": ([("soil = \"sand\"", "soil = \"sandy\"")], r':15: body\.0\.soil: expected the name of a soil, found "sandy"; did you mean "sand"'),
    # rules
    "no_strength": ([("friction_angle = 25.0", "")], r':9: soil\.sand: expected a soil with strength'),
    "dilation_above_friction": ([("poisson = 0.3", "poisson = 0.3\ndilation_angle = 30.0")], r'soil\.sand\.dilation_angle: expected at most the friction angle, found 30 deg > 25 deg'),
    "cutoff_above_apex": ([("poisson = 0.3", "poisson = 0.3\ncohesion = 1000.0\ntension_cutoff = 3000.0")], r'soil\.sand\.tension_cutoff: expected at most the cone.s apex c cot\(phi\) = 2144\.51 Pa'),
    "step_unstable": ([("end = 1.0", "end = 1.0\nstep = 0.01")], r':9: time\.step: expected a step below the stable limit'),
    "step_beyond_end": ([("end = 1.0", "end = 1.0\nstep = 3.0")], r'time\.step: expected a step of at most time\.end'),
    "cfl_unstable": ([("[accuracy]", "[accuracy]\ncfl = 2.0")], r'accuracy\.cfl: expected a number below the stable limit'),
    "low_without_high": ([("h = 1.2", "h = 1.2\nlow = [-1.0, -1.0, -1.0]")], r':7: space\.low: expected space\.low and space\.high together'),
    "low_above_high": ([("h = 1.2", "h = 1.2\nlow = [3.0, -1.0, -1.0]\nhigh = [2.0, 2.0, 2.0]")], r'space\.high: expected high above low along x'),
    "periodic_without_box": ([("h = 1.2", "h = 1.2\nperiodic = [\"y\"]")], r'space\.periodic: expected space\.low and space\.high with periodic y'),
    "periodic_short": ([("h = 1.2", "h = 1.2\nperiodic = [\"y\"]\nlow = [-1.0, 0.0, -1.0]\nhigh = [2.0, 0.3, 2.0]")], r'space\.periodic: expected a period of at least 0\.528 m along y'),
    "periodic_fraction": ([("h = 1.2", "h = 1.2\nperiodic = [\"y\"]\nlow = [-1.0, -1.0, -1.0]\nhigh = [2.0, 2.05, 2.0]")], r'space\.periodic: expected a period of whole spacings along y, found 30\.5'),
    "body_outside": ([("h = 1.2", "h = 1.2\nlow = [0.5, -1.0, -1.0]\nhigh = [2.0, 2.0, 2.0]")], r':18: body\.0\.box: expected it inside space\.low \.\. space\.high = 0\.5 \.\. 2 m along x.*space\.low is at .*:7'),
    "box_upside_down": ([(BOX, "box = { low = [0.0, 0.0, 1.0], high = [1.0, 1.0, 0.0] }")], r'body\.0\.box: expected low < high along z, found 1 and 0'),
    "box_fraction": ([(BOX, BOX.replace("high = [1.0,", "high = [1.05,"))], r':16: body\.0\.box: expected a whole number of spacings \(0\.1 m\) a side, found 10\.5 along x; let high\.x be 1 or 1\.1'),
    "box_huge": ([("spacing = 0.1", "spacing = 1e-6"), ("1.0, 1.0, 1.0", "1e3, 1e3, 1e3")], r'body\.0\.box: expected a shape that a computer can hold'),
    "sphere_empty": ([(BOX, "sphere = { center = [0.0, 0.0, 2.0], radius = 0.01 }")], r'body\.0\.sphere: expected particles strictly inside, found none'),
    "bodies_overlap": ([("[[wall]]", "[[body]]\nsoil = \"sand\"\nbox = { low = [0.9, 0.0, 0.0], high = [2.0, 1.0, 1.0] }\n[[wall]]")], r':17: body\.1: expected shapes that at most touch, found an overlap of body\.1 with body\.0 by 0\.1 m.*body\.0 is at .*:14'),
    "wall_overlaps": ([("[-1.0, -1.0, -0.4], high = [2.0, 2.0, 0.0]", "[-1.0, -1.0, -0.4], high = [2.0, 2.0, 0.1]")], r'wall\.0: expected shapes that at most touch, found an overlap of wall\.0 with body\.0'),
    "sphere_in_box": ([("[[wall]]", "[[body]]\nsoil = \"sand\"\nsphere = { center = [0.5, 0.5, 1.2], radius = 0.5 }\n[[wall]]")], r'body\.1: expected shapes that at most touch, found an overlap of body\.1 with body\.0'),
    "polygon_two_corners": ([(BOX, "polygon = { points = [[0.0, 0.0], [1.0, 0.0]], y = [0.0, 1.0] }")], r'body\.0\.polygon\.points: expected at least 3 corners, found 2'),
    "polygon_crosses": ([(BOX, "polygon = { points = [[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]], y = [0.0, 1.0] }")], r'body\.0\.polygon\.points: expected a polygon whose edges meet at their corners only'),
    "polygon_closed": ([(BOX, "polygon = { points = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.0, 0.0]], y = [0.0, 1.0] }")], r'body\.0\.polygon\.points: .*the first not again at the end'),
    "polygon_without_y": ([(BOX, "polygon = { points = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]] }")], r'body\.0\.polygon\.y: expected y = \[from, to\] in 3-D, found none'),
    "polygon_point_of_3": ([(BOX, "polygon = { points = [[0.0, 0.0, 0.0], [1.0, 0.0], [0.0, 1.0]], y = [0.0, 1.0] }")], r'body\.0\.polygon\.points: .*found an array of 3 as a corner'),
    "flat_cylinder": ([FLAT, (BOX, "cylinder = { base = [0.0, 0.0, 0.0], radius = 0.5, height = 1.0 }")], r'body\.0\.cylinder: expected a box, sphere \(a disc\) or polygon in 2-D'),
    "flat_periodic": ([FLAT, ("h = 1.2", "h = 1.2\nperiodic = [\"y\"]\nlow = [-1.0, -1.0, -1.0]\nhigh = [2.0, 2.0, 2.0]")], r'space\.periodic: expected no periodic y in 2-D'),
    "flat_gravity": ([FLAT, ("[0.0, 0.0, -9.81]", "[0.0, -9.81, 0.0]")], r'effects\.gravity: expected no gravity along y in 2-D'),
    "flat_velocity": ([FLAT, ("soil = \"sand\"", "soil = \"sand\"\nvelocity = [0.0, 1.0, 0.0]")], r'body\.0\.velocity: expected no velocity along y in 2-D'),
    "at_rest_without_gravity": ([("soil = \"sand\"", "soil = \"sand\"\nstress = \"at rest\""), ("gravity = [0.0, 0.0, -9.81]", "")], r'body\.0\.stress: expected gravity along -z for a stress "at rest", found none'),
    "several": ([("spacing = 0.1", "spacing = 0.0"), ("poisson = 0.3", "poisson = 0.7")], r':5: space\.spacing: [^\n]*\n[^\n]*:12: soil\.sand\.poisson: '),
}

folder = pathlib.Path(__file__).parent / "bad"
folder.mkdir(exist_ok=True)
for old in folder.glob("*.toml"):
    old.unlink()
for name, (edits, expected) in CASES.items():
    text = GOOD
    for before, after in edits:
        assert before in text, (name, before)
        text = text.replace(before, after, 1)
    (folder / f"{name}.toml").write_text(f"# expect: {expected}\n{text}")
