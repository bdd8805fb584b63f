// Studies: sweep files and their messages, Richardson extrapolation, Pareto fronts, profiles, twins, the dial, presets.
#include "io/scene_file.hpp"
#include "io/scene_keys.hpp"
#include "io/sweep_file.hpp"
#include "solver/app/scaling/estimate.hpp"
#include "solver/app/study/convergence.hpp"
#include "solver/app/study/dial.hpp"
#include "solver/app/study/profile.hpp"
#include "solver/app/study/study.hpp"
#include "solver/app/study/twins.hpp"
#include "solver/scene/fill.hpp"
#include <cmath>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <set>

using namespace kuzure;
using namespace kuzure::study;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

namespace {

const std::string least_sweep = "scene = \"a.toml\"\nmeasures = [\"run-out\"]\n";
const std::string grid = "[vary]\npreset = [\"seed\", \"fast\"]\n\"space.spacing\" = [0.02, 0.01]\n";

std::string message(const std::string& text)
{
    try {
        io::parse_sweep(text, "dir/sweep.toml");
    } catch (const BadInput& e) {
        return e.what();
    }
    return "accepted";
}

/// value = limit + C spacing^p at 1, 2, 4.
std::vector<Sample> power(double limit, double c, double p)
{
    std::vector<Sample> s;
    for (const double h : {1.0, 2.0, 4.0}) s.push_back({h, limit + c * std::pow(h, p)});
    return s;
}

Scene block(double spacing, const std::string& more = "", int dimensions = 2)
{
    return io::parse_scene(
        fmt::format(
            "title = \"block\"\ndimensions = {}\n[space]\nspacing = {}\n[time]\nend = 1.0\n[soil.s]\ndensity = 1850.0\nyoung = 1.8e6\n"
            "poisson = 0.3\nfriction_angle = 25.0\n[effects]\ngravity = [0.0, 0.0, -9.81]\n{}",
            dimensions, spacing, more.empty() ? "[[body]]\nsoil = \"s\"\nbox = { low = [0, 0, 0], high = [0.8, 0.8, 0.8] }\n" : more),
        "block");
}
io::SoilSnapshot filled(const Scene& s)
{
    const scene::Filling f(s);
    io::SoilSnapshot soil;
    for (std::int64_t id = 0; id < f.soil_count(); ++id) soil.position.push_back(f.soil_position(id)), soil.displacement.push_back({});
    return soil;
}

} // namespace

