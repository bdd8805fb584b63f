#include "io/scene_keys.hpp"
#include <algorithm>
#include <fmt/format.h>
#include <fmt/ranges.h>

namespace kuzure::io {
namespace {

Range above(double low) { return {.low = low, .low_open = true}; }
Range from(double low) { return {.low = low}; }
Range between(double low, double high) { return {.low = low, .high = high}; }
Range from_below(double low, double high) { return {.low = low, .high = high, .high_open = true}; }
Range above_to(double low, double high) { return {.low = low, .high = high, .low_open = true}; }
const Range any{};
/// Places and sizes: beyond this nobody means metres.
const double far = 1e9;

std::vector<Key> make_keys()
{
    using enum Kind;
    using enum Need;
    const auto place = between(-far, far), size = above_to(0, far);
    const auto book = Role::Bookkeeping;
    std::vector<Key> keys{
        {"title", Text, "", Required, "", any, {}, "\"self-weight collapse\"", "what this scene is", book},
        {"dimensions", Integer, "", Required, "", between(2, 3), {}, "3", "3, or 2: plane strain in x-z with a full 3-D stress tensor"},

        {"space", Table, "", Required, "", any, {}, "{ spacing = 0.04 }", "resolution and extent"},
        {"space.spacing", Number, "m", Required, "", between(1e-6, 1e6), {}, "0.04", "initial distance of particles"},
        {"space.h", Number, "spacings", Default, "1.3", between(0.8, 3), {}, "1.3", "smoothing length; the support is 2 h"},
        {"space.low", Vector, "m", Optional, "", place, {}, "[-1.0, -1.0, -0.5]", "lower corner of the box that particles may not leave"},
        {"space.high", Vector, "m", Optional, "", place, {}, "[10.0, 10.0, 5.0]", "upper corner of the box that particles may not leave"},
        {"space.periodic", Choices, "", Optional, "", any, {"x", "y", "z"}, "[\"y\"]", "axes along which space repeats from low to high"},

        {"time", Table, "", Required, "", any, {}, "{ end = 1.0 }", "how long, in which steps"},
        {"time.end", Number, "s", Required, "", above(0), {}, "1.0", "time at which the run ends", book},
        {"time.step", Number, "s", Optional, "", above(0), {}, "1.0e-4", "fixed step; without it the step follows accuracy.cfl"},

        {"time.retry",
         Flag,
         "",
         Default,
         "false",
         any,
         {},
         "true",
         "when numbers fail: back to the last good state in memory and on with half the step, once for each trouble"},

        {"soil", Named, "", Required, "", any, {}, "[soil.sand]", "any number of soils, each with a name"},
        {"soil.*", Table, "", Optional, "", any, {}, "[soil.sand]", "one soil"},
        {"soil.*.density", Number, "kg/m^3", Required, "", above(0), {}, "1850.0", "bulk density at the start"},
        {"soil.*.young", Number, "Pa", Required, "", above(0), {}, "1.8e6", "Young's modulus"},
        {"soil.*.poisson", Number, "1", Required, "", from_below(0, 0.5), {}, "0.3", "Poisson's ratio"},
        {"soil.*.cohesion", Number, "Pa", Default, "0.0", from(0), {}, "5000.0", "cohesion c"},
        {"soil.*.friction_angle", Number, "deg", Default, "0.0", from_below(0, 90), {}, "25.0", "friction angle phi"},
        {"soil.*.dilation_angle", Number, "deg", Default, "0.0", from_below(0, 90), {}, "0.0", "dilation angle psi, at most phi"},
        {"soil.*.cone",
         Choice,
         "",
         Default,
         "\"compression\"",
         any,
         {"compression", "extension", "plane strain", "plane strain, no dilation"},
         "\"compression\"",
         "how the Drucker-Prager cone is fitted to c and phi"},
        {"soil.*.tension_cutoff",
         Number,
         "Pa",
         Optional,
         "",
         from(0),
         {},
         "1000.0",
         "largest mean tension, at most the cone's apex c cot(phi)"},
        {"soil.*.dilation_decay",
         Number,
         "1",
         Optional,
         "",
         above(0),
         {},
         "0.1",
         "plastic shear strain over which dilation dies out linearly; without it dilation stays"},
        {"soil.*.softening",
         Table,
         "",
         Optional,
         "",
         any,
         {},
         "{ friction_angle = 20.0, slip = 0.02 }",
         "strength falls linearly to a residual one"},
        {"soil.*.softening.cohesion", Number, "Pa", Default, "0.0", from(0), {}, "0.0", "residual cohesion, at most the first"},
        {"soil.*.softening.friction_angle",
         Number,
         "deg",
         Default,
         "0.0",
         from_below(0, 90),
         {},
         "20.0",
         "residual friction angle, at most the first"},
        {"soil.*.softening.slip",
         Number,
         "m",
         Required,
         "",
         above(0),
         {},
         "0.02",
         "slip across a shear band (taken 2 h wide) at which the residual strength is reached"},
        {"soil.*.rate_friction",
         Table,
         "",
         Optional,
         "",
         any,
         {},
         "{ friction_angle = 33.0, inertial_number = 0.3, grain = 0.001, grain_density = 2600.0 }",
         "mu(I): friction grows with the rate of shear"},
        {"soil.*.rate_friction.friction_angle",
         Number,
         "deg",
         Required,
         "",
         from_below(0, 90),
         {},
         "33.0",
         "friction angle of fast flow, at least that at rest"},
        {"soil.*.rate_friction.inertial_number", Number, "1", Default, "0.3", above(0), {}, "0.3", "I_0, where half the growth is reached"},
        {"soil.*.rate_friction.grain", Number, "m", Required, "", above(0), {}, "0.001", "diameter of a grain"},
        {"soil.*.rate_friction.grain_density", Number, "kg/m^3", Default, "2600.0", above(0), {}, "2600.0", "density of a grain"},

        {"body", Tables, "", Required, "", any, {}, "[[body]]", "soil of one shape; bodies may touch, not overlap"},
        {"body.*.soil", Text, "", Required, "", any, {}, "\"sand\"", "name of the soil it is made of"},
        {"body.*.velocity", Vector, "m/s", Default, "[0.0, 0.0, 0.0]", between(-1e6, 1e6), {}, "[0.0, 0.0, -1.0]", "velocity at the start"},
        {"body.*.stress",
         Choice,
         "",
         Default,
         "\"none\"",
         any,
         {"none", "at rest"},
         "\"none\"",
         "stress at the start; \"at rest\" is K0 under its own weight"},

        {"wall", Tables, "", Optional, "", any, {}, "[[wall]]", "fixed particles of one shape"},
        {"wall.*.surface",
         ChoiceOrTable,
         "",
         Default,
         "\"rough\"",
         any,
         {"rough", "smooth"},
         "\"rough\"",
         "\"rough\" (no slip), \"smooth\" (free slip) or { friction_angle } (Coulomb)"},
        {"wall.*.surface.friction_angle", Number, "deg", Required, "", from_below(0, 90), {}, "20.0", "Coulomb friction of the wall"},

        {"effects",
         Table,
         "",
         Default,
         "{}",
         any,
         {},
         "{ gravity = [0.0, 0.0, -9.81] }",
         "what is simulated beyond the soil itself: only what is written"},
        {"effects.gravity", Vector, "m/s^2", Optional, "", between(-1e6, 1e6), {}, "[0.0, 0.0, -9.81]", "body force per mass"},
        {"effects.viscosity",
         Table,
         "",
         Optional,
         "",
         any,
         {},
         "{ alpha = 0.1, beta = 0.0 }",
         "artificial viscosity against the P-wave speed"},
        {"effects.viscosity.alpha", Number, "1", Required, "", between(0, 10), {}, "0.1", "linear part"},
        {"effects.viscosity.beta", Number, "1", Default, "0.0", between(0, 10), {}, "0.0", "quadratic part"},
        {"effects.artificial_stress",
         ChoiceOrTable,
         "",
         Optional,
         "",
         any,
         {"auto"},
         "\"auto\"",
         "against tensile instability; \"auto\" is on exactly where tension can exist"},
        {"effects.artificial_stress.epsilon",
         Number,
         "1",
         Default,
         "0.5",
         between(0, 1),
         {},
         "0.5",
         "share of the tensile principal stress"},
        {"effects.artificial_stress.exponent", Number, "1", Default, "2.55", above_to(0, 20), {}, "2.55", "exponent n of W(r)/W(spacing)"},
        {"effects.stress_diffusion",
         ChoiceOrTable,
         "",
         Optional,
         "",
         any,
         {"auto"},
         "{ zeta = 0.1 }",
         "against noise in the stress; \"auto\" is on for one dry soil in boxes or cylinders under vertical gravity"},
        {"effects.stress_diffusion.zeta", Number, "1", Default, "0.1", between(0, 1), {}, "0.1", "strength"},
        {"effects.pore_pressure",
         Table,
         "",
         Optional,
         "",
         any,
         {},
         "{ table = [[0.0, 4.0], [20.0, 1.0]] }",
         "still pore water: buoyancy and seepage of a given water table; stresses are then effective"},
        {"effects.pore_pressure.table",
         Points,
         "m",
         Required,
         "",
         place,
         {},
         "[[0.0, 4.0], [20.0, 1.0]]",
         "its corners [x, z], x increasing"},
        {"effects.pore_pressure.density", Number, "kg/m^3", Default, "1000.0", above(0), {}, "1000.0", "density of the water"},
        {"effects.damping",
         Table,
         "",
         Optional,
         "",
         any,
         {},
         "{ ratio = 0.02, until = 0.5 }",
         "viscous damping to settle an initial state"},
        {"effects.damping.ratio", Number, "of critical", Required, "", above_to(0, 10), {}, "0.02", "strength"},
        {"effects.damping.until", Number, "s", Required, "", above(0), {}, "0.5", "time at which it is switched off"},

        {"accuracy", Table, "", Default, "{}", any, {}, "{ cfl = 0.2 }", "everything that trades error for time"},
        {"accuracy.kernel",
         Choice,
         "",
         Default,
         "\"wendland c2\"",
         any,
         {"cubic spline", "wendland c2", "wendland c4"},
         "\"wendland c2\"",
         "smoothing kernel"},
        {"accuracy.cfl", Number, "1", Default, "0.2", above(0), {}, "0.2", "Courant number of the step where time.step is absent"},
        {"accuracy.precision",
         Choice,
         "",
         Default,
         "\"double\"",
         any,
         {"double", "mixed"},
         "\"double\"",
         "\"mixed\": pair sums in single, state in double precision"},
        {"accuracy.correction",
         Choice,
         "",
         Default,
         "\"none\"",
         any,
         {"none", "gradient"},
         "\"none\"",
         "\"gradient\": velocity gradients exact for linear fields, also at surfaces"},
        {"accuracy.skin",
         Number,
         "supports",
         Default,
         "0.1",
         between(0.01, 0.5),
         {},
         "0.1",
         "reach of neighbour lists beyond the support: cost only"},

        {"output", Table, "", Default, "{}", any, {}, "{ every = 0.05 }", "what a run leaves in its directory", book},
        {"output.directory",
         Text,
         "",
         Optional,
         "",
         any,
         {},
         "\"results/seed-52\"",
         "result directory; without it results/<scene file's name>",
         book},
        {"output.every",
         Number,
         "s",
         Optional,
         "",
         above(0),
         {},
         "0.05",
         "time between snapshots; without it the first and the last state",
         book},
        {"output.fields",
         Choices,
         "",
         Default,
         R"(["velocity", "stress", "density", "plastic_strain", "displacement"])",
         any,
         {"velocity", "stress", "density", "plastic_strain", "displacement"},
         "[\"velocity\", \"stress\"]",
         "fields of snapshots beside position, id, kind and soil",
         book},
        {"output.history",
         Number,
         "s",
         Optional,
         "",
         above(0),
         {},
         "0.001",
         "time between rows of history.csv; without it the first and the last state",
         book},
        {"output.grain",
         Number,
         "m",
         Optional,
         "",
         above(0),
         {},
         "0.04",
         "height from which a column counts as soil in history.csv; without it one spacing",
         book},
        {"output.checkpoint_minutes", Number, "min", Default, "30.0", above(0), {}, "30.0", "wall time between checkpoints", book},
        {"output.picture",
         Table,
         "",
         Optional,
         "",
         any,
         {},
         R"({ view = "oblique", color = "displacement" })",
         "pictures of the snapshots",
         book},
        {"output.picture.view", Choice, "", Default, "\"oblique\"", any, {"oblique", "side", "top"}, "\"oblique\"", "where from", book},
        {"output.picture.color",
         Choice,
         "",
         Default,
         "\"displacement\"",
         any,
         {"displacement", "speed", "plastic_strain", "pressure"},
         "\"displacement\"",
         "what the colour shows",
         book},
    };
    const std::vector<Key> shapes{
        {"box", Table, "", Optional, "", any, {}, "{ low = [0.0, 0.0, 0.0], high = [1.0, 1.0, 1.0] }", "a box of whole spacings a side"},
        {"box.low", Vector, "m", Required, "", place, {}, "[0.0, 0.0, 0.0]", "lower corner"},
        {"box.high", Vector, "m", Required, "", place, {}, "[1.0, 1.0, 1.0]", "upper corner"},
        {"cylinder",
         Table,
         "",
         Optional,
         "",
         any,
         {},
         "{ base = [0.0, 0.0, 0.0], radius = 0.1, height = 0.2 }",
         "an upright cylinder (3-D)"},
        {"cylinder.base", Vector, "m", Required, "", place, {}, "[0.0, 0.0, 0.0]", "centre of its lower face"},
        {"cylinder.radius", Number, "m", Required, "", size, {}, "0.1", "radius"},
        {"cylinder.height", Number, "m", Required, "", size, {}, "0.2", "height along z"},
        {"sphere", Table, "", Optional, "", any, {}, "{ center = [0.0, 0.0, 0.0], radius = 0.1 }", "a sphere, in 2-D a disc"},
        {"sphere.center", Vector, "m", Required, "", place, {}, "[0.0, 0.0, 0.0]", "centre"},
        {"sphere.radius", Number, "m", Required, "", size, {}, "0.1", "radius"},
        {"polygon",
         Table,
         "",
         Optional,
         "",
         any,
         {},
         "{ points = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]], y = [0.0, 1.0] }",
         "a polygon in x-z, drawn out along y"},
        {"polygon.points", Points, "m", Required, "", place, {}, "[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]", "its corners [x, z] in order"},
        {"polygon.y", Pair, "m", Optional, "", place, {}, "[0.0, 1.0]", "its extent along y; needed in 3-D, left out in 2-D"},
    };
    for (const char* parent : {"body.*.", "wall.*."}) {
        const auto at = std::find_if(keys.begin(), keys.end(), [&](const Key& k) { return k.path.starts_with(parent); });
        auto rows = shapes;
        for (auto& row : rows) row.path = parent + row.path;
        keys.insert(at, rows.begin(), rows.end());
    }
    return keys;
}

} // namespace

bool Range::holds(double x) const { return (low_open ? x > low : x >= low) && (high_open ? x < high : x <= high); }

std::string Range::text() const
{
    const bool below = low > -std::numeric_limits<double>::infinity(), above = high < std::numeric_limits<double>::infinity();
    if (below && above) return fmt::format("{:g} {} x {} {:g}", low, low_open ? "<" : "<=", high_open ? "<" : "<=", high);
    if (below) return fmt::format("x {} {:g}", low_open ? ">" : ">=", low);
    return above ? fmt::format("x {} {:g}", high_open ? "<" : "<=", high) : "";
}

std::string Key::expected() const
{
    const std::string of_unit = unit.empty() || unit == "1" ? "" : unit.starts_with("of ") ? " " + unit : " in " + unit;
    const std::string limits = range.text().empty() ? "" : ", " + range.text();
    const auto one_of = [&] { return fmt::format("\"{}\"", fmt::join(choices, "\", \"")); };
    switch (kind) {
    case Kind::Text:
        return "a string";
    case Kind::Number:
        return "a number" + of_unit + limits;
    case Kind::Integer:
        return "an integer" + limits;
    case Kind::Flag:
        return "true or false";
    case Kind::Vector:
        return "three numbers [x, y, z]" + of_unit;
    case Kind::Pair:
        return "two numbers [from, to]" + of_unit;
    case Kind::Points:
        return "an array of corners [x, z]" + of_unit;
    case Kind::Choice:
        return (choices.size() > 1 ? "one of " : "") + one_of();
    case Kind::Choices:
        return "an array of " + one_of();
    case Kind::ChoiceOrTable:
        return one_of() + " or a table";
    case Kind::Table:
        return "a table";
    case Kind::Tables:
        return fmt::format("tables [[{}]]", path);
    case Kind::Named:
        return fmt::format("tables [{}.<name>]", path);
    }
    return {};
}

const std::vector<Key>& scene_keys()
{
    static const std::vector<Key> keys = make_keys();
    return keys;
}

std::string pattern_of(std::string_view path)
{
    const auto first = path.find('.');
    const auto head = path.substr(0, first);
    if (first == path.npos || (head != "soil" && head != "body" && head != "wall")) return std::string(path);
    const auto second = path.find('.', first + 1);
    return std::string(head) + ".*" + std::string(second == path.npos ? "" : path.substr(second));
}

const Key* find_key(std::string_view path)
{
    const std::string pattern = pattern_of(path);
    const auto& keys = scene_keys();
    const auto found = std::find_if(keys.begin(), keys.end(), [&](const Key& k) { return k.path == pattern; });
    return found == keys.end() ? nullptr : &*found;
}

std::vector<const Key*> keys_in(std::string_view pattern)
{
    const std::string head = pattern.empty() ? "" : std::string(pattern) + ".";
    std::vector<const Key*> inside;
    for (const Key& k : scene_keys())
        if (k.path.starts_with(head) && k.path.find('.', head.size()) == k.path.npos && k.leaf() != "*") inside.push_back(&k);
    return inside;
}

int edit_distance(std::string_view a, std::string_view b)
{
    std::vector<std::vector<int>> d(a.size() + 1, std::vector<int>(b.size() + 1));
    for (std::size_t i = 0; i <= a.size(); ++i)
        for (std::size_t j = 0; j <= b.size(); ++j) {
            if (i == 0 || j == 0) {
                d[i][j] = int(i + j);
                continue;
            }
            d[i][j] = std::min({d[i - 1][j] + 1, d[i][j - 1] + 1, d[i - 1][j - 1] + (a[i - 1] != b[j - 1])});
            if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) d[i][j] = std::min(d[i][j], d[i - 2][j - 2] + 1);
        }
    return d[a.size()][b.size()];
}

std::string nearest(std::string_view written, const std::vector<std::string>& known)
{
    // What others call it is nearer than any word of similar letters.
    static constexpr std::pair<std::string_view, std::string_view> others[] = {
        {"rho", "density"},        {"E", "young"},    {"nu", "poisson"},    {"c", "cohesion"},   {"phi", "friction_angle"},
        {"psi", "dilation_angle"}, {"dx", "spacing"}, {"dp", "spacing"},    {"dt", "step"},      {"g", "gravity"},
        {"diameter", "radius"},    {"size", "high"},  {"boundary", "wall"}, {"material", "soil"}};
    for (const auto& [other, ours] : others)
        if (written == other && std::find(known.begin(), known.end(), ours) != known.end()) return std::string(ours);
    // A very long word is near to nothing, and the table of distances would be large.
    const auto word = written.substr(0, 100);
    const auto best = std::min_element(known.begin(), known.end(),
                                       [&](const auto& a, const auto& b) { return edit_distance(word, a) < edit_distance(word, b); });
    return best == known.end() ? "" : *best;
}

} // namespace kuzure::io
