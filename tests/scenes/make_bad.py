#!/usr/bin/python3
"""Writes tests/scenes/bad/*.toml: a good scene broken once a file, with the message expected as a regular expression in
the first line, and tests/scenes/doubtful/*.toml: scenes that are accepted with the warning expected there. The files are
kept in the repository; run this after adding a case. tests/unit/scene_file_test.cpp reads them."""
# Beyond 400 lines: a table, one entry a bad scene.
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
P = "poisson = 0.3"


# Where a line is put, or what is put for another.
def key(old, new):
    return [(old, new)]


def spa(line):
    return [("h = 1.2", "h = 1.2\n" + line)]


def tim(line):
    return [("end = 1.0", "end = 1.0\n" + line)]


def soil(line):
    return [(P, P + "\n" + line)]


def bod(line):
    return [('soil = "sand"', 'soil = "sand"\n' + line)]


def shape(text):
    return [(BOX, text)]


def wal(line):
    return [("[effects]", line + "\n[effects]")]


def eff(line):
    return [("[accuracy]", line + "\n[accuracy]")]


def acc(line):
    return [("[accuracy]", "[accuracy]\n" + line)]


def out(line):
    return [("[output]", "[output]\n" + line)]


CASES = {
    "coordinates_beyond_rounding": (
        key("spacing = 0.1", "spacing = 1e-6") + shape("box = { low = [1e8, 0.0, 0.0], high = [100000000.00001, 1e-5, 1e-5] }"),
        r"body\.0\.box: expected coordinates that tell particles 1e-06 m apart from each other, found such that rounding moves by .* m; move the scene nearer to the origin",
    ),
    # maps
    "maps_flat": (
        [FLAT] + eff("[maps]"),
        r":21: maps: expected dimensions = 3 with \[maps\], which are drawn in plan, found 2; use dimensions = 3",
    ),
    "maps_cell_zero": (eff("[maps]\ncell = 0.0"), r":22: maps\.cell: expected a number in m, 0 < x <= 1e\+09, found 0"),
    "maps_cell_minute": (
        eff("[maps]\ncell = 1e-5"),
        r":22: maps\.cell: expected at most 5e\+07 cells over all walls and soil, found 9e\+10 of 1e-05 m; let maps\.cell be 0\.00045",
    ),
    "maps_wet_negative": (eff("[maps]\nwet = -0.1"), r":22: maps\.wet: expected a number in m, 0 < x <= 1e\+09, found -0\.1"),
    "maps_limit_negative": (
        eff("[maps]\nlimits = [0.5, -1.0]"),
        r":22: maps\.limits: expected an array of numbers in m, 0 < x <= 1e\+09, found -1 among them",
    ),
    "maps_limits_number": (
        eff("[maps]\nlimits = 0.5"),
        r":22: maps\.limits: expected an array of numbers in m, 0 < x <= 1e\+09, found 0\.5",
    ),
    "maps_limit_word": (
        eff('[maps]\nlimits = ["deep"]'),
        r':22: maps\.limits: expected an array of numbers in m, 0 < x <= 1e\+09, found "deep" among them',
    ),
    "maps_limit_twice": (
        eff("[maps]\nlimits = [0.5, 1.0, 0.5]"),
        r":22: maps\.limits: expected each limit once, found 0\.5 again; leave it out",
    ),
    "maps_points_number": (eff("[maps]\npoints = 3"), r":22: maps\.points: expected a string, found 3"),
    "maps_misspelt": (eff("[maps]\nlimit = [0.5]"), r':22: maps\.limit: expected a known key, found "limit"; did you mean "limits"'),
    # spelling and structure
    "unknown_top": (
        [("dimensions = 3", "dimensions = 3\ncolour = 1")],
        r':4: colour: expected a known key, found "colour"\. Known here: title, ',
    ),
    "misspelt_spacing": ([("spacing = 0.1", "spacing = 0.1\nspaceing = 0.1")], r':6: space\.spaceing: .*did you mean "spacing"'),
    "misspelt_table": ([("[effects]", "[efects]")], r':19: efects: .*did you mean "effects"'),
    "misspelt_nested": (
        [("[accuracy]", "viscosity = { alfa = 0.1, alpha = 0.1 }\n[accuracy]")],
        r':21: effects\.viscosity\.alfa: .*"alpha"',
    ),
    "wrong_section": ([("end = 1.0", "end = 1.0\ncfl = 0.2")], r':9: time\.cfl: .*did you mean "accuracy\.cfl"'),
    "softening_without_slip": (
        [("poisson = 0.3", "poisson = 0.3\nsoftening = { friction_angle = 20.0 }")],
        r"soil\.sand\.softening\.slip: expected a number in m, x > 0, found nothing",
    ),
    "softening_misspelt": (
        [("poisson = 0.3", "poisson = 0.3\nsoftening = { rate = 1.0, slip = 0.1 }")],
        r"soil\.sand\.softening\.rate: expected a known key",
    ),
    "softening_that_hardens": (
        [("poisson = 0.3", "poisson = 0.3\nsoftening = { friction_angle = 35.0, slip = 0.1 }")],
        r"soil\.sand\.softening: expected a residual strength of at most the first",
    ),
    "softening_adds_cohesion": (
        [("poisson = 0.3", "poisson = 0.3\nsoftening = { cohesion = 10.0, slip = 0.1 }")],
        r"soil\.sand\.softening: expected a residual strength of at most the first",
    ),
    "rate_friction_falls": (
        [("poisson = 0.3", "poisson = 0.3\nrate_friction = { friction_angle = 20.0, grain = 0.001 }")],
        r"rate_friction\.friction_angle: expected at least the friction angle at rest",
    ),
    "rate_friction_without_grain": (
        [("poisson = 0.3", "poisson = 0.3\nrate_friction = { friction_angle = 35.0 }")],
        r"rate_friction\.grain: expected a number in m",
    ),
    "rate_friction_of_clay": (
        [("friction_angle = 25.0", "cohesion = 1e3\nrate_friction = { friction_angle = 35.0, grain = 0.001 }")],
        r"rate_friction: expected a soil with a friction_angle above 0",
    ),
    "dilation_decay_zero": ([("poisson = 0.3", "poisson = 0.3\ndilation_decay = 0")], r"dilation_decay: expected a number, x > 0, found 0"),
    "pore_pressure_sideways": (
        [("[accuracy]", "pore_pressure = { table = [[0.0, 1.0]] }\n[accuracy]"), ("[0.0, 0.0, -9.81]", "[1.0, 0.0, -9.81]")],
        r"effects\.pore_pressure: expected gravity along -z",
    ),
    "pore_pressure_dry": (
        [("[accuracy]", "pore_pressure = { table = [] }\n[accuracy]")],
        r"effects\.pore_pressure\.table: expected at least one corner",
    ),
    "pore_pressure_backwards": (
        [("[accuracy]", "pore_pressure = { table = [[1.0, 1.0], [0.0, 1.0]] }\n[accuracy]")],
        r"effects\.pore_pressure\.table: expected corners with increasing x",
    ),
    "diffusion_too_strong": (
        [("[accuracy]", "stress_diffusion = { zeta = 10 }\n[accuracy]")],
        r"effects\.stress_diffusion\.zeta: expected a number, 0 <= x <= 1, found 10",
    ),
    "diffusion_switch": (
        [("[accuracy]", "stress_diffusion = true\n[accuracy]")],
        r'effects\.stress_diffusion: expected "auto" or a table, found true',
    ),
    "not_offered_walls": ([("[accuracy]", '[accuracy]\nwalls = "extrapolated"')], r"accuracy\.walls: expected a known key"),
    "not_offered_correction": (
        [("[accuracy]", '[accuracy]\ncorrection = "kernel"')],
        r'accuracy\.correction: expected one of "none", "gradient", "adjoint", found "kernel"',
    ),
    "quoted_path": ([("dimensions = 3", 'dimensions = 3\n"space.h" = 1.2')], r'expected a known key, found "space\.h"'),
    "not_toml": ([("end = 1.0", "end = = 1.0")], r":8: expected TOML, found an error"),
    "twice": ([("end = 1.0", "end = 1.0\nend = 2.0")], r":9: expected TOML, found an error.*"),
    "soil_is_no_table": ([("[soil.sand]", "[soil]\nclay = 3\n[soil.sand]")], r"soil\.clay: expected a soil.s table, found 3"),
    "soil_name": ([("[soil.sand]", '[soil."wet sand"]')], r"soil\.wet sand: expected a name of letters"),
    "body_is_a_table": ([("[[body]]", "[body]")], r":14: body: expected tables \[\[body\]\], found a table"),
    # what is needed
    "no_title": ([('title = "a good scene"', "")], r":1: title: expected a string, found nothing; write, for example, title ="),
    "no_dimensions": ([("dimensions = 3", "")], r"dimensions: expected an integer, 2 <= x <= 3, found nothing"),
    "no_spacing": (
        [("spacing = 0.1", "")],
        r":4: space\.spacing: expected a number in m.*found nothing; write, for example, spacing = 0\.04",
    ),
    "no_space": ([("[space]\nspacing = 0.1\nh = 1.2", "")], r"space: expected a table, found nothing"),
    "no_end": ([("end = 1.0", "")], r":7: time\.end: expected a number in s, x > 0, found nothing"),
    "no_soil": ([(GOOD[GOOD.index("[soil") : GOOD.index("[[body")], "")], r"soil: expected tables \[soil\.<name>\], found nothing"),
    "no_body": ([(GOOD[GOOD.index("[[body") : GOOD.index("[[wall")], "")], r"body: expected tables \[\[body\]\], found nothing"),
    "no_density": ([("density = 1850.0", "")], r":9: soil\.sand\.density: expected a number in kg/m\^3"),
    "no_young": ([("young = 1.8e6", "")], r"soil\.sand\.young: expected a number in Pa"),
    "no_poisson": ([("poisson = 0.3", "")], r"soil\.sand\.poisson: expected a number"),
    "no_body_soil": ([('soil = "sand"', "")], r":14: body\.0\.soil: expected a string, found nothing"),
    "no_shape": ([(BOX, "")], r":14: body\.0: expected exactly one of box, cylinder, sphere, polygon, release, found none"),
    "two_shapes": (
        [(BOX, BOX + "\nsphere = { center = [0.0, 0.0, 0.0], radius = 1.0 }")],
        r"body\.0: expected exactly one of .* found box and sphere",
    ),
    "no_radius": ([(BOX, "sphere = { center = [0.0, 0.0, 2.0] }")], r"body\.0\.sphere\.radius: expected a number in m"),
    # types
    "title_is_a_number": ([('title = "a good scene"', "title = 5")], r"title: expected a string, found 5"),
    "dimensions_is_a_float": ([("dimensions = 3", "dimensions = 3.0")], r"dimensions: expected an integer"),
    "dimensions_is_4": ([("dimensions = 3", "dimensions = 4")], r":3: dimensions: expected an integer, 2 <= x <= 3, found 4"),
    "spacing_is_a_string": ([("spacing = 0.1", 'spacing = "0.1"')], r':5: space\.spacing: expected a number in m.*found "0\.1"'),
    "end_is_a_date": ([("end = 1.0", "end = 2020-01-01")], r"time\.end: expected a number in s, x > 0, found a date or time"),
    "gravity_is_a_number": (
        [("gravity = [0.0, 0.0, -9.81]", "gravity = -9.81")],
        r"effects\.gravity: expected three numbers \[x, y, z\] in m/s\^2, found -9\.81",
    ),
    "gravity_has_two": ([("gravity = [0.0, 0.0, -9.81]", "gravity = [0.0, -9.81]")], r"effects\.gravity: .*found an array of 2"),
    "gravity_is_nan": ([("gravity = [0.0, 0.0, -9.81]", "gravity = [0.0, 0.0, nan]")], r"effects\.gravity: .*found nan among them"),
    "young_is_infinite": ([("young = 1.8e6", "young = inf")], r"soil\.sand\.young: .*found inf"),
    "density_is_true": ([("density = 1850.0", "density = true")], r"soil\.sand\.density: .*found true"),
    "space_is_a_number": (
        [("[space]\nspacing = 0.1\nh = 1.2", ""), ("dimensions = 3", "dimensions = 3\nspace = 1")],
        r"space: expected a table, found 1",
    ),
    # ranges
    "spacing_is_negative": ([("spacing = 0.1", "spacing = -0.1")], r"space\.spacing: .*found -0\.1"),
    "h_is_small": ([("h = 1.2", "h = 0.3")], r"space\.h: .*0\.8 <= x <= 3, found 0\.3"),
    "end_is_0": ([("end = 1.0", "end = 0.0")], r"time\.end: .*x > 0, found 0"),
    "poisson_is_half": ([("poisson = 0.3", "poisson = 0.5")], r"soil\.sand\.poisson: expected a number, 0 <= x < 0\.5, found 0\.5"),
    "friction_is_95": (
        [("friction_angle = 25.0", "friction_angle = 95")],
        r":13: soil\.sand\.friction_angle: expected a number in deg, 0 <= x < 90, found 95",
    ),
    "cohesion_is_negative": ([("poisson = 0.3", "poisson = 0.3\ncohesion = -1.0")], r"soil\.sand\.cohesion: .*x >= 0, found -1"),
    "density_is_0": ([("density = 1850.0", "density = 0")], r"soil\.sand\.density: .*x > 0, found 0"),
    "skin_is_large": ([("[accuracy]", "[accuracy]\nskin = 0.9")], r"accuracy\.skin: .*0\.01 <= x <= 0\.5, found 0\.9"),
    "place_is_far": ([(BOX, BOX.replace("1.0, 1.0, 1.0", "1e300, 1.0, 1.0"))], r"body\.0\.box\.high: .*among them, outside"),
    # choices
    "cone_misspelt": (
        [("poisson = 0.3", 'poisson = 0.3\ncone = "compresion"')],
        r'soil\.sand\.cone: expected one of "compression", .*did you mean "compression"',
    ),
    "kernel_unknown": (
        [("[accuracy]", '[accuracy]\nkernel = "wendland c6"')],
        r'accuracy\.kernel: .*"wendland c4", found "wendland c6"; did you mean "wendland c[24]"',
    ),
    "precision_unknown": (
        [("[accuracy]", '[accuracy]\nprecision = "single"')],
        r'accuracy\.precision: expected one of "double", "mixed", found "single"',
    ),
    "surface_unknown": (
        [("[effects]", 'surface = "ruff"\n[effects]')],
        r'wall\.0\.surface: expected "rough", "smooth" or a table, found "ruff"; choose one of these',
    ),
    "surface_without_angle": ([("[effects]", "surface = {}\n[effects]")], r"wall\.0\.surface\.friction_angle: expected a number in deg"),
    "field_unknown": (
        [("[output]", '[output]\nfields = ["velocity", "stres"]')],
        r'output\.fields: .*found "stres"; did you mean "stress"',
    ),
    "field_twice": ([("[output]", '[output]\nfields = ["stress", "stress"]')], r'output\.fields: .*"stress" twice'),
    "fields_empty": ([("[output]", "[output]\nfields = []")], r"output\.fields: .*name at least one or leave the key out"),
    "periodic_unknown": ([("h = 1.2", 'h = 1.2\nperiodic = ["w"]')], r'space\.periodic: .*found "w"'),
    "artificial_stress_unknown": (
        [("[accuracy]", 'artificial_stress = "on"\n[accuracy]')],
        r'effects\.artificial_stress: expected "auto" or a table, found "on"',
    ),
    "picture_unknown": ([("[output]", '[output]\npicture = { view = "front" }')], r'output\.picture\.view: expected one of "oblique"'),
    "picture_range_backwards": (
        out("picture = { range = [2.0, 1.0] }"),
        r"output\.picture\.range: expected \[least, largest\], found \[2, 1\]; exchange",
    ),
    "movie_without_picture": (out("movie = true"), r"output\.movie: a film is made of pictures, and there are none"),
    "body_soil_unknown": (
        [('soil = "sand"', 'soil = "sandy"')],
        r':15: body\.0\.soil: expected the name of a soil, found "sandy"; did you mean "sand"',
    ),
    # rules
    "no_strength": ([("friction_angle = 25.0", "")], r":9: soil\.sand: expected a soil with strength"),
    "dilation_above_friction": (
        [("poisson = 0.3", "poisson = 0.3\ndilation_angle = 30.0")],
        r"soil\.sand\.dilation_angle: expected at most the friction angle, found 30 deg > 25 deg",
    ),
    "cutoff_above_apex": (
        [("poisson = 0.3", "poisson = 0.3\ncohesion = 1000.0\ntension_cutoff = 3000.0")],
        r"soil\.sand\.tension_cutoff: expected at most the cone.s apex c cot\(phi\) = 2144\.51 Pa",
    ),
    "step_unstable": ([("end = 1.0", "end = 1.0\nstep = 0.01")], r":9: time\.step: expected a step below the stable limit"),
    "step_beyond_end": ([("end = 1.0", "end = 1.0\nstep = 3.0")], r"time\.step: expected a step of at most time\.end"),
    "cfl_unstable": ([("[accuracy]", "[accuracy]\ncfl = 2.0")], r"accuracy\.cfl: expected a number below the stable limit"),
    "low_without_high": (
        [("h = 1.2", "h = 1.2\nlow = [-1.0, -1.0, -1.0]")],
        r":7: space\.low: expected space\.low and space\.high together",
    ),
    "low_above_high": (
        [("h = 1.2", "h = 1.2\nlow = [3.0, -1.0, -1.0]\nhigh = [2.0, 2.0, 2.0]")],
        r"space\.high: expected high above low along x",
    ),
    "periodic_without_box": (
        [("h = 1.2", 'h = 1.2\nperiodic = ["y"]')],
        r"space\.periodic: expected space\.low and space\.high with periodic y",
    ),
    "periodic_short": (
        [("h = 1.2", 'h = 1.2\nperiodic = ["y"]\nlow = [-1.0, 0.0, -1.0]\nhigh = [2.0, 0.3, 2.0]')],
        r"space\.periodic: expected a period of at least 0\.576 m along y",
    ),
    "periodic_fraction": (
        [("h = 1.2", 'h = 1.2\nperiodic = ["y"]\nlow = [-1.0, -1.0, -1.0]\nhigh = [2.0, 2.05, 2.0]')],
        r"space\.periodic: expected a period of whole spacings along y, found 30\.5",
    ),
    "body_outside": (
        [("h = 1.2", "h = 1.2\nlow = [0.5, -1.0, -1.0]\nhigh = [2.0, 2.0, 2.0]")],
        r":18: body\.0\.box: expected it inside space\.low \.\. space\.high = 0\.5 \.\. 2 m along x.*space\.low is at .*:7",
    ),
    "box_upside_down": (
        [(BOX, "box = { low = [0.0, 0.0, 1.0], high = [1.0, 1.0, 0.0] }")],
        r"body\.0\.box: expected low < high along z, found 1 and 0",
    ),
    "box_fraction": (
        [(BOX, BOX.replace("high = [1.0,", "high = [1.05,"))],
        r":16: body\.0\.box: expected a whole number of spacings \(0\.1 m\) a side, found 10\.5 along x; let high\.x be 1 or 1\.1",
    ),
    "box_huge": (
        [("spacing = 0.1", "spacing = 1e-6"), ("1.0, 1.0, 1.0", "1e3, 1e3, 1e3")],
        r"body\.0\.box: expected a shape that a computer can hold",
    ),
    "sphere_empty": (
        [(BOX, "sphere = { center = [0.0, 0.0, 2.0], radius = 0.01 }")],
        r"body\.0\.sphere: expected particles inside, found none",
    ),
    "bodies_overlap": (
        [("[[wall]]", '[[body]]\nsoil = "sand"\nbox = { low = [0.9, 0.0, 0.0], high = [2.0, 1.0, 1.0] }\n[[wall]]')],
        r":17: body\.1: expected shapes that at most touch, found an overlap of body\.1 with body\.0 by 0\.1 m.*body\.0 is at .*:14",
    ),
    "wall_overlaps": (
        [("[-1.0, -1.0, -0.4], high = [2.0, 2.0, 0.0]", "[-1.0, -1.0, -0.4], high = [2.0, 2.0, 0.1]")],
        r"wall\.0: expected shapes that at most touch, found an overlap of wall\.0 with body\.0",
    ),
    "sphere_in_box": (
        [("[[wall]]", '[[body]]\nsoil = "sand"\nsphere = { center = [0.5, 0.5, 1.2], radius = 0.5 }\n[[wall]]')],
        r"body\.1: expected shapes that at most touch, found an overlap of body\.1 with body\.0",
    ),
    "polygon_two_corners": (
        [(BOX, "polygon = { points = [[0.0, 0.0], [1.0, 0.0]], y = [0.0, 1.0] }")],
        r"body\.0\.polygon\.points: expected at least 3 corners, found 2",
    ),
    "polygon_crosses": (
        [(BOX, "polygon = { points = [[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]], y = [0.0, 1.0] }")],
        r"body\.0\.polygon\.points: expected a polygon whose edges meet at their corners only",
    ),
    "polygon_closed": (
        [(BOX, "polygon = { points = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.0, 0.0]], y = [0.0, 1.0] }")],
        r"body\.0\.polygon\.points: .*the first not again at the end",
    ),
    "polygon_without_y": (
        [(BOX, "polygon = { points = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]] }")],
        r"body\.0\.polygon\.y: expected y = \[from, to\] in 3-D, found none",
    ),
    "polygon_point_of_3": (
        [(BOX, "polygon = { points = [[0.0, 0.0, 0.0], [1.0, 0.0], [0.0, 1.0]], y = [0.0, 1.0] }")],
        r"body\.0\.polygon\.points: .*found an array of 3 as a corner",
    ),
    "flat_cylinder": (
        [FLAT, (BOX, "cylinder = { base = [0.0, 0.0, 0.0], radius = 0.5, height = 1.0 }")],
        r"body\.0\.cylinder: expected a box, sphere \(a disc\) or polygon in 2-D",
    ),
    "flat_periodic": (
        [FLAT, ("h = 1.2", 'h = 1.2\nperiodic = ["y"]\nlow = [-1.0, -1.0, -1.0]\nhigh = [2.0, 2.0, 2.0]')],
        r"space\.periodic: expected no periodic y in 2-D",
    ),
    "flat_gravity": ([FLAT, ("[0.0, 0.0, -9.81]", "[0.0, -9.81, 0.0]")], r"effects\.gravity: expected no gravity along y in 2-D"),
    "flat_velocity": (
        [FLAT, ('soil = "sand"', 'soil = "sand"\nvelocity = [0.0, 1.0, 0.0]')],
        r"body\.0\.velocity: expected no velocity along y in 2-D",
    ),
    "at_rest_without_gravity": (
        [('soil = "sand"', 'soil = "sand"\nstress = "at rest"'), ("gravity = [0.0, 0.0, -9.81]", "")],
        r'body\.0\.stress: expected gravity that points down for a stress "at rest", found none',
    ),
    "several": (
        [("spacing = 0.1", "spacing = 0.0"), ("poisson = 0.3", "poisson = 0.7")],
        r":5: space\.spacing: [^\n]*\n[^\n]*:12: soil\.sand\.poisson: ",
    ),
    # text that is no TOML, or no text
    "comma_decimal": (
        key("spacing = 0.1", "spacing = 0,1"),
        r":5: expected TOML, found an error in column 12: Error while parsing key-value pair:",
    ),
    "unit_after_number": (
        key("end = 1.0", "end = 1.0 s"),
        r":8: expected TOML, found an error in column 11: Error while parsing key-value pair:",
    ),
    "smart_quotes": (key('"a good scene"', "“a good scene”"), r":2: expected TOML, found an error in column 9: Error while parsing value:"),
    "python_true": (tim("retry = True"), r":9: expected TOML, found an error in column 9: Error while parsing boolean:"),
    "slash_comment": (
        key("end = 1.0", "end = 1.0 // seconds"),
        r":8: expected TOML, found an error in column 11: Error while parsing key-value pair:",
    ),
    "colon_for_equals": (
        key("spacing = 0.1", "spacing: 0.1"),
        r":5: expected TOML, found an error in column 8: Error while parsing key-value pair:",
    ),
    "no_value": (key("end = 1.0", "end ="), r":8: expected TOML, found an error in column 6: Error while parsing key-value pair:"),
    "string_unterminated": (
        key('"a good scene"', '"a good scene'),
        r":2: expected TOML, found an error in column 22: Error while parsing string:",
    ),
    "array_unterminated": (
        key("gravity = [0.0, 0.0, -9.81]", "gravity = [0.0, 0.0, -9.81"),
        r":21: expected TOML, found an error in column 1: Error while parsing array:",
    ),
    "bracket_missing": (key("[space]", "[space"), r":4: expected TOML, found an error in column 7: Error while parsing table header:"),
    "table_twice": (
        key("[accuracy]", "[accuracy]\n[space]"),
        r":22: expected TOML, found an error in column 1: Error while parsing table header:",
    ),
    "soil_twice": (
        key("[[body]]", "[soil.sand]\ndensity = 2000.0\n[[body]]"),
        r":14: expected TOML, found an error in column 1: Error while parsing table header:",
    ),
    "number_leading_point": (
        key("poisson = 0.3", "poisson = .3"),
        r":12: expected TOML, found an error in column 11: Error while parsing floating-point:",
    ),
    "number_trailing_point": (
        key("spacing = 0.1", "spacing = 1."),
        r":5: expected TOML, found an error in column 13: Error while parsing floating-point:",
    ),
    "number_leading_zero": (
        key("density = 1850.0", "density = 01850.0"),
        r":10: expected TOML, found an error in column 12: Error while parsing floating-point:",
    ),
    "number_in_fortran": (
        key("young = 1.8e6", "young = 1.8d6"),
        r":11: expected TOML, found an error in column 12: Error while parsing floating-point:",
    ),
    "not_utf8": (key('"a good scene"', '"a good sc\udce8ne"'), r":2: expected UTF-8, found the byte 0xe8 that is none"),
    "control_character": (
        key('"a good scene"', '"a good\x01scene"'),
        r":2: expected TOML, found an error in column 16: Error while parsing string:",
    ),
    "zero_byte": (
        key('"a good scene"', '"a good\x00scene"'),
        r":2: expected TOML, found an error in column 16: Error while parsing string:",
    ),
    "json": (
        '{\n  "title": "a scene",\n  "dimensions": 3\n}\n',
        r":2: expected TOML, found an error in column 1: Error while parsing root table:",
    ),
    "empty": ("", r":1: title: expected a string, found nothing"),
    "only_a_comment": ("# nothing yet\n", r":1: title: expected a string, found nothing"),
    "an_image": ("\udc89PNG\r\n\x1a\n\x00\x00\x00\rIHDR", r":2: expected UTF-8, found the byte 0x89 that is none"),
    "utf16": ("\udcff\udcfet\x00i\x00t\x00l\x00e\x00", r":2: expected UTF-8, found the byte 0xff that is none"),
    "deep_nesting": (
        "title = " + "[" * 2000 + "]" * 2000 + "\n",
        r":2: expected TOML, found an error in column 265: Error while parsing value:",
    ),
    # misspelt, misplaced, unknown
    "capital_key": (
        key("density = 1850.0", "Density = 1850.0"),
        r':10: soil\.sand\.Density: expected a known key, found "Density"; did you mean "density"',
    ),
    "rho_for_density": (
        key("density = 1850.0", "rho = 1850.0"),
        r':10: soil\.sand\.rho: expected a known key, found "rho"; did you mean "density"',
    ),
    "phi_for_friction": (
        key("friction_angle = 25.0", "phi = 25.0"),
        r':13: soil\.sand\.phi: expected a known key, found "phi"; did you mean "friction_angle"',
    ),
    "friction_misspelt": (
        key("friction_angle = 25.0", "fricton_angle = 25.0"),
        r':13: soil\.sand\.fricton_angle: expected a known key, found "fricton_angle"',
    ),
    "body_misspelt": (key("[[body]]", "[[bodies]]"), r':14: bodies: expected a known key, found "bodies"'),
    "wall_misspelt": (key("[[wall]]", "[[walls]]"), r':17: walls: expected a known key, found "walls"'),
    "wall_is_a_table": (key("[[wall]]", "[wall]"), r":17: wall: expected tables \[\[wall\]\], found a table"),
    "soil_is_an_array": (key("[soil.sand]", "[[soil]]"), r":9: soil: expected tables \[soil\.<name>\], found an array of 1"),
    "soil_without_name": (key("[soil.sand]", "[soil]"), r""":10: soil\.density: expected a soil's table, found 1850"""),
    "gravity_at_top": (
        key("dimensions = 3", "dimensions = 3\ngravity = [0.0, 0.0, -9.81]"),
        r':4: gravity: expected a known key, found "gravity"',
    ),
    "step_in_accuracy": (acc("step = 1e-4"), r':22: accuracy\.step: expected a known key, found "step"'),
    "dt_for_step": (tim("dt = 1e-4"), r':9: time\.dt: expected a known key, found "dt"; did you mean "step"'),
    "retry_in_accuracy": (acc("retry = true"), r':22: accuracy\.retry: expected a known key, found "retry"'),
    "fields_in_effects": (eff('fields = ["stress"]'), r':21: effects\.fields: expected a known key, found "fields"'),
    "cohesion_in_body": (bod("cohesion = 100.0"), r':16: body\.0\.cohesion: expected a known key, found "cohesion"'),
    "surface_of_a_body": (bod('surface = "rough"'), r':16: body\.0\.surface: expected a known key, found "surface"'),
    "wall_with_soil": (wal('soil = "sand"'), r':19: wall\.0\.soil: expected a known key, found "soil"'),
    "velocity_of_a_wall": (wal("velocity = [1.0, 0.0, 0.0]"), r':19: wall\.0\.velocity: expected a known key, found "velocity"'),
    "box_in_space": (spa("box = { low = [0.0, 0.0, 0.0], high = [1.0, 1.0, 1.0] }"), r':7: space\.box: expected a known key, found "box"'),
    "box_with_size": (
        shape("box = { low = [0.0, 0.0, 0.0], size = [1.0, 1.0, 1.0] }"),
        r':16: body\.0\.box\.size: expected a known key, found "size"; did you mean "high"',
    ),
    "cylinder_with_diameter": (
        shape("cylinder = { base = [0.0, 0.0, 1.0], diameter = 1.0, height = 1.0 }"),
        r':16: body\.0\.cylinder\.diameter: expected a known key, found "diameter"; did you mean "radius"',
    ),
    "sphere_british": (
        shape("sphere = { centre = [0.0, 0.0, 2.0], radius = 1.0 }"),
        r':16: body\.0\.sphere\.centre: expected a known key, found "centre"; did you mean "center"',
    ),
    "cuboid": (
        shape("cuboid = { low = [0.0, 0.0, 0.0], high = [1.0, 1.0, 1.0] }"),
        r':16: body\.0\.cuboid: expected a known key, found "cuboid"',
    ),
    "picture_colour": (out('picture = { colour = "speed" }'), r':23: output\.picture\.colour: expected a known key, found "colour"'),
    "checkpoint_hours": (out("checkpoint_hours = 1"), r':23: output\.checkpoint_hours: expected a known key, found "checkpoint_hours"'),
    # wrong types
    "end_is_a_string": (key("end = 1.0", 'end = "1.0"'), r':8: time\.end: expected a number in s, x > 0, found "1\.0"'),
    "density_with_unit": (
        key("density = 1850.0", 'density = "1850 kg/m3"'),
        r':10: soil\.sand\.density: expected a number in kg/m\^3, x > 0, found "1850 kg/m3"',
    ),
    "title_is_an_array": (key('"a good scene"', '["a", "scene"]'), r":2: title: expected a string, found an array of 2"),
    "dimensions_is_a_string": (key("dimensions = 3", 'dimensions = "3D"'), r':3: dimensions: expected an integer, 2 <= x <= 3, found "3D"'),
    "dimensions_is_1": (key("dimensions = 3", "dimensions = 1"), r":3: dimensions: expected an integer, 2 <= x <= 3, found 1"),
    "spacing_is_a_vector": (
        key("spacing = 0.1", "spacing = [0.1, 0.1, 0.1]"),
        r":5: space\.spacing: expected a number in m, 1e-06 <= x <= 1e\+06, found an array of 3",
    ),
    "periodic_is_a_string": (spa('periodic = "y"'), r':7: space\.periodic: expected an array of "x", "y", "z", found "y"'),
    "periodic_is_true": (spa("periodic = true"), r':7: space\.periodic: expected an array of "x", "y", "z", found true'),
    "periodic_twice": (
        spa('periodic = ["y", "y"]\nlow = [-1.0, -1.0, -1.0]\nhigh = [2.0, 2.0, 2.0]'),
        r':7: space\.periodic: expected an array of "x", "y", "z", found "y" twice; name it once',
    ),
    "retry_is_a_number": (tim("retry = 1"), r":9: time\.retry: expected true or false, found 1"),
    "retry_is_a_string": (tim('retry = "yes"'), r':9: time\.retry: expected true or false, found "yes"'),
    "softening_is_true": (soil("softening = true"), r":13: soil\.sand\.softening: expected a table, found true"),
    "softening_is_a_word": (soil('softening = "linear"'), r':13: soil\.sand\.softening: expected a table, found "linear"'),
    "rate_friction_is_a_number": (soil("rate_friction = 0.3"), r":13: soil\.sand\.rate_friction: expected a table, found 0\.3"),
    "dilation_decay_is_a_table": (
        soil("dilation_decay = { strain = 0.1 }"),
        r":13: soil\.sand\.dilation_decay: expected a number, x > 0, found a table",
    ),
    "viscosity_is_a_number": (eff("viscosity = 0.1"), r":21: effects\.viscosity: expected a table, found 0\.1"),
    "viscosity_without_alpha": (
        eff("viscosity = { beta = 0.1 }"),
        r":21: effects\.viscosity\.alpha: expected a number, 0 <= x <= 10, found nothing",
    ),
    "damping_is_a_number": (eff("damping = 0.02"), r":21: effects\.damping: expected a table, found 0\.02"),
    "damping_without_end": (
        eff("damping = { ratio = 0.02 }"),
        r":21: effects\.damping\.until: expected a number in s, x > 0, found nothing",
    ),
    "diffusion_is_a_number": (eff("stress_diffusion = 0.1"), r':21: effects\.stress_diffusion: expected "auto" or a table, found 0\.1'),
    "pore_pressure_is_true": (eff("pore_pressure = true"), r":21: effects\.pore_pressure: expected a table, found true"),
    "pore_pressure_is_a_level": (
        eff("pore_pressure = { table = 4.0 }"),
        r":21: effects\.pore_pressure\.table: expected an array of corners \[x, z\] in m, found 4",
    ),
    "pore_pressure_without_table": (
        eff("pore_pressure = { density = 1000.0 }"),
        r":21: effects\.pore_pressure\.table: expected an array of corners \[x, z\] in m, found nothing",
    ),
    "pore_pressure_corner_of_3": (
        eff("pore_pressure = { table = [[0.0, 0.0, 4.0]] }"),
        r":21: effects\.pore_pressure\.table: expected an array of corners \[x, z\] in m, found an array of 3 as a corner",
    ),
    "pore_pressure_flat_list": (
        eff("pore_pressure = { table = [0.0, 4.0] }"),
        r":21: effects\.pore_pressure\.table: expected an array of corners \[x, z\] in m, found 0 as a corner",
    ),
    "adjoint_in_one_pass": (
        acc('scheme = "leap-frog"\ncorrection = "adjoint"'),
        r'accuracy\.correction: expected "none" or "gradient" with the leap-frog scheme, found "adjoint"',
    ),
    "shifting_in_one_pass": (
        acc('scheme = "leap-frog"\nshifting = 2.0'),
        r'accuracy\.shifting: expected 0, found 2: the leap-frog scheme shifts no particles\. Remedy: accuracy\.scheme = "staggered"',
    ),
    "hourglass_in_one_pass": (
        acc('scheme = "leap-frog"\nhourglass = 0.1'),
        r'accuracy\.hourglass: expected 0, found 0\.1: the leap-frog scheme has no hourglass control\. Remedy: accuracy\.scheme = "staggered"',
    ),
    "hourglass_too_strong": (acc("hourglass = 0.5"), r"accuracy\.cfl: expected a number below the stable limit"),
    "kernel_norm_misspelt": (
        acc('kernel_norm = "grid"'),
        r':22: accuracy\.kernel_norm: expected one of "lattice", "continuum", found "grid"',
    ),
    "shifting_beyond_range": (acc("shifting = 7.0"), r":22: accuracy\.shifting: expected a number, 0 <= x <= 3, found 7"),
    "correction_is_true": (
        acc("correction = true"),
        r':22: accuracy\.correction: expected one of "none", "gradient", "adjoint", found true',
    ),
    "correction_misspelt": (
        acc('correction = "gradients"'),
        r':22: accuracy\.correction: expected one of "none", "gradient", "adjoint", found "gradients"',
    ),
    "precision_is_a_number": (acc("precision = 32"), r':22: accuracy\.precision: expected one of "double", "mixed", found 32'),
    "kernel_is_a_number": (
        acc("kernel = 2"),
        r':22: accuracy\.kernel: expected one of "cubic spline", "wendland c2", "wendland c4", found 2',
    ),
    "kernel_in_capitals": (
        acc('kernel = "Cubic Spline"'),
        r':22: accuracy\.kernel: expected one of "cubic spline", "wendland c2", "wendland c4", found "Cubic Spline"',
    ),
    "fields_is_a_string": (
        out('fields = "stress"'),
        r':23: output\.fields: expected an array of "velocity", "stress", "density", "plastic_strain", "displacement", found "stress"',
    ),
    "every_is_a_string": (out('every = "0.05 s"'), r':23: output\.every: expected a number in s, x > 0, found "0\.05 s"'),
    "picture_is_a_string": (out('picture = "side"'), r':23: output\.picture: expected a table, found "side"'),
    "directory_is_a_number": (out("directory = 5"), r":23: output\.directory: expected a string, found 5"),
    "velocity_is_a_number": (bod("velocity = 3.0"), r":16: body\.0\.velocity: expected three numbers \[x, y, z\] in m/s, found 3"),
    "velocity_has_two": (
        bod("velocity = [1.0, 2.0]"),
        r":16: body\.0\.velocity: expected three numbers \[x, y, z\] in m/s, found an array of 2",
    ),
    "velocity_has_four": (
        bod("velocity = [1.0, 2.0, 3.0, 4.0]"),
        r":16: body\.0\.velocity: expected three numbers \[x, y, z\] in m/s, found an array of 4",
    ),
    "velocity_of_strings": (
        bod('velocity = ["1", "0", "0"]'),
        r':16: body\.0\.velocity: expected three numbers \[x, y, z\] in m/s, found "1" among them',
    ),
    "stress_is_a_number": (bod("stress = 1.0e3"), r':16: body\.0\.stress: expected one of "none", "at rest", found 1000'),
    "stress_k0": (bod('stress = "K0"'), r':16: body\.0\.stress: expected one of "none", "at rest", found "K0"'),
    "box_is_an_array": (shape("box = [0.0, 0.0, 0.0, 1.0, 1.0, 1.0]"), r":16: body\.0\.box: expected a table, found an array of 6"),
    "box_without_high": (
        shape("box = { low = [0.0, 0.0, 0.0] }"),
        r":16: body\.0\.box\.high: expected three numbers \[x, y, z\] in m, found nothing",
    ),
    "box_is_empty": (shape("box = {}"), r":16: body\.0\.box\.low: expected three numbers \[x, y, z\] in m, found nothing"),
    "box_corner_of_2": (
        shape("box = { low = [0.0, 0.0], high = [1.0, 1.0] }"),
        r":16: body\.0\.box\.low: expected three numbers \[x, y, z\] in m, found an array of 2",
    ),
    "sphere_without_center": (
        shape("sphere = { radius = 1.0 }"),
        r":16: body\.0\.sphere\.center: expected three numbers \[x, y, z\] in m, found nothing",
    ),
    "cylinder_without_height": (
        shape("cylinder = { base = [0.0, 0.0, 1.0], radius = 0.5 }"),
        r":16: body\.0\.cylinder\.height: expected a number in m, 0 < x <= 1e\+09, found nothing",
    ),
    "polygon_flat_list": (
        shape("polygon = { points = [0.0, 0.0, 1.0, 0.0, 0.0, 1.0], y = [0.0, 1.0] }"),
        r":16: body\.0\.polygon\.points: expected an array of corners \[x, z\] in m, found 0 as a corner",
    ),
    "polygon_of_strings": (
        shape('polygon = { points = [["0", "0"], ["1", "0"], ["0", "1"]], y = [0.0, 1.0] }'),
        r':16: body\.0\.polygon\.points: expected an array of corners \[x, z\] in m, found "0" among them as a corner',
    ),
    "polygon_y_is_a_number": (
        shape("polygon = { points = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]], y = 1.0 }"),
        r":16: body\.0\.polygon\.y: expected two numbers \[from, to\] in m, found 1",
    ),
    "polygon_y_reversed": (
        shape("polygon = { points = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]], y = [1.0, 0.0] }"),
        r":16: body\.0\.polygon\.y: expected y = \[from, to\] with from < to, found \[1, 0\]",
    ),
    "surface_is_a_number": (wal("surface = 20.0"), r':19: wall\.0\.surface: expected "rough", "smooth" or a table, found 20'),
    "surface_angle_is_95": (
        wal("surface = { friction_angle = 95.0 }"),
        r":19: wall\.0\.surface\.friction_angle: expected a number in deg, 0 <= x < 90, found 95",
    ),
    "surface_by_coefficient": (
        wal("surface = { friction = 0.4 }"),
        r':19: wall\.0\.surface\.friction: expected a known key, found "friction"',
    ),
    # out of range, not finite, negative
    "spacing_is_0": (key("spacing = 0.1", "spacing = 0.0"), r":5: space\.spacing: expected a number in m, 1e-06 <= x <= 1e\+06, found 0"),
    "spacing_is_nan": (
        key("spacing = 0.1", "spacing = nan"),
        r":5: space\.spacing: expected a number in m, 1e-06 <= x <= 1e\+06, found nan",
    ),
    "spacing_is_infinite": (
        key("spacing = 0.1", "spacing = inf"),
        r":5: space\.spacing: expected a number in m, 1e-06 <= x <= 1e\+06, found inf",
    ),
    "spacing_is_tiny": (
        key("spacing = 0.1", "spacing = 1e-9"),
        r":5: space\.spacing: expected a number in m, 1e-06 <= x <= 1e\+06, found 1e-09",
    ),
    "h_in_metres": (key("h = 1.2", "h = 0.12"), r":6: space\.h: expected a number in spacings, 0\.8 <= x <= 3, found 0\.12"),
    "h_is_nan": (key("h = 1.2", "h = nan"), r":6: space\.h: expected a number in spacings, 0\.8 <= x <= 3, found nan"),
    "h_is_large": (key("h = 1.2", "h = 12"), r":6: space\.h: expected a number in spacings, 0\.8 <= x <= 3, found 12"),
    "end_is_negative": (key("end = 1.0", "end = -1.0"), r":8: time\.end: expected a number in s, x > 0, found -1"),
    "end_is_infinite": (key("end = 1.0", "end = inf"), r":8: time\.end: expected a number in s, x > 0, found inf"),
    "step_is_0": (tim("step = 0.0"), r":9: time\.step: expected a number in s, x > 0, found 0"),
    "step_is_negative": (tim("step = -1.0e-4"), r":9: time\.step: expected a number in s, x > 0, found -0\.0001"),
    "step_is_tiny": (tim("step = 1.0e-20"), r":9: time\.step: expected fewer than 1e12 steps, found 1e\+20; is the step in seconds\?"),
    "cfl_is_0": (acc("cfl = 0.0"), r":22: accuracy\.cfl: expected a number, x > 0, found 0"),
    "cfl_is_negative": (acc("cfl = -0.2"), r":22: accuracy\.cfl: expected a number, x > 0, found -0\.2"),
    "cfl_is_tiny": (
        acc("cfl = 1e-30"),
        r":8: time\.end: expected fewer than 1e12 steps, found 3\.02e\+32 of 3\.32e-33 s; is time\.end in seconds, and young in Pa\? Or is accuracy\.cfl too small",
    ),
    "end_is_an_age": (
        key("end = 1.0", "end = 1e30"),
        r":8: time\.end: expected fewer than 1e12 steps, found 3\.02e\+32 of 0\.00332 s; is time\.end in seconds, and young in Pa\? Or is accuracy\.cfl too small",
    ),
    "density_is_negative": (
        key("density = 1850.0", "density = -1850.0"),
        r":10: soil\.sand\.density: expected a number in kg/m\^3, x > 0, found -1850",
    ),
    "density_is_infinite": (
        key("density = 1850.0", "density = inf"),
        r":10: soil\.sand\.density: expected a number in kg/m\^3, x > 0, found inf",
    ),
    "young_is_negative": (
        key("young = 1.8e6", "young = -1.8e6"),
        r":11: soil\.sand\.young: expected a number in Pa, x > 0, found -1800000",
    ),
    "young_is_0": (key("young = 1.8e6", "young = 0"), r":11: soil\.sand\.young: expected a number in Pa, x > 0, found 0"),
    "young_is_subnormal": (
        key("young = 1.8e6", "young = 1e-320"),
        r":11: soil\.sand\.young: expected a P-wave speed between 1e-6 and 1e12 m/s, found 2\.22e-162 m/s from young = 9\.99989e-321 Pa and density = 1850 kg/m\^3; correct them",
    ),
    "density_is_astronomic": (
        key("density = 1850.0", "density = 1e300"),
        r":11: soil\.sand\.young: expected a P-wave speed between 1e-6 and 1e12 m/s, found 1\.56e-147 m/s from young = 1\.8e\+06 Pa and density = 1e\+300 kg/m\^3; correct them",
    ),
    "poisson_in_percent": (key(P, "poisson = 30"), r":12: soil\.sand\.poisson: expected a number, 0 <= x < 0\.5, found 30"),
    "poisson_is_negative": (key(P, "poisson = -0.1"), r":12: soil\.sand\.poisson: expected a number, 0 <= x < 0\.5, found -0\.1"),
    "friction_is_negative": (
        key("friction_angle = 25.0", "friction_angle = -25.0"),
        r":13: soil\.sand\.friction_angle: expected a number in deg, 0 <= x < 90, found -25",
    ),
    "friction_is_90": (
        key("friction_angle = 25.0", "friction_angle = 90.0"),
        r":13: soil\.sand\.friction_angle: expected a number in deg, 0 <= x < 90, found 90",
    ),
    "dilation_is_negative": (
        soil("dilation_angle = -5.0"),
        r":13: soil\.sand\.dilation_angle: expected a number in deg, 0 <= x < 90, found -5",
    ),
    "dilation_decay_is_negative": (
        soil("dilation_angle = 5.0\ndilation_decay = -0.1"),
        r":14: soil\.sand\.dilation_decay: expected a number, x > 0, found -0\.1",
    ),
    "cutoff_is_negative": (soil("tension_cutoff = -1.0"), r":13: soil\.sand\.tension_cutoff: expected a number in Pa, x >= 0, found -1"),
    "softening_slip_is_0": (
        soil("softening = { friction_angle = 20.0, slip = 0.0 }"),
        r":13: soil\.sand\.softening\.slip: expected a number in m, x > 0, found 0",
    ),
    "softening_slip_is_negative": (
        soil("softening = { friction_angle = 20.0, slip = -0.1 }"),
        r":13: soil\.sand\.softening\.slip: expected a number in m, x > 0, found -0\.1",
    ),
    "softening_angle_is_95": (
        soil("softening = { friction_angle = 95.0, slip = 0.1 }"),
        r":13: soil\.sand\.softening\.friction_angle: expected a number in deg, 0 <= x < 90, found 95",
    ),
    "rate_friction_grain_is_0": (
        soil("rate_friction = { friction_angle = 35.0, grain = 0.0 }"),
        r":13: soil\.sand\.rate_friction\.grain: expected a number in m, x > 0, found 0",
    ),
    "rate_friction_number_is_negative": (
        soil("rate_friction = { friction_angle = 35.0, grain = 0.001, inertial_number = -0.3 }"),
        r":13: soil\.sand\.rate_friction\.inertial_number: expected a number, x > 0, found -0\.3",
    ),
    "rate_friction_angle_is_90": (
        soil("rate_friction = { friction_angle = 90.0, grain = 0.001 }"),
        r":13: soil\.sand\.rate_friction\.friction_angle: expected a number in deg, 0 <= x < 90, found 90",
    ),
    "rate_friction_weightless": (
        soil("rate_friction = { friction_angle = 35.0, grain = 0.001, grain_density = 0.0 }"),
        r":13: soil\.sand\.rate_friction\.grain_density: expected a number in kg/m\^3, x > 0, found 0",
    ),
    "viscosity_is_negative": (
        eff("viscosity = { alpha = -0.1 }"),
        r":21: effects\.viscosity\.alpha: expected a number, 0 <= x <= 10, found -0\.1",
    ),
    "viscosity_is_100": (
        eff("viscosity = { alpha = 100.0 }"),
        r":21: effects\.viscosity\.alpha: expected a number, 0 <= x <= 10, found 100",
    ),
    "artificial_stress_epsilon_is_2": (
        eff("artificial_stress = { epsilon = 2.0 }"),
        r":21: effects\.artificial_stress\.epsilon: expected a number, 0 <= x <= 1, found 2",
    ),
    "artificial_stress_exponent_is_0": (
        eff("artificial_stress = { exponent = 0.0 }"),
        r":21: effects\.artificial_stress\.exponent: expected a number, 0 < x <= 20, found 0",
    ),
    "diffusion_is_negative": (
        eff("stress_diffusion = { zeta = -0.1 }"),
        r":21: effects\.stress_diffusion\.zeta: expected a number, 0 <= x <= 1, found -0\.1",
    ),
    "damping_is_0": (
        eff("damping = { ratio = 0.0, until = 0.5 }"),
        r":21: effects\.damping\.ratio: expected a number of critical, 0 < x <= 10, found 0",
    ),
    "damping_until_0": (
        eff("damping = { ratio = 0.02, until = 0.0 }"),
        r":21: effects\.damping\.until: expected a number in s, x > 0, found 0",
    ),
    "water_is_weightless": (
        eff("pore_pressure = { table = [[0.0, 1.0]], density = 0.0 }"),
        r":21: effects\.pore_pressure\.density: expected a number in kg/m\^3, x > 0, found 0",
    ),
    "water_table_twice": (
        eff("pore_pressure = { table = [[0.0, 1.0], [0.0, 2.0]] }"),
        r":21: effects\.pore_pressure\.table: expected corners with increasing x, found 0 after 0; reorder them",
    ),
    "water_table_is_nan": (
        eff("pore_pressure = { table = [[0.0, nan]] }"),
        r":21: effects\.pore_pressure\.table: expected an array of corners \[x, z\] in m, found nan among them as a corner",
    ),
    "water_without_gravity": (
        [("gravity = [0.0, 0.0, -9.81]", "pore_pressure = { table = [[0.0, 1.0]] }")],
        r":20: effects\.pore_pressure: expected gravity along -z with still water",
    ),
    "gravity_is_infinite": (
        key("[0.0, 0.0, -9.81]", "[0.0, 0.0, -inf]"),
        r":20: effects\.gravity: expected three numbers \[x, y, z\] in m/s\^2, found -inf among them",
    ),
    "gravity_is_huge": (
        key("[0.0, 0.0, -9.81]", "[0.0, 0.0, -9.81e9]"),
        r":20: effects\.gravity: expected three numbers \[x, y, z\] in m/s\^2, found -9810000000 among them, outside -1e\+06 <= x <= 1e\+06",
    ),
    "velocity_is_nan": (
        bod("velocity = [nan, 0.0, 0.0]"),
        r":16: body\.0\.velocity: expected three numbers \[x, y, z\] in m/s, found nan among them",
    ),
    "velocity_is_huge": (
        bod("velocity = [1e9, 0.0, 0.0]"),
        r":16: body\.0\.velocity: expected three numbers \[x, y, z\] in m/s, found 1000000000 among them, outside -1e\+06 <= x <= 1e\+06",
    ),
    "low_is_nan": (
        spa("low = [nan, -1.0, -1.0]\nhigh = [2.0, 2.0, 2.0]"),
        r":7: space\.low: expected three numbers \[x, y, z\] in m, found nan among them",
    ),
    "skin_is_0": (acc("skin = 0.0"), r":22: accuracy\.skin: expected a number in supports, 0\.01 <= x <= 0\.5, found 0"),
    "every_is_0": (out("every = 0.0"), r":23: output\.every: expected a number in s, x > 0, found 0"),
    "every_is_negative": (out("every = -0.05"), r":23: output\.every: expected a number in s, x > 0, found -0\.05"),
    "history_is_0": (out("history = 0"), r":23: output\.history: expected a number in s, x > 0, found 0"),
    "checkpoint_is_never": (out("checkpoint_minutes = 0"), r":23: output\.checkpoint_minutes: expected a number in min, x > 0, found 0"),
    "grain_is_negative": (out("grain = -0.04"), r":23: output\.grain: expected a number in m, x > 0, found -0\.04"),
    "sphere_radius_is_negative": (
        shape("sphere = { center = [0.0, 0.0, 2.0], radius = -1.0 }"),
        r":16: body\.0\.sphere\.radius: expected a number in m, 0 < x <= 1e\+09, found -1",
    ),
    "cylinder_height_is_0": (
        shape("cylinder = { base = [0.0, 0.0, 1.0], radius = 0.5, height = 0.0 }"),
        r":16: body\.0\.cylinder\.height: expected a number in m, 0 < x <= 1e\+09, found 0",
    ),
    "sphere_radius_is_infinite": (
        shape("sphere = { center = [0.0, 0.0, 2.0], radius = inf }"),
        r":16: body\.0\.sphere\.radius: expected a number in m, 0 < x <= 1e\+09, found inf",
    ),
    # contradictions
    "high_without_low": (
        spa("high = [2.0, 2.0, 2.0]"),
        r":7: space\.high: expected space\.low and space\.high together, found only space\.high",
    ),
    "box_is_flat": (
        shape("box = { low = [0.0, 0.0, 0.0], high = [1.0, 1.0, 0.0] }"),
        r":16: body\.0\.box: expected low < high along z, found 0 and 0",
    ),
    "box_is_thinner_than_a_particle": (
        shape("box = { low = [0.0, 0.0, 0.0], high = [1.0, 1.0, 0.01] }"),
        r":16: body\.0\.box: expected a whole number of spacings \(0\.1 m\) a side, found 0\.1 along z",
    ),
    "box_in_millimetres": (
        shape("box = { low = [0.0, 0.0, 0.0], high = [1234.56, 1000.0, 1000.0] }"),
        r":16: body\.0\.box: expected a whole number of spacings \(0\.1 m\) a side, found 12345\.6 along x",
    ),
    "dilation_of_clay": (
        [("friction_angle = 25.0", "cohesion = 1e3\ndilation_angle = 5.0")],
        r":14: soil\.sand\.dilation_angle: expected at most the friction angle, found 5 deg > 0 deg; with more, plastic flow would create energy",
    ),
    "dry_cutoff": (
        soil("tension_cutoff = 100.0"),
        r""":13: soil\.sand\.tension_cutoff: expected at most the cone's apex c cot\(phi\) = 0 Pa, found 100 Pa; lower it or leave it out""",
    ),
    "at_rest_upwards": (
        bod('stress = "at rest"') + [("[0.0, 0.0, -9.81]", "[0.0, 0.0, 9.81]")],
        r':16: body\.0\.stress: expected gravity that points down for a stress "at rest", found \[0, 0, 9\.81\]',
    ),
    "body_twice": (
        [("[[wall]]", '[[body]]\nsoil = "sand"\n' + BOX + "\n[[wall]]")],
        r":17: body\.1: expected shapes that at most touch, found an overlap of body\.1 with body\.0 by 1 m",
    ),
    "walls_overlap": (
        [("[effects]", "[[wall]]\nbox = { low = [1.9, -1.0, -0.4], high = [2.3, 2.0, 1.0] }\n[effects]")],
        r":19: wall\.1: expected shapes that at most touch, found an overlap of wall\.1 with wall\.0 by 0\.1 m",
    ),
    "cylinder_in_wall": (
        shape("cylinder = { base = [0.5, 0.5, -0.1], radius = 0.4, height = 1.0 }"),
        r":17: wall\.0: expected shapes that at most touch, found an overlap of wall\.0 with body\.0",
    ),
    "polygon_in_polygon": (
        [
            (BOX, "polygon = { points = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]], y = [0.0, 1.0] }"),
            ("[[wall]]", '[[body]]\nsoil = "sand"\npolygon = { points = [[0.1, 0.1], [0.5, 0.1], [0.1, 0.5]], y = [0.0, 1.0] }\n[[wall]]'),
        ],
        r":17: body\.1: expected shapes that at most touch, found an overlap of body\.1 with body\.0",
    ),
    "wall_beyond_period": (
        spa('periodic = ["x"]\nlow = [-0.5, -1.0, -1.0]\nhigh = [1.5, 2.0, 2.0]'),
        r":21: wall\.0\.box: expected it inside space\.low \.\. space\.high = -0\.5 \.\. 1\.5 m along x, found -1 \.\. 2 m",
    ),
    "body_beyond_period": (
        spa('periodic = ["y"]\nlow = [-1.0, 0.5, -1.0]\nhigh = [2.0, 2.5, 2.0]'),
        r":19: body\.0\.box: expected it inside space\.low \.\. space\.high = 0\.5 \.\. 2\.5 m along y, found 0 \.\. 1 m",
    ),
    "flat_tilted_water": (
        [
            ("dimensions = 3", "dimensions = 2"),
            ("[accuracy]", "pore_pressure = { table = [[0.0, 1.0]] }\n[accuracy]"),
            ("[0.0, 0.0, -9.81]", "[5.0, 0.0, -8.4]"),
        ],
        r":21: effects\.pore_pressure: expected gravity along -z with still water",
    ),
    "second_soil_misspelt": (
        [
            (
                "[[body]]",
                '[soil.clay]\ndensity = 1700.0\nyoung = 5e6\npoisson = 0.4\ncohesion = 2e4\n[[body]]\nsoil = "caly"\nbox = { low = [1.0, 0.0, 0.0], high = [2.0, 1.0, 1.0] }\n[[body]]',
            )
        ],
        r':20: body\.0\.soil: expected the name of a soil, found "caly"',
    ),
    # gigantic
    "sphere_huge": (
        key("spacing = 0.1", "spacing = 1e-4") + shape("sphere = { center = [0.0, 0.0, 2e3], radius = 1e3 }"),
        r":16: body\.0\.sphere: expected a shape that a computer can hold, found 8e\+21 particles at a spacing of 0\.0001 m; is space\.spacing in metres\?",
    ),
    "spheres_huge_together": (
        [
            ("spacing = 0.1", "spacing = 1e-3"),
            (BOX, "sphere = { center = [0.0, 0.0, 4.0], radius = 1.9 }"),
            ("[[wall]]", '[[body]]\nsoil = "sand"\nsphere = { center = [0.0, 0.0, 9.0], radius = 1.9 }\n[[wall]]'),
        ],
        r":19: body\.1\.sphere: expected shapes that a computer can hold together, found 2\.89e\+07 rows of particles up to this one at a spacing of 0\.001 m; is space\.spacing in metres\?",
    ),
    "polygon_along_a_row": (
        [FLAT] + shape("polygon = { points = [[0.0, 0.05], [9e8, 0.05], [9e8, 1.05]] }"),
        r":16: body\.0\.polygon: expected a polygon that can be filled in a minute, found 3 corners and 9e\+09 particles next to its edges at a spacing of 0\.1 m; leave out corners, or is space\.spacing in metres\?",
    ),
    "wall_huge": (
        [("[-1.0, -1.0, -0.4], high = [2.0, 2.0, 0.0]", "[-1e8, -1e8, -0.4], high = [1e8, 1e8, 0.0]")],
        r":18: wall\.0\.box: expected a shape that a computer can hold, found 1\.6e\+19 particles at a spacing of 0\.1 m; is space\.spacing in metres\?",
    ),
    "steps_without_number": (
        tim("step = 1e-13"),
        r":9: time\.step: expected fewer than 1e12 steps, found 1e\+13; is the step in seconds\?",
    ),
}
# Accepted, but hardly meant: units off by 1e3, degrees and radians, what changes nothing.
DOUBTFUL = {
    "density_in_tonnes": (
        key("density = 1850.0", "density = 1.85"),
        r"""soil\.sand\.density: 1\.85 kg/m\^3 is no soil's density \(100 \.\. 20000\): is it in other units\? Then write 1850""",
    ),
    "density_in_grams": (
        key("density = 1850.0", "density = 1.85e6"),
        r"""soil\.sand\.density: 1\.85e\+06 kg/m\^3 is no soil's density \(100 \.\. 20000\): is it in other units\? Then write 1850""",
    ),
    "young_in_megapascal": (
        key("young = 1.8e6", "young = 1.8"),
        r"soil\.sand\.young: with 1\.8 Pa the P-wave runs at 0\.0362 m/s, in soils and rocks at 30 \.\. 6000 m/s: young is in Pa \(1 MPa = 1e6, 1 kPa = 1e3\)",
    ),
    "young_in_kilopascal": (
        key("young = 1.8e6", "young = 1800.0"),
        r"soil\.sand\.young: with 1800 Pa the P-wave runs at 1\.14 m/s, in soils and rocks at 30 \.\. 6000 m/s: young is in Pa \(1 MPa = 1e6, 1 kPa = 1e3\)",
    ),
    "young_too_much": (
        key("young = 1.8e6", "young = 1.8e12"),
        r"soil\.sand\.young: with 1\.8e\+12 Pa the P-wave runs at 3\.62e\+04 m/s, in soils and rocks at 30 \.\. 6000 m/s: young is in Pa \(1 MPa = 1e6, 1 kPa = 1e3\)",
    ),
    "friction_in_radians": (
        key("friction_angle = 25.0", "friction_angle = 0.436"),
        r"soil\.sand\.friction_angle: 0\.436 deg is nearly no friction: angles are in degrees \(is it 24\.98 deg\?\)",
    ),
    "gravity_upwards": (
        key("[0.0, 0.0, -9.81]", "[0.0, 0.0, 9.81]"),
        r"effects\.gravity: it points up \(9\.81 m/s\^2 along z, which is up\): write a minus",
    ),
    "gravity_in_centimetres_and_more": (
        key("[0.0, 0.0, -9.81]", "[0.0, 0.0, -9810.0]"),
        r"effects\.gravity: 9810 m/s\^2 is more than any centrifuge reaches: it is in m/s\^2",
    ),
    "no_gravity": (
        key("gravity = [0.0, 0.0, -9.81]", ""),
        r"effects\.gravity: there is no gravity and every body rests: nothing will move; write gravity = \[0\.0, 0\.0, -9\.81\]",
    ),
    "no_wall": (
        [("[[wall]]\nbox = { low = [-1.0, -1.0, -0.4], high = [2.0, 2.0, 0.0] }\n", "")],
        r"wall: there is gravity and no wall: all soil falls without end; write a \[\[wall\]\] below it",
    ),
    "every_beyond_the_end": (
        out("every = 5.0"),
        r"output\.every: 5 s is longer than the run \(1 s\): only the first and the last snapshot are written",
    ),
    "history_beyond_the_end": (
        out("history = 5.0"),
        r"output\.history: 5 s is longer than the run \(1 s\): only the first and the last row are written",
    ),
    "every_below_a_step": (
        out("every = 1e-7"),
        r"output\.every: 1e-07 s is shorter than a step \(0\.00332 s\): every step writes a snapshot, 302 of them",
    ),
    "history_below_a_step": (
        out("history = 1e-7"),
        r"output\.history: 1e-07 s is shorter than a step \(0\.00332 s\): every step writes a row, 302 of them",
    ),
    "cohesion_above_young": (
        soil("cohesion = 5.0e6"),
        r"soil\.sand\.cohesion: 5e\+06 Pa is more than a tenth of young = 1\.8e\+06 Pa, where soils fail at strains of a percent: both are in Pa",
    ),
    "poisson_near_half": (
        key(P, "poisson = 0.4999"),
        r"soil\.sand\.poisson: at 0\.4999 the soil is nearly incompressible: its bulk modulus is 5000 times the shear modulus and shortens the step as its root; 0\.49 is enough for undrained clay",
    ),
    "velocity_in_kilometres": (
        bod("velocity = [500.0, 0.0, 0.0]"),
        r"mach: the soil may move at 13\.82 of its P-wave speed: raise young, or read impacts with care",
    ),
    "dilation_without_end": (
        soil("dilation_angle = 5.0"),
        r"soil\.sand\.dilation_angle: a constant dilation angle lets sheared soil swell without end: read long run-outs with care",
    ),
    "damping_beyond_the_end": (
        eff("damping = { ratio = 0.02, until = 5.0 }"),
        r"effects\.damping\.until: damping lasts beyond the end of the run \(5 s > 1 s\)",
    ),
    "wall_of_one_layer": (
        [("-0.4], high", "-0.1], high")],
        r"wall\.0: the wall is 0\.1 m thick, thinner than the support of 0\.24 m: soil at its face feels only a part of it; make it 3 spacings thick",
    ),
    "water_of_grams": (
        eff("pore_pressure = { table = [[0.0, 1.0]], density = 1.0 }"),
        r"""effects\.pore_pressure\.density: 1 kg/m\^3 is no water's density: water has 1000""",
    ),
    "slow_motion": (key("end = 1.0", "end = 1.0e6"), r"time\.end: 1e\+06 s are 3\.02e\+08 steps of 0\.00332 s: times are in seconds"),
    "grain_above_the_heap": (
        out("grain = 4.0"),
        r"output\.grain: no column of soil is 4 m high, all of it 1 m: fronts in history\.csv will be empty",
    ),
    "rate_friction_of_boulders": (
        soil("rate_friction = { friction_angle = 35.0, grain = 5.0 }"),
        r"soil\.sand\.rate_friction\.grain: grains of 5 m are larger than the particles they make up, 0\.1 m apart: it is in m",
    ),
    "softening_at_once": (
        soil("softening = { friction_angle = 20.0, slip = 1e-9 }"),
        r"soil\.sand\.softening\.slip: a slip of 1e-09 m is nothing against the width of a shear band here, 0\.24 m: strength is lost at once; it is in m",
    ),
    "mass_of_a_wedge": (
        shape("polygon = { points = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]], y = [0.0, 1.0] }"),
        r"body\.0\.polygon: its particles hold 10 % less mass than its volume would: lattice points and faces do not fit",
    ),
    "compression_cone_in_2d": (
        [FLAT],
        r"soil\.sand\.cone: in plane strain the compression cone acts like a friction angle of 29\.6 deg on a rough bed \(atan 3 alpha\) and 34\.6 deg by its stress circle \(asin 3 alpha\) instead of 25",
    ),
}


def write(name, marker, cases):
    folder = pathlib.Path(__file__).parent / name
    folder.mkdir(exist_ok=True)
    for old in folder.glob("*.toml"):
        old.unlink()
    for case, (edits, expected) in cases.items():
        text = edits if isinstance(edits, str) else GOOD
        for before, after in edits if not isinstance(edits, str) else ():
            assert before in text, (case, before)
            text = text.replace(before, after, 1)
        # Half a surrogate stands for a byte that is no UTF-8.
        (folder / f"{case}.toml").write_bytes(f"# {marker}: {expected}\n{text}".encode("utf-8", "surrogateescape"))


def main():
    write("bad", "expect", CASES)
    write("doubtful", "warns", DOUBTFUL)


if __name__ == "__main__":
    main()