// ---- sweep files ----
TEST(Sweep, ListsMultiplyAndPresetsStandForTheirKeys)
{
    const auto s = io::parse_sweep(least_sweep + grid, "dir/sweep.toml");
    EXPECT_EQ(s.scene, "dir/a.toml");
    ASSERT_EQ(s.points.size(), 4u);
    EXPECT_EQ(s.points[0].curve, "seed");
    EXPECT_EQ(s.points[1].curve, "fast");
    EXPECT_THAT(s.points[3].sets, ::testing::Contains("space.spacing=0.01"));
    EXPECT_THAT(s.points[0].sets, ::testing::Contains("accuracy.kernel=\"cubic spline\""));
    EXPECT_FALSE(s.points[0].choice);
}
TEST(Sweep, PointsStartFromTheBaseAndOwnPresetsFromThoseOfKuzure)
{
    const auto s = io::parse_sweep(least_sweep + "[base]\npreset = \"wide\"\nspace.spacing = 0.02\n[presets.wide]\n\"space.h\" = "
                                                 "1.7\npreset = \"fast\"\n[[point]]\nname = \"slow\"\n\"accuracy.cfl\" = 0.1\n",
                                   "sweep.toml");
    ASSERT_EQ(s.points.size(), 2u);
    EXPECT_EQ(s.points[0].curve, "base");
    EXPECT_EQ(s.points[1].curve, "slow");
    const auto& sets = s.points[1].sets;
    const auto index_of = [&](const std::string& set) { return std::find(sets.begin(), sets.end(), set) - sets.begin(); };
    // what is written overrides what it starts from
    EXPECT_LT(index_of("space.h=1.2"), index_of("space.h=1.7"));
    EXPECT_LT(index_of("space.h=1.7"), std::ptrdiff_t(sets.size()));
    EXPECT_EQ(sets.back(), "accuracy.cfl=0.1");
}
TEST(Sweep, BadOnesAreRefusedWithFileLineKeyAndRemedy)
{
    EXPECT_THAT(message("scene = \"a.toml\"\nmeasures = [\"run-out\"\n"), HasSubstr("dir/sweep.toml:"));
    EXPECT_THAT(message("measures = [\"run-out\"]\n" + grid),
                HasSubstr("scene: expected a string, found nothing; write, for example, scene = \"column.toml\""));
    EXPECT_THAT(message("scene = \"a.toml\"\n" + grid), HasSubstr("measures: expected an array"));
    EXPECT_THAT(message("scene = \"a.toml\"\nmeasures = [\"runout\"]\n" + grid), HasSubstr("did you mean \"run-out\""));
    EXPECT_THAT(message("scene = \"a.toml\"\nmeasures = [\"run-out\", \"run-out\"]\n" + grid), HasSubstr("twice"));
    EXPECT_THAT(message(least_sweep), HasSubstr("[vary] or [[point]]"));
    EXPECT_THAT(message(least_sweep + "wary = 1\n" + grid),
                HasSubstr("sweep.toml:3: wary: expected a known key, found \"wary\"; did you mean \"vary\"?"));
    EXPECT_THAT(message(least_sweep + "[vary]\n\"space.spacin\" = [1]\n"), HasSubstr("did you mean \"space.spacing\""));
    EXPECT_THAT(message(least_sweep + "[vary]\n\"space.spacing\" = 0.1\n"), HasSubstr("expected an array of values"));
    EXPECT_THAT(message(least_sweep + "[vary]\n\"space.spacing\" = []\n"), HasSubstr("expected an array of values"));
    EXPECT_THAT(message(least_sweep + "[vary]\n\"space.spacing\" = [0.1, 0.1]\n"), HasSubstr("each value once"));
    EXPECT_THAT(message(least_sweep + "[vary]\npreset = [\"sead\"]\n"), HasSubstr("did you mean \"seed\""));
    EXPECT_THAT(message(least_sweep + grid + "[presets.fast]\n\"space.h\" = 1.5\n"), HasSubstr("a name of your own"));
    EXPECT_THAT(message(least_sweep + "[[point]]\n\"accuracy.cfl\" = 0.1\n"),
                HasSubstr("sweep.toml:3: point.0.name: expected a string, found nothing"));
    EXPECT_THAT(message(least_sweep + "[[point]]\nname = \"a\"\n"), HasSubstr("expected a setting"));
    EXPECT_THAT(message(least_sweep + "[[point]]\nname = \"base\"\n\"accuracy.cfl\" = 0.1\n"), HasSubstr("a name of its own"));
    EXPECT_THAT(message(least_sweep + "[reference]\nfinest = true\nclosed_form = \"k0 column\"\n" + grid), HasSubstr("exactly one"));
    EXPECT_THAT(message(least_sweep + "[reference]\nclosed_form = \"k1 column\"\n" + grid), HasSubstr("k0 column"));
    EXPECT_THAT(message("scene = \"a.toml\"\nmeasures = [\"stress\"]\n" + grid), HasSubstr("needs closed_form"));
    EXPECT_THAT(message(least_sweep + "threads = 0\n" + grid),
                HasSubstr("sweep.toml:3: threads: expected an integer, 1 <= x <= 4096, found 0"));
    EXPECT_THAT(message(least_sweep + "[reference]\nfinest = false\n" + grid),
                HasSubstr("reference.finest: expected a string or true, found false"));
    EXPECT_THAT(message(least_sweep + "[reference]\nprofile = \"a.csv\"\nscater = 0.1\n" + grid), HasSubstr("did you mean \"scatter\""));
    EXPECT_THAT(message(least_sweep + "base = 3\n" + grid), HasSubstr("base: expected a table, found 3"));
    EXPECT_THAT(message(least_sweep + "point = 3\n"), HasSubstr("point: expected tables [[point]], found 3"));
    EXPECT_THAT(message(least_sweep + "presets = { a = 3 }\n" + grid), HasSubstr("presets.a: expected a table"));
    EXPECT_THAT(message(least_sweep + "[[point]]\nname = \"\"\n\"accuracy.cfl\" = 0.1\n"), HasSubstr("point.name: expected words"));
    // As for scenes: everything that is wrong at once, and what kind of file this should be.
    const auto both = message("scene = 3\nmeasures = [\"run-out\"]\ngrain = -1\n" + grid);
    EXPECT_THAT(both, HasSubstr("sweep.toml:1: scene: expected a string, found 3"));
    EXPECT_THAT(both, HasSubstr("sweep.toml:3: grain: expected a number in m, 1e-09 <= x <= 1e+09, found -1"));
    EXPECT_THAT(message(std::string(1 << 20, ' ') + least_sweep), HasSubstr("expected a sweep of at most 1 MiB"));
    std::string wide = least_sweep + "[vary]\n";
    for (const char* key : {"space.h", "space.spacing", "accuracy.cfl"}) {
        wide += fmt::format("\"{}\" = [1", key);
        for (int k = 2; k <= 30; ++k) wide += fmt::format(", {}", k);
        wide += "]\n";
    }
    EXPECT_THAT(message(wide), HasSubstr("at most 10000 points"));
    EXPECT_EQ(message(least_sweep + grid), "accepted");
}

