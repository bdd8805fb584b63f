#pragma once
// What a scene file says, once: every key stands here beside the member it is read into, with its unit, range, default,
// example and words. Reader, writer, hash, table of keys, reference and JSON Schema are visitors A of describe().
// Beyond 400 lines: one table, one entry a key.
// A key is needed unless it has a fallback, is optional or is read into a std::optional.
#include "io/scene_keys.hpp"
#include "solver/scene/scene.hpp"
#include "solver/scene/uncertain.hpp"
#include <numbers>
#include <string>

namespace kuzure::io {

/// Angles are degrees in files, radians in scenes.
inline const double radians_per_degree = std::numbers::pi / 180;

/// What there is to know of a key beside its path and kind.
struct KeyInfo {
    const char* unit = ""; // "1": a plain number; "of ...": a share of that
    Range range{};
    const char* fallback = ""; // the default as TOML; of what presets set, presets() has it
    bool optional = false;     // may be absent though its member always has a value
    const char* example = "";  // a value as TOML
    const char* doc = "";
    Role role = Role::Physics; // of a section: of all its keys
};

// m; beyond it the number is not meant in metres
constexpr Range coordinate = between(-1e9, 1e9), size = above_to(0, 1e9);

template <class A> void describe_box(A& a, const std::string& p, scene::Box& box)
{
    a.vector(p + ".low", box.low, {.unit = "m", .range = coordinate, .example = "[0.0, 0.0, 0.0]", .doc = "lower corner"});
    a.vector(p + ".high", box.high, {.unit = "m", .range = coordinate, .example = "[1.0, 1.0, 1.0]", .doc = "upper corner"});
}

template <class A> void describe_shape(A& a, const std::string& path, scene::Shape& shape)
{
    a.template alternative<scene::Box>(
        path + ".box", shape, {.example = "{ low = [0.0, 0.0, 0.0], high = [1.0, 1.0, 1.0] }", .doc = "a box of whole spacings a side"},
        [&](const std::string& p, auto& s) { describe_box(a, p, s); });
    a.template alternative<scene::Cylinder>(
        path + ".cylinder", shape,
        {.example = "{ base = [0.0, 0.0, 0.0], radius = 0.1, height = 0.2 }", .doc = "an upright cylinder (3-D)"},
        [&](const std::string& p, auto& s) {
            a.vector(p + ".base", s.base,
                     {.unit = "m", .range = coordinate, .example = "[0.0, 0.0, 0.0]", .doc = "centre of its lower face"});
            a.number(p + ".radius", s.radius, {.unit = "m", .range = size, .example = "0.1", .doc = "radius"});
            a.number(p + ".height", s.height, {.unit = "m", .range = size, .example = "0.2", .doc = "height along z"});
        });
    a.template alternative<scene::Sphere>(
        path + ".sphere", shape, {.example = "{ center = [0.0, 0.0, 0.0], radius = 0.1 }", .doc = "a sphere, in 2-D a disc"},
        [&](const std::string& p, auto& s) {
            a.vector(p + ".center", s.center, {.unit = "m", .range = coordinate, .example = "[0.0, 0.0, 0.0]", .doc = "centre"});
            a.number(p + ".radius", s.radius, {.unit = "m", .range = size, .example = "0.1", .doc = "radius"});
        });
    a.template alternative<scene::Polygon>(
        path + ".polygon", shape,
        {.example = "{ points = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]], y = [0.0, 1.0] }", .doc = "a polygon in x-z, drawn out along y"},
        [&](const std::string& p, auto& s) {
            a.points(p + ".points", s.points,
                     {.unit = "m",
                      .range = coordinate,
                      .example = "[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]",
                      .doc = "its corners [x, z] in order"});
            a.pair(p + ".y", s.y,
                   {.unit = "m",
                    .range = coordinate,
                    .optional = true,
                    .example = "[0.0, 1.0]",
                    .doc = "its extent along y; needed in 3-D, left out in 2-D"});
        });
}

/// Soil that lies on real ground within an outline.
template <class A> void describe_release(A& a, const std::string& path, scene::Shape& shape)
{
    const auto file = [](const char* example, const char* doc) {
        return KeyInfo{.optional = true, .example = example, .doc = doc, .role = Role::Bookkeeping}; // its content counts
    };
    a.template alternative<scene::Release>(
        path + ".release", shape,
        {.example = "{ outline = \"scar.shp\", thickness = 4.5 }",
         .doc = "the mass that fails on the ground of [terrain]: one of thickness, thickness_map, surface, or before and after "
                "(docs/terrain.md)"},
        [&](const std::string& p, auto& s) {
            a.text(p + ".outline", s.outline,
                   file("\"scar.shp\"", "polygons of a .shp or GeoJSON; their attribute \"thickness\" (m) counts where no other is named"));
            a.number(p + ".thickness", s.thickness,
                     {.unit = "m", .range = size, .example = "4.5", .doc = "thickness along z, everywhere the same"});
            a.text(p + ".thickness_map", s.thickness_map, file("\"thickness.tif\"", "raster of thicknesses along z in m"));
            a.text(p + ".surface", s.surface,
                   file("\"slip.tif\"", "raster of the slip surface: the mass is what the elevation model has above it"));
            a.text(p + ".before", s.before, file("\"before.tif\"", "elevation model before the failure, together with after"));
            a.text(p + ".after", s.after, file("\"after.tif\"", "elevation model after it, which becomes the bed"));
            a.flag(p + ".on_top", s.on_top,
                   {.fallback = "false",
                    .example = "true",
                    .doc = "with thickness or thickness_map: the elevation model is the bed and the mass lies on it; else its top"});
        });
}

template <class A> void describe_terrain(A& a, std::optional<scene::Terrain>& terrain)
{
    a.part("terrain", terrain,
           {.example = "{ dem = \"dem.tif\", friction = 24.0 }",
            .doc = "real ground from elevation models, a wall of its own (docs/terrain.md)"},
           [&](const std::string& p, auto& t) {
               a.files(p + ".dem", t.dem,
                       {.example = "\"dem.tif\"",
                        .doc = "elevation models (GeoTIFF, ESRI ASCII, GSI's .xml or .zip); of several a later one fills what earlier ones "
                               "leave open",
                        .role = Role::Bookkeeping});
               a.text(p + ".crs", t.crs,
                      {.optional = true,
                       .example = "\"EPSG:6670\"",
                       .doc = "system of the map, in metres; needed where the files name none, or degrees",
                       .role = Role::Bookkeeping});
               a.window(p + ".window", t.window,
                        {.unit = "m",
                         .range = coordinate,
                         .example = "[-2000.0, 11000.0, -500.0, 13000.0]",
                         .doc = "part of the map that is read, in its coordinates; without it what releases can reach (11 degrees)"});
               a.choice(p + ".surface", t.surface,
                        {{"coulomb", scene::Surface::Coulomb}, {"rough", scene::Surface::Rough}, {"smooth", scene::Surface::Smooth}},
                        {.fallback = "\"coulomb\"",
                         .example = "\"rough\"",
                         .doc = "\"coulomb\": slips against friction, \"rough\": no slip, \"smooth\": free slip"});
               a.angle(p + ".friction", t.friction_angle,
                       {.unit = "deg",
                        .range = {.low = 0, .high = 90, .low_open = true, .high_open = true},
                        .optional = true,
                        .example = "24.0",
                        .doc = "Coulomb friction of the ground; needed unless surface is \"rough\" or \"smooth\", or friction_map says it "
                               "everywhere"});
               a.text(p + ".friction_map", t.friction_map,
                      {.optional = true,
                       .example = "\"friction.tif\"",
                       .doc = "raster of such angles in degrees; where it has none friction counts",
                       .role = Role::Bookkeeping});
               a.number(p + ".xi", t.xi,
                        {.unit = "m/s^2",
                         .range = above_to(0, 1e6),
                         .optional = true,
                         .example = "500.0",
                         .doc = "Voellmy's drag: beside Coulomb's friction a traction of rho g v^2/xi; without it none"});
               a.choice(p + ".edge", t.edge, {{"open", scene::Edge::Open}, {"closed", scene::Edge::Closed}},
                        {.fallback = "\"open\"",
                         .example = "\"closed\"",
                         .doc = "\"open\": soil that leaves the ground is counted and taken out; \"closed\": it ends the run (exit 3)"});
               a.choice(p + ".lattice", t.lattice, {{"draped", scene::GroundLattice::Draped}, {"plain", scene::GroundLattice::Plain}},
                        {.fallback = "\"draped\"",
                         .example = "\"plain\"",
                         .doc =
                             "wall particles of the ground: \"draped\" along its surface, with no stairs; \"plain\": on the cubic lattice, "
                             "for ground steeper than 55 degrees, where draped columns stand too far apart"});
           });
}

inline Words<scene::Cone> cone_words()
{
    return {{"compression", scene::Cone::Compression},
            {"extension", scene::Cone::Extension},
            {"plane strain", scene::Cone::PlaneStrain},
            {"plane strain, no dilation", scene::Cone::PlaneStrainNoDilation},
            {"shear", scene::Cone::Shear}};
}
/// Of a body or wall.
inline KeyInfo name_info(const char* example)
{
    return {
        .optional = true, .example = example, .doc = "its name in events, forces, probes and messages; no other wall, body or load has it"};
}

/// What changes a soil's strength as it yields.
template <class A> void describe_laws(A& a, const std::string& path, scene::Soil& soil)
{
    a.number(path + ".dilation_decay", soil.dilation_decay,
             {.unit = "1",
              .range = above(0),
              .example = "0.1",
              .doc = "plastic shear strain over which dilation dies out linearly; without it dilation stays"});
    a.table(path + ".softening", soil.softening,
            {.example = "{ friction_angle = 20.0, slip = 0.02 }", .doc = "strength falls linearly to a residual one"},
            [&](const std::string& p, auto& v) {
                a.number(
                    p + ".cohesion", v.cohesion,
                    {.unit = "Pa", .range = from(0), .fallback = "0.0", .example = "0.0", .doc = "residual cohesion, at most the first"});
                a.angle(p + ".friction_angle", v.friction_angle,
                        {.unit = "deg",
                         .range = from_below(0, 90),
                         .fallback = "0.0",
                         .example = "20.0",
                         .doc = "residual friction angle, at most the first"});
                a.number(p + ".slip", v.slip,
                         {.unit = "m",
                          .range = above(0),
                          .example = "0.02",
                          .doc = "slip across a shear band (taken 2 h wide) at which the residual strength is reached"});
            });
    a.table(path + ".rate_friction", soil.rate_friction,
            {.example = "{ friction_angle = 33.0, inertial_number = 0.3, grain = 0.001, grain_density = 2600.0 }",
             .doc = "mu(I): friction grows with the rate of shear"},
            [&](const std::string& p, auto& v) {
                a.angle(p + ".friction_angle", v.friction_angle,
                        {.unit = "deg",
                         .range = from_below(0, 90),
                         .example = "33.0",
                         .doc = "friction angle of fast flow, at least that at rest"});
                a.number(
                    p + ".inertial_number", v.inertial_number,
                    {.unit = "1", .range = above(0), .fallback = "0.3", .example = "0.3", .doc = "I_0, where half the growth is reached"});
                a.number(p + ".grain", v.grain, {.unit = "m", .range = above(0), .example = "0.001", .doc = "diameter of a grain"});
                a.number(p + ".grain_density", v.grain_density,
                         {.unit = "kg/m^3", .range = above(0), .fallback = "2600.0", .example = "2600.0", .doc = "density of a grain"});
            });
}

template <class A> void describe_soil(A& a, const std::string& path, scene::Soil& soil)
{
    a.number(path + ".density", soil.density,
             {.unit = "kg/m^3", .range = above(0), .example = "1850.0", .doc = "bulk density at the start"});
    a.number(path + ".young", soil.young, {.unit = "Pa", .range = above(0), .example = "1.8e6", .doc = "Young's modulus"});
    a.number(path + ".poisson", soil.poisson, {.unit = "1", .range = from_below(0, 0.5), .example = "0.3", .doc = "Poisson's ratio"});
    a.number(path + ".cohesion", soil.cohesion,
             {.unit = "Pa", .range = from(0), .fallback = "0.0", .example = "5000.0", .doc = "cohesion c"});
    a.angle(path + ".friction_angle", soil.friction_angle,
            {.unit = "deg", .range = from_below(0, 90), .fallback = "0.0", .example = "25.0", .doc = "friction angle phi"});
    a.angle(path + ".dilation_angle", soil.dilation_angle,
            {.unit = "deg", .range = from_below(0, 90), .fallback = "0.0", .example = "0.0", .doc = "dilation angle psi, at most phi"});
    a.choice(path + ".cone", soil.cone, cone_words(),
             {.fallback = "\"compression\"",
              .example = "\"compression\"",
              .doc = "how the Drucker-Prager cone is fitted to c and phi (docs/theory.md)"});
    a.choice(path + ".opened_volume", soil.opened_volume,
             {{"kept", scene::OpenedVolume::Kept}, {"forgotten", scene::OpenedVolume::Forgotten}},
             {.fallback = "\"kept\"",
              .example = "\"kept\"",
              .doc = "\"kept\": soil torn open bears no pressure until the opened volume is closed; \"forgotten\": at once, as published"});
    a.number(path + ".tension_cutoff", soil.tension_cutoff,
             {.unit = "Pa", .range = from(0), .example = "1000.0", .doc = "largest mean tension, at most the cone's apex c cot(phi)"});
    describe_laws(a, path, soil);
}

template <class A> void describe_effects(A& a, scene::Effects& effects)
{
    a.section("effects", {.fallback = "{}",
                          .example = "{ gravity = [0.0, 0.0, -9.81] }",
                          .doc = "what is simulated beyond the soil itself: only what is written"});
    a.vector("effects.gravity", effects.gravity,
             {.unit = "m/s^2", .range = between(-1e6, 1e6), .example = "[0.0, 0.0, -9.81]", .doc = "body force per mass"});
    a.table("effects.viscosity", effects.viscosity,
            {.example = "{ alpha = 0.1, beta = 0.0 }", .doc = "artificial viscosity against the P-wave speed"},
            [&](const std::string& p, auto& v) {
                a.number(p + ".alpha", v.alpha, {.unit = "1", .range = between(0, 10), .example = "0.1", .doc = "linear part"});
                a.number(p + ".beta", v.beta,
                         {.unit = "1", .range = between(0, 10), .fallback = "0.0", .example = "0.0", .doc = "quadratic part"});
            });
    a.automatic(
        "effects.artificial_stress", effects.artificial_stress, effects.artificial_stress_decision,
        {.example = "\"auto\"", .doc = "against tensile instability; \"auto\" is on exactly where tension can exist"},
        [&](const std::string& p, auto& v) {
            a.number(
                p + ".epsilon", v.epsilon,
                {.unit = "1", .range = between(0, 1), .fallback = "0.5", .example = "0.5", .doc = "share of the tensile principal stress"});
            a.number(
                p + ".exponent", v.exponent,
                {.unit = "1", .range = above_to(0, 20), .fallback = "2.55", .example = "2.55", .doc = "exponent n of W(r)/W(spacing)"});
        });
    a.automatic("effects.stress_diffusion", effects.stress_diffusion, effects.stress_diffusion_decision,
                {.example = "{ zeta = 0.1 }",
                 .doc = "against noise in the stress; \"auto\" is on for one dry soil in boxes or cylinders under vertical gravity"},
                [&](const std::string& p, auto& v) {
                    a.number(p + ".zeta", v.zeta,
                             {.unit = "1", .range = between(0, 1), .fallback = "0.1", .example = "0.1", .doc = "strength"});
                });
    a.table("effects.pore_pressure", effects.pore_pressure,
            {.example = "{ table = [[0.0, 4.0], [20.0, 1.0]] }",
             .doc = "still pore water: buoyancy and seepage of a given water table; stresses are then effective"},
            [&](const std::string& p, auto& v) {
                a.points(
                    p + ".table", v.table,
                    {.unit = "m", .range = coordinate, .example = "[[0.0, 4.0], [20.0, 1.0]]", .doc = "its corners [x, z], x increasing"});
                a.number(p + ".density", v.density,
                         {.unit = "kg/m^3", .range = above(0), .fallback = "1000.0", .example = "1000.0", .doc = "density of the water"});
            });
    a.table("effects.damping", effects.damping,
            {.example = "{ ratio = 0.02, until = 0.5 }", .doc = "viscous damping to settle an initial state"},
            [&](const std::string& p, auto& v) {
                a.number(p + ".ratio", v.ratio, {.unit = "of critical", .range = above_to(0, 10), .example = "0.02", .doc = "strength"});
                a.number(p + ".until", v.until,
                         {.unit = "s", .range = above(0), .example = "0.5", .doc = "time at which it is switched off"});
            });
}

template <class A> void describe_accuracy(A& a, scene::Accuracy& accuracy)
{
    a.section("accuracy", {.fallback = "{}", .example = "{ cfl = 0.5 }", .doc = "everything that trades error for time"});
    a.choice("accuracy.preset", accuracy.preset, preset_words(),
             {.fallback = "\"standard\"",
              .example = "\"fast\"",
              .doc = "sets the keys of this section and space.h that are not written (docs/accuracy.md)",
              .role = Role::Bookkeeping});
    a.choice("accuracy.kernel", accuracy.kernel,
             {{"cubic spline", scene::Kernel::CubicSpline},
              {"wendland c2", scene::Kernel::WendlandC2},
              {"wendland c4", scene::Kernel::WendlandC4}},
             {.example = "\"wendland c2\"", .doc = "smoothing kernel"});
    a.choice("accuracy.kernel_norm", accuracy.kernel_norm,
             {{"lattice", scene::KernelNorm::Lattice}, {"continuum", scene::KernelNorm::Continuum}},
             {.example = "\"lattice\"",
              .doc = "gradients of linear fields are exact for particles on their lattice, or for infinitely many, as published"});
    a.number("accuracy.cfl", accuracy.cfl,
             {.unit = "1", .range = above(0), .example = "1.0", .doc = "Courant number dt c_p/h of the step where time.step is absent"});
    a.choice("accuracy.scheme", accuracy.scheme, {{"staggered", scene::Scheme::Staggered}, {"leap-frog", scene::Scheme::LeapFrog}},
             {.example = "\"staggered\"",
              .doc = "\"staggered\": two passes a step, stable to dt c_p/h of about 1.8; \"leap-frog\": Bui's (2008) one pass, to 0.3"});
    a.choice("accuracy.precision", accuracy.precision, {{"double", scene::Precision::Double}, {"mixed", scene::Precision::Mixed}},
             {.example = "\"double\"", .doc = "\"mixed\": pair sums in single, state in double precision"});
    a.choice("accuracy.correction", accuracy.correction,
             {{"none", scene::Correction::None}, {"gradient", scene::Correction::Gradient}, {"adjoint", scene::Correction::Adjoint}},
             {.example = "\"none\"",
              .doc = "\"gradient\": velocity gradients exact for linear fields, also at surfaces; \"adjoint\": pair forces by the same "
                     "gradients too, so that energy is kept: for soil that holds together"});
    a.number("accuracy.shifting", accuracy.shifting,
             {.unit = "1",
              .range = between(0, 3),
              .fallback = "0.0",
              .example = "1.0",
              .doc = "particles that shear plastically are shifted towards even spacing, by this constant (docs/theory.md); 0: not"});
    a.number("accuracy.hourglass", accuracy.hourglass,
             {.unit = "1",
              .range = between(0, 0.5),
              .fallback = "0.0",
              .example = "0.1",
              .doc = "motion of neighbours that no velocity gradient tells of is damped in soil that does not yield, by this strength "
                     "(docs/theory.md); 0: not"});
    a.number("accuracy.skin", accuracy.skin,
             {.unit = "supports",
              .range = between(0.01, 0.5),
              .example = "0.1",
              .doc = "reach of neighbour lists beyond the support: cost only"});
    a.number("accuracy.sleep_below", accuracy.sleep_below,
             {.unit = "m/s",
              .range = from(0),
              .fallback = "0.0",
              .example = "0.001",
              .doc = "soil slower than this, and not about to move, among soil that is too, keeps its state until it is looked at again "
                     "(docs/performance.md); 0: never"});
}

template <class A> void describe_output(A& a, scene::Output& output)
{
    a.section("output",
              {.fallback = "{}", .example = "{ every = 0.05 }", .doc = "what a run leaves in its directory", .role = Role::Bookkeeping});
    a.text("output.directory", output.directory,
           {.optional = true, .example = "\"results/seed-52\"", .doc = "result directory; without it results/<scene file's name>"});
    a.number("output.every", output.every,
             {.unit = "s", .range = above(0), .example = "0.05", .doc = "time between snapshots; without it the first and the last state"});
    a.choices("output.fields", output.fields, {"velocity", "stress", "density", "plastic_strain", "displacement"},
              {.fallback = R"(["velocity", "stress", "density", "plastic_strain", "displacement"])",
               .example = "[\"velocity\", \"stress\"]",
               .doc = "fields of snapshots beside position, id, kind and soil; what colours the pictures is kept too"});
    a.number("output.history", output.history,
             {.unit = "s",
              .range = above(0),
              .example = "0.001",
              .doc = "time between rows of history.csv; without it the first and the last state"});
    a.number("output.grain", output.grain,
             {.unit = "m",
              .range = above(0),
              .example = "0.04",
              .doc = "height from which a column counts as soil in history.csv; without it one spacing"});
    a.number("output.checkpoint_minutes", output.checkpoint_minutes,
             {.unit = "min", .range = above(0), .fallback = "30.0", .example = "30.0", .doc = "wall time between checkpoints"});
    a.table(
        "output.picture", output.picture,
        {.example = R"({ view = "oblique", color = "displacement" })",
         .doc = "pictures of the snapshots, drawn when the run ends or stops: one camera, one range of colours"},
        [&](const std::string& p, auto& v) {
            a.choice(
                p + ".view", v.view,
                {{"oblique", scene::View::Oblique}, {"side", scene::View::Side}, {"top", scene::View::Top}, {"cut", scene::View::Slice}},
                {.fallback = "\"oblique\"",
                 .example = "\"oblique\"",
                 .doc = "where from; \"cut\": a slice two spacings thick along x, through the middle of the soil at the start"});
            a.choice(p + ".color", v.color,
                     {{"displacement", scene::Color::Displacement},
                      {"speed", scene::Color::Speed},
                      {"plastic_strain", scene::Color::PlasticStrain},
                      {"pressure", scene::Color::Pressure}},
                     {.fallback = "\"displacement\"", .example = "\"displacement\"", .doc = "what the colour shows"});
            a.pair(p + ".range", v.range,
                   {.unit = "of the colour",
                    .optional = true,
                    .example = "[0.0, 1.0]",
                    .doc = "least and largest value of the colours (m, m/s, 1, Pa); without it those of the whole run, of 98 % of "
                           "the soil where single grains stand far out"});
        });
    a.flag("output.movie", output.movie,
           {.fallback = "false", .example = "true", .doc = "the pictures as a film at the end (needs ffmpeg)"});
}

/// What an event makes of a soil.
template <class A> void describe_soil_change(A& a, const std::string& path, scene::SoilChange& soil)
{
    a.number(path + ".young", soil.young, {.unit = "Pa", .range = above(0), .example = "1.0e6", .doc = "Young's modulus from then on"});
    a.number(path + ".poisson", soil.poisson,
             {.unit = "1", .range = from_below(0, 0.5), .example = "0.3", .doc = "Poisson's ratio from then on"});
    a.number(path + ".cohesion", soil.cohesion, {.unit = "Pa", .range = from(0), .example = "500.0", .doc = "cohesion from then on"});
    a.angle(path + ".friction_angle", soil.friction_angle,
            {.unit = "deg", .range = from_below(0, 90), .example = "20.0", .doc = "friction angle from then on"});
    a.angle(path + ".dilation_angle", soil.dilation_angle,
            {.unit = "deg", .range = from_below(0, 90), .example = "0.0", .doc = "dilation angle from then on"});
    a.number(path + ".tension_cutoff", soil.tension_cutoff,
             {.unit = "Pa", .range = from(0), .example = "0.0", .doc = "largest mean tension from then on"});
    a.choice(path + ".cone", soil.cone, cone_words(), {.optional = true, .example = "\"plane strain\"", .doc = "cone from then on"});
    a.number(path + ".strength", soil.strength,
             {.unit = "1",
              .range = above_to(0, 1e6),
              .example = "0.8",
              .doc = "factor of cohesion, tan(friction_angle) and tension_cutoff; the dilation angle stays at most the friction angle"});
    a.number(path + ".stiffness", soil.stiffness,
             {.unit = "1", .range = above_to(0, 1e6), .example = "0.5", .doc = "factor of Young's modulus"});
}

template <class A> void describe_move(A& a, const std::string& p, scene::WallMove& m)
{
    a.text(p + ".wall", m.wall, {.example = "\"gate\"", .doc = "name of the wall"});
    a.vector(p + ".velocity", m.velocity,
             {.unit = "m/s",
              .range = between(-1e6, 1e6),
              .fallback = "[0.0, 0.0, 0.0]",
              .example = "[0.0, 0.0, 1.5]",
              .doc = "velocity, of the center where it turns too"});
    a.table(p + ".rotation", m.turn, {.example = "{ center = [1.0, 0.0, 0.0], rate = 2.0 }", .doc = "the wall turns as well"},
            [&](const std::string& q, scene::Turn& t) {
                a.vector(
                    q + ".center", t.center,
                    {.unit = "m", .range = coordinate, .example = "[1.0, 0.0, 0.0]", .doc = "a point of the axis when the motion begins"});
                a.vector(q + ".axis", t.axis,
                         {.unit = "1",
                          .range = between(-1e6, 1e6),
                          .fallback = "[0.0, 1.0, 0.0]",
                          .example = "[0.0, 1.0, 0.0]",
                          .doc = "direction of the axis; a right-handed turn about it is positive"});
                a.angle(q + ".rate", t.rate, {.unit = "deg/s", .range = between(-1e6, 1e6), .example = "2.0", .doc = "how fast it turns"});
            });
    a.number(
        p + ".ramp", m.ramp,
        {.unit = "s",
         .range = from(0),
         .fallback = "0.0",
         .example = "0.1",
         .doc = "time in which the motion comes to that speed, and in which it comes to rest at its end; the way is that much shorter"});
    a.text(p + ".path", m.path.file,
           {.optional = true,
            .example = "\"path.csv\"",
            .doc = "instead, with at: a .csv with the columns time, x, y, z, seconds from at on and metres from where the wall stands then",
            .role = Role::Bookkeeping}); // its content counts
}

template <class A> void describe_load(A& a, const std::string& path, scene::Load& l)
{
    a.text(path + ".name", l.name, {.optional = true, .example = "\"footing\"", .doc = "by which events and outputs know it"});
    a.number(path + ".pressure", l.pressure,
             {.unit = "Pa", .range = above(0), .example = "2.0e4", .doc = "on the free faces of the soil, into it"});
    a.vector(path + ".traction", l.traction,
             {.unit = "Pa",
              .range = between(-1e12, 1e12),
              .example = "[0.0, 0.0, -2.0e4]",
              .doc = "instead of pressure: force for each area of the face that looks along normal"});
    a.vector(path + ".normal", l.normal,
             {.unit = "1",
              .range = between(-1e6, 1e6),
              .example = "[0.0, 0.0, 1.0]",
              .doc = "which way the loaded face looks: area counts as it is seen along it; without it every free face"});
    a.table(path + ".box", l.box,
            {.example = "{ low = [0.0, 0.0, 0.8], high = [1.0, 1.0, 1.2] }",
             .doc = "soil in it as the load begins is pushed: the face, and the two layers below it; without it all soil"},
            [&](const std::string& p, scene::Box& box) { describe_box(a, p, box); });
    a.text(path + ".body", l.body, {.optional = true, .example = "\"block\"", .doc = "only the soil of the body of this name"});
    a.flag(path + ".follow", l.follow,
           {.fallback = "false",
            .example = "true",
            .doc = "the pressure acts on the faces as they are at each time; without it each particle keeps the force of the start"});
    a.flag(path + ".plate", l.plate,
           {.fallback = "false",
            .example = "true",
            .doc = "the soil at the face moves along normal as one, as if a weightless plate lay on it that does not tilt"});
    a.number(path + ".factor", l.factor,
             {.unit = "1", .range = from(0), .fallback = "1.0", .example = "0.0", .doc = "how much of it acts before an event changes it"});
}

template <class A> void describe_probe(A& a, const std::string& path, scene::Probe& p)
{
    a.text(path + ".name", p.name, {.optional = true, .example = "\"toe\"", .doc = "what the rows are called; without it its number"});
    a.vector(path + ".point", p.point,
             {.unit = "m", .range = coordinate, .example = "[1.0, 0.0, 0.5]", .doc = "a place: what the soil around it is"});
    a.integer(path + ".particle", p.particle, {.range = between(0, 2147483647), .example = "1200", .doc = "a particle of soil by its id"});
    a.text(path + ".body", p.body,
           {.optional = true, .example = "\"block\"", .doc = "the name of a body: the mean of its particles by mass"});
}

template <class A> void describe_events(A& a, Scene& s)
{
    a.tables("load", s.loads,
             {.optional = true, .example = "[[load]]", .doc = "a pressure or traction on free faces of soil (docs/stages.md)"},
             [&](const std::string& path, scene::Load& l) { describe_load(a, path, l); });
    a.tables(
        "event", s.events, {.optional = true, .example = "[[event]]", .doc = "a change while the run goes on (docs/stages.md)"},
        [&](const std::string& path, scene::Event& e) {
            a.number(path + ".at", e.at,
                     {.unit = "s", .range = above(0), .example = "2.0", .doc = "when it happens, at the boundary of two steps"});
            a.number(path + ".from", e.from,
                     {.unit = "s", .range = from(0), .example = "2.0", .doc = "instead of at: when a linear change begins"});
            a.number(path + ".to", e.to, {.unit = "s", .range = above(0), .example = "3.0", .doc = "when it is complete"});
            a.some_names(path + ".remove", e.remove,
                         {.optional = true, .example = "\"gate\"", .doc = "names of walls, bodies and loads that go, or one of them"});
            a.some_names(path + ".add", e.add,
                         {.optional = true,
                          .example = "\"lift\"",
                          .doc = "names of walls, bodies and loads that come: they are not there before, the soil is as its body says"});
            a.vector(path + ".gravity", e.gravity,
                     {.unit = "m/s^2", .range = between(-1e6, 1e6), .example = "[2.0, 0.0, -9.81]", .doc = "gravity from then on"});
            a.text(path + ".shaking", e.shaking.file,
                   {.optional = true,
                    .example = "\"record.csv\"",
                    .doc =
                        "acceleration of the ground from at on: a .csv with the columns time, x, y, z in s and m/s^2; soil and walls are "
                        "seen from that ground",
                    .role = Role::Bookkeeping}); // its content counts
            a.points(path + ".water", e.water,
                     {.unit = "m",
                      .range = coordinate,
                      .optional = true,
                      .example = "[[0.0, 4.0], [20.0, 1.0]]",
                      .doc = "the water table of effects.pore_pressure from then on"});
            a.number(path + ".damping", e.damping,
                     {.unit = "of critical",
                      .range = between(0, 10),
                      .example = "0.05",
                      .doc = "damping as effects.damping, from then on; 0: none"});
            a.table(path + ".move", e.move,
                    {.example = "{ wall = \"gate\", velocity = [0.0, 0.0, 1.5] }", .doc = "a wall that moves, from from to to"},
                    [&](const std::string& p, scene::WallMove& m) { describe_move(a, p, m); });
            a.table(path + ".load", e.load,
                    {.example = "{ name = \"footing\", factor = 1.5 }", .doc = "how much of a load acts from then on"},
                    [&](const std::string& p, scene::LoadChange& l) {
                        a.text(p + ".name", l.name, {.example = "\"footing\"", .doc = "name of the load"});
                        a.number(p + ".factor", l.factor,
                                 {.unit = "1", .range = from(0), .example = "1.5", .doc = "of its pressure or traction"});
                    });
            a.soil_changes(path + ".soil", e.soils, s.soils,
                           {.optional = true, .example = "[event.soil.sand]", .doc = "what a soil becomes; only what is written changes"},
                           [&](const std::string& p, scene::SoilChange& soil) { describe_soil_change(a, p, soil); });
        });
    a.tables("probe", s.probes,
             {.optional = true,
              .example = "[[probe]]",
              .doc = "a row a time of output.history in probes.csv: of a place, a particle or the mean of a body (docs/stages.md)",
              .role = Role::Bookkeeping},
             [&](const std::string& path, scene::Probe& p) { describe_probe(a, path, p); });
}

template <class A> void describe_maps(A& a, std::optional<scene::Maps>& maps)
{
    a.part("maps", maps,
           {.example = "{ limits = [0.5, 1.0] }",
            .doc = "rasters of what happened, in maps/ of the result directory (docs/maps.md)",
            .role = Role::Bookkeeping},
           [&](const std::string& p, auto& v) {
               a.number(p + ".cell", v.cell,
                        {.unit = "m", .range = size, .optional = true, .example = "2.0", .doc = "side of a cell; without it two spacings"});
               a.number(p + ".wet", v.wet,
                        {.unit = "m",
                         .range = size,
                         .optional = true,
                         .example = "0.1",
                         .doc = "least thickness that counts as reached; without it one spacing"});
               a.numbers(p + ".limits", v.limits,
                         {.unit = "m",
                          .range = size,
                          .fallback = "[]",
                          .example = "[0.5, 1.0, 2.0]",
                          .doc = "greatest thicknesses whose outlines are drawn"});
               a.text(p + ".points", v.points,
                      {.optional = true,
                       .example = "\"houses.csv\"",
                       .doc = "named points (.csv with the columns name, x, y; .shp; GeoJSON) of which points.csv tells arrival, "
                              "greatest thickness, speed and pressure"});
           });
}

/// What kuzure hazard varies; no part of a Scene, for a run takes the scene as it is written.
template <class A> void describe_uncertain(A& a, std::optional<scene::Uncertain>& uncertain)
{
    const Range friction = from_below(0, 90);
    struct Example {
        const char *low, *likely, *high;
    };
    const auto triangle = [&](const std::string& path, std::optional<scene::Triangle>& to, const char* unit, Range range, Example e,
                              const char* doc) {
        const std::string whole = std::string("{ low = ") + e.low + ", likely = " + e.likely + ", high = " + e.high + " }";
        a.table(path, to, {.unit = unit, .example = whole.c_str(), .doc = doc}, [&](const std::string& p, scene::Triangle& t) {
            a.number(p + ".low", t.low, {.unit = unit, .range = range, .example = e.low, .doc = "least value"});
            a.number(p + ".likely", t.likely, {.unit = unit, .range = range, .example = e.likely, .doc = "most likely value"});
            a.number(p + ".high", t.high, {.unit = unit, .range = range, .example = e.high, .doc = "greatest value"});
        });
    };
    a.part("uncertain", uncertain,
           {.example = "{ bed_friction = { low = 16.0, likely = 20.0, high = 28.0 } }",
            .doc = "what is not known, for kuzure hazard: distributions are triangles from low over likely to high (docs/hazard.md)",
            .role = Role::Bookkeeping},
           [&](const std::string& p, scene::Uncertain& u) {
               a.integer(p + ".seed", u.seed,
                         {.range = between(0, 2147483647), .fallback = "1", .example = "7", .doc = "which members are drawn"});
               a.integer(p + ".members", u.members,
                         {.range = between(0, 10000),
                          .fallback = "0",
                          .example = "24",
                          .doc = "runs of the ensemble; 0: as many as the time allows"});
               triangle(p + ".friction", u.friction, "deg", friction, {"26.0", "30.0", "34.0"}, "friction angle of every soil");
               triangle(p + ".bed_friction", u.bed_friction, "deg", friction, {"16.0", "20.0", "28.0"},
                        "Coulomb friction of the ground, and of every wall that has one");
               triangle(p + ".thickness", u.thickness, "1", between(0.1, 10), {"0.65", "1.0", "1.35"},
                        "factor on the thickness of releases and the height of other bodies, hence on the volume");
               a.table(p + ".dem_error", u.dem_error,
                       {.example = "{ height = 1.0, length = 50.0 }", .doc = "error of the elevation models, the same sort everywhere"},
                       [&](const std::string& q, scene::HeightError& e) {
                           a.number(q + ".height", e.height,
                                    {.unit = "m", .range = above_to(0, 1000), .example = "1.0", .doc = "root mean square"});
                           a.number(q + ".length", e.length,
                                    {.unit = "m", .range = size, .example = "50.0", .doc = "over which errors are alike"});
                       });
               a.numbers(p + ".pressures", u.pressures,
                         {.unit = "kPa",
                          .range = above_to(0, 1e6),
                          .fallback = "[3.0, 30.0]",
                          .example = "[3.0, 30.0]",
                          .doc = "dynamic pressures whose exceedance is mapped"});
               a.tables(p + ".key", u.keys, {.optional = true, .example = "[[uncertain.key]]", .doc = "any other number of the scene"},
                        [&](const std::string& q, scene::UncertainKey& k) {
                            a.text(q + ".key", k.key, {.example = "\"soil.debris.cohesion\"", .doc = "its path"});
                            const auto number = [&](const char* leaf, double& to, const char* doc) {
                                a.number(q + leaf, to, {.unit = "of the key", .example = "1000.0", .doc = doc});
                            };
                            number(".low", k.value.low, "least value"), number(".likely", k.value.likely, "most likely value"),
                                number(".high", k.value.high, "greatest value");
                        });
           });
}

template <class A> void describe_space_and_time(A& a, Scene& s)
{
    a.section("space", {.example = "{ spacing = 0.04 }", .doc = "resolution and extent"});
    a.number("space.spacing", s.space.spacing,
             {.unit = "m", .range = between(1e-6, 1e6), .example = "0.04", .doc = "initial distance of particles"});
    a.number("space.h", s.space.h,
             {.unit = "spacings", .range = between(0.8, 3), .example = "1.3", .doc = "smoothing length; the support is 2 h"});
    a.vector(
        "space.low", s.space.low,
        {.unit = "m", .range = coordinate, .example = "[-1.0, -1.0, -0.5]", .doc = "lower corner of the box that particles may not leave"});
    a.vector(
        "space.high", s.space.high,
        {.unit = "m", .range = coordinate, .example = "[10.0, 10.0, 5.0]", .doc = "upper corner of the box that particles may not leave"});
    a.axes("space.periodic", s.space.periodic,
           {.optional = true, .example = "[\"y\"]", .doc = "axes along which space repeats from low to high"});

    a.section("time", {.example = "{ end = 1.0 }", .doc = "how long, in which steps"});
    a.number("time.end", s.time.end,
             {.unit = "s", .range = above(0), .example = "1.0", .doc = "time at which the run ends", .role = Role::Bookkeeping});
    a.number("time.step", s.time.step,
             {.unit = "s", .range = above(0), .example = "1.0e-4", .doc = "fixed step; without it the step follows accuracy.cfl"});
    a.flag("time.retry", s.time.retry,
           {.fallback = "false",
            .example = "true",
            .doc = "when numbers fail: back to the last good state in memory and on with half the step, once for each trouble"});
}

/// Soils, bodies and walls.
template <class A> void describe_matter(A& a, Scene& s)
{
    a.soils("soil", s.soils, {.example = "[soil.sand]", .doc = "any number of soils, each with a name"},
            [&](const std::string& path, scene::Soil& soil) { describe_soil(a, path, soil); });
    a.tables("body", s.bodies, {.example = "[[body]]", .doc = "soil of one shape; bodies may touch, not overlap"},
             [&](const std::string& path, scene::Body& body) {
                 a.soil_of(path + ".soil", body.soil, s.soils, {.example = "\"sand\"", .doc = "name of the soil it is made of"});
                 describe_shape(a, path, body.shape);
                 describe_release(a, path, body.shape);
                 a.vector(path + ".velocity", body.velocity,
                          {.unit = "m/s",
                           .range = between(-1e6, 1e6),
                           .fallback = "[0.0, 0.0, 0.0]",
                           .example = "[0.0, 0.0, -1.0]",
                           .doc = "velocity at the start"});
                 a.choice(
                     path + ".stress", body.stress, {{"none", scene::InitialStress::None}, {"at rest", scene::InitialStress::AtRest}},
                     {.fallback = "\"none\"", .example = "\"none\"", .doc = "stress at the start; \"at rest\" is K0 under its own weight"});
                 a.text(path + ".name", body.name, name_info("\"slope\""));
             });
    a.tables("wall", s.walls, {.optional = true, .example = "[[wall]]", .doc = "fixed particles of one shape"},
             [&](const std::string& path, scene::Wall& wall) {
                 describe_shape(a, path, wall.shape);
                 a.choice_or_table(
                     path + ".surface", wall.surface, {{"rough", scene::Surface::Rough}, {"smooth", scene::Surface::Smooth}},
                     scene::Surface::Coulomb,
                     {.fallback = "\"rough\"",
                      .example = "\"rough\"",
                      .doc = "\"rough\" (no slip), \"smooth\" (free slip) or { friction_angle } (Coulomb)"},
                     [&](const std::string& p) {
                         a.angle(p + ".friction_angle", wall.friction_angle,
                                 {.unit = "deg", .range = from_below(0, 90), .example = "20.0", .doc = "Coulomb friction of the wall"});
                     });
                 a.text(path + ".name", wall.name, name_info("\"gate\""));
             });
}

template <class A> void describe_start(A& a, Scene& s)
{
    a.section("start",
              {.fallback = "{}", .example = "{ from = \"results/settled\" }", .doc = "the state to start from", .role = Role::Bookkeeping});
    a.text("start.from", s.start.from,
           {.optional = true,
            .example = "\"results/settled\"",
            .doc = "start from the last state of another run (its result directory, or a checkpoint): places, velocities, densities, "
                   "stresses and strains; time and displacement begin anew. Bodies, spacing and dimensions must be that run's; walls, "
                   "effects, soils' numbers and accuracy may differ",
            .role = Role::Bookkeeping});
}

/// Every key of a scene, in the order in which scenes are written.
template <class A> void describe(A& a, Scene& s)
{
    a.text("title", s.title, {.example = "\"self-weight collapse\"", .doc = "what this scene is", .role = Role::Bookkeeping});
    a.integer("dimensions", s.dimensions,
              {.range = between(2, 3), .example = "3", .doc = "3, or 2: plane strain in x-z with a full 3-D stress tensor"});

    describe_space_and_time(a, s);
    describe_matter(a, s);
    describe_terrain(a, s.terrain);
    describe_start(a, s);
    describe_effects(a, s.effects);
    describe_accuracy(a, s.accuracy);
    describe_maps(a, s.maps);
    describe_events(a, s);
    describe_output(a, s.output);
}

} // namespace kuzure::io