// ---- presets ----
TEST(Presets, FillInWhatIsNotWrittenAndReadBackToTheSameScene)
{
    const std::string text = io::write_scene(block(0.1));
    EXPECT_THAT(text, HasSubstr("preset = \"standard\""));
    std::string bare = "title = \"p\"\ndimensions = 2\n[space]\nspacing = 0.1\n[time]\nend = 1.0\n[soil.s]\ndensity = 1850.0\nyoung = "
                       "1.8e6\npoisson = 0.3\n"
                       "friction_angle = 25.0\n[[body]]\nsoil = \"s\"\nbox = { low = [0, 0, 0], high = [0.8, 0, 0.8] }\n";
    std::string before;
    for (const auto& preset : io::presets()) {
        const auto s = io::parse_scene(bare, "p", std::vector<std::string>{"accuracy.preset=" + preset.name});
        const auto written = io::write_scene(s);
        EXPECT_THAT(written, HasSubstr(fmt::format("preset = \"{}\"", preset.name)));
        const auto again = io::parse_scene(written, "p");
        EXPECT_EQ(again, s);
        EXPECT_EQ(io::scene_hash(again), io::scene_hash(s));
        // The hash is of the keys: one preset's keys under another's name are the same physics.
        std::vector<std::string> keys;
        for (const auto& [key, value] : preset.settings) keys.push_back(key + "=" + value);
        EXPECT_EQ(io::scene_hash(io::parse_scene(bare, "p", keys)), io::scene_hash(s)) << preset.name;
        EXPECT_NE(io::scene_hash(s), before) << preset.name;
        before = io::scene_hash(s);
    }
    // Explicit keys win.
    EXPECT_EQ(io::parse_scene(bare, "p", std::vector<std::string>{"accuracy.preset=seed", "accuracy.cfl=0.15"}).accuracy.cfl, 0.15);
    EXPECT_EQ(io::parse_scene(bare, "p"), io::parse_scene(bare, "p", std::vector<std::string>{"accuracy.preset=standard"}));
    EXPECT_THROW(io::parse_scene(bare, "p", std::vector<std::string>{"accuracy.preset=exact"}), BadInput);
    EXPECT_EQ(io::parse_scene(bare, "p").accuracy, scene::Accuracy{});
    EXPECT_EQ(io::parse_scene(bare, "p").space.h, scene::Space{}.h);
}

// ---- convergence ----
TEST(Convergence, FindsOrderAndLimitOfAPower)
{
    for (const double p : {0.75, 1.0, 1.5, 2.0}) {
        const auto c = converge(power(3.0, -0.2, p));
        ASSERT_TRUE(c.order) << c.why_not;
        EXPECT_NEAR(*c.order, p, 1e-9);
        EXPECT_NEAR(c.limit, 3.0, 1e-9);
        EXPECT_NEAR(c.half_width, safety * 0.2, 1e-9);
    }
    // unequal ratios, in any order
    std::vector<Sample> s;
    for (const double h : {2.0, 1.0, 5.0}) s.push_back({h, 1 + 0.3 * std::pow(h, 1.3)});
    const auto c = converge(s);
    ASSERT_TRUE(c.order);
    EXPECT_NEAR(*c.order, 1.3, 1e-9);
    EXPECT_NEAR(c.limit, 1.0, 1e-9);
}
TEST(Convergence, AFasterFallThanTheMethodsIsNotBelieved)
{
    const auto c = converge(power(3.0, 0.2, 5));
    ASSERT_TRUE(c.order);
    EXPECT_NEAR(*c.order, 5, 1e-6);
    EXPECT_NEAR(c.half_width, safety * (0.2 * 31) / 3, 1e-9); // as if of second order
}
TEST(Convergence, SaysWhereThereIsNone)
{
    const auto none = [](double a, double b, double c) { return converge({{4, a}, {2, b}, {1, c}}); };
    EXPECT_THAT(none(1, 2, 1.5).why_not, HasSubstr("not monotone")); // swings
    EXPECT_THAT(none(1, 1, 1.5).why_not, HasSubstr("not monotone"));
    EXPECT_THAT(none(1, 2, 4).why_not, HasSubstr("hardly fall")); // runs away
    EXPECT_THAT(none(1, 2, 3).why_not, HasSubstr("hardly fall")); // of order 0
    for (const auto& c : {none(1, 2, 1.5), none(1, 2, 4)}) EXPECT_FALSE(c.order);
    EXPECT_THAT(converge({{1, 1}, {2, 2}}).why_not, HasSubstr("three resolutions"));
    EXPECT_EQ(none(2, 2, 2).half_width, 0);
}
TEST(Pareto, KeepsWhatNothingBeats)
{
    const std::vector<Price> p{{1, 9}, {2, 5}, {3, 6}, {4, 5}, {5, 1}, {2, 7}, {6, std::nan("")}};
    EXPECT_THAT(pareto_front(p), ElementsAre(0u, 1u, 4u));
    EXPECT_THAT(pareto_front(std::vector<Price>{}), ElementsAre());
}
TEST(Pareto, CostAtAnError)
{
    const std::vector<Price> p{{1, 0.1}, {100, 0.001}};
    EXPECT_NEAR(*cost_at(p, 0.01), 10, 1e-9);
    EXPECT_FALSE(cost_at(p, 1e-4));
    EXPECT_EQ(*cost_at(p, 0.5), 1);
}

// ---- heaps ----
TEST(Heap, ABlockIsItsOwnProfileAtEverySpacing)
{
    for (const double spacing : {0.1, 0.05}) {
        const auto s = block(spacing);
        auto soil = filled(s);
        const auto still = measure_profile(s, soil, 0.2);
        EXPECT_EQ(still.spread, Spread::Plane);
        EXPECT_NEAR(still.top, 0.8, 1e-9);
        EXPECT_NEAR(still(0.4), 0.8, 1e-9);
        EXPECT_NEAR(still.runout(0.1), 0, 1e-9); // it stands between walls as far as anyone can see
        // Moved to both sides: the volume stays, the front goes with it.
        for (auto& x : soil.position) x.x = 0.4 + (x.x - 0.4) * 2;
        const auto flat = measure_profile(s, soil, 0.2);
        EXPECT_NEAR(flat(0.4), 0.4, 0.01);
        EXPECT_NEAR(flat.runout(0.2), 0.4, 0.5 * spacing);
        double volume = 0;
        for (std::size_t k = 1; k < flat.at.size(); ++k)
            volume += 0.5 * (flat.height[k] + flat.height[k - 1]) * (flat.at[k] - flat.at[k - 1]);
        EXPECT_NEAR(volume, 0.64, 1e-3);
        EXPECT_NEAR(profile_distance(flat, flat), 0, 1e-12);
        EXPECT_GT(profile_distance(still, flat), 0.5);
    }
}
TEST(Heap, CylindersSpreadFromTheirAxisAndCubesAlongX)
{
    const auto c = block(0.05, "[[body]]\nsoil = \"s\"\ncylinder = { base = [0.3, 0.2, 0], radius = 0.5, height = 0.4 }\n", 3);
    const auto profile = measure_profile(c, filled(c), 0.1);
    EXPECT_EQ(profile.spread, Spread::Radial);
    EXPECT_NEAR(profile(0.25), 0.4, 0.02);
    EXPECT_NEAR(profile.runout(0.1), 0, 0.05);
    const auto b = block(0.1, "", 3);
    const auto cube = measure_profile(b, filled(b), 0.2);
    EXPECT_EQ(cube.spread, Spread::Band);
    EXPECT_NEAR(cube(0.4), 0.8, 1e-9);
}
TEST(Heap, FailureLineSeparatesWhatMoved)
{
    const auto s = block(0.1);
    auto soil = filled(s);
    for (std::size_t i = 0; i < soil.position.size(); ++i)
        if (soil.position[i].x + soil.position[i].z > 0.8) soil.displacement[i].x = 0.2, soil.position[i].x += 0.2;
    const auto line = failure_line(soil, 0.1, 0.01);
    ASSERT_FALSE(line.empty());
    for (const auto& [x, z] : line) EXPECT_NEAR(x + z, 0.8, 0.11);
}

// ---- twins ----
TEST(Twins, BoxesKeepWholeSpacingsAndWallsTheirThickness)
{
    const auto s = block(0.1, "[[body]]\nsoil = \"s\"\nbox = { low = [0, 0, 0], high = [0.8, 0, 0.8] }\n[[wall]]\nbox = { low = [-0.4, 0, "
                              "-0.4], high = [2.0, 0, 0] }\n");
    for (const int factor : twin_factors) {
        const auto t = coarsened(s, factor);
        EXPECT_DOUBLE_EQ(t.scene.space.spacing, 0.1 * factor);
        EXPECT_TRUE(t.notes.empty()) << t.notes.front();
        EXPECT_NEAR(t.soil_volume, 1, 1e-12);
        const auto& wall = std::get<scene::Box>(t.scene.walls[0].shape);
        EXPECT_DOUBLE_EQ(wall.high.z, 0);
        EXPECT_LE(wall.low.z, -2 * s.space.h * 0.1 * factor);
        EXPECT_EQ(scene::Filling(t.scene).soil_count(), 64 / (factor * factor));
    }
}
TEST(Twins, SayWhereBodiesDoNotFit)
{
    const auto odd = block(0.1, "[[body]]\nsoil = \"s\"\nbox = { low = [0, 0, 0], high = [0.9, 0, 0.7] }\n");
    const auto t = coarsened(odd, 2);
    ASSERT_EQ(t.notes.size(), 2u);
    EXPECT_THAT(t.notes[0], HasSubstr("faces were moved by up to 0.1 m"));
    EXPECT_THAT(t.notes[1], HasSubstr("% of soil"));
    const auto thin = block(0.1, "[[body]]\nsoil = \"s\"\nbox = { low = [0, 0, 0], high = [0.8, 0, 0.1] }\n");
    EXPECT_THROW(coarsened(thin, 4), BadInput);
}
TEST(Twins, AFixedStepGrowsWithTheSpacing)
{
    auto s = block(0.1);
    s.time.step = 1e-4;
    EXPECT_DOUBLE_EQ(*coarsened(s, 4).scene.time.step, 4e-4);
}

// ---- the dial ----
namespace {
const std::string table_text = R"([
{"scene": "cube", "measure": "profile", "preset": "standard", "about": {"dimensions": 3, "slenderness": 2, "friction_angle": 25, "cohesion": 0},
 "points": [[8, 0.16], [16, 0.08], [32, 0.04]]},
{"scene": "cube", "measure": "profile", "preset": "fast", "about": {"dimensions": 3, "slenderness": 2, "friction_angle": 25, "cohesion": 0},
 "points": [[8, 0.2], [16, 0.15], [32, 0.12]]},
{"scene": "bars", "measure": "profile", "preset": "standard", "about": {"dimensions": 2, "slenderness": 1, "friction_angle": 20, "cohesion": 0},
 "points": [[10, 0.05], [20, 0.025]]}])";
}
TEST(Dial, ReadsErrorsAndLayersOffACurve)
{
    const auto table = read_measured(table_text);
    ASSERT_EQ(table.size(), 3u);
    EXPECT_NEAR(error_at(table[0], 16), 0.08, 1e-12);
    EXPECT_NEAR(error_at(table[0], 20), 0.064, 1e-9); // of first order
    EXPECT_NEAR(error_at(table[0], 64), 0.02, 1e-9);  // beyond, with the same slope
    EXPECT_NEAR(error_at(table[0], 4), 0.32, 1e-9);
    EXPECT_NEAR(layers_for(table[0], 0.05), 25.6, 1e-3);
    EXPECT_NEAR(layers_for(table[1], 0.06), 32 * 4, 1e-3); // slower than an order of 0.5 is taken as 0.5
    EXPECT_THROW(read_measured("[{]"), Broken);
}
TEST(Dial, ProposesTheCheapestThatReachesTheError)
{
    const auto scene = block(0.1, "", 3);
    const auto cost = [](const scene::CheckedScene& r) {
        return std::pow(r.scene.space.spacing, -4) * (r.scene.accuracy.preset == scene::Preset::Fast ? 0.01 : 1);
    };
    const auto coarse = propose(scene, 0.15, read_measured(table_text), cost);
    EXPECT_EQ(coarse.preset, "fast");
    const auto fine = propose(scene, 0.05, read_measured(table_text), cost);
    EXPECT_EQ(fine.preset, "standard"); // fast would need far more layers
    EXPECT_LE(fine.expected, 0.05);
    EXPECT_LE(fine.low, fine.expected);
    EXPECT_GE(fine.high, fine.expected);
    EXPECT_LE(fine.checked->scene.space.spacing, 0.8 / 25.6);
    EXPECT_TRUE(scene::Filling::problems(fine.checked->scene).empty());
    EXPECT_EQ(fine.nearest, "cube");
    EXPECT_LT(fine.distance, 0.1);
    EXPECT_THAT(to_text(fine, 0.05, 12), HasSubstr("preset = \"standard\""));
    // Another kind of scene is told from this one.
    std::string why;
    EXPECT_GE(distance(likeness(block(0.1)), read_measured(table_text)[0].about, &why), 1);
    EXPECT_THAT(why, HasSubstr("2-D, not 3-D"));
    EXPECT_THROW(propose(scene, 0.05, {}, cost), BadInput);
}
// What a study writes about its scene is what the dial compares scenes by, in the same units: a scene is no distance from itself.
TEST(Dial, TakesAScenesOwnStudyForItsLike)
{
    Study study;
    study.points.emplace_back();
    auto& p = study.points.back();
    p.scene = block(0.1);
    p.scene->soils[0].cohesion = 5e3; // Pa; the weight of the height is 14.5 kPa
    p.spacing = 0.1;
    const auto about = to_json(study)["about"];
    EXPECT_NEAR(about["cohesion"].get<double>(), 5e3 / (1850 * 9.81 * 0.8), 1e-9);
    EXPECT_NEAR(about["height"].get<double>(), 0.8, 1e-9);
    const std::string curve = fmt::format(
        R"([{{"scene": "own", "measure": "profile", "preset": "fast", "about": {}, "points": [[8, 0.2], [16, 0.1]]}}])", about.dump());
    EXPECT_NEAR(distance(likeness(*p.scene), read_measured(curve)[0].about), 0, 1e-9);
}
TEST(Dial, AStepIsPricedByThePassesOfItsScheme)
{
    // The same soil and the same steps: only what a step does with them differs.
    const auto estimated = [](scene::Scheme scheme, scene::Precision precision) {
        Scene s = block(0.1, "", 3);
        s.time.step = 1e-4;
        s.accuracy.scheme = scheme, s.accuracy.precision = precision;
        return estimate(s, scene::Filling(s), *choose_model(s, Arithmetic::Simd));
    };
    const auto one = estimated(scene::Scheme::LeapFrog, scene::Precision::Double);
    const auto two = estimated(scene::Scheme::Staggered, scene::Precision::Double);
    EXPECT_EQ(one.pairs, two.pairs);
    EXPECT_EQ(step_price(scene::Scheme::LeapFrog), 1);
    EXPECT_GT(work(one), one.pairs) << "updates of particles count too";
    // Twice over the pairs, once over the neighbours' distances: dearer, but not twice as dear.
    EXPECT_NEAR(work(two) / work(one), step_price(scene::Scheme::Staggered), 1e-12);
    EXPECT_GT(step_price(scene::Scheme::Staggered), 1.1);
    EXPECT_LT(step_price(scene::Scheme::Staggered), 2);
    EXPECT_LT(work(estimated(scene::Scheme::Staggered, scene::Precision::Mixed)), work(two));
    // What a run is priced at goes with its steps: thirteen times as many of the cheap ones cost more than the dear ones.
    auto often = one, seldom = two;
    often.steps *= 13, often.pairs *= 13;
    EXPECT_GT(work(often), 8 * work(seldom));
}
TEST(Dial, TheBuiltInTableHoldsTogether)
{
    std::set<std::string> known;
    for (const auto& p : io::presets()) known.insert(p.name);
    for (const auto& c : measured()) {
        EXPECT_TRUE(known.contains(c.preset));
        for (const auto& p : c.points) EXPECT_GT(p.error, 0);
    }
    EXPECT_FALSE(measured().empty());
}
TEST(Dial, WantedErrors)
{
    EXPECT_NEAR(parse_accuracy("5%"), 0.05, 1e-12);
    EXPECT_NEAR(parse_accuracy("0.5 %"), 0.005, 1e-12);
    EXPECT_NEAR(parse_accuracy("0.1"), 0.1, 1e-12);
    for (const char* bad : {"", "x", "5%%", "0", "-1%", "90%", "5 percent"}) EXPECT_THROW(parse_accuracy(bad), BadInput) << bad;
}
